"""Protocol of an analysis.

Results of the steps of a run: their sum, their part of the summary, and natural modes.

Steps of a run, for all analyses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from fsm.analyses.comparison import Comparison, Statement
from fsm.case.models.solve import Kind
from fsm.model.plan.in_python import of_compiler
from fsm.results.array import ArrayMotion
from fsm.results.curve import ForceCurve
from fsm.results.quantities import summarise_drive
from fsm.results.solution import Layout, Solution
from fsm.results.step_data import StepModes
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, CurvePoint, SavedState, Statistics
from fsm.solve.outcome.status import Event, Outcome
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.statics.arc_length import ArcSettings

States = dict[str, np.ndarray]
"""Poses, rates, nodes and memory at the end of a step, from which the next step begins."""


@dataclass(frozen=True)
class RunStep:
    """Step of a run.

    Attributes
    ----------
    name, kind : see `fsm.case.models.solve.Step`
    start, end : s
    method, reason : method of the solver, and the reason
    settings : settings of the solver; None if nothing is solved
    record_times, sample_times : times of records and of samples of probes, s
    modes : number of natural modes
    """

    name: str
    kind: Kind
    start: float
    end: float
    method: str
    reason: str
    settings: Settings | PathSettings | ArcSettings | None
    record_times: list[float]
    sample_times: list[float] = field(default_factory=list)
    modes: int = 0


@dataclass
class StepResult:
    """Result of a step, for the summary and for a restart.

    Attributes
    ----------
    name, kind, method, start, end : see `RunStep`
    counters : counters of the solver
    n_points : number of points of the curve at the end of the step
    events, frequencies : events, and natural frequencies in Hz
    path : program time, stability and loads at all points of a path by arc length (`fsm.solve.statics.arc_run`)
    loads : size of every load at the end, and displacement of its point along the load since the start of the step
    """

    name: str
    kind: str
    method: str
    start: float
    end: float
    counters: dict[str, Any]
    n_points: int
    events: list[dict[str, Any]] = field(default_factory=list)
    frequencies: list[float] = field(default_factory=list)
    path: dict[str, Any] = field(default_factory=dict)
    loads: dict[str, tuple[float, float]] = field(default_factory=dict)


MODAL = "modal"
"""Name of the method of a reduced model."""

StatedErrors = dict[str, Statement | Comparison]

Watch = Callable[[str, float], Callable[[AcceptedStep], None]]
"""Function of the name and end time (s) of a further solve; returns a function to call after each of its steps."""


class Solver(Protocol):
    """Solver that reports states at requested times; `fsm.solve.simulate.simulate` describes the arguments."""

    def __call__(
        self,
        end: float,
        times: Sequence[float],
        on_save: Callable[[SavedState], None],
        on_step: Callable[[AcceptedStep], None],
        energy_balance: EnergyBalance,
    ) -> Statistics:
        """Solve."""
        ...


class Analysis(Protocol):
    """Compiled case of one kind of analysis: its system, and the methods that differ between kinds.

    Analyses derive from this class. The default methods are for analyses without probes, bars and a special solver.
    """

    system: System
    """System for the solvers; for a film it exists after `initialise`."""

    @property
    def kernels(self) -> tuple[str, ...]:
        """Names of the required kernels in `fsm.run.warm_up.KINDS`."""
        ...

    def initialise(self, warnings: list[str]) -> None:
        """Prepare the solve and check the case; at this time no results have been written.

        Raises
        ------
        CaseError
        """
        return

    def steps(self) -> list[RunStep]:
        """Steps of the run, in order; each step has its method and its times."""
        ...

    def cut(self, number: int, time: float) -> None:
        """Let a step (number from 0) end at a time (s), at which an event has ended it; later steps begin earlier."""
        return

    def enter(self, number: int, states: States | None) -> System:
        """System of a step (number from 0); `states` are the states at the end of the previous step, None for the first
        step.
        """
        ...

    def begin(self, number: int, system: System, states: States | None) -> tuple[np.ndarray, np.ndarray]:
        """Configuration and velocity at the start of a step."""
        ...

    def leave(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> States:
        """States at the end of a step, from which the next step begins."""
        ...

    def whole(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Configuration and velocity of the whole system in a state of the system of a step."""
        ...

    def layout(self) -> Layout:
        """Constant data of the results; the recorder adds the case and its source."""
        ...

    def probes(self, q: np.ndarray) -> np.ndarray:
        """Displacement of every probe, (n_probes, 3), m."""
        return np.zeros((0, 3))

    def negative_pivots(self, system: System, t: float, q: np.ndarray) -> int:
        """Number of negative pivots of the stiffness if the analysis follows equilibria, else 0."""
        return 0

    def array_motion(self, solution: Solution, warnings: list[str], watch: Watch | None = None) -> ArrayMotion | None:
        """Motion of points and stress of bars of a scissor array; None for other analyses.

        `watch` receives the progress of further solves.
        """
        return None

    def stated_errors(self, solution: Solution, statistics: Statistics, summary: dict[str, Any]) -> StatedErrors:
        """Errors of the summary by their causes, "mesh" and "steps": a statement, or further runs that find it."""
        ...

    def coarsen(self, factor: float, records: int) -> None:
        """Multiply the steps that resolve impacts by a factor, and keep one of so many records, for a further run."""
        return

    def in_python(self) -> tuple[str, ...]:
        """Reasons why steps of the solver are computed in Python; empty for compiled steps."""
        ...

    def own_solver(self) -> Solver | None:
        """Special solver of this analysis; None for the common solvers."""
        return None

    def summarise(self, solution: Solution, statistics: Statistics) -> dict[str, Any]:
        """Part of the summary that depends on the analysis."""
        ...

    def warnings(self, solution: Solution, summary: dict[str, Any]) -> list[str]:
        """Warnings about the result."""
        ...


class OneStep(Analysis, Protocol):
    """Analysis of one step, from time zero on."""

    step_name: str

    def method(self) -> tuple[str, str]:
        """Method of the solver, and the reason."""
        ...

    def settings(self, method: str) -> Settings | PathSettings:
        """Settings of the solver."""
        ...

    def record_times(self, end: float) -> list[float]:
        """Times of records, s."""
        ...

    def sample_times(self, end: float) -> list[float]:
        """Times of samples of probes, s."""
        ...

    def steps(self) -> list[RunStep]:
        """See `Analysis`."""
        method, reason = self.method()
        settings = self.settings(method)
        end = settings.end_time
        times = self.record_times(end), self.sample_times(end)
        return [RunStep(self.step_name, "dynamic", 0.0, end, method, reason, settings, *times)]

    def in_python(self) -> tuple[str, ...]:
        """See `Analysis`."""
        method, own = self.method()[0], getattr(self.system, "in_python", of_compiler())
        return () if method == MODAL else own.of(method)

    def enter(self, number: int, states: States | None) -> System:
        """See `Analysis`."""
        return self.system

    def begin(self, number: int, system: System, states: States | None) -> tuple[np.ndarray, np.ndarray]:
        """See `Analysis`."""
        return system.initial()

    def leave(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> States:
        """See `Analysis`; no step follows the only step."""
        return {}

    def whole(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Analysis`."""
        return q, u


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
            curve = ForceCurve.from_points(part)
            drive = int(np.argmax(np.abs(curve.force).max(axis=0) > 0.0))
            one |= {"drive": solution.layout.drive_names[drive]} | summarise_drive(curve, drive)
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
