"""LU factorisation of block-sparse matrices on a fixed pattern, without row exchanges between blocks.

The rows of P A P^T are eliminated one after the other (IKJ order). Rows are exchanged only inside a pivot block. Blocks that
are exactly zero are skipped, so a pattern may contain blocks of possible contacts at little cost.

A pivot block S has factors M and N with M S N = I; its inverse N M would lose the digits of soft directions beside stiff
ones, the square of the condition number of S (Demmel, Higham and Schreiber, 1995). For a symmetric A only the upper triangle
is computed, which halves the work, and N = M^T E with E = diag(1, -1, ...). The number of negative eigenvalues of A is that
of the entries -1 in all E (Sylvester's law of inertia).
"""

from __future__ import annotations

import math

import numpy as np

from fsm.kernels import small_blocks as small
from fsm.kernels.jit import kernel

REFINE_ABOVE = 1e-10
"""Backward error above which a solution is refined."""
TRUST_BELOW = 1e-13
"""Backward error of a solution below which other solutions with the same factors are not checked."""
SYMMETRY_TOLERANCE = 1e-13
"""Largest asymmetry of a symmetric matrix; see `is_symmetric`."""
REFINEMENTS = 2
"""Largest number of refinements of a solution."""
MAX_ERROR = 1e-8
"""Largest admissible backward error after refinement; above it, pivoting inside blocks is not sufficient."""


@kernel(inline=True)
def _sort(values: np.ndarray, first: int, last: int) -> None:
    """Sort `values[first:last]` in place by Shell's method; the compilation of NumPy's sort would take a second."""
    gap = 1
    while 3 * gap < last - first:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(first + gap, last):
            value, j = values[i], i
            while j >= first + gap and values[j - gap] > value:
                values[j] = values[j - gap]
                j -= gap
            values[j] = value
        gap //= 3


@kernel
def fill_in(
    indptr: np.ndarray, indices: np.ndarray, order: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Pattern of L + U in the order of elimination, and positions of the blocks of A in it.

    Parameters
    ----------
    indptr, indices : pattern of A, structurally symmetric, with the diagonal
    order : (n,) int array
        order[i] is the row of A that is eliminated in step i.

    Returns
    -------
    indptr, indices : int arrays
        Rows of L + U, with sorted columns.
    diagonal : (n,) int array
        Position of each diagonal block.
    place : (n_blocks,) int array
        Position of each block of A.
    """
    count = order.shape[0]
    position = np.empty(count, dtype=np.int64)
    for i in range(count):
        position[order[i]] = i
    # columns to the right of the diagonal come from A and from the children in the elimination tree
    start = np.zeros(count + 1, dtype=np.int64)
    columns = np.empty(4 * indices.shape[0] + 16, dtype=np.int64)
    first_child = np.full(count, -1, dtype=np.int64)
    next_child = np.full(count, -1, dtype=np.int64)
    mark = np.full(count, -1, dtype=np.int64)
    size = 0
    for i in range(count):
        if size + count - i > columns.shape[0]:
            longer = np.empty(2 * columns.shape[0] + count, dtype=np.int64)
            for k in range(size):
                longer[k] = columns[k]
            columns = longer
        mark[i] = i
        row = order[i]
        for k in range(indptr[row], indptr[row + 1]):
            j = position[indices[k]]
            if j > i and mark[j] != i:
                mark[j] = i
                columns[size] = j
                size += 1
        child = first_child[i]
        while child >= 0:
            for k in range(start[child], start[child + 1]):
                j = columns[k]
                if mark[j] != i:
                    mark[j] = i
                    columns[size] = j
                    size += 1
            child = next_child[child]
        start[i + 1] = size
        _sort(columns, start[i], size)
        if size > start[i]:
            parent = columns[start[i]]
            next_child[i] = first_child[parent]
            first_child[parent] = i
    # complete rows: row j gets the columns i < j of all rows i that contain column j, in sorted order
    length = np.ones(count, dtype=np.int64)
    for i in range(count):
        length[i] += start[i + 1] - start[i]
        for k in range(start[i], start[i + 1]):
            length[columns[k]] += 1
    full = np.zeros(count + 1, dtype=np.int64)
    for i in range(count):
        full[i + 1] = full[i] + length[i]
    filled = np.empty(full[count], dtype=np.int64)
    diagonal = np.empty(count, dtype=np.int64)
    fill = full[:count].copy()
    for i in range(count):
        for k in range(start[i], start[i + 1]):
            j = columns[k]
            filled[fill[j]] = i
            fill[j] += 1
        # all columns to the left of the diagonal are complete now
        diagonal[i] = fill[i]
        filled[diagonal[i]] = i
        for k in range(start[i], start[i + 1]):
            filled[diagonal[i] + 1 + k - start[i]] = columns[k]
    place = np.empty(indices.shape[0], dtype=np.int64)
    for row in range(count):
        i = position[row]
        for k in range(full[i], full[i + 1]):
            mark[filled[k]] = k
        for k in range(indptr[row], indptr[row + 1]):
            place[k] = mark[position[indices[k]]]
    return full, filled, diagonal, place


@kernel(inline=True)
def _largest(block: np.ndarray) -> float:
    """Largest magnitude of the entries of a block."""
    largest = 0.0
    for a in range(block.shape[0]):
        for b in range(block.shape[1]):
            largest = max(largest, abs(block[a, b]))
    return largest


@kernel
def is_symmetric(
    data: np.ndarray, indptr: np.ndarray, indices: np.ndarray, transposed: np.ndarray, tolerance: float
) -> bool:
    """Whether block data define a symmetric matrix.

    Parameters
    ----------
    data : (n_blocks, d, d) array
    indptr, indices : pattern of the block rows
    transposed : (n_blocks,) int array
        Number of the block (j, i) for every block (i, j).
    tolerance : -
        Relative to the largest entry of the block (i, j), or to the geometric mean of the largest entries of the blocks
        (i, i) and (j, j) if this is larger: the round-off of a sum over elements is proportional to the stiffness of
        the elements, also where their stiffnesses cancel.
    """
    size, count = data.shape[1], indptr.shape[0] - 1
    own = np.zeros(count)
    for i in range(count):
        for k in range(indptr[i], indptr[i + 1]):
            if indices[k] == i:
                own[i] = _largest(data[k])
    for i in range(count):
        for k in range(indptr[i], indptr[i + 1]):
            other, j = transposed[k], indices[k]
            if j < i or (small.is_zero(data[k]) and small.is_zero(data[other])):
                continue
            bound = tolerance * max(_largest(data[k]), math.sqrt(own[i] * own[j]))
            for a in range(size):
                for b in range(size):
                    if not abs(data[k, a, b] - data[other, b, a]) <= bound:
                        return False
    return True


@kernel(inline=True)
def _find(indices: np.ndarray, low: int, high: int, column: int) -> int:
    """Position of an existing column among `indices[low:high]`."""
    while low < high:
        middle = (low + high) // 2
        if indices[middle] < column:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def factorise(
    data: np.ndarray,
    place: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    diagonal: np.ndarray,
    symmetric: bool,
    factors: np.ndarray,
) -> int:
    """Factorise P A P^T = L U with blocks M^-1 on the diagonal of L, and N^-1 on that of U.

    Parameters
    ----------
    data : (n_blocks, d, d) array
        Blocks of A, real or complex.
    place, indptr, indices, diagonal : results of `fill_in`
    symmetric : bool
        Whether A is symmetric; complex matrices must not use this.
    factors : (n_filled + n, d, d) array, changed in place
        Blocks of L and U, with M on the diagonal; then N. For a symmetric A, only U is computed.

    Returns
    -------
    int
        -1, or the number of a singular pivot block.
    """
    count, size, filled = diagonal.shape[0], data.shape[1], indices.shape[0]
    factors[:] = 0.0
    used = np.zeros(filled, dtype=np.bool_)
    for k in range(data.shape[0]):
        if not small.is_zero(data[k]):
            used[place[k]] = True
            for a in range(size):
                for b in range(size):
                    factors[place[k], a, b] = data[k, a, b]
    where = np.empty(count, dtype=np.int64)
    work = np.empty((size, size), dtype=factors.dtype)
    signs = np.empty((count, size))
    for i in range(count):
        for k in range(indptr[i], indptr[i + 1]):
            where[indices[k]] = k
        for k in range(indptr[i], diagonal[i]):
            pivot = indices[k]
            first = diagonal[pivot] + 1
            if symmetric:  # blocks to the left of the transposed block above the diagonal are not needed
                first = _find(indices, first, indptr[pivot + 1], i)
                if not used[first]:
                    continue
                for a in range(size):
                    for b in range(size):
                        work[b, a] = signs[pivot, a] * factors[first, a, b]
            else:
                if not used[k]:
                    continue
                _multiply(factors[k], factors[filled + pivot], work, factors[k])
                for a in range(size):
                    for b in range(size):
                        work[a, b] = factors[k, a, b]
            if size == 3:
                _subtract_row_of_3(work, indices, first, indptr[pivot + 1], where, used, factors)
                continue
            for m in range(first, indptr[pivot + 1]):
                if used[m]:
                    target = where[indices[m]]
                    used[target] = True
                    small.subtract_product(factors[target], work, factors[m])
        left, right = factors[diagonal[i]], factors[filled + i]
        if not (small.split_symmetric(left, right, work) if symmetric else small.split(left, right, work)):
            return i
        for a in range(size):
            signs[i, a] = small.sign_of_row(left, right, a) if symmetric else 1.0
        for m in range(diagonal[i] + 1, indptr[i + 1]):
            if used[m]:
                _multiply(left, factors[m], work, factors[m])
    return -1


@kernel(inline=True)
def _subtract_row_of_3(
    work: np.ndarray, indices: np.ndarray, first: int, last: int, where: np.ndarray, used: np.ndarray, factors: np.ndarray
) -> None:
    """Subtract `work` times the blocks `first` to `last` of a pivot row from the blocks of their columns in another row, for
    blocks of 3 x 3. Each block is read as a whole before a store, which for the compiler may change the others.
    """
    a00, a01, a02 = work[0, 0], work[0, 1], work[0, 2]
    a10, a11, a12 = work[1, 0], work[1, 1], work[1, 2]
    a20, a21, a22 = work[2, 0], work[2, 1], work[2, 2]
    for m in range(first, last):
        if used[m]:
            t = where[indices[m]]
            used[t] = True
            b00, b01, b02 = factors[m, 0, 0], factors[m, 0, 1], factors[m, 0, 2]
            b10, b11, b12 = factors[m, 1, 0], factors[m, 1, 1], factors[m, 1, 2]
            b20, b21, b22 = factors[m, 2, 0], factors[m, 2, 1], factors[m, 2, 2]
            c00 = factors[t, 0, 0] - (a00 * b00 + a01 * b10 + a02 * b20)
            c01 = factors[t, 0, 1] - (a00 * b01 + a01 * b11 + a02 * b21)
            c02 = factors[t, 0, 2] - (a00 * b02 + a01 * b12 + a02 * b22)
            c10 = factors[t, 1, 0] - (a10 * b00 + a11 * b10 + a12 * b20)
            c11 = factors[t, 1, 1] - (a10 * b01 + a11 * b11 + a12 * b21)
            c12 = factors[t, 1, 2] - (a10 * b02 + a11 * b12 + a12 * b22)
            c20 = factors[t, 2, 0] - (a20 * b00 + a21 * b10 + a22 * b20)
            c21 = factors[t, 2, 1] - (a20 * b01 + a21 * b11 + a22 * b21)
            c22 = factors[t, 2, 2] - (a20 * b02 + a21 * b12 + a22 * b22)
            factors[t, 0, 0], factors[t, 0, 1], factors[t, 0, 2] = c00, c01, c02
            factors[t, 1, 0], factors[t, 1, 1], factors[t, 1, 2] = c10, c11, c12
            factors[t, 2, 0], factors[t, 2, 1], factors[t, 2, 2] = c20, c21, c22


@kernel(inline=True)
def _multiply(a: np.ndarray, b: np.ndarray, work: np.ndarray, out: np.ndarray) -> None:
    """out = a b; `out` may be a or b."""
    size = out.shape[0]
    for i in range(size):
        for j in range(size):
            work[i, j] = 0.0
    small.subtract_product(work, a, b)
    for i in range(size):
        for j in range(size):
            out[i, j] = -work[i, j]


@kernel
def count_negative(diagonal: np.ndarray, factors: np.ndarray) -> int:
    """Number of negative eigenvalues of a symmetric A from its factors."""
    total, filled = 0, factors.shape[0] - diagonal.shape[0]
    for i in range(diagonal.shape[0]):
        for a in range(factors.shape[1]):
            if small.sign_of_row(factors[diagonal[i]], factors[filled + i], a) < 0.0:
                total += 1
    return total


@kernel
def count_negative_parts(diagonal: np.ndarray, factors: np.ndarray) -> int:
    """Number of negative eigenvalues of the symmetric parts of all pivot blocks of an unsymmetric A, from their inverses."""
    size, total, filled = factors.shape[1], 0, factors.shape[0] - diagonal.shape[0]
    inverse, work = np.empty((size, size)), np.empty((size, size))
    left, right = np.empty((size, size)), np.empty((size, size))
    for i in range(diagonal.shape[0]):
        _multiply(factors[filled + i], factors[diagonal[i]], work, inverse)
        total += small.negative_eigenvalues(inverse, left, right, work)
    return total


@kernel(inline=True)
def _add_products(factors: np.ndarray, indices: np.ndarray, first: int, last: int, y: np.ndarray, out: np.ndarray) -> None:
    """Add the products of the blocks `first` to `last` with the rows of y (n, d) of their columns. For blocks of 3 x 3, the
    result is stored once, because for the compiler each store may change the blocks and y.
    """
    if factors.shape[1] == 3:
        x0, x1, x2 = out[0], out[1], out[2]
        for k in range(first, last):
            y0, y1, y2 = y[indices[k], 0], y[indices[k], 1], y[indices[k], 2]
            x0 = x0 + factors[k, 0, 0] * y0 + factors[k, 0, 1] * y1 + factors[k, 0, 2] * y2
            x1 = x1 + factors[k, 1, 0] * y0 + factors[k, 1, 1] * y1 + factors[k, 1, 2] * y2
            x2 = x2 + factors[k, 2, 0] * y0 + factors[k, 2, 1] * y1 + factors[k, 2, 2] * y2
        out[0], out[1], out[2] = x0, x1, x2
        return
    for k in range(first, last):
        small.add_product(out, factors[k], y[indices[k]])


@kernel(inline=True)
def _subtract_transposed(
    factors: np.ndarray, indices: np.ndarray, first: int, last: int, x: np.ndarray, y: np.ndarray
) -> None:
    """Subtract the products of the transposed blocks `first` to `last` with x (d,) from the rows of y (n, d)."""
    if factors.shape[1] == 3:
        x0, x1, x2 = x[0], x[1], x[2]
        for k in range(first, last):
            j = indices[k]
            y0 = y[j, 0] - factors[k, 0, 0] * x0 - factors[k, 1, 0] * x1 - factors[k, 2, 0] * x2
            y1 = y[j, 1] - factors[k, 0, 1] * x0 - factors[k, 1, 1] * x1 - factors[k, 2, 1] * x2
            y2 = y[j, 2] - factors[k, 0, 2] * x0 - factors[k, 1, 2] * x1 - factors[k, 2, 2] * x2
            y[j, 0], y[j, 1], y[j, 2] = y0, y1, y2
        return
    for k in range(first, last):
        small.subtract_transposed(y[indices[k]], factors[k], x)


@kernel
def _solve_factorised(
    order: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    diagonal: np.ndarray,
    factors: np.ndarray,
    right: np.ndarray,
) -> np.ndarray:
    """Solve A x = b with the factors of `factorise`; b and x are (n d,)."""
    count, size, filled = diagonal.shape[0], factors.shape[1], indices.shape[0]
    y = np.empty((count, size), dtype=factors.dtype)
    x = np.empty(count * size, dtype=factors.dtype)
    total, rest = np.empty(size, dtype=factors.dtype), np.empty(size, dtype=factors.dtype)
    for i in range(count):
        for a in range(size):
            total[a] = -right[order[i] * size + a]
            y[i, a] = 0.0
        _add_products(factors, indices, indptr[i], diagonal[i], y, total)
        for a in range(size):
            total[a] = -total[a]
        small.add_product(y[i], factors[diagonal[i]], total)
    for i in range(count - 1, -1, -1):
        for a in range(size):
            rest[a] = -y[i, a]
            total[a] = 0.0
        _add_products(factors, indices, diagonal[i] + 1, indptr[i + 1], y, rest)
        for a in range(size):
            rest[a] = -rest[a]
        small.add_product(total, factors[filled + i], rest)
        for a in range(size):
            y[i, a] = total[a]
            x[order[i] * size + a] = total[a]
    return x


@kernel
def _solve_symmetric(
    order: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    diagonal: np.ndarray,
    factors: np.ndarray,
    right: np.ndarray,
) -> np.ndarray:
    """Solve as `_solve_factorised` for a symmetric A, but read only the upper factors, which are half of all factors."""
    count, size, filled = diagonal.shape[0], factors.shape[1], indices.shape[0]
    y = np.empty((count, size), dtype=factors.dtype)
    x = np.empty(count * size, dtype=factors.dtype)
    total = np.empty(size, dtype=factors.dtype)
    for i in range(count):
        for a in range(size):
            y[i, a] = right[order[i] * size + a]
    for i in range(count):
        for a in range(size):
            total[a] = 0.0
        small.add_product(total, factors[diagonal[i]], y[i])
        for a in range(size):
            y[i, a] = total[a]
            total[a] *= small.sign_of_row(factors[diagonal[i]], factors[filled + i], a)
        _subtract_transposed(factors, indices, diagonal[i] + 1, indptr[i + 1], total, y)
    for i in range(count - 1, -1, -1):
        for a in range(size):
            total[a] = 0.0
        _add_products(factors, indices, diagonal[i] + 1, indptr[i + 1], y, total)
        for a in range(size):
            y[i, a] -= total[a]
            total[a] = 0.0
        small.add_product(total, factors[filled + i], y[i])
        for a in range(size):
            y[i, a] = total[a]
            x[order[i] * size + a] = total[a]
    return x


@kernel
def multiply_blocks(indptr: np.ndarray, indices: np.ndarray, data: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Product A x, (n d,)."""
    size = data.shape[1]
    out = np.zeros(x.shape[0], dtype=x.dtype)
    for i in range(indptr.shape[0] - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            for a in range(size):
                for b in range(size):
                    out[i * size + a] += data[k, a, b] * x[j * size + b]
    return out


@kernel
def backward_error(
    indptr: np.ndarray, indices: np.ndarray, data: np.ndarray, x: np.ndarray, right: np.ndarray, residual: np.ndarray
) -> float:
    """Largest |b - A x|_i / (|A| |x| + |b|)_i, NaN if x contains NaN; b - A x is written to `residual` (n d,)."""
    size = data.shape[1]
    worst = 0.0
    total, scale = np.empty(size, dtype=residual.dtype), np.empty(size)
    for i in range(indptr.shape[0] - 1):
        for a in range(size):
            total[a] = right[i * size + a]
            scale[a] = abs(total[a])
        for k in range(indptr[i], indptr[i + 1]):
            if small.is_zero(data[k]):
                continue
            first = indices[k] * size
            small.subtract_terms(total, scale, data[k], x[first : first + size])
        for a in range(size):
            residual[i * size + a] = total[a]
            if scale[a] > 0.0:
                error = abs(total[a]) / scale[a]
                if not error <= worst:
                    worst = error
    return worst


@kernel
def solve_refined(
    order: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    diagonal: np.ndarray,
    factors: np.ndarray,
    rows: np.ndarray,
    columns: np.ndarray,
    data: np.ndarray,
    right: np.ndarray,
    refine_above: float,
    symmetric: bool,
    trusted: bool,
) -> tuple[np.ndarray, float, bool]:
    """Solve A x = b with the factors of `factorise`, refined at most twice while the backward error is above `refine_above`.

    Factors of a nearly symmetric A are those of its upper triangle. In a row whose terms are all round-off, such as one
    across the plane of a plane motion, the difference counts, and one refinement may be too little.

    Parameters
    ----------
    order, indptr, indices, diagonal, factors : results of `fill_in` and `factorise`
    rows, columns, data : pattern (indptr and indices) and blocks of A
    right : (n d,) array
        Right-hand side b.
    refine_above : float
        Largest backward error without refinement.
    symmetric : bool
        The value given to `factorise`.
    trusted : bool
        Whether to skip the backward error and refinement.

    Returns
    -------
    x : (n d,) array
    error : float
        Backward error of x; 0 if it is skipped.
    doubtful : bool
        Whether other solutions with the same factors must be checked.
    """
    residual = np.empty(right.shape[0], dtype=factors.dtype)
    if symmetric:
        x = _solve_symmetric(order, indptr, indices, diagonal, factors, right)
    else:
        x = _solve_factorised(order, indptr, indices, diagonal, factors, right)
    if trusted:
        return x, 0.0, False
    error = backward_error(rows, columns, data, x, right, residual)
    doubtful = not error <= TRUST_BELOW
    for _ in range(REFINEMENTS):
        if not error > refine_above:
            break
        if symmetric:
            x += _solve_symmetric(order, indptr, indices, diagonal, factors, residual)
        else:
            x += _solve_factorised(order, indptr, indices, diagonal, factors, residual)
        error = backward_error(rows, columns, data, x, right, residual)
    return x, error, doubtful
