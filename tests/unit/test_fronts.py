"""Factorisation of large symmetric matrices by dense fronts: solutions, negative pivots, fill, choice of the method."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fsm.kernels.blocks
from fsm.errors import NotConverged
from fsm.kernels.block_lu import fill_in
from fsm.kernels.blocks import BlockMatrix, BlockPattern, Elimination
from fsm.kernels.fronts import Supernodes, count_negative_pivots, factorise_fronts, solve_by_fronts, solve_columns
from fsm.kernels.programs import ramp
from fsm.model.bodies.group import body_pattern
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.loading import Loading, SupportMotion
from fsm.model.nodes.system.build import MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.equations import linear
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import equilibrium
from fsm.solve.equations.supernodes import supernodes


def random_symmetric(rows: int, columns: int, size: int, links: int, seed: int) -> BlockMatrix:
    """A grid with some additional links; the matrix is indefinite and far from singular."""
    rng = np.random.default_rng(seed)
    grid = np.arange(rows * columns).reshape(rows, columns)
    pairs = [
        np.column_stack([grid[:-1].ravel(), grid[1:].ravel()]),
        np.column_stack([grid[:, :-1].ravel(), grid[:, 1:].ravel()]),
        rng.integers(0, rows * columns, (links, 2)),
    ]
    pattern = body_pattern(np.arange(rows * columns), pairs, size)
    data = rng.normal(size=(len(pattern.indices), size, size))
    data[pattern.diagonal] += 5.0 * size * rng.choice([-1.0, 1.0], (rows * columns, 1, 1)) * np.eye(size)
    return BlockMatrix(pattern, data).symmetric()


def eliminated(pattern: BlockPattern) -> Elimination:
    order = np.random.default_rng(0).permutation(pattern.order)
    return Elimination(order, *fill_in(pattern.indptr, pattern.indices, order))


@settings(deadline=None, max_examples=40)  # the first call compiles
@given(
    rows=st.integers(1, 9),
    columns=st.integers(1, 9),
    size=st.sampled_from([1, 3, 6, 9]),
    links=st.integers(0, 12),
    seed=st.integers(0, 10**6),
)
def test_fronts_solve_as_a_dense_solver_and_count_negative_eigenvalues(
    rows: int, columns: int, size: int, links: int, seed: int
) -> None:
    matrix = random_symmetric(rows, columns, size, links, seed)
    pattern = matrix.pattern
    nodes = supernodes(pattern, eliminated(pattern))
    assert sorted(nodes.order) == list(range(rows * columns))
    factors = np.full(nodes.factors[-1], np.nan)
    assert factorise_fronts(nodes, pattern.indptr, pattern.indices, matrix.data, factors) == -1
    right = np.random.default_rng(seed).normal(size=matrix.order)
    x, error, _ = solve_by_fronts(nodes, factors, pattern.indptr, pattern.indices, matrix.data, right, 1e-10, False)
    dense = matrix.bsr().toarray()
    np.testing.assert_allclose(dense @ x, right, atol=1e-9)
    assert error < 1e-10
    several = solve_columns(nodes, factors, np.column_stack([right, -2.0 * right]))
    np.testing.assert_allclose(several, np.column_stack([x, -2.0 * x]), rtol=1e-9, atol=1e-12 * np.abs(x).max())
    assert count_negative_pivots(nodes, factors) == int(np.sum(np.linalg.eigvalsh(dense) < 0.0))


@pytest.mark.parametrize(("size", "most"), [(3, 2.5), (6, 2.0), (9, 1.8)])
def test_merged_supernodes_add_few_zeros(size: int, most: float) -> None:
    pattern = random_symmetric(30, 30, size, 0, 0).pattern
    solver = LinearSolver()
    known, _ = solver.ready(pattern)
    nodes: Supernodes = supernodes(pattern, known)
    upper = int(np.sum(known.indptr[1:] - known.diagonal))
    # the square of each pivot is stored, and merged fronts add zeros
    assert upper * size**2 <= nodes.factors[-1] < most * upper * size**2
    assert np.diff(nodes.first).max() > 10  # the last separator of 30 nodes is not cut in pieces
    for s, (first, last) in enumerate(zip(nodes.start[:-1], nodes.start[1:], strict=True)):
        assert np.all(np.diff(nodes.rows[first:last]) > 0)
        assert np.all(nodes.rows[first:last] >= nodes.first[s + 1])


def pulled(cells: int) -> AncfSystem:
    """A film whose edges are moved outwards by a thousandth."""
    builder, lines = MeshBuilder(), np.linspace(0.0, 0.3, cells + 1)
    edge = builder.film(lines, lines, (FilmMaterial(2.5e9, 0.34, 1420.0, 25e-6),)).edge()
    builder.hold(edge, (2,))
    mesh = builder.build()
    plane = np.concatenate([edge, edge + 1])
    motion = SupportMotion(plane, 1e-3 * (mesh.coordinates[plane] - np.where(plane % 9 < 2, 0.15, 0.0)), ramp())
    return AncfSystem(mesh, Loading(motions=(motion,)))


def test_large_symmetric_matrices_take_fronts_and_all_others_do_not() -> None:
    large, small = (pulled(cells).linearise(0.0, pulled(cells).start, None).stiffness for cells in (24, 12))
    solver, right = LinearSolver(), np.random.default_rng(0).normal(size=large.order)

    def fronts(matrix: BlockMatrix) -> bool:
        solver.factorise(matrix)
        return solver._supernodes is not None

    assert fronts(large)
    assert not fronts(small)
    skew = BlockMatrix(large.pattern, large.data.copy())
    skew.data[large.pattern.diagonal[300], 0, 1] += 1e-3 * np.abs(large.data).max()
    assert not fronts(skew)
    assert not fronts(BlockMatrix(large.pattern, large.data + 0j))
    apart = BlockMatrix(large.pattern, large.data.copy())
    apart.data[large.pattern.rows != large.pattern.indices] = 0.0  # as contacts that are open
    assert not fronts(apart)
    assert fronts(large)
    by_fronts = solver.solve(right)
    np.testing.assert_allclose(large.times(by_fronts), right, atol=1e-9 * np.abs(large.data).max())
    assert solver.fallbacks == 0


def test_several_right_sides_are_refined_as_one_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """The factors have an error of 1e-6; one refinement reduces the error of every solution to about its square."""
    matrix = random_symmetric(12, 12, 9, 10, 3)
    monkeypatch.setattr(fsm.kernels.blocks, "FRONTS_FROM", 0.0)
    solver = LinearSolver()
    solver.factorise(matrix)
    assert solver._supernodes is not None
    solver._front_factors *= 1.0 + 1e-6
    monkeypatch.setattr(fsm.kernels.block_lu, "REFINE_ABOVE", 1e-9)
    rights = np.random.default_rng(4).normal(size=(3, matrix.order))
    found = solver._solve_all(rights)
    exact = np.linalg.solve(matrix.bsr().toarray(), rights.T)
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())


def test_fronts_begin_earlier_for_small_blocks() -> None:
    solver = LinearSolver()
    for cells, size, fronts in ((40, 3, True), (12, 3, False), (13, 9, False)):
        solver.factorise(random_symmetric(cells, cells, size, 0, 1))
        assert (solver._supernodes is not None) == fronts


def test_accurate_fronts_need_no_second_count_of_negative_pivots(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second count takes several times as long as the factorisation by fronts."""
    matrix = random_symmetric(14, 14, 3, 0, 5)
    negative = int(np.sum(np.linalg.eigvalsh(matrix.bsr().toarray()) < 0.0))
    monkeypatch.setattr(fsm.kernels.blocks, "FRONTS_FROM", 0.0)
    monkeypatch.setattr("fsm.solve.equations.inertia.negative_eigenvalues", lambda *_: -1)
    solver = LinearSolver()
    solver.factorise(matrix)
    assert solver._supernodes is not None and negative > 0
    assert solver.negative_pivots() == negative
    monkeypatch.setattr(linear, "ACCURATE", 0.0)
    assert solver.negative_pivots() == -1


def test_equilibrium_by_fronts_is_that_by_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for bound in (np.inf, 0.0):
        monkeypatch.setattr(fsm.kernels.blocks, "FRONTS_FROM", bound)
        system = pulled(6)
        assert (system.arrays_at_rest(LinearSolver().ready) is None) == (bound == 0.0)
        found.append(equilibrium(system, system.start, np.array([0.0, 1.0])))
    assert np.abs(found[0] - system.start).max() > 1e-4
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-10 * np.abs(found[0]).max())


def test_superlu_takes_over_where_a_front_is_singular_or_the_residual_is_poor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fsm.kernels.blocks, "FRONTS_FROM", 0.0)
    pattern = body_pattern(np.arange(40), [np.column_stack([np.arange(39), np.arange(1, 40)])], 3)
    solver = LinearSolver()
    with pytest.raises(NotConverged, match="mechanism"):
        solver.factorise(BlockMatrix(pattern, np.ones_like(pattern.zeros())))
    matrix = random_symmetric(6, 6, 3, 4, 0)
    matrix.data[matrix.pattern.diagonal] = 1e-18 * np.eye(3)
    # merged blocks exchange rows inside a panel, so a small diagonal entry alone causes no loss
    right, solver = np.arange(108.0), LinearSolver()
    solver.factorise(matrix)
    np.testing.assert_allclose(matrix.times(solver.solve(right)), right, atol=1e-7)


def test_fronts_keep_the_digits_of_soft_directions_beside_stiff_ones() -> None:
    """Links of a chain are 1e10 times as stiff along their directions as across. The backward error of a solution is
    round-off; with inverses of the pivots, it is larger by the condition number of a pivot.
    """
    rng, count, size = np.random.default_rng(1), 40, 3
    bodies = np.arange(count)
    pattern = body_pattern(bodies, [np.column_stack([bodies[:-1], bodies[1:]])], size)
    dense = np.zeros((count * size, count * size))
    for i in range(count - 1):
        way = rng.normal(size=size)
        way /= np.linalg.norm(way)
        link = 1e10 * np.outer(way, way) + np.eye(size)
        for a, b, sign in ((i, i, 1.0), (i + 1, i + 1, 1.0), (i, i + 1, -1.0), (i + 1, i, -1.0)):
            dense[a * size : a * size + size, b * size : b * size + size] += sign * link
    dense[:size, :size] += np.eye(size)
    data = np.array([
        dense[r * size : r * size + size, c * size : c * size + size]
        for r in range(count) for c in pattern.indices[pattern.indptr[r] : pattern.indptr[r + 1]]
    ])  # fmt: skip
    nodes = supernodes(pattern, eliminated(pattern))
    factors = np.zeros(nodes.factors[-1])
    assert factorise_fronts(nodes, pattern.indptr, pattern.indices, data, factors) == -1
    assert count_negative_pivots(nodes, factors) == 0
    right = dense @ rng.normal(size=count * size)
    x = solve_columns(nodes, factors, right.reshape(-1, 1)).ravel()
    error = np.abs(dense @ x - right) / (np.abs(dense) @ np.abs(x) + np.abs(right))
    assert error.max() < 1e-13
