"""Relative pose of two bodies in space: (Z1, Z2, Z3, s1, psi, s3) in the joint axes of the outer body.

    Z_k = e_k . (A_b^T (r_a + A_a c_a - r_b) - c_b)                  docs/theory.md

The swing (s1, s3) is measured in the same axes, or half-way between both bodies (`fsm.interactions.swing_twist`).

The force of Z acts on both bodies at one point, P+ of the inner body. The outer arm is A_b^T (p_a - r_b), not c_b.
Coordinates of an element: (dr, dtheta) of the inner body a, then of the outer body b; dtheta in body axes.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import BlockIndex
from fsm.interactions.hinge_spatial import rotation_derivatives
from fsm.interactions.pose_planar import MeasureTangents
from fsm.interactions.swing_twist import increments, relative_quaternion, swing_measures, twist_measure
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.scatter import add_block
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
    first, second = np.empty((3, 4)), np.empty((3, 4, 4))
    swing, swing_first, swing_second = np.empty(2), np.empty((2, 4)), np.empty((2, 4, 4))
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
        value[i, 4] = angle_offset[i] + twist_measure(q, first[1], second[1])
        swing_measures(q, half_way[i], swing, swing_first, swing_second)
        value[i, 3], value[i, 5] = swing[0], swing[1]
        first[0], first[2] = swing_first[0], swing_first[1]
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


@kernel
def _translation_hessian(
    axis: np.ndarray,
    point: np.ndarray,
    rot_a: np.ndarray,
    rot_b: np.ndarray,
    place: np.ndarray,
    in_a: np.ndarray,
    unit: np.ndarray,
    turned: np.ndarray,
    moved: np.ndarray,
    out: np.ndarray,
) -> None:
    """Derivative (12, 12) of the gradient of Z with respect to body increments; see the module docstring for the terms."""
    out[:] = 0.0
    for j in range(3):
        unit[:] = 0.0
        unit[j] = 1.0
        # inner body turns about its axis j: c_a x (-e_j x A_a^T E), and y moves by A_b^T A_a (e_j x c_a)
        cross(unit, in_a, turned)
        cross(turned, point, moved)
        for i in range(3):
            out[3 + i, 3 + j] = moved[i]
        cross(unit, point, turned)
        for i in range(3):
            total = 0.0
            for k in range(3):
                for m in range(3):
                    total += rot_b[k, i] * rot_a[k, m] * turned[m]
            moved[i] = total
        cross(axis, moved, turned)
        for i in range(3):
            out[9 + i, 3 + j] = turned[i]
        # outer body turns about its axis j: E by A_b (e_j x e), y by -e_j x y
        cross(unit, axis, turned)
        for i in range(3):
            moved[i] = rot_b[i, 0] * turned[0] + rot_b[i, 1] * turned[1] + rot_b[i, 2] * turned[2]
            out[i, 9 + j] = moved[i]
            out[6 + i, 9 + j] = -moved[i]
        for i in range(3):
            turned[i] = rot_a[0, i] * moved[0] + rot_a[1, i] * moved[1] + rot_a[2, i] * moved[2]
        cross(point, turned, moved)
        for i in range(3):
            out[3 + i, 9 + j] = moved[i]
        cross(place, unit, turned)
        cross(axis, turned, moved)
        for i in range(3):
            out[9 + i, 9 + j] = moved[i]
        # either body moves along inertial axis j: y by +-A_b^T e_j
        for i in range(3):
            turned[i] = rot_b[j, i]
        cross(axis, turned, moved)
        for i in range(3):
            out[9 + i, j] = moved[i]
            out[9 + i, 6 + j] = -moved[i]


@kernel
def tangent_pose_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    point_inner: np.ndarray,
    point_outer: np.ndarray,
    axes_inner: np.ndarray,
    axes_outer: np.ndarray,
    angle_offset: np.ndarray,
    half_way: np.ndarray,
    measured: MeasureTangents,
    index: BlockIndex,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add K = -dh/dx and D = -dh/du of all force elements; terms as in `tangent_pose_planar`."""
    gradient, effort, stiffness, damping = measured
    dof, indptr, indices = index
    rot_a, rot_b = np.empty((3, 3)), np.empty((3, 3))
    place, axis, world, in_a = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    unit, turned, moved = np.empty(3), np.empty(3), np.empty(3)
    q, work, steps = np.empty(4), np.empty((2, 4)), np.empty((6, 4))
    first, second = np.empty((3, 4)), np.empty((3, 4, 4))
    swing, swing_first, swing_second = np.empty(2), np.empty((2, 4)), np.empty((2, 4, 4))
    change, joint_second, frames = np.empty(4), np.empty((6, 6)), np.empty((2, 3, 3))
    scratch, speed, along = np.empty(12), np.empty(12), np.empty(12)
    shift_hessian, turn_hessian = np.zeros((12, 12)), np.zeros((12, 12))
    block_k, block_d = np.empty((12, 12)), np.empty((12, 12))
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        speed[:6] = rates[a]
        speed[6:] = rates[b]
        block_k[:] = 0.0
        block_d[:] = 0.0
        _translation(poses[a], poses[b], point_inner[i], rot_a, rot_b, place)
        fill_rotation(axes_inner[i], frames[0])
        fill_rotation(axes_outer[i], frames[1])
        relative_quaternion(poses[a], poses[b], axes_inner[i], axes_outer[i], work, q)
        twist_measure(q, first[1], second[1])
        swing_measures(q, half_way[i], swing, swing_first, swing_second)
        for m in range(4):
            first[0, m], first[2, m] = swing_first[0, m], swing_first[1, m]
            for n in range(4):
                second[0, m, n], second[2, m, n] = swing_second[0, m, n], swing_second[1, m, n]
        increments(q, steps)
        for k in range(6):
            if stiffness[i, k] == 0.0 and damping[i, k] == 0.0 and effort[i, k] == 0.0:
                continue
            if k < 3:
                for j in range(3):
                    axis[j] = frames[1, j, k]
                _translation_gradient(axis, point_inner[i], rot_a, rot_b, place, world, in_a, scratch)
                _translation_hessian(
                    axis, point_inner[i], rot_a, rot_b, place, in_a, unit, turned, moved, shift_hessian
                )
                hessian = shift_hessian
            else:
                rotation_derivatives(
                    first[k - 3], second[k - 3], steps, frames, change, joint_second, scratch, turn_hessian
                )
                hessian = turn_hessian
            for n in range(12):
                total = 0.0
                for m in range(12):
                    total += hessian[m, n] * speed[m]
                along[n] = total
            g = gradient[i, k]
            for m in range(12):
                for n in range(12):
                    block_k[m, n] += (
                        g[m] * (stiffness[i, k] * g[n] + damping[i, k] * along[n]) + effort[i, k] * hessian[m, n]
                    )
                    block_d[m, n] += damping[i, k] * g[m] * g[n]
        add_block(block_k, dof, bodies[i], indptr, indices, stiffness_data)
        add_block(block_d, dof, bodies[i], indptr, indices, damping_data)
