"""Regularised Coulomb friction with one coefficient: mu(v) = mu_d tanh(v/v_s) (docs/theory.md).

Under a constant load f < mu_d N the contact creeps at v = v_s artanh(f/(mu_d N)).
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.laws.friction.isotropic import length, set_effort
from fsm.laws.friction.law import FrictionDescription, FrictionLaw


@kernel(inline=True)
def smooth_sign(speed: float, v_static: float) -> tuple[float, float]:
    """Ratio tanh(v/v_s)/v, s/m, and the slope of tanh(v/v_s) with respect to v, s/m."""
    x = speed / v_static
    value = np.tanh(x)
    return (value / speed if x > 1e-8 else 1.0 / v_static), (1.0 - value * value) / v_static


@kernel
def tanh(slip: np.ndarray, normal: np.ndarray, params: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Effort and its derivatives, see `FrictionLaw`; `params`: mu_d, v_s (m/s)."""
    count, components = slip.shape
    effort, by_normal = np.empty((count, components)), np.empty((count, components))
    by_slip = np.empty((count, components, components))
    for i in range(count):
        speed = length(slip, i)
        ratio, slope = smooth_sign(speed, params[1])
        set_effort(i, slip, speed, normal[i], params[0] * ratio, params[0] * slope, effort, by_slip, by_normal)
    return effort, by_slip, by_normal


def _params(friction: FrictionDescription) -> np.ndarray:
    return np.array([friction.mu_dynamic, friction.v_static])


TANH = FrictionLaw(tanh, _params, bristle=False)
