"""Block matrices with a part of low rank: products, solutions, and negative pivots, against dense matrices."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.kernels.blocks import BlockMatrix, BlockPattern, LowRank
from fsm.solve.equations.linear import LinearSolver

COUNT = 8


def chain(seed: int, low_rank: LowRank, soft: float = 0.0) -> BlockMatrix:
    """Chain of blocks whose first three eigenvalues are about `soft`."""
    rng = np.random.default_rng(seed)
    rows = [sorted({max(i - 1, 0), i, min(i + 1, COUNT - 1)}) for i in range(COUNT)]
    pattern = BlockPattern(
        np.cumsum([0, *map(len, rows)]), np.array([column for row in rows for column in row], dtype=np.int64), 3
    )
    data = pattern.zeros()
    place = {(i, j): k for k, (i, j) in enumerate(zip(pattern.rows.tolist(), pattern.indices.tolist(), strict=True))}
    for i in range(COUNT - 1):
        root = rng.normal(size=(3, 3))
        stiff = root @ root.T + np.eye(3)
        for a, b, sign in ((i, i, 1), (i + 1, i + 1, 1), (i, i + 1, -1), (i + 1, i, -1)):
            data[place[a, b]] += sign * stiff
    data[pattern.diagonal] += soft * np.eye(3)
    return BlockMatrix(pattern, data, low_rank)


def rank(seed: int, count: int, symmetric: bool = True) -> LowRank:
    rng = np.random.default_rng(seed)
    weights = rng.normal(size=(count, count))
    return LowRank(rng.normal(size=(count, 3 * COUNT)), weights + weights.T if symmetric else weights)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("symmetric", [True, False])
def test_solution_and_product(seed: int, symmetric: bool) -> None:
    matrix = chain(seed, rank(seed, 1 + seed % 3, symmetric), soft=0.5 - 0.2 * seed)
    dense, right = matrix.bsr().toarray(), np.random.default_rng(9).normal(size=3 * COUNT)
    np.testing.assert_allclose(dense, matrix.blocks().toarray() + matrix.low_rank.vectors.T @ matrix.low_rank.weights
                               @ matrix.low_rank.vectors)  # fmt: skip
    np.testing.assert_allclose(matrix.times(right), dense @ right, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(matrix.symmetric().bsr().toarray(), 0.5 * (dense + dense.T), rtol=1e-12, atol=1e-12)
    solver = LinearSolver()
    solver.factorise(matrix)
    np.testing.assert_allclose(solver.solve(right), np.linalg.solve(dense, right), rtol=1e-9, atol=1e-9)
    if symmetric:
        assert solver.negative_pivots() == np.sum(np.linalg.eigvalsh(dense) < 0.0)


@pytest.mark.parametrize("seed", range(8))
def test_blocks_alone_are_singular(seed: int) -> None:
    """A chain that is free to move along one axis is held by a vector alone."""
    matrix = chain(seed, LowRank(np.random.default_rng(seed).normal(size=(1, 3 * COUNT)), np.diag([10.0 ** (seed - 4)])))
    matrix.data[matrix.pattern.diagonal[0], (0, 1), (0, 1)] += 1.0
    dense, right = matrix.bsr().toarray(), np.ones(3 * COUNT)
    assert np.linalg.eigvalsh(matrix.blocks().toarray())[0] < 1e-12
    solver = LinearSolver()
    solver.factorise(matrix)
    np.testing.assert_allclose(dense @ solver.solve(right), right, rtol=1e-9, atol=1e-9)
    assert solver.negative_pivots() == 0


def test_next_matrix_without_low_rank() -> None:
    """Factors of a matrix without low rank do not keep the low-rank part of the last matrix."""
    solver, right = LinearSolver(), np.ones(3 * COUNT)
    solver.factorise(chain(1, rank(1, 2), soft=1.0))
    plain = BlockMatrix(*(getattr(chain(1, rank(1, 2), soft=1.0), name) for name in ("pattern", "data")))
    solver.factorise(plain)
    np.testing.assert_allclose(plain.times(solver.solve(right)), right, rtol=1e-10)
