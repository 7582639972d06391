"""Rates of positions and quaternions."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.newton_euler import quaternion_rates


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
