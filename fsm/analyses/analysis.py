"""What a kind of analysis owes the one way from a case to its results."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from fsm.analyses.run_step import RunStep, States
from fsm.results.array import ArrayMotion
from fsm.results.solution import Layout, Solution
from fsm.solve.handed_over import Saved, Statistics, StepEnd
from fsm.solve.ledger import Ledger
from fsm.solve.settings import Settings
from fsm.solve.static import PathSettings
from fsm.system import System

__all__ = ["Analysis", "OneStep", "Solver", "Watch"]

Watch = Callable[[str, float], Callable[[StepEnd], None]]
"""From the name and the end time (s) of a further solve: function that is called after each of its steps."""


class Solver(Protocol):
    """Solves up to the end and hands over the states at the times that are wanted, see `fsm.solve.simulate.simulate`."""

    def __call__(
        self,
        end: float,
        times: Sequence[float],
        on_save: Callable[[Saved], None],
        on_step: Callable[[StepEnd], None],
        ledger: Ledger,
    ) -> Statistics:
        """Solve."""
        ...


class Analysis(Protocol):
    """A case of one kind, compiled: the system that is solved, and all that is not the same for every kind."""

    @property
    def system(self) -> System:
        """What the solvers get."""
        ...

    @property
    def kernels(self) -> tuple[str, ...]:
        """The kernels it needs, as `fsm.warm_up.KINDS` calls them."""
        ...

    def make_ready(self, warnings: list[str]) -> None:
        """Do what comes before the solve and may be refused; nothing has been written yet.

        Raises
        ------
        CaseError
        """
        ...

    def steps(self) -> list[RunStep]:
        """Steps of the run, in order, each with its method and times."""
        ...

    def enter(self, number: int, states: States | None) -> System:
        """System of a step (from 0), which begins where the step before ended; None for the first."""
        ...

    def begin(self, number: int, system: System, states: States | None) -> tuple[np.ndarray, np.ndarray]:
        """Configuration and velocity that a step starts from."""
        ...

    def leave(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> States:
        """What the next step begins from."""
        ...

    def whole(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Configuration and velocity of `system` of the analysis, in a state of the system of a step."""
        ...

    def layout(self) -> Layout:
        """What does not change; the recorder adds the case and where it comes from."""
        ...

    def probes(self, q: np.ndarray) -> np.ndarray:
        """Displacement of every probe, (n_probes, 3), m."""
        ...

    def unstable_ways(self, system: System, t: float, q: np.ndarray) -> int:
        """Negative pivots of the stiffness where they mean something, else 0."""
        ...

    def array_motion(self, solution: Solution, warnings: list[str], watch: Watch | None = None) -> ArrayMotion | None:
        """Of a scissor array, how its points move and its bars are stressed; None of anything else.

        Its further solves are watched.
        """
        ...

    def own_solver(self) -> Solver | None:
        """What solves it in place of the solvers of systems; None if they do."""
        ...

    def summarise(self, solution: Solution, statistics: Statistics) -> dict[str, Any]:
        """Its own part of the summary."""
        ...

    def warnings(self, solution: Solution, summary: dict[str, Any]) -> list[str]:
        """What a user should know of the result."""
        ...


class OneStep(ABC):
    """Analysis of one step, from time zero on."""

    step_name: str

    @property
    @abstractmethod
    def system(self) -> System:
        """See `Analysis`."""

    @abstractmethod
    def method(self) -> tuple[str, str]:
        """Method of the solver, and why."""

    @abstractmethod
    def settings(self, method: str) -> Settings | PathSettings:
        """Settings of the solver."""

    @abstractmethod
    def record_times(self, end: float) -> list[float]:
        """Times of records, s."""

    @abstractmethod
    def sample_times(self, end: float) -> list[float]:
        """Times of samples of probes, s."""

    def steps(self) -> list[RunStep]:
        """See `Analysis`."""
        method, reason = self.method()
        settings = self.settings(method)
        end = settings.end_time
        times = self.record_times(end), self.sample_times(end)
        return [RunStep(self.step_name, "dynamic", 0.0, end, method, reason, settings, *times)]

    def enter(self, number: int, states: States | None) -> System:
        """See `Analysis`."""
        return self.system

    def begin(self, number: int, system: System, states: States | None) -> tuple[np.ndarray, np.ndarray]:
        """See `Analysis`."""
        return system.initial()

    def leave(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> States:
        """See `Analysis`: no step follows."""
        return {}

    def whole(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Analysis`."""
        return q, u
