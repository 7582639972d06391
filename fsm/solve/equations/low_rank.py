"""Solutions of equations whose matrix is a block matrix plus a part of low rank, A + V^T W V (Woodbury, 1950).

A may be singular although the sum is not, for example if a gas alone holds a piston. Each vector v of V therefore adds a
stiffness s = |W_ii| max v^2 at one component e to the factorised matrix, and -s e e^T to the part of low rank. The component
is the largest one of A^-1 v, which a nearly singular A turns into its softest mode.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from fsm.kernels.blocks import BlockMatrix, LowRank

_REFINE_ABOVE = 1e-13
"""Residual relative to the right side from which a solution is refined."""
_NO_WEIGHT = 1e-14
"""Eigenvalue of W over the largest one, up to which its direction has no weight."""
_SOFT = 1e6
"""Bound of the ratio of two stiffnesses, of a vector and of the blocks along it; above it the blocks count as singular."""


def shifted(matrix: BlockMatrix, places: np.ndarray | None) -> tuple[BlockMatrix, LowRank]:
    """Block matrix that can be factorised, and the part of low rank that completes it to the given matrix.

    `places` (k,) are the components e; None selects the largest entries of V.
    """
    low_rank = matrix.low_rank
    assert low_rank is not None
    if places is None or len(places) != len(low_rank.vectors):
        places = np.argmax(np.abs(low_rank.vectors), axis=1)
    size, data = matrix.pattern.size, matrix.data.copy()
    shifts = np.abs(np.diag(low_rank.weights)) * np.square(low_rank.vectors).max(axis=1)
    rows, components = np.divmod(places, size)
    np.add.at(data, (matrix.pattern.diagonal[rows], components, components), shifts)
    units = np.zeros(low_rank.vectors.shape)
    units[range(len(places)), places] = 1.0
    used = shifts > 0.0
    return BlockMatrix(matrix.pattern, data), low_rank.plus(LowRank(units[used], np.diag(-shifts[used])))


class LowRankSolution:
    """Solutions with A + V^T W V, by solutions with the factors of A.

    Parameters
    ----------
    matrix : BlockMatrix
        The whole matrix, for residuals.
    low_rank : LowRank
        V and W.
    solve, solve_all : solution (n,) with the factors of A, and solutions (n, k) for k right sides (k, n)
    """

    def __init__(
        self,
        matrix: BlockMatrix,
        low_rank: LowRank,
        solve: Callable[[np.ndarray], np.ndarray],
        solve_all: Callable[[np.ndarray], np.ndarray],
    ) -> None:
        self._matrix, self._low_rank, self._solve_blocks, self._solve_all = matrix, low_rank, solve, solve_all
        self._blocks = matrix.blocks()

    @cached_property
    def _columns(self) -> np.ndarray:
        """A^-1 V^T, (n, k)."""
        return self._solve_all(self._low_rank.vectors.astype(self._matrix.data.dtype))

    @cached_property
    def _inner(self) -> np.ndarray:
        """V A^-1 V^T, (k, k)."""
        return np.asarray(self._low_rank.vectors @ self._columns)

    @cached_property
    def _correction(self) -> np.ndarray:
        """(1 + W V A^-1 V^T)^-1 W, (k, k); NaN if the whole matrix is singular."""
        weights = self._low_rank.weights
        try:
            return np.linalg.solve(np.eye(len(weights)) + weights @ self._inner, weights)
        except np.linalg.LinAlgError:
            return np.full(weights.shape, np.nan)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution (n,), with one refinement if its residual is above round-off."""
        x = self._once(right)
        rest = right - self._blocks @ x
        if self._matrix.low_rank is not None:
            rest -= self._matrix.low_rank.times(x)
        if np.abs(rest).max(initial=0.0) > _REFINE_ABOVE * np.abs(right).max(initial=0.0):
            x = x + self._once(rest)
        return x

    def _once(self, right: np.ndarray) -> np.ndarray:
        x = self._solve_blocks(right)
        return np.asarray(x - self._columns @ (self._correction @ (self._low_rank.vectors @ x)))

    @property
    def places(self) -> np.ndarray:
        """Degrees of freedom (k,), one for each vector, at which an added stiffness makes the blocks nonsingular."""
        assert self._matrix.low_rank is not None
        return np.argmax(np.abs(self._columns[:, : len(self._matrix.low_rank.vectors)]), axis=0)

    @property
    def singular(self) -> bool:
        """Whether the blocks are nearly singular along a vector."""
        ratio = np.abs(np.diag(self._inner) * np.diag(self._low_rank.weights))
        return not bool(np.all(ratio < _SOFT))

    @property
    def more_negative(self) -> int:
        """Number of negative eigenvalues of the whole symmetric matrix minus the number of A (Haynsworth, 1968).

        The matrix [[A, V^T], [V, -W^-1]] has as many as -W^-1 and A + V^T W V together, and as many as A and
        -W^-1 - V A^-1 V^T together. Directions without weight are not counted.
        """
        values, turn = np.linalg.eigh(0.5 * (self._low_rank.weights + self._low_rank.weights.T))
        used = np.abs(values) > _NO_WEIGHT * np.abs(values).max(initial=0.0)
        turn, values = turn[:, used], values[used]
        inner = turn.T @ self._inner @ turn
        scale = np.sqrt(np.abs(values))
        whole = np.diag(np.sign(values)) + scale[:, None] * inner * scale
        return int(np.sum(np.linalg.eigvalsh(0.5 * (whole + whole.T)) > 0.0) - np.sum(values > 0.0))
