"""Which of given pairs of boxes overlap."""

from __future__ import annotations

import numpy as np

__all__ = ["overlapping_listed"]


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
    one, two = pairs[:, 0], pairs[:, 1]
    return np.flatnonzero(np.all((low[one] <= high[two]) & (low[two] <= high[one]), axis=1))
