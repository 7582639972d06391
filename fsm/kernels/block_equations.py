"""Linear equations of a compiled model: their pattern, factorisation and solution (`fsm.kernels.block_lu`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fsm.kernels import block_lu
from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d, put_array
from fsm.kernels.blocks import BlockPattern, Elimination
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import call_at, pointers_to

SYMMETRIC, TRUSTED, FAILED = 0, 1, 2
"""Indices of the flags of a model: two on the last factorisation, and whether any factorisation or solution has failed."""


class Pattern(NamedTuple):
    """A `BlockPattern` and its `Elimination`."""

    rows: np.ndarray
    columns: np.ndarray
    transposed: np.ndarray
    diagonal: np.ndarray
    order: np.ndarray
    filled_rows: np.ndarray
    filled_columns: np.ndarray
    filled_diagonal: np.ndarray
    place: np.ndarray


class EquationKernels(NamedTuple):
    """`Pointer`s to `factorise` and `solve_refined` of `fsm.kernels.block_lu`, and the table of a part of low rank of the
    matrix (`fsm.kernels.low_rank`), without rows if there is none.
    """

    factorise: Any
    solve: Any
    low_rank: np.ndarray


FACTORISE, SOLVE, NEGATIVE, TIMES = 0.0, 1.0, 2.0, 3.0
"""Tasks for a part of low rank. The result of `FACTORISE` is 1, or 0 for a singular matrix. `SOLVE` and `TIMES` replace the
right side by the solution, or by the product with the part of low rank. The result of `NEGATIVE` is the number of negative
eigenvalues of the whole symmetric matrix, or `UNKNOWN`."""
UNKNOWN = -1.0
_ADDRESS, OF_RIGHT, OF_MATRIX, OF_FACTORS = range(4)
OF_PATTERN = 4
OF_FLAGS = OF_PATTERN + len(Pattern._fields)
OF_NUMBERS, OF_WEIGHTS = OF_FLAGS + 1, OF_FLAGS + 2
LOW_RANK_ROWS = OF_FLAGS + 16
"""Rows of the table of a part of low rank: address of its kernel, arrays of the model, two numbers, W, and further rows of
`fsm.kernels.low_rank`. The numbers are 1 if the last factorised matrix has this part, else 0, and the factor on a kept
tangent."""
NO_LOW_RANK = np.zeros((0, 4), dtype=np.int64)


def pattern_arrays(pattern: BlockPattern, known: Elimination) -> Pattern:
    """Arrays of a pattern and of its elimination."""
    return Pattern(
        pattern.indptr, pattern.indices, pattern.transposed, pattern.diagonal, known.order, known.indptr, known.indices,
        known.diagonal, known.place,
    )  # fmt: skip


def equation_kernels(
    p: Pattern, matrix: np.ndarray, factors: np.ndarray, right: np.ndarray, low_rank: np.ndarray | None = None
) -> EquationKernels:
    """Pointers to the kernels for arrays of these types, and the table of a part of low rank."""
    filled = p.filled_rows, p.filled_columns, p.filled_diagonal
    solving = p.order, *filled, factors, p.rows, p.columns, matrix, right, 0.0, True, True
    wanted = (block_lu.factorise, matrix, p.place, *filled, True, factors), (block_lu.solve_refined, *solving)
    found: Any = pointers_to(wanted)
    return EquationKernels(found[0], found[1], NO_LOW_RANK if low_rank is None else low_rank)


@kernel
def pattern_at(t: np.ndarray, k: int) -> Pattern:
    """Pattern in a table of `fsm.kernels.addresses`, from row k on."""
    return Pattern(
        integers_1d(t, k), integers_1d(t, k + 1), integers_1d(t, k + 2), integers_1d(t, k + 3), integers_1d(t, k + 4),
        integers_1d(t, k + 5), integers_1d(t, k + 6), integers_1d(t, k + 7), integers_1d(t, k + 8),
    )  # fmt: skip


@kernel
def do_low_rank(
    own: np.ndarray, task: float, p: Pattern, matrix: np.ndarray, factors: np.ndarray, flags: np.ndarray, right: np.ndarray
) -> float:
    """Do a task for a part of low rank, with these arrays of the model."""
    put_array(own, OF_RIGHT, right)
    put_array(own, OF_MATRIX, matrix)
    put_array(own, OF_FACTORS, factors)
    put_array(own, OF_FLAGS, flags)
    k = OF_PATTERN
    for array in (
        p.rows, p.columns, p.transposed, p.diagonal, p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, p.place,
    ):  # fmt: skip
        put_array(own, k, array)
        k += 1
    return float(call_at(integers_1d(own, _ADDRESS)[0], own, own, task))


@kernel
def has_low_rank(by: EquationKernels) -> bool:
    """Whether the last factorised matrix has a part of low rank."""
    return by.low_rank.shape[0] > 0 and floats_1d(by.low_rank, OF_NUMBERS)[0] == 1.0


@kernel
def set_factors(
    by: EquationKernels, p: Pattern, matrix: np.ndarray, factors: np.ndarray, flags: np.ndarray, whole: bool
) -> bool:
    """Factorise a matrix, without its part of low rank unless it is `whole`; false if it is singular.

    `flags` (3,) belong to the model.
    """
    if by.low_rank.shape[0] > 0:
        floats_1d(by.low_rank, OF_NUMBERS)[0] = 1.0 if whole else 0.0
    if has_low_rank(by):
        if do_low_rank(by.low_rank, FACTORISE, p, matrix, factors, flags, matrix[0, 0]) > 0.0:
            return True
        flags[FAILED] = 1
        return False
    symmetric = block_lu.is_symmetric(matrix, p.rows, p.columns, p.transposed, block_lu.SYMMETRY_TOLERANCE)
    flags[SYMMETRIC], flags[TRUSTED] = 1 if symmetric else 0, 0
    failed = by.factorise(matrix, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, symmetric, factors)
    if failed >= 0:
        flags[FAILED] = 1
    return bool(failed < 0)


@kernel
def solution(
    by: EquationKernels, p: Pattern, matrix: np.ndarray, factors: np.ndarray, flags: np.ndarray, right: np.ndarray
) -> np.ndarray:
    """Solution (n,) with the last factors of the matrix; other arguments as in `set_factors`."""
    x: np.ndarray
    if has_low_rank(by):
        x = right.copy()
        do_low_rank(by.low_rank, SOLVE, p, matrix, factors, flags, x)
        return x
    x, error, doubtful = by.solve(
        p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, factors, p.rows, p.columns, matrix, right,
        block_lu.REFINE_ABOVE, flags[SYMMETRIC] == 1, flags[TRUSTED] == 1,
    )  # fmt: skip
    if not error <= block_lu.MAX_ERROR:
        flags[FAILED] = 1
    flags[TRUSTED] = 0 if doubtful else 1
    return x


@kernel
def keep_low_rank(by: EquationKernels, part: float, first: bool) -> None:
    """Part of low rank of the sum of two tangents, each multiplied by its `part`: that of the second one stands for both,
    which changes the iterations but not their solution.
    """
    if by.low_rank.shape[0] > 0:
        numbers, weights = floats_1d(by.low_rank, OF_NUMBERS), floats_2d(by.low_rank, OF_WEIGHTS)
        if first:
            numbers[1] = part
        else:
            for i in range(weights.shape[0]):
                for j in range(weights.shape[1]):
                    weights[i, j] *= numbers[1] + part


@kernel
def stiffness_times(
    by: EquationKernels, p: Pattern, stiffness: np.ndarray, flags: np.ndarray, vector: np.ndarray
) -> np.ndarray:
    """Product (n,) of a stiffness, with its part of low rank, and a vector (n,)."""
    out = block_lu.multiply_blocks(p.rows, p.columns, stiffness, vector)
    if by.low_rank.shape[0] > 0:
        more = vector.copy()
        do_low_rank(by.low_rank, TIMES, p, stiffness, stiffness, flags, more)
        for i in range(out.shape[0]):
            out[i] += more[i]
    return out
