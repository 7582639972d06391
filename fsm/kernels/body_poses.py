"""Poses and rates of all bodies from the coordinates of the free bodies, and increments of poses in space."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_inverse_tangent, fill_rotation


@kernel
def scatter_free(free: np.ndarray, values: np.ndarray, unit: bool, out: np.ndarray) -> None:
    """Write coordinates (n_free * size,) into the rows of the free bodies of `out` (n_bodies, size).

    With `unit`, the last four numbers of a row are a quaternion, which is normalised.
    """
    size = out.shape[1]
    for i in range(free.shape[0]):
        row = free[i]
        for k in range(size):
            out[row, k] = values[i * size + k]
        if unit:
            total = 0.0
            for k in range(3, 7):
                total += out[row, k] * out[row, k]
            norm = np.sqrt(total)
            for k in range(3, 7):
                out[row, k] /= norm


@kernel
def shift_body(out: np.ndarray, body: int, direction: np.ndarray, distance: float) -> None:
    """Add `distance` along a direction (n,) to one row of `out`."""
    for k in range(direction.shape[0]):
        out[body, k] += distance * direction[k]


@kernel
def place_bodies(
    start: np.ndarray,
    free: np.ndarray,
    values: np.ndarray,
    unit: bool,
    driven: np.ndarray,
    motion: np.ndarray,
    directions: np.ndarray,
    sizes: np.ndarray,
) -> np.ndarray:
    """Poses or rates of all bodies, (n_bodies, size).

    Parameters
    ----------
    start : (n_bodies, size) array
        Initial poses or rates; those of the bodies without degrees of freedom are used.
    free, values, unit : free bodies and their coordinates, see `scatter_free`
    driven, motion : (m,) int arrays
        Driven bodies, and the number of the motion of each.
    directions : (n_motions, 2 or 3) array
    sizes : (n_motions,) array
        Travel or velocity of every motion.
    """
    out = np.empty(start.shape)
    for i in range(start.shape[0]):
        for k in range(start.shape[1]):
            out[i, k] = start[i, k]
    scatter_free(free, values, unit, out)
    for i in range(driven.shape[0]):
        shift_body(out, driven[i], directions[motion[i]], sizes[motion[i]])
    return out


@kernel
def place_corners(poses: np.ndarray, bodies: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Corners (n, 4, 3) of outlines of bodies (n,) from those in body axes (n, 4, 3), m."""
    out, frame = np.empty(local.shape), np.zeros((3, 3))
    for i in range(local.shape[0]):
        pose = poses[bodies[i]]
        if pose.shape[0] == 7:
            x, y, z = pose[0], pose[1], pose[2]
            fill_rotation(pose[3:], frame)
        else:
            x, y, z = pose[0], 0.0, pose[1]
            cosine, sine = np.cos(pose[2]), np.sin(pose[2])
            frame[0, 0], frame[0, 2], frame[1, 1], frame[2, 0], frame[2, 2] = cosine, sine, 1.0, -sine, cosine
        for k in range(local.shape[1]):
            a, b, c = local[i, k, 0], local[i, k, 1], local[i, k, 2]
            out[i, k, 0] = x + frame[0, 0] * a + frame[0, 1] * b + frame[0, 2] * c
            out[i, k, 1] = y + frame[1, 0] * a + frame[1, 1] * b + frame[1, 2] * c
            out[i, k, 2] = z + frame[2, 0] * a + frame[2, 1] * b + frame[2, 2] * c
    return out


@kernel
def gather_free(free: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Concatenated rows of the free bodies of `values` (n_bodies, size), (n_free * size,)."""
    size = values.shape[1]
    out = np.empty(free.shape[0] * size)
    for i in range(free.shape[0]):
        for k in range(size):
            out[i * size + k] = values[free[i], k]
    return out


@kernel
def retract_poses(q: np.ndarray, dx: np.ndarray) -> np.ndarray:
    """Positions and unit quaternions (n * 7,) after increments (n * 6,), with rotation vectors in body axes."""
    out = np.empty(q.shape[0])
    for i in range(q.shape[0] // 7):
        a, b = 7 * i, 6 * i
        for k in range(3):
            out[a + k] = q[a + k] + dx[b + k]
        x, y, z = dx[b + 3], dx[b + 4], dx[b + 5]
        half = 0.5 * np.sqrt(x * x + y * y + z * z)
        # this is sin(half)/(2 half), with a series for small angles
        factor = 0.5 * np.sin(half) / half if half > 1e-4 else 0.5 - half * half / 12.0
        w, x, y, z = np.cos(half), factor * x, factor * y, factor * z
        p, r, s, t = q[a + 3], q[a + 4], q[a + 5], q[a + 6]
        n0 = p * w - r * x - s * y - t * z
        n1 = p * x + r * w + s * z - t * y
        n2 = p * y - r * z + s * w + t * x
        n3 = p * z + r * y - s * x + t * w
        norm = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2 + n3 * n3)
        out[a + 3], out[a + 4], out[a + 5], out[a + 6] = n0 / norm, n1 / norm, n2 / norm, n3 / norm
    return out


@kernel
def pose_difference(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Increments (n * 6,) between poses (n * 7,), the inverse of `retract_poses`; rotations are at most pi."""
    count = start.shape[0] // 7
    out = np.empty(6 * count)
    for i in range(count):
        a, b = 7 * i, 6 * i
        for k in range(3):
            out[b + k] = end[a + k] - start[a + k]
        p, r, s, t = start[a + 3], -start[a + 4], -start[a + 5], -start[a + 6]
        w, x, y, z = end[a + 3], end[a + 4], end[a + 5], end[a + 6]
        n0 = p * w - r * x - s * y - t * z
        n1 = p * x + r * w + s * z - t * y
        n2 = p * y - r * z + s * w + t * x
        n3 = p * z + r * y - s * x + t * w
        if n0 < 0.0:
            n0, n1, n2, n3 = -n0, -n1, -n2, -n3
        sine = np.sqrt(n1 * n1 + n2 * n2 + n3 * n3)
        factor = 2.0 * np.arctan2(sine, n0) / sine if sine > 1e-12 else 2.0 / n0
        out[b + 3], out[b + 4], out[b + 5] = factor * n1, factor * n2, factor * n3
    return out


@kernel
def increment_blocks(dx: np.ndarray) -> np.ndarray:
    """Derivatives (n, 6, 6) of increments dx (6 n,) with respect to a later small increment; see `System.increment_map`."""
    count = dx.shape[0] // 6
    out = np.zeros((count, 6, 6))
    for i in range(count):
        for k in range(3):
            out[i, k, k] = 1.0
        fill_inverse_tangent(dx[6 * i + 3], dx[6 * i + 4], dx[6 * i + 5], out[i, 3:, 3:])
    return out
