"""Gap between a probe point of one panel and the surface of another, in the plane.

    g = n . (p - C(s)) - clearance,     (p - C(s)) . C_s(s) = 0,     n = side * normal of the curve

The signed distance and its derivatives follow from the closest-point condition. With t = C_s/|C_s|, L = |C_s|, d the
distance and A = L^2 - d n.C_ss,

    ds = [L t.(dp - dC) + d n.dC_s]/A,   dn = -t beta,   beta = n.(dC_s + C_ss ds)/L,   dg = n.(dp - dC)

At a distance x past the straight part of its tip, the surface is a disc of radius R (`fsm.interactions.surfaces.surface`):

    g_round = sqrt(x^2 + y^2) - R,   y = g + R,   dx = t.(dp - dC) + distance n.dC_s/L

Slip is the relative velocity of the two bodies' material along t at one common point, x_c = p - inset n. Action and
reaction therefore conserve the angular momentum.

Coordinates of a contact: (x, z, phi) of the probe's body, then of the piece's bodies a and b.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import BlockIndex, ContactForces, FoundPoints
from fsm.interactions.surfaces.surface import blend, overshoot
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_block


@kernel(inline=True)
def _curve(
    poses: np.ndarray, a: int, b: int, axes: tuple[float, float, float, float], weights: np.ndarray, out: np.ndarray
) -> None:
    """Evaluate C, C_s, C_ss into the rows of `out` (3, 2) from the blend weights (3, 4); `axes`: cosines and sines."""
    ca, sa, cb, sb = axes
    for d in range(3):
        wa, xa, wb, xb = weights[d]
        out[d, 0] = wa * poses[a, 0] + wb * poses[b, 0] + ca * xa + cb * xb
        out[d, 1] = wa * poses[a, 1] + wb * poses[b, 1] - sa * xa - sb * xb


@kernel(inline=True)
def _geometry(
    poses: np.ndarray,
    bodies: np.ndarray,
    probe_x: float,
    side: float,
    s: float,
    stations: np.ndarray,
    weights: np.ndarray,
    curve: np.ndarray,
    vectors: np.ndarray,
) -> tuple[float, float, float, float, float, float, float]:
    """Compute the first variations at a closest point.

    Rows of `vectors` (5, 9), changed in place: t.(dp - dC), n.(dp - dC), t.dC_s, n.dC_s, n.dC_ss (dC_ss at fixed s).
    Returns tx, tz, nx, nz, L, distance, n.C_ss.
    """
    blend(s, stations, weights)
    ca, sa = np.cos(poses[bodies[1], 2]), np.sin(poses[bodies[1], 2])
    cb, sb = np.cos(poses[bodies[2], 2]), np.sin(poses[bodies[2], 2])
    _curve(poses, bodies[1], bodies[2], (ca, sa, cb, sb), weights, curve)
    length = np.sqrt(curve[1, 0] ** 2 + curve[1, 1] ** 2)
    tx, tz = curve[1, 0] / length, curve[1, 1] / length
    nx, nz = -side * tz, side * tx
    c, si = np.cos(poses[bodies[0], 2]), np.sin(poses[bodies[0], 2])
    arm_x, arm_z = c * probe_x, -si * probe_x
    px, pz = poses[bodies[0], 0] + arm_x, poses[bodies[0], 1] + arm_z
    distance = nx * (px - curve[0, 0]) + nz * (pz - curve[0, 1])
    vectors[:] = 0.0
    vectors[0, 0], vectors[0, 1], vectors[0, 2] = tx, tz, tx * arm_z - tz * arm_x
    vectors[1, 0], vectors[1, 1], vectors[1, 2] = nx, nz, nx * arm_z - nz * arm_x
    for k in range(2):
        cosine, sine = (ca, sa) if k == 0 else (cb, sb)
        for d in range(3):
            weight, station = weights[d, 2 * k], weights[d, 2 * k + 1]
            ax, az = cosine * station, -sine * station
            for row, ux, uz in ((0, tx, tz), (1, nx, nz)):
                target = row + 2 * d if d < 2 else 4
                if d == 2 and row == 0:
                    continue
                sign = -1.0 if d == 0 else 1.0
                vectors[target, 3 + 3 * k] = sign * weight * ux
                vectors[target, 4 + 3 * k] = sign * weight * uz
                vectors[target, 5 + 3 * k] = sign * (ux * az - uz * ax)
    return tx, tz, nx, nz, length, distance, nx * curve[2, 0] + nz * curve[2, 1]


@kernel
def write_gap_planar(
    poses: np.ndarray, rates: np.ndarray, found: FoundPoints, probe_body: np.ndarray, probe_x: np.ndarray,
    straight: np.ndarray, clearance: np.ndarray, inset: np.ndarray, owners: np.ndarray, stations: np.ndarray,
    bodies: np.ndarray, rate: np.ndarray, gradient: np.ndarray,
) -> None:  # fmt: skip
    """Write bodies (count, 3), rates (count, 2), m/s, of the gap and of the slip, and gradients (count, 2, 9): dg/dx, and
    the slip gradient V, with the slip velocity V.u at the rates u.
    """
    found_probe, found_piece, found_side, found_s = found
    weights = np.empty((3, 4))
    curve = np.empty((3, 2))
    vectors = np.empty((5, 9))
    for i in range(found_probe.shape[0]):
        probe, piece = found_probe[i], found_piece[i]
        bodies[i, 0] = probe_body[probe]
        bodies[i, 1] = owners[piece, 0]
        bodies[i, 2] = owners[piece, 1]
        _, _, _, _, length, distance, _ = _geometry(
            poses, bodies[i], probe_x[probe], found_side[i], found_s[i], stations[piece], weights, curve, vectors
        )
        lever = (distance - inset[probe]) / length
        over, radius = overshoot(found_s[i], stations[piece], length, straight[probe], clearance[probe])
        height = distance - clearance[probe] + radius
        far = np.hypot(over, height)
        for m in range(9):
            gradient[i, 0, m] = vectors[1, m]
            if over != 0.0:
                sliding = vectors[0, m] + distance / length * vectors[3, m]
                gradient[i, 0, m] = (over * sliding + height * vectors[1, m]) / far
            gradient[i, 1, m] = vectors[0, m] + lever * vectors[3, m]
        gradient[i, 1, 2] -= found_side[i] * inset[probe]
        for k in range(2):
            total = 0.0
            for b in range(3):
                for c in range(3):
                    total += gradient[i, k, 3 * b + c] * rates[bodies[i, b], c]
            rate[i, k] = total


@kernel
def _slip_gradient(
    vec: np.ndarray,
    ds: np.ndarray,
    beta: np.ndarray,
    curvature: np.ndarray,
    lever: float,
    length: float,
    turn: float,
    out: np.ndarray,
) -> None:
    """Derivative (9, 9) of the slip gradient t.(dp - dC) + lever n.dC_s, without the term of the inset."""
    for m in range(9):
        for n in range(9):
            stretch = vec[2, n] + turn * ds[n]
            slope_n = -beta[n] * vec[2, m] + vec[4, m] * ds[n]
            if m == n:
                slope_n += curvature[2, m]
            out[m, n] = (
                beta[n] * vec[1, m]
                - vec[2, m] * ds[n]
                + vec[1, n] / length * vec[3, m]
                + lever * (slope_n - vec[3, m] * stretch / length)
            )
        out[m, m] += curvature[0, m]


@kernel
def tangent_gap_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    gradient: np.ndarray,
    found: FoundPoints,
    probe_x: np.ndarray,
    straight: np.ndarray,
    clearance: np.ndarray,
    inset: np.ndarray,
    stations: np.ndarray,
    forces: ContactForces,
    index: BlockIndex,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add K and D of all contacts."""
    found_probe, found_piece, found_side, found_s = found
    normal, by_depth, by_closing, effort, by_slip, by_normal, with_friction = forces
    dof, indptr, indices = index
    weights = np.empty((3, 4))
    curve = np.empty((3, 2))
    vec = np.empty((5, 9))
    hessian = np.zeros((9, 9))
    slip_gradient = np.zeros((9, 9))
    block_k = np.empty((9, 9))
    block_d = np.empty((9, 9))
    ds = np.empty(9)
    beta = np.empty(9)
    curvature = np.zeros((3, 9))
    speed = np.empty(9)
    along = np.empty(9)
    for i in range(found_probe.shape[0]):
        probe, piece = found_probe[i], found_piece[i]
        tx, tz, nx, nz, length, distance, bend = _geometry(
            poses, bodies[i], probe_x[probe], found_side[i], found_s[i], stations[piece], weights, curve, vec
        )
        turn = tx * curve[2, 0] + tz * curve[2, 1]
        metric = length * length - distance * bend
        for b in range(3):
            body = bodies[i, b]
            for c in range(3):
                speed[3 * b + c] = rates[body, c]
            # second derivatives of p - C and of C_s with respect to the angle of their body: -arm
            cb, sb = np.cos(poses[body, 2]), np.sin(poses[body, 2])
            place = 3 * b + 2
            if b == 0:
                ax, az = cb * probe_x[probe], -sb * probe_x[probe]
                curvature[0, place] = -(tx * ax + tz * az)
                curvature[1, place] = -(nx * ax + nz * az)
            else:
                ax, az = cb * weights[0, 2 * b - 1], -sb * weights[0, 2 * b - 1]
                curvature[0, place] = tx * ax + tz * az
                curvature[1, place] = nx * ax + nz * az
                ax, az = cb * weights[1, 2 * b - 1], -sb * weights[1, 2 * b - 1]
                curvature[2, place] = -(nx * ax + nz * az)
        for m in range(9):
            ds[m] = (length * vec[0, m] + distance * vec[3, m]) / metric
            beta[m] = (vec[3, m] + bend * ds[m]) / length
        for m in range(9):
            for n in range(9):
                hessian[m, n] = -beta[n] * vec[0, m] - vec[3, m] * ds[n]
            hessian[m, m] += curvature[1, m]
        over, radius = overshoot(found_s[i], stations[piece], length, straight[probe], clearance[probe])
        if over != 0.0:
            # the second derivative of x equals the derivative of the slip gradient at the surface
            _slip_gradient(vec, ds, beta, curvature, distance / length, length, turn, slip_gradient)
            for m in range(9):
                along[m] = vec[0, m] + distance / length * vec[3, m]
            height = distance - clearance[probe] + radius
            far = np.hypot(over, height)
            for m in range(9):
                for n in range(9):
                    hessian[m, n] = (
                        along[m] * along[n]
                        + vec[1, m] * vec[1, n]
                        - gradient[i, 0, m] * gradient[i, 0, n]
                        + over * slip_gradient[m, n]
                        + height * hessian[m, n]
                    ) / far
        if with_friction:
            lever = (distance - inset[probe]) / length
            _slip_gradient(vec, ds, beta, curvature, lever, length, turn, slip_gradient)
        for n in range(9):
            gap_rate = 0.0
            slip_rate = 0.0
            for m in range(9):
                gap_rate += hessian[m, n] * speed[m]
                slip_rate += slip_gradient[m, n] * speed[m]
            normal_x = -by_depth[i] * gradient[i, 0, n] - by_closing[i] * gap_rate
            normal_u = -by_closing[i] * gradient[i, 0, n]
            friction_x = by_slip[i, 0, 0] * slip_rate + by_normal[i, 0] * normal_x
            friction_u = by_slip[i, 0, 0] * gradient[i, 1, n] + by_normal[i, 0] * normal_u
            for m in range(9):
                block_k[m, n] = -normal[i] * hessian[m, n] - gradient[i, 0, m] * normal_x
                block_d[m, n] = -gradient[i, 0, m] * normal_u
                if with_friction:
                    block_k[m, n] += gradient[i, 1, m] * friction_x + effort[i, 0] * slip_gradient[m, n]
                    block_d[m, n] += gradient[i, 1, m] * friction_u
        add_block(block_k, dof, bodies[i], indptr, indices, stiffness_data)
        add_block(block_d, dof, bodies[i], indptr, indices, damping_data)
