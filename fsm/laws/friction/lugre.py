"""LuGre friction: bristles that bend and give way; what sticks stays (docs/theory.md).

    dz/dt = v - a z,  a = alpha(r) sigma_0 |v|/g(v),  g = mu_d + (mu_s - mu_d) exp(-(v/v_S)^2),  r = sigma_0 |z|/g(v)
    f = N (sigma_0 z + sigma_1 exp(-(v/v_S)^2) dz/dt + sigma_2 v)

Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Autom. Control 40 (1995) 419-425, with z, v and f vectors in the
tangent plane and the bristles' effort in proportion to N. Their damping fades as they slide (Olsson's form): so the law
is dissipative for sigma_1 < 9.3 mu_d/v_S, which with a constant sigma_1 no law is at all speeds.

alpha, a cubic from 0 at r = 0.8 to 1 at r = 1, and 0 where z shrinks (Dupont, Hayward, Armstrong and Altpeter, IEEE Trans.
Autom. Control 47 (2002) 787-792): below 0.8 of what they can hold bristles are springs. With alpha = 1 everywhere, which is
the law of 1995, they give way a little at every vibration, and what should stick creeps.

Over a step of length h with the mean slip w the deflection goes to z = E z_0 + h phi w, with x = a h, E = exp(-x),
phi = (1 - E)/x, alpha taken where the bristles would be as springs, z_0 + h w: exact for a constant slip of springs and of
bristles that give way, and never beyond the larger of |z_0| and g/sigma_0. The rest of the force is of the end of the
step. Second order in h for springs, first where they begin to give way. At h = 0 the deflection is the old one.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.laws.friction.isotropic import length
from fsm.laws.friction.law import FrictionDescription, FrictionLaw
from fsm.laws.friction.stribeck import stribeck_curve
from fsm.laws.step import step

__all__ = ["LUGRE", "lugre"]


_ELASTIC = 0.8
"""Part of what bristles can hold up to which they are springs."""


@kernel(inline=True)
def _relaxation(
    slip: np.ndarray, speed: float, bent: np.ndarray, size: float, params: np.ndarray
) -> tuple[float, float, float]:
    """a, 1/s, and its slopes by |v|, 1/m, and by |z|, 1/(m s); `slip` and `bent` are v and z, then their lengths."""
    g, fall = stribeck_curve(speed, params[0], params[1], params[2])
    along = 0.0
    for c in range(slip.shape[0]):
        along += slip[c] * bent[c]
    if along <= 0.0:
        return 0.0, 0.0, 0.0
    ratio = params[3] * size / g
    alpha, slope = step((ratio - _ELASTIC) / (1.0 - _ELASTIC))
    slope /= 1.0 - _ELASTIC
    rate = params[3] * speed / g
    by_speed = alpha * params[3] * (g - speed * fall) / (g * g) - rate * slope * ratio * fall / g
    return alpha * rate, by_speed, rate * slope * params[3] / g


@kernel(inline=True)
def _mean_decay(x: float) -> tuple[float, float]:
    """phi(x) = (1 - exp(-x))/x and its slope."""
    if x < 1e-3:
        return 1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0)), -0.5 + x * (1.0 / 3.0 - x * (0.125 - x / 30.0))
    phi = -np.expm1(-x) / x
    return phi, (np.exp(-x) - phi) / x


@kernel
def lugre(
    slip: np.ndarray,
    mean: np.ndarray,
    normal: np.ndarray,
    deflection: np.ndarray,
    duration: float,
    params: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Effort, its derivatives and the new deflection, see `FrictionLaw`.

    `params`: mu_s, mu_d, v_S (m/s), sigma_0 (1/m), sigma_1 (s/m), sigma_2 (s/m). |v| has a kink at v = 0 where
    bristles are bent beyond springs: there the derivatives are those of unbending, the stiffer ones.
    """
    v_stribeck, sigma_0, sigma_2 = params[2], params[3], params[5]
    count, components = slip.shape
    effort, by_normal = np.empty((count, components)), np.empty((count, components))
    by_slip, by_mean = np.empty((count, components, components)), np.empty((count, components, components))
    new_deflection = np.empty((count, components))
    spring = deflection + duration * mean
    z_by_mean = np.empty((components, components))
    for i in range(count):
        mean_speed, reach = length(mean, i), length(spring, i)
        a_mean, by_mean_speed, by_reach = _relaxation(mean[i], mean_speed, spring[i], reach, params)
        decay = np.exp(-a_mean * duration)
        phi, phi_slope = _mean_decay(a_mean * duration)
        for c in range(components):
            new_deflection[i, c] = decay * deflection[i, c] + duration * phi * mean[i, c]
        for c in range(components):
            by_x = phi_slope * duration * mean[i, c] - decay * deflection[i, c]
            for k in range(components):
                same = 1.0 if c == k else 0.0
                along_mean = mean[i, k] / mean_speed if mean_speed > 0.0 else 0.0
                along_spring = spring[i, k] / reach if reach > 0.0 else 0.0
                x_slope = duration * (by_mean_speed * along_mean + by_reach * duration * along_spring)
                z_by_mean[c, k] = duration * phi * same + by_x * x_slope
        speed, size = length(slip, i), length(new_deflection, i)
        a, by_speed, by_size = _relaxation(slip[i], speed, new_deflection[i], size, params)
        sigma_1 = params[4] * np.exp(-((speed / v_stribeck) ** 2))
        sigma_1_slope = -2.0 * sigma_1 * speed / v_stribeck**2
        for c in range(components):
            z = new_deflection[i, c]
            z_rate = slip[i, c] - a * z
            by_normal[i, c] = sigma_0 * z + sigma_1 * z_rate + sigma_2 * slip[i, c]
            effort[i, c] = normal[i] * by_normal[i, c]
            for k in range(components):
                same = 1.0 if c == k else 0.0
                along = slip[i, k] / speed if speed > 0.0 else 0.0
                size_by_mean = 0.0
                for m in range(components):
                    size_by_mean += new_deflection[i, m] / size * z_by_mean[m, k] if size > 0.0 else 0.0
                bent = (sigma_0 - sigma_1 * a) * z_by_mean[c, k] - sigma_1 * by_size * z * size_by_mean
                by_mean[i, c, k] = normal[i] * bent
                now = (sigma_1 + sigma_2) * same + (sigma_1_slope * z_rate - sigma_1 * by_speed * z) * along
                by_slip[i, c, k] = normal[i] * now
    return effort, by_slip, by_mean, by_normal, new_deflection


def _params(friction: FrictionDescription) -> np.ndarray:
    v_stribeck, presliding, damping = friction.v_stribeck, friction.presliding, friction.bristle_damping
    if v_stribeck is None or presliding is None:
        raise ValueError("LuGre friction needs v_stribeck and presliding")
    return np.array(
        [
            friction.mu_static,
            friction.mu_dynamic,
            v_stribeck,
            friction.mu_static / presliding,
            friction.mu_dynamic / v_stribeck if damping is None else damping,
            friction.viscous,
        ]
    )


LUGRE = FrictionLaw(lugre, _params, bristle=True)
