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
from fsm.model.nodes.curvature import add_curvature_hessian, add_mapped, curvature_gradient, map_vectors, normal
from fsm.model.nodes.facets.facet import (
    FacetArrays,
    add_geometric,
    bend_point,
    columns_of,
    gather,
    stretch_efforts,
    stretch_gradients,
    stretch_strains,
)


@kernel
def facet_rates(
    facets: FacetArrays, rows: np.ndarray, q: np.ndarray, u: np.ndarray, stretching: np.ndarray, turning: np.ndarray
) -> None:
    """Rates of the strains (m, 5, 3) and of the curvatures (m, 3, 3), 1/s and 1/(m s); `rows`: `FacetRows.bend`."""
    e, v, slopes, strains = np.empty((9, 3)), np.empty((9, 3)), np.empty((3, 4, 3)), np.empty((5, 3))
    gradients, gradient = np.zeros((15, 27)), np.empty((3, 15))
    g, w, n, c = np.empty(15), np.empty(15), np.empty(3), np.empty(3)
    for k in range(facets.vectors.shape[0]):
        gather(facets.vectors[k], q, e)
        gather(facets.vectors[k], u, v)
        stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        stretch_gradients(facets.edges[k], facets.across[k], slopes, e, gradients)
        for s in range(15):
            total = 0.0
            for i in range(27):
                total += gradients[s, i] * v[i // 3, i % 3]
            stretching[k, s // 3, s % 3] = total
        for point in range(3):
            bend_point(rows[k, point], e, g)
            bend_point(rows[k, point], v, w)
            curvature_gradient(g, n, normal(g, n), c, gradient)
            for i in range(3):
                turning[k, point, i] = 0.0
                for j in range(15):
                    turning[k, point, i] += gradient[i, j] * w[j]


@kernel
def facet_dissipation(
    facets: FacetArrays, rows: np.ndarray, tau: float, q: np.ndarray, stretching: np.ndarray, turning: np.ndarray,
    force: np.ndarray,
) -> float:  # fmt: skip
    """Add the forces of damping of all triangles; returns the dissipated power, W.

    Parameters
    ----------
    facets : FacetArrays
    rows : (m, 3, 5, 9) array
        `FacetRows.bend`.
    tau : s
    q : (n,) array
    stretching, turning : (m, 5, 3) and (m, 3, 3) arrays
        See `facet_rates`.
    force : (n,) array, changed in place
    """
    e, slopes, strains, efforts = np.empty((9, 3)), np.empty((3, 4, 3)), np.empty((5, 3)), np.empty((5, 3))
    gradients, gradient = np.zeros((15, 27)), np.empty((3, 15))
    g, n, c, m, f = np.empty(15), np.empty(3), np.empty(3), np.empty(3), np.empty(27)
    power = 0.0
    for k in range(facets.vectors.shape[0]):
        gather(facets.vectors[k], q, e)
        stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        stretch_gradients(facets.edges[k], facets.across[k], slopes, e, gradients)
        stretch_efforts(facets.moduli[k], stretching[k], efforts)
        f[:] = 0.0
        for s in range(15):
            effort = tau * efforts[s // 3, s % 3]
            power += effort * stretching[k, s // 3, s % 3]
            for i in range(27):
                f[i] += effort * gradients[s, i]
        for point in range(3):
            bend_point(rows[k, point], e, g)
            curvature_gradient(g, n, normal(g, n), c, gradient)
            _moments(facets.bend_moduli[k], tau, turning[k, point], m)
            for i in range(3):
                power += m[i] * turning[k, point, i]
            for d in range(5):
                for a in range(3):
                    effort = 0.0
                    for i in range(3):
                        effort += m[i] * gradient[i, 3 * d + a]
                    for j in range(9):
                        f[3 * j + a] += rows[k, point, d, j] * effort
        for i in range(9):
            for a in range(3):
                force[facets.vectors[k, i] + a] -= f[3 * i + a]
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
    gradients, changes, weighed = np.zeros((15, 27)), np.zeros((15, 27)), np.empty((15, 27))
    h, d, others, plain = np.empty((27, 27)), np.empty((27, 27)), np.zeros((27, 27)), np.empty((9, 9))
    g, w, n, c, work = np.empty(15), np.empty(15), np.empty(3), np.empty(3), np.empty((8, 6))
    gradient, change, m, unit = np.empty((3, 15)), np.empty((3, 15)), np.empty(3), np.empty(3)
    turn, moments, turn_change = np.empty((3, 27)), np.empty((3, 27)), np.empty((3, 27))
    of_q, half, moving = np.empty((15, 15)), np.empty((15, 27)), _any(u)
    for k in range(facets.vectors.shape[0]):
        gather(facets.vectors[k], q, e)
        stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], e, slopes, strains)
        stretch_gradients(facets.edges[k], facets.across[k], slopes, e, gradients)
        for s in range(15):
            weighed[s] = 0.0
            for r in range(15):
                x = tau * facets.moduli[k, s, r]
                first, last = columns_of(r)
                for i in range(first, last):
                    weighed[s, i] += x * gradients[r, i]
        stretch_efforts(facets.moduli[k], stretching[k], efforts)
        efforts *= tau
        h[:] = 0.0
        d[:] = 0.0
        for s in range(15):  # h and d are symmetric, so only their upper triangles are summed; `others` is not
            first, last = columns_of(s)
            for i in range(first, last):
                x = gradients[s, i]
                for j in range(i, 27):
                    d[i, j] += x * weighed[s, j]
        if moving:
            gather(facets.vectors[k], u, v)
            stretch_strains(facets.edges[k], facets.across[k], facets.rest[k], v, rising, strains)
            stretch_gradients(facets.edges[k], facets.across[k], rising, v, changes)  # strains are quadratic
            others[:] = 0.0
            _add_products(weighed, changes, others)
        plain[:] = 0.0
        add_geometric(facets.edges[k], facets.across[k], efforts, plain)
        for i in range(9):
            for j in range(i, 9):
                for a in range(3):
                    h[3 * i + a, 3 * j + a] += plain[i, j]
        for point in range(3):
            bend_point(rows[k, point], e, g)
            length = normal(g, n)
            curvature_gradient(g, n, length, c, gradient)
            map_vectors(gradient, rows[k, point], turn)
            _moments(facets.bend_moduli[k], tau, turning[k, point], m)
            for i in range(3):
                for j in range(27):
                    moments[i, j] = 0.0
                    for r in range(3):
                        moments[i, j] += tau * facets.bend_moduli[k, i, r] * turn[r, j]
            for r in range(3):
                for i in range(27):
                    x = turn[r, i]
                    for j in range(i, 27):
                        d[i, j] += x * moments[r, j]
            if moving:
                bend_point(rows[k, point], v, w)
                for i in range(3):
                    unit[:] = 0.0
                    unit[i] = 1.0
                    of_q[:] = 0.0
                    add_curvature_hessian(g, n, length, unit, work, of_q)
                    for j in range(15):
                        change[i, j] = 0.0
                        for r in range(15):
                            change[i, j] += of_q[j, r] * w[r]
                map_vectors(change, rows[k, point], turn_change)
                _add_products(moments, turn_change, others)
            of_q[:] = 0.0
            add_curvature_hessian(g, n, length, m, work, of_q)
            add_mapped(of_q, rows[k, point], half, h)
        for i in range(27):
            for j in range(i):
                h[i, j], d[i, j] = h[j, i], d[j, i]
        for i in range(9):
            for j in range(9):
                slot = slots[k, i, j]
                for a in range(3):
                    for b in range(3):
                        stiffness[slot + a * size + b] += h[3 * i + a, 3 * j + b] + others[3 * i + a, 3 * j + b]
                        damping[slot + a * size + b] += d[3 * i + a, 3 * j + b]


@kernel(inline=True)
def _any(values: np.ndarray) -> bool:
    found = False
    for i in range(values.shape[0]):
        found = found or values[i] != 0.0
    return found


@kernel
def _add_products(left: np.ndarray, right: np.ndarray, out: np.ndarray) -> None:
    """Add the product (27, 27) of the transpose of a matrix (r, 27), and a matrix (r, 27)."""
    for r in range(left.shape[0]):
        for i in range(27):
            x = left[r, i]
            for j in range(27):
                out[i, j] += x * right[r, j]
