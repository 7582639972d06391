"""Work of loads between two equilibria."""

from __future__ import annotations

import numpy as np

from fsm.solve.interface.system import System


def load_work(system: System, one: tuple[float, np.ndarray], two: tuple[float, np.ndarray]) -> float:
    """Work of loads between two states (time of the loads in s, q) by the trapezoidal rule, J.

    The power of loads is linear in velocities. Free bodies and nodes move by the difference of the states, and driven
    bodies with the speed of their drives.
    """
    change = system.difference(one[1], two[1])
    total = 0.0
    for t, q in (one, two):
        of_drives = _power(system, t, q, np.zeros_like(change))
        total += 0.5 * (_power(system, t, q, change) - of_drives + of_drives * (two[0] - one[0]))
    return total


def _power(system: System, t: float, q: np.ndarray, u: np.ndarray) -> float:
    energy = system.energy(t, q, u)
    return energy.input_power if energy.load_power is None else energy.load_power
