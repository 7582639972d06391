"""Equal dampers about all axes of a joint without rotational springs: M = c (w_a - w_b), at any rotation of the joint."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.body_poses import retract_poses
from fsm.model.bodies.group import BlockSums, BodyState, PreviousPoses, body_pattern
from fsm.model.elements.elements import BushingGroup
from tests.runs import run
from tests.tangents import differences

BODIES = np.array([[0, 1]])
DAMPING = 0.7
SWINGS = pytest.mark.parametrize("swing", [0.3, 1.6, np.pi - 1e-9, np.pi, 4.0])


def quaternions(rotation: Rotation) -> np.ndarray:
    return np.roll(rotation.as_quat(), 1, axis=-1)


def joint(swing: float, seed: int, translations: float = 1.0) -> tuple[BushingGroup, np.ndarray, np.ndarray]:
    """A joint with a swing of this size about an axis across e2, twisted and rotated at random."""
    rng = np.random.default_rng(seed)
    axes = Rotation.random(2, random_state=seed)
    outer = Rotation.random(random_state=seed + 10)
    across = rng.normal(size=2)
    across *= swing / np.linalg.norm(across)
    relative = Rotation.from_rotvec([across[0], 0.0, across[1]]) * Rotation.from_rotvec([0.0, rng.normal(), 0.0])
    inner = outer * axes[1] * relative * axes[0].inv()
    poses = np.column_stack([rng.normal(size=(2, 3)), [quaternions(inner), quaternions(outer)]])
    geometry = (
        rng.normal(size=(1, 3)), rng.normal(size=(1, 3)), quaternions(axes)[:1].copy(), quaternions(axes)[1:].copy(),
        np.zeros(1), np.zeros(1, dtype=bool),
    )  # fmt: skip
    stiffness, damping = np.zeros((1, 6)), np.full((1, 6), DAMPING)
    stiffness[0, :3], damping[0, :3] = translations * rng.uniform(1, 5, (2, 3))
    group = BushingGroup(
        BODIES, geometry, np.zeros((1, 6)), stiffness, damping,
        np.zeros(1, dtype=np.int64), np.ones(1), ("ball",), np.zeros(1, dtype=bool), np.zeros((1, 6), dtype=bool),
    )  # fmt: skip
    return group, poses, rng.normal(size=(2, 6))


def force_of(group: BushingGroup, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None) -> np.ndarray:
    force = np.zeros((2, 6))
    group.add_force(BodyState(0.0, poses, rates, past), force)
    return force


@SWINGS
def test_moment_is_that_of_the_relative_rotation(swing: float) -> None:
    group, poses, rates = joint(swing, 1, translations=0.0)
    turns = Rotation.from_quat(np.roll(poses[:, 3:], -1, axis=1))
    relative = turns[0].apply(rates[0, 3:]) - turns[1].apply(rates[1, 3:])
    moments = turns.apply(force_of(group, poses, rates)[:, 3:])
    np.testing.assert_allclose(moments, DAMPING * np.array([-relative, relative]), atol=1e-12)


def tangents(
    group: BushingGroup, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None
) -> tuple[np.ndarray, np.ndarray]:
    pattern = body_pattern(np.array([0, 1]), [BODIES], 6)
    force, stiffness, damping = np.zeros((2, 6)), pattern.zeros(), pattern.zeros()
    group.add_linearised(BodyState(0.0, poses, rates, past), BlockSums(pattern, force, stiffness, damping))
    np.testing.assert_allclose(force, force_of(group, poses, rates, past), atol=1e-12)
    return BlockMatrix(pattern, stiffness).bsr().toarray(), BlockMatrix(pattern, damping).bsr().toarray()


def by_difference(group: BushingGroup, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None) -> list[np.ndarray]:
    """-dh/dx and -dh/du."""
    steps = np.full(12, 1e-5)
    moved = differences(lambda x: force_of(group, retract_poses(poses.ravel(), x).reshape(2, 7), rates, past).ravel(), steps)
    faster = differences(lambda x: force_of(group, poses, rates + x.reshape(2, 6), past).ravel(), steps)
    return [-moved, -faster]


@SWINGS
def test_tangents(swing: float) -> None:
    group, poses, rates = joint(swing, 2)
    for found, wanted in zip(tangents(group, poses, rates, None), by_difference(group, poses, rates, None), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-7)


@SWINGS
@pytest.mark.parametrize("turn", [1e-3, 0.3])
def test_tangents_of_differences_from_a_past_state(swing: float, turn: float) -> None:
    group, poses, rates = joint(swing, 6)
    past = PreviousPoses(retract_poses(poses.ravel(), turn * rates.ravel()).reshape(2, 7), 0.5)
    stiffness, damping = tangents(group, poses, rates, past)
    wanted, _ = by_difference(group, poses, rates, past)
    np.testing.assert_allclose(stiffness + damping / past.duration, wanted, atol=1e-6)


@SWINGS
def test_efforts_to_first_order(swing: float) -> None:
    group, poses, rates = joint(swing, 7)
    past = PreviousPoses(retract_poses(poses.ravel(), 1e-4 * rates.ravel()).reshape(2, 7), 0.5)
    step = 1e-4 * np.random.default_rng(1).normal(size=(2, 6))
    ahead = retract_poses(poses.ravel(), step.ravel()).reshape(2, 7)
    wanted = group.efforts(ahead, 0.0 * step, past)
    np.testing.assert_allclose(group.efforts(poses, step, past), wanted, atol=1e-6)
    assert np.abs(wanted[0, 3:]).max() > 1e-5


@SWINGS
def test_power_is_what_the_dampers_take(swing: float) -> None:
    group, poses, rates = joint(swing, 3)
    energy, power, _ = group.energy(BodyState(0.0, poses, rates))
    still, _, _ = group.energy(BodyState(0.0, poses, 0.0 * rates))
    springs = force_of(group, poses, 0.0 * rates)
    assert power == pytest.approx(-float(np.sum((force_of(group, poses, rates) - springs) * rates)), rel=1e-12)
    assert energy == still


def test_uneven_dampers_and_springs_are_of_swing_and_twist() -> None:
    """Only at these angles do they differ from c (w_a - w_b)."""
    group, poses, rates = joint(1.2, 4, translations=0.0)
    even = force_of(group, poses, rates)
    for stiffness, damping in ((0.0, 1.1), (1e-9, 1.0)):
        other = replace(group, stiffness=group.stiffness.copy(), damping=group.damping.copy())
        other.damping[0, 4] *= damping
        other.stiffness[0, 4] = stiffness
        value, rate, gradient = other.measure(poses, rates, BODIES, *other.geometry)
        effort = other.stiffness * value + other.damping * rate
        by_hand = -np.einsum("k,kj->j", effort[0], gradient[0]).reshape(2, 6)
        found = force_of(other, poses, rates)
        np.testing.assert_allclose(found, by_hand, atol=1e-12)
        assert np.abs(found - even).max() > 0.01


@SWINGS
@pytest.mark.parametrize("half_way", [False, True], ids=["outer", "half-way"])
def test_differences_from_a_past_state(swing: float, half_way: bool) -> None:
    """Quasi-static steps have no rates: the moment is c times the rotation vector of the step over its duration."""
    group, poses, rates = joint(swing, 5, translations=0.0)
    group = replace(group, geometry=(*group.geometry[:-1], np.array([half_way])))
    before = retract_poses(poses.ravel(), 0.2 * rates.ravel()).reshape(2, 7)
    past, axes = PreviousPoses(before, 0.1), np.roll(group.geometry[3], -1, axis=1)
    sides = [[Rotation.from_quat(np.roll(state[k, 3:], -1)) for k in range(2)] for state in (poses, before)]
    inner, outer = sides[0]
    joint_axes = outer * Rotation.from_quat(axes[0])
    # both rotations as they are seen from the outer body
    earlier = (sides[1][1] * Rotation.from_quat(axes[0])).inv() * sides[1][0]
    since = joint_axes.inv() * inner * earlier.inv()
    moment = joint_axes.apply(DAMPING * since.as_rotvec() / 0.1)
    force = np.zeros((2, 6))
    group.add_force(BodyState(0.0, poses, rates, past), force)
    np.testing.assert_allclose(force[:, 3:], [-inner.inv().apply(moment), outer.inv().apply(moment)], atol=1e-10)
    _, power, _ = group.energy(BodyState(0.0, poses, rates, past))
    assert power == pytest.approx(float(moment @ moment) / DAMPING, rel=1e-10)


ROD = """
gravity = [0, 0, "-9.81 m/s^2"]
[scene]
[[scene.bodies]]
name = "rod"
mass = "14.7 g"
inertia = [3.43e-7, 3.15e-5, 3.18e-5]
position = ["80 mm", 0, 0]
angular_velocity = [0, 0, "8 rad/s"]
velocity = [0, "0.64 m/s", 0]
[[scene.elements]]
name = "ball"
inner = "ground"
outer = "rod"
point_outer = ["-80 mm", 0, 0]
translation = [65000, 65000, 65000]
translation_damping = [8.7, 8.7, 8.7]
rotation_damping = [5.9e-5, 5.9e-5, 5.9e-5]
[solve]
end_time = "0.8 s"
"""


def test_a_rod_on_a_ball_joint_turns_all_the_way(tmp_path: Path) -> None:
    """The swing passes 180 degrees at 0.54 s."""
    _, summary = run(tmp_path, ROD)
    assert summary["energy_error"] < 1e-4
