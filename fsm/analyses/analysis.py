"""Protocol of an analysis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from fsm.analyses.comparison import Comparison, Statement
from fsm.analyses.run_step import RunStep, States
from fsm.model.plan.in_python import of_compiler
from fsm.results.array import ArrayMotion
from fsm.results.solution import Layout, Solution
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, SavedState, Statistics
from fsm.solve.settings import PathSettings, Settings

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
