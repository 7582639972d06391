"""ANCF membrane: a thin rectangle of four nodes with position and two slopes, 36 coordinates (Sun et al. 2024).

    eps_ij = (r_i.r_j - R_i.R_j)/2,   kappa_ij = r_ij.n/|n| - kappa0_ij,   n = r_X x r_Y
    U = C/2 int ex^2 + ey^2 + 2 nu ex ey + 2 (1 - nu) exy^2 + D/2 int kx^2 + ky^2 + 2 nu kx ky + 2 (1 - nu) kxy^2
    C = E t/(1 - nu^2),   D = E t^3/(12 (1 - nu^2))

R is the unstressed shape, flat unless given. Stretch may be a tension field (`fsm.model.nodes.tension_field`). Damping is
Kelvin-Voigt damping of plain stretch and of bending: the stresses follow from strain + viscosity * rate.

Gauss points: 4 x 4 for stretch, 3 x 3 for bending; see `POINTS`. The kernels use slopes times length, so all
elements share one table of derivatives. One product with it gives the derivatives at all points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.model.nodes import curvature
from fsm.model.nodes.assembly import contract, gather, scatter_force, scatter_matrix, weigh_bending, weigh_stretch
from fsm.model.nodes.tension_field import film_energy, film_stress, film_tangent


class MembraneArrays(NamedTuple):
    """Arrays of all elements for the kernels.

    Attributes
    ----------
    vectors : (m, 12) int array
    scale : (m, 12) array
        1, b, c for positions and slopes.
    sides : (m, 2) array, m
        b, c.
    stiffness : (m, 3) array
        C (N/m), Poisson's ratio, D (N m).
    remainder : (2,) array
        eps of a tension field, 1 of a plain film, and the strain w; see `fsm.model.nodes.tension_field`.
    release : (m, s, 3) array, N/m
        P of a tension field, as xx, yy, xy; zeros of a plain film.
    rest_strain, rest_curvature : (m, s, 3), (m, p, 3) arrays
        Strain (R_i.R_j - delta_ij)/2 and curvature kappa0 of the unstressed shape, as xx, yy, xy.
    columns : (12, 2 s + 5 p) array
        Derivatives of the shape functions: first x and then y at all points of stretch; then x, y, xx, yy, xy at the points
        of bending.
    rows : transpose of `columns`
    stretch_weights, bend_weights : (s,), (p,) arrays
    """

    vectors: np.ndarray
    scale: np.ndarray
    sides: np.ndarray
    stiffness: np.ndarray
    remainder: np.ndarray
    release: np.ndarray
    rest_strain: np.ndarray
    rest_curvature: np.ndarray
    columns: np.ndarray
    rows: np.ndarray
    stretch_weights: np.ndarray
    bend_weights: np.ndarray


@kernel
def _derivatives(film: MembraneArrays, q: np.ndarray) -> np.ndarray:
    """Natural derivatives (m, 3, k) of r at all points of all elements: one product with the table."""
    count = film.vectors.shape[0]
    e = np.empty((count, 3, 12))
    for k in range(count):
        gather(film.vectors[k], film.scale[k], q, e[k])
    return np.dot(e.reshape(3 * count, 12), film.columns).reshape(count, 3, film.columns.shape[1])


@kernel(inline=True)
def _bend_point(r: np.ndarray, first: int, points: int, per_b: float, per_c: float, g: np.ndarray) -> None:
    """The five derivatives (15,) at a point of bending, with respect to material lengths; `first` is its column of x.

    Here and below `per_b` and `per_c` are 1/b and 1/c, because divisions are slow.
    """
    for a in range(3):
        g[a] = r[a, first] * per_b
        g[3 + a] = r[a, first + points] * per_c
        g[6 + a] = r[a, first + 2 * points] * (per_b * per_b)
        g[9 + a] = r[a, first + 3 * points] * (per_c * per_c)
        g[12 + a] = r[a, first + 4 * points] * (per_b * per_c)


@kernel(inline=True)
def _products(
    r: np.ndarray, v: np.ndarray, x: int, y: int, per_b: float, per_c: float
) -> tuple[float, float, float]:
    """r_X.v_X, r_Y.v_Y and (r_X.v_Y + r_Y.v_X)/2 at the columns x and y."""
    xx = yy = xy = 0.0
    for a in range(3):
        xx += r[a, x] * v[a, x]
        yy += r[a, y] * v[a, y]
        xy += r[a, x] * v[a, y] + r[a, y] * v[a, x]
    return xx * (per_b * per_b), yy * (per_c * per_c), 0.5 * xy * (per_b * per_c)


@kernel(inline=True)
def _strain(
    r: np.ndarray, point: int, points: int, per_b: float, per_c: float, rest: np.ndarray
) -> tuple[float, float, float]:
    """Green strain exx, eyy, exy at a point of stretch."""
    xx, yy, xy = _products(r, r, point, points + point, per_b, per_c)
    return 0.5 * (xx - 1.0) - rest[0], 0.5 * (yy - 1.0) - rest[1], 0.5 * xy - rest[2]


@kernel(inline=True)
def _curvature(g: np.ndarray, n: np.ndarray, kappa: np.ndarray) -> None:
    for k in range(3):
        kappa[k] = g[6 + 3 * k] * n[0] + g[7 + 3 * k] * n[1] + g[8 + 3 * k] * n[2]


@kernel(inline=True)
def _moments(kappa: np.ndarray, bending: float, poisson: float, m: np.ndarray) -> None:
    """Derivatives of the bending energy per area with respect to kappa_XX, kappa_YY, kappa_XY."""
    m[0] = bending * (kappa[0] + poisson * kappa[1])
    m[1] = bending * (kappa[1] + poisson * kappa[0])
    m[2] = 2.0 * bending * (1.0 - poisson) * kappa[2]


@kernel
def stored_energy(film: MembraneArrays, q: np.ndarray) -> tuple[float, float]:
    """Energy of stretch and of bending, J."""
    remainder, width = film.remainder[0], film.remainder[1]
    count, points = film.stretch_weights.shape[0], film.bend_weights.shape[0]
    derivatives = _derivatives(film, q)
    g, n, kappa, m = np.empty(15), np.empty(3), np.empty(3), np.empty(3)
    stretch = bend = 0.0
    for k in range(film.vectors.shape[0]):
        r = derivatives[k]
        b, c = film.sides[k]
        per_b, per_c = 1.0 / b, 1.0 / c
        plain, poisson, bending = film.stiffness[k]
        for point in range(count):
            exx, eyy, exy = _strain(r, point, count, per_b, per_c, film.rest_strain[k, point])
            density = film_energy(exx, eyy, exy, plain, poisson, remainder, width)
            free = film.release[k, point]
            density += remainder * (free[0] * exx + free[1] * eyy + 2.0 * free[2] * exy)
            stretch += b * c * film.stretch_weights[point] * density
        for point in range(points):
            _bend_point(r, 2 * count + point, points, per_b, per_c, g)
            curvature.normal(g, n)
            _curvature(g, n, kappa)
            for a in range(3):
                kappa[a] -= film.rest_curvature[k, point, a]
            _moments(kappa, bending, poisson, m)
            density = 0.5 * (m[0] * kappa[0] + m[1] * kappa[1] + m[2] * kappa[2])
            bend += b * c * film.bend_weights[point] * density
    return stretch, bend


@kernel(inline=True)
def _stretch_effort(
    r: np.ndarray, x: int, y: int, per_b: float, per_c: float, weight: float, nxx: float, nyy: float, nxy: float,
    p: np.ndarray,
) -> None:  # fmt: skip
    """Write the derivatives of the energy with respect to r_x and r_y at a point of stretch to the same columns of p."""
    for a in range(3):
        rx, ry = r[a, x] * per_b, r[a, y] * per_c
        p[a, x] = weight * per_b * (nxx * rx + nxy * ry)
        p[a, y] = weight * per_c * (nxy * rx + nyy * ry)


@kernel
def add_force(
    film: MembraneArrays, q: np.ndarray, u: np.ndarray, elastic: bool, viscosity: float, force: np.ndarray
) -> None:
    """Add the forces of all elements; without elastic forces if not `elastic`. `u` is used only if the viscosity (s) is not
    zero.
    """
    remainder, width, share = film.remainder[0], film.remainder[1], 1.0 if elastic else 0.0
    count, points = film.stretch_weights.shape[0], film.bend_weights.shape[0]
    table = film.columns.shape[1]
    elements = film.vectors.shape[0]
    derivatives, efforts = _derivatives(film, q), np.empty((elements, 3, table))
    rates = _derivatives(film, u) if viscosity > 0.0 else derivatives
    g, gv, n, c3, kappa, m = np.empty(15), np.empty(15), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    turning, effort = np.empty(3), np.empty(15)
    for k in range(film.vectors.shape[0]):
        r = derivatives[k]
        v, p = rates[k], efforts[k]
        b, c = film.sides[k]
        per_b, per_c = 1.0 / b, 1.0 / c
        plain, poisson, bending = film.stiffness[k]
        for point in range(count):
            nxx = nyy = nxy = 0.0
            if elastic:
                exx, eyy, exy = _strain(r, point, count, per_b, per_c, film.rest_strain[k, point])
                nxx, nyy, nxy = film_stress(exx, eyy, exy, plain, poisson, remainder, width)
                nxx += remainder * film.release[k, point, 0]
                nyy += remainder * film.release[k, point, 1]
                nxy += remainder * film.release[k, point, 2]
            if viscosity > 0.0:
                dxx, dyy, dxy = _products(r, v, point, count + point, per_b, per_c)
                vxx, vyy, vxy = film_stress(dxx, dyy, dxy, viscosity * plain, poisson, 1.0, 0.0)
                nxx, nyy, nxy = nxx + vxx, nyy + vyy, nxy + vxy
            weight = b * c * film.stretch_weights[point]
            _stretch_effort(r, point, count + point, per_b, per_c, weight, nxx, nyy, nxy, p)
        for point in range(points):
            first = 2 * count + point
            _bend_point(r, first, points, per_b, per_c, g)
            size = curvature.normal(g, n)
            _curvature(g, n, kappa)
            for a in range(3):
                kappa[a] = share * (kappa[a] - film.rest_curvature[k, point, a])
            if viscosity > 0.0:
                _bend_point(v, first, points, per_b, per_c, gv)
                curvature.curvature_rates(g, gv, n, size, c3, turning)
                for a in range(3):
                    kappa[a] += viscosity * turning[a]
            _moments(kappa, bending, poisson, m)
            weight = b * c * film.bend_weights[point]
            curvature.curvature_effort(g, n, size, m, c3, effort)
            for d in range(5):
                factor = weight * _length(d, per_b, per_c)
                for a in range(3):
                    p[a, first + d * points] = factor * effort[3 * d + a]
    products = np.dot(efforts.reshape(3 * elements, table), film.rows).reshape(elements, 3, 12)
    for k in range(elements):
        scatter_force(film.vectors[k], film.scale[k], -1.0, products[k], force)


@kernel(inline=True)
def _length(d: int, per_b: float, per_c: float) -> float:
    """Natural over material derivative number d (X, Y, XX, YY, XY)."""
    if d == 0:
        return per_b
    if d == 1:
        return per_c
    if d == 2:
        return per_b * per_b
    if d == 3:
        return per_c * per_c
    return per_b * per_c


@kernel(inline=True)
def _add_moduli(
    factor: float, bending: float, poisson: float, left: np.ndarray, right: np.ndarray, work: np.ndarray, out: np.ndarray
) -> None:
    """out += factor sum_kl D_kl left_k right_l^T with the bending moduli D_kl; left and right (3, 15), work too."""
    for j in range(15):
        _moments(right[:, j], factor * bending, poisson, work[:, j])
    for i in range(15):
        l0, l1, l2 = left[0, i], left[1, i], left[2, i]
        for j in range(15):
            out[i, j] += l0 * work[0, j] + l1 * work[1, j] + l2 * work[2, j]


@kernel(inline=True)
def _natural(derivatives: int, per_b: float, per_c: float, h: np.ndarray) -> None:
    """Second derivatives (3 d, 3 d), converted from material derivatives of r to natural ones."""
    for d in range(derivatives):
        for f in range(derivatives):
            factor = _length(d, per_b, per_c) * _length(f, per_b, per_c)
            for i in range(3):
                for j in range(3):
                    h[3 * d + i, 3 * f + j] *= factor


@kernel(inline=True)
def _stretch_moduli(
    x: np.ndarray, y: np.ndarray, vx: np.ndarray, vy: np.ndarray,
    moduli: tuple[float, float, float, float, float, float], factor: float, h: np.ndarray,
) -> None:  # fmt: skip
    """h += factor sum_kl c_kl b_k(x, y) b_l(vx, vy)^T, b_k the derivatives (6,) of exx, eyy, 2 exy."""
    c11, c12, c13, c22, c23, c33 = moduli
    for a in range(3):
        # columns of c b: derivatives of the stresses
        for b in range(3):
            h[a, b] += factor * (x[a] * (c11 * vx[b] + c13 * vy[b]) + y[a] * (c13 * vx[b] + c33 * vy[b]))
            h[a, 3 + b] += factor * (x[a] * (c12 * vy[b] + c13 * vx[b]) + y[a] * (c23 * vy[b] + c33 * vx[b]))
            h[3 + a, b] += factor * (y[a] * (c12 * vx[b] + c23 * vy[b]) + x[a] * (c13 * vx[b] + c33 * vy[b]))
            h[3 + a, 3 + b] += factor * (y[a] * (c22 * vy[b] + c23 * vx[b]) + x[a] * (c23 * vy[b] + c33 * vx[b]))


@kernel
def add_tangent(
    film: MembraneArrays, q: np.ndarray, u: np.ndarray, elastic: bool, moving: float, viscosity: float,
    slots: np.ndarray, size: int, into_stiffness: np.ndarray, into_damping: np.ndarray,
) -> None:  # fmt: skip
    """Add -dh/dq and -dh/du to the flat block data; `moving` is the viscosity, or 0 at rest (u is not used), and -dh/dq is
    that of dampers alone if not `elastic`.
    """
    remainder, width, share = film.remainder[0], film.remainder[1], 1.0 if elastic else 0.0
    count, points = film.stretch_weights.shape[0], film.bend_weights.shape[0]
    table = film.columns.shape[1]
    derivatives = _derivatives(film, q)
    rate_derivatives = _derivatives(film, u) if moving > 0.0 else derivatives
    x, y, vx, vy = np.empty(3), np.empty(3), np.zeros(3), np.zeros(3)
    g, gv, n, c3 = np.empty(15), np.empty(15), np.empty(3), np.empty(3)
    kappa, m, work = np.empty(3), np.empty(3), np.empty((5, 3))
    gradient, turned, rates = np.empty((3, 15)), np.empty((8, 6)), np.empty((3, 15))
    stretch, bend = np.empty((6, 6)), np.empty((15, 15))
    changed, element = np.empty((3, 15)), np.empty((3, 3, 12, 12))
    symmetric = not moving > 0.0
    pairs = 6 if symmetric else 9
    weighed, products = np.empty((table, pairs, 12)), np.empty((12, 12 * pairs))
    viscous, viscous_products = np.empty((table, 6, 12)), np.empty((12, 72))
    for k in range(film.vectors.shape[0]):
        r = derivatives[k]
        v = rate_derivatives[k]
        b, c = film.sides[k]
        per_b, per_c = 1.0 / b, 1.0 / c
        plain, poisson, bending = film.stiffness[k]
        plain_moduli = film_tangent(0.0, 0.0, 0.0, plain, poisson, 1.0, 0.0)
        for point in range(count):
            weight = b * c * film.stretch_weights[point]
            for a in range(3):
                x[a], y[a] = r[a, point] * per_b, r[a, count + point] * per_c
            nxx = nyy = nxy = 0.0
            stretch[:] = 0.0
            if elastic:
                exx, eyy, exy = _strain(r, point, count, per_b, per_c, film.rest_strain[k, point])
                nxx, nyy, nxy = film_stress(exx, eyy, exy, plain, poisson, remainder, width)
                nxx += remainder * film.release[k, point, 0]
                nyy += remainder * film.release[k, point, 1]
                nxy += remainder * film.release[k, point, 2]
                _stretch_moduli(x, y, x, y, film_tangent(exx, eyy, exy, plain, poisson, remainder, width), weight, stretch)
            if moving > 0.0:
                dxx, dyy, dxy = _products(r, v, point, count + point, per_b, per_c)
                sxx, syy, sxy = film_stress(dxx, dyy, dxy, moving * plain, poisson, 1.0, 0.0)
                nxx, nyy, nxy = nxx + sxx, nyy + syy, nxy + sxy
                for a in range(3):
                    vx[a], vy[a] = v[a, point] * per_b, v[a, count + point] * per_c
                _stretch_moduli(x, y, vx, vy, plain_moduli, moving * weight, stretch)
            for a in range(3):
                stretch[a, a] += weight * nxx
                stretch[a, 3 + a] += weight * nxy
                stretch[3 + a, a] += weight * nxy
                stretch[3 + a, 3 + a] += weight * nyy
            _natural(2, per_b, per_c, stretch)
            weigh_stretch(film.rows, point, count, stretch, symmetric, weighed)
            if viscosity > 0.0:
                stretch[:] = 0.0
                _stretch_moduli(x, y, x, y, plain_moduli, viscosity * weight, stretch)
                _natural(2, per_b, per_c, stretch)
                weigh_stretch(film.rows, point, count, stretch, True, viscous)
        for point in range(points):
            weight = b * c * film.bend_weights[point]
            first = 2 * count + point
            _bend_point(r, first, points, per_b, per_c, g)
            length = curvature.normal(g, n)
            _curvature(g, n, kappa)
            for a in range(3):
                kappa[a] = share * (kappa[a] - film.rest_curvature[k, point, a])
            curvature.curvature_gradient(g, n, length, c3, gradient)
            bend[:] = 0.0
            if moving > 0.0:
                _bend_point(v, first, points, per_b, per_c, gv)
                for a in range(3):
                    for j in range(15):
                        kappa[a] += moving * gradient[a, j] * gv[j]
                curvature.curvature_gradient_rates(g, gv, n, length, work, rates)  # d(dkappa/dt)/dq
                _add_moduli(moving * weight, bending, poisson, gradient, rates, changed, bend)
            _moments(kappa, bending, poisson, m)
            for a in range(3):
                m[a] *= weight
            curvature.add_curvature_hessian(g, n, length, m, turned, bend)
            _add_moduli(share * weight, bending, poisson, gradient, gradient, changed, bend)
            _natural(5, per_b, per_c, bend)
            weigh_bending(film.rows, first, points, bend, symmetric, weighed)
            if viscosity > 0.0:
                bend[:] = 0.0
                _add_moduli(viscosity * weight, bending, poisson, gradient, gradient, changed, bend)
                _natural(5, per_b, per_c, bend)
                weigh_bending(film.rows, first, points, bend, True, viscous)
        contract(film.columns, weighed, symmetric, products, element)
        scatter_matrix(slots[k], film.scale[k], size, element, into_stiffness)
        if viscosity > 0.0:
            contract(film.columns, viscous, True, viscous_products, element)
            scatter_matrix(slots[k], film.scale[k], size, element, into_damping)


@kernel
def dissipation(film: MembraneArrays, q: np.ndarray, u: np.ndarray, viscosity: float) -> float:
    """Dissipated power, W."""
    count, points = film.stretch_weights.shape[0], film.bend_weights.shape[0]
    derivatives, rates = _derivatives(film, q), _derivatives(film, u)
    g, gv, n, c3 = np.empty(15), np.empty(15), np.empty(3), np.empty(3)
    rate, m = np.empty(3), np.empty(3)
    power = 0.0
    for k in range(film.vectors.shape[0]):
        r, v = derivatives[k], rates[k]
        b, c = film.sides[k]
        per_b, per_c = 1.0 / b, 1.0 / c
        plain, poisson, bending = film.stiffness[k]
        for point in range(count):
            dxx, dyy, dxy = _products(r, v, point, count + point, per_b, per_c)
            density = film_energy(dxx, dyy, dxy, plain, poisson, 1.0, 0.0)
            power += 2.0 * viscosity * b * c * film.stretch_weights[point] * density
        for point in range(points):
            _bend_point(r, 2 * count + point, points, per_b, per_c, g)
            _bend_point(v, 2 * count + point, points, per_b, per_c, gv)
            curvature.curvature_rates(g, gv, n, curvature.normal(g, n), c3, rate)
            _moments(rate, bending, poisson, m)
            density = m[0] * rate[0] + m[1] * rate[1] + m[2] * rate[2]
            power += viscosity * b * c * film.bend_weights[point] * density
    return power


@kernel
def strains_at(film: MembraneArrays, q: np.ndarray) -> np.ndarray:
    """Green strains (m, s, 3) xx, yy, xy at the points of stretch."""
    count = film.stretch_weights.shape[0]
    derivatives = _derivatives(film, q)
    out = np.empty((film.vectors.shape[0], count, 3))
    for k in range(film.vectors.shape[0]):
        r = derivatives[k]
        b, c = film.sides[k]
        per_b, per_c = 1.0 / b, 1.0 / c
        for point in range(count):
            out[k, point, 0], out[k, point, 1], out[k, point, 2] = _strain(
                r, point, count, per_b, per_c, film.rest_strain[k, point]
            )
    return out


@kernel
def curvatures_at(film: MembraneArrays, q: np.ndarray) -> np.ndarray:
    """Curvatures (m, p, 3) xx, yy, xy relative to rest, at the points of bending, 1/m."""
    count, points = film.stretch_weights.shape[0], film.bend_weights.shape[0]
    derivatives = _derivatives(film, q)
    g, n, kappa = np.empty(15), np.empty(3), np.empty(3)
    out = np.empty((film.vectors.shape[0], points, 3))
    for k in range(film.vectors.shape[0]):
        r = derivatives[k]
        b, c = film.sides[k]
        per_b, per_c = 1.0 / b, 1.0 / c
        for point in range(points):
            _bend_point(r, 2 * count + point, points, per_b, per_c, g)
            curvature.normal(g, n)
            _curvature(g, n, kappa)
            for a in range(3):
                out[k, point, a] = kappa[a] - film.rest_curvature[k, point, a]
    return out
