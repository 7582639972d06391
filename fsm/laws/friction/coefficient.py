"""Friction coefficient against slip velocity, continuous through zero (docs/theory.md).

Known limit of both laws: they creep. Under a steady tangential load below mu_s N the contact slides at the velocity at
which mu(v) carries the load, a fraction of v_static.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["LAW_STEP", "LAW_TANH", "friction"]

LAW_STEP = 0
LAW_TANH = 1


@kernel(inline=True)
def _coefficient(
    speed: float, law: int, mu_static: float, mu_dynamic: float, v_static: float, v_dynamic: float
) -> tuple[float, float]:
    """mu(|v|) >= 0 and d mu/d|v|."""
    if law == 1:
        value = np.tanh(speed / v_static)
        return mu_dynamic * value, mu_dynamic * (1.0 - value * value) / v_static
    if speed < v_static:
        # odd continuation of STEP(v, -v_s, -mu_s, v_s, mu_s): C1 through zero
        x = 0.5 * (1.0 + speed / v_static)
        return mu_static * (2.0 * x * x * (3.0 - 2.0 * x) - 1.0), mu_static * 6.0 * x * (1.0 - x) / v_static
    if speed < v_dynamic:
        x = (speed - v_static) / (v_dynamic - v_static)
        change = mu_dynamic - mu_static
        return mu_static + change * x * x * (3.0 - 2.0 * x), change * 6.0 * x * (1.0 - x) / (v_dynamic - v_static)
    return mu_dynamic, 0.0


@kernel
def friction(
    slip: np.ndarray,
    normal: np.ndarray,
    law: int,
    mu_static: float,
    mu_dynamic: float,
    v_static: float,
    v_dynamic: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Friction effort mu(|v|) N v/|v| and its slopes.

    Parameters
    ----------
    slip : (m, c) array, m/s
        Slip velocity; one component in the plane, a tangent vector in space.
    normal : (m,) array, N
    law : LAW_STEP or LAW_TANH
    mu_static, mu_dynamic, v_static, v_dynamic : parameters of the law, - and m/s

    Returns
    -------
    effort : (m, c) array, N
        Opposes the slip when subtracted along it.
    slopes : (m, 2) array
        Coefficient over speed, mu/|v| (s/m; its limit at zero slip), and d mu/d|v|.
    """
    effort = np.zeros(slip.shape)
    slopes = np.zeros((slip.shape[0], 2))
    for i in range(slip.shape[0]):
        speed = 0.0
        for c in range(slip.shape[1]):
            speed += slip[i, c] ** 2
        speed = np.sqrt(speed)
        value, slope = _coefficient(speed, law, mu_static, mu_dynamic, v_static, v_dynamic)
        ratio = value / speed if speed > 1e-9 * v_static else slope
        for c in range(slip.shape[1]):
            effort[i, c] = ratio * normal[i] * slip[i, c]
        slopes[i, 0] = ratio
        slopes[i, 1] = slope
    return effort, slopes
