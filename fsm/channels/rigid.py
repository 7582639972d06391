"""Poses, rates and wrenches of rigid bodies in three components, for planar and spatial systems alike."""

from __future__ import annotations

import numpy as np

from fsm.channels.offer import State
from fsm.kernels.rotation import multiply, rotate_by
from fsm.model.bodies.group import PreviousPoses


def placed(state: State) -> tuple[np.ndarray, np.ndarray]:
    """Poses and rates of all bodies in the coordinates of the system."""
    poses, rates = state.system.place(state.time, state.q, state.u, state.before)
    return np.array(poses), np.array(rates)


def motion_of_bodies(state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions, quaternions, velocities and angular velocities of all bodies in inertial axes, the ground first."""
    poses, rates = placed(state)
    turned = quaternions(poses)
    return positions(poses), turned, *in_space(rates, turned)


def past_of(state: State) -> PreviousPoses | None:
    """Poses of the previous state in statics, and the time since then."""
    if state.before is None or state.u is None:
        return None
    poses, _ = state.system.place(*state.before, None)
    return PreviousPoses(np.array(poses), state.time - state.before[0])


def positions(poses: np.ndarray) -> np.ndarray:
    """Positions (n, 3), m."""
    return poses[:, :3] if poses.shape[1] == 7 else np.stack([poses[:, 0], np.zeros(len(poses)), poses[:, 1]], axis=1)


def quaternions(poses: np.ndarray) -> np.ndarray:
    """Unit quaternions (n, 4)."""
    if poses.shape[1] == 7:
        return poses[:, 3:]
    half, zero = 0.5 * poses[:, 2], np.zeros(len(poses))
    return np.stack([np.cos(half), zero, np.sin(half), zero], axis=1)


def in_space(rows: np.ndarray, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First three and last three components (n, 3) each of rates or wrenches (n, 3 or 6), both in inertial axes.

    In space the last three are about the body axes; `turned` (n, 4) are the quaternions of the bodies.
    """
    if rows.shape[1] == 6:
        return rows[:, :3], rotated(turned, rows[:, 3:])
    zero = np.zeros(len(rows))
    return np.stack([rows[:, 0], zero, rows[:, 1]], axis=1), np.stack([zero, rows[:, 2], zero], axis=1)


def rotated(turned: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) rotated by quaternions (n, 4)."""
    return np.asarray(rotate_by(turned, vectors))


def rotation_since(start: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """Rotation vector (3,), rad, in inertial axes, from one quaternion to another; its length is at most pi."""
    relative = np.asarray(multiply(turned, start * np.array([1.0, -1.0, -1.0, -1.0])))
    if relative[0] < 0.0:
        relative = -relative
    size = float(np.linalg.norm(relative[1:]))
    return relative[1:] * (2.0 if size < 1e-12 else 2.0 * np.arctan2(size, relative[0]) / size)

