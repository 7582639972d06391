"""Multifrontal LDL^T factorisation of symmetric block-sparse matrices, in dense products of matrices.

Rows with nearly equal patterns form a supernode. The front of a supernode is the dense matrix of its own rows and of all
later rows that they couple. The front sums the entries of A and the Schur complements of its children in the elimination
tree. The supernode's own rows are eliminated, and the Schur complement of the others goes to its parent (Duff and Reid,
1983; Liu, 1992). Rows are exchanged only inside a panel, a few blocks of a supernode.

The method has more operations than `fsm.kernels.block_lu`, since it does not skip zeros, but products of long matrices run
several times as fast as products of blocks. A pivot S has a factor M with M S M^T = E = diag(1, -1, ...), because with
S^-1 the digits of soft directions beside stiff ones would be lost (`fsm.kernels.block_lu`). The number of negative
eigenvalues of A is that of the entries -1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.block_lu import REFINEMENTS, TRUST_BELOW, backward_error
from fsm.kernels.jit import kernel
from fsm.kernels.small_blocks import is_zero, sign_of_row, split_symmetric

_STRIP = 48
"""Rows of the Schur complement that are computed at once, up to the diagonal of the last one."""


class Supernodes(NamedTuple):
    """Symbolic factorisation: m supernodes, children before parents.

    Attributes
    ----------
    order : (n,) int array
        Elimination order of the block rows.
    first : (m + 1,) int array
        Supernode s eliminates the steps first[s] to first[s + 1] - 1.
    start, rows : (m + 1,) and int arrays
        Later steps that supernode s couples: rows[start[s]:start[s + 1]], sorted.
    children : (m,) int array
        Number of children in the elimination tree.
    factors : (m + 1,) int array
        First number of each supernode in the factors. A panel of w rows, with pivot S, and of r later rows, with column C,
        has the factor M (w, w) of M S M^T = E, and then C M^T (r, w). The signs in E of all own rows come last.
    size, width : int
        Rows of a block, and largest number of blocks of a panel.
    largest, stacked : int
        Rows of the largest front, and numbers in the largest stack of Schur complements.
    """

    order: np.ndarray
    first: np.ndarray
    start: np.ndarray
    rows: np.ndarray
    children: np.ndarray
    factors: np.ndarray
    size: int
    width: int
    largest: int
    stacked: int


@kernel
def count_nonzero(data: np.ndarray) -> int:
    """Number of blocks (n_blocks, d, d) that are not exactly zero."""
    count = 0
    for k in range(data.shape[0]):
        if not is_zero(data[k]):
            count += 1
    return count


@kernel
def _add_entries(
    indptr: np.ndarray, indices: np.ndarray, data: np.ndarray, order: np.ndarray, position: np.ndarray,
    first: int, last: int, local: np.ndarray, front: np.ndarray,
) -> None:  # fmt: skip
    """Write the blocks of A at and below the diagonal in the columns of the steps `first` to `last` - 1."""
    size = data.shape[1]
    for step in range(first, last):
        for k in range(indptr[order[step]], indptr[order[step] + 1]):
            other = position[indices[k]]
            if other >= step:
                row, column = local[other] * size, (step - first) * size
                for a in range(size):
                    for b in range(size):
                        front[row + b, column + a] = data[k, a, b]


@kernel
def _add_child(rows: np.ndarray, local: np.ndarray, size: int, child: np.ndarray, front: np.ndarray) -> None:
    """Add the lower triangle of the Schur complement of a child, whose rows belong to the steps `rows`."""
    for i in range(rows.shape[0]):
        for a in range(size):
            row = local[rows[i]] * size + a
            for j in range(i + 1):
                column = local[rows[j]] * size
                for b in range(size):
                    front[row, column + b] += child[i * size + a, j * size + b]


@kernel
def _eliminate(own: int, step: int, size: int, front: np.ndarray, work: np.ndarray, factors: np.ndarray) -> bool:
    """Eliminate the first `own` rows of a front in panels of `step` rows; write the factors, return False if singular."""
    spare, at, signs = np.empty((2, step * step)), 0, factors[factors.shape[0] - own :]
    for begin in range(0, own, step):
        end = min(begin + step, own)
        width, below = end - begin, front.shape[0] - end
        pivot = factors[at : at + width * width].reshape(width, width)
        for i in range(width):
            for j in range(i // size * size + size):
                pivot[i, j] = pivot[j, i] = front[begin + i, begin + j]
        other = spare[0, : width * width].reshape(width, width)
        if not split_symmetric(pivot, other, spare[1, : width * width].reshape(width, width)):
            return False
        for i in range(width):
            signs[begin + i] = sign_of_row(pivot, other, i)
        at += width * width
        column = factors[at : at + below * width].reshape(below, width)
        at += below * width
        if below == 0:
            break
        weighed = work[: below * width].reshape(below, width)
        for i in range(below):
            for j in range(width):
                weighed[i, j] = front[end + i, begin + j]
        np.dot(weighed, pivot.T, column)
        for i in range(below):
            for j in range(width):
                weighed[i, j] = signs[begin + j] * column[i, j]
        for top in range(0, below, _STRIP):
            bottom = min(top + _STRIP, below)
            change = work[below * width : below * width + (bottom - top) * bottom].reshape(bottom - top, bottom)
            np.dot(weighed[top:bottom], column[:bottom].T, change)
            for i in range(top, bottom):
                for j in range(bottom):
                    front[end + i, end + j] -= change[i - top, j]
    return True


@kernel
def factorise_fronts(
    nodes: Supernodes, indptr: np.ndarray, indices: np.ndarray, data: np.ndarray, factors: np.ndarray
) -> int:
    """Factorise a symmetric A.

    Parameters
    ----------
    nodes : Supernodes
    indptr, indices, data : pattern and (n_blocks, d, d) blocks of A
    factors : (nodes.factors[-1],) array, changed in place

    Returns
    -------
    int
        -1, or the number of a supernode with a singular pivot.
    """
    size, count, step = nodes.size, nodes.order.shape[0], nodes.width * nodes.size
    position, local = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    for i in range(count):
        position[nodes.order[i]] = i
    space, stack = np.empty(nodes.largest * nodes.largest), np.empty(nodes.stacked)
    work = np.empty(nodes.largest * (step + _STRIP))
    waiting, held, top = np.empty(nodes.children.shape[0], dtype=np.int64), 0, 0
    for s in range(nodes.children.shape[0]):
        first, last = nodes.first[s], nodes.first[s + 1]
        rows = nodes.rows[nodes.start[s] : nodes.start[s + 1]]
        own = (last - first) * size
        whole = own + rows.shape[0] * size
        front = space[: whole * whole].reshape(whole, whole)
        for i in range(whole):
            for j in range(i // size * size + size):
                front[i, j] = 0.0
        for i in range(first, last):
            local[i] = i - first
        for i in range(rows.shape[0]):
            local[rows[i]] = last - first + i
        _add_entries(indptr, indices, data, nodes.order, position, first, last, local, front)
        for _ in range(nodes.children[s]):
            held -= 1
            child = waiting[held]
            below = nodes.rows[nodes.start[child] : nodes.start[child + 1]]
            length = below.shape[0] * size
            top -= length * length
            _add_child(below, local, size, stack[top : top + length * length].reshape(length, length), front)
        if not _eliminate(own, step, size, front, work, factors[nodes.factors[s] : nodes.factors[s + 1]]):
            return s
        length = whole - own
        rest = stack[top : top + length * length].reshape(length, length)
        for i in range(length):
            for j in range(i // size * size + size):
                rest[i, j] = front[own + i, own + j]
        top += length * length
        waiting[held] = s
        held += 1
    return -1


@kernel
def _gather(nodes: Supernodes, s: int, y: np.ndarray, part: np.ndarray) -> int:
    """Write the rows of y (n d, k) of a supernode's own steps and of its rows to `part`; return how many are its own."""
    size, first, own = nodes.size, nodes.first[s], (nodes.first[s + 1] - nodes.first[s]) * nodes.size
    for i in range(own):
        for c in range(y.shape[1]):
            part[i, c] = y[first * size + i, c]
    for k in range(nodes.start[s], nodes.start[s + 1]):
        for a in range(size):
            for c in range(y.shape[1]):
                part[own + (k - nodes.start[s]) * size + a, c] = y[nodes.rows[k] * size + a, c]
    return int(own)


@kernel
def _signed(signs: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Rows of (w, k) numbers times their signs."""
    out = np.empty(part.shape)
    for i in range(part.shape[0]):
        for c in range(part.shape[1]):
            out[i, c] = signs[i] * part[i, c]
    return out


@kernel
def solve_columns(nodes: Supernodes, factors: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve A X = B with the factors of `factorise_fronts`; B and X are (n d, k)."""
    size, count, step, columns = nodes.size, nodes.order.shape[0], nodes.width * nodes.size, right.shape[1]
    y, part = np.empty((count * size, columns)), np.empty((nodes.largest, columns))
    for i in range(count):
        for a in range(size):
            for c in range(columns):
                y[i * size + a, c] = right[nodes.order[i] * size + a, c]
    for s in range(nodes.children.shape[0]):
        own, at = _gather(nodes, s, y, part), nodes.factors[s]
        whole = own + (nodes.start[s + 1] - nodes.start[s]) * size
        signs = factors[nodes.factors[s + 1] - own : nodes.factors[s + 1]]
        for begin in range(0, own, step):
            end = min(begin + step, own)
            width, below = end - begin, whole - end
            pivot = factors[at : at + width * width].reshape(width, width)
            at += width * width
            column = factors[at : at + below * width].reshape(below, width)
            at += below * width
            part[begin:end] = np.dot(pivot, part[begin:end])
            if below > 0:
                part[end:whole] -= np.dot(column, _signed(signs[begin:end], part[begin:end]))
        for i in range(own):
            for c in range(columns):
                y[nodes.first[s] * size + i, c] = part[i, c]
        for k in range(nodes.start[s], nodes.start[s + 1]):
            for a in range(size):
                for c in range(columns):
                    y[nodes.rows[k] * size + a, c] = part[own + (k - nodes.start[s]) * size + a, c]
    for s in range(nodes.children.shape[0] - 1, -1, -1):
        own = _gather(nodes, s, y, part)
        whole, at = own + (nodes.start[s + 1] - nodes.start[s]) * size, nodes.factors[s + 1] - own
        signs = factors[at : at + own]
        for begin in range((own - 1) // step * step, -1, -step):
            end = min(begin + step, own)
            width, below = end - begin, whole - end
            at -= below * width
            column = factors[at : at + below * width].reshape(below, width)
            at -= width * width
            pivot = factors[at : at + width * width].reshape(width, width)
            if below > 0:
                part[begin:end] -= np.dot(column.T, part[end:whole])
            part[begin:end] = np.dot(pivot.T, _signed(signs[begin:end], part[begin:end]))
        for i in range(own):
            for c in range(columns):
                y[nodes.first[s] * size + i, c] = part[i, c]
    x = np.empty((count * size, columns))
    for i in range(count):
        for a in range(size):
            for c in range(columns):
                x[nodes.order[i] * size + a, c] = y[i * size + a, c]
    return x


@kernel
def solve_by_fronts(
    nodes: Supernodes,
    factors: np.ndarray,
    rows: np.ndarray,
    columns: np.ndarray,
    data: np.ndarray,
    right: np.ndarray,
    refine_above: float,
    trusted: bool,
) -> tuple[np.ndarray, float, bool]:
    """Solve A x = b with the factors of `factorise_fronts`; see `fsm.kernels.block_lu.solve_refined`."""
    x = solve_columns(nodes, factors, right.reshape(-1, 1)).reshape(-1)
    if trusted:
        return x, 0.0, False
    residual = np.empty(right.shape[0])
    error = backward_error(rows, columns, data, x, right, residual)
    doubtful = not error <= TRUST_BELOW
    for _ in range(REFINEMENTS):
        if not error > refine_above:
            break
        x += solve_columns(nodes, factors, residual.reshape(-1, 1)).reshape(-1)
        error = backward_error(rows, columns, data, x, right, residual)
    return x, error, doubtful


@kernel
def count_negative_pivots(nodes: Supernodes, factors: np.ndarray) -> int:
    """Number of negative eigenvalues of A from the signs of its pivots."""
    total = 0
    for s in range(nodes.children.shape[0]):
        own = (nodes.first[s + 1] - nodes.first[s]) * nodes.size
        for k in range(nodes.factors[s + 1] - own, nodes.factors[s + 1]):
            if factors[k] < 0.0:
                total += 1
    return total
