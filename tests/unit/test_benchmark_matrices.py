"""The matrices for timing the linear solvers have the properties that their names say, and both solvers solve them."""

import numpy as np
import pytest

from fsm.solve.equations.linear import LinearSolver
from validation.benchmarks.linear_algebra import TOUCHING, chain, linear_table, measure_linear, touching_chain


def test_contacts_are_added_to_the_chain_and_keep_it_symmetric() -> None:
    alone, touching = chain(40), touching_chain(40)
    added = len(touching.pattern.indices) - len(alone.pattern.indices)
    assert 0 < added <= 2 * TOUCHING * 40
    whole = touching.bsr().toarray()
    np.testing.assert_allclose(whole, whole.T, atol=1e-9 * np.abs(whole).max())
    more = np.linalg.eigvalsh(whole - alone.bsr().toarray())
    assert more.min() > -1e-9 * more.max()  # springs push back
    assert np.sum(more > 1e-9 * more.max()) == TOUCHING * 40


@pytest.mark.parametrize("backend", ["block", "splu"])
def test_both_solve_with_them(backend: str) -> None:
    matrix = touching_chain(40)
    solver, expected = LinearSolver(backend), np.random.default_rng(0).standard_normal(matrix.order)
    solver.factorise(matrix)
    np.testing.assert_allclose(solver.solve(matrix.times(expected)), expected, rtol=1e-6, atol=1e-6)


def test_table_has_a_line_a_matrix() -> None:
    rows = list(measure_linear(["chain of 40 segments"]))
    assert float(rows[0]["time_s"]) > 0.0
    assert linear_table(rows).splitlines()[2].startswith("| chain of 40 segments | 120 | ")
