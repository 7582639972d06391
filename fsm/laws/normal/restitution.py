"""Law with an exact coefficient of restitution c (docs/theory.md).

With the speed v over the impact speed, the equation of motion is m v dv = -K d^e (1 + h v) dd. Compression and separation
cover the same penetration. The integrals of v/(1 + h v) over v from 0 to 1 and from 0 to -c are therefore equal:

    phi(h) = c^2 phi(-h c),  phi(x) = (x - ln(1 + x))/x^2      or      h (1 + c) = ln[(1 + h)/(1 - h c)]

The result holds for any exponent e and any stiffness. For c -> 0, h tends to 1/c.
"""

from __future__ import annotations

import math

from fsm.laws.normal.dissipative import restitution_law


def damping_factor(restitution: float) -> float:
    """Damping factor h, the root of h (1 + c) = ln[(1 + h)/(1 - h c)], to 1e-13 relative or absolute.

    Raises
    ------
    ValueError
        c is not in (0, 1]; h would be infinite for c = 0.
    """
    c = restitution
    if not 0.0 < c <= 1.0:
        raise ValueError(f"a coefficient of restitution must be above 0 and at most 1; it is {c:g}")
    if c == 1.0:
        return 0.0

    # the unknown is s = -ln(1 - h c), because for small c the root h c differs from 1 by less than round-off
    def difference(s: float) -> float:
        y = -math.expm1(-s)
        separation = _phi(-y) if s < 0.1 else (s - y) / y**2
        return _phi(y / c) - c * c * separation

    from scipy.optimize import brentq  # SciPy's solver is imported here, because few cases need it and the import takes long

    s = float(brentq(difference, 0.0, (1.0 + c) / c, xtol=1e-15, rtol=1e-14))
    return -math.expm1(-s) / c


def _phi(x: float) -> float:
    """Function (x - ln(1 + x))/x^2; a series for small x avoids cancellation."""
    if abs(x) < 0.1:
        return sum((-x) ** k / (k + 2) for k in range(18))
    return (x - math.log1p(x)) / x**2


RESTITUTION = restitution_law(damping_factor)
