"""What a kind of analysis owes the one way from a case to its results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from fsm.results.array import ArrayMotion
from fsm.results.solution import Layout, Solution
from fsm.solve.handed_over import Saved, Statistics, StepEnd
from fsm.solve.ledger import Ledger
from fsm.solve.settings import Settings
from fsm.solve.static import PathSettings
from fsm.system import System

__all__ = ["Analysis", "Solver"]


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

    def method(self) -> tuple[str, str]:
        """What solves it, and why."""
        ...

    def settings(self, method: str) -> Settings | PathSettings:
        """How it is solved, and until when."""
        ...

    def record_times(self, end: float) -> list[float]:
        """When whole states are kept, s."""
        ...

    def sample_times(self, end: float) -> list[float]:
        """When probes are sampled, s."""
        ...

    def start(self, warnings: list[str]) -> tuple[float, np.ndarray, np.ndarray]:
        """Time, configuration and velocity that the solve starts from."""
        ...

    def layout(self) -> Layout:
        """What does not change; the recorder adds the case and where it comes from."""
        ...

    def probes(self, q: np.ndarray) -> np.ndarray:
        """Displacement of every probe, (n_probes, 3), m."""
        ...

    def unstable_ways(self, t: float, q: np.ndarray) -> int:
        """Negative pivots of the stiffness where they mean something, else 0."""
        ...

    def array_motion(self, solution: Solution, warnings: list[str]) -> ArrayMotion | None:
        """Of a scissor array, how its points move and its bars are stressed; None of anything else."""
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
