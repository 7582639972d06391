"""Weight of a contact point near the end of a surface.

A point represents a cell of its panel that extends by a to both sides. As the end of another panel passes over the cell, the
weight of the point grows with the covered part of the cell. Without this change of weight, the force would jump by the whole
weight of the point. Let S be the distance of the point from the end, positive inwards. The full weight is multiplied by

    f(S) = 2 c(S - b/2) - c(S - 5b/4),     c(x) = [G(x + a) - G(x - a)]/(2a),     G'' = 2/b within 0 < x < b/2, else 0

b is the largest cell of the panel. G is max(0, x) with a rounded corner, so f is C1. The factor f is zero at the end and
beyond, and one from 9b/4 on. In between, f exceeds the covered part of the cell. The excess makes the total force of an
evenly pressed panel equal to the force of cells that are cut off at the end. The cells adjoin each other, so the sums of c
over all cells telescope. The sum of the weights thus does not depend on the positions of the points.

A contact energy w f U, with w U the energy at full weight, gives the forces -w f dU/dx and -w U df/dx. The change of the
overlap thus also causes a force. The factor f varies only within the half segment at the end of a surface. There S is a
coordinate of that segment.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.scatter import add_block
from fsm.kernels.vector import cross, dot, rotate

TAPER = 2.25
"""Ratio of the taper's length to the largest cell."""


@kernel(inline=True)
def _rounded_ramp(x: float, width: float) -> tuple[float, float, float]:
    """Compute G and its first two derivatives."""
    if x <= 0.0:
        return 0.0, 0.0, 0.0
    if x >= width:
        return x - 0.5 * width, 1.0, 0.0
    return 0.5 * x * x / width, x / width, 1.0 / width


@kernel
def end_taper(inside: float, half_cell: float, largest: float) -> tuple[float, float, float]:
    """Compute f and its first two derivatives with respect to S.

    Parameters
    ----------
    inside : m
        S.
    half_cell, largest : a, b, m
    """
    value = slope = bend = 0.0
    for factor, shift in ((2.0, 0.5), (-1.0, 1.25)):
        x = inside - shift * largest
        g1, d1, e1 = _rounded_ramp(x + half_cell, 0.5 * largest)
        g0, d0, e0 = _rounded_ramp(x - half_cell, 0.5 * largest)
        value += factor * (g1 - g0)
        slope += factor * (d1 - d0)
        bend += factor * (e1 - e0)
    return 0.5 * value / half_cell, 0.5 * slope / half_cell, 0.5 * bend / half_cell


@kernel(inline=True)
def inside_of_end(s: float, stations: np.ndarray) -> tuple[float, float]:
    """S of a point at s of a piece, m, and its sign along the body's axis; infinite if the piece is not at an end."""
    half = stations[3] - stations[0]
    if stations[4] < 0.0:
        return s * half, 1.0
    if stations[5] > 1.0:
        return (1.0 - s) * half, -1.0
    return np.inf, 0.0


@kernel
def _tapered_rows(
    count: int,
    found_probe: np.ndarray,
    found_piece: np.ndarray,
    found_s: np.ndarray,
    cell: np.ndarray,
    stations: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows (m,) of the tapered contacts, f with its derivatives (m, 3), and signs of S (m,)."""
    rows, shape, signs = np.empty(count, dtype=np.int64), np.empty((count, 3)), np.empty(count)
    found = 0
    for i in range(count):
        probe, piece = found_probe[i], found_piece[i]
        if cell[probe, 1] == 0.0:
            continue
        inside, sign = inside_of_end(found_s[i], stations[piece])
        if inside >= TAPER * cell[probe, 1]:
            continue
        shape[found, 0], shape[found, 1], shape[found, 2] = end_taper(inside, cell[probe, 0], cell[probe, 1])
        signs[found], rows[found] = sign, i
        found += 1
    return rows[:found].copy(), shape[:found].copy(), signs[:found].copy()


@kernel
def tapered_planar(
    poses: np.ndarray,
    bodies: np.ndarray,
    count: int,
    found_probe: np.ndarray,
    found_piece: np.ndarray,
    found_s: np.ndarray,
    probe_x: np.ndarray,
    cell: np.ndarray,
    stations: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Find the contacts with tapered weights; compute the weights and their derivatives.

    Parameters
    ----------
    bodies : (count, 3) int array
        Bodies of the contacts, as measured.
    found_probe, found_piece, found_s : (count,) arrays of the contact search
    cell : (n, 2) array, m
        a and b of every probe; zeros for a probe without taper.

    Returns
    -------
    rows : (m,) int array
    part : (m,) array
        f.
    gradient : (m, 9) array
        df/dx.
    hessian : (m, 9, 9) array
    """
    rows, shape, signs = _tapered_rows(count, found_probe, found_piece, found_s, cell, stations)
    gradient, hessian = np.zeros((len(rows), 9)), np.zeros((len(rows), 9, 9))
    for k in range(len(rows)):
        i = rows[k]
        own, end, sign, x = bodies[i, 0], bodies[i, 1], signs[k], probe_x[found_probe[i]]
        c, s = np.cos(poses[own, 2]), np.sin(poses[own, 2])
        ax, az = np.cos(poses[end, 2]), -np.sin(poses[end, 2])  # axis of the end segment and its derivative:
        bx, bz = az, -ax
        dx = poses[own, 0] + c * x - poses[end, 0]
        dz = poses[own, 1] - s * x - poses[end, 1]
        g, h = gradient[k], hessian[k]
        g[0], g[1], g[2] = sign * ax, sign * az, -sign * x * (ax * s + az * c)
        g[3], g[4], g[5] = -sign * ax, -sign * az, sign * (dx * bx + dz * bz)
        h[2, 2] = -sign * x * (ax * c - az * s)
        h[2, 5] = -sign * x * (bx * s + bz * c)
        h[0, 5], h[1, 5], h[3, 5], h[4, 5] = sign * bx, sign * bz, -sign * bx, -sign * bz
        h[5, 5] = -sign * (dx * ax + dz * az)
        for m in range(5):
            h[5, m] = h[m, 5]
        _chain_rule(shape[k], g, h)
    return rows, shape[:, 0].copy(), gradient, hessian


@kernel
def _chain_rule(shape: np.ndarray, gradient: np.ndarray, hessian: np.ndarray) -> None:
    """Convert the derivatives of S to the derivatives of f, in place."""
    for m in range(gradient.shape[0]):
        for n in range(gradient.shape[0]):
            hessian[m, n] = shape[1] * hessian[m, n] + shape[2] * gradient[m] * gradient[n]
    for m in range(gradient.shape[0]):
        gradient[m] *= shape[1]


@kernel
def tapered_spatial(
    poses: np.ndarray,
    bodies: np.ndarray,
    count: int,
    found_probe: np.ndarray,
    found_piece: np.ndarray,
    found_at: np.ndarray,
    probe_place: np.ndarray,
    cell: np.ndarray,
    stations: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Tapered contacts in space, as `tapered_planar` with 18 coordinates; hessian[m, n] is d(df/dx_m)/dx_n."""
    rows, shape, signs = _tapered_rows(count, found_probe, found_piece, found_at[:, 0].copy(), cell, stations)
    gradient, hessian = np.zeros((len(rows), 18)), np.zeros((len(rows), 18, 18))
    frames, arm, unit, turned = np.empty((2, 3, 3)), np.zeros(3), np.empty(3), np.empty(3)
    axis, away = np.empty(3), np.empty(3)
    own_turn, end_turn = np.empty((3, 3)), np.empty((3, 3))  # derivatives of arm and axis with respect to rotations
    first_axis = np.zeros(3)
    first_axis[0] = 1.0
    for k in range(len(rows)):
        i = rows[k]
        own, end, sign = bodies[i, 0], bodies[i, 1], signs[k]
        fill_rotation(poses[own, 3:], frames[0])
        fill_rotation(poses[end, 3:], frames[1])
        arm[0], arm[1] = probe_place[found_probe[i], 0], probe_place[found_probe[i], 1]
        rotate(frames[0], arm, away)
        rotate(frames[1], first_axis, axis)
        for c in range(3):
            away[c] += poses[own, c] - poses[end, c]
        for j in range(3):
            unit[:] = 0.0
            unit[j] = 1.0
            cross(unit, arm, turned)
            rotate(frames[0], turned, own_turn[j])
            cross(unit, first_axis, turned)
            rotate(frames[1], turned, end_turn[j])
        g, h = gradient[k], hessian[k]
        for j in range(3):
            g[j], g[6 + j] = sign * axis[j], -sign * axis[j]
            g[3 + j], g[9 + j] = sign * dot(axis, own_turn[j]), sign * dot(end_turn[j], away)
            for n in range(3):
                h[j, 9 + n] = h[9 + n, j] = sign * end_turn[n, j]
                h[6 + j, 9 + n] = h[9 + n, 6 + j] = -sign * end_turn[n, j]
                h[3 + j, 9 + n] = h[9 + n, 3 + j] = sign * dot(end_turn[n], own_turn[j])
                h[3 + j, 3 + n] = sign * _second_by_rotations(frames[0], arm, j, n, axis, unit, turned)
                h[9 + j, 9 + n] = sign * _second_by_rotations(frames[1], first_axis, j, n, away, unit, turned)
        _chain_rule(shape[k], g, h)
    return rows, shape[:, 0].copy(), gradient, hessian


@kernel
def _second_by_rotations(
    frame: np.ndarray, arm: np.ndarray, j: int, n: int, along: np.ndarray, unit: np.ndarray, turned: np.ndarray
) -> float:
    """Second derivative along . A (e_n x (e_j x arm)) of a coordinate by two rotations."""
    unit[:] = 0.0
    unit[j] = 1.0
    cross(unit, arm, turned)
    unit[j] = 0.0
    unit[n] = 1.0
    total = 0.0
    for c in range(3):
        total += along[c] * (
            frame[c, 0] * (unit[1] * turned[2] - unit[2] * turned[1])
            + frame[c, 1] * (unit[2] * turned[0] - unit[0] * turned[2])
            + frame[c, 2] * (unit[0] * turned[1] - unit[1] * turned[0])
        )
    return total


@kernel
def add_taper_tangent(
    bodies: np.ndarray,
    gradient: np.ndarray,
    rows: np.ndarray,
    part_gradient: np.ndarray,
    part_hessian: np.ndarray,
    energy: np.ndarray,
    elastic: np.ndarray,
    normal: np.ndarray,
    by_normal: np.ndarray,
    dof: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Add to K the terms from the change of tapered weights.

    Parameters
    ----------
    bodies, gradient : (count, ...) arrays of all contacts, as measured
    rows, part_gradient, part_hessian : results of `tapered_planar`
    energy, elastic, normal : (m,) arrays, J, N, N
        Energy, elastic and total normal force of the tapered contacts at full weight.
    by_normal : (count, c) array
        df/dN of the friction of all contacts.
    dof, indptr, indices : see `fsm.model.bodies.group.BodyPattern`
    stiffness : block data, changed in place
    """
    order = gradient.shape[2]
    block = np.empty((order, order))
    for k in range(rows.shape[0]):
        i = rows[k]
        for m in range(order):
            # force that grows with the weight: the normal force minus the friction
            along = gradient[i, 0, m]
            for c in range(by_normal.shape[1]):
                along -= by_normal[i, c] * gradient[i, 1 + c, m]
            for n in range(order):
                block[m, n] = (
                    energy[k] * part_hessian[k, m, n]
                    - elastic[k] * part_gradient[k, m] * gradient[i, 0, n]
                    - normal[k] * along * part_gradient[k, n]
                )
        add_block(block, dof, bodies[i], indptr, indices, stiffness)
