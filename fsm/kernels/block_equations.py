"""Linear equations of a compiled model: their pattern, factorisation and solution (`fsm.kernels.block_lu`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.addresses import integers_1d
from fsm.kernels.block_lu import MAX_ERROR, REFINE_ABOVE, SYMMETRY_TOLERANCE, factorise, is_symmetric, solve_refined
from fsm.kernels.blocks import BlockPattern, Elimination
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import pointers

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
    """`Pointer`s to `factorise` and `solve_refined` of `fsm.kernels.block_lu`."""

    factorise: Any
    solve: Any


def pattern_arrays(pattern: BlockPattern, known: Elimination) -> Pattern:
    """Arrays of a pattern and of its elimination."""
    return Pattern(
        pattern.indptr, pattern.indices, pattern.transposed, pattern.diagonal, known.order, known.indptr, known.indices,
        known.diagonal, known.place,
    )  # fmt: skip


def equation_kernels(p: Pattern, matrix: np.ndarray, factors: np.ndarray, right: np.ndarray) -> EquationKernels:
    """Pointers to the kernels for arrays of these types."""
    filled = p.filled_rows, p.filled_columns, p.filled_diagonal
    return pointers(
        EquationKernels(factorise, solve_refined),
        EquationKernels(
            (matrix, p.place, *filled, True, factors),
            (p.order, *filled, factors, p.rows, p.columns, matrix, right, 0.0, True, True),
        ),
    )


@kernel
def pattern_at(t: np.ndarray, k: int) -> Pattern:
    """Pattern in a table of `fsm.kernels.addresses`, from row k on."""
    return Pattern(
        integers_1d(t, k), integers_1d(t, k + 1), integers_1d(t, k + 2), integers_1d(t, k + 3), integers_1d(t, k + 4),
        integers_1d(t, k + 5), integers_1d(t, k + 6), integers_1d(t, k + 7), integers_1d(t, k + 8),
    )  # fmt: skip


@kernel
def set_factors(
    by: EquationKernels, p: Pattern, matrix: np.ndarray, factors: np.ndarray, flags: np.ndarray
) -> bool:
    """Factorise a matrix; false if it is singular. `flags` (3,) belong to the model."""
    symmetric = is_symmetric(matrix, p.rows, p.columns, p.transposed, SYMMETRY_TOLERANCE)
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
    x, error, doubtful = by.solve(
        p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, factors, p.rows, p.columns, matrix, right,
        REFINE_ABOVE, flags[SYMMETRIC] == 1, flags[TRUSTED] == 1,
    )  # fmt: skip
    if not error <= MAX_ERROR:
        flags[FAILED] = 1
    flags[TRUSTED] = 0 if doubtful else 1
    return x
