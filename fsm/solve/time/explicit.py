"""The explicit Runge-Kutta method, step by step; see `fsm.solve.stepping.explicit` for the equations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import ROW, address_table
from fsm.kernels.pointers import enter
from fsm.solve.interface.records import Observation
from fsm.solve.interface.system import System
from fsm.solve.stepping import explicit
from fsm.solve.stepping.explicit import Through
from fsm.solve.stepping.explicit_stages import ExplicitMotion, ExplicitRules
from fsm.solve.stepping.generalized_alpha import LONGEST, MAX_STEP, STARTED, STEP_SIZE
from fsm.solve.stepping.march import BALANCE
from fsm.solve.stepping.model import CREASES, DRIVES, PANELS
from fsm.solve.time.array_steps import StepMethod

_MOST_NUMBERS = 500_000
"""Largest number of values of all states that a kernel keeps at a time."""
_NO_STATES, _NO_MEMORY = np.zeros((0, 0)), np.zeros((0, ROW), dtype=np.int64)


@cache
def _tables() -> ExplicitRules:
    """Constants of the method, without tolerances, scales and times."""
    from scipy.integrate import DOP853

    count, none = len(DOP853.B), np.zeros(0)
    stages = DOP853.C[:count], DOP853.B, DOP853.A[:count, :count], DOP853.E5[:count], DOP853.E3[:count]
    nodes, weights, table, fifth, third = (np.ascontiguousarray(each) for each in stages)
    between = (np.ascontiguousarray(each) for each in (DOP853.C_EXTRA, DOP853.A_EXTRA, DOP853.D))
    return ExplicitRules(0.0, nodes, weights, table, fifth, third, none, none, none, none, *between)


class PassedState(NamedTuple):
    """State through which a march went: time (s), elastic energies of panels and creases (J), numbers of
    `fsm.solve.stepping.march`, q, u, and internal variables of the system.
    """

    time: float
    panels: float
    creases: float
    balance: np.ndarray
    q: np.ndarray
    u: np.ndarray
    memory: np.ndarray


class Explicit(StepMethod):
    """The explicit Runge-Kutta method of order 8, step by step.

    Parameters
    ----------
    system : System
    t, q, u : time and state to start from
    rtol : -
        Bound of the local error of a step, root mean square over all components, relative to the system's scales; of
        velocities relative to scales and size.
    max_step : s
    observed : Observation of any state, for the numbers of drives and contact pairs; computed if absent
    """

    one_step, in_python = staticmethod(explicit.take_step), staticmethod(explicit.march_explicit)
    in_kernel = staticmethod(explicit.march_explicit_arrays)
    following = STEP_SIZE
    _through: Through | None = None
    kept = "rate", "sizes", "counts"

    def __init__(
        self, system: System, t: float, q: np.ndarray, u: np.ndarray, rtol: float, max_step: float = math.inf,
        observed: Observation | None = None,
    ) -> None:  # fmt: skip
        sizes, counts, still = np.zeros(11), np.zeros(13, dtype=np.int64), np.zeros(len(u))
        sizes[MAX_STEP], sizes[LONGEST] = max_step, math.inf
        observed, tables = observed or system.observe(t, q, u), _tables()
        q, u = np.array(q, dtype=float), np.array(u, dtype=float)
        more = tables.between.shape[1]
        of_q, of_u = np.zeros((more, len(q))), np.zeros((more, len(u)))
        y, at_q = np.zeros((2, len(q)))
        v, at_u, moved, faster = np.zeros((4, len(u)))
        motion = ExplicitMotion(
            q, u, still, sizes, counts, y, v, of_q, of_u, at_q, at_u, moved, faster, np.zeros((more, 2)),
            np.zeros((2, len(observed.pairs.force))), np.zeros(len(observed.drive.force)),
            np.zeros(DRIVES + 2 * len(observed.drive.force) + len(observed.pairs.force)),
        )  # fmt: skip
        super().__init__(system, t, q, motion, True)
        scales = system.scales()
        self.rules = tables._replace(
            rtol=rtol, tolerance=np.minimum(rtol * scales.increment, scales.resolution), velocity=scales.velocity,
            increment=scales.increment, breaks=np.array(sorted(system.break_times()), dtype=float),
        )  # fmt: skip

    def step(self, until: float) -> None:
        """See `StepMethod`."""
        with self._held():
            super().step(until)

    def march(self, balance: np.ndarray, until: float, most: int, every: bool = False) -> np.ndarray:
        """See `StepMethod`."""
        with self._held():
            return super().march(balance, until, most, every)

    @contextmanager
    def _held(self) -> Iterator[None]:
        """Steps of this method end at events."""
        self.system.hold(True)
        try:
            yield
        finally:
            self.system.hold(False)

    def march_through(self, balance: np.ndarray, times: np.ndarray, most: int, memory: Sequence[np.ndarray]) -> None:
        """Take at most `most` steps through given times in one kernel, and keep the states there; see `passed`.

        `memory` contains the arrays of the system's internal variables.
        """
        size = DRIVES + len(balance) + len(self.q) + len(self.u) + sum(len(part) for part in memory)
        count = min(len(times), max(1, _MOST_NUMBERS // size))
        self._through = Through(
            times[:count], np.empty((count, size)), np.zeros(1, dtype=np.int64), address_table(memory)
        )
        self.march(balance, math.nan, most)

    def passed(self) -> list[PassedState]:
        """States that the last call of `march_through` has kept."""
        if self._through is None:
            return []
        through, self._through = self._through, None
        q = DRIVES + BALANCE
        u = q + len(self.q)
        end = u + len(self.u)
        rows = through.states[: through.passed[0]]
        return [
            PassedState(t, float(row[PANELS]), float(row[CREASES]), row[DRIVES:q], row[q:u], row[u:end], row[end:])
            for t, row in zip(through.times.tolist(), rows, strict=False)
        ]

    def _march(self, balance: np.ndarray, until: float, most: int, records: np.ndarray) -> int:
        assert self._arrays is not None
        through = self._through or Through(np.array([until]), _NO_STATES, np.zeros(1, dtype=np.int64), _NO_MEMORY)
        arguments = self._arrays, self.motion, self.rules, balance, through, int(most), records
        outcome: int = enter(self._arrays.calls.force, self.in_kernel, *arguments)
        return outcome

    def _end(self, until: float) -> float:
        """See `StepMethod`."""
        return until if self._through is None else float(self._through.times[int(self._through.passed[0])])

    @property
    def _pace(self) -> np.ndarray:
        return np.asarray(self.motion.rate / self.rules.velocity)

    def _without_factors(self) -> None:
        self.motion.counts[STARTED] = 0
