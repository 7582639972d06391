"""Regularised Stribeck friction (docs/theory.md).

    mu(v) = g(v) tanh(v/v_0) + mu_v v,    g(v) = mu_d + (mu_s - mu_d) exp(-(v/v_S)^2)

v_0 is `v_static` and v_S is `v_stribeck`. The largest coefficient is slightly below mu_s. With v_S = 10 v_0 the difference
is 3 % for mu_s = 1.5 mu_d, and 6 % for mu_s = 5 mu_d. A sticking contact creeps, as in all laws without bristles.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.laws.friction.isotropic import length, set_effort
from fsm.laws.friction.law import FrictionDescription, FrictionLaw
from fsm.laws.friction.tanh import smooth_sign


@kernel(inline=True)
def stribeck_curve(speed: float, mu_static: float, mu_dynamic: float, v_stribeck: float) -> tuple[float, float]:
    """Coefficient g(|v|) of steady sliding, and its slope, s/m."""
    x = speed / v_stribeck
    excess = (mu_static - mu_dynamic) * np.exp(-x * x)
    return mu_dynamic + excess, -2.0 * x * excess / v_stribeck


@kernel
def stribeck(
    slip: np.ndarray, normal: np.ndarray, params: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Effort and its derivatives, see `FrictionLaw`; `params`: mu_s, mu_d, v_0 (m/s), v_S (m/s), mu_v (s/m)."""
    mu_static, mu_dynamic, v_static, v_stribeck, viscous = params[0], params[1], params[2], params[3], params[4]
    count, components = slip.shape
    effort, by_normal = np.empty((count, components)), np.empty((count, components))
    by_slip = np.empty((count, components, components))
    for i in range(count):
        speed = length(slip, i)
        start, start_slope = smooth_sign(speed, v_static)
        sliding, fall = stribeck_curve(speed, mu_static, mu_dynamic, v_stribeck)
        ratio = sliding * start + viscous
        slope = sliding * start_slope + fall * start * speed + viscous
        set_effort(i, slip, speed, normal[i], ratio, slope, effort, by_slip, by_normal)
    return effort, by_slip, by_normal


def _params(friction: FrictionDescription) -> np.ndarray:
    values = (friction.mu_static, friction.mu_dynamic, friction.v_static, friction.v_stribeck, friction.viscous)
    return np.array(values, dtype=float)


STRIBECK = FrictionLaw(stribeck, _params, bristle=False)
