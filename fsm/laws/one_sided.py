"""Spring and damper that act beyond a limit and never pull back: stops, latches, play of gears, slack of cables."""

from __future__ import annotations

from fsm.kernels.jit import kernel


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
