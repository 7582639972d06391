"""Kernels that all planar beams use: energy, forces and tangents of strains that depend on derivatives of r.

At a point with weight w the strains s_i(z), for example with z = (r_x, r_y, r_xy) in R^6, store the energy w/2 c_i s_i^2.
The dampers dissipate w c_i beta s_i'^2. With the gradients g_i and the Hessians H_i of the strains

    effort  t_i = w c_i (s_i + beta g_i . z'),   dU/dz = sum t_i g_i,
    K_z = sum w c_i g_i (g_i + beta H_i z')^T + t_i H_i,   D_z = sum w c_i beta g_i g_i^T,

and with z = B e, B = rows x I_2: f = -B^T dU/dz, K = B^T K_z B, D = B^T D_z B.
An element type is defined by its rows and its strains.

Array shapes, here and in the elements: m elements of v plane vectors, g points, p derivatives of r, s strains.

Shape functions of the planar shear-deformable beam with 14 coordinates (Peng et al. 2019, eqs. 1, 2).

The coordinates are seven planar vectors, e = (r1, r1x, r1y, r2, r2x, r2y, r1xy). Node 1 is at x = 0, and node 2 at x = L.
With xi = x/L, the shape functions are

    s = (1 - 3 xi^2 + 2 xi^3, L (xi - 2 xi^2 + xi^3), y (1 - xi^2),
         3 xi^2 - 2 xi^3, L (xi^3 - xi^2), y xi^2, L y xi (1 - xi)).

They span 1, x, x^2, x^3, y, xy and x^2 y, and the position is r(x, y) = s . e. The section rotates
and stretches with r_y, a quadratic function of x. The axis is a cubic function of x, so its slope is quadratic too. Shear
can therefore vanish everywhere, and there is no locking.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel(inline=True)
def _at_point(rows: np.ndarray, coordinates: np.ndarray, z: np.ndarray) -> None:
    """Compute z = B e at a point, (2 p,), from rows (p, v) and coordinates (v, 2)."""
    for p in range(rows.shape[0]):
        x, y = 0.0, 0.0
        for a in range(rows.shape[1]):
            x += rows[p, a] * coordinates[a, 0]
            y += rows[p, a] * coordinates[a, 1]
        z[2 * p], z[2 * p + 1] = x, y


@kernel
def at_points(coordinates: np.ndarray, rows: np.ndarray, z: np.ndarray) -> None:
    """Compute z at all points of all elements, (m, g, 2 p), from coordinates (m, v, 2) and rows (m, g, p, v)."""
    for i in range(rows.shape[0]):
        for g in range(rows.shape[1]):
            _at_point(rows[i, g], coordinates[i], z[i, g])


@kernel(inline=True)
def _rate(gradient: np.ndarray, speed: np.ndarray) -> float:
    """Rate of a strain."""
    rate = 0.0
    for j in range(speed.shape[0]):
        rate += gradient[j] * speed[j]
    return rate


@kernel
def strain_energy(
    strain: np.ndarray,
    gradient: np.ndarray,
    rates: np.ndarray,
    rows: np.ndarray,
    stiffness: np.ndarray,
    beta: np.ndarray,
) -> tuple[float, float]:
    """Potential energy (J) and dissipated power (W) of all elements; arguments as in `strain_force`."""
    speed = np.zeros(gradient.shape[3])
    energy, power = 0.0, 0.0
    for i in range(rows.shape[0]):
        for g in range(rows.shape[1]):
            _at_point(rows[i, g], rates[i], speed)
            for k in range(strain.shape[2]):
                stiff = stiffness[i, g, k]
                rate = _rate(gradient[i, g, k], speed)
                energy += 0.5 * stiff * strain[i, g, k] * strain[i, g, k]
                power += stiff * beta[i] * rate * rate
    return energy, power


@kernel
def strain_force(
    strain: np.ndarray,
    gradient: np.ndarray,
    rates: np.ndarray,
    rows: np.ndarray,
    stiffness: np.ndarray,
    beta: np.ndarray,
) -> np.ndarray:
    """Elastic and viscous forces of a batch of elements, (m, v, 2).

    Parameters
    ----------
    strain, gradient : (m, g, s) and (m, g, s, 2 p) arrays
        Strains and their gradients at the present coordinates.
    rates : (m, v, 2) array
        Rates of the coordinates.
    rows : (m, g, p, v) array
    stiffness : (m, g, s) array
        Stiffness of each strain times the weight of the point; zero at points where a strain is not integrated.
    beta : (m,) array, s
        Kelvin-Voigt time.
    """
    width = gradient.shape[3]
    force = np.zeros(rates.shape)
    speed, by_z = np.zeros(width), np.zeros(width)
    for i in range(rows.shape[0]):
        for g in range(rows.shape[1]):
            _at_point(rows[i, g], rates[i], speed)
            by_z[:] = 0.0
            for k in range(strain.shape[2]):
                effort = strain[i, g, k] + beta[i] * _rate(gradient[i, g, k], speed)
                effort *= stiffness[i, g, k]
                for j in range(width):
                    by_z[j] += effort * gradient[i, g, k, j]
            for a in range(rows.shape[3]):
                for c in range(2):
                    for p in range(rows.shape[2]):
                        force[i, a, c] -= rows[i, g, p, a] * by_z[2 * p + c]
    return force


@kernel(inline=True)
def _spread(rows: np.ndarray, of_z: np.ndarray, half: np.ndarray, matrix: np.ndarray) -> None:
    """Add B^T of_z B to an element matrix (2 v, 2 v); `half` (2 p, 2 v) is work space."""
    derivatives, width = rows.shape
    for i in range(2 * derivatives):
        for b in range(width):
            for d in range(2):
                total = 0.0
                for p in range(derivatives):
                    total += of_z[i, 2 * p + d] * rows[p, b]
                half[i, 2 * b + d] = total
    for a in range(width):
        for c in range(2):
            for j in range(2 * width):
                total = 0.0
                for p in range(derivatives):
                    total += rows[p, a] * half[2 * p + c, j]
                matrix[2 * a + c, j] += total


@kernel
def strain_tangent(
    strain: np.ndarray,
    gradient: np.ndarray,
    hessian: np.ndarray,
    rates: np.ndarray,
    rows: np.ndarray,
    stiffness: np.ndarray,
    beta: np.ndarray,
    elastic: float,
) -> tuple[np.ndarray, np.ndarray]:
    """K = -df/de and D = -df/de' of every element, (m, 2 v, 2 v); `hessian` (m, g, s, 2 p, 2 p), else as `strain_force`.

    `elastic` is 1, or 0 for K of dampers alone, at zero strains.
    """
    width, order = gradient.shape[3], 2 * rows.shape[3]
    by_coordinates, by_rates = np.zeros((rows.shape[0], order, order)), np.zeros((rows.shape[0], order, order))
    speed, turned = np.zeros(width), np.zeros(width)
    k_z, d_z, half = np.zeros((width, width)), np.zeros((width, width)), np.zeros((width, order))
    for i in range(rows.shape[0]):
        for g in range(rows.shape[1]):
            _at_point(rows[i, g], rates[i], speed)
            k_z[:] = 0.0
            d_z[:] = 0.0
            for k in range(strain.shape[2]):
                slope, bent = gradient[i, g, k], hessian[i, g, k]
                stiff = stiffness[i, g, k]
                effort = stiff * (strain[i, g, k] + beta[i] * _rate(slope, speed))
                for j in range(width):
                    turned[j] = elastic * slope[j] + beta[i] * _rate(bent[j], speed)
                for j in range(width):
                    for n in range(width):
                        k_z[j, n] += stiff * slope[j] * turned[n] + effort * bent[j, n]
                        d_z[j, n] += stiff * beta[i] * slope[j] * slope[n]
            _spread(rows[i, g], k_z, half, by_coordinates[i])
            if beta[i] > 0.0:
                _spread(rows[i, g], d_z, half, by_rates[i])
    return by_coordinates, by_rates


def gauss_points(count: int, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre points and weights of an interval, (count,) each."""
    points, weights = np.polynomial.legendre.leggauss(count)
    half = 0.5 * (end - start)
    return start + half * (points + 1.0), half * weights


def beam_shape(xi: np.ndarray, y: np.ndarray, length: float) -> np.ndarray:
    """Shape functions at points, (n, 7).

    Parameters
    ----------
    xi : (n,) array, -       x/L
    y : (n,) array, m        from the axis
    length : m
    """
    x2, x3 = xi**2, xi**3
    return np.stack(
        [
            1.0 - 3.0 * x2 + 2.0 * x3,
            length * (xi - 2.0 * x2 + x3),
            y * (1.0 - x2),
            3.0 * x2 - 2.0 * x3,
            length * (x3 - x2),
            y * x2,
            length * y * xi * (1.0 - xi),
        ],
        axis=-1,
    )


def beam_rows(xi: np.ndarray, y: np.ndarray, length: float) -> np.ndarray:
    """Derivatives of the shape functions with respect to x, y, and both, (n, 3, 7); arguments as `beam_shape`."""
    none = np.zeros_like(xi)
    x2 = xi**2
    by_x = [
        (6.0 * x2 - 6.0 * xi) / length,
        1.0 - 4.0 * xi + 3.0 * x2,
        -2.0 * xi * y / length,
        (6.0 * xi - 6.0 * x2) / length,
        3.0 * x2 - 2.0 * xi,
        2.0 * xi * y / length,
        y * (1.0 - 2.0 * xi),
    ]
    by_y = [none, none, 1.0 - x2, none, none, x2, length * xi * (1.0 - xi)]
    by_both = [none, none, -2.0 * xi / length, none, none, 2.0 * xi / length, 1.0 - 2.0 * xi]
    return np.stack([np.stack(by, axis=-1) for by in (by_x, by_y, by_both)], axis=1)
