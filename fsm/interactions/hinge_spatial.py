"""Hinge angle between two bodies in space: the twist psi about the crease axis e2 of the joint frames.

Coordinates of a hinge: (dr, dtheta) of the inner body a, then of the outer body b; dtheta in body axes.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import BlockIndex
from fsm.interactions.swing_twist import increments, relative_quaternion, second_increment, twist_measure
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.scatter import add_block


@kernel
def measure_hinge_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    axes_inner: np.ndarray,
    axes_outer: np.ndarray,
    angle_offset: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles (m,) rad, rates (m,) rad/s and gradients (m, 1, 12) of all hinges.

    Parameters
    ----------
    poses, rates : (n_bodies, 7) and (n_bodies, 6) arrays
    bodies : (m, 2) int array
    axes_inner, axes_outer : (m, 4) arrays
        Quaternions of the joint axes in the bodies; the inner ones are rotated back by the initial angle.
    angle_offset : (m,) array, rad
        The initial angle.
    """
    count = bodies.shape[0]
    value = np.empty(count)
    rate = np.zeros(count)
    gradient = np.zeros((count, 1, 12))
    q, work = np.empty(4), np.empty((2, 4))
    first, second = np.empty(4), np.empty((4, 4))
    steps, frame = np.empty((6, 4)), np.empty((3, 3))
    for i in range(count):
        a, b = bodies[i, 0], bodies[i, 1]
        relative_quaternion(poses[a], poses[b], axes_inner[i], axes_outer[i], work, q)
        value[i] = angle_offset[i] + twist_measure(q, first, second)
        increments(q, steps)
        for side in range(2):
            fill_rotation(axes_inner[i] if side == 0 else axes_outer[i], frame)
            for c in range(3):
                total = 0.0
                for j in range(3):
                    slope = 0.0
                    for m in range(4):
                        slope += first[m] * steps[3 * side + j, m]
                    total += frame[c, j] * slope
                gradient[i, 0, 6 * side + 3 + c] = total
                rate[i] += total * rates[bodies[i, side], 3 + c]
    return value, rate, gradient


@kernel
def stiffness_hinge_spatial(
    poses: np.ndarray, bodies: np.ndarray, axes_inner: np.ndarray, axes_outer: np.ndarray, effort: np.ndarray,
    stiffness: np.ndarray, index: BlockIndex, stiffness_data: np.ndarray,
) -> None:  # fmt: skip
    """Add K of all hinges; `effort` and `stiffness` (m, 1), N m and N m/rad."""
    gradients, hessians = derivatives_hinge_spatial(poses, bodies, axes_inner, axes_outer)
    (dof, indptr, indices), block = index, np.zeros((12, 12))
    for i in range(bodies.shape[0]):
        gradient, hessian = gradients[i], hessians[i]
        for m in range(12):
            for n in range(12):
                block[m, n] = gradient[m] * (stiffness[i, 0] * gradient[n]) + effort[i, 0] * hessian[m, n]
        add_block(block, dof, bodies[i], indptr, indices, stiffness_data)


@kernel
def derivatives_hinge_spatial(
    poses: np.ndarray, bodies: np.ndarray, axes_inner: np.ndarray, axes_outer: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gradients (m, 12) of all hinge angles, and their derivatives (m, 12, 12), see `rotation_derivatives`."""
    q, work = np.empty(4), np.empty((2, 4))
    first, second = np.empty(4), np.empty((4, 4))
    steps, change = np.empty((6, 4)), np.empty(4)
    frames, joint_second = np.empty((2, 3, 3)), np.empty((6, 6))
    count = bodies.shape[0]
    gradient, hessian = np.zeros((count, 12)), np.zeros((count, 12, 12))
    for i in range(count):
        relative_quaternion(poses[bodies[i, 0]], poses[bodies[i, 1]], axes_inner[i], axes_outer[i], work, q)
        twist_measure(q, first, second)
        increments(q, steps)
        fill_rotation(axes_inner[i], frames[0])
        fill_rotation(axes_outer[i], frames[1])
        rotation_derivatives(first, second, steps, frames, change, joint_second, gradient[i], hessian[i])
    return gradient, hessian


@kernel
def rotation_derivatives(
    first: np.ndarray,
    second: np.ndarray,
    steps: np.ndarray,
    frames: np.ndarray,
    change: np.ndarray,
    joint_second: np.ndarray,
    gradient: np.ndarray,
    hessian: np.ndarray,
) -> None:
    """Gradient (12,) and its derivative (12, 12) with respect to body increments of a measure m(q).

    Row m, column n of `hessian` is d(gradient_m)/dx_n; it is not symmetric, because rotation increments do not commute.
    `change` and `joint_second` are scratch; the entries of positions are not changed (zero).
    """
    for r in range(6):
        for c in range(6):
            second_increment(r, c, steps, change)
            total = 0.0
            for m in range(4):
                total += first[m] * change[m]
                for k in range(4):
                    total += second[m, k] * steps[r, m] * steps[c, k]
            joint_second[r, c] = total
    for side in range(2):
        for i in range(3):
            total = 0.0
            for j in range(3):
                for m in range(4):
                    total += frames[side, i, j] * first[m] * steps[3 * side + j, m]
            gradient[6 * side + 3 + i] = total
            for other in range(2):
                for k in range(3):
                    total = 0.0
                    for j in range(3):
                        for m in range(3):
                            total += frames[side, i, j] * joint_second[3 * side + j, 3 * other + m] * frames[other, k, m]
                    hessian[6 * side + 3 + i, 6 * other + 3 + k] = total
