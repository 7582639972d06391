"""Results of the steps of a run: their sum, their part of the summary, and natural modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fsm.analyses.analysis import Analysis
from fsm.analyses.run_step import RunStep, StepResult
from fsm.results.curve import ForceCurve
from fsm.results.quantities import peaks
from fsm.results.solution import Solution
from fsm.results.step_data import StepModes
from fsm.solve.interface.system import System
from fsm.solve.outcome.run_io import CurvePoint, Statistics
from fsm.solve.outcome.status import Event, Outcome

_SUMMED = (
    "steps", "force_evaluations", "jacobian_evaluations", "factorisations", "newton_iterations", "wall_time", "rejected",
)  # fmt: skip
_SMALL = 1e-6
"""Amplitude of a mode shape in results, relative to the size of the structure; small, so that it is linear."""


def counted(statistics: Statistics) -> dict[str, Any]:
    """Counters of a solve."""
    return {name: getattr(statistics, name) for name in (*_SUMMED, "smallest_step")}


def total_of(done: Sequence[StepResult], points: list[CurvePoint]) -> Statistics:
    """Counters and events of all steps that were solved; methods are in the order of their use."""
    solved = [result for result in done if result.counters]
    total = Statistics(" + ".join(dict.fromkeys(result.method for result in solved)) or done[-1].method, points=points)
    for result in solved:
        for name in _SUMMED:
            setattr(total, name, getattr(total, name) + result.counters[name])
        total.smallest_step = min(total.smallest_step, result.counters["smallest_step"])
        total.events += [Event(**event) for event in result.events]
    total.outcome = Outcome.FINISHED
    return total


def step_summaries(done: Sequence[StepResult], points: list[CurvePoint], solution: Solution) -> list[dict[str, Any]]:
    """One dict for every step: name, kind, times, peak of the first drive that has a force, loads, steps and iterations."""
    found, first = [], 0
    for number, result in enumerate(done, 1):
        part, first = points[first : result.n_points], result.n_points
        one: dict[str, Any] = {
            "name": result.name,
            "kind": result.kind,
            "method": result.method,
            "start_time": result.start,
            "end_time": result.end,
            "steps": result.counters.get("steps", 0),
            "newton_iterations": result.counters.get("newton_iterations", 0),
            "records": int((solution.step == number).sum()),
            "events": len(result.events),
        }
        if part and len(part[0].drive.force):
            forces = np.array([point.drive.force for point in part])
            drive = int(np.argmax(np.abs(forces).max(axis=0) > 0.0))
            whole = ForceCurve.from_points(part)
            curve = replace(whole, travel=whole.travel[:, [drive]], force=whole.force[:, [drive]])
            one["drive"] = solution.layout.drive_names[drive]
            one["peak_force"], one["peak_travel"] = peaks(curve).largest
            one["peak_kind"] = "quasi-static" if curve.has_quasi_static else "dynamic"
            one["final_force"] = float(forces[-1, drive])
            one["final_travel"] = float(part[-1].drive.travel[drive])
        if result.loads:
            one["loads"] = {
                name: {"size": size, "displacement": moved} for name, (size, moved) in result.loads.items()
            }
        if result.path and result.method == "arc-length":
            one["limit_points"] = limit_points(result.path)
        if result.frequencies:
            one["frequencies_hz"] = result.frequencies
        found.append(one)
    return found


def final_loads(done: Sequence[StepResult]) -> list[dict[str, Any]]:
    """Name, size and displacement of every load at the end of the last step with loads."""
    loads = next((result.loads for result in reversed(done) if result.loads), {})
    return [{"name": name, "size": size, "displacement": moved} for name, (size, moved) in loads.items()]


def limit_points(path: dict[str, Any]) -> list[dict[str, Any]]:
    """Points of an arc-length path at which the loads have an extremum.

    Returns
    -------
    list of dict
        Program time, negative modes beyond the point, and size and displacement of every load. Each point is the vertex of a
        parabola through three points of the path.
    """
    time, length = np.array(path["time"]), np.array(path["length"])
    found = []
    for k in np.flatnonzero(np.diff(np.sign(np.diff(time))) != 0.0) + 1:
        near = slice(k - 1, k + 2)
        weights = _at_vertex(length[near], time[near])
        found.append({
            "program_time": float(weights @ time[near]),
            "negative_modes": int(path["negative_modes"][k + 1]),
            "loads": {
                name: dict(zip(("size", "displacement"), (weights @ np.array(rows[near])).tolist(), strict=True))
                for name, rows in path["loads"].items()
            },
        })  # fmt: skip
    return found


def _at_vertex(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Weights (3,) of three points for values at the vertex of the parabola y(x) through them."""
    slopes = np.diff(y) / np.diff(x)
    curvature = (slopes[1] - slopes[0]) / (x[2] - x[0])
    at = min(max(0.5 * (x[0] + x[1]) - 0.5 * slopes[0] / curvature, x[0]), x[2]) if curvature else x[1]
    return np.array([
        np.prod([(at - x[j]) / (x[i] - x[j]) for j in range(3) if j != i]) for i in range(3)
    ])  # fmt: skip


def step_modes(analysis: Analysis, system: System, step: RunStep, number: int, q: np.ndarray) -> StepModes:
    """Natural modes about a state."""
    from fsm.solve.equations.newton import held_still
    from fsm.solve.modal import modes  # this import loads large parts of SciPy

    q = held_still(system, step.start, q)
    found = modes(system, step.start, q, step.modes)
    here = system.shape(step.start, q)
    shapes, increments = [], []
    for shape in found.shapes:
        largest = float(np.abs(shape / system.scales().span).max(initial=0.0)) or 1.0
        moved = system.shape(step.start, system.retract(q, shape * (_SMALL / largest))) - here
        largest_move = float(np.abs(moved).max(initial=0.0))
        shapes.append(moved / largest_move if largest_move else moved)
        _, increment = analysis.whole(system, step.start, q, shape)
        increments.append(increment / (float(np.abs(increment).max(initial=0.0)) or 1.0))
    count = len(found.squared)
    return StepModes(
        np.full(count, number + 1, dtype=np.int64),
        found.frequencies,
        np.array(shapes).reshape(count, *here.shape),
        np.array(increments).reshape(count, -1),
    )
