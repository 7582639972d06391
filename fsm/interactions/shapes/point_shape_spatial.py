"""Contact of a rounded point of one body with a shape of another body, in space.

    g = phi(xi) - r_point - r_shape,    xi = F^T (A_b^T (p - r_b) - c)          phi: `fsm.interactions.shapes.shape_distance`

with the point p = r_a + A_a x, and the shape's position c and axes F in body b. The normal n = A_b F grad phi points from
the shape to the point. The contact point is x_c = p - r_point n, on the point's own face. With H the Hessian of phi in
inertial axes and M the relative motion at p (`fsm.interactions.contact.contact_frame`),

    dn = H M + dtheta_b x n,      dx_c = dp - r_point dn

A point of a circle, such as the rim of a cylinder, turns with the tilt (`fsm.interactions.shapes.circle_point`):
x = x_0 + cos a u + sin a w. With t = A_a dx/da, the angle changes by da, the gap's gradient has the additional part n.t da,
dn has H t da, and dp has t da. For the nearest point

    da = -(dtheta_a x t . n + t.(H M + dtheta_b x n))/f'',      f'' = n.A_a d2x/da2 + t.H t

For a point at an angle from the lowest one, t and A_a d2x/da2 of the lowest point replace these, and the normal of the plane
replaces n, with H = 0. The Hessian of the gap is without n.t d2a, which cancels in the sum over a cap if the forces of the
points at equal heights are equal.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.contact_frame import (
    add_contact_tangent,
    contact_derivatives,
    contact_gradient,
    relative_motion,
)
from fsm.interactions.contact.shapes import BlockIndex, ContactForces, Points, Shapes
from fsm.interactions.shapes.circle_point import FIXED, FLAT, LOWEST, circle_angle
from fsm.interactions.shapes.shape_distance import shape_derivatives
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.vector import cross, dot, rotate


@kernel
def local_points_spatial(
    poses: np.ndarray,
    slots: np.ndarray,
    points: Points,
    shapes: Shapes,
) -> np.ndarray:
    """Positions (m, 3) of probes in the axes of their shapes, m.

    Parameters
    ----------
    poses : (n_bodies, 7) array
    slots : (m,) int array
        Rows of the selected probes.
    points, shapes : tables
    """
    out = np.empty((slots.shape[0], 3))
    frames, arm, place = np.empty((2, 3, 3)), np.empty(3), np.empty((5, 3))
    last_a = last_b = -1  # probes of one body against one shape are consecutive
    for i in range(slots.shape[0]):
        probe = slots[i]
        shape = points.shape[probe]
        a, b = points.body[probe], shapes.body[shape]
        if a != last_a:
            fill_rotation(poses[a, 3:], frames[0])
        if b != last_b:
            fill_rotation(poses[b, 3:], frames[1])
        last_a, last_b = a, b
        _place(poses, probe, points, shapes, frames, place)
        rotate(frames[0], place[0], arm)
        for c in range(3):
            arm[c] += poses[a, c] - poses[b, c]
        _to_shape_axes(frames[1], shapes.offset[shape], shapes.frame[shape], arm, out[i])
    return out


@kernel
def _place(
    poses: np.ndarray, probe: int, points: Points, shapes: Shapes, frames: np.ndarray, place: np.ndarray
) -> int:
    """Place of a probe in body axes (row 0) and its first and second derivative by the angle on its circle (rows 1, 2), and
    these derivatives at the lowest point (rows 3, 4); returns the way of the probe.
    """
    around = points.around[probe]
    for c in range(3):
        place[0, c] = points.place[probe, c]
    if around[2, 0] == 0.0 and around[2, 1] == 0.0:
        return FIXED
    shape = points.shape[probe]
    a, b, axes = points.body[probe], shapes.body[shape], shapes.frame[shape]
    arm, nothing, centre, radii = np.empty(3), np.zeros(3), np.empty(3), np.empty((2, 3))
    rotate(frames[0], place[0], arm)
    for c in range(3):
        arm[c] += poses[a, c] - poses[b, c]
    _to_shape_axes(frames[1], shapes.offset[shape], axes, arm, centre)
    for k in range(2):
        rotate(frames[0], around[k], arm)
        _to_shape_axes(frames[1], nothing, axes, arm, radii[k])
    angle, way = circle_angle(shapes.kind[shape], shapes.size[shape], centre, radii, around[2, 2] != 0.0)
    first_c, first_s = np.cos(angle), np.sin(angle)
    cosine, sine = first_c, first_s
    if way in (LOWEST, FIXED):
        cosine = first_c * around[2, 0] - first_s * around[2, 1]
        sine = first_s * around[2, 0] + first_c * around[2, 1]
    for c in range(3):
        place[2, c] = -cosine * around[0, c] - sine * around[1, c]
        place[1, c] = cosine * around[1, c] - sine * around[0, c]
        place[0, c] -= place[2, c]
        place[4, c] = -first_c * around[0, c] - first_s * around[1, c]
        place[3, c] = first_c * around[1, c] - first_s * around[0, c]
    return int(way)


@kernel
def _to_shape_axes(frame: np.ndarray, offset: np.ndarray, axes: np.ndarray, arm: np.ndarray, out: np.ndarray) -> None:
    """Transform a vector (3,) from the body's centre in inertial axes to a position in the axes of the body's shape."""
    for c in range(3):
        out[c] = 0.0
    for k in range(3):
        along = frame[0, k] * arm[0] + frame[1, k] * arm[1] + frame[2, k] * arm[2] - offset[k]
        for c in range(3):
            out[c] += axes[k, c] * along


@kernel
def _state(
    poses: np.ndarray,
    probe: int,
    points: Points,
    shapes: Shapes,
    frames: np.ndarray,
    world: np.ndarray,
    local: np.ndarray,
    slope: np.ndarray,
    bend: np.ndarray,
    normal: np.ndarray,
    arms: np.ndarray,
    place: np.ndarray,
) -> int:
    """Frames, the shape's axes in inertial ones (`world`), n, and the arms of the probe's centre (rows 0, 1) and of x_c.

    `slope` and `bend` are the derivatives of phi in the shape's axes; for `place` and the result see `_place`.
    """
    shape, radius = points.shape[probe], points.radius[probe]
    a, b, axes = points.body[probe], shapes.body[shape], shapes.frame[shape]
    fill_rotation(poses[a, 3:], frames[0])
    fill_rotation(poses[b, 3:], frames[1])
    way = _place(poses, probe, points, shapes, frames, place)
    rotate(frames[0], place[0], arms[0])
    for c in range(3):
        arms[1, c] = arms[0, c] + poses[a, c] - poses[b, c]
    _to_shape_axes(frames[1], shapes.offset[shape], axes, arms[1], local)
    shape_derivatives(shapes.kind[shape], shapes.size[shape], local, slope, bend)
    for i in range(3):
        for j in range(3):
            world[i, j] = (
                frames[1, i, 0] * axes[0, j] + frames[1, i, 1] * axes[1, j] + frames[1, i, 2] * axes[2, j]
            )
    rotate(world, slope, normal)
    for c in range(3):
        arms[2, c] = arms[0, c] - radius * normal[c]
        arms[3, c] = arms[1, c] - radius * normal[c]
    return way


@kernel
def write_points_spatial(
    poses: np.ndarray, rates: np.ndarray, slots: np.ndarray, points: Points, shapes: Shapes, bodies: np.ndarray,
    rate: np.ndarray, gradient: np.ndarray,
) -> None:  # fmt: skip
    """Write bodies (count, 2) of the probe and of the shape, rates (count, 4), m/s, of the gap and the slip velocity in
    inertial axes, and gradients (count, 4, 12).
    """
    frames, world, arms = np.empty((2, 3, 3)), np.empty((3, 3)), np.empty((4, 3))
    local, slope, bend, normal, along = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(3)
    motion, place, turning = np.empty((12, 3)), np.empty((5, 3)), np.empty(12)
    for i in range(slots.shape[0]):
        probe = slots[i]
        bodies[i, 0], bodies[i, 1] = points.body[probe], shapes.body[points.shape[probe]]
        way = _state(poses, probe, points, shapes, frames, world, local, slope, bend, normal, arms, place)
        relative_motion(frames, arms[2:], motion)
        contact_gradient(rates, bodies[i], normal, motion, rate[i], gradient[i])
        if way == LOWEST:
            _turning_of_lowest(frames, world, place, turning)
            rotate(frames[0], place[1], along)
            share = dot(along, normal)
            for m in range(12):
                gradient[i, 0, m] += share * turning[m]
                rate[i, 0] += share * turning[m] * rates[bodies[i, m // 6], m % 6]


@kernel
def _normal_and_point_changes(
    frames: np.ndarray,
    world: np.ndarray,
    bend: np.ndarray,
    normal: np.ndarray,
    radius: float,
    motion: np.ndarray,
    normal_change: np.ndarray,
    point_change: np.ndarray,
) -> None:
    """dn and dx_c (12, 3) from M at the probe's centre; see the module docstring."""
    turned = np.empty(3)
    for m in range(12):
        for i in range(3):
            along = world[0, i] * motion[m, 0] + world[1, i] * motion[m, 1] + world[2, i] * motion[m, 2]
            turned[i] = along
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += world[i, j] * (
                    bend[j, 0] * turned[0] + bend[j, 1] * turned[1] + bend[j, 2] * turned[2]
                )
            normal_change[m, i] = total
    for j in range(3):
        cross(frames[1][:, j], normal, turned)
        for c in range(3):
            normal_change[9 + j, c] += turned[c]
    for m in range(12):
        for c in range(3):
            point_change[m, c] = (motion[m, c] if m < 6 else 0.0) - radius * normal_change[m, c]


@kernel
def _turning_of_lowest(frames: np.ndarray, world: np.ndarray, place: np.ndarray, turning: np.ndarray) -> None:
    """Change da (12,) of the angle of the lowest point of a circle over the plane z = 0 of a shape."""
    along, inward, up, turned = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    rotate(frames[0], place[3], along)
    rotate(frames[0], place[4], inward)
    for c in range(3):
        up[c] = world[c, 2]
    turning[:] = 0.0
    curvature = dot(inward, up)  # its sign is that of the side of the plane
    for j in range(3):
        cross(frames[0][:, j], along, turned)
        turning[3 + j] = -dot(turned, up) / curvature
        cross(frames[1][:, j], up, turned)
        turning[9 + j] = -dot(turned, along) / curvature


@kernel
def _turning_of_nearest(
    frames: np.ndarray, bent: np.ndarray, normal: np.ndarray, place: np.ndarray, normal_change: np.ndarray,
    turning: np.ndarray,
) -> None:  # fmt: skip
    """Change da (12,) of the angle of the nearest point of a circle; `bent` is H t."""
    along, inward, turned = np.empty(3), np.empty(3), np.empty(3)
    rotate(frames[0], place[1], along)
    rotate(frames[0], place[2], inward)
    turning[:] = 0.0
    curvature = dot(inward, normal) + dot(along, bent)
    if not curvature > FLAT * np.sqrt(dot(along, along)):
        return
    for m in range(12):
        turning[m] = -dot(along, normal_change[m]) / curvature
        if 3 <= m < 6:
            cross(frames[0][:, m - 3], along, turned)
            turning[m] -= dot(turned, normal) / curvature


@kernel
def _add_turning(
    frames: np.ndarray, world: np.ndarray, bend: np.ndarray, normal: np.ndarray, radius: float, place: np.ndarray,
    way: int, normal_change: np.ndarray, point_change: np.ndarray, turning: np.ndarray,
) -> None:  # fmt: skip
    """Add the parts of dn and dx_c by the motion of the contact point along its circle, and write da (12,)."""
    along, part, bent = np.empty(3), np.empty(3), np.empty(3)
    rotate(frames[0], place[1], along)
    for i in range(3):
        part[i] = world[0, i] * along[0] + world[1, i] * along[1] + world[2, i] * along[2]
    for i in range(3):
        bent[i] = 0.0
        for k in range(3):
            bent[i] += world[i, k] * (bend[k, 0] * part[0] + bend[k, 1] * part[1] + bend[k, 2] * part[2])
    if way == LOWEST:
        _turning_of_lowest(frames, world, place, turning)
    else:
        _turning_of_nearest(frames, bent, normal, place, normal_change, turning)
    for m in range(12):
        for c in range(3):
            normal_change[m, c] += bent[c] * turning[m]
            point_change[m, c] += (along[c] - radius * bent[c]) * turning[m]


@kernel
def _add_turned_gradient(
    frames: np.ndarray, normal: np.ndarray, place: np.ndarray, normal_change: np.ndarray, turning: np.ndarray,
    hessian: np.ndarray,
) -> None:  # fmt: skip
    """Add the derivative of n.t da to the Hessian of the gap, without n.t d2a."""
    along, inward, turned = np.empty(3), np.empty(3), np.empty(3)
    rotate(frames[0], place[1], along)
    rotate(frames[0], place[2], inward)
    for n in range(12):
        change = dot(normal_change[n], along) + dot(normal, inward) * turning[n]
        if 3 <= n < 6:
            cross(frames[0][:, n - 3], along, turned)
            change += dot(normal, turned)
        for m in range(12):
            hessian[m, n] += change * turning[m]


@kernel
def tangent_points_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    slots: np.ndarray,
    bodies: np.ndarray,
    gradient: np.ndarray,
    points: Points,
    shapes: Shapes,
    forces: ContactForces,
    index: BlockIndex,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add K and D; `bodies` and `gradient` come from `measure_points_spatial`; forces as in `add_contact_tangent`."""
    frames, world, arms = np.empty((2, 3, 3)), np.empty((3, 3)), np.empty((4, 3))
    local, slope, bend, normal = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty(3)
    motion, normal_change, point_change = np.empty((12, 3)), np.empty((12, 3)), np.empty((12, 3))
    place, turning = np.empty((5, 3)), np.empty(12)
    hessian, slip_second = np.empty((12, 12)), np.empty((12, 12, 3))
    block_k, block_d = np.empty((12, 12)), np.empty((12, 12))
    for i in range(slots.shape[0]):
        probe = slots[i]
        way = _state(poses, probe, points, shapes, frames, world, local, slope, bend, normal, arms, place)
        relative_motion(frames, arms[:2], motion)
        _normal_and_point_changes(frames, world, bend, normal, points.radius[probe], motion, normal_change, point_change)
        if way != FIXED:
            _add_turning(
                frames, world, bend, normal, points.radius[probe], place, way, normal_change, point_change, turning
            )  # fmt: skip
        relative_motion(frames, arms[2:], motion)
        contact_derivatives(frames, arms[2:], normal, motion, normal_change, point_change, hessian, slip_second)
        if way == LOWEST:
            _add_turned_gradient(frames, normal, place, normal_change, turning, hessian)
        add_contact_tangent(
            i, rates, bodies, gradient, hessian, slip_second, forces, index, stiffness_data, damping_data, block_k, block_d
        )  # fmt: skip
