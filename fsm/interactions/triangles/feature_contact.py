"""Gap, slip and their derivatives at closest points of a triangulated surface
(`fsm.interactions.triangles.closest_features`).

With r = sum c_i x_i, the unit normal n, the distance g = n.r, and the k free directions t_a = sum tau_ai x_i,

    dg = n . sum c_i dx_i                     the closest points do not matter to first order
    A_a = t_a . sum c_i dx_i,   B_a = n . sum tau_ai dx_i,   G = t_a.t_b
    dbeta = G^-1 (A + g B),     dc_i = -tau_ai dbeta_a
    dn = (I - n n^T - P) sum c_i dx_i/g - t_a (G^-1 B)_a,    P = t_a G^-1_ab t_b
    d2g = |(I - n n^T - P) sum c_i dx_i|^2/g - A G^-1 B - B G^-1 A - g B G^-1 B

Inside of a triangle and between two edges (k = 2), I - n n^T - P is zero, and nothing is divided by g. The slip is the
tangential part of sum c_i v_i. Coordinates are those of bodies (dr, dtheta), whose rotations have no effect.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.contact_frame import write_contact_tangent
from fsm.interactions.contact.shapes import BlockIndex, ContactForces
from fsm.interactions.triangles.closest_features import Found
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot
from fsm.kernels.vector import dot

SIZE = 24
"""Coordinates of four bodies."""


@kernel
def write_features(
    rates: np.ndarray, body: np.ndarray, found: Found, count: int, bodies: np.ndarray, rate: np.ndarray,
    gradient: np.ndarray,
) -> None:  # fmt: skip
    """Write bodies (m, 4), rates (m, 4) and gradients (m, 4, 24) of gap and slip of `count` closest points.

    `body` (n,) contains the bodies of all nodes. Derivatives with respect to rotations keep their values, which are zero.
    """
    for i in range(count):
        n = found.normal[i]
        for k in range(4):
            bodies[i, k] = body[found.nodes[i, k]]
            c = found.coefficients[i, k]
            for e in range(3):
                gradient[i, 0, 6 * k + e] = c * n[e]
                for f in range(3):
                    gradient[i, 1 + f, 6 * k + e] = c * ((1.0 if e == f else 0.0) - n[e] * n[f])
        for row in range(4):
            rate[i, row] = 0.0
            for k in range(4):
                for e in range(3):
                    rate[i, row] += gradient[i, row, 6 * k + e] * rates[bodies[i, k], e]


@kernel
def _directions(places: np.ndarray, found: Found, i: int, t: np.ndarray, inverse: np.ndarray) -> int:
    """Write the free directions t (2, 3) of closest points i, and G^-1 (2, 2); returns k."""
    k = found.free[i]
    t[:] = 0.0
    for a in range(k):
        for m in range(4):
            for e in range(3):
                t[a, e] += found.directions[i, a, m] * places[found.nodes[i, m], e]
    inverse[:] = 0.0
    if k == 1:
        inverse[0, 0] = 1.0 / dot(t[0], t[0])
    elif k == 2:
        one, two, both = dot(t[0], t[0]), dot(t[1], t[1]), dot(t[0], t[1])
        whole = one * two - both * both
        if whole > 1e-14 * one * two:
            inverse[0, 0], inverse[1, 1] = two / whole, one / whole
            inverse[0, 1] = inverse[1, 0] = -both / whole
        else:
            inverse[0, 0] = 1.0 / one
    return k


@kernel
def _second_derivatives(
    places: np.ndarray, found: Found, i: int, scratch: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    hessian: np.ndarray, slip_second: np.ndarray,
) -> None:  # fmt: skip
    """Write d2g (12, 12) and the derivatives (12, 12, 3) of the slip's gradient by translations."""
    t, inverse, project, by_beta, turn = scratch
    k = _directions(places, found, i, t, inverse)
    n, c, tau, g = found.normal[i], found.coefficients[i], found.directions[i], found.distance[i]
    for e in range(3):
        for f in range(3):
            project[e, f] = (1.0 if e == f else 0.0) - n[e] * n[f]
            for a in range(k):
                for b in range(k):
                    project[e, f] -= t[a, e] * inverse[a, b] * t[b, f]
    if k == 2 or g == 0.0:
        project[:] = 0.0
        g_inverse = 0.0
    else:
        g_inverse = 1.0 / g
    # coordinate (node m, component e): by_beta = dbeta, turn = dn
    for m in range(4):
        for e in range(3):
            for f in range(3):
                turn[3 * m + e, f] = project[f, e] * c[m] * g_inverse
            for a in range(2):
                by_beta[3 * m + e, a] = 0.0
            for a in range(k):
                for b in range(k):
                    of_b = tau[b, m] * n[e]
                    by_beta[3 * m + e, a] += inverse[a, b] * (t[b, e] * c[m] + g * of_b)
                    for f in range(3):
                        turn[3 * m + e, f] -= t[a, f] * inverse[a, b] * of_b
    for one in range(12):
        m, e = one // 3, one % 3
        for two in range(12):
            # d2g = dn.(c dx) + n.(dc dx), of coordinate `one` in direction `two`
            shift = 0.0
            for a in range(k):
                shift -= tau[a, m] * by_beta[two, a]
            hessian[one, two] = turn[two, e] * c[m] + n[e] * shift
            for f in range(3):
                same = 1.0 if e == f else 0.0
                slip_second[one, two, f] = (same - n[e] * n[f]) * shift - c[m] * (
                    turn[two, e] * n[f] + n[e] * turn[two, f]
                )


@kernel
def _add_translations(
    block: np.ndarray, dof: np.ndarray, bodies: np.ndarray, indptr: np.ndarray, indices: np.ndarray, data: np.ndarray
) -> None:
    """Add a matrix (12, 12) of the translations of four bodies to block data."""
    for i in range(4):
        for j in range(4):
            k = find_slot(indptr, indices, dof[bodies[i]], dof[bodies[j]])
            if k < 0:
                continue
            for e in range(3):
                for f in range(3):
                    data[k, e, f] += block[3 * i + e, 3 * j + f]


@kernel
def tangent_features(
    places: np.ndarray, rates: np.ndarray, bodies: np.ndarray, gradient: np.ndarray, found: Found, forces: ContactForces,
    index: BlockIndex, stiffness_data: np.ndarray, damping_data: np.ndarray,
) -> None:  # fmt: skip
    """Add K and D of contacts at closest points; `bodies` and `gradient` from `write_features`."""
    scratch = np.empty((2, 3)), np.empty((2, 2)), np.empty((3, 3)), np.empty((12, 2)), np.empty((12, 3))
    hessian, slip_second, own = np.empty((12, 12)), np.empty((12, 12, 3)), np.empty((4, 12))
    block_k, block_d = np.empty((12, 12)), np.empty((12, 12))
    dof, indptr, indices = index
    for i in range(bodies.shape[0]):
        _second_derivatives(places, found, i, scratch, hessian, slip_second)
        for row in range(4):
            for one in range(12):
                own[row, one] = gradient[i, row, 6 * (one // 3) + one % 3]
        write_contact_tangent(i, rates, bodies[i], own, 3, hessian, slip_second, forces, block_k, block_d)
        _add_translations(block_k, dof, bodies[i], indptr, indices, stiffness_data)
        _add_translations(block_d, dof, bodies[i], indptr, indices, damping_data)


@kernel
def _directions_of(places: np.ndarray, found: Found, i: int, u: np.ndarray, v: np.ndarray) -> tuple[float, float, float]:
    """Write the vectors u (3,) and v (3,) along two edges; returns u.v, u.u and v.v."""
    for e in range(3):
        u[e] = places[found.nodes[i, 1], e] - places[found.nodes[i, 0], e]
        v[e] = places[found.nodes[i, 3], e] - places[found.nodes[i, 2], e]
    return dot(u, v), dot(u, u), dot(v, v)


@kernel
def _parallel(places: np.ndarray, found: Found, begin: int, end: int, least: float) -> np.ndarray:
    """Rows of edges whose sin^2 is below `least`."""
    u, v = np.empty(3), np.empty(3)
    rows, number = np.empty(end - begin, dtype=np.int64), 0
    for i in range(begin, end):
        p, a, b = _directions_of(places, found, i, u, v)
        if 1.0 - p * p / (a * b) < least:
            rows[number] = i
            number += 1
    return rows[:number]


@kernel
def parallel_weights(
    places: np.ndarray, found: Found, begin: int, end: int, least: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Weights of nearly parallel edges, whose closest points jump: y (2 - y), y = sin^2/least (Li et al., 2020).

    The edges are in rows from `begin` up to, and without, `end`.

    Returns
    -------
    rows : (m,) int array
        Pairs of edges with sin^2 below `least`.
    part, gradient, hessian : (m,), (m, 24) and (m, 24, 24) arrays
        Weight and its derivatives.
    """
    rows = _parallel(places, found, begin, end, least)
    count = rows.shape[0]
    part, gradient, hessian = np.empty(count), np.zeros((count, SIZE)), np.zeros((count, SIZE, SIZE))
    u, v = np.empty(3), np.empty(3)
    slope, curve = np.empty((3, 6)), np.empty((3, 6, 6))
    for number in range(count):
        # y is a function of p = u.v, a = u.u, b = v.v, which are quadratic in (u, v)
        p, a, b = _directions_of(places, found, rows[number], u, v)
        square = 1.0 - p * p / (a * b)
        slope[:] = 0.0
        curve[:] = 0.0
        for e in range(3):
            slope[0, e], slope[0, 3 + e] = v[e], u[e]
            slope[1, e], slope[2, 3 + e] = 2.0 * u[e], 2.0 * v[e]
            curve[0, e, 3 + e] = curve[0, 3 + e, e] = 1.0
            curve[1, e, e] = curve[2, 3 + e, 3 + e] = 2.0
        first = -2.0 * p / (a * b), p * p / (a * a * b), p * p / (a * b * b)
        second = (
            (-2.0 / (a * b), 2.0 * p / (a * a * b), 2.0 * p / (a * b * b)),
            (2.0 * p / (a * a * b), -2.0 * p * p / (a**3 * b), -p * p / (a * a * b * b)),
            (2.0 * p / (a * b * b), -p * p / (a * a * b * b), -2.0 * p * p / (a * b**3)),
        )  # fmt: skip
        y = square / least
        by, by_by = 2.0 * (1.0 - y) / least, -2.0 / (least * least)
        part[number] = y * (2.0 - y)
        for one in range(6):
            d_one = 0.0
            for x in range(3):
                d_one += first[x] * slope[x, one]
            for tip in range(2):
                sign = 1.0 if tip == 1 else -1.0
                gradient[number, 6 * (2 * (one // 3) + tip) + one % 3] = sign * by * d_one
            for two in range(6):
                d_two = d_both = 0.0
                for x in range(3):
                    d_two += first[x] * slope[x, two]
                    d_both += first[x] * curve[x, one, two]
                    for z in range(3):
                        d_both += second[x][z] * slope[x, one] * slope[z, two]
                value = by * d_both + by_by * d_one * d_two
                for tip in range(2):
                    for other in range(2):
                        sign = 1.0 if tip == other else -1.0
                        hessian[number, 6 * (2 * (one // 3) + tip) + one % 3, 6 * (2 * (two // 3) + other) + two % 3] = (
                            sign * value
                        )
    return rows, part, gradient, hessian
