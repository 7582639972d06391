"""Kernels of Kelvin-Voigt damping of ANCF-DKT triangles: efforts in proportion to the rates of strains and curvatures.

With the scalars e_s of stretch (`fsm.model.nodes.facets.facet`) and the curvatures kappa_i along the normal at the middles
of the edges, the dissipated power is

    P = tau (sum C_rs e_r' e_s' + sum D_ij kappa_i' kappa_j'),    e_s' = e_s,q . u,    kappa_i' = kappa_i,q . u

with the moduli C and D of the elastic energy. Rigid motions change none of these scalars and lose no energy. In a step of a
path, the rates are differences over the step.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.model.nodes.curvature import (
    add_curvature_stiffness,
    curvature_effort,
    curvature_gradient,
    curvature_gradient_rates,
    curvature_rates,
    map_vectors,
    normal,
)
from fsm.model.nodes.facets import facet
from fsm.model.nodes.facets.facet import FacetArrays


@kernel
def facet_dissipation(
    facets: FacetArrays, rows: np.ndarray, tau: float, q: np.ndarray, u: np.ndarray, stretching: np.ndarray,
    turning: np.ndarray, force: np.ndarray,
) -> float:  # fmt: skip
    """Add the forces of damping of all triangles; returns the dissipated power, W.

    Parameters
    ----------
    facets : FacetArrays
    rows : (m, 3, 5, 9) array
        `FacetRows.bend`.
    tau : s
    q : (n,) array
    u : (n,) array
        Velocities; empty if the rates are given.
    stretching, turning : (m, 5, 3) and (m, 3, 3) arrays, 1/s and 1/(m s)
        Rates of the strains and of the curvatures. Those of the velocities are written here.
    force : (n,) array, changed in place
    """
    e, v, slopes, strains = np.empty((9, 3)), np.empty((9, 3)), np.empty((3, 4, 3)), np.empty((5, 3))
    rising, efforts, f = np.empty((3, 4, 3)), np.empty((5, 3)), np.empty((9, 3))
    g, w, n, c, m, effort = np.empty(15), np.empty(15), np.empty(3), np.empty(3), np.empty(3), np.empty(15)
    power, moving = 0.0, u.shape[0] > 0
    for k in range(facets.vectors.shape[0]):
        facet.gather(facets.vectors[k], q, e)
        facet.stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        if moving:
            facet.gather(facets.vectors[k], u, v)
            facet.stretch_rates(facets.edges[k], facets.across[k], slopes, e, v, rising, stretching[k])
        facet.stretch_efforts(facets.moduli[k], stretching[k], efforts)
        for part in range(5):
            for i in range(3):
                efforts[part, i] *= tau
                power += efforts[part, i] * stretching[k, part, i]
        f[:] = 0.0
        facet.add_stretch(facets.edges[k], facets.across[k], efforts, slopes, e, f)
        for point in range(3):
            facet.bend_point(rows[k, point], e, g)
            size = normal(g, n)
            if moving:
                facet.bend_point(rows[k, point], v, w)
                curvature_rates(g, w, n, size, c, turning[k, point])
            _moments(facets.bend_moduli[k], tau, turning[k, point], m)
            for i in range(3):
                power += m[i] * turning[k, point, i]
            curvature_effort(g, n, size, m, c, effort)
            for d in range(5):
                for i in range(9):
                    for a in range(3):
                        f[i, a] += rows[k, point, d, i] * effort[3 * d + a]
        for i in range(9):
            for a in range(3):
                force[facets.vectors[k, i] + a] -= f[i, a]
    return power


@kernel(inline=True)
def _moments(moduli: np.ndarray, tau: float, turning: np.ndarray, m: np.ndarray) -> None:
    """Efforts (3,) of the rates of curvatures (3,)."""
    for i in range(3):
        m[i] = 0.0
        for j in range(3):
            m[i] += tau * moduli[i, j] * turning[j]


@kernel
def add_facet_damping(
    facets: FacetArrays, rows: np.ndarray, tau: float, q: np.ndarray, u: np.ndarray, stretching: np.ndarray,
    turning: np.ndarray, slots: np.ndarray, size: int, stiffness: np.ndarray, damping: np.ndarray,
) -> None:  # fmt: skip
    """Add -dh/dq and -dh/du of the damping of all triangles to flat block data; other arguments as in `facet_dissipation`.

    Parameters
    ----------
    u : (n,) array
        Zero if the rates are differences over a step.
    slots : (m, 9, 9) int array
    size : size of the blocks
    stiffness, damping : flat block data, changed in place
    """
    e, v, slopes, strains = np.empty((9, 3)), np.empty((9, 3)), np.empty((3, 4, 3)), np.empty((5, 3))
    rising, efforts = np.empty((3, 4, 3)), np.empty((5, 3))
    gradients, changes, weighed = np.zeros((24, 27)), np.zeros((24, 27)), np.empty((24, 27))  # stretch, then curvatures
    d, half, further, plain = np.empty((27, 27)), np.empty((27, 27)), np.zeros((27, 27)), np.empty((9, 9))
    g, w, n, c, work = np.empty(15), np.empty(15), np.empty(3), np.empty(3), np.empty((15, 15))
    gradient, change, m, by_slopes = np.empty((3, 15)), np.empty((3, 15)), np.empty(3), np.empty((6, 27))
    moving = _any(u)
    for k in range(facets.vectors.shape[0]):
        facet.gather(facets.vectors[k], q, e)
        facet.gather(facets.vectors[k], u, v)
        facet.stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        facet.stretch_gradients(facets.edges[k], facets.across[k], slopes, e, gradients)
        np.dot(facets.moduli[k], gradients[:15], weighed[:15])
        if moving:
            facet.stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], v, rising, strains)
            facet.stretch_gradients(facets.edges[k], facets.across[k], rising, v, changes)  # strains are quadratic
        half[:] = 0.0
        for point in range(3):
            facet.bend_point(rows[k, point], e, g)
            length, own = normal(g, n), 15 + 3 * point
            curvature_gradient(g, n, length, c, gradient)
            map_vectors(gradient, rows[k, point], gradients[own : own + 3])
            for i in range(3):
                x, y, z = facets.bend_moduli[k, i, 0], facets.bend_moduli[k, i, 1], facets.bend_moduli[k, i, 2]
                for j in range(27):
                    weighed[own + i, j] = x * gradients[own, j] + y * gradients[own + 1, j] + z * gradients[own + 2, j]
            if moving:
                facet.bend_point(rows[k, point], v, w)
                curvature_gradient_rates(g, w, n, length, work, change)
                map_vectors(change, rows[k, point], changes[own : own + 3])
            _moments(facets.bend_moduli[k], tau, turning[k, point], m)
            add_curvature_stiffness(g, n, length, m, rows[k, point], work, by_slopes, half)
        facet.stretch_efforts(facets.moduli[k], stretching[k], efforts)
        efforts *= tau
        plain[:] = 0.0
        facet.add_geometric(facets.edges[k], facets.across[k], efforts, plain)
        weighed *= tau
        np.dot(gradients.T, weighed, d)
        if moving:
            np.dot(weighed.T, changes, further)
        for i in range(9):
            for j in range(9):
                slot = slots[k, i, j]
                for a in range(3):
                    stiffness[slot + a * size + a] += plain[i, j]
                    for b in range(3):
                        row, column = 3 * i + a, 3 * j + b
                        stiffness[slot + a * size + b] += (half[row, column] + half[column, row]) + further[row, column]
                        # the upper triangle stands for both, so the damping is symmetric to the last bit
                        damping[slot + a * size + b] += d[min(row, column), max(row, column)]


@kernel(inline=True)
def _any(values: np.ndarray) -> bool:
    found = False
    for i in range(values.shape[0]):
        found = found or values[i] != 0.0
    return found
