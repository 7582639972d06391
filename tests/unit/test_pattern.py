"""The block-sparse pattern against a dense assembly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.scatter import add_block, find_slot, pair_slots, scatter_efforts
from fsm.model.bodies.group import body_pattern

DOF = np.array([-1, 0, 1, -1, 2, 3])
PAIRS = np.array([[0, 1], [1, 2], [4, 2], [3, 4], [5, 5]])


@pytest.mark.parametrize("size", [3, 6])
@settings(deadline=None)  # the first call may compile
@given(
    pairs=st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=12),
    seed=st.integers(0, 100),
)
def test_blocks_add_up_as_in_a_dense_matrix(size: int, pairs: list[tuple[int, int]], seed: int) -> None:
    rng = np.random.default_rng(seed)
    bodies = np.array(pairs, dtype=np.int64)
    pattern = body_pattern(DOF, [bodies], size)
    data, dense = pattern.zeros(), np.zeros((6 * size, 6 * size))
    for pair in bodies:
        block = rng.normal(size=(2 * size, 2 * size))
        add_block(block, DOF, pair, pattern.indptr, pattern.indices, data)
        rows = np.concatenate([np.arange(size) + body * size for body in pair])
        np.add.at(dense, np.ix_(rows, rows), block)  # a body that occurs twice adds both entries
    keep = np.concatenate([np.arange(size) + body * size for body in np.flatnonzero(DOF >= 0)])
    np.testing.assert_allclose(BlockMatrix(pattern, data).bsr().toarray(), dense[np.ix_(keep, keep)], atol=1e-14)


def test_pattern_is_symmetric_sorted_and_has_the_diagonal() -> None:
    pattern = body_pattern(DOF, [PAIRS[:2], PAIRS[2:]], 3)
    filled = np.zeros((4, 4), dtype=bool)
    for row in range(4):
        columns = pattern.indices[pattern.indptr[row] : pattern.indptr[row + 1]]
        assert np.all(np.diff(columns) > 0)
        filled[row, columns] = True
    assert np.array_equal(filled, filled.T)
    np.testing.assert_array_equal(filled, np.eye(4, dtype=bool) | _links((0, 1), (1, 2)))
    assert pattern.zeros().shape == (8, 3, 3)


def _links(*pairs: tuple[int, int]) -> np.ndarray:
    links = np.zeros((4, 4), dtype=bool)
    for i, j in pairs:
        links[i, j] = links[j, i] = True
    return links


@settings(deadline=None)
@given(
    there=st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=8),
    wanted=st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=3),
)
def test_pattern_knows_what_it_holds(there: list[tuple[int, int]], wanted: list[tuple[int, int]]) -> None:
    pattern = body_pattern(DOF, [np.array(there)], 3)
    filled = np.zeros((4, 4), dtype=bool)
    filled[pattern.rows, pattern.indices] = True
    blocks = [(DOF[a], DOF[b]) for a, b in wanted if DOF[a] >= 0 and DOF[b] >= 0]
    assert pattern.holds(np.array(wanted)) == all(filled[i, j] for i, j in blocks)


def test_find_slot() -> None:
    pattern = body_pattern(DOF, [PAIRS], 3)
    for row in range(4):
        for column in range(4):
            slot = find_slot(pattern.indptr, pattern.indices, row, column)
            inside = column in pattern.indices[pattern.indptr[row] : pattern.indptr[row + 1]]
            assert (slot >= 0) == inside
            if inside:
                assert pattern.indices[slot] == column
                assert pattern.indptr[row] <= slot < pattern.indptr[row + 1]
    assert find_slot(pattern.indptr, pattern.indices, -1, 0) == -1
    assert find_slot(pattern.indptr, pattern.indices, 0, -1) == -1


def test_pair_slots() -> None:
    pattern = body_pattern(DOF, [PAIRS], 3)
    slots = pair_slots(PAIRS, *pattern.index)
    for pair, row in zip(PAIRS, slots, strict=True):
        wanted = [find_slot(pattern.indptr, pattern.indices, DOF[i], DOF[j]) for i in pair for j in pair]
        assert list(row) == wanted
    assert np.count_nonzero(slots < 0) == 6  # both pairs with a held body keep one block


def test_no_free_body_is_an_empty_pattern() -> None:
    pattern = body_pattern(np.array([-1, -1]), [np.array([[0, 1]])], 6)
    assert BlockMatrix(pattern, pattern.zeros()).bsr().shape == (0, 0)


def test_efforts_scatter_to_minus_the_gradient() -> None:
    rng = np.random.default_rng(0)
    bodies, gradient, effort = np.array([[0, 1, 1], [2, 0, 3]]), rng.normal(size=(2, 2, 9)), rng.normal(size=(2, 2))
    force = np.ones((4, 3))
    scatter_efforts(bodies, gradient, effort, 2, force)
    wanted = np.ones((4, 3))
    for i in range(2):
        for b in range(3):
            wanted[bodies[i, b]] -= effort[i] @ gradient[i, :, 3 * b : 3 * b + 3]
    np.testing.assert_allclose(force, wanted, atol=1e-14)
    first_only = np.zeros((4, 3))
    scatter_efforts(bodies, gradient, effort, 1, first_only)
    assert not first_only[[2, 3]].any()
    assert first_only[[0, 1]].all()
