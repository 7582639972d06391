"""Law of Lankarani and Nikravesh (1990, J. Mech. Des. 112, 369-376).

It is accurate for a coefficient of restitution near 1. For smaller coefficients the restitution is too large.
"""

from __future__ import annotations

from fsm.laws.normal.dissipative import restitution_law


def damping_factor(restitution: float) -> float:
    """Damping factor h = 3/4 (1 - c^2)."""
    return 0.75 * (1.0 - restitution**2)


LANKARANI_NIKRAVESH = restitution_law(damping_factor)
