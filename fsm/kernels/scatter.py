"""Sums element forces into body forces and element tangents into the block matrix."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["add_block", "find_slot", "scatter_efforts"]


@kernel
def scatter_efforts(
    bodies: np.ndarray, gradient: np.ndarray, effort: np.ndarray, count: int, force: np.ndarray
) -> None:
    """Add the generalised forces -e_k dm_k/dx of a batch of interactions to their bodies.

    Parameters
    ----------
    bodies : (m, b) int array
        Bodies of each interaction; its coordinates are theirs in this order.
    gradient : (m, k, b d) array
        dm_k/dx of each measure.
    effort : (m, k) array
        Effort conjugate to each measure, positive where it resists growth.
    count : int
        Only the first `count` interactions are summed.
    force : (n_bodies, d) array, changed in place
    """
    size = force.shape[1]
    for i in range(count):
        for b in range(bodies.shape[1]):
            body = bodies[i, b]
            for c in range(size):
                total = 0.0
                for k in range(effort.shape[1]):
                    total += effort[i, k] * gradient[i, k, b * size + c]
                force[body, c] -= total


@kernel
def find_slot(indptr: np.ndarray, indices: np.ndarray, row: int, column: int) -> int:
    """Position of block (row, column) in a block-sparse pattern with sorted columns; -1 if it is not there."""
    if row < 0 or column < 0:
        return -1
    low, high = indptr[row], indptr[row + 1]
    while low < high:
        middle = (low + high) // 2
        if indices[middle] < column:
            low = middle + 1
        else:
            high = middle
    if low < indptr[row + 1] and indices[low] == column:
        return low
    return -1


@kernel
def add_block(
    matrix: np.ndarray,
    dof: np.ndarray,
    bodies: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    data: np.ndarray,
) -> None:
    """Add one element matrix to the block-sparse matrix; rows and columns of bodies that cannot move are dropped.

    Parameters
    ----------
    matrix : (b d, b d) array
    dof : (n_bodies,) int array
        Block number of each body, -1 for a body without degrees of freedom.
    bodies : (b,) int array
        The same body may stand twice; its blocks add up.
    indptr, indices : block-sparse pattern
    data : (n_blocks, d, d) array, changed in place
    """
    size = data.shape[1]
    for i in range(bodies.shape[0]):
        row = dof[bodies[i]]
        for j in range(bodies.shape[0]):
            slot = find_slot(indptr, indices, row, dof[bodies[j]])
            if slot >= 0:
                for k in range(size):
                    for m in range(size):
                        data[slot, k, m] += matrix[i * size + k, j * size + m]
