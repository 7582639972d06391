"""Loads and their displacements in a step, from its records: along a static step, and at the end of any step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fsm.model.system.system import SegmentSystem
from fsm.results.solution import Solution
from fsm.solve.outcome.run_io import CurvePoint


def static_load_path(
    system: SegmentSystem, whole: SegmentSystem, solution: Solution, number: int, points: Sequence[CurvePoint]
) -> dict[str, Any]:
    """Program time, negative modes, and size and displacement of every load at the equilibria that a static step has saved.

    Parameters
    ----------
    system, whole : system of the step, and of all steps
    solution : records so far
    number : number of the step, from 1
    points : points of the curve of the step; they show which states are equilibria and which belong to a snap

    Returns
    -------
    dict
        Arrays as in `fsm.solve.statics.arc_run.ArcRun.loads`; the dict is empty if no load changes in the step.
    """
    records = np.flatnonzero(solution.step == number)
    moving = {point.time for point in points if point.path % 2}
    records = records[[float(t) not in moving for t in solution.time[records]]]
    if not len(records):
        return {}
    first = _state(system, whole, solution, _origin(solution, number))
    ways: dict[str, list[list[float]]] = {}
    for record in records.tolist():
        here = _state(system, whole, solution, record)
        for name, pair in system.load_displacements(first, here).items():
            ways.setdefault(name, []).append(list(pair))
    if all(len({size for size, _ in rows}) == 1 for rows in ways.values()):
        return {}
    negative = [int(count) for count in solution.negative_pivots[records]]
    return {"time": solution.time[records].tolist(), "negative_modes": negative, "loads": ways}


def loads_at_end(
    system: SegmentSystem, whole: SegmentSystem, solution: Solution, number: int, end: tuple[float, np.ndarray]
) -> dict[str, tuple[float, float]]:
    """Size and displacement of every load at the end of a step; see `SegmentSystem.load_displacements`.

    Parameters
    ----------
    system, whole, solution, number : see `static_load_path`
    end : time (s) and configuration at the end of the step
    """
    if not np.any(solution.step <= number):
        return {}
    return system.load_displacements(_state(system, whole, solution, _origin(solution, number)), end)


def loads_at(
    system: SegmentSystem, whole: SegmentSystem, solution: Solution, number: int, time: float
) -> dict[str, tuple[float, float]]:
    """Size of every load at a time (s) of a step, and its displacement at the last record until then; empty without one.

    `system`, `whole`, `solution` and `number` are those of `static_load_path`.
    """
    record = int(np.searchsorted(solution.time[solution.step <= number], time, side="right")) - 1
    if record < 0:
        return {}
    first = _state(system, whole, solution, _origin(solution, number))
    return system.load_displacements(first, (time, _state(system, whole, solution, record)[1]))


def _origin(solution: Solution, number: int) -> int:
    """Record at the start of a step: the last record of the previous steps, or the first record of the run."""
    return max(int(np.searchsorted(solution.step, number)) - 1, 0)


def _state(system: SegmentSystem, whole: SegmentSystem, solution: Solution, record: int) -> tuple[float, np.ndarray]:
    """Time of a record, and its configuration in the system of the step."""
    t, q = float(solution.time[record]), solution.q[record]
    if system is not whole:
        q, _ = system.from_states(whole.all_states(t, q, np.zeros(whole.nu)))
    return t, q
