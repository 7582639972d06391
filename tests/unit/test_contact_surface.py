"""The smooth surface through the segments: shape, gap as a probe slides along it, forces, broad phase."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fsm.interactions.gap_planar import find_contacts_planar, measure_gap_planar
from fsm.interactions.gap_spatial import find_contacts_spatial, measure_gap_spatial
from fsm.interactions.surface import TIP, blend, pieces_of
from fsm.kernels.rotation import rotation_matrix
from fsm.scene.builders.strip import build_strip
from fsm.scene.case import Case
from fsm.segments.compile import compile_scene
from fsm.segments.contacts import ContactGroup
from fsm.segments.system import SegmentSystem

SPATIAL = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
LENGTHS = np.array([0.02, 0.03, 0.025, 0.02, 0.04])
TURNS = np.array([0.1, 0.35, 0.5, 0.3, 0.45])


# shape --------------------------------------------------------------------------------------------------------


def row_of_segments(gap: float = 0.0) -> np.ndarray:
    """Poses (x, z, phi) of segments joined end to end; with `gap`, the joints' springs have given way."""
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
        if 0 < j < len(poses) - 1:  # within the panel in the parameter too
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


def test_ends_go_on_straight_by_the_tip() -> None:
    poses = row_of_segments()
    _, stations = pieces_of(np.arange(5), LENGTHS / 2)
    tip = TIP * LENGTHS.sum()
    for piece, s, end, sign in ((0, stations[0, 4], 0, -1), (5, stations[5, 5], 4, 1)):
        x, z, phi = poses[end]
        axis = np.array([np.cos(phi), -np.sin(phi)])
        wanted = np.array([x, z]) + sign * (LENGTHS[end] / 2 + tip) * axis
        np.testing.assert_allclose(curve(poses, piece, s)[0], wanted, atol=1e-15)
    np.testing.assert_array_equal(stations[1:5, 4:], np.tile([0.0, 1.0], (4, 1)))


# gap ----------------------------------------------------------------------------------------------------------


def quaternion(phi: float) -> list[float]:
    return [np.cos(phi / 2), 0.0, np.sin(phi / 2), 0.0]


def seen(
    surface: np.ndarray, point: tuple[float, float], spatial: bool, side: float = 1.0, clearance: float = 1e-3
) -> tuple[float, np.ndarray, np.ndarray] | None:
    """Gap (m), gradients (2, 9) of gap and slip, and the rates of both, of one probe on a body of its own."""
    count = len(surface)
    poses = np.vstack([surface, [*point, 0.3]])
    rates = np.linspace(-1.0, 1.0, poses.size).reshape(poses.shape)
    place, inset = -0.004, 4e-4
    poses[-1, :2] -= place * np.array([np.cos(0.3), -np.sin(0.3)])
    owners, stations = pieces_of(np.arange(count), LENGTHS[:count] / 2)
    one = np.ones(1)
    body, window = np.array([count]), np.array([[0, count + 1]])
    probe, piece, gap = np.empty(1, dtype=np.int64), np.empty(1, dtype=np.int64), np.empty(1)
    limits = (side * one, clearance * one, one, window, owners, stations)
    if not spatial:
        at = np.empty(1)
        found = find_contacts_planar(poses, body, place * one, *limits, 1.0, probe, piece, at, gap)
        if not found:
            return None
        _, rate, gradient = measure_gap_planar(
            poses, rates, 1, probe, piece, at, body, place * one, side * one, inset * one, owners, stations
        )
        return float(gap[0]), gradient[0], rate[0]
    lifted = np.array([[x, 0.0, z, *quaternion(phi)] for x, z, phi in poses])
    speeds = np.zeros((len(poses), 6))
    speeds[:, [0, 2, 4]] = rates
    half_width, at = np.full(count + 1, 0.02), np.empty((1, 2))
    places = np.array([[place, 0.01]])
    found = find_contacts_spatial(lifted, body, places, *limits, half_width, 1.0, probe, piece, at, gap)
    if not found:
        return None
    _, rate, gradient = measure_gap_spatial(
        lifted, speeds, 1, probe, piece, at, body, places, side * one, inset * one, owners, stations, half_width
    )
    assert at[0, 1] == pytest.approx(0.01, abs=1e-12)
    # in the plane: (x, z, phi) of three bodies, slip along the tangent, which is the normal turned by 90 degrees
    columns = [6 * b + c for b in range(3) for c in (0, 2, 4)]
    normal = gradient[0, 0, [0, 2]]
    tangent = side * np.array([normal[1], -normal[0]])
    slip = tangent @ gradient[0, [1, 3]][:, columns]
    return float(gap[0]), np.array([gradient[0, 0, columns], slip]), np.array([rate[0, 0], tangent @ rate[0, [1, 3]]])


@SPATIAL
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_gap_is_the_distance_from_the_curve(spatial: bool, side: float) -> None:
    poses = row_of_segments(5e-4)
    dense = np.array([curve(poses, piece, s)[0] for piece in range(6) for s in np.linspace(0, 1, 4001)])
    for piece, s in ((1, 0.5), (2, 0.1), (3, 0.7), (5, 0.4)):
        c = curve(poses, piece, s)
        tangent = unit(c[1])
        point = c[0] + side * 3e-3 * np.array([-tangent[1], tangent[0]])
        found = seen(poses, (point[0], point[1]), spatial, side)
        assert found is not None
        assert found[0] == pytest.approx(2e-3, abs=1e-12)
        assert found[0] + 1e-3 == pytest.approx(np.linalg.norm(dense - point, axis=1).min(), abs=1e-8)


@SPATIAL
def test_gap_and_normal_are_continuous_as_a_probe_slides(spatial: bool) -> None:
    """Along a straight path over all joints: no jump of the gap or of the normal, force direction included."""
    poses = row_of_segments()
    start, end = curve(poses, 0, 0.2)[0], curve(poses, 5, 0.8)[0]
    share = np.linspace(0.0, 1.0, 1501)
    rise = np.array([0.004, 0.01])
    path = start + np.outer(share, end - start) + rise
    states = [seen(poses, (p[0], p[1]), spatial) for p in path]
    assert all(state is not None for state in states)
    gaps = np.array([state[0] for state in states if state is not None])
    normals = np.array([state[1][0, :2] for state in states if state is not None])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    step = np.linalg.norm(path[1] - path[0])
    assert np.abs(np.diff(gaps)).max() <= step * (1 + 1e-9)
    # the normal turns by the curvature at most: alpha/(l/2) a joint, with a margin for the offset
    assert np.abs(np.diff(normals, axis=0)).max() <= 60.0 * step
    # dg = n.dp across every joint; a normal that jumps by its joint's turn would be off by a tenth
    middle = 0.5 * (normals[1:] + normals[:-1])
    np.testing.assert_allclose(np.diff(gaps), middle @ (path[1] - path[0]), atol=1e-3 * step)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_planar_and_spatial_gaps_agree(side: float) -> None:
    poses = row_of_segments(5e-4)
    for x in np.linspace(0.11, 0.2, 19):
        for z in (-0.25, -0.2):
            planar, spatial = seen(poses, (x, z), False, side), seen(poses, (x, z), True, side)
            assert (planar is None) == (spatial is None)
            if planar is None or spatial is None:
                continue
            for one, other in zip(planar, spatial, strict=True):
                np.testing.assert_allclose(one, other, atol=1e-11)


def test_a_probe_beyond_the_tip_or_too_deep_touches_nothing() -> None:
    poses = row_of_segments()
    x, z, phi = poses[-1]
    axis = np.array([np.cos(phi), -np.sin(phi)])
    tip = LENGTHS[-1] / 2 + TIP * LENGTHS.sum()
    inside, outside = (np.array([x, z]) + (tip + d) * axis for d in (-1e-6, 1e-6))
    for spatial in (False, True):
        assert seen(poses, (inside[0], inside[1]), spatial) is not None
        assert seen(poses, (outside[0], outside[1]), spatial) is None


# forces -------------------------------------------------------------------------------------------------------


def pressed_strip(
    spatial: bool, friction: bool = False, thick: bool = True, damping: float = 0.0, segments: int = 4
) -> SegmentSystem:
    data: dict[str, Any] = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": "80 deg",
            "segments_per_panel": segments,
        },
        "material": {"young": 3e9, "density": 800},
        "crease": {"law": "linear", "stiffness": 9e-3},
        "contact": {"stiffness": 1e6, "damping": damping, "thickness_in_gap": thick},
        "drive": [{"crease": 3, "speed": "2 mm/s", "travel": "40 mm"}],
    }  # fmt: skip
    if friction:
        data["friction"] = {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 0.05, "v_dynamic": 0.2}
    return compile_scene(build_strip(Case.model_validate(data)), spatial)


def pressed(system: SegmentSystem, seed: int, depth: float = 7.5e-4) -> np.ndarray:
    """Panels 3 and 4 upright and into each other, a little out of place."""
    pose, middle = system.bodies.pose, 3 * 0.08 * np.cos(np.radians(80))
    move = np.zeros((system.n_free, system.size))
    for row, body in enumerate(system.bodies.free):
        panel = int(system.bodies.names[body].split()[1])
        if panel in (3, 4):
            side = 1.0 if panel == 3 else -1.0
            move[row, 0] = middle + side * depth - pose[body, 0]
            move[row, 2 if system.size == 3 else 4] = -side * np.radians(10)
    size = [2e-4, 2e-4, 1e-2] if system.size == 3 else [2e-4] * 3 + [1e-2] * 3
    noise = np.random.default_rng(seed).normal(size=(system.n_free, system.size)) * size
    return system.retract(system.retract(system.initial()[0], move.ravel()), noise.ravel())


def contact_force(system: SegmentSystem, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forces on all bodies by contact alone, and their poses."""
    assert system.contacts is not None
    poses, rates = system.place(0.0, q, u)
    force = np.zeros_like(rates)
    system.contacts.add_force(0.0, poses, rates, force)
    return force, poses


def differences(function: Callable[[np.ndarray], float], size: np.ndarray) -> np.ndarray:
    slopes = []
    for j, h in enumerate(size):
        move = np.zeros(len(size))
        move[j] = h
        near, far = function(move) - function(-move), function(2 * move) - function(-2 * move)
        slopes.append((8 * near - far) / (12 * h))
    return np.array(slopes)


@SPATIAL
@pytest.mark.parametrize("thick", [False, True], ids=["middle", "thickness"])
def test_force_is_minus_the_slope_of_the_contact_energy(spatial: bool, thick: bool) -> None:
    system = pressed_strip(spatial, thick=thick)
    q, rest = pressed(system, seed=2), np.zeros(system.nu)
    assert system.contacts is not None
    contacts = system.contacts

    def energy(dx: np.ndarray) -> float:
        return contacts.energy(0.0, *system.place(0.0, system.retract(q, dx), rest))[0]["contact"]

    force = contact_force(system, q, rest)[0][system.bodies.free].ravel()
    assert np.count_nonzero(force) > 10
    size = np.tile([1e-7] * (system.size // 2 + (system.size == 3)) + [1e-5] * (1 if system.size == 3 else 3), 16)
    np.testing.assert_allclose(force, -differences(energy, size), atol=1e-7 * np.abs(force).max())


@SPATIAL
@pytest.mark.parametrize("friction", [False, True], ids=["frictionless", "friction"])
def test_contact_forces_balance(spatial: bool, friction: bool) -> None:
    """Force and moment about the origin of all bodies add to nothing: both faces are pushed at one point."""
    system = pressed_strip(spatial, friction, damping=5.0)
    q, u = pressed(system, seed=3), np.random.default_rng(3).normal(size=system.nu)
    force, poses = contact_force(system, q, u)
    if spatial:
        arms = np.cross(poses[:, :3], force[:, :3])
        turned = np.array([rotation_matrix(p[3:]) @ f[3:] for p, f in zip(poses, force, strict=True)])
        moment, total = np.sum(arms + turned, axis=0), force[:, :3].sum(axis=0)
    else:
        total = force[:, :2].sum(axis=0)
        moment = np.sum(force[:, 2] + poses[:, 1] * force[:, 0] - poses[:, 0] * force[:, 1])
    size = np.abs(force).max()
    assert size > 0.1
    np.testing.assert_allclose(total, 0.0, atol=1e-12 * size)
    np.testing.assert_allclose(moment, 0.0, atol=1e-12 * size)


@SPATIAL
def test_dissipation_is_what_damping_and_friction_take(spatial: bool) -> None:
    system = pressed_strip(spatial, friction=True, damping=5.0)
    assert system.contacts is not None
    q, u = pressed(system, seed=5), 0.1 * np.random.default_rng(5).normal(size=system.nu)
    poses, rates = system.place(0.0, q, u)
    power = system.contacts.energy(0.0, poses, rates)[1]
    moving, resting = contact_force(system, q, u)[0], contact_force(system, q, 0 * u)[0]
    # the drive does not touch; the elastic part is the same at rest
    assert power == pytest.approx(-float(np.sum((moving - resting) * rates)), rel=1e-10)
    assert power > 0


# broad phase --------------------------------------------------------------------------------------------------


def only_contacts(system: SegmentSystem) -> ContactGroup:
    assert system.contacts is not None
    return system.contacts


@SPATIAL
def test_result_does_not_depend_on_when_the_broad_phase_was_renewed(spatial: bool) -> None:
    """A long walk in small steps renews now and then; a fresh system renews at the very state. Bit for bit the same."""
    walker, rng = pressed_strip(spatial, friction=True, damping=5.0), np.random.default_rng(7)
    u = rng.normal(size=walker.nu)
    here = pressed(walker, seed=7, depth=2e-3)
    # first far away and back
    walker.force(0.0, walker.retract(here, np.full(walker.nu, 0.05)), u)
    size = np.tile([1e-3] * (walker.size // 2 + (walker.size == 3)) + [2e-2] * (1 if walker.size == 3 else 3), 16)
    touched = 0
    for _ in range(40):
        here = walker.retract(here, 0.3 * size * rng.normal(size=walker.nu))
        fresh = pressed_strip(spatial, friction=True, damping=5.0)
        walked, direct = contact_force(walker, here, u)[0], contact_force(fresh, here, u)[0]
        np.testing.assert_array_equal(walked, direct)
        touched += bool(direct.any())
        seen_walking, seen_fresh = walker.observe(0.0, here, u), fresh.observe(0.0, here, u)
        np.testing.assert_array_equal(seen_walking.pair_force, seen_fresh.pair_force)
        np.testing.assert_array_equal(seen_walking.pair_gap, seen_fresh.pair_gap)
    assert touched > 20
    assert 1 < only_contacts(walker).refreshes < 40


@SPATIAL
def test_tangent_does_not_depend_on_it_either(spatial: bool) -> None:
    walker, rng = pressed_strip(spatial), np.random.default_rng(9)
    here, u = pressed(walker, seed=9), np.zeros(walker.nu)
    walker.tangent(0.0, here, u)
    there = walker.retract(here, 1e-5 * rng.normal(size=walker.nu))
    before = only_contacts(walker).refreshes
    walked = [matrix.toarray() for matrix in walker.tangent(0.0, there, u)]
    assert only_contacts(walker).refreshes == before
    direct = [matrix.toarray() for matrix in pressed_strip(spatial).tangent(0.0, there, u)]
    np.testing.assert_array_equal(walked[0], direct[0])
    np.testing.assert_array_equal(walked[1], direct[1])


def slid(system: SegmentSystem, slide: float) -> np.ndarray:
    """Panels 3 and 4 upright, 10 um into each other, and one pushed past the other along their length."""
    pose, middle = system.bodies.pose, 3 * 0.08 * np.cos(np.radians(80))
    move = np.zeros((system.n_free, 3))
    for row, body in enumerate(system.bodies.free):
        panel = int(system.bodies.names[body].split()[1])
        if panel in (3, 4):
            side = 1.0 if panel == 3 else -1.0
            height = pose[body, 1] / np.sin(np.radians(80))
            move[row] = (
                middle + side * 5e-6 - pose[body, 0],
                height + side * slide / 2 - pose[body, 1],
                -side * np.radians(10),
            )
    return system.retract(system.initial()[0], move.ravel())


@pytest.mark.parametrize("segments", [20, 40])
def test_tips_are_found_whenever_the_broad_phase_was_renewed(segments: int) -> None:
    """Tip over tip, coming from so far along the panel that the broad phase need not be renewed on the way."""
    walker, fresh = (pressed_strip(False, thick=False, segments=segments) for _ in range(2))
    rest, over = np.zeros(walker.nu), 0.08 + 0.95 * TIP * 0.08
    walker.force(0.0, slid(walker, over + 0.77 * only_contacts(walker).margin), rest)
    walked, direct = (contact_force(system, slid(system, over), rest)[0] for system in (walker, fresh))
    assert direct.any()
    np.testing.assert_array_equal(walked, direct)
