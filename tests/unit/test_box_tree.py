"""Broad phase: nearest pieces, windows and overlapping boxes, compared with a search through all of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fsm.interactions.search.box_tree import fit_tree, nearest_piece, window_pieces
from fsm.interactions.search.chord import chord_boxes, chord_distance, chords_planar, chords_spatial
from fsm.interactions.surfaces.surface import pieces_of
from fsm.kernels.rotation import rotation_matrix
from tests.without_compiler import without_compiler

SPATIAL = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])


# chains ---------------------------------------------------------------------------------------------------------------


def straight(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Lengths and angles of the segments of a chain."""
    return np.full(60, 1e-3), np.full(60, 0.3)


def zigzag(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Almost completely folded: layers of seven segments."""
    number = np.arange(91)
    return np.full(91, 2e-3), np.where(number // 7 % 2 == 0, 0.0, np.pi) + 0.02 * rng.normal(size=91)


def rolled(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return np.full(120, 1e-3), np.cumsum(1.0 / (1.0 + 0.1 * np.arange(120)))


def coincident(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The chain goes back and forth on one line: all layers coincide."""
    return np.full(64, 1e-3), np.where(np.arange(64) // 8 % 2 == 0, 0.0, np.pi)


def mixed(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Some plates of 80 mm among segments of 0.1 mm."""
    return np.where(rng.random(80) < 0.1, 0.08, 1e-4), rng.normal(size=80)


def single(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return np.array([0.08]), np.array([-0.4])


CHAINS: list[Callable[[np.random.Generator], tuple[np.ndarray, np.ndarray]]] = [
    straight, zigzag, rolled, coincident, mixed, single,
]  # fmt: skip


def table(lengths: np.ndarray, angles: np.ndarray, spatial: bool, rng: np.random.Generator) -> np.ndarray:
    """Chords of a connected chain; in space the chain is rotated as a whole and twisted a little."""
    axes = np.column_stack([np.cos(angles), -np.sin(angles)])
    ends = np.vstack([[0.0, 0.0], np.cumsum(lengths[:, None] * axes, axis=0)])
    middle = 0.5 * (ends[1:] + ends[:-1])
    owners, stations = pieces_of(np.arange(len(lengths)), lengths / 2)
    if not spatial:
        return chords_planar(np.column_stack([middle, angles]), owners, stations)
    poses = np.zeros((len(lengths), 7))
    whole = rng.normal(size=4)
    turn = rotation_matrix(whole / np.linalg.norm(whole))
    poses[:, :3] = np.column_stack([middle[:, 0], 0.0 * middle[:, 0], middle[:, 1]]) @ turn.T
    for i, angle in enumerate(angles):
        own = np.array([np.cos(angle / 2), 0.02 * rng.normal(), np.sin(angle / 2), 0.0])
        poses[i, 3:] = product(whole / np.linalg.norm(whole), own / np.linalg.norm(own))
    return chords_spatial(poses, owners, stations, rng.uniform(0.01, 0.03, len(owners)))


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Of quaternions."""
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def scene(number: int, spatial: bool) -> dict[str, Any]:
    """All chains, each a surface, in one table, and probes near and far that watch one of them each."""
    rng = np.random.default_rng(number)
    parts = [table(*chain(rng), spatial, rng) for chain in CHAINS]
    chords = np.vstack(parts)
    size = 3 if spatial else 2
    edges = np.cumsum([0] + [len(part) for part in parts])
    surface = np.repeat(np.arange(len(parts)), 30)
    points = np.empty((len(surface), size))
    for i, own in enumerate(surface):
        piece = rng.integers(edges[own], edges[own + 1])
        on_it = chords[piece, :size] + rng.random() * chords[piece, size : 2 * size]
        if spatial:
            on_it = on_it + rng.uniform(-1.3, 1.3) * chords[piece, 11] * chords[piece, 8:11]
        points[i] = on_it + 10.0 ** rng.uniform(-6, -1) * rng.normal(size=size)
    points[0] = chords[0, :size]  # at the end of one piece, and as far from two others
    points[1] = chords[5, :size]
    return {
        "points": points,
        "first": edges[surface],
        "last": edges[surface + 1],
        "chords": chords,
        "reach": rng.uniform(1e-3, 0.05, len(points)),
        "margin": float(rng.uniform(0.0, 4e-3)),
    }


def windows(given: dict[str, Any], nearest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The results of the tree."""
    chords, nearest = given["chords"], nearest.copy()
    window = np.full((len(nearest), 2), -7)
    window_pieces(
        given["points"], given["first"], given["last"], chords, fit_tree(*chord_boxes(chords)),
        given["reach"], given["margin"], nearest, window,
    )  # fmt: skip
    return nearest, window


def all_distances(given: dict[str, Any], i: int) -> np.ndarray:
    """Squared distances of a point from all pieces of its surface."""
    pieces = range(given["first"][i], given["last"][i])
    return np.array([chord_distance(given["chords"][j], given["points"][i]) for j in pieces])


@SPATIAL
@pytest.mark.parametrize("number", range(6))
def test_windows_are_those_of_a_look_at_all_pieces(number: int, spatial: bool) -> None:
    given = scene(number, spatial)
    nearest, window = windows(given, np.full(len(given["points"]), -1))
    seen = 0
    for i, first in enumerate(given["first"]):
        square = all_distances(given, i)
        if square.min() >= given["reach"][i] ** 2:
            assert nearest[i] == -1
            assert window[i, 0] == window[i, 1]
            continue
        seen += 1
        assert nearest[i] == first + np.argmin(square)
        within = np.flatnonzero(square < min(np.sqrt(square.min()) + given["margin"], given["reach"][i]) ** 2)
        within = np.append(within, np.argmin(square))
        assert tuple(window[i]) == (first + within.min(), first + within.max() + 1)
    assert 50 < seen < len(nearest) - 10


@SPATIAL
def test_where_one_looks_first_changes_nothing(spatial: bool) -> None:
    given = scene(7, spatial)
    count = len(given["points"])
    cold = windows(given, np.full(count, -1))
    rng = np.random.default_rng(0)
    anywhere = rng.integers(-5, len(given["chords"]) + 5, count)
    for start in (cold[0], given["first"], given["last"] - 1, given["last"], anywhere):
        for one, other in zip(cold, windows(given, start), strict=True):
            np.testing.assert_array_equal(one, other)


@SPATIAL
def test_a_window_holds_the_nearest_piece_until_distances_have_changed_by_half_the_margin(spatial: bool) -> None:
    given = scene(8, spatial) | {"margin": 3e-3, "reach": np.full(180, 0.05)}
    reach = {"reach": given["reach"] - 1.5e-3}  # objects that are later in the window were within its reach before
    nearest, window = windows(given, np.full(180, -1))
    rng = np.random.default_rng(1)
    for _ in range(5):
        step = rng.normal(size=given["points"].shape)
        moved = given | {"points": given["points"] + 1.49e-3 * step / np.linalg.norm(step, axis=1)[:, None]}
        after, _ = windows(moved | reach, nearest)
        inside = (nearest >= 0) & (after >= 0)
        assert inside.sum() > 60
        assert np.all((window[inside, 0] <= after[inside]) & (after[inside] < window[inside, 1]))


@SPATIAL
def test_nearest_piece_alone(spatial: bool) -> None:
    given = scene(9, spatial)
    tree = fit_tree(*chord_boxes(given["chords"]))
    for i in range(0, len(given["points"]), 7):
        square = all_distances(given, i)
        search = (given["points"][i], given["first"][i], given["last"][i], given["chords"], tree, -1)
        piece, found = nearest_piece(*search, np.inf)
        assert (piece, found) == (given["first"][i] + np.argmin(square), square.min())
        assert nearest_piece(*search, square.min()) == (-1, square.min())  # nearer than the bound, and not equally near


@SPATIAL
def test_no_pieces_and_no_probes(spatial: bool) -> None:
    given = scene(3, spatial)
    nothing = given | {"last": given["first"]}
    nearest, window = windows(nothing, np.zeros(180, dtype=np.int64))
    assert np.all(nearest == -1)
    assert np.all(window[:, 0] == window[:, 1])
    nobody = {key: value[:0] if key in ("points", "first", "last", "reach") else value for key, value in given.items()}
    assert windows(nobody, np.zeros(0, dtype=np.int64))[1].shape == (0, 2)
    empty = fit_tree(*chord_boxes(given["chords"][:0]))
    assert nearest_piece(given["points"][0], 0, 0, given["chords"][:0], empty, -1, np.inf) == (-1, np.inf)


@SPATIAL
def test_a_point_that_is_not_a_number_is_near_nothing(spatial: bool) -> None:
    given = scene(3, spatial)
    given["points"][::2, 1] = np.nan
    nearest, window = windows(given, np.full(180, -1))
    assert np.all(nearest[::2] == -1)
    assert np.all(window[::2, 0] == window[::2, 1])
    assert np.any(nearest[1::2] >= 0)


def test_distances_of_chords_in_space() -> None:
    """A rectangle: distances along it, across within the width, and across beyond the width."""
    poses = np.array([[0.0, 0, 0, 1, 0, 0, 0]])
    owners, stations = pieces_of(np.array([0]), np.array([0.5]))
    chords = chords_spatial(poses, owners, stations, np.array([0.2, 0.2]))
    for point, distance in (
        ([-0.2, 0.1, 0.3], 0.3), ([-0.2, 0.3, 0.0], 0.1), ([-0.8, -0.6, 0.0], 0.5), ([0.3, 0.1, -0.4], np.hypot(0.3, 0.4)),
    ):  # fmt: skip
        assert chord_distance(chords[0], np.array(point)) == pytest.approx(distance**2)


def test_chords_in_space_are_those_in_the_plane() -> None:
    rng = np.random.default_rng(2)
    lengths, angles = zigzag(rng)
    owners, stations = pieces_of(np.arange(len(lengths)), lengths / 2)
    place = rng.normal(size=(len(lengths), 2))
    spatial = np.zeros((len(lengths), 7))
    spatial[:, [0, 2]] = place
    spatial[:, 3], spatial[:, 5] = np.cos(angles / 2), np.sin(angles / 2)
    flat = chords_planar(np.column_stack([place, angles]), owners, stations)
    solid = chords_spatial(spatial, owners, stations, np.full(len(owners), 0.1))
    np.testing.assert_allclose(solid[:, [0, 2, 3, 5, 6, 7]], flat, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(solid[:, 11], 0.1, atol=1e-12)


def test_a_piece_without_length_is_a_point() -> None:
    owners, stations = np.array([[0, 1]]), np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    chords = chords_planar(np.array([[1.0, 2, 0.3], [1, 2, 0.4]]), owners, stations)
    assert chord_distance(chords[0], np.array([4.0, 6.0])) == pytest.approx(25.0)


# pure Python ----------------------------------------------------------------------------------------------------------


def evaluate() -> list[Any]:
    """All kernels of this file, for small scenes."""
    found: list[Any] = []
    for spatial in (False, True):
        given = scene(11, spatial)
        keep = slice(None, None, 9)
        some = {key: value[keep] if key in ("points", "first", "last", "reach") else value for key, value in given.items()}
        found += windows(some, np.full(len(some["points"]), -1))
    return found


def test_compiled_is_what_python_says() -> None:
    wanted = without_compiler(__file__, "fsm.interactions.search.box_tree.fit_tree")
    for compiled, python in zip(evaluate(), wanted, strict=True):
        np.testing.assert_array_equal(compiled, python)
