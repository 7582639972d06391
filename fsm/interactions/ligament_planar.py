"""Ligaments between two bodies in the plane: deformations, linear law and assembly in one loop.

The chord d = p_a - p_b runs from P- on the outer body b to P+ on the inner body a. In the stress-free state it has the
length l and the direction of the given scene. The deformations are symmetric in both bodies:

    x1 = |d| - l ,      x3 = l (alpha - (phi_a + phi_b)/2 - gamma_0) ,      psi = phi_a - phi_b + psi_0

alpha is the angle of the chord, d = |d| (cos alpha, -sin alpha). The law is e = k (x - x0) + c x' with x0 = 0.

The chord of a bent beam is shorter than the beam. A ligament whose `bent` length is b = l, and not 0, is such a beam, and

    x1 = |d| - l + b (gamma^2/10 + psi^2/24) ,      gamma = x3/l .

This is the difference between the lengths of a beam with a cubic deflection and of its chord, to second order.

With n = d/|d|, w = (n_z, -n_x), the arms s_a, s_b of the two points, and W s = (s_z, -s_x),

    D = d(d)/dx = (I, W s_a, -I, -W s_b)                             coordinates (x, z, phi) of a, then of b
    d|d|/dx = n.D          d2|d| = D^T w w^T D / |d| + n.dD
    dalpha/dx = w.D/|d|    d2alpha = -D^T (w n^T + n w^T) D / |d|^2 + w.dD/|d|

where v.dD has the entries -v.s_a at (phi_a, phi_a) and v.s_b at (phi_b, phi_b).
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import BlockIndex
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_block

_STIFFNESS, _DAMPING, _BENT = 7, 10, 13


def ligament_constants_planar(
    poses: np.ndarray,
    bodies: np.ndarray,
    point_inner: np.ndarray,
    point_outer: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
    bends: np.ndarray,
) -> np.ndarray:
    """Constants (m, 14) of all ligaments for the kernels; the given poses are the stress-free state.

    Columns: inner point (2), outer point (2), l, gamma_0, psi_0, k and c of (x1, x3, psi), and b, which is l where `bends`
    (m,) is true and 0 elsewhere.
    """
    ends = []
    for point, body in ((point_inner, bodies[:, 0]), (point_outer, bodies[:, 1])):
        cosine, sine = np.cos(poses[body, 2]), np.sin(poses[body, 2])
        x = poses[body, 0] + cosine * point[:, 0] + sine * point[:, 1]
        ends.append((x, poses[body, 1] - sine * point[:, 0] + cosine * point[:, 1]))
    dx, dz = ends[0][0] - ends[1][0], ends[0][1] - ends[1][1]
    inner, outer = poses[bodies[:, 0], 2], poses[bodies[:, 1], 2]
    gamma = np.arctan2(-dz, dx) - 0.5 * (inner + outer)
    length = np.hypot(dx, dz)
    bent = np.where(bends, length, 0.0)
    return np.column_stack([point_inner, point_outer, length, gamma, outer - inner, stiffness, damping, bent])


@kernel(inline=True)
def _chord(poses: np.ndarray, a: int, b: int, row: np.ndarray) -> tuple[float, float, float, float, float, float]:
    """Arms s_a and s_b, and d."""
    ca, sa = np.cos(poses[a, 2]), np.sin(poses[a, 2])
    cb, sb = np.cos(poses[b, 2]), np.sin(poses[b, 2])
    ax, az = ca * row[0] + sa * row[1], ca * row[1] - sa * row[0]
    bx, bz = cb * row[2] + sb * row[3], cb * row[3] - sb * row[2]
    return ax, az, bx, bz, poses[a, 0] + ax - poses[b, 0] - bx, poses[a, 1] + az - poses[b, 1] - bz


@kernel
def _measure(
    poses: np.ndarray, a: int, b: int, row: np.ndarray, value: np.ndarray, gradient: np.ndarray
) -> tuple[float, float, float, float, float, float, float]:
    """Compute deformations (3,) and gradients (3, 6) of a straight ligament in place; return s_a, s_b, n and |d|."""
    ax, az, bx, bz, dx, dz = _chord(poses, a, b, row)
    length = np.hypot(dx, dz)
    nx, nz = dx / length, dz / length
    shear = np.arctan2(-dz, dx) - 0.5 * (poses[a, 2] + poses[b, 2]) - row[5]
    value[0] = length - row[4]
    value[1] = row[4] * (shear - 2.0 * np.pi * np.round(shear / (2.0 * np.pi)))
    value[2] = poses[a, 2] - poses[b, 2] + row[6]
    gradient[0, 0], gradient[0, 1], gradient[0, 2] = nx, nz, nx * az - nz * ax
    gradient[0, 3], gradient[0, 4], gradient[0, 5] = -nx, -nz, nz * bx - nx * bz
    scale = row[4] / length
    gradient[1, 0], gradient[1, 1], gradient[1, 2] = scale * nz, -scale * nx, scale * (nz * az + nx * ax) - 0.5 * row[4]
    gradient[1, 3], gradient[1, 4], gradient[1, 5] = -scale * nz, scale * nx, -scale * (nz * bz + nx * bx) - 0.5 * row[4]
    for j in range(6):
        gradient[2, j] = 0.0
    gradient[2, 2], gradient[2, 5] = 1.0, -1.0
    return ax, az, bx, bz, nx, nz, length


@kernel(inline=True)
def _shorten(row: np.ndarray, value: np.ndarray, gradient: np.ndarray) -> tuple[float, float]:
    """Add the shortening of the chord by bending to x1 and its gradient, in place; return its slopes by x3 and by psi."""
    by_shear, by_turn = 0.2 * row[_BENT] * value[1] / row[4] ** 2, row[_BENT] * value[2] / 12.0
    value[0] += 0.5 * (by_shear * value[1] + by_turn * value[2])
    for j in range(6):
        gradient[0, j] += by_shear * gradient[1, j] + by_turn * gradient[2, j]
    return by_shear, by_turn


@kernel(inline=True)
def _change(value: float, before: float, k: int, rest: float) -> float:
    """Change of a deformation; x3 jumps by 2 pi l when the chord points backwards, and the change is corrected for this
    jump.
    """
    change = value - before
    if k == 1:
        change -= 2.0 * np.pi * rest * np.round(change / (2.0 * np.pi * rest))
    return change


@kernel
def measure_ligament_planar(
    poses: np.ndarray, rates: np.ndarray, bodies: np.ndarray, constants: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Deformations (m and rad) and rates (m/s and rad/s), (m, 3), and gradients (m, 3, 6) of all ligaments.

    Parameters
    ----------
    poses, rates : (n_bodies, 3) arrays
    bodies : (m, 2) int array
        Inner and outer body.
    constants : (m, 14) array of `ligament_constants_planar`
    """
    count = bodies.shape[0]
    value, rate, gradient = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3, 6))
    for i in range(count):
        a, b = bodies[i, 0], bodies[i, 1]
        _measure(poses, a, b, constants[i], value[i], gradient[i])
        _shorten(constants[i], value[i], gradient[i])
        for k in range(3):
            rate[i, k] = 0.0
            for c in range(3):
                rate[i, k] += gradient[i, k, c] * rates[a, c] + gradient[i, k, 3 + c] * rates[b, c]
    return value, rate, gradient


@kernel
def force_ligament_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    force: np.ndarray,
) -> None:
    """Add the forces of all ligaments.

    Parameters
    ----------
    poses, rates, bodies, constants : as in `measure_ligament_planar`
    before : (m, 3) array
        Deformations at a past state; not read if `per_second` is zero.
    per_second : float, 1/s
        Inverse of the time since the past state. If zero, the rates are those of the bodies.
    force : (n_bodies, 3) array, changed in place
    """
    value, rate, gradient = measure_ligament_planar(poses, rates, bodies, constants)
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        for k in range(3):
            speed = rate[i, k] if per_second == 0.0 else _change(value[i, k], before[i, k], k, constants[i, 4]) * per_second
            effort = constants[i, _STIFFNESS + k] * value[i, k] + constants[i, _DAMPING + k] * speed
            for c in range(3):
                force[a, c] -= effort * gradient[i, k, c]
                force[b, c] -= effort * gradient[i, k, 3 + c]


@kernel
def _second(
    ax: float, az: float, bx: float, bz: float, nx: float, nz: float, length: float, rest: float,
    gradient: np.ndarray, stretch: np.ndarray, shear: np.ndarray,
) -> None:  # fmt: skip
    """Compute second derivatives (6, 6) of x1 and x3, changed in place."""
    # n.D and w.D: gradients of x1, and of x3 without the mean rotation
    across = np.empty(6)
    for j in range(6):
        across[j] = gradient[1, j] * length / rest
    across[2] += 0.5 * length
    across[5] += 0.5 * length
    for j in range(6):
        for k in range(6):
            stretch[j, k] = across[j] * across[k] / length
            mixed = across[j] * gradient[0, k] + gradient[0, j] * across[k]
            shear[j, k] = -rest * mixed / length**2
    stretch[2, 2] -= nx * ax + nz * az
    stretch[5, 5] += nx * bx + nz * bz
    shear[2, 2] -= rest * (nz * ax - nx * az) / length
    shear[5, 5] += rest * (nz * bx - nx * bz) / length


@kernel
def linearise_ligament_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    index: BlockIndex,
    force: np.ndarray,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add the forces of all ligaments, and K = -dh/dx and D = -dh/du to the block data.

    K = sum_k g_k (k_k g_k + c_k H_k u)^T + e_k H_k,  D = sum_k c_k g_k g_k^T. If the rate is a difference from a past
    state, it does not depend on the directions, and H u is omitted.

    Parameters
    ----------
    poses ... per_second, force : as in `force_ligament_planar`
    index : arrays of the block-sparse pattern
    stiffness_data, damping_data : (n_blocks, 3, 3) arrays, changed in place
    """
    dof, indptr, indices = index
    value, gradient, second = np.empty(3), np.empty((3, 6)), np.zeros((3, 6, 6))
    block_k, block_d, speed, turned = np.empty((6, 6)), np.empty((6, 6)), np.empty(6), np.zeros(6)
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        row = constants[i]
        ax, az, bx, bz, nx, nz, length = _measure(poses, a, b, row, value, gradient)
        _second(ax, az, bx, bz, nx, nz, length, row[4], gradient, second[0], second[1])
        by_shear, _ = _shorten(row, value, gradient)
        for m in range(6):
            for n in range(6):
                bending = 0.2 * gradient[1, m] * gradient[1, n] / row[4] ** 2 + gradient[2, m] * gradient[2, n] / 12.0
                second[0, m, n] += row[_BENT] * bending + by_shear * second[1, m, n]
        speed[:3] = rates[a]
        speed[3:] = rates[b]
        block_k[:] = 0.0
        block_d[:] = 0.0
        for k in range(3):
            g, stiffness, damping = gradient[k], row[_STIFFNESS + k], row[_DAMPING + k]
            if per_second == 0.0:
                rate = 0.0
                for m in range(6):
                    rate += g[m] * speed[m]
                    turned[m] = 0.0
                    for n in range(6):
                        turned[m] += second[k, m, n] * speed[n]
            else:
                rate = _change(value[k], before[i, k], k, row[4]) * per_second
            effort = stiffness * value[k] + damping * rate
            for m in range(6):
                for n in range(6):
                    block_k[m, n] += g[m] * (stiffness * g[n] + damping * turned[n]) + effort * second[k, m, n]
                    block_d[m, n] += damping * g[m] * g[n]
            for c in range(3):
                force[a, c] -= effort * g[c]
                force[b, c] -= effort * g[3 + c]
        add_block(block_k, dof, bodies[i, :2], indptr, indices, stiffness_data)
        add_block(block_d, dof, bodies[i, :2], indptr, indices, damping_data)


@kernel
def stored_ligament_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
) -> tuple[float, float]:
    """Potential energy of all ligaments, J, and the power of their dampers, W; arguments as in `force_ligament_planar`."""
    value, rate, _ = measure_ligament_planar(poses, rates, bodies, constants)
    energy = power = 0.0
    for i in range(bodies.shape[0]):
        for k in range(3):
            speed = rate[i, k] if per_second == 0.0 else _change(value[i, k], before[i, k], k, constants[i, 4]) * per_second
            energy += 0.5 * constants[i, _STIFFNESS + k] * value[i, k] ** 2
            power += constants[i, _DAMPING + k] * speed**2
    return energy, power
