"""Law of Hunt and Crossley (1975, J. Appl. Mech. 42, 440-445).

It is accurate for a coefficient of restitution near 1. For smaller coefficients the restitution is too large.
"""

from __future__ import annotations

from fsm.laws.normal.dissipative import restitution_law


def damping_factor(restitution: float) -> float:
    """Damping factor h = 3/2 (1 - c)."""
    return 1.5 * (1.0 - restitution)


HUNT_CROSSLEY = restitution_law(damping_factor)
