"""Hertz power law with damping that STEP ramps up (docs/theory.md).

    N = w max(0, K d^e + STEP(d, 0, 0, ramp, C) d')

The weight w is the point's share of its face. With e > 1 the law is C1 at d = 0. The law is unilateral, and by default
undamped.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.laws.normal.law import ContactDescription, NormalLaw
from fsm.laws.step import step


@kernel
def hertz(
    depth: np.ndarray, closing: np.ndarray, onset: np.ndarray, share: np.ndarray, params: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Normal force and its slopes, see `NormalLaw`; `params`: K (N/m^e), e, C (N s/m), ramp (m)."""
    stiffness, exponent, damping, ramp = params[0], params[1], params[2], params[3]
    force = np.zeros(depth.shape[0])
    slopes = np.zeros((depth.shape[0], 2))
    for i in range(depth.shape[0]):
        d = depth[i]
        if d <= 0.0:
            continue
        ramped, steepness = step(d / ramp)
        total = stiffness * d**exponent + damping * ramped * closing[i]
        if total > 0.0:
            by_depth = stiffness * exponent * d ** (exponent - 1.0) + damping * closing[i] * steepness / ramp
            force[i] = share[i] * total
            slopes[i, 0] = share[i] * by_depth
            slopes[i, 1] = share[i] * damping * ramped
    return force, slopes


@kernel
def power_energy(depth: np.ndarray, share: np.ndarray, params: np.ndarray) -> np.ndarray:
    """Energy w K d^(e+1)/(e+1) of each contact, (m,), J, for all laws whose `params` begin with K and e."""
    energy = np.zeros(depth.shape[0])
    for i in range(depth.shape[0]):
        if depth[i] > 0.0:
            energy[i] = share[i] * params[0] * depth[i] ** (params[1] + 1.0) / (params[1] + 1.0)
    return energy


def _params(contact: ContactDescription) -> np.ndarray:
    return np.array([contact.stiffness, contact.exponent, contact.damping, contact.ramp])


def _damped(params: np.ndarray) -> bool:
    return bool(params[2] > 0.0)


HERTZ = NormalLaw(hertz, power_energy, _params, restitution=False, rate_dependent=_damped)
