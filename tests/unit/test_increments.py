"""Increments of configurations: retract and difference are inverse, and the map of an increment is its derivative."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fsm.kernels.body_poses import pose_difference, retract_poses
from fsm.kernels.rotation import fill_inverse_tangent, multiply, rotation_matrix
from tests.tangents import differences


def random_poses(count: int, seed: int) -> np.ndarray:
    poses = np.random.default_rng(seed).normal(size=(count, 7))
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return poses.ravel()


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1.0, 3.0])
def test_retract_turns_by_the_rotation_vector(size: float) -> None:
    q = random_poses(5, 0)
    dx = np.random.default_rng(1).normal(size=(5, 6))
    dx[:, 3:] *= size / np.linalg.norm(dx[:, 3:], axis=1, keepdims=True)
    moved = retract_poses(q, dx.ravel()).reshape(5, 7)
    np.testing.assert_allclose(moved[:, :3], q.reshape(5, 7)[:, :3] + dx[:, :3])
    for before, after, step in zip(q.reshape(5, 7), moved, dx, strict=True):
        turned = rotation_matrix(before[3:]) @ Rotation.from_rotvec(step[3:]).as_matrix()
        np.testing.assert_allclose(rotation_matrix(after[3:]), turned, atol=1e-14)
    np.testing.assert_allclose(pose_difference(q, moved.ravel()).reshape(5, 6), dx, rtol=1e-9, atol=1e-15)


def test_difference_takes_either_sign_of_a_quaternion() -> None:
    q = random_poses(1, 2)
    moved = retract_poses(q, np.array([0.0, 0.0, 0.0, 0.3, -0.2, 0.1]))
    moved[3:] *= -1.0
    np.testing.assert_allclose(pose_difference(q, moved)[3:], [0.3, -0.2, 0.1], rtol=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-5, 0.4, 2.5])
def test_increment_map_is_the_derivative(size: float) -> None:
    rng = np.random.default_rng(3)
    vector = rng.normal(size=3)
    vector *= size / np.linalg.norm(vector)
    q = random_poses(1, 4)
    moved = retract_poses(q, np.concatenate([np.zeros(3), vector]))
    exact = np.empty((3, 3))
    fill_inverse_tangent(*vector, exact)
    found = differences(lambda x: pose_difference(q, retract_poses(moved, x))[3:], np.full(6, 1e-5))
    np.testing.assert_allclose(found[:, 3:], exact, atol=1e-9)


def test_products_of_quaternions_are_products_of_rotations() -> None:
    p, r = (random_poses(1, seed)[3:] for seed in (5, 6))
    np.testing.assert_allclose(rotation_matrix(multiply(p, r)), rotation_matrix(p) @ rotation_matrix(r), atol=1e-14)
