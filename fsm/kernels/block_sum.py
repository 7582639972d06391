"""Block data on a pattern: stiffness and what velocities add to it, which increments turn."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["turn_blocks", "with_rates"]


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
    if turned is None:
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
                    continue  # most blocks: contacts without friction, and what does not damp
                for j in range(size):
                    out[k, i, j] += rate * turned[columns[k], m, j]
    return out


@kernel
def turn_blocks(data: np.ndarray, turned: np.ndarray, columns: np.ndarray) -> None:
    """Block data (n, s, s) times a block diagonal matrix (order, s, s), in place; what lies in columns behind it is left."""
    size = data.shape[1]
    row = np.empty(size)
    for k in range(data.shape[0]):
        column = columns[k]
        if column >= turned.shape[0]:
            continue
        for i in range(size):
            for j in range(size):
                row[j] = data[k, i, j]
                data[k, i, j] = 0.0
            for m in range(size):
                if row[m] == 0.0:
                    continue  # most blocks: contacts without friction, and what does not damp
                for j in range(size):
                    data[k, i, j] += row[m] * turned[column, m, j]
