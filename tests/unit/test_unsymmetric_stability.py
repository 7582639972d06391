"""Stability from an unsymmetric matrix whose own factors do not show it, in a kernel."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.kernels.block_equations import UNKNOWN, equation_kernels, pattern_arrays, set_factors, solution
from fsm.kernels.blocks import BlockMatrix, BlockPattern
from fsm.model.bodies.array_pivots import negative_of_last
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.stepping.accuracy import ACCURATE, trial_vector


@pytest.mark.parametrize("negative", [0, 1])
def test_the_symmetric_part_decides(negative: int) -> None:
    """A definite symmetric part proves stability; an indefinite one proves nothing, and the factors remain those of A."""
    rng, count = np.random.default_rng(5), 8
    pairs = [(i, j) for i in range(count) for j in range(max(i - 1, 0), min(i + 2, count))]
    rows, columns = np.array(pairs).T
    pattern = BlockPattern(np.searchsorted(rows, np.arange(count + 1)), columns.copy(), 3)
    symmetric = BlockMatrix(pattern, rng.normal(size=(len(rows), 3, 3))).symmetric()
    symmetric.data[pattern.diagonal] += 12.0 * np.eye(3)
    symmetric.data[pattern.diagonal[4], 1, 1] -= 40.0 * negative
    other = BlockMatrix(pattern, rng.normal(size=(len(rows), 3, 3)))
    data = symmetric.data + other.data - other.symmetric().data
    dense, right = symmetric.with_data(data).blocks().toarray(), rng.normal(size=3 * count)
    assert np.sum(np.linalg.eigvalsh(0.5 * (dense + dense.T)) < 0.0) == negative
    known, factors = LinearSolver().ready(pattern)
    p, flags = pattern_arrays(pattern, known), np.zeros(3, dtype=np.int64)
    equations = equation_kernels(p, data, factors, right)
    assert set_factors(equations, p, data, factors, flags, True)
    found = negative_of_last(equations, p, data, factors, flags, trial_vector(3 * count), ACCURATE)
    assert found == (UNKNOWN if negative else 0.0)
    if negative:
        np.testing.assert_allclose(dense @ solution(equations, p, data, factors, flags, right), right, atol=1e-10)
