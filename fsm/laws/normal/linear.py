"""Linear spring and damper with a smooth start (docs/theory.md).

    N = w max(0, K s(d) + STEP(d, 0, 0, ramp, C) d'),   s(d) = d^2/(2 ramp) up to the ramp, d - ramp/2 beyond

The law is C1 at d = 0 and at the ramp. With a ramp well below the penetration it is the Kelvin-Voigt law.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.laws.normal.law import ContactDescription, NormalLaw
from fsm.laws.step import step


@kernel
def linear(
    depth: np.ndarray, closing: np.ndarray, onset: np.ndarray, share: np.ndarray, params: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Normal force and its slopes, see `NormalLaw`; `params`: K (N/m), C (N s/m), ramp (m)."""
    stiffness, damping, ramp = params[0], params[1], params[2]
    force = np.zeros(depth.shape[0])
    slopes = np.zeros((depth.shape[0], 2))
    for i in range(depth.shape[0]):
        d = depth[i]
        if d <= 0.0:
            continue
        ramped, steepness = step(d / ramp)
        if d < ramp:
            elastic, by_depth = stiffness * 0.5 * d * d / ramp, stiffness * d / ramp
        else:
            elastic, by_depth = stiffness * (d - 0.5 * ramp), stiffness
        total = elastic + damping * ramped * closing[i]
        if total > 0.0:
            force[i] = share[i] * total
            slopes[i, 0] = share[i] * (by_depth + damping * closing[i] * steepness / ramp)
            slopes[i, 1] = share[i] * damping * ramped
    return force, slopes


@kernel
def linear_energy(depth: np.ndarray, share: np.ndarray, params: np.ndarray) -> np.ndarray:
    """Energy of the spring of each contact, (m,), J; `params` as in `linear`."""
    stiffness, ramp = params[0], params[2]
    energy = np.zeros(depth.shape[0])
    for i in range(depth.shape[0]):
        d = depth[i]
        if d <= 0.0:
            continue
        if d < ramp:
            energy[i] = share[i] * stiffness * d**3 / (6.0 * ramp)
        else:
            energy[i] = share[i] * stiffness * (0.5 * d * (d - ramp) + ramp * ramp / 6.0)
    return energy


def _params(contact: ContactDescription) -> np.ndarray:
    return np.array([contact.stiffness, contact.damping, contact.ramp])


def _damped(params: np.ndarray) -> bool:
    return bool(params[1] > 0.0)


LINEAR = NormalLaw(linear, linear_energy, _params, restitution=False, rate_dependent=_damped)
