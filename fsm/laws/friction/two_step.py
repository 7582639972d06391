"""Regularised friction of ADAMS with two STEP functions (docs/theory.md).

    mu(v) = STEP(v, -v_s, -mu_s, v_s, mu_s) for |v| < v_s,  STEP(v, v_s, mu_s, v_d, mu_d) beyond

Under a load below mu_s N the contact creeps at a speed below v_s.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.laws.friction.isotropic import length, set_effort
from fsm.laws.friction.law import FrictionDescription, FrictionLaw
from fsm.laws.step import step


@kernel
def two_step(
    slip: np.ndarray, normal: np.ndarray, params: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Effort and its derivatives, see `FrictionLaw`; `params`: mu_s, mu_d, v_s, v_d (m/s)."""
    mu_static, mu_dynamic, v_static, v_dynamic = params[0], params[1], params[2], params[3]
    count, components = slip.shape
    effort, by_normal = np.empty((count, components)), np.empty((count, components))
    by_slip = np.empty((count, components, components))
    for i in range(count):
        speed = length(slip, i)
        if speed < v_static:
            # STEP from -v_s to v_s is an odd function: mu_s x (3 - x^2)/2 with x = v/v_s
            x = speed / v_static
            ratio = 0.5 * mu_static * (3.0 - x * x) / v_static
            slope = 1.5 * mu_static * (1.0 - x * x) / v_static
        else:
            part, steepness = step((speed - v_static) / (v_dynamic - v_static))
            change = mu_dynamic - mu_static
            ratio = (mu_static + change * part) / speed
            slope = change * steepness / (v_dynamic - v_static)
        set_effort(i, slip, speed, normal[i], ratio, slope, effort, by_slip, by_normal)
    return effort, by_slip, by_normal


def _params(friction: FrictionDescription) -> np.ndarray:
    return np.array([friction.mu_static, friction.mu_dynamic, friction.v_static, friction.v_dynamic], dtype=float)


TWO_STEP = FrictionLaw(two_step, _params, bristle=False)
