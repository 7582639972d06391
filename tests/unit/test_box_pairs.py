"""Pairs of boxes found by a tree, compared with all pairs, and boxes compared with the corners of their contents."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.interactions.contact.shapes import Shapes
from fsm.interactions.search.box_pairs import ListedPairs, overlapping_boxes
from fsm.interactions.shapes.shape_distance import BOX, HALF_SPACE, shape_boxes_planar, shape_boxes_spatial
from fsm.kernels.rotation import rotation_matrix


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("listed", [0, 40, 3000])
@pytest.mark.parametrize("seed", range(5))
def test_pairs_are_those_that_overlap(seed: int, listed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    low = rng.uniform(0.0, [1.0, 5.0, 2.0][:size], size=(80, size))
    high = low + rng.uniform(0.0, 0.6, size=low.shape)
    low[[3, 70]], high[[3, 70]] = -np.inf, np.inf
    pairs = rng.integers(80, size=(listed, 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]  # in any order, some pairs twice
    meet = ((low[pairs[:, 0]] <= high[pairs[:, 1]]) & (low[pairs[:, 1]] <= high[pairs[:, 0]])).all(axis=1)
    every = ListedPairs([np.array([shape]) for shape in range(80)], pairs, 80)
    members, rows = every.overlapping(low, high)
    np.testing.assert_array_equal(np.sort(rows), np.flatnonzero(meet))
    np.testing.assert_array_equal(every.shape[members], pairs[rows])
    np.testing.assert_array_equal(np.lexsort((rows, members[:, 1], members[:, 0])), np.arange(len(rows)))
    assert listed < 100 or 100 < len(rows) < 2000


@pytest.mark.parametrize("seed", range(5))
def test_sides_stand_for_all_pairs_of_their_shapes(seed: int) -> None:
    """A side with itself and with another side, and single shapes, some of them in two sides."""
    rng = np.random.default_rng(seed)
    low = rng.uniform(0.0, 1.0, size=(60, 3))
    high = low + rng.uniform(0.0, 0.7, size=low.shape)
    sides = [np.arange(25), np.arange(25, 40), np.array([40]), np.array([3]), np.arange(41, 60)[::-1]]
    pairs, numbers = np.array([[0, 0], [1, 0], [3, 2], [4, 2], [4, 4]]), np.array([7, 3, 9, 4, 5])
    wanted = set()
    for (one, two), number in zip(pairs, numbers, strict=True):
        for i in sides[one]:
            for j in sides[two]:
                if i != j and np.all(low[i] <= high[j]) and np.all(low[j] <= high[i]):
                    wanted.add((min(i, j), max(i, j), number))
    listed = ListedPairs(sides, pairs, 60, numbers)
    members, found = listed.overlapping(low, high)
    shapes = np.sort(listed.shape[members], axis=1)
    assert len(found) == len(wanted) > 50
    assert set(zip(*shapes.T.tolist(), found.tolist(), strict=True)) == wanted
    members, found = listed.everything()
    both = listed.among(np.column_stack(np.triu_indices(60, 1)))
    np.testing.assert_array_equal(members, both[0])
    np.testing.assert_array_equal(found, both[1])
    assert len(found) <= listed.at_most()


@pytest.mark.parametrize("count", [0, 1, 5, 300])
def test_equal_and_empty_boxes_are_all_paired(count: int) -> None:
    """All boxes are at one place, where the order along a space-filling curve is no help."""
    boxes = np.ones((count, 3))
    found = overlapping_boxes(boxes, boxes)
    assert len(np.unique(np.sort(found, axis=1), axis=0)) == len(found) == count * (count - 1) // 2


@pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
def test_boxes_just_hold_their_shapes(spatial: bool) -> None:
    rng = np.random.default_rng(7)
    size, radius = np.array([0.3, 0.2, 0.1]), 0.05
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * size
    for _ in range(20):
        turn, at, axes = rng.normal(size=4), rng.normal(size=3), rng.normal(size=4)
        if not spatial:
            turn[[1, 3]] = axes[[1, 3]] = at[1] = 0.0
        turn, axes = turn / np.linalg.norm(turn), axes / np.linalg.norm(axes)
        offset = rng.normal(size=3) * [1.0, spatial, 1.0]
        points = (corners @ rotation_matrix(axes).T + offset) @ rotation_matrix(turn).T + at
        kinds = np.array([BOX, HALF_SPACE])
        body, sizes, radii = np.zeros(2, dtype=np.int64), np.tile(size, (2, 1)), np.full(2, radius)
        if spatial:
            low, high = shape_boxes_spatial(
                np.concatenate([at, turn])[None],
                Shapes(body, kinds, sizes, np.tile(offset, (2, 1)), np.tile(rotation_matrix(axes), (2, 1, 1)), radii),
            )
        else:
            points = points[:, [0, 2]]
            angle, own = (2.0 * np.arctan2(q[2], q[0]) for q in (turn, axes))
            low, high = shape_boxes_planar(
                np.array([[at[0], at[2], angle]]),
                Shapes(body, kinds, sizes, np.tile(offset[[0, 2]], (2, 1)), np.full(2, own), radii),
            )
        np.testing.assert_allclose(low[0], points.min(axis=0) - radius, atol=1e-12)
        np.testing.assert_allclose(high[0], points.max(axis=0) + radius, atol=1e-12)
        assert np.all(low[1] == -np.inf)
        assert np.all(high[1] == np.inf)
