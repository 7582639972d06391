"""Spring and damper that act beyond a limit and never pull back: stops, latches, play of gears, slack of cables."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

NEAR = 1e-9
"""Distance from a limit that counts as at the limit, rad or m; relative if larger than 1."""
_ROOT = 60
"""Largest number of iterations for the time of an event in a step."""


@kernel(inline=True)
def ends_at(before: float, beyond: float, near: float) -> bool:
    """Whether a step ends at the limit, where the effort of a damper jumps: it belongs to the next step.

    Parameters
    ----------
    before, beyond : penetration at both ends of a step, negative before the limit, m or rad
    near : distance that counts as at the limit, m or rad
    """
    return bool(before < -near and beyond <= near)


@kernel(inline=True)
def _cubic(way: float, begins: float, ends: float, part: float) -> float:
    """Cubic from 0 to `way` over a step, with these slopes at both ends."""
    return part * (begins + part * (3.0 * way - 2.0 * begins - ends + part * (begins + ends - 2.0 * way)))


@kernel
def _highest(way: float, begins: float, ends: float) -> float:
    """Part of a step at which its cubic has a maximum between the ends, or 0."""
    if not (begins > 0.0 and ends < 0.0):
        return 0.0
    half, three = 3.0 * way - 2.0 * begins - ends, 3.0 * (begins + ends - 2.0 * way)
    root = np.sqrt(max(half * half - three * begins, 0.0))
    return float(begins / (root - half)) if root > half else 0.0


@kernel
def part_to(before: float, now: float, event: float, near: float, begins: float, ends: float) -> float:
    """Part of a step after which a value that increases is just beyond an event: 1 at its end, 2 if it is later.

    `begins` and `ends` are the slopes at both ends of the step, per step; the value between them is the cubic (Hermite). It
    may pass the event and return in the step.
    """
    way, low, high = now - before, 0.0, 1.0
    if not before < event - near:
        return 2.0
    if now < event - near:
        high = _highest(way, begins, ends)
        if not before + _cubic(way, begins, ends, high) > event + near:
            return 2.0
    elif now <= event + near:
        return 1.0
    target = event + 0.5 * near - before
    part = min(target / way, high) if way > 0.0 else high
    for _ in range(_ROOT):
        value = _cubic(way, begins, ends, part)
        slope = begins + part * (2.0 * (3.0 * way - 2.0 * begins - ends) + 3.0 * part * (begins + ends - 2.0 * way))
        if value < target:
            low = part
        else:
            high = part
        found = part - (value - target) / slope if slope > 0.0 else 0.5 * (low + high)
        if not low < found < high:
            found = 0.5 * (low + high)
        if found == part:
            break
        part = found
    return part


@kernel
def part_of_line(before: float, now: float, event: float, near: float) -> float:
    """See `part_to`; the value is a straight line over the step."""
    return part_to(before, now, event, near, now - before, now - before)


@kernel
def one_sided(beyond: float, rate: float, stiffness: float, damping: float) -> tuple[float, float, float, float, float]:
    """Effort k p + c p' of a penetration p > 0 of a limit, or zero if it would pull.

    Parameters
    ----------
    beyond, rate : penetration p, m or rad, and its rate
    stiffness, damping : k and c

    Returns
    -------
    Effort, its derivatives by p and p', energy k p^2/2 (J), and dissipated power (W). A spring that returns more slowly than
    the bodies part loses its energy.
    """
    if not beyond > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    elastic, damped, energy = stiffness * beyond, damping * rate, 0.5 * stiffness * beyond * beyond
    if elastic + damped > 0.0:
        return elastic + damped, stiffness, damping, energy, damped * rate
    return 0.0, 0.0, 0.0, energy, -elastic * rate


@kernel
def mean_loss(begin: float, end: float, rate: float, stiffness: float, damping: float, rebound: float) -> float:
    """Mean of the power (W) that `one_sided` dissipates while the penetration changes at a constant rate.

    The mean is exact, also if the bodies touch or part in the step, where the power has a kink. The value in the middle of
    such a step would be wrong by as much as the loss of the step.

    Parameters
    ----------
    begin, end, rate : penetration at both ends of a step, m or rad, and its rate
    stiffness, damping : k and c
    rebound : factor b, s/m or s/rad
        The damping at a penetration p is c + k b p, see restitution of stops.
    """
    low, high = max(min(begin, end), 0.0), max(begin, end)
    if not high > low:
        return one_sided(high, rate, stiffness, damping + stiffness * rebound * max(high, 0.0))[4]
    apart, slope = low, stiffness * (1.0 + rebound * rate)
    if rate < 0.0:  # below this penetration the effort would pull
        apart = min(max(-damping * rate / slope, low), high) if slope > 0.0 else high
    elastic = 0.5 * stiffness * (apart * apart - low * low)
    viscous = damping * (high - apart) + 0.5 * stiffness * rebound * (high * high - apart * apart)
    return (viscous * rate * rate - elastic * rate) / abs(end - begin)
