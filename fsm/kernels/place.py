"""Poses and rates of all bodies from the coordinates of the free ones."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["place_free", "take_free"]


@kernel
def place_free(free: np.ndarray, values: np.ndarray, unit: bool, out: np.ndarray) -> None:
    """Write coordinates (n_free * size,) into the rows of the free bodies of `out` (n_bodies, size).

    With `unit`, the last four of a row are a quaternion, which is brought to unit norm.
    """
    size = out.shape[1]
    for i in range(free.shape[0]):
        row = free[i]
        for k in range(size):
            out[row, k] = values[i * size + k]
        if unit:
            total = 0.0
            for k in range(3, 7):
                total += out[row, k] * out[row, k]
            norm = np.sqrt(total)
            for k in range(3, 7):
                out[row, k] /= norm


@kernel
def take_free(free: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Rows of the free bodies of `values` (n_bodies, size), one after the other, (n_free * size,)."""
    size = values.shape[1]
    out = np.empty(free.shape[0] * size)
    for i in range(free.shape[0]):
        for k in range(size):
            out[i * size + k] = values[free[i], k]
    return out
