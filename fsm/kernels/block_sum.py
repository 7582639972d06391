"""Sums of block data on one pattern: stiffness and what velocities add to it."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["with_rates"]


@kernel
def with_rates(
    stiffness: np.ndarray, damping: np.ndarray, factor: float, turned: np.ndarray | None, columns: np.ndarray
) -> np.ndarray:
    """K + c D T of block data (n, s, s), where T is block diagonal.

    Parameters
    ----------
    stiffness, damping : K, D
    factor : c
    turned : (order, s, s) array or None
        Blocks of T; without them the identity.
    columns : (n,) int array
        Column of every block.
    """
    out = np.empty_like(stiffness)
    size = stiffness.shape[1]
    for k in range(stiffness.shape[0]):
        for i in range(size):
            for j in range(size):
                out[k, i, j] = stiffness[k, i, j]
            for m in range(size):
                rate = factor * damping[k, i, m]
                if rate == 0.0:
                    continue  # most blocks: contacts without friction, and what does not damp
                if turned is None:
                    out[k, i, m] += rate
                else:
                    for j in range(size):
                        out[k, i, j] += rate * turned[columns[k], m, j]
    return out
