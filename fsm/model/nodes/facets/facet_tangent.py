"""Tangents of ANCF-DKT triangles with damping, in packs of triangles; see `fsm.model.nodes.facets.facet`.

With the derivatives G (24 x 27) of strains and curvatures e by the nodal vectors, their moduli C and their efforts s:

    -dh/dq = G^T C G + sum_r s_r d^2 e_r/dq^2 + tau G^T C dG/dt,    -dh/du = tau G^T C G

The third term is zero if the rates are differences over a step.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.model.nodes.facets import facet
from fsm.model.nodes.facets.facet import BEND_MODULI, LANES, MODULI, MOMENTS, NORMALS, ROWS, SLOPES, STRETCH, VECTORS
from fsm.model.nodes.facets.facet_tension import relax_moduli

_CURVATURES, _GRADIENTS, _SQUARE = 15, 24 * 27, 27 * 27
"""First row of curvatures in G, and numbers of entries of G and of a tangent."""
_NORMALS, _ON_N, _ON_REST, _SLOPES, _ACROSS, _BENT, _HALF, _BENDING, _SCRATCH = 0, 18, 24, 30, 66, 84, 93, 255, 259
"""First rows of the scratch of the second derivatives of curvatures, and their number."""


@kernel
def _place_gradients(constants: np.ndarray, w: np.ndarray, out: np.ndarray) -> None:
    """Write G of the strains. The zeros of corner strains, outside the columns of their slopes, are not written."""
    for edge in range(3):
        start, across = SLOPES + 9 * edge, SLOPES + 27 + 3 * edge
        for i in range(9):
            along, side = ROWS + 27 * edge + i, ROWS + 81 + 9 * edge + i
            for a in range(3):
                stretch, turn = 27 * edge + 3 * i + a, 27 * (12 + edge) + 3 * i + a
                for k in range(LANES):
                    c0, c1 = constants[along * LANES + k], constants[(along + 9) * LANES + k]
                    c2, c3 = constants[(along + 18) * LANES + k], constants[side * LANES + k]
                    p0, p1 = w[(start + a) * LANES + k], w[(start + 3 + a) * LANES + k]
                    p2, p3 = w[(start + 6 + a) * LANES + k], w[(across + a) * LANES + k]
                    out[stretch * LANES + k] = (c0 * p0 + 4.0 * c1 * p1 + c2 * p2) / 6.0
                    out[turn * LANES + k] = (c2 - c0) * p3 + c3 * (p2 - p0)
        for a in range(3):
            x, first = VECTORS + 9 * edge + 3 + a, 27 * (3 + 3 * edge) + 9 * edge + 3 + a
            for k in range(LANES):
                ex, ey = w[x * LANES + k], w[(x + 3) * LANES + k]
                out[first * LANES + k] = ex
                out[(first + 3) * LANES + k] = 0.0
                out[(first + 27) * LANES + k] = 0.0
                out[(first + 30) * LANES + k] = ey
                out[(first + 54) * LANES + k] = ey
                out[(first + 57) * LANES + k] = ex


@kernel
def _map_curvature(constants: np.ndarray, point: int, i: int, by: np.ndarray, out: np.ndarray) -> None:
    """Write one row of G of curvatures from its derivatives `by` (9 rows) by r_X, r_Y and the curvature vector."""
    first, x, y, bent = 27 * (_CURVATURES + 3 * point + i), 27 * point + 9, 81 + 9 * point, 108 + 27 * point + 9 * i
    for v in range(9):
        for a in range(3):
            for k in range(LANES):
                out[(first + 3 * v + a) * LANES + k] = (
                    constants[(ROWS + x + v) * LANES + k] * by[a * LANES + k]
                    + constants[(ROWS + y + v) * LANES + k] * by[(3 + a) * LANES + k]
                    + constants[(ROWS + bent + v) * LANES + k] * by[(6 + a) * LANES + k]
                )  # fmt: skip


@kernel(inline=True)
def _vector(w: np.ndarray, row: int, k: int) -> tuple[float, float, float]:
    return w[row * LANES + k], w[(row + 1) * LANES + k], w[(row + 2) * LANES + k]


@kernel(inline=True)
def _put(w: np.ndarray, row: int, k: int, x: float, y: float, z: float) -> None:
    w[row * LANES + k], w[(row + 1) * LANES + k], w[(row + 2) * LANES + k] = x, y, z


@kernel
def _place_curvatures(constants: np.ndarray, w: np.ndarray, by: np.ndarray, out: np.ndarray) -> None:
    """Write G of the curvatures; `by` is scratch."""
    for point in range(3):
        x, y, n = SLOPES + 9 * point + 3, SLOPES + 27 + 3 * point, NORMALS + 4 * point
        for i in range(3):
            bent = SLOPES + 36 + 9 * point + 3 * i
            for k in range(LANES):
                n0, n1, n2 = _vector(w, n, k)
                b0, b1, b2 = _vector(w, bent, k)
                per_size, along = w[(n + 3) * LANES + k], n0 * b0 + n1 * b1 + n2 * b2
                c0, c1, c2 = (b0 - along * n0) * per_size, (b1 - along * n1) * per_size, (b2 - along * n2) * per_size
                x0, x1, x2 = _vector(w, x, k)
                y0, y1, y2 = _vector(w, y, k)
                _put(by, 0, k, y1 * c2 - y2 * c1, y2 * c0 - y0 * c2, y0 * c1 - y1 * c0)
                _put(by, 3, k, c1 * x2 - c2 * x1, c2 * x0 - c0 * x2, c0 * x1 - c1 * x0)
                _put(by, 6, k, n0, n1, n2)
            _map_curvature(constants, point, i, by, out)


@kernel
def _place_curvature_rates(constants: np.ndarray, w: np.ndarray, v: np.ndarray, by: np.ndarray, out: np.ndarray) -> None:
    """Write the rates of G of the curvatures at velocities v; `by` is scratch."""
    for point in range(3):
        x, y, n = SLOPES + 9 * point + 3, SLOPES + 27 + 3 * point, NORMALS + 4 * point
        for i in range(3):
            bent = SLOPES + 36 + 9 * point + 3 * i
            for k in range(LANES):
                n0, n1, n2 = _vector(w, n, k)
                x0, x1, x2 = _vector(w, x, k)
                y0, y1, y2 = _vector(w, y, k)
                u0, u1, u2 = _vector(v, x, k)
                v0, v1, v2 = _vector(v, y, k)
                b0, b1, b2 = _vector(w, bent, k)
                d0, d1, d2 = _vector(v, bent, k)
                per_size = w[(n + 3) * LANES + k]
                t0 = u1 * y2 - u2 * y1 + (x1 * v2 - x2 * v1)
                t1 = u2 * y0 - u0 * y2 + (x2 * v0 - x0 * v2)
                t2 = u0 * y1 - u1 * y0 + (x0 * v1 - x1 * v0)
                grown = n0 * t0 + n1 * t1 + n2 * t2
                t0, t1, t2 = (t0 - grown * n0) * per_size, (t1 - grown * n1) * per_size, (t2 - grown * n2) * per_size
                grown, along = grown * per_size, n0 * b0 + n1 * b1 + n2 * b2
                changed = t0 * b0 + t1 * b1 + t2 * b2 + (n0 * d0 + n1 * d1 + n2 * d2)
                c0, c1, c2 = (b0 - along * n0) * per_size, (b1 - along * n1) * per_size, (b2 - along * n2) * per_size
                r0 = (d0 - changed * n0 - along * t0) * per_size - grown * c0
                r1 = (d1 - changed * n1 - along * t1) * per_size - grown * c1
                r2 = (d2 - changed * n2 - along * t2) * per_size - grown * c2
                z0 = v1 * c2 - v2 * c1 + (y1 * r2 - y2 * r1)
                z1 = v2 * c0 - v0 * c2 + (y2 * r0 - y0 * r2)
                z2 = v0 * c1 - v1 * c0 + (y0 * r1 - y1 * r0)
                _put(by, 0, k, z0, z1, z2)
                z0 = r1 * x2 - r2 * x1 + (c1 * u2 - c2 * u1)
                z1 = r2 * x0 - r0 * x2 + (c2 * u0 - c0 * u2)
                z2 = r0 * x1 - r1 * x0 + (c0 * u1 - c1 * u0)
                _put(by, 3, k, z0, z1, z2)
                _put(by, 6, k, t0, t1, t2)
            _map_curvature(constants, point, i, by, out)


@kernel(inline=True)
def _add_products(x: np.ndarray, per_row: int, y: np.ndarray, out: np.ndarray) -> None:
    """Add X^T Y of three rows of three columns. Rows of X have `per_row` columns, those of Y and of the result 27.

    The arrays begin at the first entries: with constant offsets, the compiler knows that no index is negative, and computes
    several lanes at once.
    """
    for k in range(LANES):
        t00, t01, t02 = out[k], out[LANES + k], out[2 * LANES + k]
        t10, t11, t12 = out[27 * LANES + k], out[28 * LANES + k], out[29 * LANES + k]
        t20, t21, t22 = out[54 * LANES + k], out[55 * LANES + k], out[56 * LANES + k]
        for r in range(3):
            x0, x1, x2 = _vector(x, per_row * r, k)
            y0, y1, y2 = _vector(y, 27 * r, k)
            t00, t01, t02 = t00 + x0 * y0, t01 + x0 * y1, t02 + x0 * y2
            t10, t11, t12 = t10 + x1 * y0, t11 + x1 * y1, t12 + x1 * y2
            t20, t21, t22 = t20 + x2 * y0, t21 + x2 * y1, t22 + x2 * y2
        _put(out, 0, k, t00, t01, t02)
        _put(out, 27, k, t10, t11, t12)
        _put(out, 54, k, t20, t21, t22)


@kernel
def _weigh(moduli: np.ndarray, first: int, g: np.ndarray, out: np.ndarray) -> None:
    """Write the rows of strains of C G, with symmetric moduli from a row on."""
    out[: 15 * 27 * LANES] = 0.0
    for i in range(0, 15, 3):
        for v in range(9):
            for j in range(0, 15, 3):
                if j in (0, 12) or (j == v // 3 * 3 + 3 and v % 3 > 0):
                    _add_products(
                        moduli[(first + 15 * j + i) * LANES :], 15, g[(27 * j + 3 * v) * LANES :],
                        out[(27 * i + 3 * v) * LANES :],
                    )  # fmt: skip


@kernel
def _weigh_curvatures(constants: np.ndarray, g: np.ndarray, out: np.ndarray) -> None:
    """Write the rows of curvatures of C G."""
    out[27 * _CURVATURES * LANES :] = 0.0
    for row in range(_CURVATURES, 24, 3):
        for v in range(9):
            at = (27 * row + 3 * v) * LANES
            _add_products(constants[BEND_MODULI * LANES :], 3, g[at:], out[at:])


@kernel
def _multiply(g: np.ndarray, weighed: np.ndarray, curved: bool, upper: bool, out: np.ndarray) -> None:
    """Write G^T (C G), with or without the rows of curvatures, the whole matrix or its blocks from the diagonal on."""
    out[:] = 0.0
    for v in range(9):
        for u in range(v if upper else 0, 9):
            for row in range(0, 24 if curved else 15, 3):
                if row in (0, 12) or row >= _CURVATURES or (row == v // 3 * 3 + 3 and v % 3 > 0):
                    _add_products(
                        g[(27 * row + 3 * v) * LANES :], 27, weighed[(27 * row + 3 * u) * LANES :],
                        out[(81 * v + 3 * u) * LANES :],
                    )  # fmt: skip


@kernel
def _add_geometric(constants: np.ndarray, efforts: np.ndarray, out: np.ndarray) -> None:
    """Add the geometric stiffness of membrane efforts, which is equal for x, y and z, to an upper triangle."""
    part = np.empty(LANES)
    for i in range(9):
        for j in range(i, 9):
            part[:] = 0.0
            for edge in range(3):
                x, y, stretch, turn = ROWS + 27 * edge + i, ROWS + 27 * edge + j, STRETCH + edge, STRETCH + 12 + edge
                p, q = ROWS + 81 + 9 * edge + i, ROWS + 81 + 9 * edge + j
                for k in range(LANES):
                    x0, x2, y0 = constants[x * LANES + k], constants[(x + 18) * LANES + k], constants[y * LANES + k]
                    y2, middle = constants[(y + 18) * LANES + k], constants[(x + 9) * LANES + k]
                    simpson = x0 * y0 + 4.0 * middle * constants[(y + 9) * LANES + k] + x2 * y2
                    turned = (x2 - x0) * constants[q * LANES + k] + (y2 - y0) * constants[p * LANES + k]
                    part[k] += efforts[stretch * LANES + k] * simpson / 6.0 + efforts[turn * LANES + k] * turned
            row, vector, other = STRETCH + 3 + 3 * (i // 3), i % 3, j % 3
            if i // 3 == j // 3 and vector > 0:
                row += 2 if vector != other else vector - 1
                for k in range(LANES):
                    part[k] += efforts[row * LANES + k]
            for a in range(3):
                at = 27 * (3 * i + a) + 3 * j + a
                for k in range(LANES):
                    out[at * LANES + k] += part[k]


@kernel
def _add_second_curvatures(
    constants: np.ndarray, w: np.ndarray, efforts: np.ndarray, t: np.ndarray, out: np.ndarray
) -> None:
    """Add the second derivatives of moments times curvatures to an upper triangle; see `fsm.model.nodes.curvature`. `t` is
    scratch: dn (3 x 6), N . dn, P r_ij . dn, half of the second derivatives by two slopes (6 x 6), those by a slope and
    m . r_ij, m . r_ij from the nodal vectors, half of the matrix by slopes (6 x 27), m . r_ij and n . m . r_ij.
    """
    for point in range(3):
        x, y, n, m = SLOPES + 9 * point + 3, SLOPES + 27 + 3 * point, NORMALS + 4 * point, MOMENTS + 3 * point
        bent, rx, ry = SLOPES + 36 + 9 * point, ROWS + 27 * point + 9, ROWS + 81 + 9 * point
        for k in range(LANES):
            x0, x1, x2 = _vector(w, x, k)
            y0, y1, y2 = _vector(w, y, k)
            _put(t, _NORMALS, k, 0.0, y2, -y1)
            _put(t, _NORMALS + 3, k, 0.0, -x2, x1)
            _put(t, _NORMALS + 6, k, -y2, 0.0, y0)
            _put(t, _NORMALS + 9, k, x2, 0.0, -x0)
            _put(t, _NORMALS + 12, k, y1, -y0, 0.0)
            _put(t, _NORMALS + 15, k, -x1, x0, 0.0)
            m0, m1, m2 = _vector(efforts, m, k)
            n0, n1, n2 = _vector(w, n, k)
            s0 = m0 * w[bent * LANES + k] + m1 * w[(bent + 3) * LANES + k] + m2 * w[(bent + 6) * LANES + k]
            s1 = m0 * w[(bent + 1) * LANES + k] + m1 * w[(bent + 4) * LANES + k] + m2 * w[(bent + 7) * LANES + k]
            s2 = m0 * w[(bent + 2) * LANES + k] + m1 * w[(bent + 5) * LANES + k] + m2 * w[(bent + 8) * LANES + k]
            _put(t, _BENDING, k, s0, s1, s2)
            t[(_BENDING + 3) * LANES + k] = n0 * s0 + n1 * s1 + n2 * s2
        for i in range(6):
            d, on, across = t[(_NORMALS + i) * LANES :], t[(_ON_N + i) * LANES :], t[(_ACROSS + 3 * i) * LANES :]
            for k in range(LANES):
                n0, n1, n2 = _vector(w, n, k)
                s0, s1, s2 = _vector(t, _BENDING, k)
                d0, d1, d2, per_size = d[k], d[6 * LANES + k], d[12 * LANES + k], w[(n + 3) * LANES + k]
                on_n = n0 * d0 + n1 * d1 + n2 * d2
                on[k] = on_n
                on[6 * LANES + k] = s0 * d0 + s1 * d1 + s2 * d2 - t[(_BENDING + 3) * LANES + k] * on_n
                d0, d1, d2 = (d0 - on_n * n0) * per_size, (d1 - on_n * n1) * per_size, (d2 - on_n * n2) * per_size
                _put(across, 0, k, d0, d1, d2)
        for i in range(6):
            di, on_i = t[(_NORMALS + i) * LANES :], t[(_ON_N + i) * LANES :]
            for j in range(6):
                dj, on_j, to = t[(_NORMALS + j) * LANES :], t[(_ON_N + j) * LANES :], t[(_SLOPES + 6 * i + j) * LANES :]
                for k in range(LANES):
                    per_size, six, twelve = w[(n + 3) * LANES + k], 6 * LANES + k, 12 * LANES + k
                    plane = di[k] * dj[k] + di[six] * dj[six] + di[twelve] * dj[twelve] - on_i[k] * on_j[k]
                    both = on_i[k] * on_j[six] + on_i[six] * on_j[k]
                    to[k] = -0.5 * per_size * per_size * (both + t[(_BENDING + 3) * LANES + k] * plane)
        for k in range(LANES):  # c . (dr_X x dr_Y) in both orders
            n0, n1, n2 = _vector(w, n, k)
            s0, s1, s2 = _vector(t, _BENDING, k)
            half, along = 0.5 * w[(n + 3) * LANES + k], t[(_BENDING + 3) * LANES + k]
            c0, c1, c2 = (s0 - along * n0) * half, (s1 - along * n1) * half, (s2 - along * n2) * half
            t[(_SLOPES + 4) * LANES + k] += c2
            t[(_SLOPES + 5) * LANES + k] -= c1
            t[(_SLOPES + 9) * LANES + k] -= c2
            t[(_SLOPES + 11) * LANES + k] += c0
            t[(_SLOPES + 15) * LANES + k] += c1
            t[(_SLOPES + 16) * LANES + k] -= c0
            t[(_SLOPES + 24) * LANES + k] += c2
            t[(_SLOPES + 30) * LANES + k] -= c1
            t[(_SLOPES + 19) * LANES + k] -= c2
            t[(_SLOPES + 31) * LANES + k] += c0
            t[(_SLOPES + 20) * LANES + k] += c1
            t[(_SLOPES + 26) * LANES + k] -= c0
        for v in range(9):
            row = ROWS + 108 + 27 * point + v
            for k in range(LANES):
                m0, m1, m2 = _vector(efforts, m, k)
                t[(_BENT + v) * LANES + k] = (
                    m0 * constants[row * LANES + k] + m1 * constants[(row + 9) * LANES + k]
                    + m2 * constants[(row + 18) * LANES + k]
                )  # fmt: skip
        for i in range(6):
            slope, across = t[(_SLOPES + 6 * i) * LANES :], t[(_ACROSS + 3 * i) * LANES :]
            for v in range(9):
                half, bent_v = t[(_HALF + 27 * i + 3 * v) * LANES :], t[(_BENT + v) * LANES :]
                for k in range(LANES):
                    cx, cy, cb = constants[(rx + v) * LANES + k], constants[(ry + v) * LANES + k], bent_v[k]
                    for a in range(3):
                        at = a * LANES + k
                        half[at] = slope[at] * cx + slope[3 * LANES + at] * cy + across[at] * cb
        for v in range(9):
            xv, yv, two = constants[(rx + v) * LANES :], constants[(ry + v) * LANES :], t[(_HALF + 3 * v) * LANES :]
            for u in range(v, 9):
                xu, yu, one = constants[(rx + u) * LANES :], constants[(ry + u) * LANES :], t[(_HALF + 3 * u) * LANES :]
                to = out[(81 * v + 3 * u) * LANES :]
                for k in range(LANES):
                    for a in range(3):
                        for b in range(3):
                            at, other = (27 * a + b) * LANES + k, (27 * b + a) * LANES + k
                            to[at] += (xv[k] * one[at] + yv[k] * one[81 * LANES + at]) + (
                                xu[k] * two[other] + yu[k] * two[81 * LANES + other]
                            )


@kernel
def _relax(facets: facet.FacetArrays, pack: int, w: np.ndarray, moduli: np.ndarray) -> None:
    """Write the moduli of strains with the tension field, 225 rows."""
    own, strains = np.empty((15, 15)), np.empty((5, 3))
    for k in range(LANES):
        at = min(pack * LANES + k, facets.tension.shape[0] - 1)
        facet.of_lane(facets.constants[pack], MODULI, k, own)
        facet.of_lane(w, facet.STRAINS, k, strains)
        relax_moduli(facets.points[at], facets.tension[at], strains, own)
        for i in range(225):
            moduli[i * LANES + k] = own[i // 15, i % 15]


@kernel
def _add_flat(bending: np.ndarray, out: np.ndarray) -> None:
    """Add the stiffness of bending of flat triangles to an upper triangle."""
    for i in range(9):
        for j in range(i, 9):
            for a in range(3):
                for k in range(LANES):
                    out[(27 * (3 * i + a) + 3 * j + a) * LANES + k] += bending[(9 * i + j) * LANES + k]


@kernel
def _scatter(square: np.ndarray, upper: bool, factor: float, slots: np.ndarray, size: int, out: np.ndarray) -> None:
    """Add the matrices of a pack times a factor to flat block data at the slots (m, 9, 9); from the `upper` triangles, whose
    mirror images make the sums symmetric to the last bit, or from transposed whole matrices.
    """
    if upper:
        for v in range(9):
            block = square[84 * v * LANES :]
            for k in range(LANES):
                block[27 * LANES + k], block[54 * LANES + k] = block[LANES + k], block[2 * LANES + k]
                block[55 * LANES + k] = block[29 * LANES + k]
    for k in range(slots.shape[0]):
        for v in range(9):
            for u in range(9):
                to = out[slots[k, v, u] :]
                if upper and u >= v:
                    _add_block(square[(81 * v + 3 * u) * LANES + k :], 27, 1, factor, size, to)
                else:
                    _add_block(square[(81 * u + 3 * v) * LANES + k :], 1, 27, factor, size, to)


@kernel(inline=True)
def _add_block(block: np.ndarray, by_row: int, by_column: int, factor: float, size: int, out: np.ndarray) -> None:
    """Add a block of one triangle times a factor; the distances of its entries are given."""
    for a in range(3):
        for b in range(3):
            out[a * size + b] += factor * block[(by_row * a + by_column * b) * LANES]


@kernel
def add_facet_tangent(
    facets: facet.FacetArrays, q: np.ndarray, given: np.ndarray, damping: facet.Damping, slots: np.ndarray, size: int,
    stiffness: np.ndarray, into_damping: np.ndarray,
) -> None:  # fmt: skip
    """Add -dh/dq and -dh/du to the flat block data.

    Parameters
    ----------
    facets : FacetArrays
    q : (n,) array
    given : (m, 5, 3) array
        Membrane efforts of the geometric stiffness; if empty, the efforts at q are used.
    damping : Damping
    slots : (m, 9, 9) int array
    size : size of the blocks
    stiffness, into_damping : flat block data, changed in place
    """
    w, v, efforts = np.empty(facet.STATE * LANES), np.zeros(facet.STATE * LANES), np.empty(facet.EFFORTS * LANES)
    g, weighed, changes = np.empty(_GRADIENTS * LANES), np.empty(_GRADIENTS * LANES), np.empty(_GRADIENTS * LANES)
    h, d, further = np.empty(_SQUARE * LANES), np.empty(_SQUARE * LANES), np.empty(_SQUARE * LANES)
    scratch, moduli = np.empty(_SCRATCH * LANES), np.empty(225 * LANES)
    flat, tense, tau = facets.bending.shape[0] > 0, facets.tension.shape[0] > 0, damping.tau
    damped, moving, elastic = tau > 0.0, tau > 0.0 and damping.over == 0.0, damping.elastic
    for pack in range(facets.packed.shape[0]):
        vectors, constants = facets.packed[pack], facets.constants[pack]
        facet.place(vectors, constants, q, w)
        facet.measure(constants, w)
        facet.place_rates(vectors, constants, damping, w, v)
        stretched = 0.0 if given.shape[0] > 0 else elastic
        facet.place_efforts(constants, w, v, stretched, 0.0 if flat else elastic, tau, efforts)
        count = min(LANES, facets.vectors.shape[0] - pack * LANES)
        if elastic == 0.0:
            h[:] = 0.0
        elif given.shape[0] > 0:
            for k in range(count):
                for i in range(15):
                    efforts[(STRETCH + i) * LANES + k] += given[pack * LANES + k, i // 3, i % 3]
        else:
            facet.relax(facets, pack, w, efforts)
        _place_gradients(constants, w, g)
        if damped or not flat:
            _place_curvatures(constants, w, scratch, g)
        if damped or not (flat or tense):
            _weigh(constants, MODULI, g, weighed)
            _weigh_curvatures(constants, g, weighed)
            _multiply(g, weighed, True, True, d)
        if moving:
            _place_gradients(constants, v, changes)  # strains are quadratic
            _place_curvature_rates(constants, w, v, scratch, changes)
            _multiply(changes, weighed, True, False, further)
        if elastic > 0.0 and (flat or tense):
            if tense:
                _relax(facets, pack, w, moduli)
            _weigh(moduli if tense else constants, 0 if tense else MODULI, g, weighed)
            if not flat:
                _weigh_curvatures(constants, g, weighed)
            _multiply(g, weighed, not flat, True, h)
        elif elastic > 0.0:
            h[:] = d
        _add_geometric(constants, efforts, h)
        if flat and elastic > 0.0:
            _add_flat(facets.bending[pack], h)
        if damped or not flat:
            _add_second_curvatures(constants, w, efforts, scratch, h)
        own = slots[pack * LANES : pack * LANES + count]
        _scatter(h, True, 1.0, own, size, stiffness)
        if damped:
            _scatter(d, True, tau, own, size, into_damping)
        if moving:
            _scatter(further, False, tau, own, size, stiffness)
