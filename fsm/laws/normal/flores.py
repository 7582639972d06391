"""Law of Flores, Machado, Silva and Martins (2011, Multibody Syst. Dyn. 25, 357-375), for any coefficient of restitution."""

from __future__ import annotations

from fsm.laws.normal.dissipative import restitution_law


def damping_factor(restitution: float) -> float:
    """Damping factor h = 8 (1 - c)/(5 c)."""
    return 1.6 * (1.0 - restitution) / restitution


FLORES = restitution_law(damping_factor)
