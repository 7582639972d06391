"""A system with locked directions as y' = f(t, y) for SciPy's methods: accelerations and multipliers of each state.

f belongs to the nearest state that the joints allow (`fsm.solve.stepping.model.consistent`), as in explicit steps; y itself
may drift from it by the errors of the method. Records have the nearest states. Jacobians are finite differences.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.solve.interface.system import System
from fsm.solve.time.scipy_ivp import FirstOrder


class JointedEquations(FirstOrder):
    """A system with locked directions as y' = f(t, y)."""

    differences = True

    def at(self, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `FirstOrder`; the system has the multipliers and the turns of this state."""
        q, u, _ = self._allowed(math.nextafter(t, -math.inf), y)  # motors jump at breaks
        self.system.commit(t, q, u)
        return q, u

    def rate(self, t: float, y: np.ndarray) -> np.ndarray:
        """y' = (T u, u'); the lengths of quaternions of y are kept."""
        self.force_calls += 1
        _, u, rate = self._allowed(t, y)
        return np.concatenate([self.system.kinematic_map(y[: self.nq], u), rate])

    def _allowed(self, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nearest configuration and velocity that the joints allow, and their acceleration."""
        q, u = self.split(y)
        q, u, rate = self.system.retract(q, np.zeros(len(u))), u.copy(), np.zeros(len(u))
        self.system.consistent(t, q, u, rate)
        return q, u, rate


def equations_of(system: System) -> FirstOrder:
    """Equations of a system for SciPy's methods."""
    return JointedEquations(system) if system.lock(0.0) else FirstOrder(system)
