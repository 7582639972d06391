"""Sides of points near joints of panels: each joint has one side, and points that come from outside of a corner remain
outside."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.interactions.surfaces.closest_planar import probe_points_planar
from fsm.interactions.surfaces.closest_spatial import probe_points_spatial
from fsm.interactions.surfaces.probe_sides import turned_sides
from fsm.model.compile.compile_case import compile_case
from fsm.model.contact.surfaces.panel_points import Corners
from fsm.model.contact.surfaces.surface_contacts import SurfaceContacts
from fsm.model.system.system import SegmentSystem

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
DEEP = 0.5


def points_of(spatial: bool) -> Callable[..., np.ndarray]:
    return probe_points_spatial if spatial else probe_points_planar


def strip(spatial: bool) -> SegmentSystem:
    changes = ["expect=none", "strip.segments_per_panel=3", f"solve.spatial={str(spatial).lower()}"]
    return compile_case(load_case(CASE, changes).case)[1]


@pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
def test_corners_of_the_strip(spatial: bool) -> None:
    """A joint and its twin count as one point on one surface; a point and its copy across a corner count as one point on
    two."""
    system = strip(spatial)
    geometry = system.contacts[0].geometry
    assert isinstance(geometry, SurfaceContacts)
    probes, corners = geometry.probes, geometry.corners
    points = points_of(spatial)(system.place(0.0, *system.initial())[0], probes.body, probes.place)
    here = np.arange(len(points))
    paired = np.flatnonzero(corners.twin != here)
    # joints 1 to 5 of every panel that shares the joint next to them, once for each line of points across
    assert len(paired) == 8 * (2 if spatial else 1)
    np.testing.assert_allclose(points[corners.twin[paired]], points[paired], atol=1e-12)
    np.testing.assert_array_equal(probes.first_piece[corners.twin[paired]], probes.first_piece[paired])
    assert np.all(probes.body[corners.twin[paired]] != probes.body[paired])
    for at_end in (0, 1):
        rows = np.flatnonzero(corners.across[:, at_end] >= 0)
        across = corners.across[rows, at_end]
        assert len(rows)
        np.testing.assert_array_equal(probes.body[across], probes.body[rows])
        np.testing.assert_allclose(points[across], points[rows], atol=1e-15)
        watched = probes.first_piece if at_end else probes.last_piece
        joined = probes.last_piece if at_end else probes.first_piece
        np.testing.assert_array_equal(watched[across], joined[rows])
        assert np.all(np.abs(corners.inside[rows, at_end]) == 1.0)


@pytest.mark.parametrize(
    ("before", "side", "height", "expected"),
    [
        # faces 0 and 1 of a corner, with the inside of both at +; for face 1 the stored side of the point is -, outside
        (0.0, 1.0, (0.1, 0.1), -1.0),  # overlapping, and new over face 0: the point is outside of face 0, too
        (0.0, 1.0, (0.3, 0.1), 0.0),  # deeper in that face than in face 1: the point lies on that face
        (0.0, 1.0, (0.1, 0.3), -1.0),
        (0.0, 1.0, (0.1, -0.1), 1.0),  # outside of face 1; face 0 sees the point on its inner side, behind face 1
        (0.0, -1.0, (-0.1, 0.1), -1.0),
        (-1.0, -1.0, (0.1, -0.1), -1.0),  # the point is pressed into face 0 as before
        (-1.0, -1.0, (0.1, 0.1), -1.0),
        (-1.0, -1.0, (0.6, -0.1), 1.0),  # the point has moved around the corner to face 1
        (-1.0, -1.0, (0.6, 0.1), -1.0),  # has not: it is inside
        (1.0, 1.0, (-0.6, 0.1), -1.0),  # the point has come from behind face 1
        (1.0, 1.0, (-0.4, 0.1), 1.0),
    ],
)
def test_sides_at_a_corner(before: float, side: float, height: tuple[float, float], expected: float) -> None:
    corners = Corners(np.arange(2), np.array([[1, -1], [-1, -1]]), np.ones((2, 2)), np.ones((2, 2)))
    found = turned_sides(
        tuple(corners), np.array([before, -1.0]), np.array([side, -1.0]), np.array(height), np.full(2, DEEP / 0.9),
        np.array([0]), np.array([0]),
    )  # fmt: skip
    assert found.tolist() == [expected, -1.0]


def test_what_is_inside_a_corner_stays_there() -> None:
    corners = Corners(np.arange(2), np.array([[1, -1], [-1, -1]]), np.ones((2, 2)), np.ones((2, 2)))
    for before, height in ((0.0, (0.1, 0.1)), (1.0, (-0.6, 0.1))):
        found = turned_sides(
            tuple(corners), np.array([before, 1.0]), np.ones(2), np.array(height), np.full(2, DEEP / 0.9), np.array([0]),
            np.array([0]),
        )  # fmt: skip
        assert found.tolist() == [1.0, 1.0]


def test_a_joint_has_the_side_of_its_twin() -> None:
    corners = Corners(np.array([1, 1]), np.full((2, 2), -1), np.zeros((2, 2)), np.zeros((2, 2)))
    none = np.zeros(0, dtype=np.int64)
    found = turned_sides(
        tuple(corners), np.zeros(2), np.array([1.0, -1.0]), np.array([0.1, 0.1]), np.full(2, DEEP / 0.9), none, none
    )
    assert found.tolist() == [-1.0, -1.0]


@pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
@pytest.mark.parametrize(
    ("down", "beyond", "turned"),
    [
        (0.5, 0.3, False),  # above the middle of the disc that rounds the tip
        (1.2, 0.9, False),  # below the middle, but the point presses on the disc
        (1.2, 1.2, True),  # below the middle, and free
        (1.99, 0.05, True),  # around the tip, and still in contact
    ],
)
def test_a_point_that_slides_round_a_tip_changes_its_side(
    down: float, beyond: float, turned: bool, spatial: bool
) -> None:
    """A point `down` below the top of the disc, `beyond` the end of the straight part, both over the radius."""
    system = strip(spatial)
    geometry = system.contacts[0].geometry
    assert isinstance(geometry, SurfaceContacts)
    probes, stations = geometry.probes, geometry.surfaces.stations
    probe = int(np.flatnonzero((probes.straight == 0.0) & (stations[probes.first_piece, 4] < 0.0))[0])
    piece, side = probes.first_piece[probe], probes.side[probe]
    poses = system.place(0.0, *system.initial())[0].copy()
    radius = 0.5 * -stations[piece, 4] * (stations[piece, 3] - stations[piece, 0])
    points = [points_of(spatial)(poses, np.array([geometry.surfaces.owners[piece, 0]]), place)[0]
              for place in (end_of(stations[piece, 0], spatial), end_of(stations[piece, 3], spatial))]  # fmt: skip
    along = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    normal = np.zeros_like(along)
    normal[0], normal[-1] = -along[-1], along[0]
    place = points[0] - beyond * radius * along + side * (probes.clearance[probe] - down * radius) * normal
    poses[probes.body[probe], : len(place)] += place - points_of(spatial)(poses, probes.body, probes.place)[probe]
    geometry.commit(poses)
    assert geometry.side[probe] == (-side if turned else side)


def end_of(station: float, spatial: bool) -> np.ndarray:
    return np.array([[station, 0.0]]) if spatial else np.array([station])
