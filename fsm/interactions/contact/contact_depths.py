"""Depths of contacts as additional unknowns of Newton's method (docs/theory.md).

The penetration of a stiff contact is micrometres, while an iteration may move bodies by millimetres. The slope of K d^e
at the depth of an intermediate iterate is then useless. With e = 3/2 each iteration reduces a depth that is too large
by only one third, and a contact that opens slightly is lost. The law is therefore linearised at a separate depth d*.
The depth d* follows from the contact force N, which is advanced to first order in each iteration. The forces of stiff
springs are treated in the same way (Magisano, Leonetti, Garcea 2017).

The new depth is d* (N_new/N)^(1/p) with the local exponent p = d* N'(d*)/N, at least 1. The iteration would not converge
with an exponent below p/2: a law that is linear at large depths is quadratic in its ramp, and damping grows in the ramp too.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def advance_depths(
    bodies: np.ndarray,
    gradient: np.ndarray,
    change: np.ndarray,
    per_second: float,
    depth: np.ndarray,
    normal: np.ndarray,
    acting: np.ndarray,
    by_depth: np.ndarray,
    by_closing: np.ndarray,
) -> np.ndarray:
    """Depths d* (count,), m, after a change of the poses; zero where the first-order force would be tensile.

    Parameters
    ----------
    bodies, gradient : as in `fsm.model.contact.contact_table.ContactKinematics`
    change : (n_bodies, 3 or 6) array
    per_second : 1/s
        Inverse of the time since the last state; zero in statics.
    depth, normal, by_depth, by_closing : (count,) arrays
        d*, and the normal force and its slopes at d*.
    acting : (count,) array, N
        Normal force of the law linearised at d*, evaluated at the geometric depth.
    """
    out = np.zeros(depth.shape[0])
    size = change.shape[1]
    for i in range(depth.shape[0]):
        deeper = 0.0
        for b in range(bodies.shape[1]):
            for c in range(size):
                deeper -= gradient[i, 0, b * size + c] * change[bodies[i, b], c]
        force = acting[i] + (by_depth[i] + per_second * by_closing[i]) * deeper
        if force > 0.0 and normal[i] > 0.0:
            out[i] = depth[i] * (force / normal[i]) ** (1.0 / max(1.0, depth[i] * by_depth[i] / normal[i]))
    return out
