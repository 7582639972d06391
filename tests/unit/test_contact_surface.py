"""The smooth surface through the segments: its shape, and the gap while a point slides along it and around its ends."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fsm.interactions.surfaces.closest_planar import find_contacts_planar
from fsm.interactions.surfaces.closest_spatial import find_contacts_spatial
from fsm.interactions.surfaces.gap_planar import write_gap_planar
from fsm.interactions.surfaces.gap_spatial import write_gap_spatial
from fsm.interactions.surfaces.surface import BARE, STRAIGHT, TIP, blend, overshoot, pieces_of

PARTS = pytest.mark.parametrize("straight", [0.0, STRAIGHT], ids=["interior", "end probe"])
SIDES = pytest.mark.parametrize("side", [1.0, -1.0])
ENDS = pytest.mark.parametrize("last", [False, True], ids=["beginning", "end"])
SPATIAL = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
LENGTHS = np.array([0.02, 0.03, 0.025, 0.02, 0.04])
TURNS = np.array([0.1, 0.35, 0.5, 0.3, 0.45])


# shape --------------------------------------------------------------------------------------------------------


def row_of_segments(gap: float = 0.0) -> np.ndarray:
    """Poses (x, z, phi) of segments joined end to end; with `gap`, the springs of the joints are deformed."""
    poses, end = [], np.array([0.1, -0.2])
    shift = gap * np.array([[0.3, 0.7], [-0.5, 0.2], [0.4, -0.6], [0.1, 0.9], [-0.2, -0.3]])
    for length, turn, off in zip(LENGTHS, TURNS, shift, strict=True):
        axis = np.array([np.cos(turn), -np.sin(turn)])
        poses.append([*(end + off + axis * length / 2), turn])
        end = end + axis * length
    return np.array(poses)


def curve(poses: np.ndarray, piece: int, s: float) -> np.ndarray:
    """C, C_s, C_ss (3, 2) by the docstring's formula."""
    owners, stations = pieces_of(np.arange(len(poses)), LENGTHS[: len(poses)] / 2)
    weights = np.empty((3, 4))
    blend(s, stations[piece], weights)
    total = np.zeros((3, 2))
    for k in range(2):
        x, z, phi = poses[owners[piece, k]]
        axis = np.array([np.cos(phi), -np.sin(phi)])
        total += np.outer(weights[:, 2 * k], [x, z]) + np.outer(weights[:, 2 * k + 1], axis)
    return total


@cache
def dense(gap: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) of the whole curve of `row_of_segments`, m, and its normals."""
    poses = row_of_segments(gap)
    found = np.array([curve(poses, piece, s)[:2] for piece in range(6) for s in np.linspace(0, 1, 4001)])
    tangents = found[:, 1] / np.linalg.norm(found[:, 1], axis=1, keepdims=True)
    return found[:, 0], np.column_stack([-tangents[:, 1], tangents[:, 0]])


def unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


@pytest.mark.parametrize("gap", [0.0, 1e-3], ids=["closed", "joint gives"])
def test_curve_is_c1_and_touches_every_segment_in_its_middle(gap: float) -> None:
    poses = row_of_segments(gap)
    for j, (x, z, phi) in enumerate(poses):
        before, after = curve(poses, j, 1.0), curve(poses, j + 1, 0.0)
        np.testing.assert_allclose(before[0], [x, z], atol=1e-15)
        np.testing.assert_allclose(after[0], [x, z], atol=1e-15)
        axis = [np.cos(phi), -np.sin(phi)]
        np.testing.assert_allclose(unit(before[1]), axis, atol=1e-12)
        np.testing.assert_allclose(unit(after[1]), axis, atol=1e-12)
        if 0 < j < len(poses) - 1:  # also within the panel in its parameter
            np.testing.assert_allclose(before[1], after[1], atol=1e-15)


def test_derivatives_of_the_blend() -> None:
    poses, h = row_of_segments(1e-3), 1e-4
    for piece in range(len(poses) + 1):
        for s in (0.05, 0.4, 0.9):
            found = [(curve(poses, piece, s + h)[k] - curve(poses, piece, s - h)[k]) / (2 * h) for k in range(2)]
            np.testing.assert_allclose(curve(poses, piece, s)[1:], found, atol=1e-8)


@pytest.mark.parametrize("turn", [1e-3, 0.05, 0.3])
def test_departs_from_the_polygon_by_an_eighth(turn: float) -> None:
    length = LENGTHS[0]
    poses = np.array(
        [[-length / 2, 0.0, 0.0], [np.cos(turn) * length / 2, -np.sin(turn) * length / 2, turn]]
    )
    _, stations = pieces_of(np.arange(2), np.full(2, length / 2))
    weights = np.empty((3, 4))
    blend(0.5, stations[1], weights)
    axes = np.array([[1.0, 0.0], [np.cos(turn), -np.sin(turn)]])
    middle = sum(weights[0, 2 * k] * poses[k, :2] + weights[0, 2 * k + 1] * axes[k] for k in range(2))
    # the joint is the origin
    assert np.linalg.norm(middle) == pytest.approx(length * np.sin(turn / 2) / 4, rel=1e-12)
    assert np.linalg.norm(middle) == pytest.approx(length * turn / 8, rel=turn**2)


def test_ends_go_on_by_the_tip() -> None:
    poses = row_of_segments()
    _, stations = pieces_of(np.arange(5), LENGTHS / 2)
    tip = TIP * LENGTHS.sum()
    for piece, s, end, sign in ((0, stations[0, 4], 0, -1), (5, stations[5, 5], 4, 1)):
        x, z, phi = poses[end]
        axis = np.array([np.cos(phi), -np.sin(phi)])
        wanted = np.array([x, z]) + sign * (LENGTHS[end] / 2 + tip) * axis
        np.testing.assert_allclose(curve(poses, piece, s)[0], wanted, atol=1e-15)
    np.testing.assert_array_equal(stations[1:5, 4:], np.tile([0.0, 1.0], (4, 1)))


@pytest.mark.parametrize("straight", [0.0, STRAIGHT, 1.0])
def test_overshoot_begins_where_the_straight_part_ends(straight: float) -> None:
    _, stations = pieces_of(np.arange(5), LENGTHS / 2)
    tip = TIP * LENGTHS.sum()
    for piece, end, sign, length in ((0, 0.0, -1.0, LENGTHS[0] / 2), (5, 1.0, 1.0, LENGTHS[4] / 2)):
        for past in (1e-9, 0.3 * tip, tip):
            over, radius = overshoot(end + sign * (straight * tip + past) / length, stations[piece], length, straight, 0.0)
            assert over == pytest.approx(sign * past, abs=1e-16)
            assert radius == pytest.approx(tip / 2, rel=1e-12)
            before = end + sign * (straight * tip - past) / length
            assert overshoot(before, stations[piece], length, straight, 0.0) == (0, 0)
    for piece in range(1, 5):
        for s in (0.0, 1.0):
            assert overshoot(s, stations[piece], 0.01, straight, 0.0) == (0, 0)


# gap ----------------------------------------------------------------------------------------------------------


def quaternion(phi: float) -> list[float]:
    return [np.cos(phi / 2), 0.0, np.sin(phi / 2), 0.0]


def seen(
    surface: np.ndarray,
    point: np.ndarray,
    spatial: bool,
    side: float = 1.0,
    straight: float = 0.0,
    clearance: float = 1e-3,
    below: float = 1.0,
    depth_limit: float = 1.0,
) -> tuple[float, np.ndarray, np.ndarray] | None:
    """Gap (m), gradients (3, 9) of gap and slip (a vector in the plane), and their rates, for one point on a separate
    body."""
    count = len(surface)
    poses = np.vstack([surface, [*point, 0.3]])
    rates = np.linspace(-1.0, 1.0, poses.size).reshape(poses.shape)
    place, inset = -0.004, 4e-4
    poses[-1, :2] -= place * np.array([np.cos(0.3), -np.sin(0.3)])
    owners, stations = pieces_of(np.arange(count), LENGTHS[:count] / 2)
    one, only = np.ones(1), np.zeros(1, dtype=np.int64)
    body, window = np.array([count]), np.array([[0, count + 1]])
    probe, piece, facing, gap = np.empty(1, dtype=np.int64), np.empty(1, dtype=np.int64), np.empty(1), np.empty(1)
    no_share = 0.0 if straight == BARE else -1.0
    limits = (
        side * one, straight * one, (clearance * one, depth_limit * one, no_share * one), window, owners, stations
    )  # fmt: skip
    touch = (straight * one, clearance * one, inset * one, owners, stations)
    if not spatial:
        at = np.empty(1)
        found = find_contacts_planar(poses, body, place * one, *limits, only, below, (probe, piece, facing, at, gap))
        if not found:
            return None
        written = np.empty((1, 3), dtype=np.int64), np.empty((1, 2)), np.empty((1, 2, 9))
        write_gap_planar(poses, rates, (probe, piece, facing, at), body, place * one, *touch, *written)
        _, rate, gradient = written
        tangent = gradient[0, 1, :2]  # t.dp
        assert np.linalg.norm(tangent) == pytest.approx(1.0, rel=1e-12)
        slip, slipping = np.outer(tangent, gradient[0, 1]), tangent * rate[0, 1]
        return float(gap[0]), np.vstack([gradient[0, :1], slip]), np.array([rate[0, 0], *slipping])
    lifted = np.array([[x, 0.0, z, *quaternion(phi)] for x, z, phi in poses])
    speeds = np.zeros((len(poses), 6))
    speeds[:, [0, 2, 4]] = rates
    half_width, at = np.full(count + 1, 0.02), np.empty((1, 2))
    places = np.array([[place, 0.01]])
    found = find_contacts_spatial(lifted, body, places, *limits, half_width, only, below, (probe, piece, facing, at, gap))
    if not found:
        return None
    written = np.empty((1, 3), dtype=np.int64), np.empty((1, 4)), np.empty((1, 4, 18))
    write_gap_spatial(lifted, speeds, (probe, piece, facing, at), body, places, *touch, *written)
    _, rate, gradient = written
    assert at[0, 1] == pytest.approx(0.01, abs=1e-12)
    # in the plane: (x, z, phi) of three bodies, and no slip across
    columns = [6 * b + c for b in range(3) for c in (0, 2, 4)]
    np.testing.assert_allclose(gradient[0, 2, columns], 0.0, atol=1e-15)
    return float(gap[0]), gradient[0, [0, 1, 3]][:, columns], rate[0, [0, 1, 3]]


class Tip:
    """A rounded tip in elementary geometry: the straight part ends at `end`, where it is tangential to the disc about
    `middle`."""

    radius = TIP * LENGTHS.sum() / 2

    def __init__(self, poses: np.ndarray, last: bool, side: float, straight: float, clearance: float = 1e-3) -> None:
        x, z, phi = poses[-1 if last else 0]
        tangent = np.array([np.cos(phi), -np.sin(phi)])
        self.out = tangent if last else -tangent
        self.up = side * np.array([-tangent[1], tangent[0]])
        half = LENGTHS[-1 if last else 0] / 2
        self.end = np.array([x, z]) + (half + straight * 2 * self.radius) * self.out + clearance * self.up
        self.middle = self.end - self.radius * self.up

    def around(self, angle: float, height: float) -> np.ndarray:
        """The point above the disc at an angle from the face's normal."""
        return self.middle + (self.radius + height) * self.normal(angle)

    def normal(self, angle: float) -> np.ndarray:
        return np.sin(angle) * self.out + np.cos(angle) * self.up

    def beside(self, past: float, height: float) -> np.ndarray:
        """The point past the end of the straight part, above the straight line."""
        return self.end + past * self.out + height * self.up


@SPATIAL
@SIDES
def test_gap_is_the_distance_from_the_curve(spatial: bool, side: float) -> None:
    poses = row_of_segments(5e-4)
    points, _ = dense(5e-4)
    for piece, s in ((1, 0.5), (2, 0.1), (3, 0.7), (5, 0.4)):
        c = curve(poses, piece, s)
        tangent = unit(c[1])
        point = c[0] + side * 3e-3 * np.array([-tangent[1], tangent[0]])
        found = seen(poses, point, spatial, side)
        assert found is not None
        assert found[0] == pytest.approx(2e-3, abs=1e-12)
        assert found[0] + 1e-3 == pytest.approx(np.linalg.norm(points - point, axis=1).min(), abs=1e-8)


@SPATIAL
@SIDES
@PARTS
@ENDS
def test_gap_at_an_end_is_the_distance_from_the_rounded_outline(
    spatial: bool, side: float, straight: float, last: bool
) -> None:
    """Outline: the curve raised by the clearance, its straight part to the end, and slightly more than a quarter of a
    circle."""
    poses = row_of_segments(5e-4)
    tip = Tip(poses, last, side, straight)
    points, normals = dense(5e-4)
    raised = points + side * 1e-3 * normals
    arc = [tip.around(angle, 0.0) for angle in np.linspace(0.0, 1.7, 2001)]
    ahead = [tip.beside(past, 0.0) for past in np.linspace(-2 * straight * tip.radius, 0.0, 2001)]
    outline = np.concatenate([raised, ahead, arc])
    for angle in (0.01, 0.4, 0.8, 1.3):
        for height in (5e-5, -0.2 * tip.radius, -0.5 * tip.radius):
            point = tip.around(angle, height)
            found = seen(poses, point, spatial, side, straight)
            assert found is not None
            assert found[0] == pytest.approx(height, abs=1e-12)
            away = np.linalg.norm(outline - point, axis=1).min()
            assert abs(found[0]) == pytest.approx(away, abs=1e-8)
            np.testing.assert_allclose(found[1][0, :2], tip.normal(angle), atol=1e-10)
    # an edge that touches a face is loaded along the face's normal
    found = seen(poses, tip.around(np.pi / 2, -0.3 * tip.radius), spatial, side, straight)
    assert found is not None
    assert found[0] == pytest.approx(-0.3 * tip.radius, abs=1e-12)
    np.testing.assert_allclose(found[1][0, :2], tip.out, atol=1e-10)


def assert_smooth(states: list[tuple[float, np.ndarray, np.ndarray] | None], path: np.ndarray, bend: float) -> None:
    """Neither the gap nor the normal jumps along a path of even steps; `bend` (1/m) bounds the rotation of the normal."""
    assert all(state is not None for state in states)
    gaps = np.array([state[0] for state in states if state is not None])
    normals = np.array([state[1][0, :2] for state in states if state is not None])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    moves = np.diff(path, axis=0)
    step = np.linalg.norm(moves, axis=1).max()
    assert np.abs(np.diff(gaps)).max() <= step * (1 + 1e-9)
    assert np.abs(np.diff(normals, axis=0)).max() <= bend * step
    # dg = n.dp along the whole path; a normal that jumps by the angle of a joint would give an error of a tenth
    middle = 0.5 * (normals[1:] + normals[:-1])
    np.testing.assert_allclose(np.diff(gaps), np.sum(middle * moves, axis=1), atol=1e-3 * step)


@SPATIAL
def test_gap_and_normal_are_continuous_as_a_probe_slides(spatial: bool) -> None:
    """Along a straight path over all joints the gap, the normal and the direction of the force do not jump."""
    poses = row_of_segments()
    start, end = curve(poses, 0, 0.2)[0], curve(poses, 5, 0.8)[0]
    share = np.linspace(0.0, 1.0, 1501)
    path = start + np.outer(share, end - start) + np.array([0.004, 0.01])
    # the rotation of the normal is bounded by the curvature: alpha/(l/2) for each joint, with a margin for the offset
    assert_smooth([seen(poses, p, spatial) for p in path], path, 60.0)


@SPATIAL
@SIDES
@PARTS
@ENDS
def test_gap_and_normal_are_continuous_round_a_tip(spatial: bool, side: float, straight: float, last: bool) -> None:
    poses = row_of_segments()
    tip = Tip(poses, last, side, straight)
    depth = 0.3 * tip.radius
    # over the end of the straight part and around the disc, until an edge touches at 90 degrees
    ahead = [tip.beside(past, -depth) for past in np.linspace(-2e-3, 0.0, 400, endpoint=False)]
    around = [tip.around(angle, -depth) for angle in np.linspace(0.0, np.pi / 2, 400)]
    path = np.array(ahead + around)
    states = [seen(poses, p, spatial, side, straight) for p in path]
    assert_smooth(states, path, 1.01 / (tip.radius - depth))
    np.testing.assert_allclose([state[0] for state in states if state is not None], -depth, atol=1e-12)
    # straight outwards: contact ends smoothly, exactly at zero gap
    path = np.array([tip.beside(past, -depth) for past in np.linspace(-2e-3, 0.999 * tip.radius, 800)])
    states = [seen(poses, p, spatial, side, straight) for p in path]
    assert_smooth(states, path, 1.01 / (tip.radius - depth))
    assert states[-1] is not None and states[-1][0] > 0.0
    touching = [seen(poses, p, spatial, side, straight, below=0.0) is not None for p in path]
    assert touching == [state is not None and state[0] < 0.0 for state in states]
    # all derivatives, also of the slip, on both sides of the end of the straight part
    inner, outer = (seen(poses, tip.beside(past, -depth), spatial, side, straight) for past in (-1e-9, 1e-9))
    assert inner is not None and outer is not None
    for one, other in zip(inner, outer, strict=True):
        np.testing.assert_allclose(one, other, atol=5e-6)


@SIDES
@PARTS
def test_planar_and_spatial_gaps_agree(side: float, straight: float) -> None:
    poses = row_of_segments(5e-4)
    points = [np.array([x, z]) for x in np.linspace(0.11, 0.2, 19) for z in (-0.25, -0.2)]
    rounded = [
        Tip(poses, last, side, straight).around(angle, height)
        for last in (False, True) for angle in (0.3, 1.0, 1.5) for height in (-8e-4, -1e-4)
    ]  # fmt: skip
    for number, point in enumerate(points + rounded):
        planar, spatial = (seen(poses, point, space, side, straight) for space in (False, True))
        assert (planar is None) == (spatial is None)
        if planar is None or spatial is None:
            assert number < len(points)
            continue
        for one, other in zip(planar, spatial, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-11)


@SPATIAL
@PARTS
def test_a_probe_beyond_the_tip_or_too_deep_touches_nothing(spatial: bool, straight: float) -> None:
    poses = row_of_segments()
    x, z, phi = poses[-1]
    axis = np.array([np.cos(phi), -np.sin(phi)])
    tip = LENGTHS[-1] / 2 + TIP * LENGTHS.sum()
    inside, outside = (np.array([x, z]) + (tip + d) * axis for d in (-1e-6, 1e-6))
    assert seen(poses, inside, spatial, straight=straight) is not None
    assert seen(poses, outside, spatial, straight=straight) is None
    # the end of the tip is past the disc: no contact that still had a force ends there
    for clearance in (0.0, 1e-3):
        assert seen(poses, inside, spatial, straight=straight, clearance=clearance, below=1e-8) is None
    rounded = Tip(poses, True, 1.0, straight).around(0.7, -5e-4)
    assert seen(poses, rounded, spatial, straight=straight, below=0.0, depth_limit=5.1e-4) is not None
    assert seen(poses, rounded, spatial, straight=straight, below=0.0, depth_limit=4.9e-4) is None
