"""Normal force of a contact point: Hertz with STEP-ramped damping (docs/theory.md).

    N = w max(0, K d^e + STEP(d, 0, 0, ramp, C) d')

w is the point's share of its face. The law starts C1 at d = 0 and never pulls.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["hertz", "hertz_energy"]


@kernel
def hertz(
    penetration: np.ndarray,
    closing: np.ndarray,
    share: np.ndarray,
    stiffness: float,
    exponent: float,
    damping: float,
    ramp: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Normal force and its slopes.

    Parameters
    ----------
    penetration, closing : (m,) arrays, m and m/s
        d > 0 and its rate.
    share : (m,) array
        w, the point's share of its face.
    stiffness, exponent : K (N/m^e) of a whole face, e
    damping, ramp : C (N s/m) of a whole face, and the penetration (m) at which it is fully on

    Returns
    -------
    force : (m,) array, N
    slopes : (m, 2) array
        dN/dd, N/m, and dN/dd', N s/m.
    """
    force = np.zeros(penetration.shape[0])
    slopes = np.zeros((penetration.shape[0], 2))
    for i in range(penetration.shape[0]):
        depth = penetration[i]
        x = min(1.0, depth / ramp)
        step = x * x * (3.0 - 2.0 * x)
        total = stiffness * depth**exponent + damping * step * closing[i]
        if total > 0.0:
            force[i] = share[i] * total
            by_depth = stiffness * exponent * depth ** (exponent - 1.0)
            if depth < ramp:
                by_depth += damping * closing[i] * 6.0 * x * (1.0 - x) / ramp
            slopes[i, 0] = share[i] * by_depth
            slopes[i, 1] = share[i] * damping * step
    return force, slopes


@kernel
def hertz_energy(penetration: np.ndarray, share: np.ndarray, stiffness: float, exponent: float) -> np.ndarray:
    """Energy w K d^(e+1)/(e+1) stored in each contact, (m,), J."""
    return share * stiffness * penetration ** (exponent + 1.0) / (exponent + 1.0)
