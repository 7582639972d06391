"""Which of given pairs of boxes overlap."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["overlapping_listed"]


@kernel
def overlapping_listed(low: np.ndarray, high: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Rows of `pairs` whose boxes have a point in common.

    Parameters
    ----------
    low, high : (n, d) arrays, m
        Corners of the boxes; may be infinite.
    pairs : (m, 2) int array

    Returns
    -------
    (k,) int array, in order
    """
    out = np.empty(pairs.shape[0], dtype=np.int64)
    count = 0
    for k in range(pairs.shape[0]):
        one, two = pairs[k, 0], pairs[k, 1]
        meet = True
        for i in range(low.shape[1]):
            meet = meet and low[one, i] <= high[two, i] and low[two, i] <= high[one, i]
        if meet:
            out[count] = k
            count += 1
    return out[:count].copy()
