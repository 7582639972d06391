"""Gap between a probe point of one panel and the surface of another, in space.

    g = n . (p - S(s, y)) - clearance,     (p - S) . S_a = 0  for a = s, y

The surface is ruled: the curve of `fsm.interactions.surface` with y e2 added to its control points. With d_i the variation
of p - S by coordinate i at fixed (s, y), m_ab = S_a.S_b - distance n.S_ab and S^a the contravariant base,

    a_i = m^-1 (S_a.d_i + distance n.dS_a,i),   dn_i = -S^a B_a,i,   B_a,i = n.(dS_a,i + S_ab a^b_i),   dg_i = n.d_i

Slip is the tangential relative velocity of the two bodies' material at one point, x_c = p - inset n. In a plane motion all
this is `gap_planar`. Points beyond the sides |y| > width/2 touch nothing.

Coordinates of a contact: (dr, dtheta) of the probe's body, then of the piece's bodies a and b; dtheta in body axes.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.surface import blend
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.scatter import add_block

__all__ = ["KERNELS", "find_contacts_spatial", "measure_gap_spatial", "tangent_gap_spatial", "window_probes_spatial"]

# rows of the tables of surface derivatives
_S, _SS, _SY, _SSS, _SSY = 0, 1, 2, 3, 4


@kernel
def _rotate(rotation: np.ndarray, vector: np.ndarray, out: np.ndarray) -> None:
    for i in range(3):
        out[i] = rotation[i, 0] * vector[0] + rotation[i, 1] * vector[1] + rotation[i, 2] * vector[2]


@kernel
def _dot(a: np.ndarray, b: np.ndarray) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@kernel
def _cross(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@kernel
def _chord_distance(
    poses: np.ndarray, owners: np.ndarray, stations: np.ndarray, j: int, point: np.ndarray, frame: np.ndarray
) -> float:
    """Squared distance of a point from the line between the ends of piece j, not counting what lies across it."""
    a, b = owners[j, 0], owners[j, 1]
    fill_rotation(poses[a, 3:], frame)
    gap, side, line, start = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    for i in range(3):
        side[i] = frame[i, 1]
        start[i] = poses[a, i] + frame[i, 0] * stations[j, 0]
    fill_rotation(poses[b, 3:], frame)
    for i in range(3):
        line[i] = poses[b, i] + frame[i, 0] * stations[j, 3] - start[i]
        gap[i] = point[i] - start[i]
    across_gap, across_line = _dot(gap, side), _dot(line, side)
    for i in range(3):
        gap[i] -= across_gap * side[i]
        line[i] -= across_line * side[i]
    share = min(1.0, max(0.0, _dot(gap, line) / _dot(line, line)))
    for i in range(3):
        gap[i] -= share * line[i]
    return _dot(gap, gap)


@kernel
def _probe_point(poses: np.ndarray, body: int, place: np.ndarray, frame: np.ndarray, out: np.ndarray) -> None:
    fill_rotation(poses[body, 3:], frame)
    for i in range(3):
        out[i] = poses[body, i] + frame[i, 0] * place[0] + frame[i, 1] * place[1]


@kernel
def window_probes_spatial(
    poses: np.ndarray,
    probe_body: np.ndarray,
    place: np.ndarray,
    first_piece: np.ndarray,
    last_piece: np.ndarray,
    owners: np.ndarray,
    stations: np.ndarray,
    half_width: np.ndarray,
    reach: np.ndarray,
    window: np.ndarray,
) -> None:
    """Broad phase; see `window_probes_planar`. `place` is (n, 2), `half_width` (n_pieces,)."""
    frame, point = np.empty((3, 3)), np.empty(3)
    for i in range(probe_body.shape[0]):
        _probe_point(poses, probe_body[i], place[i], frame, point)
        low, high = last_piece[i], first_piece[i]
        for j in range(first_piece[i], last_piece[i]):
            if _chord_distance(poses, owners, stations, j, point, frame) < reach[i] * reach[i]:
                low = min(low, j)
                high = max(high, j + 1)
        window[i, 0] = low
        window[i, 1] = max(low, high)


@kernel
def _tables(
    s: float, y: float, stations: np.ndarray, weights: np.ndarray, shift: np.ndarray, local: np.ndarray
) -> None:
    """How S and its derivatives hang on the two bodies: D = sum_k shift[D, k] r_k + A_k local[D, k].

    Rows: S, S_s, S_y, S_ss, S_sy; `shift` (5, 2), `local` (5, 2, 3).
    """
    blend(s, stations, weights)
    local[:] = 0.0
    for k in range(2):
        for row, order in ((_S, 0), (_SS, 1), (_SSS, 2)):
            shift[row, k] = weights[order, 2 * k]
            local[row, k, 0] = weights[order, 2 * k + 1]
            local[row, k, 1] = weights[order, 2 * k] * y
        shift[_SY, k] = 0.0
        shift[_SSY, k] = 0.0
        local[_SY, k, 1] = weights[0, 2 * k]
        local[_SSY, k, 1] = weights[1, 2 * k]


@kernel
def _surface(
    poses: np.ndarray, a: int, b: int, shift: np.ndarray, local: np.ndarray, frames: np.ndarray, out: np.ndarray
) -> None:
    """S, S_s, S_y, S_ss, S_sy in the rows of `out` (5, 3); `frames` (3, 3, 3) rows 1 and 2 get A_a and A_b."""
    fill_rotation(poses[a, 3:], frames[1])
    fill_rotation(poses[b, 3:], frames[2])
    for row in range(5):
        for i in range(3):
            total = shift[row, 0] * poses[a, i] + shift[row, 1] * poses[b, i]
            for j in range(2):
                total += frames[1, i, j] * local[row, 0, j] + frames[2, i, j] * local[row, 1, j]
            out[row, i] = total


@kernel
def find_contacts_spatial(
    poses: np.ndarray,
    probe_body: np.ndarray,
    place: np.ndarray,
    side: np.ndarray,
    clearance: np.ndarray,
    depth_limit: np.ndarray,
    window: np.ndarray,
    owners: np.ndarray,
    stations: np.ndarray,
    half_width: np.ndarray,
    below: float,
    found_probe: np.ndarray,
    found_piece: np.ndarray,
    found_at: np.ndarray,
    found_gap: np.ndarray,
) -> int:
    """Closest points of all probes whose gap is below a bound; see `find_contacts_planar`. `found_at` holds (s, y)."""
    weights, shift, local = np.empty((3, 4)), np.empty((5, 2)), np.empty((5, 2, 3))
    frames, surface = np.empty((3, 3, 3)), np.empty((5, 3))
    point, gap, normal = np.empty(3), np.empty(3), np.empty(3)
    count = 0
    for i in range(probe_body.shape[0]):
        if window[i, 0] >= window[i, 1]:
            continue
        _probe_point(poses, probe_body[i], place[i], frames[0], point)
        piece, nearest = -1, np.inf
        for j in range(window[i, 0], window[i, 1]):
            distance = _chord_distance(poses, owners, stations, j, point, frames[0])
            if distance < nearest:
                piece, nearest = j, distance
        s, y = 0.5, place[i, 1]
        for _ in range(40):
            _tables(s, y, stations[piece], weights, shift, local)
            _surface(poses, owners[piece, 0], owners[piece, 1], shift, local, frames, surface)
            for m in range(3):
                gap[m] = point[m] - surface[_S, m]
            r_s, r_y = _dot(gap, surface[_SS]), _dot(gap, surface[_SY])
            g_ss, g_sy, g_yy = (
                _dot(surface[_SS], surface[_SS]),
                _dot(surface[_SS], surface[_SY]),
                _dot(surface[_SY], surface[_SY]),
            )
            m_ss, m_sy = g_ss - _dot(gap, surface[_SSS]), g_sy - _dot(gap, surface[_SSY])
            if m_ss * g_yy - m_sy * m_sy < 0.1 * (g_ss * g_yy - g_sy * g_sy):
                m_ss, m_sy = g_ss, g_sy
            determinant = m_ss * g_yy - m_sy * m_sy
            step_s = min(0.5, max(-0.5, (g_yy * r_s - m_sy * r_y) / determinant))
            step_y = (m_ss * r_y - m_sy * r_s) / determinant
            y += step_y
            new = s + step_s
            if new > 1.0 and piece + 1 < window[i, 1]:
                piece, s = piece + 1, 0.0
                continue
            if new < 0.0 and piece > window[i, 0]:
                piece, s = piece - 1, 1.0
                continue
            s = min(stations[piece, 5] + 0.5, max(stations[piece, 4] - 0.5, new))
            if abs(step_s) < 1e-14 and abs(step_y) < 1e-14 * half_width[piece]:
                break
        if s < stations[piece, 4] - 1e-12 or s > stations[piece, 5] + 1e-12 or abs(y) > half_width[piece]:
            continue
        _cross(surface[_SS], surface[_SY], normal)
        length = np.sqrt(_dot(normal, normal))
        value = side[i] * _dot(normal, gap) / length - clearance[i]
        if value < below and value > -depth_limit[i]:
            found_probe[count] = i
            found_piece[count] = piece
            found_at[count, 0] = s
            found_at[count, 1] = y
            found_gap[count] = value
            count += 1
    return count


@kernel
def _variations(
    poses: np.ndarray,
    bodies: np.ndarray,
    place: np.ndarray,
    side: float,
    at: np.ndarray,
    stations: np.ndarray,
    weights: np.ndarray,
    shift: np.ndarray,
    local: np.ndarray,
    frames: np.ndarray,
    surface: np.ndarray,
    normal: np.ndarray,
    dual: np.ndarray,
    change: np.ndarray,
) -> float:
    """First variations at a closest point; returns the distance of the point from the surface along the normal.

    `normal` (3,), `dual` (2, 3) the contravariant base S^s, S^y, and `change` (5, 18, 3): d_i = d(p - S), dS_s, dS_y,
    dS_ss, dS_sy by every coordinate at fixed (s, y).
    """
    unit, turned, world = np.zeros(3), np.empty(3), np.empty(3)
    _tables(at[0], at[1], stations, weights, shift, local)
    _surface(poses, bodies[1], bodies[2], shift, local, frames, surface)
    fill_rotation(poses[bodies[0], 3:], frames[0])
    _cross(surface[_SS], surface[_SY], normal)
    length = side * np.sqrt(_dot(normal, normal))
    for m in range(3):
        normal[m] /= length
    g_ss, g_sy, g_yy = (
        _dot(surface[_SS], surface[_SS]),
        _dot(surface[_SS], surface[_SY]),
        _dot(surface[_SY], surface[_SY]),
    )
    determinant = g_ss * g_yy - g_sy * g_sy
    distance = 0.0
    for m in range(3):
        dual[0, m] = (g_yy * surface[_SS, m] - g_sy * surface[_SY, m]) / determinant
        dual[1, m] = (g_ss * surface[_SY, m] - g_sy * surface[_SS, m]) / determinant
        p = poses[bodies[0], m] + frames[0, m, 0] * place[0] + frames[0, m, 1] * place[1]
        distance += normal[m] * (p - surface[_S, m])
    change[:] = 0.0
    for j in range(3):
        unit[:] = 0.0
        unit[j] = 1.0
        change[0, j, j] = 1.0
        # e_j x (place, 0)
        turned[0] = -unit[2] * place[1]
        turned[1] = unit[2] * place[0]
        turned[2] = unit[0] * place[1] - unit[1] * place[0]
        _rotate(frames[0], turned, world)
        for m in range(3):
            change[0, 3 + j, m] = world[m]
        for k in range(2):
            first = 6 + 6 * k
            for row in range(5):
                sign = -1.0 if row == 0 else 1.0
                change[row, first + j, j] += sign * shift[row, k]
                _cross(unit, local[row, k], turned)
                _rotate(frames[1 + k], turned, world)
                for m in range(3):
                    change[row, first + 3 + j, m] += sign * world[m]
    return distance


@kernel
def measure_gap_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    count: int,
    found_probe: np.ndarray,
    found_piece: np.ndarray,
    found_at: np.ndarray,
    probe_body: np.ndarray,
    place: np.ndarray,
    side: np.ndarray,
    inset: np.ndarray,
    owners: np.ndarray,
    stations: np.ndarray,
    half_width: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rates and gradients of gap and slip of the contacts found.

    Returns
    -------
    bodies : (count, 3) int array
    rate : (count, 4) array, m/s
        Rate of the gap, and the slip velocity in inertial axes.
    gradient : (count, 4, 18) array
    """
    bodies = np.empty((count, 3), dtype=np.int64)
    rate = np.empty((count, 4))
    gradient = np.zeros((count, 4, 18))
    weights, shift, local = np.empty((3, 4)), np.empty((5, 2)), np.empty((5, 2, 3))
    frames, surface = np.empty((3, 3, 3)), np.empty((5, 3))
    normal, dual, change = np.empty(3), np.empty((2, 3)), np.empty((5, 18, 3))
    turned = np.empty(3)
    for i in range(count):
        probe, piece = found_probe[i], found_piece[i]
        bodies[i, 0] = probe_body[probe]
        bodies[i, 1] = owners[piece, 0]
        bodies[i, 2] = owners[piece, 1]
        distance = _variations(
            poses, bodies[i], place[probe], side[probe], found_at[i], stations[piece],
            weights, shift, local, frames, surface, normal, dual, change,
        )  # fmt: skip
        lever = distance - inset[probe]
        for m in range(18):
            along = _dot(normal, change[0, m])
            gradient[i, 0, m] = along
            tilt_s, tilt_y = _dot(normal, change[_SS, m]), _dot(normal, change[_SY, m])
            for c in range(3):
                gradient[i, 1 + c, m] = (
                    change[0, m, c] - normal[c] * along + lever * (dual[0, c] * tilt_s + dual[1, c] * tilt_y)
                )
        for j in range(3):
            _cross(frames[0][:, j], normal, turned)
            for c in range(3):
                gradient[i, 1 + c, 3 + j] -= inset[probe] * turned[c]
        for k in range(4):
            total = 0.0
            for b in range(3):
                for c in range(6):
                    total += gradient[i, k, 6 * b + c] * rates[bodies[i, b], c]
            rate[i, k] = total
    return bodies, rate, gradient


@kernel
def _second_variation(
    frame: np.ndarray, arm: np.ndarray, row: int, column: int, unit: np.ndarray, turned: np.ndarray, out: np.ndarray
) -> None:
    """A (e_column x (e_row x arm)): how the variation by rotation `row` changes with rotation `column` of a body."""
    unit[:] = 0.0
    unit[row] = 1.0
    _cross(unit, arm, turned)
    unit[row] = 0.0
    unit[column] = 1.0
    _cross(unit, turned, out)
    turned[0], turned[1], turned[2] = out[0], out[1], out[2]
    _rotate(frame, turned, out)


@kernel
def tangent_gap_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    count: int,
    bodies: np.ndarray,
    gradient: np.ndarray,
    rate: np.ndarray,
    found_probe: np.ndarray,
    found_piece: np.ndarray,
    found_at: np.ndarray,
    place: np.ndarray,
    side: np.ndarray,
    inset: np.ndarray,
    stations: np.ndarray,
    half_width: np.ndarray,
    normal_force: np.ndarray,
    effort: np.ndarray,
    slopes: np.ndarray,
    with_friction: bool,
    dof: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add K and D of the contacts found; arguments as in `tangent_gap_planar`, with slip and friction 3-vectors."""
    weights, shift, local = np.empty((3, 4)), np.empty((5, 2)), np.empty((5, 2, 3))
    frames, surface = np.empty((3, 3, 3)), np.empty((5, 3))
    normal, dual, change = np.empty(3), np.empty((2, 3)), np.empty((5, 18, 3))
    arm, unit, turned, second = np.zeros(3), np.empty(3), np.empty(3), np.empty(3)
    parameters, tilt = np.empty((2, 18)), np.empty((2, 18))
    normal_change, dual_change = np.empty((18, 3)), np.empty((2, 18, 3))
    base_change = np.empty((2, 18, 3))
    hessian, speed = np.empty((18, 18)), np.empty(18)
    slip_second = np.zeros((18, 18, 3))
    slip_x, response = np.empty(3), np.empty((3, 3))
    block_k, block_d = np.empty((18, 18)), np.empty((18, 18))
    for i in range(count):
        probe, piece = found_probe[i], found_piece[i]
        distance = _variations(
            poses, bodies[i], place[probe], side[probe], found_at[i], stations[piece],
            weights, shift, local, frames, surface, normal, dual, change,
        )  # fmt: skip
        for b in range(3):
            for c in range(6):
                speed[6 * b + c] = rates[bodies[i, b], c]
        m_ss = _dot(surface[_SS], surface[_SS]) - distance * _dot(normal, surface[_SSS])
        m_sy = _dot(surface[_SS], surface[_SY]) - distance * _dot(normal, surface[_SSY])
        m_yy = _dot(surface[_SY], surface[_SY])
        determinant = m_ss * m_yy - m_sy * m_sy
        for m in range(18):
            r_s = _dot(surface[_SS], change[0, m]) + distance * _dot(normal, change[_SS, m])
            r_y = _dot(surface[_SY], change[0, m]) + distance * _dot(normal, change[_SY, m])
            parameters[0, m] = (m_yy * r_s - m_sy * r_y) / determinant
            parameters[1, m] = (m_ss * r_y - m_sy * r_s) / determinant
            for c in range(3):
                base_change[0, m, c] = (
                    change[_SS, m, c]
                    + surface[_SSS, c] * parameters[0, m]
                    + surface[_SSY, c] * parameters[1, m]
                )
                base_change[1, m, c] = change[_SY, m, c] + surface[_SSY, c] * parameters[0, m]
            tilt[0, m] = _dot(normal, base_change[0, m])
            tilt[1, m] = _dot(normal, base_change[1, m])
            for c in range(3):
                normal_change[m, c] = -dual[0, c] * tilt[0, m] - dual[1, c] * tilt[1, m]
        for m in range(18):
            for n in range(18):
                hessian[m, n] = (
                    _dot(normal_change[n], change[0, m])
                    - _dot(normal, change[_SS, m]) * parameters[0, n]
                    - _dot(normal, change[_SY, m]) * parameters[1, n]
                )
        if with_friction:
            _slip_derivatives(
                surface, normal, dual, change, parameters, normal_change, base_change, gradient[i, 0],
                distance - inset[probe], inset[probe], frames, turned, dual_change, slip_second,
            )  # fmt: skip
        # second variations by rotations of one body
        for b in range(3):
            first = 6 * b + 3
            for row in range(3):
                for column in range(3):
                    if b == 0:
                        arm[0], arm[1], arm[2] = place[probe, 0], place[probe, 1], 0.0
                        _second_variation(frames[0], arm, row, column, unit, turned, second)
                        sign = 1.0
                    else:
                        _second_variation(frames[b], local[_S, b - 1], row, column, unit, turned, second)
                        sign = -1.0
                    along = _dot(normal, second)
                    hessian[first + row, first + column] += sign * along
                    if not with_friction:
                        continue
                    for c in range(3):
                        slip_second[first + row, first + column, c] += sign * (second[c] - normal[c] * along)
                    if b > 0:
                        lever = distance - inset[probe]
                        for a, table in ((0, _SS), (1, _SY)):
                            _second_variation(frames[b], local[table, b - 1], row, column, unit, turned, second)
                            along = _dot(normal, second)
                            for c in range(3):
                                slip_second[first + row, first + column, c] += lever * dual[a, c] * along
        by_depth, by_rate, ratio, slope = slopes[i, 0], slopes[i, 1], slopes[i, 2], slopes[i, 3]
        force = normal_force[i]
        square = rate[i, 1] ** 2 + rate[i, 2] ** 2 + rate[i, 3] ** 2
        for c in range(3):
            for e in range(3):
                response[c, e] = 0.0
                if square > 0.0:
                    response[c, e] = force * (slope - ratio) * rate[i, 1 + c] * rate[i, 1 + e] / square
            response[c, c] += force * ratio
        for n in range(18):
            gap_rate = 0.0
            for m in range(18):
                gap_rate += hessian[m, n] * speed[m]
            normal_x = -by_depth * gradient[i, 0, n] - by_rate * gap_rate
            normal_u = -by_rate * gradient[i, 0, n]
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
                friction_x = ratio * rate[i, 1 + c] * normal_x
                friction_u = ratio * rate[i, 1 + c] * normal_u
                for e in range(3):
                    friction_x += response[c, e] * slip_x[e]
                    friction_u += response[c, e] * gradient[i, 1 + e, n]
                for m in range(18):
                    block_k[m, n] += gradient[i, 1 + c, m] * friction_x + effort[i, 1 + c] * slip_second[m, n, c]
                    block_d[m, n] += gradient[i, 1 + c, m] * friction_u
        add_block(block_k, dof, bodies[i], indptr, indices, stiffness_data)
        add_block(block_d, dof, bodies[i], indptr, indices, damping_data)


@kernel
def _slip_derivatives(
    surface: np.ndarray,
    normal: np.ndarray,
    dual: np.ndarray,
    change: np.ndarray,
    parameters: np.ndarray,
    normal_change: np.ndarray,
    base_change: np.ndarray,
    gap_gradient: np.ndarray,
    lever: float,
    inset: float,
    frames: np.ndarray,
    turned: np.ndarray,
    dual_change: np.ndarray,
    out: np.ndarray,
) -> None:
    """Derivative (18, 18, 3) of the slip's gradient V_m by coordinate n, without the second variations by rotations.

    V_m = d_m - n (n.d_m) - inset (R_m x n) + lever S^a (n.dS_a,m)
    """
    for n in range(18):
        for a in range(2):
            for c in range(3):
                dual_change[a, n, c] = (
                    -_dot(dual[a], base_change[0, n]) * dual[0, c]
                    - _dot(dual[a], base_change[1, n]) * dual[1, c]
                    - _dot(dual[a], normal_change[n]) * normal[c]
                )
    for m in range(18):
        along = _dot(normal, change[0, m])
        tilt_s, tilt_y = _dot(normal, change[_SS, m]), _dot(normal, change[_SY, m])
        for n in range(18):
            ds, dy = parameters[0, n], parameters[1, n]
            # d_m changes by -dS_a,m a^a_n; n.dS_a,m by dn.dS_a,m + n.dS_ab,m a^b_n
            slide = (
                _dot(normal_change[n], change[0, m])
                - _dot(normal, change[_SS, m]) * ds
                - _dot(normal, change[_SY, m]) * dy
            )
            tilt_s_n = (
                _dot(normal_change[n], change[_SS, m])
                + _dot(normal, change[_SSS, m]) * ds
                + _dot(normal, change[_SSY, m]) * dy
            )
            tilt_y_n = _dot(normal_change[n], change[_SY, m]) + _dot(normal, change[_SSY, m]) * ds
            for c in range(3):
                moved = -change[_SS, m, c] * ds - change[_SY, m, c] * dy
                out[m, n, c] = (
                    moved
                    - normal_change[n, c] * along
                    - normal[c] * slide
                    + gap_gradient[n] * (dual[0, c] * tilt_s + dual[1, c] * tilt_y)
                    + lever
                    * (
                        dual_change[0, n, c] * tilt_s
                        + dual_change[1, n, c] * tilt_y
                        + dual[0, c] * tilt_s_n
                        + dual[1, c] * tilt_y_n
                    )
                )
    # R_m x n: the probe body's axes turn too, d(A e_m)/dtheta_n = A (e_n x e_m)
    axis = np.empty(3)
    for m in range(3):
        for n in range(18):
            _cross(frames[0][:, m], normal_change[n], turned)
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
            _cross(axis, normal, turned)
            for c in range(3):
                out[3 + m, 3 + n, c] -= inset * turned[c]


KERNELS = (window_probes_spatial, find_contacts_spatial, measure_gap_spatial, tangent_gap_spatial)
"""Broad phase, closest points, measure and tangent, in the order `ContactKernels` wants."""
