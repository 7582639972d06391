"""Tangent of spatial contacts: second derivatives of gap and slip at a closest point; see `gap_spatial` for the terms."""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import BlockIndex, ContactForces, FoundPoints
from fsm.interactions.search.control_points import ROW, ROW_S, ROW_SS, ROW_SY, ROW_Y
from fsm.interactions.surfaces.gap_spatial import variations
from fsm.interactions.surfaces.surface import overshoot
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_block
from fsm.kernels.vector import cross, dot, rotate


@kernel
def _second_variation(frame: np.ndarray, arm: np.ndarray, row: int, column: int, out: np.ndarray) -> None:
    """A (e_column x (e_row x arm)): second derivative with respect to rotations `row` and `column`."""
    for c in range(3):
        out[c] = frame[c, row] * arm[column]
    if row == column:
        for c in range(3):
            out[c] -= frame[c, 0] * arm[0] + frame[c, 1] * arm[1] + frame[c, 2] * arm[2]


@kernel
def tangent_gap_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    gradient: np.ndarray,
    found: FoundPoints,
    place: np.ndarray,
    straight: np.ndarray,
    clearance: np.ndarray,
    inset: np.ndarray,
    stations: np.ndarray,
    forces: ContactForces,
    index: BlockIndex,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add K and D of all contacts; arguments as in `tangent_gap_planar`, slip and friction are 3-vectors."""
    found_probe, found_piece, found_side, found_at = found
    normal_force, by_depth, by_closing, effort, by_slip, by_normal, with_friction = forces
    dof, indptr, indices = index
    weights, shift, local = np.empty((3, 4)), np.empty((5, 2)), np.empty((5, 2, 3))
    frames, surface = np.empty((3, 3, 3)), np.empty((5, 3))
    normal, dual, change = np.empty(3), np.empty((2, 3)), np.empty((5, 18, 3))
    arm, turned, second = np.zeros(3), np.empty(3), np.empty(3)
    parameters, tilt = np.empty((2, 18)), np.empty((2, 18))
    normal_change, dual_change = np.empty((18, 3)), np.empty((2, 18, 3))
    base_change = np.empty((2, 18, 3))
    hessian, speed = np.empty((18, 18)), np.empty(18)
    slip_second = np.zeros((18, 18, 3))
    slip_x = np.empty(3)
    sliding, along_normal, sliding_second = np.empty(18), np.empty(18), np.empty((18, 18))
    block_k, block_d = np.empty((18, 18)), np.empty((18, 18))
    for i in range(found_probe.shape[0]):
        probe, piece = found_probe[i], found_piece[i]
        distance = variations(
            poses, bodies[i], place[probe], found_side[i], found_at[i], stations[piece],
            weights, shift, local, frames, surface, normal, dual, change,
        )  # fmt: skip
        for b in range(3):
            for c in range(6):
                speed[6 * b + c] = rates[bodies[i, b], c]
        m_ss = dot(surface[ROW_S], surface[ROW_S]) - distance * dot(normal, surface[ROW_SS])
        m_sy = dot(surface[ROW_S], surface[ROW_Y]) - distance * dot(normal, surface[ROW_SY])
        m_yy = dot(surface[ROW_Y], surface[ROW_Y])
        determinant = m_ss * m_yy - m_sy * m_sy
        for m in range(18):
            r_s = dot(surface[ROW_S], change[0, m]) + distance * dot(normal, change[ROW_S, m])
            r_y = dot(surface[ROW_Y], change[0, m]) + distance * dot(normal, change[ROW_Y, m])
            parameters[0, m] = (m_yy * r_s - m_sy * r_y) / determinant
            parameters[1, m] = (m_ss * r_y - m_sy * r_s) / determinant
            for c in range(3):
                base_change[0, m, c] = (
                    change[ROW_S, m, c]
                    + surface[ROW_SS, c] * parameters[0, m]
                    + surface[ROW_SY, c] * parameters[1, m]
                )
                base_change[1, m, c] = change[ROW_Y, m, c] + surface[ROW_SY, c] * parameters[0, m]
            tilt[0, m] = dot(normal, base_change[0, m])
            tilt[1, m] = dot(normal, base_change[1, m])
            for c in range(3):
                normal_change[m, c] = -dual[0, c] * tilt[0, m] - dual[1, c] * tilt[1, m]
        for m in range(18):
            along_normal[m] = dot(normal, change[0, m])
            tilt_s, tilt_y = dot(normal, change[ROW_S, m]), dot(normal, change[ROW_Y, m])
            for n in range(18):
                turning = dot(normal_change[n], change[0, m])
                hessian[m, n] = turning - tilt_s * parameters[0, n] - tilt_y * parameters[1, n]
        if with_friction:
            _slip_derivatives(
                surface, normal, dual, change, parameters, normal_change, base_change, along_normal,
                distance - inset[probe], inset[probe], frames, turned, dual_change, slip_second,
            )  # fmt: skip
        # second variations by rotations of one body
        for b in range(3):
            first = 6 * b + 3
            for row in range(3):
                for column in range(3):
                    if b == 0:
                        arm[0], arm[1], arm[2] = place[probe, 0], place[probe, 1], 0.0
                        _second_variation(frames[0], arm, row, column, second)
                        sign = 1.0
                    else:
                        _second_variation(frames[b], local[ROW, b - 1], row, column, second)
                        sign = -1.0
                    along = dot(normal, second)
                    hessian[first + row, first + column] += sign * along
                    if not with_friction:
                        continue
                    for c in range(3):
                        slip_second[first + row, first + column, c] += sign * (second[c] - normal[c] * along)
                    if b > 0:
                        lever = distance - inset[probe]
                        for a, table in ((0, ROW_S), (1, ROW_Y)):
                            _second_variation(frames[b], local[table, b - 1], row, column, second)
                            along = dot(normal, second)
                            for c in range(3):
                                slip_second[first + row, first + column, c] += lever * dual[a, c] * along
        length = np.sqrt(dot(surface[ROW_S], surface[ROW_S]))
        over, radius = overshoot(found_at[i, 0], stations[piece], length, straight[probe], clearance[probe])
        if over != 0.0:
            height = distance - clearance[probe] + radius
            far = np.hypot(over, height)
            _sliding_derivatives(poses, bodies[i], place[probe], frames, sliding_second)
            for m in range(18):
                sliding[m] = (dot(surface[ROW_S], change[0, m]) + distance * dot(normal, change[ROW_S, m])) / length
            for m in range(18):
                for n in range(18):
                    hessian[m, n] = (
                        sliding[m] * sliding[n]
                        + along_normal[m] * along_normal[n]
                        - gradient[i, 0, m] * gradient[i, 0, n]
                        + over * sliding_second[m, n]
                        + height * hessian[m, n]
                    ) / far
        force = normal_force[i]
        for n in range(18):
            gap_rate = 0.0
            for m in range(18):
                gap_rate += hessian[m, n] * speed[m]
            normal_x = -by_depth[i] * gradient[i, 0, n] - by_closing[i] * gap_rate
            normal_u = -by_closing[i] * gradient[i, 0, n]
            for m in range(18):
                block_k[m, n] = -force * hessian[m, n] - gradient[i, 0, m] * normal_x
                block_d[m, n] = -gradient[i, 0, m] * normal_u
            if not with_friction:
                continue
            for c in range(3):
                total = 0.0
                for m in range(18):
                    total += slip_second[m, n, c] * speed[m]
                slip_x[c] = total
            for c in range(3):
                friction_x = by_normal[i, c] * normal_x
                friction_u = by_normal[i, c] * normal_u
                for e in range(3):
                    friction_x += by_slip[i, c, e] * slip_x[e]
                    friction_u += by_slip[i, c, e] * gradient[i, 1 + e, n]
                for m in range(18):
                    block_k[m, n] += gradient[i, 1 + c, m] * friction_x + effort[i, c] * slip_second[m, n, c]
                    block_d[m, n] += gradient[i, 1 + c, m] * friction_u
        add_block(block_k, dof, bodies[i], indptr, indices, stiffness_data)
        add_block(block_d, dof, bodies[i], indptr, indices, damping_data)


@kernel
def _sliding_derivatives(
    poses: np.ndarray, bodies: np.ndarray, place: np.ndarray, frames: np.ndarray, out: np.ndarray
) -> None:
    """Second derivatives (18, 18) of x = e1.(p - r_a), distance of a point p along the flat plate a."""
    out[:] = 0.0
    unit, turned, second, point = np.empty(3), np.empty(3), np.empty(3), np.zeros(3)
    axis, arm, offset = np.zeros(3), np.zeros(3), np.empty(3)
    axis[0] = 1.0
    point[0], point[1] = place[0], place[1]
    rotate(frames[0], point, arm)
    for c in range(3):
        offset[c] = poses[bodies[0], c] + arm[c] - poses[bodies[1], c]
    # derivatives of e1 and p with respect to rotations of their bodies about e_j
    axis_turned, point_turned = np.empty((3, 3)), np.empty((3, 3))
    for j in range(3):
        unit[:] = 0.0
        unit[j] = 1.0
        cross(unit, axis, turned)
        rotate(frames[1], turned, axis_turned[j])
        cross(unit, point, turned)
        rotate(frames[0], turned, point_turned[j])
    along = frames[1][:, 0].copy()
    for j in range(3):
        for c in range(3):
            out[9 + j, c] = out[c, 9 + j] = axis_turned[j, c]
            out[9 + j, 6 + c] = out[6 + c, 9 + j] = -axis_turned[j, c]
        for k in range(3):
            out[9 + j, 3 + k] = out[3 + k, 9 + j] = dot(axis_turned[j], point_turned[k])
            _second_variation(frames[0], point, j, k, second)
            out[3 + j, 3 + k] = dot(along, second)
            _second_variation(frames[1], axis, j, k, second)
            out[9 + j, 9 + k] = dot(offset, second)


@kernel
def _slip_derivatives(
    surface: np.ndarray,
    normal: np.ndarray,
    dual: np.ndarray,
    change: np.ndarray,
    parameters: np.ndarray,
    normal_change: np.ndarray,
    base_change: np.ndarray,
    along_normal: np.ndarray,
    lever: float,
    inset: float,
    frames: np.ndarray,
    turned: np.ndarray,
    dual_change: np.ndarray,
    out: np.ndarray,
) -> None:
    """Derivative (18, 18, 3) of the slip gradient V_m, dV_m/dx_n, without the second variations by rotations.

    V_m = d_m - n (n.d_m) - inset (R_m x n) + lever S^a (n.dS_a,m)

    `along_normal` is n.d_n, the gradient of the distance; on a rounded tip it differs from the gradient of the gap.
    """
    for n in range(18):
        for a in range(2):
            for c in range(3):
                dual_change[a, n, c] = (
                    -dot(dual[a], base_change[0, n]) * dual[0, c]
                    - dot(dual[a], base_change[1, n]) * dual[1, c]
                    - dot(dual[a], normal_change[n]) * normal[c]
                )
    for m in range(18):
        along = along_normal[m]
        tilt_s, tilt_y = dot(normal, change[ROW_S, m]), dot(normal, change[ROW_Y, m])
        bend_s, bend_y = dot(normal, change[ROW_SS, m]), dot(normal, change[ROW_SY, m])
        for n in range(18):
            ds, dy = parameters[0, n], parameters[1, n]
            # d_m changes by -dS_a,m a^a_n; n.dS_a,m by dn.dS_a,m + n.dS_ab,m a^b_n
            slide = dot(normal_change[n], change[0, m]) - tilt_s * ds - tilt_y * dy
            tilt_s_n = dot(normal_change[n], change[ROW_S, m]) + bend_s * ds + bend_y * dy
            tilt_y_n = dot(normal_change[n], change[ROW_Y, m]) + bend_y * ds
            for c in range(3):
                moved = -change[ROW_S, m, c] * ds - change[ROW_Y, m, c] * dy
                out[m, n, c] = (
                    moved
                    - normal_change[n, c] * along
                    - normal[c] * slide
                    + along_normal[n] * (dual[0, c] * tilt_s + dual[1, c] * tilt_y)
                    + lever
                    * (
                        dual_change[0, n, c] * tilt_s
                        + dual_change[1, n, c] * tilt_y
                        + dual[0, c] * tilt_s_n
                        + dual[1, c] * tilt_y_n
                    )
                )
    # R_m x n: the probe body's axes also turn, d(A e_m)/dtheta_n = A (e_n x e_m)
    axis = np.empty(3)
    for m in range(3):
        for n in range(18):
            cross(frames[0][:, m], normal_change[n], turned)
            for c in range(3):
                out[3 + m, n, c] -= inset * turned[c]
        for n in range(3):
            if n == m:
                continue
            # e_n x e_m = +-e_k
            k = 3 - m - n
            sign = 1.0 if (n + 1) % 3 == m else -1.0
            for c in range(3):
                axis[c] = sign * frames[0][c, k]
            cross(axis, normal, turned)
            for c in range(3):
                out[3 + m, 3 + n, c] -= inset * turned[c]
