"""Where the next configuration will be, from the last ones: a parabola in the progress of the drive."""

from __future__ import annotations

import numpy as np

from fsm.system import System

__all__ = ["History"]

_KEPT = 3
"""States kept: the curve through them is a parabola."""


class History:
    """The last states, and the polynomial through them.

    Parameters
    ----------
    system : System
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self._states: list[tuple[float, np.ndarray]] = []

    def __len__(self) -> int:
        return len(self._states)

    def add(self, t: float, q: np.ndarray) -> None:
        """Take a state."""
        self._states = [*self._states[-(_KEPT - 1) :], (self.system.progress(t), q)]

    def increment(self, t: float) -> np.ndarray | None:
        """Increment from the last state to that at time t; None with fewer than two states."""
        if len(self._states) < 2:
            return None
        last, t = self._states[-1][1], self.system.progress(t)
        times = [time for time, _ in self._states]
        total = np.zeros(self.system.nu)
        for i, (at, q) in enumerate(self._states[:-1]):
            weight = 1.0
            for j, other in enumerate(times):
                if j != i:
                    weight *= (t - other) / (at - other)
            total += weight * self.system.difference(last, q)
        return total
