"""Number of negative eigenvalues of matrices whose block factors are not accurate enough, from sparse factorisations.

A symmetric matrix is scaled by powers of two (Sylvester's law: the signs do not change) and factorised as L D L^T in two
ways: by scalars without exchanges of rows, which suits wide ranges of stiffness, and by fronts with exchanges inside a
panel, which suit zeros on the diagonal. The factors are those of B + E. If E changes a sign, an eigenvalue of B^-1 E is -1
or below, and the solution of B x = B x0 has an error as large as the part of x0 along its eigenvector. A factorisation
counts only if a test vector x0 shows that it is accurate. If B is too near to a singular matrix, the count is that of
B + shift with the smallest shift that can be verified: eigenvalues between -shift and 0 count as zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import ldl
from scipy.sparse.linalg import splu

from fsm.kernels.blocks import BlockMatrix, Elimination
from fsm.kernels.fronts import Supernodes, count_negative_pivots, factorise_fronts, solve_columns
from fsm.solve.equations.supernodes import supernodes
from fsm.solve.stepping.accuracy import ACCURATE, trial_vector

_SHIFTS = (0.0, 1e-12, 1e-11, 1e-10, 1e-9)
"""Eigenvalues of the scaled matrix, whose largest entry in each row is about 1, that may count as zero."""
_PASSES = 4
"""Passes of the scaling (Ruiz, 2001)."""


def negative_eigenvalues(matrix: BlockMatrix, known: Elimination) -> int:
    """Number of negative eigenvalues of a symmetric matrix.

    If neither sparse factorisation can be verified, a dense one decides (Bunch and Kaufman, 1977).

    Parameters
    ----------
    matrix : BlockMatrix
    known : Elimination
        Elimination of its pattern.
    """
    full = matrix.bsr().tocsc()
    scale = _scale(full)
    scaled = sparse.csc_matrix(full.multiply(scale[:, None]).multiply(scale))
    pattern, blocks, nodes = matrix.pattern, np.zeros(0), None
    if matrix.low_rank is None:
        by_row = scale.reshape(-1, pattern.size)
        blocks = matrix.data * by_row[pattern.rows][:, :, None] * by_row[pattern.indices][:, None, :]
        nodes = supernodes(pattern, known)
    entries = np.arange(pattern.size)
    for shift in _SHIFTS:
        found = _by_scalars(scaled + shift * sparse.identity(matrix.order, format="csc"))
        if found is None and nodes is not None:
            data = blocks.copy()
            data[pattern.diagonal[:, None], entries, entries] += shift
            found = _by_fronts(matrix.with_data(data), nodes)
        if found is not None:
            return found
    return _by_dense(scaled.toarray() + _SHIFTS[1] * np.eye(matrix.order))


def negative_pivots_of_unsymmetric(matrix: BlockMatrix) -> int:
    """Number of negative pivots of an unsymmetric matrix, without exchanges of rows.

    This number and the number of negative real eigenvalues are both even or both odd. If the factorisation cannot be
    verified, the result is 1 or 0, from the sign of the determinant, and an even number is not found.
    """
    full = matrix.bsr().tocsc()
    found = _by_scalars(full)
    if found is not None:
        return found
    try:
        factors = splu(full)
    except RuntimeError:  # singular: no eigenvalue of its own is negative for certain
        return 0
    odd = int(np.sum(factors.U.diagonal() < 0.0)) + _transpositions(factors.perm_r) + _transpositions(factors.perm_c)
    return odd % 2


def _scale(matrix: sparse.csc_matrix) -> np.ndarray:
    """Powers of two (n,) that bring the largest entry of each row and column of a symmetric matrix near 1."""
    scale, size = np.ones(matrix.shape[0]), abs(matrix)
    for _ in range(_PASSES):
        largest = size.multiply(scale[:, None]).multiply(scale).max(axis=1).toarray().ravel()
        scale[largest > 0.0] /= np.sqrt(largest[largest > 0.0])
    return np.asarray(np.exp2(np.round(np.log2(scale))))


def _by_scalars(matrix: sparse.csc_matrix) -> int | None:
    """Negative pivots of a factorisation without exchanges of rows; None if it is not accurate."""
    try:
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # one of the pivots is zero
        return None
    if not np.array_equal(factors.perm_r, factors.perm_c) or not _accurate(matrix, factors.solve):
        return None
    return int(np.sum(factors.U.diagonal() < 0.0))


def _by_fronts(matrix: BlockMatrix, nodes: Supernodes) -> int | None:
    """Negative eigenvalues of the pivots of dense fronts; None if they are not accurate."""
    pattern, factors = matrix.pattern, np.empty(nodes.factors[-1])
    if factorise_fronts(nodes, pattern.indptr, pattern.indices, matrix.data, factors) >= 0:
        return None
    if not _accurate(matrix.blocks(), lambda right: solve_columns(nodes, factors, right.reshape(-1, 1)).ravel()):
        return None
    return int(count_negative_pivots(nodes, factors))


def _accurate(matrix: Any, solve: Any) -> bool:
    test = trial_vector(matrix.shape[0])
    with np.errstate(all="ignore"):
        return bool(np.abs(solve(matrix @ test) - test).max(initial=0.0) < ACCURATE)


def _by_dense(matrix: np.ndarray) -> int:
    """Negative eigenvalues of the blocks of 1 x 1 and 2 x 2 of D; a block of 2 x 2 has one of each sign."""
    diagonal = ldl(matrix, overwrite_a=True, check_finite=False)[1]
    pairs = np.diagonal(diagonal, -1) != 0.0
    single = ~(np.append(pairs, False) | np.append(False, pairs))
    return int(np.sum(pairs) + np.sum(np.diagonal(diagonal)[single] < 0.0))


def _transpositions(permutation: np.ndarray) -> int:
    """Number of exchanges of two entries that sort a permutation."""
    seen, count = np.zeros(len(permutation), dtype=bool), 0
    for start in range(len(permutation)):
        at = int(permutation[start])
        while not seen[start] and at != start:
            seen[at] = True
            count += 1
            at = int(permutation[at])
        seen[start] = True
    return count
