"""Equations whose matrix has a part of low rank, against dense ones."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.kernels.blocks import BlockMatrix, BlockPattern, LowRank
from fsm.solve.equations.linear import LinearSolver


def ring(rng: np.random.Generator, count: int, diagonal: float) -> BlockMatrix:
    """Symmetric matrix of random blocks between nodes beside each other in a ring."""
    pairs = sorted({(i, j % count) for i in range(count) for j in (i - 1, i, i + 1)})
    rows, columns = np.array([(i, j % count) for i, j in pairs]).T
    pattern = BlockPattern(np.searchsorted(rows, np.arange(count + 1)), columns.copy(), 3)
    matrix = BlockMatrix(pattern, rng.normal(size=(len(rows), 3, 3))).symmetric()
    matrix.data[pattern.diagonal] += diagonal * np.eye(3)
    return matrix


@pytest.mark.parametrize("kind", ["indefinite", "definite", "rank deficient", "singular blocks"])
def test_solution_and_number_of_negative_eigenvalues(kind: str) -> None:
    """The matrix is unchanged; a vector may have no weight, and the blocks alone may be singular along a coordinate."""
    rng = np.random.default_rng(3)
    blocks = ring(rng, 10, 0.0 if kind == "indefinite" else 8.0)
    vectors, weights = rng.normal(size=(3, 30)), rng.normal(size=(3, 3))
    weights = weights + weights.T
    if kind == "rank deficient":
        vectors[1], weights[:, 2], weights[2] = 0.0, 0.0, 0.0
    if kind == "singular blocks":
        blocks.data[blocks.pattern.rows == 0, 0] = 0.0
        blocks.data[blocks.pattern.indices == 0, :, 0] = 0.0
    matrix, before = BlockMatrix(blocks.pattern, blocks.data, LowRank(vectors, weights)), blocks.data.copy()
    dense, right = matrix.bsr().toarray(), rng.normal(size=30)
    solver = LinearSolver()
    for _ in range(2):  # the second time with the components that the first one has found
        solver.factorise(matrix)
        np.testing.assert_allclose(dense @ solver.solve(right), right, rtol=0.0, atol=1e-9)
        assert solver.negative_pivots() == int(np.sum(np.linalg.eigvalsh(dense) < 0.0))
        np.testing.assert_array_equal(matrix.data, before)
