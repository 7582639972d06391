"""Methods of time integration; one kernel computes the steps of systems with arrays, and Python computes the steps of all
other systems.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fsm.kernels.pointers import enter
from fsm.solve.interface.records import Observation
from fsm.solve.interface.system import System
from fsm.solve.outcome.restart_points import State
from fsm.solve.outcome.status import Outcome, StepFailed
from fsm.solve.stepping import generalized_alpha as stepping
from fsm.solve.stepping.model import DRIVES, ArrayModel
from fsm.solve.stepping.outcomes import NO_SOLUTION, OBJECTED, STEPPED, UNABLE
from fsm.solve.time.system_model import SystemModel

_PATTERNS, _SHORTER = 20, 0.25
"""Largest number of patterns for one step, as far as they lack pairs of bodies, and factor on the size of this step from
the second one on."""


def _count(number: int) -> Any:
    """Property of a `StepMethod` that reads a number of `motion.counts`."""
    return property(lambda method: int(method.motion.counts[number]))


COUNTED = (
    stepping.STEPS, stepping.REJECTED, stepping.FAILED, stepping.ITERATIONS, stepping.FACTORISATIONS, stepping.FORCES,
    stepping.LINEARISATIONS,
)
"""Indices of the counters in `motion.counts`."""


class StepMethod(ABC):
    """Method of time integration, step by step or many steps at a time.

    Attributes
    ----------
    system : System
    model : SystemModel
    motion, rules : state and rules of the method; `motion.all_pairs` as `pair_energy`
    t, q, u : present state
    controlled : bool
        Whether the error is controlled.
    steps, rejected, failed, iterations, factorisations : int
        Steps taken; steps repeated because of their error; steps repeated because their equations were not solved, or a
        fixed step did not conserve the energy; iterations of Newton's method; factorisations of matrices.
    force_evaluations, linearisations : int
        Evaluations of the force without and with tangents; the mean-force method has tangents at both points of a step.
    pair_energy : (2, n_pairs) array, J
        Energy that friction and damping of contact pairs dissipated in the last `march`.
    """

    motion: Any
    rules: Any
    one_step: ClassVar[Any]
    in_python: ClassVar[Any]
    in_kernel: ClassVar[Any]
    """Functions with the arguments of `fsm.solve.stepping.generalized_alpha.take_step`, of `fsm.solve.stepping.march.march`,
    and of the latter for compiled models only."""
    following: ClassVar[int]
    """Index of the size of the next step in `motion.sizes`."""
    kept: ClassVar[tuple[str, ...]]
    """Fields of `motion` that a restart needs, besides q and u."""

    steps, rejected, failed = _count(stepping.STEPS), _count(stepping.REJECTED), _count(stepping.FAILED)
    iterations, factorisations = _count(stepping.ITERATIONS), _count(stepping.FACTORISATIONS)
    force_evaluations, linearisations = _count(stepping.FORCES), _count(stepping.LINEARISATIONS)

    def __init__(self, system: System, t: float, q: np.ndarray, motion: Any, controlled: bool) -> None:
        self.system, self.model, self.controlled, self.motion = system, SystemModel(system, q), controlled, motion
        motion.sizes[stepping.TIME], motion.counts[stepping.DIVISION] = t, 1
        self.pair_energy = np.zeros((2, 0))

    @property
    def t(self) -> float:
        """Present time, s."""
        return float(self.motion.sizes[stepping.TIME])

    @property
    def q(self) -> np.ndarray:
        """Present configuration, (nq,)."""
        return np.asarray(self.motion.q)

    @property
    def u(self) -> np.ndarray:
        """Present velocity, (nu,)."""
        return np.asarray(self.motion.u)

    @property
    @abstractmethod
    def _pace(self) -> np.ndarray:
        """Rates (nu,) relative to their scales; the body of the largest one is named if a step fails."""

    @abstractmethod
    def _without_factors(self) -> None:
        """Discard tangent and factors, so that the next step computes them again."""

    def state(self) -> State:
        """State of the method for a restart, besides time, q and u."""
        return {name: getattr(self.motion, name).copy() for name in self.kept}

    def resume(self, state: State) -> None:
        """Continue from a restart point (see `state`), with a tangent at the present state."""
        t = self.t
        for name in self.kept:
            getattr(self.motion, name)[:] = state[name]
        self.motion.sizes[stepping.TIME] = t
        self._without_factors()

    def back_to(self, t: float, q: np.ndarray, u: np.ndarray, state: State) -> None:
        """Return to an earlier state of this solver; the system has its memory of that state."""
        self.motion = self.motion._replace(q=q.copy(), u=u.copy())
        self.motion.sizes[stepping.TIME] = t
        self.resume(state)

    def observe(self) -> Observation:
        """Quantities of the present state."""
        return self.model.observe(self.t, self.q, self.u)

    def step(self, until: float) -> None:
        """Take one step that ends at `until` or before.

        Raises
        ------
        StepFailed
            Newton's method does not converge, or the error is too large, even with the smallest step.
        """
        self._begin()
        with np.errstate(all="ignore"):  # iterates may overflow before the step is rejected
            outcome = self.one_step(self.model, self.motion, self.rules, until)
        self._check(outcome)

    def march(self, balance: np.ndarray, until: float, most: int, every: bool = False) -> np.ndarray:
        """Take at most `most` steps up to `until` in one kernel, or one step in Python; see `fsm.solve.stepping.march`.

        Returns records (m, k) of all steps if `every`, else of the last step only.

        Raises
        ------
        StepFailed
            As `step`.
        """
        self._begin()
        records, begun, system, outcome = self.records(most if every else 1), self.steps, self.system, UNABLE
        self.motion.all_pairs[:] = 0.0
        if self._arrays is not None:
            system.to_arrays(self.controlled)
            outcome, tries, last = self._march(balance, until, most, records), 0, -1
            while outcome == UNABLE and system.lacks_arrays():
                tries, last = tries + 1 if self.steps == last else 1, self.steps
                if tries > _PATTERNS:
                    break
                self._arrays = system.arrays(self.model.linear.ready)
                self._without_factors()
                if tries > 1 and self.controlled:  # the iterations diverge, and reach other bodies each time
                    self.motion.sizes[self.following] *= _SHORTER
                left = most - (self.steps - begun)
                own = records[self.steps - begun :] if every else records
                outcome = self._march(balance, until, left, own)
            system.from_arrays()
            if outcome != STEPPED:
                self._arrays.arrays.flags[-1] = 0
                self._without_factors()
        if outcome in (UNABLE, OBJECTED):
            # in Python, SciPy solves the linear equations, and the reason of a rejection is available
            own = records[self.steps - begun :] if every else records
            with np.errstate(all="ignore"):
                outcome = self.in_python(self.model, self.motion, self.rules, balance, self._end(until), 1, own)
            if self._arrays is not None:
                self._without_factors()
        self._check(outcome)
        self.pair_energy = self.motion.all_pairs.copy()
        return records[: self.steps - begun]

    def _end(self, until: float) -> float:
        """Time up to which a step in Python goes."""
        return until

    def _begin(self) -> None:
        """Copy q and u, since callers may store the arrays of the previous state."""
        self.motion = self.motion._replace(q=self.motion.q.copy(), u=self.motion.u.copy())

    def _check(self, outcome: int) -> None:
        """Raise the error of a step that failed."""
        if outcome != STEPPED:
            reason = self.model.reason if outcome == OBJECTED else ""
            ending = Outcome.NO_SOLUTION if outcome == NO_SOLUTION else Outcome.STEP_TOO_SMALL
            worst = self.system.worst_body(self._pace)
            raise StepFailed(Outcome.TOO_SOFT if reason else ending, self.t, worst, reason)

    def records(self, count: int) -> np.ndarray:
        """Records of `count` steps, filled with zeros."""
        return np.zeros((count, self.recorded + len(self.q) + len(self.u)))

    def _march(self, balance: np.ndarray, until: float, most: int, records: np.ndarray) -> int:
        assert self._arrays is not None
        arguments = self._arrays, self.motion, self.rules, balance, float(until), int(most), records
        outcome: int = enter(self._arrays.calls.force, self.in_kernel, *arguments)
        return outcome

    @cached_property
    def recorded(self) -> int:
        """Number of values in a record before the state."""
        observed = self.observe()
        return DRIVES + 2 * len(observed.drive.travel) + len(observed.pairs.force)

    @cached_property
    def _arrays(self) -> ArrayModel | None:
        """Arrays of the system; they are created at the first use, because their kernels may have to be compiled."""
        model: ArrayModel | None = self.system.arrays(self.model.linear.ready)
        return model

    @property
    def marches(self) -> bool:
        """Whether the system has arrays."""
        return self._arrays is not None

