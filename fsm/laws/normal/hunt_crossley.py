"""Hunt and Crossley, J. Appl. Mech. 42 (1975) 440-445: for restitution near 1; delivers more than asked below."""

from __future__ import annotations

from fsm.laws.normal.dissipative import restitution_law

__all__ = ["HUNT_CROSSLEY", "damping_factor"]


def damping_factor(restitution: float) -> float:
    """h = 3/2 (1 - c)."""
    return 1.5 * (1.0 - restitution)


HUNT_CROSSLEY = restitution_law(damping_factor)
