"""Equations of a compiled model whose matrix is a block matrix plus a part of low rank, A + V^T W V (Woodbury, 1950).

A may be singular although the sum is not, for example if a gas alone holds a piston. Each vector v of V therefore adds a
stiffness s = |W_ii| max v^2 at one component e to the factorised matrix, and -s e e^T to the part of low rank. The component
is the largest one of A^-1 v, which a nearly singular A turns into its softest mode.

All arrays are in a table, and one kernel, called by its address, does all tasks. Models without such a part do not have it.
"""

from __future__ import annotations

import weakref

import numpy as np

from fsm.kernels import block_equations as equations
from fsm.kernels import block_lu
from fsm.kernels.addresses import ROW, address_table, floats_1d, floats_2d, floats_3d, integers_1d, put_array
from fsm.kernels.block_equations import Pattern
from fsm.kernels.blocks import LowRank
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import address_of, call_at
from fsm.kernels.small_blocks import negative_eigenvalues, solve_dense

_VECTORS, _COLUMNS, _PLACES, _SHIFTS, _KEPT, _TERMS = range(equations.OF_WEIGHTS + 1, equations.OF_WEIGHTS + 7)
_BY_TERMS, _SOLVED, _INNER, _CORRECTION, _TRIAL, _ACCURATE, _NEXT = range(equations.OF_WEIGHTS + 7, equations.LOW_RANK_ROWS)
"""Rows of the table after W (r, r): V (r, m), and its column for each coordinate (n,) or -1; component e, stiffness s and
original entry of the matrix of each vector; V with all vectors e (2 r, n), their W, A^-1 V^T, V A^-1 V^T and
(1 + W V A^-1 V^T)^-1 W; trial vector of entries 1 and -1, and largest error of its solution with which signs of pivots are
certain; components e of the next factorisation, -1 for unknown ones."""
_REFINE_ABOVE = 1e-13
"""Residual relative to the right side from which a solution is refined."""
_SOFT = 1e6
"""Bound of the ratio of two stiffnesses, of a vector and of the blocks along it; above it the blocks count as singular."""
_SHIFT = 1e-9
"""Stiffness over the largest one that makes a singular matrix regular."""


class LowRankEquations:
    """Table of a part of low rank, and its arrays.

    Parameters
    ----------
    vectors, weights : V (r, m) and W (r, r)
    columns : (n,) int array
        Column of V of each coordinate, or -1.
    trial, accurate : see `fsm.solve.stepping.accuracy`
    """

    def __init__(
        self, vectors: np.ndarray, weights: np.ndarray, columns: np.ndarray, trial: np.ndarray, accurate: float
    ) -> None:
        rank, size = len(weights), len(columns)
        both, nowhere = 2 * rank, np.zeros((1, ROW), dtype=np.int64)
        self._arrays = [
            weights, vectors, columns, np.zeros(rank, dtype=np.int64), np.zeros(rank), np.zeros(rank),
            np.zeros((both, size)), np.zeros((both, both)), np.zeros((both, size)), np.zeros((both, both)),
            np.zeros((both, both)), trial, np.array([accurate]), np.full(rank, -1, dtype=np.int64),
        ]  # fmt: skip
        self._address = np.array([address_of(_work, nowhere, nowhere, 0.0)])
        self.table = np.zeros((equations.LOW_RANK_ROWS, ROW), dtype=np.int64)
        own = [self._address, np.array([1.0, 0.0])]
        self.table[[0, equations.OF_NUMBERS]] = address_table(own)
        self.table[equations.OF_WEIGHTS :] = address_table(self._arrays)
        weakref.finalize(self.table, _forget, [*own, *self._arrays]).atexit = False  # models keep the table alone
        self.flags = np.zeros(3, dtype=np.int64)
        self._pattern: Pattern | None = None
        self._used: list[np.ndarray] = []

    def use(self, p: Pattern, low_rank: LowRank, matrix: np.ndarray, factors: np.ndarray) -> None:
        """Set the arrays for tasks from Python; V has a column for each coordinate."""
        if p is not self._pattern:
            self._pattern, self.table[equations.OF_PATTERN : equations.OF_FLAGS + 1] = p, address_table([*p, self.flags])
        self._used = [matrix, factors, low_rank.vectors, low_rank.weights]
        self.table[[equations.OF_MATRIX, equations.OF_FACTORS, _VECTORS, equations.OF_WEIGHTS]] = address_table(self._used)

    def do(self, task: float, right: np.ndarray) -> float:
        """Do a task; `right` (n,) is the right side."""
        return float(_do(self.table, task, right))


def _forget(arrays: list[np.ndarray]) -> None:
    """Let arrays go."""


@kernel
def _do(own: np.ndarray, task: float, right: np.ndarray) -> float:
    put_array(own, equations.OF_RIGHT, right)
    return float(call_at(integers_1d(own, 0)[0], own, own, task))


@kernel
def _work(table: np.ndarray, own: np.ndarray, task: float) -> float:
    if task == equations.FACTORISE:
        return 1.0 if _factorise(own) else 0.0
    if task == equations.NEGATIVE:
        return _negative(own)
    right = floats_1d(own, equations.OF_RIGHT)
    right[:] = _solution(own, right) if task == equations.SOLVE else _times(own, right)
    return 0.0


@kernel
def _times(own: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Product V^T W V x, (n,)."""
    vectors, columns, weights = floats_2d(own, _VECTORS), integers_1d(own, _COLUMNS), floats_2d(own, equations.OF_WEIGHTS)
    rank, out = weights.shape[0], np.zeros(vector.shape[0])
    along = np.zeros(rank)
    for k in range(rank):
        for i in range(out.shape[0]):
            if columns[i] >= 0:
                along[k] += vectors[k, columns[i]] * vector[i]
    for k in range(rank):
        by = 0.0
        for j in range(rank):
            by += weights[k, j] * along[j]
        for i in range(out.shape[0]):
            if columns[i] >= 0:
                out[i] += by * vectors[k, columns[i]]
    return out


@kernel
def _largest(row: np.ndarray) -> int:
    """Index of the largest magnitude."""
    found = 0
    for i in range(row.shape[0]):
        if abs(row[i]) > abs(row[found]):
            found = i
    return found


@kernel
def _set_terms(own: np.ndarray) -> None:
    """Write V, the vectors e, and their W."""
    vectors, columns, weights = floats_2d(own, _VECTORS), integers_1d(own, _COLUMNS), floats_2d(own, equations.OF_WEIGHTS)
    terms, by_terms, places, shifts = _terms_of(own)
    rank, following = weights.shape[0], integers_1d(own, _NEXT)
    terms[rank:], by_terms[:] = 0.0, 0.0
    for k in range(rank):
        largest = 0.0
        for i in range(terms.shape[1]):
            terms[k, i] = vectors[k, columns[i]] if columns[i] >= 0 else 0.0
            largest = max(largest, abs(terms[k, i]))
        for j in range(rank):
            by_terms[k, j] = weights[k, j]
        places[k] = following[k] if following[k] >= 0 else _largest(terms[k])
        shifts[k] = abs(weights[k, k]) * largest * largest
        if shifts[k] > 0.0:
            terms[rank + k, places[k]], by_terms[rank + k, rank + k] = 1.0, -shifts[k]


@kernel(inline=True)
def _terms_of(own: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    return floats_2d(own, _TERMS), floats_2d(own, _BY_TERMS), integers_1d(own, _PLACES), floats_1d(own, _SHIFTS)


@kernel
def _stiffen(own: np.ndarray) -> None:
    """Add the stiffnesses s to the matrix."""
    matrix, p = floats_3d(own, equations.OF_MATRIX), equations.pattern_at(own, equations.OF_PATTERN)
    kept, shifts = floats_1d(own, _KEPT), floats_1d(own, _SHIFTS)
    places, size = integers_1d(own, _PLACES), matrix.shape[1]
    for k in range(places.shape[0]):
        block, a = p.diagonal[places[k] // size], places[k] % size
        kept[k] = matrix[block, a, a]
        matrix[block, a, a] += shifts[k]


@kernel
def _soften(own: np.ndarray) -> None:
    """Undo `_stiffen`."""
    matrix, p = floats_3d(own, equations.OF_MATRIX), equations.pattern_at(own, equations.OF_PATTERN)
    kept = floats_1d(own, _KEPT)
    places, size = integers_1d(own, _PLACES), matrix.shape[1]
    for k in range(places.shape[0] - 1, -1, -1):
        matrix[p.diagonal[places[k] // size], places[k] % size, places[k] % size] = kept[k]


@kernel
def _factors_of_blocks(own: np.ndarray) -> bool:
    """Factorise the matrix without the part of low rank; false if it is singular."""
    p, matrix = equations.pattern_at(own, equations.OF_PATTERN), floats_3d(own, equations.OF_MATRIX)
    flags = integers_1d(own, equations.OF_FLAGS)
    symmetric = block_lu.is_symmetric(matrix, p.rows, p.columns, p.transposed, block_lu.SYMMETRY_TOLERANCE)
    flags[equations.SYMMETRIC], flags[equations.TRUSTED] = 1 if symmetric else 0, 0
    factors = floats_3d(own, equations.OF_FACTORS)
    return block_lu.factorise(matrix, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, symmetric, factors) < 0


@kernel
def _solved_by_blocks(own: np.ndarray, right: np.ndarray, trusted: bool) -> np.ndarray:
    """Solution with the last factors of blocks."""
    p, flags = equations.pattern_at(own, equations.OF_PATTERN), integers_1d(own, equations.OF_FLAGS)
    x, error, doubtful = block_lu.solve_refined(
        p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, floats_3d(own, equations.OF_FACTORS), p.rows, p.columns,
        floats_3d(own, equations.OF_MATRIX), right, block_lu.REFINE_ABOVE, flags[equations.SYMMETRIC] == 1, trusted,
    )  # fmt: skip
    if not error <= block_lu.MAX_ERROR:
        flags[equations.FAILED] = 1
    if not trusted:
        flags[equations.TRUSTED] = 0 if doubtful else 1
    return x


@kernel
def _solve_terms(own: np.ndarray, count: int) -> None:
    """Write A^-1 V^T of the first terms, and the largest components of those of V."""
    (terms, by_terms, places, _), solved = _terms_of(own), floats_2d(own, _SOLVED)
    flags = integers_1d(own, equations.OF_FLAGS)
    for k in range(count):
        if k < places.shape[0] or by_terms[k, k] != 0.0:
            solved[k] = _solved_by_blocks(own, terms[k], flags[equations.TRUSTED] == 1)
        else:
            solved[k] = 0.0


@kernel
def _attempt(own: np.ndarray) -> bool:
    """Factorise with the present components e; false if the blocks are singular."""
    _set_terms(own)
    terms, by_terms = floats_2d(own, _TERMS), floats_2d(own, _BY_TERMS)
    _stiffen(own)
    done = _factors_of_blocks(own)
    if done:
        _solve_terms(own, terms.shape[0])
    _soften(own)
    if not done:
        return False
    solved, inner, correction = floats_2d(own, _SOLVED), floats_2d(own, _INNER), floats_2d(own, _CORRECTION)
    both = terms.shape[0]
    for k in range(both):
        for j in range(both):
            inner[k, j] = 0.0
            for i in range(terms.shape[1]):
                inner[k, j] += terms[k, i] * solved[j, i]
    matrix = np.empty((both, both))
    for k in range(both):
        for j in range(both):
            matrix[k, j], correction[k, j] = 1.0 if k == j else 0.0, by_terms[k, j]
            for i in range(both):
                matrix[k, j] += by_terms[k, i] * inner[i, j]
    solve_dense(matrix, correction)
    return True


@kernel
def _set_places(own: np.ndarray) -> None:
    """Choose the largest components of A^-1 V^T for the next factorisation."""
    following, solved = integers_1d(own, _NEXT), floats_2d(own, _SOLVED)
    for k in range(following.shape[0]):
        following[k] = _largest(solved[k])


@kernel
def _factorise(own: np.ndarray) -> bool:
    if not _attempt(own):
        # the blocks have a mode without any stiffness; the component along this mode follows from a slightly stiffer matrix
        matrix, p, largest = floats_3d(own, equations.OF_MATRIX), equations.pattern_at(own, equations.OF_PATTERN), 0.0
        before = matrix.copy()
        _stiffen(own)
        flat = matrix.reshape(-1)
        for i in range(flat.shape[0]):
            largest = max(largest, abs(flat[i]))
        for block in p.diagonal:
            for a in range(matrix.shape[1]):
                matrix[block, a, a] += _SHIFT * largest
        done = _factors_of_blocks(own)
        if done:
            _solve_terms(own, integers_1d(own, _PLACES).shape[0])
            _set_places(own)
        matrix[:] = before
        return done and _attempt(own)
    inner, by_terms = floats_2d(own, _INNER), floats_2d(own, _BY_TERMS)
    _set_places(own)
    for k in range(inner.shape[0]):
        if not abs(inner[k, k] * by_terms[k, k]) < _SOFT:
            return bool(_attempt(own))
    return True


@kernel
def _once(own: np.ndarray, right: np.ndarray) -> np.ndarray:
    terms, correction, solved = floats_2d(own, _TERMS), floats_2d(own, _CORRECTION), floats_2d(own, _SOLVED)
    x, both = _solved_by_blocks(own, right, integers_1d(own, equations.OF_FLAGS)[equations.TRUSTED] == 1), terms.shape[0]
    along = np.zeros(both)
    for k in range(both):
        for i in range(x.shape[0]):
            along[k] += terms[k, i] * x[i]
    for k in range(both):
        by = 0.0
        for j in range(both):
            by += correction[k, j] * along[j]
        for i in range(x.shape[0]):
            x[i] -= by * solved[k, i]
    return x


@kernel
def _solution(own: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution (n,), with one refinement if its residual is above round-off."""
    p, matrix = equations.pattern_at(own, equations.OF_PATTERN), floats_3d(own, equations.OF_MATRIX)
    _stiffen(own)
    x = _once(own, right)
    _soften(own)
    rest, size, error = right - block_lu.multiply_blocks(p.rows, p.columns, matrix, x) - _times(own, x), 0.0, 0.0
    for i in range(rest.shape[0]):
        size, error = max(size, abs(right[i])), max(error, abs(rest[i]))
    if error > _REFINE_ABOVE * size:
        _stiffen(own)
        x += _once(own, rest)
        _soften(own)
    return x


@kernel
def _signs_hold(own: np.ndarray) -> bool:
    """Whether round-off of symmetric factors cannot have changed the sign of an eigenvalue; see
    `fsm.solve.equations.linear`.
    """
    p, trial = equations.pattern_at(own, equations.OF_PATTERN), floats_1d(own, _TRIAL)
    _stiffen(own)
    found = _solved_by_blocks(
        own, block_lu.multiply_blocks(p.rows, p.columns, floats_3d(own, equations.OF_MATRIX), trial), True
    )
    _soften(own)
    worst = 0.0
    for i in range(found.shape[0]):
        worst = max(worst, abs(found[i] - trial[i]))
    return worst < floats_1d(own, _ACCURATE)[0]


@kernel
def _negative(own: np.ndarray) -> float:
    """See `NEGATIVE` (Haynsworth, 1968).

    The symmetric matrix [[A, V^T, 0], [V, 0, -1], [0, -1, W]] has as many negative eigenvalues as A + V^T W V and k more,
    with k vectors, and as many as A and [[-V A^-1 V^T, -1], [-1, W]] together.
    """
    p, flags = equations.pattern_at(own, equations.OF_PATTERN), integers_1d(own, equations.OF_FLAGS)
    inner, by_terms = floats_2d(own, _INNER), floats_2d(own, _BY_TERMS)
    if flags[equations.SYMMETRIC] == 0:
        return equations.UNKNOWN
    found, both = block_lu.count_negative(p.filled_diagonal, floats_3d(own, equations.OF_FACTORS)), inner.shape[0]
    if not (found == 0 and flags[equations.TRUSTED] == 1) and not _signs_hold(own):
        return equations.UNKNOWN
    whole, scale = np.zeros((2 * both, 2 * both)), np.empty(both)
    for k in range(both):  # vectors of the same size, for the factorisation
        scale[k] = 1.0 / np.sqrt(abs(inner[k, k])) if inner[k, k] != 0.0 else 1.0
    for k in range(both):
        whole[k, both + k] = whole[both + k, k] = -1.0
        for j in range(both):
            whole[k, j] = -scale[k] * scale[j] * inner[k, j]
            whole[both + k, both + j] = by_terms[k, j] / (scale[k] * scale[j])
    shape = whole.shape
    return found + float(negative_eigenvalues(whole, np.empty(shape), np.empty(shape), np.empty(shape)) - both)
