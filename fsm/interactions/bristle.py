"""Bristles of friction that sticks go along with the body that carries them."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation

__all__ = ["carried"]


@kernel
def carried(vectors: np.ndarray, before: np.ndarray, after: np.ndarray, bodies: np.ndarray) -> np.ndarray:
    """Vectors turned as their bodies have turned from one set of poses to another.

    Parameters
    ----------
    vectors : (m, 3) array, inertial axes
    before, after : (n_bodies, 7) arrays
    bodies : (m,) int array
    """
    out = np.empty(vectors.shape)
    old, new, local = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for i in range(vectors.shape[0]):
        fill_rotation(before[bodies[i], 3:], old)
        fill_rotation(after[bodies[i], 3:], new)
        for j in range(3):
            local[j] = 0.0
            for k in range(3):
                local[j] += old[k, j] * vectors[i, k]
        for j in range(3):
            out[i, j] = 0.0
            for k in range(3):
                out[i, j] += new[j, k] * local[k]
    return out
