"""Kernels of ANCF-DKT triangles: energy, force, tangent and membrane efforts of flexible facets.

Stretch: fifteen scalars that rigid motions do not change, and their constant moduli (`membrane_moduli` in
`fsm.model.nodes.facets.facet_shape`). The scalars are the mean Green strains of the three edges (Simpson's rule), the Green
strains of the slopes at the corners, and the rotations of the edges within the surface. An edge from a to b with tangent t
and normal n rotates by

    (F_b t - F_a t) . (F_a n + F_b n)/2,    F = [r_X, r_Y]

Bending of a triangle that is flat at rest: U_b = 1/2 sum A/3 kappa D kappa with curvature vectors kappa, a constant matrix.
With a rest curvature k0, the components n . kappa - k0 along the unit normal n replace kappa. The rows and matrices are
those of `fsm.model.nodes.facets.facet_shape`.

Damping (Kelvin-Voigt): efforts in proportion to the rates of strains e_s' and curvatures kappa_i' along the normal, with the
moduli C and D of the elastic energy, which dissipate

    P = tau (sum C_rs e_r' e_s' + sum D_ij kappa_i' kappa_j'),    e_s' = e_s,q . u,    kappa_i' = kappa_i,q . u

Rigid motions change none of these scalars and lose no energy. In a step of a path, the rates are differences over the step.

Sixteen triangles form a pack: numbers of the same kind stand side by side, so that machine code computes several triangles
at once. A pack has rows of sixteen numbers. Row i of an array is its numbers 16 i to 16 i + 15.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.model.nodes.facets.facet_tension import relax_efforts, relax_energy

LANES = 16
"""Triangles of a pack. Of 8 and 16, 16 are twice as fast (`validation/benchmarks/README.md`)."""
SLOPE_ROWS = 21
"""Rows over the nine nodal vectors: along the three edges at start, middle and end; across the middles of the edges; the
curvature vectors xx, yy, xy at the three middles."""
ROWS, _REST, MODULI, BEND_MODULI, _REST_CURVATURE, CONSTANTS = 0, 189, 204, 429, 438, 447
"""First rows of the constants of a pack, and their number."""
VECTORS, SLOPES, STRAINS, NORMALS, _CURVATURES, STATE = 0, 27, 90, 105, 117, 126
"""First rows of the state of a pack, and their number: nodal vectors (9 x 3), their slopes and curvature vectors (21 x 3),
strains (15), unit normals with 1/|r_X x r_Y| at the middles of the edges (3 x 4), curvatures (3 x 3)."""
STRETCH, MOMENTS, _WORK, _FORCE, EFFORTS = 0, 15, 24, 87, 114
"""First rows of the efforts of a pack, and their number: of strains (15), of curvatures (3 x 3), of slopes and curvature
vectors (21 x 3), of nodal vectors (9 x 3)."""


class FacetArrays(NamedTuple):
    """Arrays of m triangles in g packs; the last pack repeats the last triangle.

    Attributes
    ----------
    vectors : (m, 9) int array
        First coordinates of r, r_1, r_2 at the corners.
    packed : (g, 144) int array
        The same in packs, 9 rows.
    constants : (g, 7152) array
        Rows of packs: slopes and curvature vectors from the nodal vectors (21 x 9), strains at rest (15: of the three edges;
        exx, eyy, 2 exy at each corner; rotations of the edges), moduli of these strains times the area (15 x 15, N m),
        moduli of bending for kxx, kyy, kxy times a third of the area (3 x 3, N m^3), curvatures at rest (3 x 3, 1/m).
    bending : (g, 1296) array, N/m
        Stiffness of bending (9 x 9 rows) of triangles that are flat at rest; empty if they are curved.
    points : (m, 3, 3, 15) array
        Strain at the middles of the edges from these strains; empty if the law is plain.
    tension : (m, 5) array
        Tension field, as in `fsm.model.nodes.facets.facet_tension.relax_energy`; empty if the law is plain.
    """

    vectors: np.ndarray
    packed: np.ndarray
    constants: np.ndarray
    bending: np.ndarray
    points: np.ndarray
    tension: np.ndarray


class Damping(NamedTuple):
    """Damping at a state.

    Attributes
    ----------
    tau : s; 0 without damping
    over : s
        Rates are differences over this time; 0: rates of velocities.
    other : (n,) array
        Velocities, or coordinates at the start of the step.
    elastic : 1, or 0 for forces and tangents of the damping alone
    """

    tau: float
    over: float
    other: np.ndarray
    elastic: float


def packed(values: np.ndarray) -> np.ndarray:
    """Values (m, ...) of triangles in packs, (g, 16 ...)."""
    rows = values.reshape(len(values), -1)
    whole = np.concatenate([rows, np.repeat(rows[-1:], -len(rows) % LANES, axis=0)])
    packs = whole.reshape(-1, LANES, rows.shape[1]).transpose(0, 2, 1)
    return np.ascontiguousarray(packs).reshape(-1, LANES * rows.shape[1])


@kernel
def place(packed: np.ndarray, constants: np.ndarray, q: np.ndarray, w: np.ndarray) -> None:
    """Write nodal vectors and their slopes into a state.

    Positions are relative to the first corner. No strain or curvature depends on this position, and round-off then belongs
    to the size of a triangle, not of the sheet.
    """
    for i in range(9):
        for k in range(LANES):
            first = packed[i * LANES + k]
            for a in range(3):
                w[(3 * i + a) * LANES + k] = q[first + a]
    for i in (6, 3, 0):
        for a in range(3):
            for k in range(LANES):
                w[(3 * i + a) * LANES + k] -= w[a * LANES + k]
    for r in range(SLOPE_ROWS):
        for k in range(LANES):
            x = y = z = 0.0
            for i in range(9):
                c = constants[(ROWS + 9 * r + i) * LANES + k]
                x += c * w[3 * i * LANES + k]
                y += c * w[(3 * i + 1) * LANES + k]
                z += c * w[(3 * i + 2) * LANES + k]
            w[(SLOPES + 3 * r) * LANES + k] = x
            w[(SLOPES + 3 * r + 1) * LANES + k] = y
            w[(SLOPES + 3 * r + 2) * LANES + k] = z


@kernel(inline=True)
def _dot(w: np.ndarray, i: int, v: np.ndarray, j: int, k: int) -> float:
    """Product of the vectors of the rows i and j of two arrays."""
    return (
        w[i * LANES + k] * v[j * LANES + k] + w[(i + 1) * LANES + k] * v[(j + 1) * LANES + k]
        + w[(i + 2) * LANES + k] * v[(j + 2) * LANES + k]
    )  # fmt: skip


@kernel
def measure(constants: np.ndarray, w: np.ndarray) -> None:
    """Write strains relative to rest, normals, and curvatures relative to rest into a state."""
    for edge in range(3):
        start, middle, end, across = SLOPES + 9 * edge, SLOPES + 9 * edge + 3, SLOPES + 9 * edge + 6, SLOPES + 27 + 3 * edge
        x, y = VECTORS + 9 * edge + 3, VECTORS + 9 * edge + 6
        of_corner, rest = STRAINS + 3 + 3 * edge, _REST + 3 + 3 * edge
        for k in range(LANES):
            simpson = _dot(w, start, w, start, k) + 4.0 * _dot(w, middle, w, middle, k) + _dot(w, end, w, end, k)
            w[(STRAINS + edge) * LANES + k] = (simpson - 6.0) / 12.0 - constants[(_REST + edge) * LANES + k]
            turned = _dot(w, end, w, across, k) - _dot(w, start, w, across, k)
            w[(STRAINS + 12 + edge) * LANES + k] = turned - constants[(_REST + 12 + edge) * LANES + k]
        for k in range(LANES):
            w[of_corner * LANES + k] = 0.5 * (_dot(w, x, w, x, k) - 1.0) - constants[rest * LANES + k]
            w[(of_corner + 1) * LANES + k] = 0.5 * (_dot(w, y, w, y, k) - 1.0) - constants[(rest + 1) * LANES + k]
            w[(of_corner + 2) * LANES + k] = _dot(w, x, w, y, k) - constants[(rest + 2) * LANES + k]
    for point in range(3):
        x, y, n = SLOPES + 9 * point + 3, SLOPES + 27 + 3 * point, NORMALS + 4 * point
        for k in range(LANES):
            x0, x1, x2 = w[x * LANES + k], w[(x + 1) * LANES + k], w[(x + 2) * LANES + k]
            y0, y1, y2 = w[y * LANES + k], w[(y + 1) * LANES + k], w[(y + 2) * LANES + k]
            n0, n1, n2 = x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0
            per_size = 1.0 / math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
            w[n * LANES + k] = n0 * per_size
            w[(n + 1) * LANES + k] = n1 * per_size
            w[(n + 2) * LANES + k] = n2 * per_size
            w[(n + 3) * LANES + k] = per_size
        for i in range(3):
            bent, rest, out = SLOPES + 36 + 9 * point + 3 * i, _REST_CURVATURE + 3 * point + i, _CURVATURES + 3 * point + i
            for k in range(LANES):
                w[out * LANES + k] = _dot(w, n, w, bent, k) - constants[rest * LANES + k]


@kernel
def _velocities(w: np.ndarray, v: np.ndarray) -> None:
    """Write the rates of strains and curvatures into a state v of velocities."""
    for edge in range(3):
        start, middle, end, across = SLOPES + 9 * edge, SLOPES + 9 * edge + 3, SLOPES + 9 * edge + 6, SLOPES + 27 + 3 * edge
        x, y, of_corner = VECTORS + 9 * edge + 3, VECTORS + 9 * edge + 6, STRAINS + 3 + 3 * edge
        for k in range(LANES):
            simpson = _dot(w, start, v, start, k) + 4.0 * _dot(w, middle, v, middle, k) + _dot(w, end, v, end, k)
            v[(STRAINS + edge) * LANES + k] = simpson / 6.0
            turned = _dot(v, end, w, across, k) - _dot(v, start, w, across, k)
            rising = _dot(w, end, v, across, k) - _dot(w, start, v, across, k)
            v[(STRAINS + 12 + edge) * LANES + k] = turned + rising
        for k in range(LANES):
            v[of_corner * LANES + k] = _dot(w, x, v, x, k)
            v[(of_corner + 1) * LANES + k] = _dot(w, y, v, y, k)
            v[(of_corner + 2) * LANES + k] = _dot(w, x, v, y, k) + _dot(w, y, v, x, k)
    for point in range(3):
        x, y, n, first = SLOPES + 9 * point + 3, SLOPES + 27 + 3 * point, NORMALS + 4 * point, SLOPES + 36 + 9 * point
        for k in range(LANES):
            x0, x1, x2 = w[x * LANES + k], w[(x + 1) * LANES + k], w[(x + 2) * LANES + k]
            y0, y1, y2 = w[y * LANES + k], w[(y + 1) * LANES + k], w[(y + 2) * LANES + k]
            u0, u1, u2 = v[x * LANES + k], v[(x + 1) * LANES + k], v[(x + 2) * LANES + k]
            v0, v1, v2 = v[y * LANES + k], v[(y + 1) * LANES + k], v[(y + 2) * LANES + k]
            n0, n1, n2 = w[n * LANES + k], w[(n + 1) * LANES + k], w[(n + 2) * LANES + k]
            per_size = w[(n + 3) * LANES + k]
            c0 = u1 * y2 - u2 * y1 + (x1 * v2 - x2 * v1)
            c1 = u2 * y0 - u0 * y2 + (x2 * v0 - x0 * v2)
            c2 = u0 * y1 - u1 * y0 + (x0 * v1 - x1 * v0)
            along = n0 * c0 + n1 * c1 + n2 * c2
            c0, c1, c2 = (c0 - along * n0) * per_size, (c1 - along * n1) * per_size, (c2 - along * n2) * per_size
            for i in range(3):
                b = first + 3 * i
                v[(_CURVATURES + 3 * point + i) * LANES + k] = (
                    n0 * v[b * LANES + k] + n1 * v[(b + 1) * LANES + k] + n2 * v[(b + 2) * LANES + k]
                    + (c0 * w[b * LANES + k] + c1 * w[(b + 1) * LANES + k] + c2 * w[(b + 2) * LANES + k])
                )  # fmt: skip


@kernel
def place_rates(packed: np.ndarray, constants: np.ndarray, damping: Damping, w: np.ndarray, v: np.ndarray) -> None:
    """Write the rates of strains and curvatures at a state w into a state v."""
    if damping.tau == 0.0:
        return
    place(packed, constants, damping.other, v)
    if damping.over == 0.0:
        _velocities(w, v)
        return
    measure(constants, v)
    for i in range(STRAINS * LANES, STATE * LANES):
        v[i] = (w[i] - v[i]) / damping.over


@kernel
def place_efforts(
    constants: np.ndarray, w: np.ndarray, v: np.ndarray, stretched: float, bent: float, tau: float, out: np.ndarray
) -> None:
    """Write the efforts of strains and curvatures: of the state times `stretched` and `bent`, plus `tau` times the rates."""
    for i in range(15):
        for k in range(LANES):
            total = 0.0
            for j in range(15):
                own = stretched * w[(STRAINS + j) * LANES + k] + tau * v[(STRAINS + j) * LANES + k]
                total += constants[(MODULI + 15 * i + j) * LANES + k] * own
            out[(STRETCH + i) * LANES + k] = total
    for point in range(3):
        for i in range(3):
            for k in range(LANES):
                total = 0.0
                for j in range(3):
                    at = (_CURVATURES + 3 * point + j) * LANES + k
                    total += constants[(BEND_MODULI + 3 * i + j) * LANES + k] * (bent * w[at] + tau * v[at])
                out[(MOMENTS + 3 * point + i) * LANES + k] = total


@kernel
def of_lane(rows: np.ndarray, first: int, k: int, out: np.ndarray) -> None:
    """Copy numbers of one triangle of a pack, from a row on."""
    flat = out.reshape(-1)
    for i in range(flat.shape[0]):
        flat[i] = rows[(first + i) * LANES + k]


@kernel
def relax(facets: FacetArrays, pack: int, w: np.ndarray, out: np.ndarray) -> None:
    """Add the tension field to efforts of the strains of a state."""
    strains, efforts = np.empty((5, 3)), np.empty((5, 3))
    for k in range(min(LANES, facets.tension.shape[0] - pack * LANES)):
        of_lane(w, STRAINS, k, strains)
        efforts[:] = 0.0
        relax_efforts(facets.points[pack * LANES + k], facets.tension[pack * LANES + k], strains, efforts)
        for i in range(15):
            out[(STRETCH + i) * LANES + k] += efforts[i // 3, i % 3]


@kernel
def _place_forces(constants: np.ndarray, w: np.ndarray, out: np.ndarray) -> None:
    """Write the forces of efforts of strains and curvatures by the nodal vectors."""
    for edge in range(3):
        stretch, turn, corner = STRETCH + edge, STRETCH + 12 + edge, STRETCH + 3 + 3 * edge
        for a in range(3):
            slope, across, x = SLOPES + 9 * edge + a, SLOPES + 27 + 3 * edge + a, VECTORS + 9 * edge + 3 + a
            by_slope, by_across, by_vector = _WORK + 9 * edge + a, _WORK + 27 + 3 * edge + a, _FORCE + 9 * edge + a
            for k in range(LANES):
                n, m = out[stretch * LANES + k] / 6.0, out[turn * LANES + k]
                start, end, side = w[slope * LANES + k], w[(slope + 6) * LANES + k], w[across * LANES + k]
                out[by_slope * LANES + k] = n * start - m * side
                out[(by_slope + 3) * LANES + k] = 4.0 * n * w[(slope + 3) * LANES + k]
                out[(by_slope + 6) * LANES + k] = n * end + m * side
                out[by_across * LANES + k] = m * (end - start)
            for k in range(LANES):
                nxx, nyy, nxy = out[corner * LANES + k], out[(corner + 1) * LANES + k], out[(corner + 2) * LANES + k]
                ex, ey = w[x * LANES + k], w[(x + 3) * LANES + k]
                out[by_vector * LANES + k] = 0.0
                out[(by_vector + 3) * LANES + k] = nxx * ex + nxy * ey
                out[(by_vector + 6) * LANES + k] = nyy * ey + nxy * ex
    for point in range(3):
        x, y, n, first = SLOPES + 9 * point + 3, SLOPES + 27 + 3 * point, NORMALS + 4 * point, SLOPES + 36 + 9 * point
        by_x, by_y, by_first, m = _WORK + 9 * point + 3, _WORK + 27 + 3 * point, _WORK + 36 + 9 * point, MOMENTS + 3 * point
        for k in range(LANES):
            m0, m1, m2 = out[m * LANES + k], out[(m + 1) * LANES + k], out[(m + 2) * LANES + k]
            n0, n1, n2 = w[n * LANES + k], w[(n + 1) * LANES + k], w[(n + 2) * LANES + k]
            per_size = w[(n + 3) * LANES + k]
            c0 = m0 * w[first * LANES + k] + m1 * w[(first + 3) * LANES + k] + m2 * w[(first + 6) * LANES + k]
            c1 = m0 * w[(first + 1) * LANES + k] + m1 * w[(first + 4) * LANES + k] + m2 * w[(first + 7) * LANES + k]
            c2 = m0 * w[(first + 2) * LANES + k] + m1 * w[(first + 5) * LANES + k] + m2 * w[(first + 8) * LANES + k]
            along = n0 * c0 + n1 * c1 + n2 * c2
            c0, c1, c2 = (c0 - along * n0) * per_size, (c1 - along * n1) * per_size, (c2 - along * n2) * per_size
            x0, x1, x2 = w[x * LANES + k], w[(x + 1) * LANES + k], w[(x + 2) * LANES + k]
            y0, y1, y2 = w[y * LANES + k], w[(y + 1) * LANES + k], w[(y + 2) * LANES + k]
            out[by_x * LANES + k] += y1 * c2 - y2 * c1
            out[(by_x + 1) * LANES + k] += y2 * c0 - y0 * c2
            out[(by_x + 2) * LANES + k] += y0 * c1 - y1 * c0
            out[by_y * LANES + k] += c1 * x2 - c2 * x1
            out[(by_y + 1) * LANES + k] += c2 * x0 - c0 * x2
            out[(by_y + 2) * LANES + k] += c0 * x1 - c1 * x0
            out[by_first * LANES + k], out[(by_first + 1) * LANES + k] = m0 * n0, m0 * n1
            out[(by_first + 2) * LANES + k], out[(by_first + 3) * LANES + k] = m0 * n2, m1 * n0
            out[(by_first + 4) * LANES + k], out[(by_first + 5) * LANES + k] = m1 * n1, m1 * n2
            out[(by_first + 6) * LANES + k], out[(by_first + 7) * LANES + k] = m2 * n0, m2 * n1
            out[(by_first + 8) * LANES + k] = m2 * n2
    for i in range(9):
        f = _FORCE + 3 * i
        for k in range(LANES):
            x, y, z = out[f * LANES + k], out[(f + 1) * LANES + k], out[(f + 2) * LANES + k]
            for r in range(SLOPE_ROWS):
                c = constants[(ROWS + 9 * r + i) * LANES + k]
                x += c * out[(_WORK + 3 * r) * LANES + k]
                y += c * out[(_WORK + 3 * r + 1) * LANES + k]
                z += c * out[(_WORK + 3 * r + 2) * LANES + k]
            out[f * LANES + k], out[(f + 1) * LANES + k], out[(f + 2) * LANES + k] = x, y, z


@kernel
def _add_bending(bending: np.ndarray, w: np.ndarray, out: np.ndarray) -> None:
    """Add the forces of bending of flat triangles by the nodal vectors."""
    for i in range(9):
        for a in range(3):
            for k in range(LANES):
                total = 0.0
                for j in range(9):
                    total += bending[(9 * i + j) * LANES + k] * w[(VECTORS + 3 * j + a) * LANES + k]
                out[(_FORCE + 3 * i + a) * LANES + k] += total


@kernel
def add_facet_force(facets: FacetArrays, q: np.ndarray, damping: Damping, force: np.ndarray) -> None:
    """Add the forces -dU/dq of all triangles and those of their damping."""
    w, v, out = np.empty(STATE * LANES), np.zeros(STATE * LANES), np.empty(EFFORTS * LANES)
    flat = facets.bending.shape[0] > 0
    for pack in range(facets.packed.shape[0]):
        vectors, constants = facets.packed[pack], facets.constants[pack]
        place(vectors, constants, q, w)
        measure(constants, w)
        place_rates(vectors, constants, damping, w, v)
        place_efforts(constants, w, v, damping.elastic, 0.0 if flat else damping.elastic, damping.tau, out)
        if damping.elastic > 0.0:
            relax(facets, pack, w, out)
        _place_forces(constants, w, out)
        if flat and damping.elastic > 0.0:
            _add_bending(facets.bending[pack], w, out)
        for i in range(9):
            for k in range(min(LANES, facets.vectors.shape[0] - pack * LANES)):
                for a in range(3):
                    force[vectors[i * LANES + k] + a] -= out[(_FORCE + 3 * i + a) * LANES + k]


@kernel
def facet_energy(facets: FacetArrays, q: np.ndarray) -> tuple[float, float]:
    """Energy of stretch and of bending of all triangles, J."""
    w, v, out, strains = np.empty(STATE * LANES), np.zeros(STATE * LANES), np.empty(EFFORTS * LANES), np.empty((5, 3))
    stretch = bend = 0.0
    flat = facets.bending.shape[0] > 0
    for pack in range(facets.packed.shape[0]):
        count = min(LANES, facets.vectors.shape[0] - pack * LANES)
        place(facets.packed[pack], facets.constants[pack], q, w)
        measure(facets.constants[pack], w)
        place_efforts(facets.constants[pack], w, v, 1.0, 0.0 if flat else 1.0, 0.0, out)
        for k in range(count):
            for i in range(15):
                stretch += 0.5 * w[(STRAINS + i) * LANES + k] * out[(STRETCH + i) * LANES + k]
            for i in range(9):
                bend += 0.5 * w[(_CURVATURES + i) * LANES + k] * out[(MOMENTS + i) * LANES + k]
            if facets.tension.shape[0] > 0:
                of_lane(w, STRAINS, k, strains)
                stretch += relax_energy(facets.points[pack * LANES + k], facets.tension[pack * LANES + k], strains)
        if flat:
            for i in range(27):
                for k in range(LANES):
                    out[(_FORCE + i) * LANES + k] = 0.0
            _add_bending(facets.bending[pack], w, out)
            for i in range(27):
                for k in range(count):
                    bend += 0.5 * w[(VECTORS + i) * LANES + k] * out[(_FORCE + i) * LANES + k]
    return stretch, bend


@kernel
def facet_power(facets: FacetArrays, q: np.ndarray, damping: Damping) -> float:
    """Power that the damping of all triangles dissipates, W."""
    w, v, out, power = np.empty(STATE * LANES), np.zeros(STATE * LANES), np.empty(EFFORTS * LANES), 0.0
    for pack in range(facets.packed.shape[0]):
        constants = facets.constants[pack]
        place(facets.packed[pack], constants, q, w)
        measure(constants, w)
        place_rates(facets.packed[pack], constants, damping, w, v)
        place_efforts(constants, w, v, 0.0, 0.0, damping.tau, out)
        for k in range(min(LANES, facets.vectors.shape[0] - pack * LANES)):
            for i in range(15):
                power += v[(STRAINS + i) * LANES + k] * out[(STRETCH + i) * LANES + k]
            for i in range(9):
                power += v[(_CURVATURES + i) * LANES + k] * out[(MOMENTS + i) * LANES + k]
    return power


@kernel
def facet_states(facets: FacetArrays, q: np.ndarray, strains: np.ndarray, curvatures: np.ndarray) -> None:
    """Strains (m, 15), and curvatures kxx, kyy, kxy along the normal at the middles of the edges (m, 9), 1/m, both relative
    to rest.
    """
    w = np.empty(STATE * LANES)
    for pack in range(facets.packed.shape[0]):
        place(facets.packed[pack], facets.constants[pack], q, w)
        measure(facets.constants[pack], w)
        for k in range(min(LANES, facets.vectors.shape[0] - pack * LANES)):
            of_lane(w, STRAINS, k, strains[pack * LANES + k])
            of_lane(w, _CURVATURES, k, curvatures[pack * LANES + k])


@kernel
def facet_efforts(facets: FacetArrays, q: np.ndarray, dx: np.ndarray, out: np.ndarray) -> None:
    """Membrane efforts (m, 5, 3) at q + dx, linearised in dx."""
    w, v, efforts = np.empty(STATE * LANES), np.empty(STATE * LANES), np.empty(EFFORTS * LANES)
    for pack in range(facets.packed.shape[0]):
        constants = facets.constants[pack]
        place(facets.packed[pack], constants, q, w)
        measure(constants, w)
        place(facets.packed[pack], constants, dx, v)
        _velocities(w, v)
        for i in range(STRAINS * LANES, (STRAINS + 15) * LANES):
            w[i] += v[i]
        place_efforts(constants, w, v, 1.0, 0.0, 0.0, efforts)
        relax(facets, pack, w, efforts)
        for k in range(min(LANES, facets.vectors.shape[0] - pack * LANES)):
            of_lane(efforts, STRETCH, k, out[pack * LANES + k])
