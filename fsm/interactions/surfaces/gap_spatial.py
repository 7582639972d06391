"""Gap between a probe point of one panel and the surface of another, in space.

    g = n . (p - S(s, y)) - clearance,     (p - S) . S_a = 0  for a = s, y

The surface is ruled: y e2 is added to the control points of the curve of `fsm.interactions.surfaces.surface`. With d_i the
variation of p - S by coordinate i at fixed (s, y), m_ab = S_a.S_b - distance n.S_ab and S^a the contravariant base,

    a_i = m^-1 (S_a.d_i + distance n.dS_a,i),   dn_i = -S^a B_a,i,   B_a,i = n.(dS_a,i + S_ab a^b_i),   dg_i = n.d_i

Slip is the tangential relative velocity of the two bodies' material at one point, x_c = p - inset n. Tips are rounded as in
`gap_planar`. In a plane motion both formulations are identical. Points beyond the sides |y| > width/2 have no contact.

Coordinates of a contact: (dr, dtheta) of the probe's body, then of the piece's bodies a and b; dtheta in body axes.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import FoundPoints
from fsm.interactions.search.control_points import ROW, ROW_S, ROW_SS, ROW_SY, ROW_Y
from fsm.interactions.surfaces.surface import blend, overshoot
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.vector import cross, dot


@kernel
def _tables(
    s: float, y: float, stations: np.ndarray, weights: np.ndarray, shift: np.ndarray, local: np.ndarray
) -> None:
    """Coefficients of S and its derivatives in the poses of both bodies: D = sum_k shift[D, k] r_k + A_k local[D, k].

    Rows: S, S_s, S_y, S_ss, S_sy; `shift` (5, 2), `local` (5, 2, 3).
    """
    blend(s, stations, weights)
    local[:] = 0.0
    for k in range(2):
        for row, order in ((ROW, 0), (ROW_S, 1), (ROW_SS, 2)):
            shift[row, k] = weights[order, 2 * k]
            local[row, k, 0] = weights[order, 2 * k + 1]
            local[row, k, 1] = weights[order, 2 * k] * y
        shift[ROW_Y, k] = 0.0
        shift[ROW_SY, k] = 0.0
        local[ROW_Y, k, 1] = weights[0, 2 * k]
        local[ROW_SY, k, 1] = weights[1, 2 * k]


@kernel
def _surface(
    poses: np.ndarray, a: int, b: int, shift: np.ndarray, local: np.ndarray, frames: np.ndarray, out: np.ndarray
) -> None:
    """Evaluate S, S_s, S_y, S_ss, S_sy into the rows of `out` (5, 3), and A_a and A_b into rows 1 and 2 of `frames`."""
    fill_rotation(poses[a, 3:], frames[1])
    fill_rotation(poses[b, 3:], frames[2])
    for row in range(5):
        for i in range(3):
            total = shift[row, 0] * poses[a, i] + shift[row, 1] * poses[b, i]
            for j in range(2):
                total += frames[1, i, j] * local[row, 0, j] + frames[2, i, j] * local[row, 1, j]
            out[row, i] = total


@kernel
def variations(
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
    """Compute the first variations at a closest point; return the distance from the surface along the normal, m.

    `normal` (3,), `dual` (2, 3) the contravariant base S^s, S^y, and `change` (5, 18, 3): d_i = d(p - S), dS_s, dS_y,
    dS_ss, dS_sy by every coordinate at fixed (s, y).
    """
    _tables(at[0], at[1], stations, weights, shift, local)
    _surface(poses, bodies[1], bodies[2], shift, local, frames, surface)
    fill_rotation(poses[bodies[0], 3:], frames[0])
    cross(surface[ROW_S], surface[ROW_Y], normal)
    length = side * np.sqrt(dot(normal, normal))
    for m in range(3):
        normal[m] /= length
    g_ss, g_sy, g_yy = (
        dot(surface[ROW_S], surface[ROW_S]),
        dot(surface[ROW_S], surface[ROW_Y]),
        dot(surface[ROW_Y], surface[ROW_Y]),
    )
    determinant = g_ss * g_yy - g_sy * g_sy
    distance = 0.0
    for m in range(3):
        dual[0, m] = (g_yy * surface[ROW_S, m] - g_sy * surface[ROW_Y, m]) / determinant
        dual[1, m] = (g_ss * surface[ROW_Y, m] - g_sy * surface[ROW_S, m]) / determinant
        p = poses[bodies[0], m] + frames[0, m, 0] * place[0] + frames[0, m, 1] * place[1]
        distance += normal[m] * (p - surface[ROW, m])
    change[:] = 0.0
    _set_variations(change[0], 0, 1.0, 1.0, frames[0], place[0], place[1])
    for k in range(2):
        for row in range(5):
            sign = -1.0 if row == 0 else 1.0
            x, y = local[row, k, 0], local[row, k, 1]
            _set_variations(change[row], 6 + 6 * k, sign, shift[row, k], frames[1 + k], x, y)
    return distance


@kernel
def _set_variations(
    out: np.ndarray, first: int, sign: float, shift: float, frame: np.ndarray, x: float, y: float
) -> None:
    """Write the variations of `shift` r + A (x, y, 0) by the coordinates of a body to the rows of `out` from `first` on."""
    for m in range(3):
        out[first + m, m] = sign * shift
        out[first + 3, m] = sign * y * frame[m, 2]
        out[first + 4, m] = -sign * x * frame[m, 2]
        out[first + 5, m] = sign * (x * frame[m, 1] - y * frame[m, 0])


@kernel
def write_gap_spatial(
    poses: np.ndarray, rates: np.ndarray, found: FoundPoints, probe_body: np.ndarray, place: np.ndarray,
    straight: np.ndarray, clearance: np.ndarray, inset: np.ndarray, owners: np.ndarray, stations: np.ndarray,
    bodies: np.ndarray, rate: np.ndarray, gradient: np.ndarray,
) -> None:  # fmt: skip
    """Write bodies (count, 3), rates (count, 4), m/s, of the gap and the slip velocity in inertial axes, and gradients
    (count, 4, 18).
    """
    found_probe, found_piece, found_side, found_at = found
    weights, shift, local = np.empty((3, 4)), np.empty((5, 2)), np.empty((5, 2, 3))
    frames, surface = np.empty((3, 3, 3)), np.empty((5, 3))
    normal, dual, change = np.empty(3), np.empty((2, 3)), np.empty((5, 18, 3))
    turned = np.empty(3)
    for i in range(found_probe.shape[0]):
        probe, piece = found_probe[i], found_piece[i]
        bodies[i, 0] = probe_body[probe]
        bodies[i, 1] = owners[piece, 0]
        bodies[i, 2] = owners[piece, 1]
        distance = variations(
            poses, bodies[i], place[probe], found_side[i], found_at[i], stations[piece],
            weights, shift, local, frames, surface, normal, dual, change,
        )  # fmt: skip
        lever = distance - inset[probe]
        length = np.sqrt(dot(surface[ROW_S], surface[ROW_S]))
        over, radius = overshoot(found_at[i, 0], stations[piece], length, straight[probe], clearance[probe])
        height = distance - clearance[probe] + radius
        far = np.hypot(over, height)
        for m in range(18):
            along = dot(normal, change[0, m])
            gradient[i, 0, m] = along
            if over != 0.0:
                sliding = dot(surface[ROW_S], change[0, m]) + distance * dot(normal, change[ROW_S, m])
                gradient[i, 0, m] = (over * sliding / length + height * along) / far
            tilt_s, tilt_y = dot(normal, change[ROW_S, m]), dot(normal, change[ROW_Y, m])
            for c in range(3):
                gradient[i, 1 + c, m] = (
                    change[0, m, c] - normal[c] * along + lever * (dual[0, c] * tilt_s + dual[1, c] * tilt_y)
                )
        for j in range(3):
            cross(frames[0][:, j], normal, turned)
            for c in range(3):
                gradient[i, 1 + c, 3 + j] -= inset[probe] * turned[c]
        for k in range(4):
            total = 0.0
            for b in range(3):
                for c in range(6):
                    total += gradient[i, k, 6 * b + c] * rates[bodies[i, b], c]
            rate[i, k] = total
