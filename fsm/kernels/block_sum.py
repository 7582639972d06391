"""Sums and products of block data: effective stiffness K + c D T, and multiplication by a block diagonal matrix."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.small_blocks import is_zero


@kernel
def effective_stiffness(
    stiffness: np.ndarray, damping: np.ndarray, factor: float, diagonal: np.ndarray | None, columns: np.ndarray
) -> np.ndarray:
    """Effective stiffness K + c D T, where T is block diagonal.

    Parameters
    ----------
    stiffness, damping : (n, s, s) arrays
        Blocks of K and D.
    factor : c
    diagonal : (order, s, s) array or None
        Blocks of T; None for the identity.
    columns : (n,) int array
        Column of every block.

    Returns
    -------
    (n, s, s) array
    """
    out = np.empty_like(stiffness)
    size = stiffness.shape[1]
    if diagonal is None:
        for k in range(stiffness.shape[0]):
            for i in range(size):
                for j in range(size):
                    out[k, i, j] = stiffness[k, i, j] + factor * damping[k, i, j]
        return out
    for k in range(stiffness.shape[0]):
        for i in range(size):
            for j in range(size):
                out[k, i, j] = stiffness[k, i, j]
            for m in range(size):
                rate = factor * damping[k, i, m]
                if rate == 0.0:
                    continue  # this is true for most blocks: contacts without friction and elements without damping
                for j in range(size):
                    out[k, i, j] += rate * diagonal[columns[k], m, j]
    return out


@kernel
def multiply_block_diagonal(data: np.ndarray, diagonal: np.ndarray, columns: np.ndarray) -> None:
    """Multiply block data (n, s, s) by a block diagonal matrix (order, s, s) in place; columns >= order are unchanged."""
    size = data.shape[1]
    row = np.empty(size)
    for k in range(data.shape[0]):
        column = columns[k]
        if column >= diagonal.shape[0] or is_zero(data[k]):  # most blocks are zero: contacts that are open
            continue
        for i in range(size):
            for j in range(size):
                row[j] = data[k, i, j]
                data[k, i, j] = 0.0
            for m in range(size):
                if row[m] == 0.0:
                    continue  # this is true for contacts without friction and elements without damping
                for j in range(size):
                    data[k, i, j] += row[m] * diagonal[column, m, j]
