"""Linear solvers with one interface: analyse a pattern once, factorise and solve often.

* ``block``: LU on the blocks (`fsm.kernels.block_lu`), rows in minimum-degree order. Default. Large symmetric matrices are
  factorised by dense fronts in nearly the same order (`fsm.kernels.fronts`).
* ``splu``: SuperLU. SuperLU replaces ``block`` for one matrix if a pivot fails or the residual is poor.
* ``pardiso``: PARDISO of Intel MKL, for large membranes; requires the extra ``mkl``.

`fsm.solve.equations.low_rank` adds a part of low rank to solutions and to the number of negative pivots.
"""

from __future__ import annotations

from typing import Any, ClassVar, Literal
from weakref import WeakKeyDictionary

import numpy as np

from fsm.errors import FsmError, NotConverged
from fsm.kernels import block_lu, fronts
from fsm.kernels.block_equations import FACTORISE, FAILED, NEGATIVE, SOLVE, SYMMETRIC, UNKNOWN, Pattern, pattern_arrays
from fsm.kernels.blocks import SMALL_BLOCKS, BlockMatrix, BlockPattern, Elimination
from fsm.kernels.fronts import Supernodes
from fsm.kernels.low_rank import LowRankEquations
from fsm.kernels.minimum_degree import few_by_minimum_degree
from fsm.solve.equations.low_rank import LowRankSolution, shifted
from fsm.solve.equations.supernodes import supernodes
from fsm.solve.stepping.accuracy import ACCURATE, trial_vector

Backend = Literal["block", "splu", "pardiso"]

_REAL = np.dtype(np.float64)
_NONZERO = 0.75
"""Smallest fraction of nonzero blocks for which fronts are used; fronts do not skip zero blocks of open contacts and
held nodes."""


_FEW = 100
"""Largest number of rows for which SuperLU is not used. SuperLU is faster, but its import takes 65 ms."""


def _minimum_degree(pattern: BlockPattern) -> np.ndarray:
    """Order of the rows by minimum degree on the graph of the blocks; large patterns use the order of SuperLU."""
    if pattern.order > _FEW:
        return many_by_minimum_degree(pattern)
    return few_by_minimum_degree(pattern.indptr, pattern.indices)


def many_by_minimum_degree(pattern: BlockPattern) -> np.ndarray:
    """Order of the rows by SuperLU's multiple minimum degree."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    count = pattern.order
    if count < 3:
        return np.arange(count)
    # the matrix is diagonally dominant, so no row exchange disturbs the order
    data = np.full(len(pattern.indices), -1.0 / (count + 1.0))
    data[pattern.diagonal] = 1.0
    graph = sparse.csc_matrix((data, pattern.indices, pattern.indptr), shape=(count, count))
    factors = splu(graph, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.argsort(factors.perm_c)


_SHIFT = 1e-9
"""Stiffness over the largest one that makes a singular matrix regular."""
_SAME = 1e-6
"""Relative difference of entries below which they count as equal."""
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
    _fronts: ClassVar[WeakKeyDictionary[BlockPattern, Supernodes]] = WeakKeyDictionary()

    def __init__(self, backend: Backend = "block") -> None:
        self.backend = backend
        self.analyses = self.factorisations = self.fallbacks = 0
        self._pardiso = _pardiso_solver() if backend == "pardiso" else None
        self._pattern: BlockPattern | None = None
        self._elimination: Elimination | None = None
        self._matrix: BlockMatrix | None = None
        self._factors = np.zeros((0, 0, 0))
        self._supernodes: Supernodes | None = None
        self._front_factors = np.zeros(0)
        self._other: Any = None
        self._symmetric = self._trusted = False
        self._low_rank: LowRankSolution | None = None
        self._places: np.ndarray | None = None
        self._equations: tuple[tuple[BlockPattern, int], LowRankEquations, Pattern] | None = None
        self._compiled: LowRankEquations | None = None

    def factorise(self, matrix: BlockMatrix) -> None:
        """Factorise a real or complex matrix; it must not change until the last `solve` with it.

        Raises
        ------
        NotConverged
            The matrix is singular.
        """
        self._low_rank, self._compiled = None, None
        if matrix.low_rank is None:
            self._factorise_blocks(matrix)
            return
        if self._factorise_compiled(matrix):
            return
        self._low_rank = self._with_low_rank(matrix)
        if self._low_rank.singular:
            self._low_rank = self._with_low_rank(matrix)

    def _factorise_compiled(self, matrix: BlockMatrix) -> bool:
        """Factorise a real matrix with a part of low rank in a kernel; false if only the methods in Python can."""
        low_rank, pattern = matrix.low_rank, matrix.pattern
        assert low_rank is not None
        known = self._analyse(pattern)
        if self.backend != "block" or matrix.data.dtype != _REAL or known.large(pattern.size, SMALL_BLOCKS):
            return False
        key = pattern, len(low_rank.weights)
        if self._equations is None or self._equations[0] != key:
            order = np.arange(matrix.order)
            unit = LowRankEquations(low_rank.vectors, low_rank.weights, order, trial_vector(matrix.order), ACCURATE)
            self._equations = key, unit, pattern_arrays(pattern, known)
        _, equations, arrays = self._equations
        equations.use(arrays, low_rank, matrix.data, self.ready(pattern)[1])
        equations.flags[FAILED] = 0
        self.factorisations += 1
        if equations.do(FACTORISE, equations.flags.astype(float)) == 0.0 or equations.flags[FAILED]:
            return False
        self._compiled, self._matrix = equations, matrix
        return True

    def _with_low_rank(self, matrix: BlockMatrix) -> LowRankSolution:
        base, terms = shifted(matrix, self._places)
        try:
            self._factorise_blocks(base)
            found = LowRankSolution(matrix, terms, self._solve_blocks, self._solve_all)
            self._places = found.places
        # the matrix has a mode without any stiffness; the component along this mode follows from a slightly stiffer matrix
        except NotConverged:
            data, diagonal, entries = base.data.copy(), matrix.pattern.diagonal, range(matrix.pattern.size)
            data[diagonal[:, None], entries, entries] += _SHIFT * np.abs(data).max(initial=0.0)
            self._factorise_blocks(base.with_data(data))
            self._places = LowRankSolution(matrix, terms, self._solve_blocks, self._solve_all).places
            base, terms = shifted(matrix, self._places)
            self._factorise_blocks(base)
            found = LowRankSolution(matrix, terms, self._solve_blocks, self._solve_all)
        return found

    def _factorise_blocks(self, matrix: BlockMatrix) -> None:
        self.factorisations += 1
        self._matrix, self._other, self._trusted, self._supernodes = matrix, None, False, None
        if self.backend != "block":
            self._other = self._library_factors(matrix)
            return
        pattern, known = matrix.pattern, self._analyse(matrix.pattern)
        self._symmetric = matrix.data.dtype == _REAL and bool(
            block_lu.is_symmetric(
                matrix.data, pattern.indptr, pattern.indices, pattern.transposed, block_lu.SYMMETRY_TOLERANCE
            )
        )
        if self._has_fronts(matrix, known):
            nodes = self._ready_fronts(pattern, known)
            failed = fronts.factorise_fronts(nodes, pattern.indptr, pattern.indices, matrix.data, self._front_factors)
        else:
            self.ready(pattern, matrix.data.dtype)
            failed = block_lu.factorise(
                matrix.data, known.place, known.indptr, known.indices, known.diagonal, self._symmetric, self._factors
            )
        if failed >= 0:
            self.fallbacks += 1
            self._other = self._library_factors(matrix)

    @property
    def symmetric(self) -> bool:
        """Whether the last matrix was symmetric."""
        if self._compiled is None or self._matrix is None or self._matrix.low_rank is None:
            return self._symmetric and self._low_rank is None
        weights = self._matrix.low_rank.weights
        apart = np.abs(weights - weights.T).max(initial=0.0)
        return bool(
            self._compiled.flags[SYMMETRIC] and apart <= block_lu.SYMMETRY_TOLERANCE * np.abs(weights).max(initial=0.0)
        )

    def ready(self, pattern: BlockPattern, dtype: np.dtype = _REAL) -> tuple[Elimination, np.ndarray]:
        """Elimination of a pattern, and the block data (n_filled, size, size) for its factors."""
        known = self._analyse(pattern)
        shape = known.factors(pattern.size)
        if self._factors.shape != shape or self._factors.dtype != dtype:
            self._factors = np.empty(shape, dtype=dtype)
        return known, self._factors

    def adopt(self, matrix: BlockMatrix, symmetric: bool, trusted: bool, times: int) -> None:
        """Use factors that the caller has computed in the data of `ready`; the caller has made `times` factorisations, and
        the last one is used. `trusted` tells whether its last solution needed no refinement.
        """
        if matrix.low_rank is not None:
            self.factorise(matrix)
            return
        self.factorisations += times
        self._low_rank, self._compiled = None, None
        self._matrix, self._other, self._trusted, self._symmetric = matrix, None, trusted, symmetric
        self._supernodes = None

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution (n,) of A x = b, with one refinement if its backward error is too large.

        After a solution with a small backward error, the check is skipped for the same factors, since it costs as much as a
        solution.
        """
        if self._compiled is not None:
            x = right.astype(float)
            self._compiled.do(SOLVE, x)
            if not self._compiled.flags[FAILED]:
                return x
            self._in_python()
        return self._solve_blocks(right) if self._low_rank is None else self._low_rank.solve(right)

    def _in_python(self) -> None:
        """Factorise the last matrix again by the methods in Python."""
        matrix, self._compiled = self._matrix, None
        assert matrix is not None
        self._low_rank = self._with_low_rank(matrix)

    def _solve_blocks(self, right: np.ndarray) -> np.ndarray:
        if self._other is not None:
            return np.asarray(self._other(right))
        matrix = self._matrix
        assert matrix is not None
        pattern = matrix.pattern
        if pattern.order == 0:
            return np.zeros(0)
        known, nodes = self._elimination, self._supernodes
        assert known is not None
        if nodes is not None:
            x, error, doubtful = fronts.solve_by_fronts(
                nodes, self._front_factors, pattern.indptr, pattern.indices, matrix.data, right, block_lu.REFINE_ABOVE,
                self._trusted
            )
        else:
            x, error, doubtful = block_lu.solve_refined(
                known.order, known.indptr, known.indices, known.diagonal, self._factors,
                pattern.indptr, pattern.indices, matrix.data, right, block_lu.REFINE_ABOVE, self._symmetric, self._trusted,
            )  # fmt: skip
        if not error <= block_lu.MAX_ERROR:
            self.fallbacks += 1
            self._other = self._library_factors(matrix)
            return np.asarray(self._other(right))
        self._trusted = not doubtful
        return np.asarray(x)

    def _solve_all(self, rights: np.ndarray) -> np.ndarray:
        """Solutions (n, k) for k right sides (k, n); fronts solve them together, refined if the first solution needed it."""
        found = [self._solve_blocks(right) for right in rights[:1]]
        if len(rights) > 1 and self._supernodes is not None and self._other is None:
            assert self._matrix is not None
            wanted = np.ascontiguousarray(rights[1:].T)
            others = fronts.solve_columns(self._supernodes, self._front_factors, wanted)
            if not self._trusted:
                rest = np.ascontiguousarray(wanted - self._matrix.blocks() @ others)
                others += fronts.solve_columns(self._supernodes, self._front_factors, rest)
            return np.column_stack([*found, others])
        return np.column_stack([*found, *(self._solve_blocks(right) for right in rights[1:])])

    def negative_pivots(self, recount: bool = True) -> int:
        """Number of negative eigenvalues of a symmetric matrix.

        Round-off of the factors can change the sign of a small pivot. Unless the first solution was accurate or a test
        vector shows that the factors are, the eigenvalues are therefore counted by other factorisations
        (`fsm.solve.equations.inertia`). With `recount` false, the signs of the block pivots are used without this check.
        """
        if self._compiled is not None:
            number = self._compiled.do(NEGATIVE, self._compiled.flags.astype(float))
            if number != UNKNOWN:
                return int(number)
            self._in_python()
        found = self._negative_pivots(recount)
        return found if self._low_rank is None else found + self._low_rank.more_negative

    def _negative_pivots(self, recount: bool) -> int:
        matrix = self._matrix
        assert matrix is not None
        if self._other is None and self._elimination is not None:
            if self._supernodes is not None:
                found = int(fronts.count_negative_pivots(self._supernodes, self._front_factors))
            elif self._symmetric:
                found = int(block_lu.count_negative(self._elimination.diagonal, self._factors))
            else:
                found = int(block_lu.count_negative_parts(self._elimination.diagonal, self._factors))
            if not (recount and self._symmetric) or (found == 0 and self._trusted) or self._signs_hold():
                return found
        return self.negative_eigenvalues(BlockMatrix(matrix.pattern, matrix.data))

    def negative_eigenvalues(self, matrix: BlockMatrix) -> int:
        """Number of negative eigenvalues of any symmetric matrix, also of a singular one (`fsm.solve.equations.inertia`)."""
        from fsm.solve.equations.inertia import (
            negative_eigenvalues,  # SciPy's import takes longer than many runs of small models
        )

        return negative_eigenvalues(matrix, self._analyse(matrix.pattern))

    def negative_real_pivots(self) -> int:
        """Number of negative real eigenvalues of the pivot blocks; `negative_pivots` for a symmetric matrix.

        For an unsymmetric matrix this number and the number of negative real eigenvalues of the matrix are both even or
        both odd. If the block pivots failed, scalar pivots count
        (`fsm.solve.equations.inertia.negative_pivots_of_unsymmetric`).
        """
        matrix = self._matrix
        assert matrix is not None
        if self._symmetric or self._low_rank is not None or self._compiled is not None:
            return self.negative_pivots()
        if self._other is not None or self._elimination is None:
            from fsm.solve.equations.inertia import negative_pivots_of_unsymmetric

            return negative_pivots_of_unsymmetric(matrix)
        own = self._elimination.diagonal
        values = np.linalg.eigvals(self._factors[-len(own) :] @ self._factors[own])
        return int(np.sum((values.real < 0.0) & (np.abs(values.imag) <= _REAL_TO * np.abs(values.real))))

    # inside ---------------------------------------------------------------------------------------------------------

    def _signs_hold(self) -> bool:
        """Whether round-off of the factors cannot have changed the sign of an eigenvalue.

        The factors are those of A + E. If a sign differs, an eigenvalue of A^-1 E is -1 or below, and a solution without
        refinement of A x = A x0 has an error as large as the part of x0 along its eigenvector.
        """
        matrix, known = self._matrix, self._elimination
        assert matrix is not None and known is not None
        pattern, data = matrix.pattern, matrix.data
        test = trial_vector(matrix.order)
        right = matrix.times(test)
        if self._supernodes is not None:
            found, _, _ = fronts.solve_by_fronts(
                self._supernodes, self._front_factors, pattern.indptr, pattern.indices, data, right, block_lu.REFINE_ABOVE,
                True
            )
        else:
            found, _, _ = block_lu.solve_refined(
                known.order, known.indptr, known.indices, known.diagonal, self._factors, pattern.indptr, pattern.indices,
                data, right, block_lu.REFINE_ABOVE, self._symmetric, True,
            )  # fmt: skip
        return bool(np.abs(found - test).max(initial=0.0) < ACCURATE)

    def _analyse(self, pattern: BlockPattern) -> Elimination:
        if self._elimination is None or self._pattern is not pattern:
            self._pattern, self._elimination = pattern, self._known.get(pattern)
            if self._elimination is None:
                order = _minimum_degree(pattern)
                self._elimination = Elimination(order, *block_lu.fill_in(pattern.indptr, pattern.indices, order))
                self._known[pattern] = self._elimination
                self.analyses += 1
        return self._elimination

    def _has_fronts(self, matrix: BlockMatrix, known: Elimination) -> bool:
        """Whether fronts are faster for a matrix: it is symmetric, large, and has few zero blocks."""
        size = matrix.pattern.size
        if not self._symmetric or matrix.data.dtype != _REAL or not known.fronts_are_faster(size):
            return False
        return bool(fronts.count_nonzero(matrix.data) >= _NONZERO * len(matrix.data))

    def _ready_fronts(self, pattern: BlockPattern, known: Elimination) -> Supernodes:
        """Supernodes of a pattern, with the array for their factors."""
        nodes = self._fronts.get(pattern)
        if nodes is None:
            nodes = self._fronts[pattern] = supernodes(pattern, known)
        if len(self._front_factors) != nodes.factors[-1]:
            self._front_factors = np.empty(nodes.factors[-1])
        self._supernodes = nodes
        return nodes

    def _library_factors(self, matrix: BlockMatrix) -> Any:
        """Function that solves with the matrix, by PARDISO if selected, else by SuperLU."""
        scalar = matrix.blocks()
        if self._pardiso is not None:
            csr = scalar.tocsr()
            self._pardiso.factorize(csr)
            return lambda right: self._pardiso.solve(csr, right)
        from scipy.sparse.linalg import splu

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


def first_of_largest(size: np.ndarray) -> np.ndarray:
    """Number of the first of the largest entries of each row (..., n), for signs of modes that no round-off changes.

    Entries that differ by less than 1e-6 count as equal, like those of a symmetric mode.
    """
    return np.argmax(size > (1.0 - _SAME) * size.max(axis=-1, keepdims=True), axis=-1)
