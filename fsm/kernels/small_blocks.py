"""Products, factors and eigenvalue signs of small dense blocks, for the block LU factorisation.

Linear equations with a small dense matrix.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.kernels.jit import kernel

_ONE_BY_ONE = (1.0 + 17.0**0.5) / 8.0
"""Entry of the diagonal over the largest other entry, from which it is a pivot of its own."""
_DEFINITE = 1e-12
"""Smallest pivot of Cholesky's factorisation of a block whose diagonal is about 1."""


@kernel(inline=True)
def subtract_product(out: np.ndarray, a: np.ndarray, b: np.ndarray) -> None:
    """out -= a b; common sizes have loops of fixed length, which the compiler unrolls."""
    size = out.shape[0]
    if size == 3:
        # all entries of b are read first: for the compiler, a store to `out` may change them
        b00, b01, b02 = b[0, 0], b[0, 1], b[0, 2]
        b10, b11, b12 = b[1, 0], b[1, 1], b[1, 2]
        b20, b21, b22 = b[2, 0], b[2, 1], b[2, 2]
        for i in range(3):
            x, y, z = a[i, 0], a[i, 1], a[i, 2]
            r0 = out[i, 0] - (x * b00 + y * b10 + z * b20)
            r1 = out[i, 1] - (x * b01 + y * b11 + z * b21)
            r2 = out[i, 2] - (x * b02 + y * b12 + z * b22)
            out[i, 0], out[i, 1], out[i, 2] = r0, r1, r2
    elif size == 6:
        for i in range(6):
            # this loop keeps a row in registers; a loop over j would load and store the row again for every k
            r0, r1, r2, r3, r4, r5 = out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4], out[i, 5]
            for k in range(6):
                factor = a[i, k]
                r0 -= factor * b[k, 0]
                r1 -= factor * b[k, 1]
                r2 -= factor * b[k, 2]
                r3 -= factor * b[k, 3]
                r4 -= factor * b[k, 4]
                r5 -= factor * b[k, 5]
            out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4], out[i, 5] = r0, r1, r2, r3, r4, r5
    elif size == 9:
        for i in range(9):
            r0, r1, r2, r3, r4 = out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4]
            r5, r6, r7, r8 = out[i, 5], out[i, 6], out[i, 7], out[i, 8]
            for k in range(9):
                factor = a[i, k]
                r0 -= factor * b[k, 0]
                r1 -= factor * b[k, 1]
                r2 -= factor * b[k, 2]
                r3 -= factor * b[k, 3]
                r4 -= factor * b[k, 4]
                r5 -= factor * b[k, 5]
                r6 -= factor * b[k, 6]
                r7 -= factor * b[k, 7]
                r8 -= factor * b[k, 8]
            out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4] = r0, r1, r2, r3, r4
            out[i, 5], out[i, 6], out[i, 7], out[i, 8] = r5, r6, r7, r8
    else:
        for i in range(size):
            for k in range(size):
                factor = a[i, k]
                for j in range(size):
                    out[i, j] -= factor * b[k, j]


@kernel(inline=True)
def _add_product_of_9(out: np.ndarray, block: np.ndarray, v: np.ndarray) -> None:
    """out += block v for size 9, with sums as trees of independent parts; inside `add_product` it is not unrolled."""
    v0, v1, v2, v3, v4, v5, v6, v7, v8 = v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]
    for a in range(9):
        first = (block[a, 0] * v0 + block[a, 1] * v1) + (block[a, 2] * v2 + block[a, 3] * v3)
        second = (block[a, 4] * v4 + block[a, 5] * v5) + (block[a, 6] * v6 + block[a, 7] * v7)
        out[a] += (first + second) + block[a, 8] * v8


@kernel(inline=True)
def add_product(out: np.ndarray, block: np.ndarray, v: np.ndarray) -> None:
    """out += block v."""
    size = out.shape[0]
    if size == 9:
        _add_product_of_9(out, block, v)
    elif size == 3:
        v0, v1, v2 = v[0], v[1], v[2]
        r0 = out[0] + (block[0, 0] * v0 + block[0, 1] * v1 + block[0, 2] * v2)
        r1 = out[1] + (block[1, 0] * v0 + block[1, 1] * v1 + block[1, 2] * v2)
        r2 = out[2] + (block[2, 0] * v0 + block[2, 1] * v1 + block[2, 2] * v2)
        out[0], out[1], out[2] = r0, r1, r2
    else:
        for a in range(size):
            total = out[a]
            for b in range(size):
                total += block[a, b] * v[b]
            out[a] = total


@kernel(inline=True)
def _subtract_transposed_of_9(out: np.ndarray, block: np.ndarray, v: np.ndarray) -> None:
    """out -= block^T v for size 9, in registers as in `subtract_product`."""
    r0, r1, r2, r3, r4, r5, r6, r7, r8 = out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7], out[8]
    for a in range(9):
        factor = v[a]
        r0 -= block[a, 0] * factor
        r1 -= block[a, 1] * factor
        r2 -= block[a, 2] * factor
        r3 -= block[a, 3] * factor
        r4 -= block[a, 4] * factor
        r5 -= block[a, 5] * factor
        r6 -= block[a, 6] * factor
        r7 -= block[a, 7] * factor
        r8 -= block[a, 8] * factor
    out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7], out[8] = r0, r1, r2, r3, r4, r5, r6, r7, r8


@kernel(inline=True)
def subtract_transposed(out: np.ndarray, block: np.ndarray, v: np.ndarray) -> None:
    """out -= block^T v."""
    size = out.shape[0]
    if size == 9:
        _subtract_transposed_of_9(out, block, v)
    else:
        for a in range(size):
            for b in range(size):
                out[b] -= block[a, b] * v[a]


@kernel(inline=True)
def _subtract_terms_of_9(total: np.ndarray, scale: np.ndarray, block: np.ndarray, v: np.ndarray) -> None:
    """Size 9 of `subtract_terms`, with sums as in `_add_product_of_9`."""
    v0, v1, v2, v3, v4, v5, v6, v7, v8 = v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]
    for a in range(9):
        p0, p1, p2, p3 = block[a, 0] * v0, block[a, 1] * v1, block[a, 2] * v2, block[a, 3] * v3
        p4, p5, p6, p7 = block[a, 4] * v4, block[a, 5] * v5, block[a, 6] * v6, block[a, 7] * v7
        p8 = block[a, 8] * v8
        total[a] -= ((p0 + p1) + (p2 + p3)) + ((p4 + p5) + (p6 + p7)) + p8
        first = (abs(p0) + abs(p1)) + (abs(p2) + abs(p3))
        scale[a] += first + ((abs(p4) + abs(p5)) + (abs(p6) + abs(p7))) + abs(p8)


@kernel(inline=True)
def subtract_terms(total: np.ndarray, scale: np.ndarray, block: np.ndarray, v: np.ndarray) -> None:
    """total -= block v and scale += |block| |v|."""
    size = total.shape[0]
    if size == 9:
        _subtract_terms_of_9(total, scale, block, v)
    else:
        for a in range(size):
            difference, magnitude = total[a], scale[a]
            for b in range(size):
                term = block[a, b] * v[b]
                difference -= term
                magnitude += abs(term)
            total[a], scale[a] = difference, magnitude


@kernel(inline=True)
def is_zero(block: np.ndarray) -> bool:
    """Whether all entries of a block are exactly zero."""
    for i in range(block.shape[0]):
        for j in range(block.shape[1]):
            if block[i, j] != 0.0:
                return False
    return True


@kernel
def _row_factor(diagonal: float) -> float:
    """Power of two near 1/sqrt(|d|) for the diagonal entry d of a row.

    Rows of forces and of moments have different units. With this factor on rows, and on columns of a symmetric block, the
    selection of pivots does not depend on the units.
    """
    return math.ldexp(1.0, -(math.frexp(diagonal)[1] // 2)) if diagonal > 0.0 else 1.0


@kernel(inline=True)
def _exchange(work: np.ndarray, k: int, row: int) -> None:
    """Exchange two rows and columns of a symmetric matrix."""
    if row != k:
        for j in range(work.shape[0]):
            work[k, j], work[row, j] = work[row, j], work[k, j]
        for i in range(work.shape[0]):
            work[i, k], work[i, row] = work[i, row], work[i, k]


@kernel
def split(left: np.ndarray, right: np.ndarray, work: np.ndarray) -> bool:
    """Overwrite a block A, given in `left`, by M, and `right` by N, with M A N = I. Return False if A is singular.

    M = L^-1 P and N = U^-1 of an LU factorisation with exchanges of scaled rows. The product of M and of N with other blocks
    has the round-off of a factorisation without blocks; with an inverse, it would grow with the condition number of A.
    """
    size = left.shape[0]
    for i in range(size):
        factor = _row_factor(abs(left[i, i]))
        for j in range(size):
            work[i, j] = factor * left[i, j]
            left[i, j] = right[i, j] = 0.0
        left[i, i] = factor
    for k in range(size):
        best, row = 0.0, k
        for i in range(k, size):
            if abs(work[i, k]) > best:
                best, row = abs(work[i, k]), i
        if not best > 0.0:
            return False
        if row != k:
            for j in range(size):
                work[k, j], work[row, j] = work[row, j], work[k, j]
                left[k, j], left[row, j] = left[row, j], left[k, j]
        for i in range(k + 1, size):
            factor = work[i, k] / work[k, k]
            if factor != 0.0:
                for j in range(k + 1, size):
                    work[i, j] -= factor * work[k, j]
                for j in range(size):
                    left[i, j] -= factor * left[k, j]
    for j in range(size):
        right[j, j] = 1.0 / work[j, j]
        for i in range(j - 1, -1, -1):
            total = work[i, j] * right[j, j]
            for k in range(i + 1, j):
                total += work[i, k] * right[k, j]
            right[i, j] = -total / work[i, i]
    return True


@kernel
def split_symmetric(left: np.ndarray, right: np.ndarray, work: np.ndarray) -> bool:
    """As `split` for a symmetric A, with N = M^T E, where E is diagonal with the entries 1 and -1; see `sign_of_row`.

    M is L^-1 of Cholesky's factorisation, or else of L D L^T with complete pivoting.
    """
    size = left.shape[0]
    for i in range(size):
        for j in range(i + 1):
            work[i, j] = work[j, i] = left[i, j]
    for i in range(size):
        scale = _row_factor(abs(left[i, i]))
        for j in range(size):
            work[i, j] *= scale
            work[j, i] *= scale
    definite = True
    for j in range(size):  # L in the lower triangle of `right`
        for i in range(j, size):
            total = work[i, j]
            for k in range(j):
                total -= right[i, k] * right[j, k]
            if i == j:
                if not total.real > _DEFINITE:
                    definite = False
                    break
                right[j, j] = math.sqrt(total.real)
            else:
                right[i, j] = total / right[j, j]
        if not definite:
            break
    if definite:
        for j in range(size):
            scale = _row_factor(abs(left[j, j]))
            for i in range(j):
                left[i, j] = 0.0
            left[j, j] = scale / right[j, j]
            for i in range(j + 1, size):
                total = right[i, j] * left[j, j]
                for k in range(j + 1, i):
                    total += right[i, k] * left[k, j]
                left[i, j] = -total / right[i, i]
    elif _split_indefinite(left, right, work) < size:
        return False
    for i in range(size):
        for j in range(size):
            if definite:
                right[j, i] = left[i, j]
    return True


@kernel
def _split_indefinite(left: np.ndarray, right: np.ndarray, work: np.ndarray) -> int:
    """`split_symmetric` of a block that is not positive definite; `work` is the scaled block.

    A pivot is an entry of the diagonal or, where these are small, a block of 2 x 2 with one eigenvalue of each sign (Bunch
    and Parlett, 1971). Returns the number of rows before the first pivot of zero.
    """
    size = left.shape[0]
    for i in range(size):
        scale = _row_factor(abs(left[i, i]))
        for j in range(size):
            left[i, j] = 0.0
        left[i, i] = scale
    k = 0
    while k < size:
        best, row = -1.0, k
        for i in range(k, size):
            if abs(work[i, i]) > best:
                best, row = abs(work[i, i]), i
        beside, first, second = 0.0, k, k
        for i in range(k, size):
            for j in range(i + 1, size):
                if abs(work[i, j]) > beside:
                    beside, first, second = abs(work[i, j]), i, j
        if best >= _ONE_BY_ONE * beside:
            if not best > 0.0:
                return k
            _exchange(work, k, row)
            _exchange_rows(left, k, row)
            for i in range(k + 1, size):
                factor = work[i, k] / work[k, k]
                for j in range(k + 1, size):
                    work[i, j] -= factor * work[k, j]
                for j in range(size):
                    left[i, j] -= factor * left[k, j]
            _scale_row(left, right, k, work[k, k].real)
            k += 1
        else:
            _exchange(work, k, first)  # first < second
            _exchange_rows(left, k, first)
            _exchange(work, k + 1, second)
            _exchange_rows(left, k + 1, second)
            a, b, c = work[k, k], work[k, k + 1], work[k + 1, k + 1]
            per_determinant = 1.0 / (a * c - b * b)
            for i in range(k + 2, size):
                one = (c * work[i, k] - b * work[i, k + 1]) * per_determinant
                two = (a * work[i, k + 1] - b * work[i, k]) * per_determinant
                for j in range(k + 2, size):
                    work[i, j] -= one * work[k, j] + two * work[k + 1, j]
                for j in range(size):
                    left[i, j] -= one * left[k, j] + two * left[k + 1, j]
            half = 0.5 * (a.real - c.real)
            along = math.hypot(half, b.real)
            middle = 0.5 * (a.real + c.real)
            turn = 0.5 * math.atan2(b.real, half)
            cosine, sine = math.cos(turn), math.sin(turn)
            for j in range(size):
                one, two = left[k, j], left[k + 1, j]
                left[k, j], left[k + 1, j] = cosine * one + sine * two, cosine * two - sine * one
            _scale_row(left, right, k, middle + along)
            _scale_row(left, right, k + 1, middle - along)
            k += 2
    return size


@kernel
def _scale_row(left: np.ndarray, right: np.ndarray, k: int, pivot: float) -> None:
    """Divide a row of M by the root of its pivot, and write the column of N."""
    root, sign = math.sqrt(abs(pivot)), 1.0 if pivot > 0.0 else -1.0
    for j in range(left.shape[0]):
        left[k, j] /= root
        right[j, k] = sign * left[k, j]


@kernel(inline=True)
def sign_of_row(left: np.ndarray, right: np.ndarray, row: int) -> float:
    """Entry 1 or -1 of E in N = M^T E, see `split_symmetric`."""
    size = left.shape[0]
    for k in range(row, row + size):
        column = k % size
        if left[row, column] != 0.0:
            return 1.0 if left[row, column] == right[column, row] else -1.0
    return 1.0


@kernel(inline=True)
def _exchange_rows(block: np.ndarray, k: int, row: int) -> None:
    if row != k:
        for j in range(block.shape[0]):
            block[k, j], block[row, j] = block[row, j], block[k, j]


@kernel
def negative_eigenvalues(block: np.ndarray, left: np.ndarray, right: np.ndarray, work: np.ndarray) -> int:
    """Number of negative eigenvalues of the symmetric part of a small block; those of zero do not count. The other arrays
    are scratch.
    """
    size = block.shape[0]
    for i in range(size):
        for j in range(size):
            left[i, j] = work[i, j] = 0.5 * (block[i, j] + block[j, i])
    for i in range(size):
        scale = _row_factor(abs(left[i, i]))
        for j in range(size):
            work[i, j] *= scale
            work[j, i] *= scale
    count = 0
    for row in range(_split_indefinite(left, right, work)):
        if sign_of_row(left, right, row) < 0.0:
            count += 1
    return count


@kernel
def solve_dense(matrix: np.ndarray, right: np.ndarray) -> bool:
    """Overwrite right sides (n, m) by the solutions, and the matrix (n, n); false, with NaN, if it is singular."""
    size, many = right.shape
    for k in range(size):
        row = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[row, k]):
                row = i
        if not abs(matrix[row, k]) > 0.0:
            right[:] = np.nan
            return False
        if row != k:
            for j in range(size):
                matrix[k, j], matrix[row, j] = matrix[row, j], matrix[k, j]
            for j in range(many):
                right[k, j], right[row, j] = right[row, j], right[k, j]
        for i in range(k + 1, size):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, size):
                    matrix[i, j] -= factor * matrix[k, j]
                for j in range(many):
                    right[i, j] -= factor * right[k, j]
    for k in range(size - 1, -1, -1):
        for j in range(many):
            total = right[k, j]
            for i in range(k + 1, size):
                total -= matrix[k, i] * right[i, j]
            right[k, j] = total / matrix[k, k]
    return True
