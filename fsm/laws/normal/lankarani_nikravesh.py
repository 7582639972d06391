"""Lankarani and Nikravesh, J. Mech. Des. 112 (1990) 369-376: for restitution near 1; delivers more than asked below."""

from __future__ import annotations

from fsm.laws.normal.dissipative import restitution_law

__all__ = ["LANKARANI_NIKRAVESH", "damping_factor"]


def damping_factor(restitution: float) -> float:
    """h = 3/4 (1 - c^2)."""
    return 0.75 * (1.0 - restitution**2)


LANKARANI_NIKRAVESH = restitution_law(damping_factor)
