"""Kernels of ANCF-DKT triangles: energy, force, tangent and membrane efforts of flexible facets.

Stretch: fifteen scalars that rigid motions do not change, and their constant moduli (`membrane_moduli` in
`fsm.model.nodes.facets.facet_shape`). The scalars are the mean Green strains of the three edges (Simpson's rule), the Green
strains of the slopes at the corners, and the rotations of the edges within the surface. An edge from a to b with tangent t
and normal n rotates by

    (F_b t - F_a t) . (F_a n + F_b n)/2,    F = [r_X, r_Y]

Bending of a triangle that is flat at rest: U_b = 1/2 sum A/3 kappa D kappa with curvature vectors kappa, a constant matrix.
With a rest curvature k0, the components n . kappa - k0 along the unit normal n replace kappa. The rows and matrices are
those of `fsm.model.nodes.facets.facet_shape`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.model.nodes.curvature import (
    add_curvature_stiffness,
    curvature_effort,
    curvature_gradient,
    map_vectors,
    normal,
)
from fsm.model.nodes.facets.facet_tension import relax_efforts, relax_energy, relax_moduli


class FacetArrays(NamedTuple):
    """Arrays of m triangles.

    Attributes
    ----------
    vectors : (m, 9) int array
        First coordinates of r, r_1, r_2 at the corners.
    edges : (m, 3, 3, 9) array
    rest : (m, 5, 3) array
        Strains at rest: the strains of the three edges; exx, eyy, 2 exy at each corner; the rotations of the edges.
    across : (m, 3, 9) array
        Mean slope across each edge.
    moduli : (m, 15, 15) array, N m
        Moduli of these strains times the area.
    bending : (m, 9, 9) array, N/m
        Stiffness of bending of triangles that are flat at rest; empty otherwise.
    rows : (m, 3, 5, 9) array
        `FacetRows.bend` of triangles that are curved at rest; empty otherwise.
    bend_moduli : (m, 3, 3) array, N m^3
        Moduli of bending for kxx, kyy, kxy times a third of the area.
    rest_curvature : (m, 3, 3) array, 1/m
    points : (m, 3, 3, 15) array
        Strain at the middles of the edges from these strains; empty if the law is plain.
    tension : (m, 5) array
        Tension field, as in `fsm.model.nodes.facets.facet_tension.relax_energy`; empty if the law is plain.
    """

    vectors: np.ndarray
    edges: np.ndarray
    across: np.ndarray
    rest: np.ndarray
    moduli: np.ndarray
    bending: np.ndarray
    rows: np.ndarray
    bend_moduli: np.ndarray
    rest_curvature: np.ndarray
    points: np.ndarray
    tension: np.ndarray


@kernel(inline=True)
def gather(vectors: np.ndarray, q: np.ndarray, e: np.ndarray) -> None:
    """Nodal vectors of one triangle, (9, 3), with positions relative to the first corner.

    No strain or curvature depends on this position, and round-off then belongs to the size of a triangle, not of the sheet.
    """
    for i in range(9):
        first = vectors[i]
        for a in range(3):
            e[i, a] = q[first + a]
    for i in (6, 3, 0):
        for a in range(3):
            e[i, a] -= e[0, a]


@kernel(inline=True)
def _dot(u: np.ndarray, v: np.ndarray) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@kernel(inline=True)
def _along(row: np.ndarray, e: np.ndarray, out: np.ndarray) -> None:
    """out (3,) = row (9,) e (9, 3)."""
    for a in range(3):
        out[a] = 0.0
    for i in range(9):
        w = row[i]
        if w != 0.0:
            for a in range(3):
                out[a] += w * e[i, a]


@kernel(inline=True)
def _simpson(point: int) -> float:
    return 4.0 / 6.0 if point == 1 else 1.0 / 6.0


@kernel(inline=True)
def stretch_strains(
    edges: np.ndarray, across: np.ndarray, rest: np.ndarray, e: np.ndarray, slopes: np.ndarray, strains: np.ndarray
) -> None:
    """Strains (5, 3) relative to rest, and the slopes (3, 4, 3) along the edges at their points and across them."""
    for k in range(3):
        total = 0.0
        for p in range(3):
            _along(edges[k, p], e, slopes[k, p])
            total += _simpson(p) * 0.5 * (_dot(slopes[k, p], slopes[k, p]) - 1.0)
        strains[0, k] = total - rest[0, k]
        x, y = e[3 * k + 1], e[3 * k + 2]
        strains[1 + k, 0] = 0.5 * (_dot(x, x) - 1.0) - rest[1 + k, 0]
        strains[1 + k, 1] = 0.5 * (_dot(y, y) - 1.0) - rest[1 + k, 1]
        strains[1 + k, 2] = _dot(x, y) - rest[1 + k, 2]
        _along(across[k], e, slopes[k, 3])
        strains[4, k] = _dot(slopes[k, 2], slopes[k, 3]) - _dot(slopes[k, 0], slopes[k, 3]) - rest[4, k]


@kernel(inline=True)
def stretch_rates(
    edges: np.ndarray, across: np.ndarray, slopes: np.ndarray, e: np.ndarray, v: np.ndarray, rising: np.ndarray,
    rates: np.ndarray,
) -> None:  # fmt: skip
    """Rates (5, 3) of the strains at rates v (9, 3) of the nodal vectors, and the rates (3, 4, 3) of the slopes."""
    for k in range(3):
        total = 0.0
        for p in range(3):
            _along(edges[k, p], v, rising[k, p])
            total += _simpson(p) * _dot(slopes[k, p], rising[k, p])
        rates[0, k] = total
        x, y = 3 * k + 1, 3 * k + 2
        rates[1 + k, 0], rates[1 + k, 1] = _dot(e[x], v[x]), _dot(e[y], v[y])
        rates[1 + k, 2] = _dot(e[x], v[y]) + _dot(e[y], v[x])
        _along(across[k], v, rising[k, 3])
        turned = _dot(rising[k, 2], slopes[k, 3]) - _dot(rising[k, 0], slopes[k, 3])
        rates[4, k] = turned + (_dot(slopes[k, 2], rising[k, 3]) - _dot(slopes[k, 0], rising[k, 3]))


@kernel(inline=True)
def add_stretch(
    edges: np.ndarray, across: np.ndarray, efforts: np.ndarray, slopes: np.ndarray, e: np.ndarray, f: np.ndarray
) -> None:
    """Add the work of membrane efforts (5, 3) by the nodal vectors, (9, 3)."""
    for edge in range(3):
        for point in range(3):
            w = efforts[0, edge] * _simpson(point)
            for i in range(9):
                v = w * edges[edge, point, i]
                if v != 0.0:
                    for a in range(3):
                        f[i, a] += v * slopes[edge, point, a]
        w = efforts[4, edge]
        for i in range(9):
            p = edges[edge, 2, i] - edges[edge, 0, i]
            v = across[edge, i]
            for a in range(3):
                f[i, a] += w * (p * slopes[edge, 3, a] + v * (slopes[edge, 2, a] - slopes[edge, 0, a]))
        x, y = 3 * edge + 1, 3 * edge + 2
        nxx, nyy, nxy = efforts[1 + edge]
        for a in range(3):
            f[x, a] += nxx * e[x, a] + nxy * e[y, a]
            f[y, a] += nyy * e[y, a] + nxy * e[x, a]


@kernel(inline=True)
def stretch_efforts(moduli: np.ndarray, strains: np.ndarray, efforts: np.ndarray) -> None:
    """Efforts (5, 3) from strains (5, 3)."""
    for part in range(5):
        for i in range(3):
            total = 0.0
            for other in range(5):
                for j in range(3):
                    total += moduli[3 * part + i, 3 * other + j] * strains[other, j]
            efforts[part, i] = total


@kernel(inline=True)
def bend_point(rows: np.ndarray, e: np.ndarray, g: np.ndarray) -> None:
    """Slopes and curvature vectors g (15,) at one point from its rows (5, 9)."""
    for d in range(5):
        _along(rows[d], e, g[3 * d : 3 * d + 3])


@kernel(inline=True)
def _moments(moduli: np.ndarray, g: np.ndarray, n: np.ndarray, rest: np.ndarray, kappa: np.ndarray, m: np.ndarray) -> None:
    """Curvatures (3,) relative to rest, and their efforts (3,)."""
    for i in range(3):
        kappa[i] = n[0] * g[6 + 3 * i] + n[1] * g[7 + 3 * i] + n[2] * g[8 + 3 * i] - rest[i]
    for i in range(3):
        m[i] = 0.0
        for j in range(3):
            m[i] += moduli[i, j] * kappa[j]


@kernel
def facet_energy(facets: FacetArrays, q: np.ndarray) -> tuple[float, float]:
    """Energy of stretch and of bending of all triangles, J."""
    e, slopes, strains, efforts = np.empty((9, 3)), np.empty((3, 4, 3)), np.empty((5, 3)), np.empty((5, 3))
    g, n, kappa, m = np.empty(15), np.empty(3), np.empty(3), np.empty(3)
    stretch = bend = 0.0
    flat = facets.bending.shape[0] > 0
    for k in range(facets.vectors.shape[0]):
        gather(facets.vectors[k], q, e)
        stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        stretch_efforts(facets.moduli[k], strains, efforts)
        for part in range(5):
            stretch += 0.5 * _dot(strains[part], efforts[part])
        if facets.tension.shape[0] > 0:
            stretch += relax_energy(facets.points[k], facets.tension[k], strains)
        if flat:
            for i in range(9):
                for j in range(9):
                    bend += 0.5 * facets.bending[k, i, j] * _dot(e[i], e[j])
            continue
        for point in range(3):
            bend_point(facets.rows[k, point], e, g)
            normal(g, n)
            _moments(facets.bend_moduli[k], g, n, facets.rest_curvature[k, point], kappa, m)
            bend += 0.5 * _dot(kappa, m)
    return stretch, bend


@kernel
def facet_curvatures(facets: FacetArrays, rows: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Curvatures (m, 3, 3) kxx, kyy, kxy along the normal at the middles of the edges, 1/m."""
    e, g, n = np.empty((9, 3)), np.empty(15), np.empty(3)
    out = np.empty((facets.vectors.shape[0], 3, 3))
    for k in range(facets.vectors.shape[0]):
        gather(facets.vectors[k], q, e)
        for point in range(3):
            bend_point(rows[k, point], e, g)
            normal(g, n)
            for i in range(3):
                out[k, point, i] = _dot(n, g[6 + 3 * i : 9 + 3 * i])
    return out


@kernel
def facet_strains(facets: FacetArrays, q: np.ndarray, out: np.ndarray) -> None:
    """Strains (m, 5, 3) relative to rest, as in `FacetArrays.rest`."""
    e, slopes, strains = np.empty((9, 3)), np.empty((3, 4, 3)), np.empty((5, 3))
    for k in range(facets.vectors.shape[0]):
        gather(facets.vectors[k], q, e)
        stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        out[k] = strains


@kernel
def add_facet_force(facets: FacetArrays, q: np.ndarray, force: np.ndarray) -> None:
    """Add the forces -dU/dq of all triangles."""
    e, slopes, strains, efforts = np.empty((9, 3)), np.empty((3, 4, 3)), np.empty((5, 3)), np.empty((5, 3))
    g, n, kappa, m, c, effort = np.empty(15), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(15)
    f = np.empty((9, 3))
    flat = facets.bending.shape[0] > 0
    for k in range(facets.vectors.shape[0]):
        gather(facets.vectors[k], q, e)
        stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        stretch_efforts(facets.moduli[k], strains, efforts)
        if facets.tension.shape[0] > 0:
            relax_efforts(facets.points[k], facets.tension[k], strains, efforts)
        f[:] = 0.0
        add_stretch(facets.edges[k], facets.across[k], efforts, slopes, e, f)
        if flat:
            for i in range(9):
                for j in range(9):
                    w = facets.bending[k, i, j]
                    for a in range(3):
                        f[i, a] += w * e[j, a]
        else:
            for point in range(3):
                rows = facets.rows[k, point]
                bend_point(rows, e, g)
                size = normal(g, n)
                _moments(facets.bend_moduli[k], g, n, facets.rest_curvature[k, point], kappa, m)
                curvature_effort(g, n, size, m, c, effort)
                for d in range(5):
                    for i in range(9):
                        for a in range(3):
                            f[i, a] += rows[d, i] * effort[3 * d + a]
        for i in range(9):
            first = facets.vectors[k, i]
            for a in range(3):
                force[first + a] -= f[i, a]


@kernel(inline=True)
def stretch_gradients(
    edges: np.ndarray, across: np.ndarray, slopes: np.ndarray, e: np.ndarray, out: np.ndarray
) -> None:
    """Derivatives (15, 27) of the strains with respect to the nodal vectors. The zeros of corner strains, outside the
    columns of their slopes, are not written.
    """
    for edge in range(3):
        for i in range(9):
            for a in range(3):
                total = 0.0
                for p in range(3):
                    total += _simpson(p) * edges[edge, p, i] * slopes[edge, p, a]
                out[edge, 3 * i + a] = total
                turned = slopes[edge, 2, a] - slopes[edge, 0, a]
                p_row = edges[edge, 2, i] - edges[edge, 0, i]
                out[12 + edge, 3 * i + a] = p_row * slopes[edge, 3, a] + across[edge, i] * turned
        x, first, row = 3 * edge + 1, 9 * edge + 3, 3 + 3 * edge
        for a in range(3):
            out[row, first + a], out[row, first + 3 + a] = e[x, a], 0.0
            out[row + 1, first + a], out[row + 1, first + 3 + a] = 0.0, e[x + 1, a]
            out[row + 2, first + a], out[row + 2, first + 3 + a] = e[x + 1, a], e[x, a]


@kernel(inline=True)
def add_geometric(edges: np.ndarray, across: np.ndarray, efforts: np.ndarray, plain: np.ndarray) -> None:
    """Add the geometric stiffness (9, 9) of membrane efforts (5, 3), which is equal for x, y and z."""
    for edge in range(3):
        for p in range(3):
            row, w = edges[edge, p], efforts[0, edge] * _simpson(p)
            for i in range(9):
                v = w * row[i]
                if v != 0.0:
                    for j in range(9):
                        plain[i, j] += v * row[j]
        w = efforts[4, edge]
        for i in range(9):
            v = w * (edges[edge, 2, i] - edges[edge, 0, i])
            if v != 0.0:
                for j in range(9):
                    plain[i, j] += v * across[edge, j]
                    plain[j, i] += v * across[edge, j]
        x, y = 3 * edge + 1, 3 * edge + 2
        plain[x, x] += efforts[1 + edge, 0]
        plain[y, y] += efforts[1 + edge, 1]
        plain[x, y] += efforts[1 + edge, 2]
        plain[y, x] += efforts[1 + edge, 2]


@kernel
def facet_efforts(facets: FacetArrays, q: np.ndarray, dx: np.ndarray, out: np.ndarray) -> None:
    """Membrane efforts (m, 5, 3) at q + dx, linearised in dx."""
    e, change, slopes, strains = np.empty((9, 3)), np.empty((9, 3)), np.empty((3, 4, 3)), np.empty((5, 3))
    rising, increments = np.empty((3, 4, 3)), np.empty((5, 3))
    for k in range(facets.vectors.shape[0]):
        gather(facets.vectors[k], q, e)
        gather(facets.vectors[k], dx, change)
        stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        stretch_rates(facets.edges[k], facets.across[k], slopes, e, change, rising, increments)
        strains += increments
        stretch_efforts(facets.moduli[k], strains, out[k])
        if facets.tension.shape[0] > 0:
            relax_efforts(facets.points[k], facets.tension[k], strains, out[k])


@kernel
def add_facet_tangent(
    facets: FacetArrays, q: np.ndarray, given: np.ndarray, slots: np.ndarray, size: int, into: np.ndarray
) -> None:
    """Add -dh/dq to the flat block data.

    Parameters
    ----------
    facets : FacetArrays
    q : (n,) array
    given : (m, 5, 3) array
        Membrane efforts of the geometric stiffness; if empty, the efforts at q are used.
    slots : (m, 9, 9) int array
    size : size of the blocks
    into : flat block data
    """
    e, slopes, strains, efforts = np.empty((9, 3)), np.empty((3, 4, 3)), np.empty((5, 3)), np.empty((5, 3))
    gradients, weighed = np.zeros((15, 27)), np.empty((15, 27))
    h, half, plain, moduli = np.empty((27, 27)), np.zeros((27, 27)), np.empty((9, 9)), np.empty((15, 15))
    g, n, kappa, m, c, work = np.empty(15), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((15, 15))
    gradient, turn, moments, by_slopes = np.empty((3, 15)), np.empty((3, 27)), np.empty((3, 27)), np.empty((6, 27))
    flat = facets.bending.shape[0] > 0
    for k in range(facets.vectors.shape[0]):
        gather(facets.vectors[k], q, e)
        stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        if given.shape[0] > 0:
            efforts[:] = given[k]
        else:
            stretch_efforts(facets.moduli[k], strains, efforts)
            if facets.tension.shape[0] > 0:
                relax_efforts(facets.points[k], facets.tension[k], strains, efforts)
        moduli[:] = facets.moduli[k]
        if facets.tension.shape[0] > 0:
            relax_moduli(facets.points[k], facets.tension[k], strains, moduli)
        # material part; at the end, the lower triangle is that of the upper one, so the tangent is exactly symmetric
        stretch_gradients(facets.edges[k], facets.across[k], slopes, e, gradients)
        np.dot(moduli, gradients, weighed)
        np.dot(gradients.T, weighed, h)
        # terms that are equal for x, y and z: geometric stiffness, bending of flat triangles
        if flat:
            plain[:] = facets.bending[k]
        else:
            plain[:] = 0.0
        add_geometric(facets.edges[k], facets.across[k], efforts, plain)
        for i in range(9):
            for j in range(i, 9):
                for a in range(3):
                    h[3 * i + a, 3 * j + a] += plain[i, j]
        if not flat:
            half[:] = 0.0
            for point in range(3):
                rows = facets.rows[k, point]
                bend_point(rows, e, g)
                length = normal(g, n)
                _moments(facets.bend_moduli[k], g, n, facets.rest_curvature[k, point], kappa, m)
                curvature_gradient(g, n, length, c, gradient)
                map_vectors(gradient, rows, turn)
                for i in range(3):
                    p, r, t = facets.bend_moduli[k, i, 0], facets.bend_moduli[k, i, 1], facets.bend_moduli[k, i, 2]
                    for j in range(27):
                        moments[i, j] = p * turn[0, j] + r * turn[1, j] + t * turn[2, j]
                for v in range(27):
                    for j in range(v, 27):
                        h[v, j] += turn[0, v] * moments[0, j] + turn[1, v] * moments[1, j] + turn[2, v] * moments[2, j]
                add_curvature_stiffness(g, n, length, m, rows, work, by_slopes, half)
            for v in range(27):
                for j in range(v, 27):
                    h[v, j] += half[v, j] + half[j, v]
        for v in range(27):
            for j in range(v):
                h[v, j] = h[j, v]
        for i in range(9):
            for j in range(9):
                slot = slots[k, i, j]
                for a in range(3):
                    for b in range(3):
                        into[slot + a * size + b] += h[3 * i + a, 3 * j + b]
