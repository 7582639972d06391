"""Spring and damper that act beyond a limit and never pull back: stops, latches, play of gears, slack of cables."""

from __future__ import annotations

from fsm.kernels.jit import kernel

NEAR = 1e-9
"""Distance from a limit that counts as at the limit, rad or m; relative if larger than 1."""


@kernel(inline=True)
def ends_at(before: float, beyond: float, near: float) -> bool:
    """Whether a step ends at the limit, where the effort of a damper jumps: it belongs to the next step.

    Parameters
    ----------
    before, beyond : penetration at both ends of a step, negative before the limit, m or rad
    near : distance that counts as at the limit, m or rad
    """
    return bool(before < -near and beyond <= near)


@kernel
def part_to(before: float, now: float, event: float, near: float) -> float:
    """Part of a step after which a value that increases is just beyond an event: 1 at its end, 2 if it is later."""
    if not (before < event - near and now >= event - near):
        return 2.0
    if now <= event + near:
        return 1.0
    return (event + 0.5 * near - before) / (now - before)


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
