"""Constants of a stop with restitution, k p (1 + b p'/v): its damping, and what a load changes."""

from __future__ import annotations

import math

from fsm.case.models.joint_action import LEAST_REBOUND


def rebound(restitution: float) -> float:
    """Solution b of (1 + e) b = log((1 + b)/(1 - e b)), at most about 1/`LEAST_REBOUND`; 0 for e = 1."""
    from scipy.optimize import brentq  # most scenes have no stops, and the import takes longer than a small scene

    e = max(restitution, LEAST_REBOUND)
    if e == 1.0:
        return 0.0
    most = (1.0 - 1e-15) / e

    def left(b: float) -> float:
        return (1.0 + e) * b - math.log1p(b) + math.log1p(-e * b)

    if left(most) > 0.0:  # b is 1/e in all digits
        return most
    return float(brentq(left, 0.5 * (1.0 - e), most, xtol=1e-15 * most))


def loss_of_rebound(restitution: float) -> float:
    """Change C of the restitution by a constant load F towards the stop, -C F/(v sqrt(k m)), to first order; 0 for e = 1.

    With w = p'/v, the work of the spring part is m v^2 times the integral of w/(1 + b w) from -e to w = 1: no longer zero,
    it is -F times the integral of 1/(1 + b w) over the way in and out.
    """
    from scipy.integrate import quad

    e, b = restitution, rebound(restitution)
    if b == 0.0:
        return 0.0

    def work(w: float) -> float:
        return w / b - math.log1p(b * w) / (b * b)

    def of_way(x: float) -> float:  # w = middle + half sin(x), since dp/dw is singular where p = 0
        w = 0.5 * (1.0 - e) + 0.5 * (1.0 + e) * math.sin(x)
        p = math.sqrt(max(2.0 * (work(1.0) - work(w)), 0.0))
        return w / ((1.0 + b * w) ** 2 * p) * 0.5 * (1.0 + e) * math.cos(x) if p > 0.0 else 0.0

    return float(-(1.0 - b * e) / e * quad(of_way, -0.5 * math.pi, 0.5 * math.pi, epsabs=1e-9)[0])
