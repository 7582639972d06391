"""LuGre friction: a bristle model in which a sticking contact does not creep (docs/theory.md).

    dz/dt = v - a z,  a = alpha(r) sigma_0 |v|/g(v),  g = mu_d + (mu_s - mu_d) exp(-(v/v_S)^2),  r = sigma_0 |z|/g(v)
    f = N (sigma_0 z + sigma_1 exp(-(v/v_S)^2) dz/dt + sigma_2 v)

The source is Canudas de Wit, Olsson, Astrom and Lischinsky (1995, IEEE Trans. Autom. Control 40, 419-425). Here z, v and f
are vectors in the tangent plane, and the effort of the bristles is proportional to N. The bristle damping decreases with the
slip velocity (Olsson's form), so the law is dissipative for sigma_1 < 9.3 mu_d/v_S. No law with a constant sigma_1 is
dissipative at all speeds.

The factor alpha is a cubic from 0 at r = 0.8 to 1 at r = 1, and 0 if z decreases (Dupont, Hayward, Armstrong and Altpeter
2002, IEEE Trans. Autom. Control 47, 787-792). Bristles below 0.8 of their largest deflection are therefore elastic. With
alpha = 1 everywhere (the law of 1995), each vibration causes a small slip, and a sticking contact creeps.

In a step of length h with the mean slip velocity w, the deflection becomes z = E z_0 + h phi w. Here x = a h, E = exp(-x)
and phi = (1 - E)/x. The factor alpha is evaluated at the elastic deflection z_0 + h w. The step is exact for a constant slip
velocity, both of elastic and of fully sliding bristles. The deflection never exceeds the larger of |z_0| and g/sigma_0.
The other terms of the force are evaluated at the end of the step. The order in h is two for elastic bristles, and one at the
transition to sliding.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.laws.friction.isotropic import length
from fsm.laws.friction.law import FrictionDescription, FrictionLaw
from fsm.laws.friction.stribeck import stribeck_curve
from fsm.laws.step import step

_ELASTIC = 0.8
"""Elastic limit of the bristle deflection, relative to its largest value."""


@kernel(inline=True)
def _relaxation(
    slip: np.ndarray, speed: float, bent: np.ndarray, size: float, params: np.ndarray
) -> tuple[float, float, float]:
    """Relaxation rate a, 1/s, and its slopes by |v|, 1/m, and |z|, 1/(m s); `slip`, `bent` are v, z, followed by lengths."""
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
    """Function phi(x) = (1 - exp(-x))/x and its slope."""
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

    `params`: mu_s, mu_d, v_S (m/s), sigma_0 (1/m), sigma_1 (s/m), sigma_2 (s/m). If the deflection is beyond its elastic
    limit, |v| has a kink at v = 0. There, the function uses the derivatives of unloading bristles, which are stiffer.
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
        raise ValueError("LuGre friction needs v_stribeck and presliding; give both parameters")
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
