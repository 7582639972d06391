"""Relative poses and hinge angles: force = -dU/dx, action = reaction, and invariance under rigid motions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fsm.interactions.hinge_planar import measure_hinge_planar
from fsm.interactions.hinge_spatial import measure_hinge_spatial
from fsm.interactions.pose_planar import measure_pose_planar
from fsm.interactions.pose_spatial import measure_pose_spatial
from fsm.kernels.scatter import scatter_efforts

BODIES = np.array([[0, 1], [2, 1], [3, 0]])
SEEDS = pytest.mark.parametrize("seed", range(4))
DIMENSIONS = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])


@dataclass
class Chain:
    """Four bodies and three force elements with random joints, springs and dampers."""

    spatial: bool
    poses: np.ndarray
    rates: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray

    def measure(self, poses: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        kernel = measure_pose_spatial if self.spatial else measure_pose_planar
        return kernel(poses, rates, BODIES, *self.geometry)

    def force(self, poses: np.ndarray, rates: np.ndarray) -> np.ndarray:
        value, rate, gradient = self.measure(poses, rates)
        effort = self.stiffness * (value - self.rest) + self.damping * rate
        force = np.zeros(self.rates.shape)
        scatter_efforts(BODIES, gradient, effort, len(BODIES), force)
        return force

    def energy(self, poses: np.ndarray) -> float:
        value, _, _ = self.measure(poses, np.zeros(self.rates.shape))
        return 0.5 * float(np.sum(self.stiffness * (value - self.rest) ** 2))


def chain(spatial: bool, seed: int) -> Chain:
    rng = np.random.default_rng(seed)
    n, m = 4, len(BODIES)
    if spatial:
        turns = rng.normal(size=(n, 3)) * 0.7
        poses = np.column_stack([rng.normal(size=(n, 3)), quaternions(Rotation.from_rotvec(turns))])
        axes = [quaternions(Rotation.random(m, random_state=seed + k)) for k in range(2)]
        half_way = (np.arange(m) + seed) % 2 == 0
        geometry = (rng.normal(size=(m, 3)), rng.normal(size=(m, 3)), *axes, rng.normal(size=m), half_way)
        size = 6
    else:
        poses = rng.normal(size=(n, 3))
        geometry = (rng.normal(size=(m, 2)), rng.normal(size=(m, 2)), rng.normal(size=m), rng.normal(size=m))
        size = 3
    shape = (m, size)
    return Chain(
        spatial, poses, rng.normal(size=(n, size)), geometry,
        rng.normal(size=shape), rng.uniform(1, 5, shape), rng.uniform(1, 5, shape),
    )  # fmt: skip


def quaternions(rotation: Rotation) -> np.ndarray:
    return np.roll(rotation.as_quat(), 1, axis=-1)


def rotations(poses: np.ndarray) -> Rotation:
    return Rotation.from_quat(np.roll(poses[:, 3:], -1, axis=1))


def retract(poses: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Move by increments: inertial axes for positions, body axes for turns. The rotations of SciPy, which also check those
    of fsm."""
    if poses.shape[1] == 3:
        return poses + step
    moved = quaternions(rotations(poses) * Rotation.from_rotvec(step[:, 3:]))
    moved *= np.sign(np.sum(moved * poses[:, 3:], axis=1, keepdims=True))
    return np.column_stack([poses[:, :3] + step[:, :3], moved])


def derivative(function: Callable[[float], np.ndarray], h: float = 1e-3) -> np.ndarray:
    d1, d2, d3 = (np.asarray(function(k * h)) - np.asarray(function(-k * h)) for k in (1, 2, 3))
    return (45 * d1 - 9 * d2 + d3) / (60 * h)


def gradient_of(function: Callable[[np.ndarray], np.ndarray], poses: np.ndarray, size: int) -> np.ndarray:
    """d function/dx by differences, body and direction in the last two axes."""
    columns = []
    for i in range(len(poses) * size):
        unit = np.zeros(len(poses) * size)
        unit[i] = 1.0
        step = unit.reshape(-1, size)
        columns.append(derivative(lambda h, step=step: function(retract(poses, h * step))))
    gradient = np.stack(columns, axis=-1)
    return gradient.reshape(*gradient.shape[:-1], len(poses), size)


def moment_about_origin(poses: np.ndarray, force: np.ndarray) -> np.ndarray:
    if poses.shape[1] == 3:  # about +y: z Fx - x Fz
        return np.array([np.sum(force[:, 2] + poses[:, 1] * force[:, 0] - poses[:, 0] * force[:, 1])])
    return np.sum(np.cross(poses[:, :3], force[:, :3]) + rotations(poses).apply(force[:, 3:]), axis=0)


def linear(poses: np.ndarray) -> int:
    return 2 if poses.shape[1] == 3 else 3


@DIMENSIONS
@SEEDS
def test_force_is_minus_the_slope_of_the_energy(spatial: bool, seed: int) -> None:
    c = chain(spatial, seed)
    force = c.force(c.poses, np.zeros(c.rates.shape))
    slope = gradient_of(lambda poses: np.array(c.energy(poses)), c.poses, c.rates.shape[1])
    np.testing.assert_allclose(force, -slope, atol=1e-9 * np.abs(force).max())


@DIMENSIONS
@SEEDS
def test_gradients_and_rates(spatial: bool, seed: int) -> None:
    c = chain(spatial, seed)
    _, rate, gradient = c.measure(c.poses, c.rates)
    found = gradient_of(lambda poses: c.measure(poses, c.rates)[0], c.poses, c.rates.shape[1])
    for i, (a, b) in enumerate(BODIES):
        np.testing.assert_allclose(gradient[i], np.concatenate([found[i, :, a], found[i, :, b]], axis=-1), atol=1e-9)
    moving = derivative(lambda t: c.measure(retract(c.poses, t * c.rates), c.rates)[0])
    np.testing.assert_allclose(rate, moving, atol=1e-8)


@DIMENSIONS
@SEEDS
def test_action_is_reaction(spatial: bool, seed: int) -> None:
    """Every element alone; force and moment balance although Z is large, so both forces act at one point."""
    c = chain(spatial, seed)
    value, rate, gradient = c.measure(c.poses, c.rates)
    effort = c.stiffness * (value - c.rest) + c.damping * rate
    for i in range(len(BODIES)):
        force = np.zeros(c.rates.shape)
        scatter_efforts(BODIES[i : i + 1], gradient[i : i + 1], effort[i : i + 1], 1, force)
        size = np.abs(force).max() * (1 + np.abs(c.poses).max())
        assert size > 0.1
        np.testing.assert_allclose(force[:, : linear(c.poses)].sum(axis=0), 0.0, atol=1e-12 * size)
        np.testing.assert_allclose(moment_about_origin(c.poses, force), 0.0, atol=1e-12 * size)


@DIMENSIONS
@SEEDS
def test_dissipated_power_is_what_the_dampers_take(spatial: bool, seed: int) -> None:
    c = chain(spatial, seed)
    _, rate, _ = c.measure(c.poses, c.rates)
    power = float(np.sum(c.damping * rate**2))
    damping_force = c.force(c.poses, c.rates) - c.force(c.poses, np.zeros(c.rates.shape))
    assert power > 0
    assert power == pytest.approx(-float(np.sum(damping_force * c.rates)), rel=1e-12)


@given(shift=st.tuples(*[st.floats(-5, 5)] * 2), turn=st.floats(-20, 20), seed=st.integers(0, 50))
def test_planar_rigid_motion_changes_nothing(shift: tuple[float, float], turn: float, seed: int) -> None:
    c = chain(False, seed)
    cosine, sine = np.cos(turn), np.sin(turn)
    rotation = np.array([[cosine, sine], [-sine, cosine]])  # +y takes x towards -z
    poses = np.column_stack([c.poses[:, :2] @ rotation.T + shift, c.poses[:, 2] + turn])
    rates = np.column_stack([c.rates[:, :2] @ rotation.T, c.rates[:, 2]])
    for before, after in zip(c.measure(c.poses, c.rates)[:2], c.measure(poses, rates)[:2], strict=True):
        np.testing.assert_allclose(after, before, atol=1e-11)
    force, turned = c.force(c.poses, c.rates), c.force(poses, rates)
    np.testing.assert_allclose(turned[:, :2], force[:, :2] @ rotation.T, atol=1e-10)
    np.testing.assert_allclose(turned[:, 2], force[:, 2], atol=1e-10)


@given(
    shift=st.tuples(*[st.floats(-5, 5)] * 3), turn=st.tuples(*[st.floats(-3, 3)] * 3), seed=st.integers(0, 50)
)
def test_spatial_rigid_motion_changes_nothing(
    shift: tuple[float, float, float], turn: tuple[float, float, float], seed: int
) -> None:
    c = chain(True, seed)
    rotation = Rotation.from_rotvec(turn)
    turned = rotation * rotations(c.poses)
    moved = quaternions(turned)
    # one sign for all, so the same rotation for all
    relative = quaternions(rotation)
    signs = np.sign([multiply_first(relative, p) @ m for p, m in zip(c.poses[:, 3:], moved, strict=True)])
    poses = np.column_stack([rotation.apply(c.poses[:, :3]) + shift, moved * signs[:, None]])
    rates = np.column_stack([rotation.apply(c.rates[:, :3]), c.rates[:, 3:]])
    for before, after in zip(c.measure(c.poses, c.rates)[:2], c.measure(poses, rates)[:2], strict=True):
        np.testing.assert_allclose(after, before, atol=1e-10)
    force, new = c.force(c.poses, c.rates), c.force(poses, rates)
    np.testing.assert_allclose(new[:, :3], rotation.apply(force[:, :3]), atol=1e-9)
    np.testing.assert_allclose(new[:, 3:], force[:, 3:], atol=1e-9)


def multiply_first(p: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Quaternion product, scalar first."""
    vector = p[0] * r[1:] + r[0] * p[1:] + np.cross(p[1:], r[1:])
    return np.concatenate([[p[0] * r[0] - p[1:] @ r[1:]], vector])


@given(shift=st.floats(-2, 2), seed=st.integers(0, 20))
def test_uniform_velocity_meets_no_damper(shift: float, seed: int) -> None:
    """Rates of a rigid motion, translation and rotation, cause no deformation."""
    c = chain(True, seed)
    omega = np.array([0.3, shift, -0.8])
    rates = np.column_stack(
        [np.cross(omega, c.poses[:, :3]) + [shift, 1.0, 2.0], rotations(c.poses).inv().apply(omega)]
    )
    np.testing.assert_allclose(c.measure(c.poses, rates)[1], 0.0, atol=1e-11)


@SEEDS
def test_planar_is_the_spatial_case_in_a_plane(seed: int) -> None:
    c = chain(False, seed)
    points_a, points_b, axes_angle, offset = c.geometry
    poses, rates = lift(c.poses), lift_rates(c.rates)
    # psi = phi_a + alpha_a - phi_b - alpha_b with alpha_a = offset + alpha_b
    inner, outer = about_y(axes_angle + offset), about_y(axes_angle)
    spatial = measure_pose_spatial(
        poses, rates, BODIES, insert_y(points_a), insert_y(points_b), inner, outer, np.zeros(len(BODIES)),
        np.array([True, False, True]),
    )
    planar = c.measure(c.poses, c.rates)
    np.testing.assert_allclose(spatial[0][:, [0, 2]], planar[0][:, :2], atol=1e-13)
    np.testing.assert_allclose(np.exp(1j * spatial[0][:, 4]), np.exp(1j * planar[0][:, 2]), atol=1e-13)
    np.testing.assert_allclose(spatial[1][:, [0, 2, 4]], planar[1], atol=1e-13)
    np.testing.assert_allclose(spatial[0][:, [1, 3, 5]], 0.0, atol=1e-13)
    columns = [0, 2, 4, 6, 8, 10]
    np.testing.assert_allclose(spatial[2][:, [0, 2, 4]][:, :, columns], planar[2], atol=1e-13)


@SEEDS
def test_hinge_is_the_twist_of_the_pose(seed: int) -> None:
    c = chain(True, seed)
    hinge = measure_hinge_spatial(c.poses, c.rates, BODIES, *c.geometry[2:5])
    pose = c.measure(c.poses, c.rates)
    for mine, other in zip(hinge, (pose[0][:, 4], pose[1][:, 4], pose[2][:, 4:5]), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-14)
    p = chain(False, seed)
    hinge = measure_hinge_planar(p.poses, p.rates, BODIES, p.geometry[3])
    pose = p.measure(p.poses, p.rates)
    for mine, other in zip(hinge, (pose[0][:, 2], pose[1][:, 2], pose[2][:, 2:3]), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-14)


def about_y(angle: np.ndarray) -> np.ndarray:
    half, zero = np.asarray(angle) / 2, np.zeros(np.shape(angle))
    return np.stack([np.cos(half), zero, np.sin(half), zero], axis=-1)


def insert_y(points: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.column_stack([points[:, 0], np.zeros(len(points)), points[:, 1]]))


def lift(poses: np.ndarray) -> np.ndarray:
    return np.column_stack([insert_y(poses[:, :2]), about_y(poses[:, 2])])


def lift_rates(rates: np.ndarray) -> np.ndarray:
    spin = np.zeros((len(rates), 3))
    spin[:, 1] = rates[:, 2]
    return np.column_stack([insert_y(rates[:, :2]), spin])
