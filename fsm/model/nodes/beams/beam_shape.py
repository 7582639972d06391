"""Shape functions of the planar shear-deformable beam with 14 coordinates (Peng et al. 2019, eqs. 1, 2).

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
