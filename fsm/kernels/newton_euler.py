"""Newton-Euler terms: gyroscopic moments, energies, reactions, and rates of quaternions with a stabilised norm.

    p' = 1/2 p (0, w) + 1/2 r (1 - p.p) p

The last term is zero for a unit quaternion, and returns a drifting norm to 1 with the rate r (1/s).
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot


@kernel
def add_gyroscopic(rates: np.ndarray, inertia: np.ndarray, force: np.ndarray) -> None:
    """Add the gyroscopic moments -w x J w to `force`; rates, inertia and force are (n_bodies, 6) arrays."""
    for i in range(rates.shape[0]):
        wx, wy, wz = rates[i, 3], rates[i, 4], rates[i, 5]
        jx, jy, jz = inertia[i, 3], inertia[i, 4], inertia[i, 5]
        force[i, 3] -= (jz - jy) * wy * wz
        force[i, 4] -= (jx - jz) * wz * wx
        force[i, 5] -= (jy - jx) * wx * wy


@kernel
def gyroscopic_damping(
    rates: np.ndarray,
    inertia: np.ndarray,
    dof: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add d(w x J w)/dw of all free bodies to the blocks of the damping matrix D."""
    for i in range(rates.shape[0]):
        slot = find_slot(indptr, indices, dof[i], dof[i])
        if slot < 0:
            continue
        wx, wy, wz = rates[i, 3], rates[i, 4], rates[i, 5]
        jx, jy, jz = inertia[i, 3], inertia[i, 4], inertia[i, 5]
        damping_data[slot, 3, 4] += (jz - jy) * wz
        damping_data[slot, 3, 5] += (jz - jy) * wy
        damping_data[slot, 4, 3] += (jx - jz) * wz
        damping_data[slot, 4, 5] += (jx - jz) * wx
        damping_data[slot, 5, 3] += (jy - jx) * wy
        damping_data[slot, 5, 4] += (jy - jx) * wx


@kernel
def support_reactions(force: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Reactions to `force` (n_bodies, 3 or 6) on the bodies without degrees of freedom; zero for the free bodies."""
    out = np.empty(force.shape)
    for i in range(force.shape[0]):
        for k in range(force.shape[1]):
            out[i, k] = -force[i, k]
    for i in range(free.shape[0]):
        for k in range(force.shape[1]):
            out[free[i], k] = 0.0
    return out


@kernel
def largest_force(wrenches: np.ndarray) -> float:
    """Largest force component in wrenches (n_bodies, 3 or 6), without moments."""
    largest = 0.0
    for i in range(wrenches.shape[0]):
        for k in range(3 if wrenches.shape[1] == 6 else 2):
            largest = max(largest, abs(wrenches[i, k]))
    return largest


@kernel
def largest_moment(wrenches: np.ndarray) -> float:
    """Largest moment component in wrenches (n_bodies, 3 or 6)."""
    largest = 0.0
    for i in range(wrenches.shape[0]):
        for k in range(3 if wrenches.shape[1] == 6 else 2, wrenches.shape[1]):
            largest = max(largest, abs(wrenches[i, k]))
    return largest


@kernel
def motion_energy(
    inertia: np.ndarray, rates: np.ndarray, wrenches: np.ndarray, driven: np.ndarray
) -> tuple[float, float, float]:
    """Kinetic energy (J) of all bodies, power (W) of the wrenches, and kinetic energy (J) of the driven bodies.

    Parameters
    ----------
    inertia, rates, wrenches : (n_bodies, 3 or 6) arrays
    driven : (n,) int array
        Driven bodies, which do not rotate.
    """
    kinetic = power = kinetic_driven = 0.0
    for i in range(rates.shape[0]):
        for k in range(rates.shape[1]):
            kinetic += 0.5 * inertia[i, k] * rates[i, k] ** 2
            power += wrenches[i, k] * rates[i, k]
    for i in range(driven.shape[0]):
        for k in range(rates.shape[1] // 2 + rates.shape[1] % 2):
            kinetic_driven += 0.5 * inertia[driven[i], 0] * rates[driven[i], k] ** 2
    return kinetic, power, kinetic_driven


@kernel
def drive_reactions(wrenches: np.ndarray, bodies: np.ndarray, motion: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Force of every drive along its direction, (n_motions,), N.

    Parameters
    ----------
    wrenches : (n_bodies, 3 or 6) array
    bodies, motion : (m,) int arrays
        Driven bodies, and the number of the motion of each.
    directions : (n_motions, 2 or 3) array
    """
    out = np.zeros(directions.shape[0])
    for i in range(bodies.shape[0]):
        for k in range(directions.shape[1]):
            out[motion[i]] += wrenches[bodies[i], k] * directions[motion[i], k]
    return out


@kernel
def quaternion_rates(poses: np.ndarray, rates: np.ndarray, norm_rate: float) -> np.ndarray:
    """Rates of position and quaternion, (n, 7), from poses (n, 7), velocities (n, 6), and the rate of the norm (1/s)."""
    out = np.empty(poses.shape)
    for i in range(poses.shape[0]):
        w, x, y, z = poses[i, 3], poses[i, 4], poses[i, 5], poses[i, 6]
        a, b, c = rates[i, 3], rates[i, 4], rates[i, 5]
        correction = 0.5 * norm_rate * (1.0 - w * w - x * x - y * y - z * z)
        out[i, 0] = rates[i, 0]
        out[i, 1] = rates[i, 1]
        out[i, 2] = rates[i, 2]
        out[i, 3] = 0.5 * (-x * a - y * b - z * c) + correction * w
        out[i, 4] = 0.5 * (w * a + y * c - z * b) + correction * x
        out[i, 5] = 0.5 * (w * b + z * a - x * c) + correction * y
        out[i, 6] = 0.5 * (w * c + x * b - y * a) + correction * z
    return out


@kernel
def quaternion_jacobian(poses: np.ndarray, rates: np.ndarray, norm_rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of `quaternion_rates` with respect to poses, (n, 7, 7), and to rates, (n, 7, 6)."""
    count = poses.shape[0]
    by_pose = np.zeros((count, 7, 7))
    by_rate = np.zeros((count, 7, 6))
    for i in range(count):
        p = poses[i, 3:]
        w, x, y, z = p[0], p[1], p[2], p[3]
        a, b, c = rates[i, 3], rates[i, 4], rates[i, 5]
        excess = 1.0 - w * w - x * x - y * y - z * z
        m = by_pose[i, 3:, 3:]
        m[0, 1], m[0, 2], m[0, 3] = -0.5 * a, -0.5 * b, -0.5 * c
        m[1, 0], m[1, 2], m[1, 3] = 0.5 * a, 0.5 * c, -0.5 * b
        m[2, 0], m[2, 1], m[2, 3] = 0.5 * b, -0.5 * c, 0.5 * a
        m[3, 0], m[3, 1], m[3, 2] = 0.5 * c, 0.5 * b, -0.5 * a
        for j in range(4):
            m[j, j] += 0.5 * norm_rate * excess
            for k in range(4):
                m[j, k] -= norm_rate * p[j] * p[k]
        for j in range(3):
            by_rate[i, j, j] = 1.0
        by_rate[i, 3, 3], by_rate[i, 3, 4], by_rate[i, 3, 5] = -0.5 * x, -0.5 * y, -0.5 * z
        by_rate[i, 4, 3], by_rate[i, 4, 4], by_rate[i, 4, 5] = 0.5 * w, -0.5 * z, 0.5 * y
        by_rate[i, 5, 3], by_rate[i, 5, 4], by_rate[i, 5, 5] = 0.5 * z, 0.5 * w, -0.5 * x
        by_rate[i, 6, 3], by_rate[i, 6, 4], by_rate[i, 6, 5] = -0.5 * y, 0.5 * x, 0.5 * w
    return by_pose, by_rate


@kernel
def tangent_from_quaternion(poses: np.ndarray) -> np.ndarray:
    """Derivatives d(tangent increment)/d(pose), (n, 6, 7): dtheta = 2 conj(p) dp / p.p without the radial part of dp."""
    count = poses.shape[0]
    out = np.zeros((count, 6, 7))
    for i in range(count):
        w, x, y, z = poses[i, 3], poses[i, 4], poses[i, 5], poses[i, 6]
        factor = 2.0 / (w * w + x * x + y * y + z * z)
        for j in range(3):
            out[i, j, j] = 1.0
        out[i, 3, 3], out[i, 3, 4], out[i, 3, 5], out[i, 3, 6] = -factor * x, factor * w, factor * z, -factor * y
        out[i, 4, 3], out[i, 4, 4], out[i, 4, 5], out[i, 4, 6] = -factor * y, -factor * z, factor * w, factor * x
        out[i, 5, 3], out[i, 5, 4], out[i, 5, 5], out[i, 5, 6] = -factor * z, factor * y, -factor * x, factor * w
    return out
