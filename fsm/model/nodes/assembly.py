"""Gathering of element coordinates, and assembly of element forces and matrices, for all ANCF kernels."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot


@kernel
def slots_of(vectors: np.ndarray, size: int, indptr: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Positions (m, v, v), in the flat block data, of the first entry of the block of two vectors of an element."""
    count, width = vectors.shape
    slots = np.empty((count, width, width), dtype=np.int64)
    for e in range(count):
        for i in range(width):
            row, a = divmod(vectors[e, i], size)
            for j in range(width):
                column, b = divmod(vectors[e, j], size)
                slots[e, i, j] = find_slot(indptr, indices, row, column) * size * size + a * size + b
    return slots


@kernel(inline=True)
def gather(vectors: np.ndarray, scale: np.ndarray, q: np.ndarray, e: np.ndarray) -> None:
    """Gather the coordinates of one element into e (3, v), each vector multiplied by its scale (v,)."""
    for i in range(vectors.shape[0]):
        first = vectors[i]
        for a in range(3):
            e[a, i] = scale[i] * q[first + a]


@kernel(inline=True)
def scatter_force(vectors: np.ndarray, scale: np.ndarray, sign: float, element: np.ndarray, force: np.ndarray) -> None:
    """Add sign * element (3, v) to the forces (n,)."""
    for i in range(vectors.shape[0]):
        first = vectors[i]
        for a in range(3):
            force[first + a] += sign * scale[i] * element[a, i]


@kernel(inline=True)
def scatter_matrix(slots: np.ndarray, scale: np.ndarray, size: int, element: np.ndarray, flat: np.ndarray) -> None:
    """Add an element matrix (3, 3, v, v) to the flat block data; `slots` (v, v) as returned by `slots_of`."""
    width = slots.shape[0]
    for i in range(width):
        for j in range(width):
            factor = scale[i] * scale[j]
            slot = slots[i, j]
            for a in range(3):
                for b in range(3):
                    flat[slot + a * size + b] += factor * element[a, b, i, j]


@kernel(inline=True)
def weigh_stretch(
    rows: np.ndarray, first: int, stride: int, hessian: np.ndarray, symmetric: bool, weighed: np.ndarray
) -> None:
    """Compute products of the second derivatives at one point with the two rows of this point in the table, for
    `contract`.

    Parameters
    ----------
    rows : (k, 12) array
        Table of the derivatives of the shape functions at all points.
    first, stride : the rows of this point are first, first + stride, ...
    hessian : (6, 6) array
    symmetric : whether the second derivatives are symmetric; pairs (a, b) with a > b are then skipped
    weighed : (k, 6 or 9, 12) array
        Output: the rows of this point, for each pair of components (a, b); with 6 pairs only a <= b.
    """
    row0, row1 = rows[first], rows[first + stride]
    pair = 0
    for a in range(3):
        for b in range(a if symmetric else 0, 3):
            for p in range(2):
                out = weighed[first + p * stride, pair]
                f0, f1 = hessian[3 * p + a, b], hessian[3 * p + a, 3 + b]
                for j in range(12):
                    out[j] = f0 * row0[j] + f1 * row1[j]
            pair += 1


@kernel(inline=True)
def weigh_bending(
    rows: np.ndarray, first: int, stride: int, hessian: np.ndarray, symmetric: bool, weighed: np.ndarray
) -> None:
    """Compute the products of `weigh_stretch` with five rows and a hessian (15, 15); all sums in one expression."""
    row0, row1, row2 = rows[first], rows[first + stride], rows[first + 2 * stride]
    row3, row4 = rows[first + 3 * stride], rows[first + 4 * stride]
    pair = 0
    for a in range(3):
        for b in range(a if symmetric else 0, 3):
            for p in range(5):
                out = weighed[first + p * stride, pair]
                i = 3 * p + a
                f0, f1, f2, f3, f4 = (
                    hessian[i, b], hessian[i, 3 + b], hessian[i, 6 + b], hessian[i, 9 + b], hessian[i, 12 + b],
                )  # fmt: skip
                for j in range(12):
                    out[j] = ((f0 * row0[j] + f1 * row1[j]) + (f2 * row2[j] + f3 * row3[j])) + f4 * row4[j]
            pair += 1


@kernel(inline=True)
def contract(
    columns: np.ndarray, weighed: np.ndarray, symmetric: bool, products: np.ndarray, matrix: np.ndarray
) -> None:
    """Element matrix (3, 3, v, v) of all points and pairs of components, as one matrix product; `products` is scratch."""
    np.dot(columns, weighed.reshape(weighed.shape[0], -1), products)
    width = matrix.shape[2]
    first = 0
    for a in range(3):
        for b in range(a if symmetric else 0, 3):
            for i in range(width):
                for j in range(width):
                    value = products[i, first + j]
                    matrix[a, b, i, j] = value
                    if symmetric:
                        matrix[b, a, j, i] = value
            first += width
