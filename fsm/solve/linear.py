"""Linear solvers with one interface: analyse a pattern once, factorise and solve often.

* ``block``: LU on the blocks (`fsm.kernels.block_lu`), rows in minimum-degree order. Default.
* ``splu``: SuperLU. It replaces ``block`` for one matrix if a pivot fails or the residual is poor.
* ``pardiso``: PARDISO of Intel MKL, for large membranes; requires the extra ``mkl``.
"""

from __future__ import annotations

from typing import Any, ClassVar, Literal
from weakref import WeakKeyDictionary

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from fsm.blocks import BlockMatrix, BlockPattern, Elimination
from fsm.errors import FsmError, NotConverged
from fsm.kernels.block_lu import (
    MAX_ERROR,
    REFINE_ABOVE,
    SYMMETRY_TOLERANCE,
    count_negative,
    factorise,
    fill_in,
    is_symmetric,
    solve_refined,
)

__all__ = ["Backend", "LinearSolver"]

Backend = Literal["block", "splu", "pardiso"]

_REAL = np.dtype(np.float64)


def _minimum_degree(pattern: BlockPattern) -> np.ndarray:
    """Order of the rows by SuperLU's multiple minimum degree on the graph of the blocks."""
    count = pattern.order
    if count < 3:
        return np.arange(count)
    # diagonally dominant, so that no row exchange disturbs the order
    data = np.full(len(pattern.indices), -1.0 / (count + 1.0))
    data[pattern.diagonal] = 1.0
    graph = sparse.csc_matrix((data, pattern.indices, pattern.indptr), shape=(count, count))
    factors = splu(graph, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.argsort(factors.perm_c)


_REAL_TO = 1e-9
"""Ratio of imaginary to real part, below which an eigenvalue is real."""


class LinearSolver:
    """Solver that factorises block matrices.

    Parameters
    ----------
    backend : "block", "splu" or "pardiso"

    Attributes
    ----------
    analyses, factorisations, fallbacks : int
        New patterns analysed, matrices factorised, and matrices for which SuperLU replaced the block solver.

    Raises
    ------
    FsmError
        PARDISO is selected but not installed.
    """

    _known: ClassVar[WeakKeyDictionary[BlockPattern, Elimination]] = WeakKeyDictionary()
    """Analyses of patterns, shared by all solvers, with the lifetime of the patterns."""

    def __init__(self, backend: Backend = "block") -> None:
        self.backend = backend
        self.analyses = self.factorisations = self.fallbacks = 0
        self._pardiso = _pardiso_solver() if backend == "pardiso" else None
        self._pattern: BlockPattern | None = None
        self._elimination: Elimination | None = None
        self._matrix: BlockMatrix | None = None
        self._factors = np.zeros((0, 0, 0))
        self._other: Any = None
        self._symmetric = self._trusted = False

    def factorise(self, matrix: BlockMatrix) -> None:
        """Factorise a real or complex matrix; it must not change until the last `solve` with it.

        Raises
        ------
        NotConverged
            The matrix is singular.
        """
        self.factorisations += 1
        self._matrix, self._other, self._trusted = matrix, None, False
        if self.backend != "block":
            self._other = self._library_factors(matrix)
            return
        known, _ = self.ready(matrix.pattern, matrix.data.dtype)
        self._symmetric = bool(is_symmetric(matrix.data, matrix.pattern.transposed, SYMMETRY_TOLERANCE))
        failed = factorise(
            matrix.data, known.place, known.indptr, known.indices, known.diagonal, self._symmetric, self._factors
        )
        if failed >= 0:
            self.fallbacks += 1
            self._other = self._library_factors(matrix)

    def ready(self, pattern: BlockPattern, dtype: np.dtype = _REAL) -> tuple[Elimination, np.ndarray]:
        """Elimination of a pattern, and the block data (n_filled, size, size) for its factors."""
        known = self._analyse(pattern)
        shape = (len(known.indices), pattern.size, pattern.size)
        if self._factors.shape != shape or self._factors.dtype != dtype:
            self._factors = np.empty(shape, dtype=dtype)
        return known, self._factors

    def adopt(self, matrix: BlockMatrix, symmetric: bool, times: int) -> None:
        """Use factors that the caller has computed in the data of `ready`, in the last of `times` factorisations."""
        self.factorisations += times
        self._matrix, self._other, self._trusted, self._symmetric = matrix, None, False, symmetric

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution (n,) of A x = b, with one refinement if its backward error is too large.

        After a solution with a small backward error, the check is skipped for the same factors, since it costs as much as a
        solution.
        """
        if self._other is not None:
            return np.asarray(self._other(right))
        matrix = self._matrix
        assert matrix is not None
        pattern = matrix.pattern
        if pattern.order == 0:
            return np.zeros(0)
        known = self._elimination
        assert known is not None
        x, error, refined = solve_refined(
            known.order, known.indptr, known.indices, known.diagonal, self._factors,
            pattern.indptr, pattern.indices, matrix.data, right, REFINE_ABOVE, self._symmetric, self._trusted,
        )  # fmt: skip
        if not error <= MAX_ERROR:
            self.fallbacks += 1
            self._other = self._library_factors(matrix)
            return np.asarray(self._other(right))
        self._trusted = not refined
        return np.asarray(x)

    def negative_pivots(self) -> int:
        """Number of negative eigenvalues of a symmetric matrix; by a dense solver if the block pivots failed."""
        assert self._matrix is not None
        if self._other is None and self._elimination is not None:
            return int(count_negative(self._elimination.diagonal, self._factors))
        values = np.linalg.eigvalsh(self._matrix.bsr().toarray())
        return int(np.sum(values < -1e-12 * np.abs(values).max(initial=0.0)))

    def negative_real_pivots(self) -> int:
        """Number of negative real eigenvalues of the pivot blocks; `negative_pivots` for a symmetric matrix.

        For an unsymmetric matrix it is even or odd as the number of negative real eigenvalues of the matrix.
        """
        assert self._matrix is not None
        if self._other is None and self._elimination is not None:
            values = np.linalg.eigvals(self._factors[self._elimination.diagonal])
        else:
            values = np.linalg.eigvals(self._matrix.bsr().toarray())
        return int(np.sum((values.real < 0.0) & (np.abs(values.imag) <= _REAL_TO * np.abs(values.real))))

    # inside ---------------------------------------------------------------------------------------------------------

    def _analyse(self, pattern: BlockPattern) -> Elimination:
        if self._elimination is None or self._pattern is not pattern:
            self._pattern, self._elimination = pattern, self._known.get(pattern)
            if self._elimination is None:
                order = _minimum_degree(pattern)
                self._elimination = Elimination(order, *fill_in(pattern.indptr, pattern.indices, order))
                self._known[pattern] = self._elimination
                self.analyses += 1
        return self._elimination

    def _library_factors(self, matrix: BlockMatrix) -> Any:
        """Function that solves with the matrix, by PARDISO if selected, else by SuperLU."""
        scalar = matrix.bsr()
        if self._pardiso is not None:
            csr = scalar.tocsr()
            self._pardiso.factorize(csr)
            return lambda right: self._pardiso.solve(csr, right)
        try:
            return splu(scalar.tocsc()).solve
        except RuntimeError:
            raise NotConverged(
                "the linear equations are singular: a part of the model moves without resistance (a mechanism); "
                "add a support or a stiffness"
            ) from None


def _pardiso_solver() -> Any:
    try:
        from pypardiso import PyPardisoSolver
    except ImportError:
        raise FsmError("PARDISO is not installed: pip install 'fsm[mkl]', or set linear = \"block\"") from None
    return PyPardisoSolver()
