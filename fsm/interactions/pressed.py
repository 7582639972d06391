"""Depths of contacts as unknowns of Newton's method beside the positions (docs/theory.md).

A stiff contact is micrometres deep where an iteration moves bodies by millimetres, and the slope of K d^e at the depth that
an iteration happens to leave means nothing: with e = 3/2 each takes a third off a depth that is too large, and a contact
that has opened by a little is lost. So the law is linearised at a depth d* of its own, that of the force as it is advanced
from one iteration to the next, to first order, as the efforts of stiff springs are (Magisano, Leonetti, Garcea 2017).
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["advance_depths"]


@kernel
def advance_depths(
    bodies: np.ndarray,
    gradient: np.ndarray,
    change: np.ndarray,
    per_second: float,
    exponent: float,
    depth: np.ndarray,
    normal: np.ndarray,
    acting: np.ndarray,
    by_depth: np.ndarray,
    by_closing: np.ndarray,
) -> np.ndarray:
    """Depths d* (count,) after a change of the poses; zero where the force, to first order, would pull.

    Parameters
    ----------
    bodies, gradient : as in `fsm.segments.contact_geometry.Measured`
    change : (n_bodies, 3 or 6) array
    per_second : 1/s
        One over the time since the last state; zero at rest.
    exponent : -
        Of the law: d* goes as the force to the power of one over it.
    depth, normal, by_depth, by_closing : (count,) arrays
        d*, and the law there.
    acting : (count,) array, N
        The law, linearised at d*, at the contact's own depth.
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
            out[i] = depth[i] * (force / normal[i]) ** (1.0 / exponent)
    return out
