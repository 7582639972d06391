"""Rows and matrices of ANCF-DKT triangles: linear functions of the nodal vectors r, r_1, r_2 at three corners.

r_1 and r_2 are the derivatives of r along two orthogonal unit vectors of the plane. Each corner may have other unit
vectors. An edge from corner a to b has the length l, the tangent t and the normal n on its left:

    m_t = 3 (r_b - r_a)/(2 l) - (r_t,a + r_t,b)/4,    m_n = (r_n,a + r_n,b)/2

are the slopes along and across it at its middle. The slopes r_X, r_Y in the triangle are quadratic, with these values. The
symmetric gradient is the curvature, evaluated at the middles of the edges (discrete Kirchhoff triangle: Batoz, Bathe and Ho,
1980).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.triangles.cubic import cubic_rows

FOLLOW = 1.0
"""Stiffness that ties the mean strain of the corners to the strain of the triangle, relative to the film's stiffness."""
_MASS_POINTS = 7
"""Gauss points per side of the square that is mapped to the triangle, for the mass: exact to degree 6."""


class FacetRows(NamedTuple):
    """Rows of m triangles over the nine vectors r, r_1, r_2 of the corners in order.

    Attributes
    ----------
    area : (m,) array, m^2
    edges : (m, 3, 3, 9) array
        Slope along each edge at its start, middle and end.
    bend : (m, 3, 5, 9) array
        At the middle of each edge: slopes along and across it, curvature vectors xx, yy, xy.
    to_strain : (m, 3, 3) array
        Strains exx, eyy, 2 exy of the triangle from the mean strains of its edges.
    """

    area: np.ndarray
    edges: np.ndarray
    bend: np.ndarray
    to_strain: np.ndarray


def facet_rows(plane: np.ndarray, angle: np.ndarray) -> FacetRows:
    """Rows of triangles.

    Parameters
    ----------
    plane : (m, 3, 2) array, m
        Corners in the plane, counter-clockwise.
    angle : (m, 3) array, rad
        Angle of the first axis of each corner with the first axis of the plane.
    """
    count = len(plane)
    along = np.roll(plane, -1, axis=1) - plane
    length = np.linalg.norm(along, axis=2)
    t = along / length[..., None]
    n = np.stack([-t[..., 1], t[..., 0]], axis=-1)
    area = 0.5 * (along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0])
    corner = _corner_rows(angle)
    edges, bend = np.zeros((count, 3, 3, 9)), np.zeros((count, 3, 5, 9))
    middle = np.zeros((count, 3, 2, 9))
    for k in range(3):
        a, b = k, (k + 1) % 3
        for place, end in ((0, a), (2, b)):
            edges[:, k, place] = np.einsum("mc,mcv->mv", t[:, k], corner[:, end])
        m_t = -0.25 * (edges[:, k, 0] + edges[:, k, 2])
        m_t[:, 3 * a] -= 1.5 / length[:, k]
        m_t[:, 3 * b] += 1.5 / length[:, k]
        m_n = 0.5 * np.einsum("mc,mcv->mv", n[:, k], corner[:, a] + corner[:, b])
        edges[:, k, 1] = bend[:, k, 0] = m_t
        bend[:, k, 1] = m_n
        middle[:, k] = t[:, k, :, None] * m_t[:, None] + n[:, k, :, None] * m_n[:, None]
    # gradient of the area coordinate of the corner across from edge k + 1
    slope = np.stack([n[:, (i + 1) % 3] * (length[:, (i + 1) % 3] / (2.0 * area))[:, None] for i in range(3)], axis=1)
    for k in range(3):
        a, b, c = k, (k + 1) % 3, (k + 2) % 3
        # d(theta)/d(coordinate) at the middle of edge k, (m, coordinate, component of theta, 9)
        gradient = np.zeros((count, 2, 2, 9))
        for i, factor in ((a, 1.0), (b, 1.0), (c, -1.0)):
            gradient += factor * slope[:, i, :, None, None] * corner[:, i, None]
        for edge, by in ((a, slope[:, a] + slope[:, b]), (b, slope[:, c]), (c, slope[:, c])):
            gradient += 2.0 * by[:, :, None, None] * middle[:, edge, None]
        bend[:, k, 2], bend[:, k, 3] = gradient[:, 0, 0], gradient[:, 1, 1]
        bend[:, k, 4] = 0.5 * (gradient[:, 0, 1] + gradient[:, 1, 0])
    of_edges = np.stack([t[..., 0] ** 2, t[..., 1] ** 2, t[..., 0] * t[..., 1]], axis=-1)
    return FacetRows(area, edges, bend, np.linalg.inv(of_edges))


def _corner_rows(angle: np.ndarray) -> np.ndarray:
    """Rows (m, 3, 2, 9) of r_X and r_Y at the corners."""
    rows = np.zeros((len(angle), 3, 2, 9))
    cosine, sine = np.cos(angle), np.sin(angle)
    for i in range(3):
        rows[:, i, 0, 3 * i + 1], rows[:, i, 0, 3 * i + 2] = cosine[:, i], -sine[:, i]
        rows[:, i, 1, 3 * i + 1], rows[:, i, 1, 3 * i + 2] = sine[:, i], cosine[:, i]
    return rows


def facet_masses(plane: np.ndarray, angle: np.ndarray, area: np.ndarray, areal_density: float) -> np.ndarray:
    """Mass matrices (m, 9, 9) of triangles with cubic shapes, kg times metres for slopes."""
    points, weights = np.polynomial.legendre.leggauss(_MASS_POINTS)
    points, weights = 0.5 * (points + 1.0), 0.5 * weights
    x, y = (grid.ravel() for grid in np.meshgrid(points, points, indexing="ij"))
    at = np.stack([1.0 - x, x * (1.0 - y), x * y], axis=1)
    weight = 2.0 * np.outer(weights * points, weights).ravel()
    rows = cubic_rows(plane, angle, at)
    return np.asarray(areal_density * area[:, None, None] * np.einsum("p,mpi,mpj->mij", weight, rows, rows))


def membrane_moduli(rows: FacetRows, plane: np.ndarray, angle: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Moduli (m, 15, 15), N m, of the strains in `fsm.model.nodes.facets.facet.FacetArrays.rest`.

    The mean strain e_0 is the integral of n u over the boundary, with cubic displacements along the edges. Neighbouring
    triangles have the same displacements there, so the patch test is satisfied. With the mean strains e_k of the edges, the
    turns g_k, the lengths l_k, and T that gives the strain of the triangle from its edges:

        e_0 = T e + sum_k l_k^2/(12 A) (g_k n n + (t E_b t - t E_a t) (n t + t n)/2)

    The strain is linear with the differences d_i = E_i - E of the corners from their mean E:

        U = A/2 (e_0 C e_0 + sum_i d_i C d_i/12 + FOLLOW (E - e_0) C (E - e_0))

    A linear strain is exact. The last term couples the slopes at the corners to the positions.
    """
    centre, at_corner = _mean_strains(rows, plane, angle)
    mean = at_corner.mean(axis=1)
    apart = at_corner - mean[:, None]
    moduli = np.einsum("mki,kl,mlj->mij", centre, stretch, centre)
    moduli += np.einsum("mcki,kl,mclj->mij", apart, stretch, apart) / 12.0
    moduli += FOLLOW * np.einsum("mki,kl,mlj->mij", mean - centre, stretch, mean - centre)
    return np.asarray(rows.area[:, None, None] * moduli)


def mid_edge_strains(rows: FacetRows, plane: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Strains exx, eyy, 2 exy at the middles of the edges (m, 3, 3, 15) from the strains of `membrane_moduli`.

    The mean of W at these points is the mean of W over the triangle.
    """
    centre, at_corner = _mean_strains(rows, plane, angle)
    apart = at_corner - at_corner.mean(axis=1)[:, None]
    return np.asarray(centre[:, None] + 0.5 * (apart + np.roll(apart, -1, axis=1)))


def _mean_strains(rows: FacetRows, plane: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """e_0 (m, 3, 15) and E_i (m, 3, 3, 15) of `membrane_moduli`."""
    count = len(angle)
    at_corner = np.zeros((count, 3, 3, 15))
    for i in range(3):
        at_corner[:, i, :, 3 + 3 * i : 6 + 3 * i] = _strain_turns(-angle[:, i])
    along = np.roll(plane, -1, axis=1) - plane
    length = np.linalg.norm(along, axis=2)
    t = along / length[..., None]
    x, y = t[..., 0], t[..., 1]  # the normal is (-y, x)
    of_edges = np.linalg.inv(rows.to_strain)
    bend = np.stack([y * y, x * x, -2.0 * x * y], axis=-1)  # n n as exx, eyy, 2 exy
    shear = np.stack([-x * y, x * y, x * x - y * y], axis=-1)  # (n t + t n)/2
    centre = np.zeros((count, 3, 15))
    centre[:, :, :3] = rows.to_strain
    for k in range(3):
        size = length[:, k] ** 2 / (12.0 * rows.area)
        centre[:, :, 12 + k] += size[:, None] * bend[:, k]
        change = np.einsum("mj,mjs->ms", of_edges[:, k], at_corner[:, (k + 1) % 3] - at_corner[:, k])
        centre += size[:, None, None] * shear[:, k, :, None] * change[:, None]
    return centre, at_corner


def _strain_turns(angle: np.ndarray) -> np.ndarray:
    """Matrices (..., 3, 3) that give exx, eyy, 2 exy in axes rotated by angles (...,)."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.empty((*np.shape(angle), 3, 3))
    turn[..., 0, :] = np.stack([c * c, s * s, c * s], axis=-1)
    turn[..., 1, :] = np.stack([s * s, c * c, -c * s], axis=-1)
    turn[..., 2, :] = np.stack([-2 * c * s, 2 * c * s, c * c - s * s], axis=-1)
    return turn
