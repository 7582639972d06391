"""Methods of time integration; one kernel computes the steps of systems with arrays, and Python computes the steps of all
other systems.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cache, cached_property
from typing import Any, ClassVar, cast

import numpy as np

from fsm.solve.restart_points import State
from fsm.solve.status import StepFailed
from fsm.solve.system_model import SystemModel
from fsm.stepping import generalized_alpha as stepping
from fsm.stepping.model import DRIVES, ArrayModel
from fsm.stepping.outcomes import OBJECTED, STEPPED, UNABLE
from fsm.system import ArraySystem, System

__all__ = ["StepMethod"]


@cache
def _has_arrays(kind: type) -> bool:
    """Whether systems of this class are `ArraySystem`; cached, since the check is slow."""
    return issubclass(kind, ArraySystem)


class StepMethod(ABC):
    """Method of time integration, step by step or many steps at a time.

    Attributes
    ----------
    system : System
    model : SystemModel
    motion, rules : state and rules of the method
    controlled : bool
        Whether the error is controlled.
    pair_energy : (2, n_pairs) array, J
        Energy that friction and damping of contact pairs dissipated in the last `march`.
    """

    motion: Any
    rules: Any
    in_python: ClassVar[Any]
    in_kernel: ClassVar[Any]
    """Functions with the arguments of `fsm.stepping.march.march`, for any model and for compiled models."""

    def __init__(self, system: System, model: SystemModel, controlled: bool) -> None:
        self.system, self.model, self.controlled = system, model, controlled
        self.pair_energy = np.zeros((2, 0))

    @property
    def t(self) -> float:
        """Present time, s."""
        return float(self.motion.sizes[stepping.TIME])

    @property
    def steps(self) -> int:
        """Steps done."""
        return self._count(stepping.STEPS)

    @property
    def rejected(self) -> int:
        """Steps repeated because of their error."""
        return self._count(stepping.REJECTED)

    @property
    def failed(self) -> int:
        """Steps repeated because their equations were not solved, or a fixed step did not conserve the energy."""
        return self._count(stepping.FAILED)

    @property
    def iterations(self) -> int:
        """Iterations of Newton's method."""
        return self._count(stepping.ITERATIONS)

    @property
    def force_evaluations(self) -> int:
        """Evaluations of the force without tangents."""
        return self._count(stepping.FORCES)

    @property
    def linearisations(self) -> int:
        """Evaluations of the force with tangents; the mean-force method evaluates them at both points of a step."""
        return self._count(stepping.LINEARISATIONS)

    @property
    @abstractmethod
    def factorisations(self) -> int:
        """Factorisations of matrices."""

    @abstractmethod
    def step(self, until: float) -> None:
        """Take one step that ends at `until` or before."""

    @abstractmethod
    def state(self) -> State:
        """State of the method for a restart, besides time, q and u."""

    @abstractmethod
    def resume(self, state: State) -> None:
        """Continue from a restart point (see `state`)."""

    @property
    def q(self) -> np.ndarray:
        """Present configuration, (nq,)."""
        return np.asarray(self.motion.q)

    @property
    def u(self) -> np.ndarray:
        """Present velocity, (nu,)."""
        return np.asarray(self.motion.u)

    @abstractmethod
    def _without_factors(self) -> None:
        """Discard tangent and factors, so that the next step computes them again."""

    @abstractmethod
    def _failure(self, outcome: int) -> StepFailed:
        """Error of a step that failed."""

    def _count(self, number: int) -> int:
        return int(self.motion.counts[number])

    def march(self, balance: np.ndarray, until: float, most: int, every: bool = False) -> np.ndarray:
        """Take at most `most` steps up to `until` in one kernel; see `fsm.stepping.march`.

        Returns records (m, k) of all steps if `every`, else of the last step only.

        Raises
        ------
        StepFailed
            As `step`.
        """
        if self._arrays is None:
            raise ValueError("this system has no arrays")
        self.motion = self.motion._replace(q=self.motion.q.copy(), u=self.motion.u.copy())
        records, begun, system = self.records(most if every else 1), self.steps, self.system
        system.to_arrays(self.controlled)
        outcome = self._march(balance, until, most, records)
        while outcome == UNABLE and system.lacks_arrays():
            self._arrays = cast(ArraySystem, system).arrays(self.model.linear.ready)
            self._without_factors()
            left = most - (self.steps - begun)
            own = records[self.steps - begun :] if every else records
            outcome = self._march(balance, until, left, own)
        self.pair_energy = system.from_arrays()
        if outcome in (UNABLE, OBJECTED):
            # take one step in Python, where SciPy solves the linear equations and the reason of a rejection is
            # available
            self._arrays.arrays.flags[-1] = 0
            self._without_factors()
            own, self.model.pair_energy = records[self.steps - begun :] if every else records, self.pair_energy
            outcome = self.in_python(self.model, self.motion, self.rules, balance, until, 1, own)
            self.pair_energy = self.model.pair_energy
            self._without_factors()
        if outcome != STEPPED:
            raise self._failure(outcome)
        return records[: self.steps - begun]

    def records(self, count: int) -> np.ndarray:
        """Records of `count` steps, filled with zeros."""
        return np.zeros((count, self.recorded + len(self.q) + len(self.u)))

    def _march(self, balance: np.ndarray, until: float, most: int, records: np.ndarray) -> int:
        assert self._arrays is not None
        arguments = self._arrays, self.motion, self.rules, balance, float(until), int(most), records
        outcome: int = self._arrays.calls.force.entry(self.in_kernel, *arguments)(*arguments)
        return outcome

    @cached_property
    def recorded(self) -> int:
        """Number of values in a record before the state."""
        observed = self.system.observe(self.t, self.q, self.u)
        return DRIVES + 2 * len(observed.drive.travel) + len(observed.pairs.force)

    @cached_property
    def _arrays(self) -> ArrayModel | None:
        """Arrays of the system; they are created at the first use, because their kernels may have to be compiled."""
        if not _has_arrays(type(self.system)):
            return None
        model: ArrayModel | None = cast(ArraySystem, self.system).arrays(self.model.linear.ready)
        return model

    @property
    def marches(self) -> bool:
        """Whether the system has arrays."""
        return self._arrays is not None

