"""Energy dissipated in a step of a time integrator, from the states at its ends."""

from __future__ import annotations

import numpy as np

from fsm.system import Before, System

__all__ = ["mean_dissipation"]


def mean_dissipation(system: System, begin: Before, end: Before, pairs: int) -> tuple[float, np.ndarray]:
    """Mean dissipated power (W) of a step between two states (time, configuration), and that of so many contact pairs.

    Of the mean rates, and of the contact forces at both ends. Rates at the ends hold what is left of stiff vibrations,
    and its square: far more than was dissipated on the way. That of the pairs is as in `Energy.pair_power`.
    """
    if not system.rate_dependent:
        return 0.0, np.zeros((2, pairs))
    mean = system.difference(begin[1], end[1]) / (end[0] - begin[0])
    first, last = (system.energy(*here, mean, there) for here, there in ((begin, end), (end, begin)))
    return 0.5 * (first.dissipated_power + last.dissipated_power), 0.5 * (first.pair_power + last.pair_power)
