"""Shear-deformable beam with the strains of its sections (Reissner 1972; coordinates of Peng et al. 2019).

With a = r_x, d = r_y and b = r_xy on the axis, l = |d|, the section's normal t = (d_y, -d_x)/l and its direction d/l:

    Gamma1 = a.t - 1,   Gamma2 = a.d/l,   kappa = (d x b)/l^2,   E22 = (d.d - 1)/2,
    U = 1/2 int EA Gamma1^2 + k GA Gamma2^2 + EI kappa^2 + EA E22^2 dx.

The strains are exact for any rotation. There is no Poisson effect, so no Poisson locking. The shear factor k is the user's
value or 5/6. The strain E22 has one purpose: it keeps the unloaded stretch of the section at one. Three Gauss points
integrate the axis of a bar without spurious modes and without locking (docs/theory.md).
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def _strains(z: np.ndarray, strain: np.ndarray, gradient: np.ndarray) -> None:
    """Compute (Gamma1, Gamma2, kappa, E22) and their gradients (4, 6) with respect to z = (a, d, b)."""
    ax, ay, dx, dy, bx, by = z[0], z[1], z[2], z[3], z[4], z[5]
    square = dx * dx + dy * dy
    one = 1.0 / np.sqrt(square)
    three = one / square
    c, p, m = ax * dy - ay * dx, ax * dx + ay * dy, dx * by - dy * bx
    strain[0], strain[1], strain[2], strain[3] = c * one - 1.0, p * one, m / square, 0.5 * (square - 1.0)
    gradient[0, 0], gradient[0, 1] = dy * one, -dx * one
    gradient[0, 2], gradient[0, 3] = -ay * one - c * three * dx, ax * one - c * three * dy
    gradient[1, 0], gradient[1, 1] = dx * one, dy * one
    gradient[1, 2], gradient[1, 3] = ax * one - p * three * dx, ay * one - p * three * dy
    turn = 2.0 * m / (square * square)
    gradient[2, 2], gradient[2, 3] = by / square - turn * dx, -bx / square - turn * dy
    gradient[2, 4], gradient[2, 5] = -dy / square, dx / square
    gradient[3, 2], gradient[3, 3] = dx, dy


@kernel
def _hessians(z: np.ndarray, hessian: np.ndarray) -> None:
    """Compute second derivatives (4, 6, 6) of the strains with respect to z; constant zero entries are not written."""
    ax, ay, dx, dy, bx, by = z[0], z[1], z[2], z[3], z[4], z[5]
    square = dx * dx + dy * dy
    one = 1.0 / np.sqrt(square)
    three, five = one / square, one / (square * square)
    c, p, m = ax * dy - ay * dx, ax * dx + ay * dy, dx * by - dy * bx
    four, six = 1.0 / (square * square), 1.0 / (square * square * square)
    d = (dx, dy)
    v, a, y = (-ay, ax), (ax, ay), (by, -bx)
    across, along = (dy, -dx), (-dy, dx)
    for i in range(2):
        for j in range(2):
            unit = 1.0 if i == j else 0.0
            # derivative of (dy, -dx) and of (-dy, dx) with respect to d
            turned = (1.0 if j == 1 else 0.0) if i == 0 else (-1.0 if j == 0 else 0.0)
            dd = d[i] * d[j]
            h0, h1 = turned * one - across[i] * d[j] * three, unit * one - dd * three
            h2 = -turned / square - 2.0 * along[i] * d[j] * four
            hessian[0, i, 2 + j] = h0
            hessian[0, 2 + j, i] = h0
            hessian[1, i, 2 + j] = h1
            hessian[1, 2 + j, i] = h1
            hessian[2, 4 + i, 2 + j] = h2
            hessian[2, 2 + j, 4 + i] = h2
            hessian[0, 2 + i, 2 + j] = -(v[i] * d[j] + d[i] * v[j] + c * unit) * three + 3.0 * c * dd * five
            hessian[1, 2 + i, 2 + j] = -(a[i] * d[j] + d[i] * a[j] + p * unit) * three + 3.0 * p * dd * five
            hessian[2, 2 + i, 2 + j] = -2.0 * (y[i] * d[j] + d[i] * y[j] + m * unit) * four + 8.0 * m * dd * six
            hessian[3, 2 + i, 2 + j] = unit


@kernel
def section_strains(z: np.ndarray, strains: np.ndarray, gradients: np.ndarray) -> None:
    """Compute (Gamma1, Gamma2, kappa, E22) (m, g, 4) and their gradients (m, g, 4, 6) from z; constant zeros are not set."""
    for i in range(z.shape[0]):
        for g in range(z.shape[1]):
            _strains(z[i, g], strains[i, g], gradients[i, g])


@kernel
def section_hessians(z: np.ndarray, hessians: np.ndarray) -> None:
    """Compute second derivatives (m, g, 4, 6, 6) of the strains; constant zeros are not set."""
    for i in range(z.shape[0]):
        for g in range(z.shape[1]):
            _hessians(z[i, g], hessians[i, g])
