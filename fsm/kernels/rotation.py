"""Unit quaternions, scalar first, and rotation matrices. A(p) maps body components to inertial ones.

Rates of positions and quaternions.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.newton_euler import quaternion_rates


@kernel(inline=True)
def fill_rotation(p: np.ndarray, out: np.ndarray) -> None:
    """Write the rotation matrix of a unit quaternion into `out` (3, 3)."""
    w, x, y, z = p[0], p[1], p[2], p[3]
    out[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    out[0, 1] = 2.0 * (x * y - w * z)
    out[0, 2] = 2.0 * (x * z + w * y)
    out[1, 0] = 2.0 * (x * y + w * z)
    out[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    out[1, 2] = 2.0 * (y * z - w * x)
    out[2, 0] = 2.0 * (x * z - w * y)
    out[2, 1] = 2.0 * (y * z + w * x)
    out[2, 2] = 1.0 - 2.0 * (x * x + y * y)


def rotation_matrix(p: np.ndarray) -> np.ndarray:
    """Rotation matrix (3, 3) of a quaternion of any norm."""
    w, x, y, z = np.asarray(p, dtype=float) / np.linalg.norm(p)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def multiply(p: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Quaternion product p r; arrays (..., 4)."""
    p, r = np.asarray(p, dtype=float), np.asarray(r, dtype=float)
    p0, p1, p2, p3 = p[..., 0], p[..., 1], p[..., 2], p[..., 3]
    r0, r1, r2, r3 = r[..., 0], r[..., 1], r[..., 2], r[..., 3]
    out = np.empty(np.broadcast(p, r).shape)  # np.stack takes several times as long for one quaternion
    out[..., 0] = p0 * r0 - p1 * r1 - p2 * r2 - p3 * r3
    out[..., 1] = p0 * r1 + p1 * r0 + p2 * r3 - p3 * r2
    out[..., 2] = p0 * r2 - p1 * r3 + p2 * r0 + p3 * r1
    out[..., 3] = p0 * r3 + p1 * r2 - p2 * r1 + p3 * r0
    return out


def exponential(vector: np.ndarray) -> np.ndarray:
    """Quaternion of a rotation vector (..., 3), rad."""
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    # np.sinc(x) = sin(pi x)/(pi x); the factor is sin(angle/2)/angle, also at zero
    return np.concatenate([np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * vector], axis=-1)


def rotate_by(p: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) rotated by unit quaternions (..., 4)."""
    axis = p[..., 1:]
    across = _cross(axis, vector)
    return vector + 2.0 * (p[..., :1] * across + _cross(axis, across))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of arrays (..., 3); for a few vectors ten times faster than `np.cross`."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    out = np.empty(np.broadcast(a, b).shape)
    out[..., 0], out[..., 1], out[..., 2] = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    return out


@kernel
def fill_inverse_tangent(x: float, y: float, z: float, out: np.ndarray) -> None:
    """Write the inverse tangent map T^-1 of a rotation vector v into `out` (3, 3): log(exp(v) exp(d)) = v + T^-1(v) d for a
    small rotation d.

    T^-1(v) = I + 1/2 [v] + (1 - a/2 cot(a/2))/a^2 [v]^2 with a = |v|       (Arnold and Bruls 2007, in body axes)
    """
    square = x * x + y * y + z * z
    half = 0.5 * np.sqrt(square)
    factor = (1.0 - half / np.tan(half)) / square if half > 1e-3 else 1.0 / 12.0 + square / 720.0
    out[0, 0] = 1.0 - factor * (y * y + z * z)
    out[1, 1] = 1.0 - factor * (x * x + z * z)
    out[2, 2] = 1.0 - factor * (x * x + y * y)
    out[0, 1], out[1, 0] = factor * x * y - 0.5 * z, factor * x * y + 0.5 * z
    out[0, 2], out[2, 0] = factor * x * z + 0.5 * y, factor * x * z - 0.5 * y
    out[1, 2], out[2, 1] = factor * y * z - 0.5 * x, factor * y * z + 0.5 * x


@kernel
def pose_rates(q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Rates (nq,) of a configuration: of poses (n * 7,) with velocities (n * 6,), angular velocities in body axes; else u.

    The rate of a quaternion p is p (0, omega)/2. It is linear in p, so p need not have the length 1.
    """
    if q.shape[0] == u.shape[0]:
        return u.copy()
    return quaternion_rates(q.reshape(-1, 7), u.reshape(-1, 6), 0.0).reshape(-1)


@kernel
def with_unit_quaternions(q: np.ndarray, size: int) -> None:
    """Normalise the quaternions of poses (n * 7,) for `size` velocities, in place; other configurations stay."""
    if q.shape[0] == size:
        return
    for i in range(q.shape[0] // 7):
        a = 7 * i + 3
        norm = np.sqrt(q[a] ** 2 + q[a + 1] ** 2 + q[a + 2] ** 2 + q[a + 3] ** 2)
        for k in range(4):
            q[a + k] /= norm


@kernel
def increments_of_rates(q: np.ndarray, rates: np.ndarray, size: int) -> np.ndarray:
    """Small increments (size,), see `retract_poses`, of small changes (nq,) of positions and quaternions."""
    out = np.empty(size)
    if q.shape[0] == size:
        for i in range(size):
            out[i] = rates[i]
        return out
    for i in range(q.shape[0] // 7):
        a, b = 7 * i, 6 * i
        for k in range(3):
            out[b + k] = rates[a + k]
        p, r, s, t = q[a + 3], q[a + 4], q[a + 5], q[a + 6]
        w, x, y, z = rates[a + 3], rates[a + 4], rates[a + 5], rates[a + 6]
        out[b + 3] = 2.0 * (p * x - r * w - s * z + t * y)
        out[b + 4] = 2.0 * (p * y + r * z - s * w - t * x)
        out[b + 5] = 2.0 * (p * z - r * y + s * x - t * w)
    return out
