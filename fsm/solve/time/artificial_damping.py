"""Rest state of a system by artificial damping that decreases with time, so that each mode decays in a few periods."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from fsm.errors import NotConverged
from fsm.kernels.blocks import BlockMatrix, BlockPattern
from fsm.solve.interface.records import Linearised, PreviousState, Ready, StepRejection
from fsm.solve.interface.system import System
from fsm.solve.outcome.status import StepFailed
from fsm.solve.time.generalized_alpha import GeneralizedAlpha

_DECAY = 8.0
"""Damping rate times the time since the start; the energy decreases with this power of that time."""
_AT_FIRST = 1e-3
"""Offset of the time in the damping rate, relative to the time in which the system moves by its size."""
_RTOL, _STEPS = 1e-3, 5000
_DEAD = 1e-8
"""Kinetic energy relative to its largest value, below which the motion has decayed."""


class DampedSystem:
    """System with the artificial damping force -c M u, c = 8/(t - began), 1/s.

    At any time, vibrations faster than c have decayed, and slower vibrations have little damping. The periods of the
    vibrations are not needed.

    Parameters
    ----------
    system : System
    began : s
    stopped : s, or None
        Time at which loads and drives are evaluated; None: the present time.
    """

    def __init__(self, system: System, began: float, stopped: float | None = None) -> None:
        self.system, self.began, self.stopped = system, began, stopped
        self._pattern: BlockPattern | None = None
        self._inertia = np.zeros((0, 0, 0))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.system, name)

    def arrays(self, ready: Ready) -> None:
        """See `System`; steps are taken in Python."""

    def _at(self, t: float) -> float:
        return t if self.stopped is None else self.stopped

    def _rate(self, t: float) -> float:
        return _DECAY / (t - self.began)

    def break_times(self) -> list[float]:
        """See `System`."""
        return self.system.break_times() if self.stopped is None else []

    def force(self, t: float, q: np.ndarray, u: np.ndarray | None) -> np.ndarray:
        """See `System`."""
        force = self.system.force(self._at(t), q, u)
        return force if u is None else force - self._rate(t) * self.system.momentum(q, u)

    def linearise(self, t: float, q: np.ndarray, u: np.ndarray | None) -> Linearised:
        """See `System`."""
        linear = self.system.linearise(self._at(t), q, u)
        if u is None:
            return linear
        pattern = linear.damping.pattern
        if pattern is not self._pattern:
            self._pattern, self._inertia = pattern, self.system.inertia(q, pattern)
        rate = self._rate(t)
        damping = BlockMatrix(pattern, linear.damping.data + rate * self._inertia)
        return Linearised(linear.force - rate * self.system.momentum(q, u), linear.stiffness, damping)

    def commit(self, t: float, q: np.ndarray, u: np.ndarray) -> None:
        """See `System`."""
        self.system.commit(self._at(t), q, u)

    def rejection(self, t: float, q: np.ndarray, u: np.ndarray | None, step: float) -> StepRejection | None:
        """See `System`."""
        return self.system.rejection(self._at(t), q, u, step)

    def longest_step(self, t: float, q: np.ndarray, u: np.ndarray) -> float:
        """See `System`."""
        return self.system.longest_step(self._at(t), q, u)

    def damping_loss(self, begin: PreviousState, end: PreviousState) -> float:
        """Energy that the artificial damping dissipates in a step, J, at the mean velocity."""
        step = end[0] - begin[0]
        u = self.system.difference(begin[1], end[1]) / step
        return self._rate(0.5 * (begin[0] + end[0])) * float(u @ self.system.momentum(end[1], u)) * step


def come_to_rest(system: System, t: float, q: np.ndarray) -> np.ndarray:
    """Final configuration of a damped motion from rest, with loads and drives at their values at time t.

    The result is an approximate equilibrium: friction and slow dampers may keep it slightly away.

    Raises
    ------
    NotConverged
        The motion does not come to rest.
    """
    u = np.zeros(system.nu)
    mass = system.mass(q)
    pace = float(np.abs(_accelerated(system, t, q) / system.scales().span).max(initial=0.0)) ** 0.5
    if pace == 0.0:
        return q
    damped = DampedSystem(system, -_AT_FIRST / pace, t)
    solver = GeneralizedAlpha(cast(System, damped), 0.0, q, u, _RTOL, rho_inf=0.0)
    largest, until = 0.0, 1e6 / pace
    try:
        for _ in range(_STEPS):
            solver.step(until)
            kinetic = float(solver.u @ (mass @ solver.u))
            largest = max(largest, kinetic)
            if kinetic < _DEAD * largest:
                return solver.q
    except StepFailed as error:
        raise NotConverged(f"no equilibrium found: the damped motion fails: {error.reason or error.outcome.value}") from None
    raise NotConverged(f"no equilibrium found: the damped motion does not come to rest within {_STEPS} steps")


def _accelerated(system: System, t: float, q: np.ndarray) -> np.ndarray:
    return system.acceleration(t, q, np.zeros(system.nu))
