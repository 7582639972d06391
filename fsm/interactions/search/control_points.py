"""Control points of surfaces (`fsm.interactions.surfaces.surface`) in inertial axes, for the contact search.

In the plane piece j is C(s) = sum_k B_k(s) P_k; in space S(s, y) = sum_k B_k(s) (P_k + y e2_k). P_0, P_1 and their e2 belong
to body a; P_2, P_3 and their e2 belong to body b. The gap modules compute derivatives with
respect to the bodies' coordinates.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation

# rows of the tables of surface derivatives
ROW, ROW_S, ROW_Y, ROW_SS, ROW_SY = 0, 1, 2, 3, 4


@kernel
def turned_planar(poses: np.ndarray) -> np.ndarray:
    """Axes e1 of all bodies, (n, 2)."""
    axes = np.empty((poses.shape[0], 2))
    for b in range(poses.shape[0]):
        axes[b, 0], axes[b, 1] = np.cos(poses[b, 2]), -np.sin(poses[b, 2])
    return axes


@kernel
def turned_spatial(poses: np.ndarray) -> np.ndarray:
    """Axes e1 and e2 of all bodies, (n, 2, 3)."""
    axes, frame = np.empty((poses.shape[0], 2, 3)), np.empty((3, 3))
    for b in range(poses.shape[0]):
        fill_rotation(poses[b, 3:], frame)
        for m in range(3):
            axes[b, 0, m], axes[b, 1, m] = frame[m, 0], frame[m, 1]
    return axes


@kernel(inline=True)
def point_planar(poses: np.ndarray, axes: np.ndarray, body: int, x: float, out: np.ndarray) -> None:
    """Position of a point of a body into `out` (2,), m."""
    out[0] = poses[body, 0] + axes[body, 0] * x
    out[1] = poses[body, 1] + axes[body, 1] * x


@kernel(inline=True)
def point_spatial(poses: np.ndarray, axes: np.ndarray, body: int, place: np.ndarray, out: np.ndarray) -> None:
    """Position of a point (x, y) of a body into `out` (3,), m."""
    for m in range(3):
        out[m] = poses[body, m] + axes[body, 0, m] * place[0] + axes[body, 1, m] * place[1]


@kernel
def control_points_planar(
    poses: np.ndarray, axes: np.ndarray, owners: np.ndarray, stations: np.ndarray
) -> np.ndarray:
    """Control points of all pieces, (n_pieces, 4, 2), m; `axes` from `turned_planar`."""
    out = np.empty((owners.shape[0], 4, 2))
    for j in range(owners.shape[0]):
        for k in range(4):
            body = owners[j, k // 2]
            for m in range(2):
                out[j, k, m] = poses[body, m] + axes[body, m] * stations[j, k]
    return out


@kernel
def control_points_spatial(
    poses: np.ndarray, axes: np.ndarray, owners: np.ndarray, stations: np.ndarray
) -> np.ndarray:
    """Control points (m) of all pieces in rows 0 to 3, and e2 of both bodies in rows 4 and 5, (n_pieces, 6, 3)."""
    out = np.empty((owners.shape[0], 6, 3))
    for j in range(owners.shape[0]):
        for m in range(3):
            for k in range(4):
                body = owners[j, k // 2]
                out[j, k, m] = poses[body, m] + axes[body, 0, m] * stations[j, k]
            out[j, 4, m], out[j, 5, m] = axes[owners[j, 0], 1, m], axes[owners[j, 1], 1, m]
    return out


@kernel(inline=True)
def curve_at(s: float, controls: np.ndarray, piece: int, out: np.ndarray) -> None:
    """Evaluate C, C_s, C_ss of a piece into the rows of `out` (3, D), m."""
    r = 1.0 - s
    b0, b1, b2, b3 = r * r * r, 3.0 * s * r * r, 3.0 * s * s * r, s * s * s
    d0, d1, d2 = 3.0 * r * r, 6.0 * s * r, 3.0 * s * s
    for m in range(out.shape[1]):
        p0, p1, p2, p3 = controls[piece, 0, m], controls[piece, 1, m], controls[piece, 2, m], controls[piece, 3, m]
        first, middle, last = p1 - p0, p2 - p1, p3 - p2
        out[0, m] = b0 * p0 + b1 * p1 + b2 * p2 + b3 * p3
        out[1, m] = d0 * first + d1 * middle + d2 * last
        out[2, m] = 6.0 * (r * (middle - first) + s * (last - middle))


@kernel(inline=True)
def surface_at(s: float, y: float, controls: np.ndarray, piece: int, curve: np.ndarray, out: np.ndarray) -> None:
    """Evaluate S, S_s, S_y, S_ss, S_sy of a piece into the rows of `out` (5, 3); `curve` (3, 3) is scratch."""
    curve_at(s, controls, piece, curve)
    weight, slope, bend = s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s), 6.0 - 12.0 * s
    for m in range(3):
        across, turn = controls[piece, 4, m], controls[piece, 5, m] - controls[piece, 4, m]
        out[ROW_Y, m] = across + weight * turn
        out[ROW_SY, m] = slope * turn
        out[ROW, m] = curve[0, m] + y * out[ROW_Y, m]
        out[ROW_S, m] = curve[1, m] + y * slope * turn
        out[ROW_SS, m] = curve[2, m] + y * bend * turn
