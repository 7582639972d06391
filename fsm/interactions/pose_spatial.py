"""Relative pose of two bodies in space: (Z1, Z2, Z3, s1, psi, s3) in the joint axes of the outer body.

    Z_k = e_k . (A_b^T (r_a + A_a c_a - r_b) - c_b)                  docs/theory.md

The swing (s1, s3) is measured in the same axes, or half-way between both bodies (`fsm.interactions.swing_twist`).

The force of Z acts on both bodies at one point, P+ of the inner body. The outer arm is A_b^T (p_a - r_b), not c_b.
Coordinates of an element: (dr, dtheta) of the inner body a, then of the outer body b; dtheta in body axes.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.swing_twist import increments, relative_quaternion, swing_slopes, twist_slopes
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.vector import cross


@kernel
def _translation(
    pose_a: np.ndarray, pose_b: np.ndarray, point: np.ndarray, rot_a: np.ndarray, rot_b: np.ndarray, place: np.ndarray
) -> None:
    """Compute the rotation matrices of both bodies, and y = A_b^T (r_a + A_a c_a - r_b) into `place` (3,)."""
    fill_rotation(pose_a[3:], rot_a)
    fill_rotation(pose_b[3:], rot_b)
    for k in range(3):
        total = 0.0
        for i in range(3):
            d = pose_a[i] - pose_b[i]
            for j in range(3):
                d += rot_a[i, j] * point[j]
            total += rot_b[i, k] * d
        place[k] = total


@kernel
def _translation_gradient(
    axis: np.ndarray,
    point: np.ndarray,
    rot_a: np.ndarray,
    rot_b: np.ndarray,
    place: np.ndarray,
    world: np.ndarray,
    in_a: np.ndarray,
    out: np.ndarray,
) -> None:
    """Gradient (12,) of Z along an axis of the outer body: (E, c_a x A_a^T E, -E, e x y), E = A_b e."""
    for i in range(3):
        world[i] = rot_b[i, 0] * axis[0] + rot_b[i, 1] * axis[1] + rot_b[i, 2] * axis[2]
    for i in range(3):
        in_a[i] = rot_a[0, i] * world[0] + rot_a[1, i] * world[1] + rot_a[2, i] * world[2]
        out[i] = world[i]
        out[6 + i] = -world[i]
    cross(point, in_a, out[3:6])
    cross(axis, place, out[9:12])


@kernel
def measure_pose_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    point_inner: np.ndarray,
    point_outer: np.ndarray,
    axes_inner: np.ndarray,
    axes_outer: np.ndarray,
    angle_offset: np.ndarray,
    half_way: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the deformations of all force elements, their rates and gradients.

    Parameters
    ----------
    poses, rates : (n_bodies, 7) and (n_bodies, 6) arrays
    bodies : (m, 2) int array
        Inner and outer body.
    point_inner, point_outer : (m, 3) arrays, m, body axes
    axes_inner, axes_outer : (m, 4) arrays
        Quaternions of the joint axes in the bodies; the inner ones are rotated back by the initial angle.
    angle_offset : (m,) array, rad
        The initial angle.
    half_way : (m,) bool array
        Whether the swing is measured in the axes half-way between both bodies.

    Returns
    -------
    value, rate : (m, 6) arrays, m and rad, m/s and rad/s
    gradient : (m, 6, 12) array
    """
    count = bodies.shape[0]
    value = np.empty((count, 6))
    rate = np.empty((count, 6))
    gradient = np.zeros((count, 6, 12))
    rot_a, rot_b, frame = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    place, axis, world, in_a = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    q, work, steps = np.empty(4), np.empty((2, 4)), np.empty((6, 4))
    first = np.empty((3, 4))
    for i in range(count):
        a, b = bodies[i, 0], bodies[i, 1]
        _translation(poses[a], poses[b], point_inner[i], rot_a, rot_b, place)
        fill_rotation(axes_outer[i], frame)
        for k in range(3):
            total = 0.0
            for j in range(3):
                axis[j] = frame[j, k]
                total += axis[j] * (place[j] - point_outer[i, j])
            value[i, k] = total
            _translation_gradient(axis, point_inner[i], rot_a, rot_b, place, world, in_a, gradient[i, k])
        relative_quaternion(poses[a], poses[b], axes_inner[i], axes_outer[i], work, q)
        turn = (q[0], q[1], q[2], q[3])
        twist, slopes_2 = twist_slopes(turn)
        value[i, 3], value[i, 5], slopes_1, slopes_3 = swing_slopes(turn, half_way[i])
        value[i, 4] = angle_offset[i] + twist
        for m in range(4):
            first[0, m], first[1, m], first[2, m] = slopes_1[m], slopes_2[m], slopes_3[m]
        increments(q, steps)
        for side in range(2):
            fill_rotation(axes_inner[i] if side == 0 else axes_outer[i], frame)
            for k in range(3):
                for c in range(3):
                    total = 0.0
                    for j in range(3):
                        for m in range(4):
                            total += frame[c, j] * first[k, m] * steps[3 * side + j, m]
                    gradient[i, 3 + k, 6 * side + 3 + c] = total
        for k in range(6):
            total = 0.0
            for c in range(6):
                total += gradient[i, k, c] * rates[a, c] + gradient[i, k, 6 + c] * rates[b, c]
            rate[i, k] = total
    return value, rate, gradient
