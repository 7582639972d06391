"""Minimum-degree order of the rows of a small block matrix."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def few_by_minimum_degree(indptr: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Order of the rows by minimum degree on the graph of the blocks, from a dense table of neighbours.

    All rows of the lowest degree that are not neighbours follow one another (multiple minimum degree: Liu, 1985). A
    chain is thus eliminated from both ends, with less round-off than from one end.

    Parameters
    ----------
    indptr, indices : (n + 1,), (m,) int arrays
        Columns of each row of a symmetric pattern with its diagonal.

    Returns
    -------
    (n,) int array
    """
    count = len(indptr) - 1
    near = np.zeros((count, count), dtype=np.bool_)
    degree, order = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    for row in range(count):
        for k in range(indptr[row], indptr[row + 1]):
            near[row, indices[k]] = True
        degree[row] = indptr[row + 1] - indptr[row]
    left, changed = np.ones(count, dtype=np.bool_), np.empty(count, dtype=np.bool_)
    done = 0
    while done < count:
        lowest = count + 1
        for row in range(count):
            changed[row] = False
            if left[row]:
                lowest = min(lowest, degree[row])
        first = done
        for pivot in range(count):
            if left[pivot] and not changed[pivot] and degree[pivot] == lowest:
                order[done] = pivot
                done += 1
                _eliminate(near, degree, changed, pivot)
        for k in range(first, done):
            left[order[k]] = False
    return order


@kernel
def _eliminate(near: np.ndarray, degree: np.ndarray, changed: np.ndarray, pivot: int) -> None:
    """Make all neighbours of a pivot neighbours of each other, and mark them as changed."""
    count = len(degree)
    for row in range(count):
        if not near[pivot, row]:
            continue
        changed[row] = True
        if row != pivot:
            degree[row] = 0
            for column in range(count):
                near[row, column] = (near[row, column] or near[pivot, column]) and column != pivot
                degree[row] += near[row, column]
