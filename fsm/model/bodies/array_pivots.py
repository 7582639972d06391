"""Numbers of negative pivots of matrices in quasi-static steps, for compiled models of all kinds."""

from __future__ import annotations

import numpy as np

from fsm.kernels import block_equations
from fsm.kernels.block_equations import EquationKernels, Pattern
from fsm.kernels.block_lu import count_negative, count_negative_parts, multiply_blocks
from fsm.kernels.jit import kernel


@kernel
def negative_of_last(
    equations: EquationKernels, p: Pattern, matrix: np.ndarray, factors: np.ndarray, flags: np.ndarray, trial: np.ndarray,
    accurate: float,
) -> float:  # fmt: skip
    """Number of negative pivots of the last matrix, or `UNKNOWN`.

    An unsymmetric matrix has no negative real pivot if the symmetric parts of all pivot blocks are definite, and these are
    definite if the symmetric part of the matrix is. Of a matrix with soft and stiff parts, as of a film on bodies, only the
    factors of the symmetric part may be accurate enough.
    """
    if block_equations.has_low_rank(equations):
        return block_equations.do_low_rank(equations.low_rank, block_equations.NEGATIVE, p, matrix, factors, flags, trial)
    if flags[block_equations.SYMMETRIC] == 0:
        if flags[block_equations.TRUSTED] == 1 and count_negative_parts(p.filled_diagonal, factors) == 0:
            return 0.0
        return 0.0 if _is_definite(equations, p, matrix, factors, trial, accurate) else block_equations.UNKNOWN
    found = count_negative(p.filled_diagonal, factors)
    if found == 0 and flags[block_equations.TRUSTED] == 1:
        return 0.0
    return float(found) if _signs_hold(equations, p, matrix, factors, trial, accurate) else block_equations.UNKNOWN


@kernel
def negative_of_symmetric(
    equations: EquationKernels, p: Pattern, blocks: np.ndarray, matrix: np.ndarray, factors: np.ndarray, trial: np.ndarray,
    accurate: float, flags: np.ndarray,
) -> float:  # fmt: skip
    """Number of negative pivots of the symmetric part of block data, or `UNKNOWN`; writes `matrix` and `factors`."""
    _symmetric_part(p, blocks, matrix)
    if equations.low_rank.shape[0] > 0:
        if not block_equations.set_factors(equations, p, matrix, factors, flags, True):
            return block_equations.UNKNOWN
        return block_equations.do_low_rank(equations.low_rank, block_equations.NEGATIVE, p, matrix, factors, flags, trial)
    failed = equations.factorise(matrix, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, True, factors)
    if failed >= 0 or not _signs_hold(equations, p, matrix, factors, trial, accurate):
        return block_equations.UNKNOWN
    return float(count_negative(p.filled_diagonal, factors))


@kernel
def _symmetric_part(p: Pattern, blocks: np.ndarray, out: np.ndarray) -> None:
    """Write the symmetric part of block data."""
    for k in range(out.shape[0]):
        mirrored = p.transposed[k]
        for i in range(out.shape[1]):
            for j in range(out.shape[1]):
                out[k, i, j] = 0.5 * (blocks[k, i, j] + blocks[mirrored, j, i])


@kernel
def _is_definite(
    equations: EquationKernels, p: Pattern, matrix: np.ndarray, factors: np.ndarray, trial: np.ndarray, accurate: float
) -> bool:
    """Whether the symmetric part of an unsymmetric matrix is surely positive definite; if not, `factors` stay those of the
    matrix.
    """
    part = np.empty(matrix.shape)
    _symmetric_part(p, matrix, part)
    filled = p.filled_rows, p.filled_columns, p.filled_diagonal
    failed = equations.factorise(part, p.place, filled[0], filled[1], filled[2], True, factors)
    if failed < 0 and count_negative(filled[2], factors) == 0 and _signs_hold(equations, p, part, factors, trial, accurate):
        return True
    equations.factorise(matrix, p.place, filled[0], filled[1], filled[2], False, factors)
    return False


@kernel
def _signs_hold(
    equations: EquationKernels, p: Pattern, matrix: np.ndarray, factors: np.ndarray, trial: np.ndarray, accurate: float
) -> bool:
    """Whether round-off of symmetric factors cannot have changed the sign of an eigenvalue; see
    `fsm.solve.equations.linear`.
    """
    right = multiply_blocks(p.rows, p.columns, matrix, trial)
    found, _, _ = equations.solve(
        p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, factors, p.rows, p.columns, matrix, right, 0.0, True,
        True,
    )  # fmt: skip
    worst = 0.0
    for i in range(found.shape[0]):
        worst = max(worst, abs(found[i] - trial[i]))
    return worst < accurate
