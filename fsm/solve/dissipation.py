"""Energy dissipated in a step of a time integrator, from the states at its ends."""

from __future__ import annotations

from fsm.system import Before, System

__all__ = ["mean_dissipation"]


def mean_dissipation(system: System, begin: Before, end: Before) -> float:
    """Mean dissipated power (W) of a step between two states (time, configuration).

    Of the mean rates, and of the contact forces at both ends. Rates at the ends hold what is left of stiff vibrations,
    and its square: far more than was dissipated on the way.
    """
    mean = system.difference(begin[1], end[1]) / (end[0] - begin[0])
    powers = [system.energy(*here, mean, there).dissipated_power for here, there in ((begin, end), (end, begin))]
    return 0.5 * sum(powers)
