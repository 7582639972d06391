"""Common kernel of all laws with a coefficient of restitution (docs/theory.md).

    N = w K d^e max(0, 1 + h d'/v0),    v0 = sqrt(onset^2 + floor^2)

Each law computes the damping factor h from the coefficient of restitution. v0 is the closing speed at the onset of the
contact. For a contact that began within the step, v0 is the present closing speed, sqrt(d'^2 + floor^2), which is
smooth at d' = 0.

Some contacts begin at rest and are loaded later, for example in statics. Without the floor their damping would be
unbounded. Far below the floor the law is K d^e (1 + h d'/floor), which tends to the elastic law. In an impact at ten
times the floor, the effective h is 0.5 % too small.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fsm.kernels.jit import kernel
from fsm.laws.normal.hertz import power_energy
from fsm.laws.normal.law import ContactDescription, NormalLaw


@kernel
def dissipative(
    depth: np.ndarray, closing: np.ndarray, onset: np.ndarray, share: np.ndarray, params: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Normal force and its slopes, see `NormalLaw`; `params`: K (N/m^e), e, h, floor (m/s)."""
    stiffness, exponent, h, floor = params[0], params[1], params[2], params[3]
    force = np.zeros(depth.shape[0])
    slopes = np.zeros((depth.shape[0], 2))
    for i in range(depth.shape[0]):
        d = depth[i]
        if d <= 0.0:
            continue
        if onset[i] > 0.0:
            v0 = np.sqrt(onset[i] ** 2 + floor**2)
            by_closing = h / v0
        else:
            v0 = np.sqrt(closing[i] ** 2 + floor**2)
            by_closing = h * floor**2 / v0**3
        factor = 1.0 + h * closing[i] / v0
        if factor > 0.0:
            elastic = share[i] * stiffness * d**exponent
            force[i] = elastic * factor
            slopes[i, 0] = share[i] * stiffness * exponent * d ** (exponent - 1.0) * factor
            slopes[i, 1] = elastic * by_closing
    return force, slopes


def restitution_law(damping_factor: Callable[[float], float]) -> NormalLaw:
    """Law whose damping factor h is the given function of the coefficient of restitution."""

    def params(contact: ContactDescription) -> np.ndarray:
        if contact.restitution is None:
            raise ValueError("this law needs a coefficient of restitution; give `restitution`")
        return np.array([contact.stiffness, contact.exponent, damping_factor(contact.restitution), contact.speed_floor])

    return NormalLaw(dissipative, power_energy, params, restitution=True, rate_dependent=_damped)


def _damped(params: np.ndarray) -> bool:
    return bool(params[2] > 0.0)
