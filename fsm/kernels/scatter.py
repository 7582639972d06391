"""Assembly of element forces into body forces, and of element tangents into the block matrix.

Sums and products of block data: effective stiffness K + c D T, and multiplication by a block diagonal matrix.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.small_blocks import is_zero
from fsm.kernels.tensor import Matrix


@kernel
def scatter_efforts(
    bodies: np.ndarray, gradient: np.ndarray, effort: np.ndarray, count: int, force: np.ndarray
) -> None:
    """Add the generalised forces -e_k dm_k/dx of several interactions to the forces on their bodies.

    Parameters
    ----------
    bodies : (m, b) int array
        Bodies of each interaction. An interaction's coordinates x are those of the bodies in this order.
    gradient : (m, k, b d) array
        dm_k/dx of each measure of deformation.
    effort : (m, k) array
        Effort conjugate to each measure; a positive effort resists an increase of the measure.
    count : int
        Number of interactions to add, from the first.
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
    """Position of block (row, column) in a block-sparse pattern with sorted columns; -1 if it is absent."""
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
    """Add one element matrix to the block-sparse matrix, without the bodies that have no degrees of freedom.

    Parameters
    ----------
    matrix : (b d, b d) array
    dof : (n_bodies,) int array
        Block number of each body, -1 for a body without degrees of freedom.
    bodies : (b,) int array
        Bodies of the element. The blocks of a repeated body add up.
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


@kernel
def pair_slots(bodies: np.ndarray, dof: np.ndarray, indptr: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Positions (m, 4) of the blocks (a, a), (a, b), (b, a), (b, b) of pairs of bodies (m, 2); -1 for an absent block."""
    slots = np.empty((bodies.shape[0], 4), dtype=np.int64)
    for i in range(bodies.shape[0]):
        for j in range(2):
            for k in range(2):
                slots[i, 2 * j + k] = find_slot(indptr, indices, dof[bodies[i, j]], dof[bodies[i, k]])
    return slots


@kernel(inline=True)
def _add_planar(
    flat: np.ndarray, slot: int, sign_row: float, sign_column: float,
    xx: float, xz: float, zx: float, zz: float, xt: float, zt: float, tx: float, tz: float, tt: float,
) -> None:  # fmt: skip
    """Add a block (x, z, rotation) to the flattened block data; the signs multiply its displacement rows and columns."""
    if slot < 0:
        return
    block = flat[9 * slot : 9 * slot + 9]
    sign = sign_row * sign_column
    block[0] += sign * xx
    block[1] += sign * xz
    block[2] += sign_row * xt
    block[3] += sign * zx
    block[4] += sign * zz
    block[5] += sign_row * zt
    block[6] += sign_column * tx
    block[7] += sign_column * tz
    block[8] += tt


@kernel(inline=True)
def add_quarters_planar(
    flat: np.ndarray, slots: np.ndarray,
    vv: tuple[float, float, float, float],
    va: tuple[float, float], vb: tuple[float, float], av: tuple[float, float], bv: tuple[float, float],
    aa: float, ab: float, ba: float, bb: float,
) -> None:  # fmt: skip
    """Add the matrix of a plane element between bodies a and b to the block data.

    The forces of the element depend only on the relative displacement and on the rotations of both bodies.

    Parameters
    ----------
    flat : (9 n_blocks,) array, changed in place
        Flattened block data.
    slots : (4,) int array, a row of `pair_slots`
    vv : tuple
        Entries xx, xz, zx, zz of the relative displacement.
    va, vb, av, bv : tuples
        Entries of the displacement (x, z) and the rotation of a body, by row and column. Entries of the displacement of
        body b have the opposite sign.
    aa, ab, ba, bb : floats
        Entries of the rotations.
    """
    xx, xz, zx, zz = vv
    _add_planar(flat, slots[0], 1.0, 1.0, xx, xz, zx, zz, va[0], va[1], av[0], av[1], aa)
    _add_planar(flat, slots[1], 1.0, -1.0, xx, xz, zx, zz, vb[0], vb[1], av[0], av[1], ab)
    _add_planar(flat, slots[2], -1.0, 1.0, xx, xz, zx, zz, va[0], va[1], bv[0], bv[1], ba)
    _add_planar(flat, slots[3], -1.0, -1.0, xx, xz, zx, zz, vb[0], vb[1], bv[0], bv[1], bb)


@kernel(inline=True)
def _add_spatial(
    flat: np.ndarray, slot: int, sign_row: float, sign_column: float, vv: Matrix, vt: Matrix, tv: Matrix, tt: Matrix
) -> None:
    """Add a block (displacement, rotation) to the flattened block data; the signs are as in `_add_planar`."""
    if slot < 0:
        return
    block = flat[36 * slot : 36 * slot + 36]
    sign = sign_row * sign_column
    for j in range(3):
        for k in range(3):
            block[6 * j + k] += sign * vv[3 * j + k]
            block[6 * j + 3 + k] += sign_row * vt[3 * j + k]
            block[18 + 6 * j + k] += sign_column * tv[3 * j + k]
            block[21 + 6 * j + k] += tt[3 * j + k]


@kernel(inline=True)
def add_quarters_spatial(
    flat: np.ndarray, slots: np.ndarray,
    vv: Matrix, va: Matrix, vb: Matrix, av: Matrix, bv: Matrix, aa: Matrix, ab: Matrix, ba: Matrix, bb: Matrix,
) -> None:  # fmt: skip
    """Spatial version of `add_quarters_planar`: `flat` (36 n_blocks,), relative displacement v, rotations a and b."""
    _add_spatial(flat, slots[0], 1.0, 1.0, vv, va, av, aa)
    _add_spatial(flat, slots[1], 1.0, -1.0, vv, vb, av, ab)
    _add_spatial(flat, slots[2], -1.0, 1.0, vv, va, bv, ba)
    _add_spatial(flat, slots[3], -1.0, -1.0, vv, vb, bv, bb)


@kernel(inline=True)
def add_turn_planar(flat: np.ndarray, slots: np.ndarray, value: float) -> None:
    """Add the matrix of a plane element that depends only on the relative rotation; see `add_quarters_planar`."""
    for j in range(4):
        if slots[j] >= 0:
            flat[9 * slots[j] + 8] += value if j == 0 or j == 3 else -value


@kernel(inline=True)
def add_turns_spatial(flat: np.ndarray, slots: np.ndarray, aa: Matrix, ab: Matrix, ba: Matrix, bb: Matrix) -> None:
    """Add the matrix of a spatial element that depends only on rotations; see `add_quarters_spatial`."""
    _add_turns(flat, slots[0], aa)
    _add_turns(flat, slots[1], ab)
    _add_turns(flat, slots[2], ba)
    _add_turns(flat, slots[3], bb)


@kernel(inline=True)
def _add_turns(flat: np.ndarray, slot: int, tt: Matrix) -> None:
    """Add the block of the rotations."""
    if slot < 0:
        return
    block = flat[36 * slot : 36 * slot + 36]
    for j in range(3):
        for k in range(3):
            block[21 + 6 * j + k] += tt[3 * j + k]


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
