"""Planar beam without shear, 8 coordinates (r1, r1x, r2, r2x): the ANCF cable (Sun et al. 2024) in a plane.

    eps = (r'.r' - 1)/2,   kappa = (r' x r'')/|r'|^2,   U = 1/2 int EA eps^2 + EI kappa^2 dx.

kappa is the curvature per unstretched length, so bending and stretch are not coupled. There are three Gauss points. With two
points the stretch has a mode without energy, in which all slopes grow equally.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


def bernoulli_shape(xi: np.ndarray, length: float) -> np.ndarray:
    """Shape functions at points, (n, 4); xi = x/L."""
    x2, x3 = xi**2, xi**3
    return np.stack(
        [1.0 - 3.0 * x2 + 2.0 * x3, length * (xi - 2.0 * x2 + x3), 3.0 * x2 - 2.0 * x3, length * (x3 - x2)], axis=-1
    )


def bernoulli_rows(xi: np.ndarray, length: float) -> np.ndarray:
    """First and second derivatives of the shape functions with respect to x, (n, 2, 4)."""
    x2 = xi**2
    first = [(6.0 * x2 - 6.0 * xi) / length, 1.0 - 4.0 * xi + 3.0 * x2, (6.0 * xi - 6.0 * x2) / length, 3.0 * x2 - 2.0 * xi]
    second = [
        (12.0 * xi - 6.0) / length**2, (6.0 * xi - 4.0) / length, (6.0 - 12.0 * xi) / length**2, (6.0 * xi - 2.0) / length,
    ]  # fmt: skip
    return np.stack([np.stack(first, axis=-1), np.stack(second, axis=-1)], axis=1)


@kernel
def _strains(z: np.ndarray, strain: np.ndarray, gradient: np.ndarray) -> None:
    """Compute (eps, kappa) and their gradients (2, 4) with respect to z = (r', r'')."""
    ax, ay, bx, by = z[0], z[1], z[2], z[3]
    square = ax * ax + ay * ay
    strain[0], strain[1] = 0.5 * (square - 1.0), (ax * by - ay * bx) / square
    turn = 2.0 * strain[1] / square
    gradient[0, 0], gradient[0, 1] = ax, ay
    gradient[1, 0], gradient[1, 1] = by / square - turn * ax, -bx / square - turn * ay
    gradient[1, 2], gradient[1, 3] = -ay / square, ax / square


@kernel
def _hessians(z: np.ndarray, hessian: np.ndarray) -> None:
    """Compute second derivatives (2, 4, 4) of the strains with respect to z; constant zero entries are not written."""
    a, b = (z[0], z[1]), (z[2], z[3])
    square = a[0] * a[0] + a[1] * a[1]
    two, three = 1.0 / (square * square), 1.0 / (square * square * square)
    m = a[0] * b[1] - a[1] * b[0]
    y, along = (b[1], -b[0]), (-a[1], a[0])
    for i in range(2):
        hessian[0, i, i] = 1.0
        for j in range(2):
            unit = 1.0 if i == j else 0.0
            turned = (1.0 if j == 1 else 0.0) if i == 0 else (-1.0 if j == 0 else 0.0)
            hessian[1, i, j] = -2.0 * (y[i] * a[j] + a[i] * y[j] + m * unit) * two + 8.0 * m * a[i] * a[j] * three
            mixed = -turned / square - 2.0 * along[i] * a[j] * two
            hessian[1, 2 + i, j] = mixed
            hessian[1, j, 2 + i] = mixed


@kernel
def bernoulli_strains(z: np.ndarray, strains: np.ndarray, gradients: np.ndarray) -> None:
    """Compute (eps, kappa) (m, g, 2) and gradients (m, g, 2, 4) from z (m, g, 4); constant zeros are not set."""
    for i in range(z.shape[0]):
        for g in range(z.shape[1]):
            _strains(z[i, g], strains[i, g], gradients[i, g])


@kernel
def bernoulli_hessians(z: np.ndarray, hessians: np.ndarray) -> None:
    """Compute second derivatives (m, g, 2, 4, 4) of the strains; constant zeros are not set."""
    for i in range(z.shape[0]):
        for g in range(z.shape[1]):
            _hessians(z[i, g], hessians[i, g])
