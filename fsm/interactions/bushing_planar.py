"""Linear springs and dampers between poses in the plane: deformation, law and assembly in one loop over the elements.

`fsm.interactions.pose_planar` defines the deformations. The law is e = k (x - x0) + c x'.
All vectors are resolved in the joint axes (e1, e3) of the outer body, in which K has a simple form:

    a = (a1, a3) from the inner body's centre to P+,   z = (z1, z3) from the outer body's centre to P+,
    Z1' = v1 + a3 w_a - z3 w_b,    Z3' = v3 - a1 w_a + z1 w_b,    psi' = w_a - w_b,    v = v_a - v_b,
    K = G^T (k G + c N) + B,       D = G^T c G,

with the gradients G (the coefficients of Z'), their change N at the present rates, and the geometric stiffness B.
The rows and columns of v_b are the rows and columns of v_a with the opposite sign.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_quarters_planar

_REST, _STIFFNESS, _DAMPING = 7, 10, 13
COLUMNS_PLANAR = _REST, _STIFFNESS
"""First columns of x0 and of k."""
LOCKED = 2
"""Value of `structural` of elements whose translations are locked: multipliers shift their x0 from 0."""


def pose_constants_planar(
    point_inner: np.ndarray,
    point_outer: np.ndarray,
    axes_angle: np.ndarray,
    angle_offset: np.ndarray,
    rest: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
) -> np.ndarray:
    """Constants (m, 16) of all elements for the kernels; arguments as in `measure_pose_planar`.

    Columns: inner point (2), cosine and sine of the axes' angle, outer point in the joint axes (2), psi_0, and x0, k, c
    of (Z1, Z3, psi).
    """
    cosine, sine = np.cos(axes_angle), np.sin(axes_angle)
    outer = (cosine * point_outer[:, 0] - sine * point_outer[:, 1], sine * point_outer[:, 0] + cosine * point_outer[:, 1])
    return np.column_stack([point_inner, cosine, sine, *outer, angle_offset, rest, stiffness, damping])


@kernel
def _cosines_and_sines(poses: np.ndarray) -> np.ndarray:
    """Cosine and sine of every body's angle, (n_bodies, 2)."""
    turns = np.empty((poses.shape[0], 2))
    for i in range(poses.shape[0]):
        turns[i, 0] = np.cos(poses[i, 2])
        turns[i, 1] = np.sin(poses[i, 2])
    return turns


@kernel(inline=True)
def _measure(
    poses: np.ndarray, rates: np.ndarray, turns: np.ndarray, a: int, b: int, row: np.ndarray
) -> tuple[float, float, float, float, float, float, float, float, float, float, float]:
    """Axes (ct, st) with e1 = (ct, -st), e3 = (st, ct); a, z, psi; v, w_a, w_b. All in joint axes."""
    ct = turns[b, 0] * row[2] - turns[b, 1] * row[3]
    st = turns[b, 1] * row[2] + turns[b, 0] * row[3]
    armx = turns[a, 0] * row[0] + turns[a, 1] * row[1]
    armz = turns[a, 0] * row[1] - turns[a, 1] * row[0]
    dx = poses[a, 0] + armx - poses[b, 0]
    dz = poses[a, 1] + armz - poses[b, 1]
    vx, vz = rates[a, 0] - rates[b, 0], rates[a, 1] - rates[b, 1]
    return (
        ct, st, ct * armx - st * armz, st * armx + ct * armz, ct * dx - st * dz, st * dx + ct * dz,
        poses[a, 2] - poses[b, 2] + row[6], ct * vx - st * vz, st * vx + ct * vz, rates[a, 2], rates[b, 2],
    )  # fmt: skip


@kernel(inline=True)
def _efforts(
    a1: float, a3: float, z1: float, z3: float, psi: float, v1: float, v3: float, wa: float, wb: float,
    row: np.ndarray, before: np.ndarray, per_second: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Efforts k (x - x0) + c x' of (Z1, Z3, psi); if `per_second` is not zero, the rate x' is (x - before) per_second."""
    x1, x3 = z1 - row[4], z3 - row[5]
    if per_second != 0.0:
        r1, r3, rp = (x1 - before[0]) * per_second, (x3 - before[1]) * per_second, (psi - before[2]) * per_second
    else:
        r1, r3, rp = v1 + a3 * wa - z3 * wb, v3 - a1 * wa + z1 * wb, wa - wb
    return (
        row[_STIFFNESS] * (x1 - row[_REST]) + row[_DAMPING] * r1,
        row[_STIFFNESS + 1] * (x3 - row[_REST + 1]) + row[_DAMPING + 1] * r3,
        row[_STIFFNESS + 2] * (psi - row[_REST + 2]) + row[_DAMPING + 2] * rp,
    )


@kernel(inline=True)
def _scatter(
    ct: float, st: float, a1: float, a3: float, z1: float, z3: float, f1: float, f3: float, m: float,
    a: int, b: int, force: np.ndarray,
) -> None:  # fmt: skip
    """Add the forces -e dx/dq of one element."""
    fx, fz = ct * f1 + st * f3, ct * f3 - st * f1
    force[a, 0] -= fx
    force[a, 1] -= fz
    force[a, 2] -= f1 * a3 - f3 * a1 + m
    force[b, 0] += fx
    force[b, 1] += fz
    force[b, 2] += f1 * z3 - f3 * z1 + m


@kernel
def force_pose_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    force: np.ndarray,
) -> None:
    """Add the forces of all elements.

    Parameters
    ----------
    poses, rates : (n_bodies, 3) arrays
    bodies : (m, 2 or more) int array
        Inner and outer body.
    constants : (m, 16) array of `pose_constants_planar`
    before : (m, 3) array
        Deformations at a past state; not read if `per_second` is zero.
    per_second : float, 1/s
        Inverse of the time since the past state. If zero, the rates are those of the bodies.
    force : (n_bodies, 3) array, changed in place
    """
    turns = _cosines_and_sines(poses)
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        ct, st, a1, a3, z1, z3, psi, v1, v3, wa, wb = _measure(poses, rates, turns, a, b, constants[i])
        f1, f3, m = _efforts(a1, a3, z1, z3, psi, v1, v3, wa, wb, constants[i], before[i], per_second)
        _scatter(ct, st, a1, a3, z1, z3, f1, f3, m, a, b, force)


@kernel
def linearise_pose_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    efforts: np.ndarray,
    slots: np.ndarray,
    force: np.ndarray,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add the forces of all elements, and K = -dh/dx and D = -dh/du to the block data.

    If the rate is a difference from a past state, it does not depend on the axes, and N is zero.

    Parameters
    ----------
    poses ... per_second, force : as in `force_pose_planar`
    efforts : (m, 3) array, or (0, 3)
        Efforts for the geometric stiffness instead of those at the poses; see `advance_efforts_planar`.
    slots : (m, 4) int array of `pair_slots`
    stiffness_data, damping_data : (n_blocks, 3, 3) arrays, changed in place
    """
    turns = _cosines_and_sines(poses)
    stiffness_flat, damping_flat = stiffness_data.reshape(-1), damping_data.reshape(-1)
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        row = constants[i]
        ct, st, a1, a3, z1, z3, psi, v1, v3, wa, wb = _measure(poses, rates, turns, a, b, row)
        f1, f3, m = _efforts(a1, a3, z1, z3, psi, v1, v3, wa, wb, row, before[i], per_second)
        _scatter(ct, st, a1, a3, z1, z3, f1, f3, m, a, b, force)
        if efforts.shape[0] > 0:
            f1, f3 = efforts[i, 0], efforts[i, 1]
        k1, k3, kp = row[_STIFFNESS], row[_STIFFNESS + 1], row[_STIFFNESS + 2]
        c1, c3, cp = row[_DAMPING], row[_DAMPING + 1], row[_DAMPING + 2]

        # k G + c N, one row for each deformation; columns v (in joint axes), w_a, w_b
        h11, h13, h1a, h1b = k1, 0.0, k1 * a3, -k1 * z3
        h31, h33, h3a, h3b = 0.0, k3, -k3 * a1, k3 * z1
        if per_second == 0.0 and (c1 != 0.0 or c3 != 0.0):
            h13 -= c1 * wb
            h31 += c3 * wb
            h1a -= c1 * a1 * (wa - wb)
            h3a -= c3 * a3 * (wa - wb)
            h1b += c1 * (a1 * wa - z1 * wb - v3)
            h3b += c3 * (a3 * wa - z3 * wb + v1)
        # G^T (k G + c N) + B; s = a f, t = z f
        s, t = a1 * f1 + a3 * f3, z1 * f1 + z3 * f3
        av1, av3 = a3 * h11 - a1 * h31, a3 * h13 - a1 * h33
        bv1, bv3 = z1 * h31 - z3 * h11 + f3, z1 * h33 - z3 * h13 - f1
        aa = a3 * h1a - a1 * h3a + kp - s
        ab = a3 * h1b - a1 * h3b - kp + s
        ba = z1 * h3a - z3 * h1a - kp + s
        bb = z1 * h3b - z3 * h1b + kp - t
        h1b += f3
        h3b -= f1
        # rotate into inertial axes
        l11, l13 = ct * h11 + st * h31, ct * h13 + st * h33
        l31, l33 = ct * h31 - st * h11, ct * h33 - st * h13
        add_quarters_planar(
            stiffness_flat, slots[i],
            (l11 * ct + l13 * st, l13 * ct - l11 * st, l31 * ct + l33 * st, l33 * ct - l31 * st),
            (ct * h1a + st * h3a, ct * h3a - st * h1a), (ct * h1b + st * h3b, ct * h3b - st * h1b),
            (av1 * ct + av3 * st, av3 * ct - av1 * st), (bv1 * ct + bv3 * st, bv3 * ct - bv1 * st),
            aa, ab, ba, bb,
        )  # fmt: skip

        if c1 == 0.0 and c3 == 0.0 and cp == 0.0:
            continue
        d1a, d1b, d3a, d3b = c1 * a3, -c1 * z3, -c3 * a1, c3 * z1
        dxx, dxz, dzz = ct * ct * c1 + st * st * c3, ct * st * (c3 - c1), st * st * c1 + ct * ct * c3
        dxa, dza, dxb, dzb = ct * d1a + st * d3a, ct * d3a - st * d1a, ct * d1b + st * d3b, ct * d3b - st * d1b
        dab = a3 * d1b - a1 * d3b - cp
        add_quarters_planar(
            damping_flat, slots[i],
            (dxx, dxz, dxz, dzz), (dxa, dza), (dxb, dzb), (dxa, dza), (dxb, dzb),
            a3 * d1a - a1 * d3a + cp, dab, dab, z1 * d3b - z3 * d1b + cp,
        )  # fmt: skip


@kernel(inline=True)
def _deformations_and_rates(
    poses: np.ndarray, rates: np.ndarray, turns: np.ndarray, a: int, b: int, row: np.ndarray
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Deformations (Z1, Z3, psi), and their rates from the bodies' rates."""
    _, _, a1, a3, z1, z3, psi, v1, v3, wa, wb = _measure(poses, rates, turns, a, b, row)
    return (z1 - row[4], z3 - row[5], psi), (v1 + a3 * wa - z3 * wb, v3 - a1 * wa + z1 * wb, wa - wb)


@kernel
def advance_efforts_planar(
    poses: np.ndarray,
    change: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
) -> np.ndarray:
    """Efforts (m, 3) of all elements after a change of the poses, to first order: e + (k + c/dt) G dx.

    Parameters
    ----------
    poses, bodies, constants, before, per_second : as in `force_pose_planar`
    change : (n_bodies, 3) array
        Increments of the poses; zeros give the efforts at the poses.
    """
    efforts = np.empty((bodies.shape[0], 3))
    turns = _cosines_and_sines(poses)
    for i in range(bodies.shape[0]):
        row, past = constants[i], before[i]
        x, dx = _deformations_and_rates(poses, change, turns, bodies[i, 0], bodies[i, 1], row)
        for k in range(3):
            later = x[k] + dx[k]
            damped = row[_DAMPING + k] * per_second * (later - past[k])
            efforts[i, k] = row[_STIFFNESS + k] * (later - row[_REST + k]) + damped
    return efforts


@kernel
def stored_pose_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    category: np.ndarray,
    categories: int,
) -> tuple[np.ndarray, float]:
    """Potential energy of all elements of each category (m,), J, and the power of all dampers, W.

    Parameters
    ----------
    poses ... per_second : as in `force_pose_planar`
    category, categories : (m,) int array, and the number of categories
    """
    energy, power = np.zeros(categories), 0.0
    turns = _cosines_and_sines(poses)
    for i in range(bodies.shape[0]):
        row, past = constants[i], before[i]
        x, rate = _deformations_and_rates(poses, rates, turns, bodies[i, 0], bodies[i, 1], row)
        for k in range(3):
            energy[category[i]] += 0.5 * row[_STIFFNESS + k] * (x[k] - row[_REST + k]) ** 2
            speed = (x[k] - past[k]) * per_second if per_second != 0.0 else rate[k]
            power += row[_DAMPING + k] * speed**2
    return energy, power


@kernel
def widest_pose_planar(
    poses: np.ndarray, bodies: np.ndarray, constants: np.ndarray, structural: np.ndarray
) -> tuple[int, float]:
    """Index of the structural element (m,) with the largest separation of its ends, and the separation, m.

    Axes without stiffness are ignored. The index is 0 if all separations are zero.
    Other arguments as in `force_pose_planar`.
    """
    worst, widest = 0, 0.0
    turns = _cosines_and_sines(poses)
    for i in range(bodies.shape[0]):
        if not structural[i]:
            continue
        row = constants[i]
        _, _, _, _, z1, z3, _, _, _, _, _ = _measure(poses, poses, turns, bodies[i, 0], bodies[i, 1], row)
        square, shifted = 0.0, 0.0 if structural[i] == LOCKED else 1.0
        if row[_STIFFNESS] > 0.0:
            square += (z1 - row[4] - shifted * row[_REST]) ** 2
        if row[_STIFFNESS + 1] > 0.0:
            square += (z3 - row[5] - shifted * row[_REST + 1]) ** 2
        if square > widest:
            worst, widest = i, square
    return worst, np.sqrt(widest)


@kernel
def deformations_pose_planar(poses: np.ndarray, rates: np.ndarray, bodies: np.ndarray, constants: np.ndarray) -> np.ndarray:
    """Deformations (m, 3) of all elements as in `measure_pose_planar`; arguments as in `force_pose_planar`."""
    value, turns = np.empty((bodies.shape[0], 3)), _cosines_and_sines(poses)
    for i in range(bodies.shape[0]):
        x, _ = _deformations_and_rates(poses, rates, turns, bodies[i, 0], bodies[i, 1], constants[i])
        for k in range(3):
            value[i, k] = x[k]
    return value
