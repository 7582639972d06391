"""The factor h that delivers exactly the coefficient of restitution that is asked for (docs/theory.md).

With the speed v as a part of the speed of impact, m v dv = -K d^e (1 + h v) dd. Both halves of the impact cover the same
depth, so the integrals of v/(1 + h v) over the speeds of approach (0 to 1) and of parting (0 to -c) are equal:

    phi(h) = c^2 phi(-h c),  phi(x) = (x - ln(1 + x))/x^2      or      h (1 + c) = ln[(1 + h)/(1 - h c)]

Any exponent e and any stiffness; c -> 0 takes h -> 1/c.
"""

from __future__ import annotations

import math

from scipy.optimize import brentq

from fsm.laws.normal.dissipative import restitution_law

__all__ = ["RESTITUTION", "damping_factor"]


def damping_factor(restitution: float) -> float:
    """h of h (1 + c) = ln[(1 + h)/(1 - h c)], to 1e-13 of itself or of 1.

    Raises
    ------
    ValueError
        c is not in (0, 1]. Nothing comes back at c = 0: h would have to be infinite.
    """
    c = restitution
    if not 0.0 < c <= 1.0:
        raise ValueError(f"a coefficient of restitution must be above 0 and at most 1; it is {c:g}")
    if c == 1.0:
        return 0.0

    # in s = -ln(1 - h c), since for small c the h c that is sought differs from 1 by less than round-off
    def imbalance(s: float) -> float:
        y = -math.expm1(-s)
        back = _phi(-y) if s < 0.1 else (s - y) / y**2
        return _phi(y / c) - c * c * back

    s = float(brentq(imbalance, 0.0, (1.0 + c) / c, xtol=1e-15, rtol=1e-14))
    return -math.expm1(-s) / c


def _phi(x: float) -> float:
    """(x - ln(1 + x))/x^2, by its series where the difference would lose digits."""
    if abs(x) < 0.1:
        return sum((-x) ** k / (k + 2) for k in range(18))
    return (x - math.log1p(x)) / x**2


RESTITUTION = restitution_law(damping_factor)
