"""Contact of a rounded point of one body with a shape of another body in the plane y = 0.

The formulas of `point_shape_spatial` and `contact_frame` apply. In the plane, a rotation dphi displaces the point (x, z)
from the body's centre by dphi (z, -x). Slip is measured along t = (n_z, -n_x):

    dg_m = n.M_m,   V_m = t.M_m,   dn = H M + dphi_b t,   dt = (dn_z, -dn_x)

Coordinates: (x, z, phi) of the point's body, then of the shape's.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.contact_frame import add_contact_tangent
from fsm.interactions.contact.shapes import BlockIndex, ContactForces, Points, Shapes
from fsm.interactions.shapes.shape_distance import shape_derivatives
from fsm.kernels.jit import kernel


@kernel
def local_points_planar(
    poses: np.ndarray,
    slots: np.ndarray,
    points: Points,
    shapes: Shapes,
) -> np.ndarray:
    """Positions (m, 3) of probes in the axes of their shapes, m; y is zero.

    Parameters
    ----------
    poses : (n_bodies, 3) array
    slots : (m,) int array
        Rows of the selected probes.
    points, shapes : tables
    """
    out = np.zeros((slots.shape[0], 3))
    for i in range(slots.shape[0]):
        probe = slots[i]
        shape = points.shape[probe]
        a, b = points.body[probe], shapes.body[shape]
        c, s = np.cos(poses[a, 2]), np.sin(poses[a, 2])
        dx = poses[a, 0] + c * points.place[probe, 0] + s * points.place[probe, 1] - poses[b, 0]
        dz = poses[a, 1] - s * points.place[probe, 0] + c * points.place[probe, 1] - poses[b, 1]
        c, s = np.cos(poses[b, 2]), np.sin(poses[b, 2])
        x, z = c * dx - s * dz - shapes.offset[shape, 0], s * dx + c * dz - shapes.offset[shape, 1]
        c, s = np.cos(shapes.frame[shape]), np.sin(shapes.frame[shape])
        out[i, 0], out[i, 2] = c * x - s * z, s * x + c * z
    return out


@kernel
def _state(
    poses: np.ndarray,
    bodies: np.ndarray,
    place: np.ndarray,
    kind: int,
    size: np.ndarray,
    angle: float,
    local: np.ndarray,
    slope: np.ndarray,
    bend: np.ndarray,
    turned: np.ndarray,
    arms: np.ndarray,
) -> tuple[float, float]:
    """n; H in inertial axes (`turned`, 2 x 2); arms of the probe's centre from both bodies, (2, 2)."""
    a, b = bodies[0], bodies[1]
    c, s = np.cos(poses[a, 2]), np.sin(poses[a, 2])
    arms[0, 0], arms[0, 1] = c * place[0] + s * place[1], c * place[1] - s * place[0]
    arms[1, 0], arms[1, 1] = arms[0, 0] + poses[a, 0] - poses[b, 0], arms[0, 1] + poses[a, 1] - poses[b, 1]
    shape_derivatives(kind, size, local, slope, bend)
    c, s = np.cos(poses[b, 2] + angle), np.sin(poses[b, 2] + angle)
    xx, xz, zz = bend[0, 0], bend[0, 2], bend[2, 2]
    turned[0, 0] = c * c * xx + 2.0 * c * s * xz + s * s * zz
    turned[0, 1] = c * s * (zz - xx) + (c * c - s * s) * xz
    turned[1, 0] = turned[0, 1]
    turned[1, 1] = s * s * xx - 2.0 * c * s * xz + c * c * zz
    return c * slope[0] + s * slope[2], c * slope[2] - s * slope[0]


@kernel
def _motion(arms: np.ndarray, shift_x: float, shift_z: float, motion: np.ndarray) -> None:
    """Relative motion M (6, 2) at the probe's centre plus a shift."""
    motion[:] = 0.0
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        motion[3 * side, 0] = sign
        motion[3 * side + 1, 1] = sign
        motion[3 * side + 2, 0] = sign * (arms[side, 1] + shift_z)
        motion[3 * side + 2, 1] = -sign * (arms[side, 0] + shift_x)


@kernel
def write_points_planar(
    poses: np.ndarray, rates: np.ndarray, slots: np.ndarray, points: Points, shapes: Shapes, bodies: np.ndarray,
    rate: np.ndarray, gradient: np.ndarray,
) -> None:  # fmt: skip
    """Write bodies (count, 2) of the probe and of the shape, rates (count, 2), m/s, and gradients (count, 2, 6) of gap and
    slip.
    """
    local = local_points_planar(poses, slots, points, shapes)
    slope, bend, turned = np.empty(3), np.empty((3, 3)), np.empty((2, 2))
    arms, motion = np.empty((2, 2)), np.empty((6, 2))
    for i in range(slots.shape[0]):
        probe = slots[i]
        shape = points.shape[probe]
        bodies[i, 0], bodies[i, 1] = points.body[probe], shapes.body[shape]
        rate[i, 0] = rate[i, 1] = 0.0
        nx, nz = _state(
            poses, bodies[i], points.place[probe], shapes.kind[shape], shapes.size[shape], shapes.frame[shape],
            local[i], slope, bend, turned, arms,
        )  # fmt: skip
        _motion(arms, -points.radius[probe] * nx, -points.radius[probe] * nz, motion)
        for m in range(6):
            gradient[i, 0, m] = nx * motion[m, 0] + nz * motion[m, 1]
            gradient[i, 1, m] = nz * motion[m, 0] - nx * motion[m, 1]
            rate[i, 0] += gradient[i, 0, m] * rates[bodies[i, m // 3], m % 3]
            rate[i, 1] += gradient[i, 1, m] * rates[bodies[i, m // 3], m % 3]


@kernel
def _derivatives(
    nx: float,
    nz: float,
    radius: float,
    turned: np.ndarray,
    arms: np.ndarray,
    centre_motion: np.ndarray,
    motion: np.ndarray,
    hessian: np.ndarray,
    slip_second: np.ndarray,
) -> None:
    """Derivatives (6, 6) of the gradients of gap and slip; `motion` is at x_c, `centre_motion` at the probe's centre."""
    for n in range(6):
        mx, mz = centre_motion[n, 0], centre_motion[n, 1]
        dx, dz = turned[0, 0] * mx + turned[0, 1] * mz, turned[1, 0] * mx + turned[1, 1] * mz
        if n == 5:
            dx += nz
            dz -= nx
        shift_x, shift_z = -radius * dx, -radius * dz
        if n < 3:
            shift_x += mx
            shift_z += mz
        for m in range(6):
            moved_x, moved_z = 0.0, 0.0
            if m % 3 == 2:
                # change of the arm minus the change due to the body's rotation
                side = m // 3
                arm_x, arm_z = shift_x, shift_z
                if n == 3 * side:
                    arm_x -= 1.0
                if n == 3 * side + 1:
                    arm_z -= 1.0
                sign = 1.0 if side == 0 else -1.0
                moved_x, moved_z = sign * arm_z, -sign * arm_x
            hessian[m, n] = dx * motion[m, 0] + dz * motion[m, 1] + nx * moved_x + nz * moved_z
            slip_second[m, n, 0] = dz * motion[m, 0] - dx * motion[m, 1] + nz * moved_x - nx * moved_z


@kernel
def tangent_points_planar(
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
    """Add K and D; `bodies` and `gradient` come from `measure_points_planar`; forces as in `add_contact_tangent`."""
    local = local_points_planar(poses, slots, points, shapes)
    slope, bend, turned = np.empty(3), np.empty((3, 3)), np.empty((2, 2))
    arms, motion, centre_motion = np.empty((2, 2)), np.empty((6, 2)), np.empty((6, 2))
    hessian, slip_second = np.empty((6, 6)), np.empty((6, 6, 1))
    block_k, block_d = np.empty((6, 6)), np.empty((6, 6))
    for i in range(slots.shape[0]):
        probe = slots[i]
        shape, radius = points.shape[probe], points.radius[probe]
        nx, nz = _state(
            poses, bodies[i], points.place[probe], shapes.kind[shape], shapes.size[shape], shapes.frame[shape],
            local[i], slope, bend, turned, arms,
        )  # fmt: skip
        _motion(arms, 0.0, 0.0, centre_motion)
        _motion(arms, -radius * nx, -radius * nz, motion)
        _derivatives(nx, nz, radius, turned, arms, centre_motion, motion, hessian, slip_second)
        add_contact_tangent(
            i, rates, bodies, gradient, hessian, slip_second, forces, index, stiffness_data, damping_data, block_k, block_d
        )  # fmt: skip
