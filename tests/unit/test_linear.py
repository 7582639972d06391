"""The block LU compared with dense and SuperLU solutions, its count of negative pivots, and its behaviour for singular
matrices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.linalg import splu

from fsm.errors import NotConverged
from fsm.kernels.block_lu import fill_in, is_symmetric
from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.minimum_degree import few_by_minimum_degree
from fsm.model.bodies.group import body_pattern
from fsm.solve.equations.linear import LinearSolver, many_by_minimum_degree


def random_matrix(count: int, size: int, links: int, seed: int, symmetric: bool = False) -> BlockMatrix:
    """A chain with some more links, not definite, far from singular."""
    rng = np.random.default_rng(seed)
    chain = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    pairs = np.vstack([chain, rng.integers(0, count, (links, 2))])
    pattern = body_pattern(np.arange(count), [pairs], size)
    data = rng.normal(size=(len(pattern.indices), size, size))
    data[pattern.diagonal] += 4.0 * size * rng.choice([-1.0, 1.0], (count, 1, 1)) * np.eye(size)
    matrix = BlockMatrix(pattern, data)
    return matrix.symmetric() if symmetric else matrix


def _parts(matrix: BlockMatrix) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    pattern = matrix.pattern
    return matrix.data, pattern.indptr, pattern.indices, pattern.transposed


@settings(deadline=None, max_examples=60)  # the first call may compile
@given(
    count=st.integers(1, 40), size=st.sampled_from([1, 3, 6, 9]), links=st.integers(0, 30), seed=st.integers(0, 10**6)
)
def test_solves_as_a_dense_solver_does(count: int, size: int, links: int, seed: int) -> None:
    matrix = random_matrix(count, size, links, seed)
    right = np.random.default_rng(seed).normal(size=matrix.order)
    solver = LinearSolver()
    solver.factorise(matrix)
    dense = matrix.bsr().toarray()
    np.testing.assert_allclose(dense @ solver.solve(right), right, atol=1e-9)
    assert solver.fallbacks == 0


@settings(deadline=None, max_examples=40)
@given(count=st.integers(1, 40), size=st.sampled_from([3, 6, 9]), links=st.integers(0, 30), seed=st.integers(0, 10**6))
def test_symmetric_matrices_by_their_right_half(count: int, size: int, links: int, seed: int) -> None:
    matrix = random_matrix(count, size, links, seed, symmetric=True)
    assert is_symmetric(*_parts(matrix), 0.0)
    right = np.random.default_rng(seed).normal(size=matrix.order)
    solver = LinearSolver()
    solver.factorise(matrix)
    np.testing.assert_allclose(matrix.bsr().toarray() @ solver.solve(right), right, atol=1e-9)
    assert solver.fallbacks == 0
    if count > 1:  # one entry beside the diagonal block is enough to make it unsymmetric
        other = BlockMatrix(matrix.pattern, matrix.data.copy())
        other.data[np.setdiff1d(np.arange(len(matrix.data)), matrix.pattern.diagonal)[0], 0, 0] += 1e-3
        assert not is_symmetric(*_parts(other), 1e-9)
        solver.factorise(other)
        np.testing.assert_allclose(other.bsr().toarray() @ solver.solve(right), right, atol=1e-9)


def test_round_off_of_stiffnesses_that_cancel_is_symmetric() -> None:
    """Stiffnesses of elements cancel in a block; its round-off is that of the rows, and larger asymmetry counts."""
    matrix = random_matrix(6, 3, 4, 2, symmetric=True)
    block = np.setdiff1d(np.arange(len(matrix.data)), matrix.pattern.diagonal)[0]
    own = np.abs(matrix.data[matrix.pattern.diagonal]).max()
    for part, symmetric in ((1e-15, True), (1e-12, False)):
        matrix.data[block] = matrix.data[matrix.pattern.transposed[block]] = 0.0
        matrix.data[block, 0, 1] = part * own
        assert is_symmetric(*_parts(matrix), 1e-13) == symmetric


def test_complex_matrices_too() -> None:
    real, imaginary = random_matrix(30, 3, 5, 1), random_matrix(30, 3, 5, 1)
    matrix = BlockMatrix(real.pattern, real.data + 0.5j * imaginary.data[::-1])
    right = np.random.default_rng(0).normal(size=90) + 1j
    solver = LinearSolver()
    solver.factorise(matrix)
    np.testing.assert_allclose(solver.solve(right), np.linalg.solve(matrix.bsr().toarray(), right), rtol=1e-10)


@settings(deadline=None, max_examples=40)
@given(count=st.integers(2, 25), size=st.sampled_from([3, 6]), links=st.integers(0, 10), seed=st.integers(0, 10**6))
def test_negative_pivots_are_negative_eigenvalues(count: int, size: int, links: int, seed: int) -> None:
    matrix = random_matrix(count, size, links, seed, symmetric=True)
    solver = LinearSolver()
    solver.factorise(matrix)
    assert solver.negative_pivots() == int(np.sum(np.linalg.eigvalsh(matrix.bsr().toarray()) < 0.0))


@settings(deadline=None, max_examples=60)
@given(count=st.integers(1, 40), size=st.sampled_from([1, 3, 6]), links=st.integers(0, 30), seed=st.integers(0, 10**6))
def test_negative_real_pivots_tell_the_sign_of_the_determinant(count: int, size: int, links: int, seed: int) -> None:
    matrix = random_matrix(count, size, links, seed)
    solver = LinearSolver()
    solver.factorise(matrix)
    sign = np.linalg.slogdet(matrix.bsr().toarray())[0]
    assert (-1) ** solver.negative_real_pivots() == sign
    symmetric = matrix.symmetric()
    solver.factorise(symmetric)
    assert solver.negative_real_pivots() == int(np.sum(np.linalg.eigvalsh(symmetric.bsr().toarray()) < 0.0))


def chain(stiff: float, seed: int, count: int = 6, ground: float = 1.0) -> BlockMatrix:
    """Chain of bodies on soft springs (N/m), joined by stiff joints that leave one random direction soft."""
    rng = np.random.default_rng(seed)
    pattern = body_pattern(np.arange(count), [np.column_stack([range(count - 1), range(1, count)])], 6)
    dense = ground * np.eye(6 * count)
    for k in range(count - 1):
        turn, _ = np.linalg.qr(rng.normal(size=(6, 6)))
        joint = turn @ np.diag([0.1, *stiff * 10.0 ** rng.uniform(-2.0, 0.0, 5)]) @ turn.T
        rows = slice(6 * k, 6 * k + 12)
        move = np.hstack([np.eye(6) + 0.3 * rng.normal(size=(6, 6)), -np.eye(6) + 0.3 * rng.normal(size=(6, 6))])
        dense[rows, rows] += move.T @ joint @ move
    dense = 0.5 * (dense + dense.T)
    blocks = zip(pattern.rows, pattern.indices, strict=True)
    data = np.array([dense[6 * i : 6 * i + 6, 6 * j : 6 * j + 6] for i, j in blocks])
    return BlockMatrix(pattern, data)


@pytest.mark.parametrize("stiff", [1e3, 1e10, 1e12])
def test_a_definite_matrix_has_no_negative_pivots(stiff: float) -> None:
    """All eigenvalues are at least 1; Cholesky's factorisation exists, so round-off does not hide their signs."""
    solver = LinearSolver()
    for seed in range(40):
        matrix = chain(stiff, seed)
        np.linalg.cholesky(matrix.bsr().toarray())
        solver.factorise(matrix)
        assert solver.negative_pivots() == 0
        assert solver.negative_real_pivots() == 0


def second_differences(nodes: int, size: int, shift: float) -> tuple[BlockMatrix, int]:
    """Blocks 2 I, -I minus a shift, and the number of negative eigenvalues, which are 2 - 2 cos(k pi/(n + 1)) - shift."""
    pattern = body_pattern(np.arange(nodes), [np.column_stack([range(nodes - 1), range(1, nodes)])], size)
    data = np.where((pattern.rows == pattern.indices)[:, None, None], 2.0 - shift, -1.0) * np.eye(size)
    values = 2.0 - 2.0 * np.cos(np.arange(1, nodes + 1) * np.pi / (nodes + 1)) - shift
    assert np.abs(values).min() > 1e-8
    return BlockMatrix(pattern, data), size * int(np.sum(values < 0.0))


@pytest.mark.parametrize("shift", [0.0, 0.013, 0.4, 2.0001, 3.9])
def test_no_full_matrix_where_the_blocks_were_replaced(shift: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(np.linalg, "eigvalsh", None)
    monkeypatch.setattr(np.linalg, "eigvals", None)
    monkeypatch.setattr("fsm.solve.equations.inertia._by_dense", None)
    matrix, negative = second_differences(2000, 6, shift)
    solver = LinearSolver("splu")
    solver.factorise(matrix)
    assert solver.negative_pivots() == negative
    assert solver.negative_eigenvalues(matrix) == negative


@settings(deadline=None, max_examples=40)
@given(
    count=st.integers(1, 30), size=st.sampled_from([1, 3, 6]), links=st.integers(0, 20), part=st.floats(0.0, 1.0),
    seed=st.integers(0, 10**6),
)  # fmt: skip
def test_negative_eigenvalues_with_zeros_on_the_diagonal(count: int, size: int, links: int, part: float, seed: int) -> None:
    """Zeros on the diagonal, as of Lagrange multipliers and of pressure on a slack film; scales over six decades."""
    matrix, rng = random_matrix(count, size, links, seed, symmetric=True), np.random.default_rng(seed)
    pattern = matrix.pattern
    entries = np.flatnonzero(rng.random((count, size)).ravel() < part)
    matrix.data[pattern.diagonal[entries // size], entries % size, entries % size] = 0.0
    values = np.linalg.eigvalsh(matrix.bsr().toarray())
    scale = 10.0 ** rng.uniform(-3.0, 3.0, (count, size))
    scaled = matrix.data * scale[pattern.rows][:, :, None] * scale[pattern.indices][:, None, :]
    if np.abs(values).min() > 1e-6 * np.abs(values).max():
        solver, wanted = LinearSolver(), int(np.sum(values < 0.0))
        assert solver.negative_eigenvalues(BlockMatrix(pattern, scaled)) == wanted
        solver.factorise(BlockMatrix(pattern, scaled))
        assert solver.negative_pivots() == wanted


def test_zero_eigenvalues_are_not_negative() -> None:
    """Bodies on joints without any support: the six motions of the whole have no stiffness, and no sign."""
    matrix = chain(1e6, 3, 20, 0.0)
    assert LinearSolver().negative_eigenvalues(matrix) == 0


@settings(deadline=None, max_examples=60)
@given(count=st.integers(1, 40), size=st.sampled_from([1, 3, 6]), links=st.integers(0, 30), seed=st.integers(0, 10**6))
def test_scalar_pivots_of_unsymmetric_matrices_tell_the_sign_of_the_determinant(
    count: int, size: int, links: int, seed: int
) -> None:
    matrix = random_matrix(count, size, links, seed)
    solver = LinearSolver("splu")
    solver.factorise(matrix)
    assert (-1) ** solver.negative_real_pivots() == np.linalg.slogdet(matrix.bsr().toarray())[0]
    matrix.data[matrix.pattern.diagonal] *= 1e-18  # no pivots without exchanges
    full = matrix.bsr().toarray()
    if np.linalg.cond(full) < 1e10:
        solver.factorise(matrix)
        assert (-1) ** solver.negative_real_pivots() == np.linalg.slogdet(full)[0]


def test_sliding_friction_on_a_stiff_contact_is_no_negative_pivot() -> None:
    """The sliding direction has 1 N/m, the normal direction 1e6 N/m, mu = 0.3: the symmetric part has -mu^2 k/4, the matrix
    no eigenvalue below 0."""
    stiffness = BlockMatrix(body_pattern(np.arange(1), [], 2), np.array([[[1.0, 0.3e6], [0.0, 1e6]]]))
    solver = LinearSolver()
    solver.factorise(stiffness.symmetric())
    assert solver.negative_pivots() == 1
    solver.factorise(stiffness)
    assert solver.negative_real_pivots() == 0


def test_a_pattern_is_analysed_once() -> None:
    first = random_matrix(20, 3, 4, 0)
    second = BlockMatrix(first.pattern, 2.0 * first.data)
    solver = LinearSolver()
    for matrix in (first, second, first):
        solver.factorise(matrix)
    assert (solver.analyses, solver.factorisations) == (1, 3)
    right = np.ones(60)
    np.testing.assert_allclose(first.bsr() @ solver.solve(right), right, rtol=1e-10)


@pytest.mark.parametrize("count", [1, 2, 7, 40, 100])
def test_few_rows_are_ordered_as_well_as_by_superlu(count: int) -> None:
    """Averaged over random patterns, the factors have at most 1.05 times the blocks of factors with SuperLU's order."""
    blocks = np.zeros(2)
    for seed in range(20):
        pattern = random_matrix(count, 1, 1 + seed % 3, seed).pattern
        orders = few_by_minimum_degree(pattern.indptr, pattern.indices), many_by_minimum_degree(pattern)
        for k, order in enumerate(orders):
            assert sorted(order) == list(range(count))
            blocks[k] += len(fill_in(pattern.indptr, pattern.indices, order)[1])
    assert blocks[0] <= 1.05 * blocks[1]


def test_zero_blocks_of_a_superset_change_nothing() -> None:
    lean = random_matrix(20, 3, 0, 3)
    links = [np.array([[0, 19], [3, 12], [4, 13]]), np.column_stack([range(19), range(1, 20)])]
    wide = body_pattern(np.arange(20), links, 3)
    data = wide.zeros()
    for k, (row, column) in enumerate(zip(lean.pattern.rows, lean.pattern.indices, strict=True)):
        data[np.flatnonzero((wide.rows == row) & (wide.indices == column))[0]] = lean.data[k]
    solver, right = LinearSolver(), np.arange(60.0)
    solver.factorise(BlockMatrix(wide, data))
    np.testing.assert_allclose(lean.bsr() @ solver.solve(right), right, atol=1e-10)


def test_superlu_takes_over_where_a_pivot_block_is_singular() -> None:
    pattern = body_pattern(np.arange(2), [np.array([[0, 1]])], 3)
    data = pattern.zeros()
    data[1] = data[2] = np.eye(3)  # [[0, I], [I, 0]]: regular, but both pivots are zero
    solver = LinearSolver()
    solver.factorise(BlockMatrix(pattern, data))
    np.testing.assert_allclose(solver.solve(np.arange(6.0)), [3, 4, 5, 0, 1, 2])
    assert solver.fallbacks == 1
    assert solver.negative_pivots() == 3


def test_superlu_takes_over_where_the_residual_is_poor() -> None:
    matrix = random_matrix(12, 3, 30, 0)  # 6 links until 2026-11-24; in another order their solution could be refined
    matrix.data[matrix.pattern.diagonal] *= 1e-18  # regular, but element growth of 1e18 destroys all digits
    solver, right = LinearSolver(), np.arange(36.0)
    solver.factorise(matrix)
    np.testing.assert_allclose(solver.solve(right), splu(matrix.bsr().tocsc()).solve(right), rtol=1e-10)
    assert solver.fallbacks == 1


@pytest.mark.parametrize("small", [1.0, 1e-6], ids=["good factors", "factors that have to be refined"])
def test_all_solutions_with_the_same_factors_are_good(small: float) -> None:
    """If the estimates are good, only the first is checked; otherwise all are."""
    matrix = random_matrix(12, 3, 6, 0)
    matrix.data[matrix.pattern.diagonal] *= small
    solver, scalar = LinearSolver(), matrix.bsr().toarray()
    solver.factorise(matrix)
    for seed in range(5):
        right = np.random.default_rng(seed).normal(size=36)
        x = solver.solve(right)
        error = np.abs(scalar @ x - right) / (np.abs(scalar) @ np.abs(x) + np.abs(right))
        assert error.max() < 1e-10
    assert solver.fallbacks == 0


@pytest.mark.parametrize("skewed", [False, True], ids=["symmetric", "unsymmetric"])
@pytest.mark.parametrize("count", [10, 40])
def test_soft_directions_beside_stiff_links_keep_their_digits(count: int, skewed: bool) -> None:
    """A chain of bodies with links 1e7 times as stiff; inverses of pivot blocks lost all digits of more than ten bodies."""
    pattern = body_pattern(np.arange(count), [np.column_stack([range(count - 1), range(1, count)])], 6)
    rng, dense = np.random.default_rng(count), np.zeros((6 * count, 6 * count))
    links = np.zeros((5 * count, 6 * count))
    for i in range(count):  # five of six directions of each body are linked to the last body
        links[5 * i : 5 * i + 5, max(6 * i - 6, 0) : 6 * i + 6] = rng.normal(size=(5, 6 if i == 0 else 12))
    dense = 1e7 * links.T @ links + np.diag(rng.uniform(0.1, 3.0, 6 * count))
    if skewed:
        dense += np.kron(np.eye(count), rng.normal(size=(6, 6))) * 0.1
    data = np.array([
        dense[6 * i : 6 * i + 6, 6 * j : 6 * j + 6] for i, j in zip(pattern.rows, pattern.indices, strict=True)
    ])  # fmt: skip
    solver, right = LinearSolver(), rng.normal(size=6 * count)
    solver.factorise(BlockMatrix(pattern, data))
    assert solver.solve(right) == pytest.approx(np.linalg.solve(dense, right), rel=1e-4, abs=1e-6)
    assert solver.fallbacks == 0
    assert skewed or solver.negative_pivots(recount=False) == 0


def test_a_singular_matrix_is_said_to_be_one() -> None:
    pattern = body_pattern(np.arange(2), [np.zeros((0, 2), dtype=np.int64)], 3)
    solver = LinearSolver()
    with pytest.raises(NotConverged, match="mechanism"):
        solver.factorise(BlockMatrix(pattern, pattern.zeros()))


@pytest.mark.parametrize("backend", ["splu", "pardiso"])
def test_the_other_back_ends_agree(backend: str) -> None:
    if backend == "pardiso":
        pytest.importorskip("pypardiso")
    matrix = random_matrix(30, 6, 8, 5)
    right = np.random.default_rng(0).normal(size=matrix.order)
    solver = LinearSolver(backend)  # type: ignore[arg-type]
    solver.factorise(matrix)
    np.testing.assert_allclose(matrix.bsr() @ solver.solve(right), right, atol=1e-9)
