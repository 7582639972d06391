"""LuGre friction: bristles that bend and give way; what sticks stays (docs/theory.md).

    dz/dt = v - a(v) z,  a = sigma_0 |v|/g(v),  g = mu_d + (mu_s - mu_d) exp(-(v/v_S)^2)
    f = N (sigma_0 z + sigma_1 exp(-(v/v_S)^2) dz/dt + sigma_2 v)

Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Autom. Control 40 (1995) 419-425, with z, v and f vectors in the
tangent plane and the bristles' effort in proportion to N. Their damping fades as they slide (Olsson's form): so the law
is dissipative for sigma_1 < 9.3 mu_d/v_S, which with a constant sigma_1 no law is at all speeds.

Over a step of length h with the mean slip w the deflection goes to z = E z_0 + h phi w, with x = a(w) h, E = exp(-x),
phi = (1 - E)/x: exact for a constant slip, and never beyond the larger of |z_0| and g/sigma_0. The rest of the force is of
the end of the step. At h = 0 the deflection is the old one.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.laws.friction.isotropic import length
from fsm.laws.friction.law import FrictionDescription, FrictionLaw
from fsm.laws.friction.stribeck import stribeck_curve

__all__ = ["LUGRE", "lugre"]


@kernel(inline=True)
def _relaxation(speed: float, params: np.ndarray) -> tuple[float, float]:
    """a(|v|) = sigma_0 |v|/g(|v|), 1/s, and its slope, 1/m."""
    g, fall = stribeck_curve(speed, params[0], params[1], params[2])
    return params[3] * speed / g, params[3] * (g - speed * fall) / (g * g)


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
    slip_before: np.ndarray,
    normal: np.ndarray,
    deflection: np.ndarray,
    duration: float,
    weight: float,
    params: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Effort, its derivatives and the new deflection, see `FrictionLaw`.

    `params`: mu_s, mu_d, v_S (m/s), sigma_0 (1/m), sigma_1 (s/m), sigma_2 (s/m). |v| has a kink at v = 0: there the
    derivatives are the mean of those of both directions.
    """
    v_stribeck, sigma_0, sigma_2 = params[2], params[3], params[5]
    count, components = slip.shape
    effort, by_normal = np.empty((count, components)), np.empty((count, components))
    by_slip, new_deflection = np.empty((count, components, components)), np.empty((count, components))
    mean = weight * slip + (1.0 - weight) * slip_before
    for i in range(count):
        speed, mean_speed = length(slip, i), length(mean, i)
        a, a_slope = _relaxation(speed, params)
        a_mean, a_mean_slope = _relaxation(mean_speed, params)
        decay = np.exp(-a_mean * duration)
        phi, phi_slope = _mean_decay(a_mean * duration)
        sigma_1 = params[4] * np.exp(-((speed / v_stribeck) ** 2))
        sigma_1_slope = -2.0 * sigma_1 * speed / v_stribeck**2
        for c in range(components):
            new_deflection[i, c] = decay * deflection[i, c] + duration * phi * mean[i, c]
        for c in range(components):
            z = new_deflection[i, c]
            z_rate = slip[i, c] - a * z
            by_normal[i, c] = sigma_0 * z + sigma_1 * z_rate + sigma_2 * slip[i, c]
            effort[i, c] = normal[i] * by_normal[i, c]
            # by x = a(w) h along the mean slip, and by the speed now along the slip now
            by_mean_speed = (phi_slope * duration * mean[i, c] - decay * deflection[i, c]) * duration * a_mean_slope
            by_speed = sigma_1_slope * z_rate - sigma_1 * a_slope * z
            for k in range(components):
                same = 1.0 if c == k else 0.0
                along_mean = mean[i, k] / mean_speed if mean_speed > 0.0 else 0.0
                along = slip[i, k] / speed if speed > 0.0 else 0.0
                # the mean slip moves by its weight times the slip
                z_by_slip = weight * (duration * phi * same + by_mean_speed * along_mean)
                total = (sigma_0 - sigma_1 * a) * z_by_slip + (sigma_1 + sigma_2) * same + by_speed * along
                by_slip[i, c, k] = normal[i] * total
    return effort, by_slip, by_normal, new_deflection


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
