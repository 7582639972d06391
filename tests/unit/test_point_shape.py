"""Rounded points against shapes, and edges against edges: gap and slip agree with the motion; balance, tangents."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fsm.interactions.contact.shapes import ContactForces
from fsm.interactions.search.box_pairs import ListedPairs
from fsm.interactions.shapes.shape_distance import BOX, CYLINDER, HALF_SPACE, RECTANGLE, SPHERE, shape_distance
from fsm.kernels.rotation import exponential, multiply, rotate_by, rotation_matrix
from fsm.kernels.scatter import scatter_efforts
from fsm.model.bodies.contact_arrays import FRICTION
from fsm.model.bodies.group import body_pattern
from fsm.model.contact.array_contacts import add_geometric_tangent
from fsm.model.contact.contact_table import ActiveContacts, ContactKinematics
from fsm.model.contact.shapes.shape_contacts import ShapeContacts
from fsm.model.contact.shapes.shape_tables import Shape, TableBuilder
from tests.tangents import fine_differences

STIFFNESS, DAMPING, MU, CREEP = 3e5, 0.4, 0.3, 0.05


def smooth_laws(gap: np.ndarray, rate: np.ndarray, with_friction: bool) -> ContactForces:
    """N = K d^1.5 (1 + c d'), f = mu N v/sqrt(v^2 + v0^2)."""
    depth, closing, slip = -gap, -rate[:, 0], rate[:, 1:]
    normal = STIFFNESS * depth**1.5 * (1.0 + DAMPING * closing)
    speed = np.sqrt(np.sum(slip**2, axis=1) + CREEP**2)
    unit = slip / speed[:, None]
    across = np.eye(slip.shape[1]) - unit[:, :, None] * unit[:, None, :]
    return ContactForces(
        normal,
        1.5 * STIFFNESS * depth**0.5 * (1.0 + DAMPING * closing),
        STIFFNESS * depth**1.5 * DAMPING,
        MU * normal[:, None] * unit * with_friction,
        MU * normal[:, None, None] * across / speed[:, None, None],
        MU * unit,
        with_friction,
    )


@dataclass
class State:
    """Contacts of some bodies in one state."""

    contacts: ShapeContacts
    poses: np.ndarray
    rates: np.ndarray

    @property
    def size(self) -> int:
        return self.rates.shape[1]

    def moved(self, step: np.ndarray) -> State:
        """Every body is moved by its row of increments."""
        step = step.reshape(self.rates.shape)
        if self.size == 3:
            return State(self.contacts, self.poses + step, self.rates)
        turned = multiply(self.poses[:, 3:], exponential(step[:, 3:]))
        return State(self.contacts, np.hstack([self.poses[:, :3] + step[:, :3], turned]), self.rates)

    def found(self) -> tuple[ActiveContacts, ContactKinematics]:
        touching = self.contacts.find(self.poses, 0.0)
        return touching, self.contacts.measure(self.poses, self.rates, 0.0)

    def force(self, with_friction: bool = True) -> np.ndarray:
        touching, measured = self.found()
        laws = smooth_laws(touching.gap, measured.rate, with_friction)
        effort = np.column_stack([-laws.normal, laws.effort])
        force = np.zeros_like(self.rates)
        scatter_efforts(measured.bodies, measured.gradient, effort, len(touching.gap), force)
        return force

    def tangent(self, with_friction: bool = True) -> tuple[np.ndarray, np.ndarray]:
        touching, measured = self.found()
        count = len(self.poses)
        pattern = body_pattern(np.arange(count), [self.contacts.pairs(self.poses)[0]], self.size)
        stiffness, damping = (np.zeros((len(pattern.indices), self.size, self.size)) for _ in range(2))
        laws = smooth_laws(touching.gap, measured.rate, with_friction)
        g, active = self.contacts.common, len(touching.gap)
        rows = g.normal_force, g.by_depth, g.by_closing, g.effort, g.by_slip, g.by_normal
        for row, values in zip(rows, laws, strict=False):
            row[:active] = values
        g.state[FRICTION] = int(with_friction)
        state = self.poses, self.rates, active, stiffness, damping
        self.contacts.call_with(pattern, add_geometric_tangent, *state)
        return dense(pattern, stiffness, count), dense(pattern, damping, count)

    def energy(self) -> float:
        return float(np.sum(STIFFNESS * (-self.contacts.find(self.poses, 0.0).gap) ** 2.5 / 2.5))


def dense(pattern: Any, data: np.ndarray, count: int) -> np.ndarray:
    size = data.shape[1]
    out = np.zeros((count, size, count, size))
    for row in range(count):
        for k in range(pattern.indptr[row], pattern.indptr[row + 1]):
            out[row, :, pattern.indices[k]] += data[k]
    return out.reshape(count * size, -1)


# states ---------------------------------------------------------------------------------------------------------------

# kind, half sizes, and position of the point in the shape's axes; gaps are a few mm below zero with the roundings of 12 and
# 5 mm
POINTS: dict[str, tuple[int, tuple[float, float, float], tuple[float, float, float]]] = {
    "plane": (HALF_SPACE, (0.0, 0.0, 0.0), (0.2, 0.1, 0.014)),
    "box, face": (BOX, (0.3, 0.2, 0.1), (0.1, -0.1, 0.114)),
    "box, edge": (BOX, (0.3, 0.2, 0.1), (0.308, 0.1, 0.11)),
    "box, corner": (BOX, (0.3, 0.2, 0.1), (-0.306, 0.207, 0.109)),
    "box, inside": (BOX, (0.3, 0.2, 0.1), (0.1, 0.03, 0.092)),
    "cylinder, side": (CYLINDER, (0.1, 0.2, 0.1), (0.08, 0.05, 0.081)),
    "cylinder, cap": (CYLINDER, (0.1, 0.2, 0.1), (0.03, 0.213, 0.04)),
    "cylinder, rim": (CYLINDER, (0.1, 0.2, 0.1), (0.078, -0.207, 0.077)),
    "sphere": (SPHERE, (0.1, 0.1, 0.1), (0.08, 0.05, 0.062)),
    "rectangle, face": (RECTANGLE, (0.3, 0.2, 0.0), (0.1, 0.05, -0.013)),
    "rectangle, edge": (RECTANGLE, (0.3, 0.2, 0.0), (0.309, 0.05, 0.009)),
    "rectangle, corner": (RECTANGLE, (0.3, 0.2, 0.0), (0.307, -0.206, 0.007)),
}
# rims: kind, half sizes, and a point of the shape towards which a circle of 0.15 m is moved until it touches
RIMS: dict[str, tuple[int, tuple[float, float, float], tuple[float, float, float]]] = {
    "rim, plane": (HALF_SPACE, (0.0, 0.0, 0.0), (0.2, 0.1, 0.0)),
    "rim, box face": (BOX, (0.3, 0.2, 0.1), (0.1, -0.1, 0.1)),
    "rim, box edge": (BOX, (0.3, 0.02, 0.1), (0.1, 0.02, 0.1)),
    "rim, cylinder side": (CYLINDER, (0.3, 0.3, 0.3), (0.24, 0.05, 0.18)),
    "rim, sphere": (SPHERE, (0.3, 0.3, 0.3), (0.24, 0.0, 0.18)),
    "rim, rectangle face": (RECTANGLE, (0.3, 0.2, 0.0), (0.1, 0.05, -0.0)),
    "rim, rectangle edge": (RECTANGLE, (0.3, 0.2, 0.0), (0.0, 0.2, 0.0)),
}
# distance of the midpoints, angle between the edges, and position of the crossing on each edge (a half length is 0.2)
EDGES: dict[str, tuple[float, float, float, float]] = {
    "edges, crossing": (0.013, 1.1, 0.05, -0.08),
    "edges, past one end": (0.013, 0.8, 0.204, 0.05),
    "edges, past both ends": (0.007, 1.2, 0.206, 0.207),
    "edges, nearly parallel": (0.012, 0.035, 0.02, -0.03),
    "edges, nearly parallel past an end": (0.01, 0.04, 0.21, 0.06),
}
PLANAR = ("plane", "box, face", "box, edge", "box, inside", "cylinder, side", "sphere", "rectangle, face", "rectangle, edge")


def random_pose(rng: np.random.Generator, spatial: bool) -> np.ndarray:
    if not spatial:
        return rng.normal(size=3)
    turn = rng.normal(size=4)
    return np.concatenate([rng.normal(size=3), turn / np.linalg.norm(turn)])


def in_body(pose: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Position of an inertial point (3,) in body axes, (3,)."""
    if len(pose) == 7:
        return np.asarray(rotation_matrix(pose[3:]).T @ (point - pose[:3]))
    c, s = np.cos(pose[2]), np.sin(pose[2])
    dx, dz = point[0] - pose[0], point[2] - pose[1]
    return np.array([c * dx - s * dz, 0.0, s * dx + c * dz])


def out_of_body(pose: np.ndarray, local: np.ndarray) -> np.ndarray:
    if len(pose) == 7:
        return np.asarray(pose[:3] + rotation_matrix(pose[3:]) @ local)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.array([pose[0] + c * local[0] + s * local[2], 0.0, pose[1] - s * local[0] + c * local[2]])


def about_y(angle: float) -> tuple[float, float, float, float]:
    return (float(np.cos(angle / 2)), 0.0, float(np.sin(angle / 2)), 0.0)


def point_state(name: str, spatial: bool, seed: int = 1) -> State:
    """One point of body 1 on a shape of body 2, both in any pose; body 0 takes no part."""
    rng = np.random.default_rng(seed)
    poses = np.array([random_pose(rng, spatial) for _ in range(3)])
    kind, size, at = POINTS[name]
    local = np.array(at) if spatial else np.array(at) * [1.0, 0.0, 1.0]
    turn = rng.normal(size=4)
    offset = rng.normal(size=3) * (1.0 if spatial else np.array([1.0, 0.0, 1.0]))
    shape = Shape(
        2, kind, size, 0.005, tuple(offset), tuple(turn / np.linalg.norm(turn)) if spatial else about_y(turn[0])
    )
    place = in_body(poses[1], out_of_body(poses[2], shape.in_body(local)))
    builder = TableBuilder(spatial)
    number = builder.add_shape(shape)
    own = builder.add_shape(Shape(1, SPHERE, (0.0, 0.0, 0.0), 0.012, tuple(place)))
    builder.add_points(own, np.zeros((1, 3)), 0.012, np.ones(1))
    contacts = ShapeContacts(builder.kit(), pair_of(own, number), spatial, 0.05, 0.0)
    return State(contacts, poses, rng.normal(size=(3, 6 if spatial else 3)))


def rim_state(name: str, seed: int = 4) -> State:
    """The rim of a disc of body 1 on a shape of body 2, both in any pose."""
    rng = np.random.default_rng(seed)
    poses = np.array([random_pose(rng, True) for _ in range(3)])
    kind, size, at = RIMS[name]
    turn, offset = rng.normal(size=4), rng.normal(size=3)
    shape = Shape(2, kind, size, 0.005, tuple(offset), tuple(turn / np.linalg.norm(turn)))
    # the disc in the axes of the shape: its axis is (0.6, -0.2, 0.77), its centre comes nearer from outside
    axis = np.array([0.6, -0.2, 0.77]) / np.linalg.norm([0.6, -0.2, 0.77])
    outwards = np.array([0.1, 1.0, 0.2] if "edge" in name else [0.3, 0.5, 1.0])
    side = np.cross(axis, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    frame = np.column_stack([side, axis, np.cross(side, axis)])
    angles = np.linspace(0.0, 2.0 * np.pi, 4000)[:, None]
    circle = 0.15 * (np.cos(angles) * frame[:, 0] + np.sin(angles) * frame[:, 2])
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        points = np.array(at) + middle * outwards + circle
        nearest = min(shape_distance(kind, np.array(size), point) for point in points)
        low, high = (middle, high) if nearest < 0.012 else (low, middle)
    centre = in_body(poses[1], out_of_body(poses[2], shape.in_body(np.array(at) + high * outwards)))
    whole = rotation_matrix(poses[1, 3:]).T @ rotation_matrix(poses[2, 3:]) @ rotation_matrix(np.array(shape.orientation))
    disc = Rotation.from_matrix(whole @ frame).as_quat(scalar_first=True)
    builder = TableBuilder(True)
    number = builder.add_shape(shape)
    own = builder.add_shape(Shape(1, CYLINDER, (0.15, 0.001, 0.15), 0.012, tuple(centre), tuple(disc)))
    builder.add_points(own, np.array([[0.15, 0.0, 0.0]]), 0.012, np.ones(1), turns=True)
    return State(ShapeContacts(builder.kit(), pair_of(own, number), True, 0.05, 0.0), poses, rng.normal(size=(3, 6)))


def pair_of(one: int, two: int) -> ListedPairs:
    """Two shapes that may touch."""
    return ListedPairs([np.array([one]), np.array([two])], np.array([[0, 1]]), 2)


def edge_state(name: str, seed: int = 2) -> State:
    """One edge of body 1 over one edge of body 2, both bodies in any pose."""
    rng = np.random.default_rng(seed)
    poses = np.array([random_pose(rng, True) for _ in range(3)])
    height, angle, one, two = EDGES[name]
    everything = random_pose(rng, True)
    builder = TableBuilder(True)
    along = np.array([[1.0, 0.0, 0.0], [np.cos(angle), np.sin(angle), 0.0]])
    for body, direction, place, lift, radius in ((1, along[0], one, height, 0.012), (2, along[1], two, 0.0, 0.005)):
        middle = np.array([0.0, 0.0, lift]) - place * direction
        ends = [out_of_body(everything, middle + side * 0.2 * direction) for side in (-1, 1)]
        local = np.array([[in_body(poses[body], end) for end in ends]])
        builder.add_edges(builder.add_shape(Shape(body, BOX, (9.0, 9.0, 9.0), radius)), local)
    return State(ShapeContacts(builder.kit(), pair_of(0, 1), True, 0.05, 0.0), poses, rng.normal(size=(3, 6)))


def any_state(case: str) -> State:
    name, _, where = case.partition(" / ")
    if name in RIMS:
        return rim_state(name)
    return edge_state(name) if name in EDGES else point_state(name, where == "space")


CASES = [f"{name} / space" for name in (*POINTS, *RIMS, *EDGES)] + [f"{name} / plane" for name in PLANAR]
EVERY = pytest.mark.parametrize("case", CASES)


# tests ----------------------------------------------------------------------------------------------------------------


@EVERY
def test_one_contact_is_found(case: str) -> None:
    state = any_state(case)
    touching, measured = state.found()
    assert len(touching.gap) == 1
    assert -0.03 < touching.gap[0] < -1e-4
    np.testing.assert_array_equal(measured.bodies, [[1, 2]])
    flat = state.rates[measured.bodies[0]].ravel()
    np.testing.assert_allclose(measured.rate[0], measured.gradient[0] @ flat, atol=1e-12)


@EVERY
def test_gap_rate_is_the_rate_of_the_gap(case: str) -> None:
    state, h = any_state(case), 1e-6
    gaps = [state.moved(k * h * state.rates).found()[0].gap[0] for k in (-2, -1, 1, 2)]
    rate = (gaps[0] - 8 * gaps[1] + 8 * gaps[2] - gaps[3]) / (12 * h)
    assert state.found()[1].rate[0, 0] == pytest.approx(rate, rel=1e-6, abs=1e-8)


@EVERY
def test_slip_is_the_tangential_velocity_of_the_material_at_one_point(case: str) -> None:
    """In space: the normal is the gradient of the gap by the position of A, and the slip is that of M without its part along
    n."""
    state = any_state(case)
    _, measured = state.found()
    if state.size == 3:
        normal = measured.gradient[0, 0, :2]
        np.testing.assert_allclose(measured.gradient[0, 1, :2], [normal[1], -normal[0]], atol=1e-14)
        return
    gradient = measured.gradient[0]
    normal = gradient[0, :3] / np.linalg.norm(gradient[0, :3])
    np.testing.assert_allclose(gradient[1:, :3], np.eye(3) - np.outer(normal, normal), atol=1e-14)
    np.testing.assert_allclose(normal @ gradient[1:], 0.0, atol=1e-13)


@EVERY
def test_nothing_moves_in_a_rigid_motion_of_everything(case: str) -> None:
    """Gap and force in body axes do not depend on a common rigid motion, and rates of rigid motions are zero."""
    state, rng = any_state(case), np.random.default_rng(8)
    gap, measured = state.found()[0].gap, state.found()[1]
    size = np.abs(state.force()).max()
    if state.size == 3:
        far = rng.normal(size=3)
        c, s = np.cos(far[2]), np.sin(far[2])
        rotation = np.array([[c, s], [-s, c]])
        poses = np.column_stack([state.poses[:, :2] @ rotation.T + far[:2], state.poses[:, 2] + far[2]])
        rates = np.column_stack([state.rates[:, :2] @ rotation.T, state.rates[:, 2]])
        moved = State(state.contacts, poses, rates)
        force, other = state.force(), moved.force()
        np.testing.assert_allclose(other[:, :2], force[:, :2] @ rotation.T, atol=1e-11 * size)
        np.testing.assert_allclose(other[:, 2], force[:, 2], atol=1e-11 * size)
        rigid = np.column_stack([state.poses[:, 1], -state.poses[:, 0], np.ones(3)]) + [0.3, -0.2, 0.0]
    else:
        far = random_pose(rng, True)
        turned = rotate_by(far[3:], state.poses[:, :3]) + far[:3]
        poses = np.hstack([turned, multiply(far[3:], state.poses[:, 3:])])
        moved = State(state.contacts, poses, np.hstack([rotate_by(far[3:], state.rates[:, :3]), state.rates[:, 3:]]))
        force, other = state.force(), moved.force()
        np.testing.assert_allclose(other[:, :3], rotate_by(far[3:], force[:, :3]), atol=1e-11 * size)
        np.testing.assert_allclose(other[:, 3:], force[:, 3:], atol=1e-11 * size)
        spin = rng.normal(size=3)
        body = np.array([rotation_matrix(pose[3:]).T @ spin for pose in state.poses])
        rigid = np.hstack([np.cross(spin, state.poses[:, :3]) + [0.3, -0.2, 0.4], body])
    np.testing.assert_allclose(moved.found()[0].gap, gap, atol=1e-13)
    np.testing.assert_allclose(measured.gradient[0] @ rigid[1:].ravel(), 0.0, atol=1e-12)


@EVERY
def test_action_and_reaction(case: str) -> None:
    """Force and moment about the origin of both bodies add up to zero, friction included."""
    state = any_state(case)
    force = state.force()
    size = np.abs(force).max()
    assert size > 0.01
    assert not force[0].any()
    if state.size == 3:
        moment = np.sum(force[:, 2] + state.poses[:, 1] * force[:, 0] - state.poses[:, 0] * force[:, 1])
        np.testing.assert_allclose(force[:, :2].sum(axis=0), 0.0, atol=1e-13 * size)
    else:
        turned = np.array([rotation_matrix(p[3:]) @ f[3:] for p, f in zip(state.poses, force, strict=True)])
        moment = np.sum(np.cross(state.poses[:, :3], force[:, :3]) + turned, axis=0)
        np.testing.assert_allclose(force[:, :3].sum(axis=0), 0.0, atol=1e-13 * size)
    np.testing.assert_allclose(moment, 0.0, atol=1e-12 * size)


@EVERY
def test_force_is_minus_the_slope_of_the_energy(case: str) -> None:
    state = any_state(case)
    rest = State(state.contacts, state.poses, np.zeros_like(state.rates))
    slopes = fine_differences(lambda step: rest.moved(step).energy(), np.full(rest.rates.size, 1e-5))
    force = rest.force().ravel()
    np.testing.assert_allclose(force, -slopes, atol=2e-7 * np.abs(force).max())


@EVERY
@pytest.mark.parametrize("with_friction", [False, True], ids=["frictionless", "friction"])
def test_tangents_are_derivatives_of_the_force(case: str, with_friction: bool) -> None:
    state = any_state(case)
    stiffness, damping = state.tangent(with_friction)
    count = state.rates.size

    def by_place(step: np.ndarray) -> np.ndarray:
        return state.moved(step).force(with_friction).ravel()

    def by_rate(step: np.ndarray) -> np.ndarray:
        return State(state.contacts, state.poses, state.rates + step.reshape(state.rates.shape)).force(with_friction).ravel()

    for exact, function, h in ((stiffness, by_place, 2e-5), (damping, by_rate, 1e-3)):
        numeric = -fine_differences(function, np.full(count, h))
        np.testing.assert_allclose(exact, numeric, atol=2e-7 * np.abs(numeric).max())
        assert np.abs(numeric).max() > 0.1


@pytest.mark.parametrize("name", PLANAR)
def test_planar_and_spatial_agree_in_a_plane_motion(name: str) -> None:
    planar = point_state(name, False)
    planar.contacts.find(planar.poses, 0.0)
    tables = planar.contacts.tables
    builder = TableBuilder(True)
    offset = (tables.shapes.offset[0, 0], 0.0, tables.shapes.offset[0, 1])
    shape = Shape(2, int(tables.shapes.kind[0]), POINTS[name][1], 0.005, offset, about_y(tables.shapes.frame[0]))
    x, z = tables.points.place[0]
    number, own = builder.add_shape(shape), builder.add_shape(Shape(1, SPHERE, (0.0, 0.0, 0.0), 0.012, (x, 0.0, z)))
    builder.add_points(own, np.zeros((1, 3)), 0.012, np.ones(1))
    poses = np.array([[x, 0.0, z, *about_y(turn)] for x, z, turn in planar.poses])
    rates = np.zeros((3, 6))
    rates[:, [0, 2, 4]] = planar.rates
    spatial = State(ShapeContacts(builder.kit(), pair_of(own, number), True, 0.05, 0.0), poses, rates)
    inside = [6 * body + c for body in range(3) for c in (0, 2, 4)]
    size = np.abs(planar.force()).max()
    np.testing.assert_allclose(spatial.force().ravel()[inside], planar.force().ravel(), atol=1e-11 * size)
    assert np.abs(np.delete(spatial.force().ravel(), inside)).max() < 1e-12 * size
    for one, two in zip(spatial.tangent(), planar.tangent(), strict=True):
        np.testing.assert_allclose(one[np.ix_(inside, inside)], two, atol=1e-10 * np.abs(two).max())
