"""Rotation about a line between two directions, with first and second derivatives.

The rotation psi about c from a to b is the argument of

    z = p + i s,    p = (c.c)(a.b) - (a.c)(b.c),    s = |c| b.(a x c),

which is invariant to rigid motions and to stretch. The angle is positive upwards: from x towards z for a line along y.
Derivatives follow from log z: grad psi = Im(grad z/z), and the second derivatives are Im(grad grad z/z - grad z grad
z^T/z^2).
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel(inline=True)
def _dot(x: np.ndarray, y: np.ndarray) -> float:
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


@kernel(inline=True)
def _cross(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


@kernel(inline=True)
def _number(v: np.ndarray) -> tuple[float, float]:
    """p and s of the vectors a, b, c (3, 3)."""
    a, b, c = v[0], v[1], v[2]
    x, y, z = _cross(a, c)
    cc = _dot(c, c)
    return cc * _dot(a, b) - _dot(a, c) * _dot(b, c), np.sqrt(cc) * (b[0] * x + b[1] * y + b[2] * z)


@kernel
def fold_angle(v: np.ndarray, near: float) -> float:
    """Rotation psi of the vectors a, b, c (3, 3) within half a turn of `near`, rad."""
    p, s = _number(v)
    cosine, sine = np.cos(near), np.sin(near)
    return near + np.arctan2(s * cosine - p * sine, p * cosine + s * sine)


@kernel
def fold_gradient(v: np.ndarray, gradient: np.ndarray, along: np.ndarray) -> None:
    """Compute grad psi by a, b, c (9,), and the real part of grad z/z (9,)."""
    a, b, c = v[0], v[1], v[2]
    p, s = _number(v)
    cc, ab, ac, bc = _dot(c, c), _dot(a, b), _dot(a, c), _dot(b, c)
    size, square = np.sqrt(cc), p * p + s * s
    by_a, by_b, by_c = _cross(c, b), _cross(a, c), _cross(b, a)
    triple = s / size
    for i in range(3):
        first = cc * b[i] - bc * c[i], cc * a[i] - ac * c[i], 2.0 * ab * c[i] - bc * a[i] - ac * b[i]
        second = size * by_a[i], size * by_b[i], size * by_c[i] + triple * c[i] / size
        for k in range(3):
            gradient[3 * k + i] = (p * second[k] - s * first[k]) / square
            along[3 * k + i] = (p * first[k] + s * second[k]) / square


@kernel(inline=True)
def _skew(x: np.ndarray, i: int, j: int) -> float:
    """Entry of the matrix e_ij = epsilon_ijk x_k."""
    if i == j:
        return 0.0
    return x[3 - i - j] if (j - i) % 3 == 1 else -x[3 - i - j]


@kernel
def fold_hessian(v: np.ndarray, gradient: np.ndarray, along: np.ndarray, hessian: np.ndarray) -> None:
    """Compute second derivatives of psi (9, 9), with the results of `fold_gradient`."""
    a, b, c = v[0], v[1], v[2]
    p, s = _number(v)
    cc, ab, ac, bc = _dot(c, c), _dot(a, b), _dot(a, c), _dot(b, c)
    size, square = np.sqrt(cc), p * p + s * s
    by_a, by_b, by_c = _cross(c, b), _cross(a, c), _cross(b, a)
    triple = s / size
    hessian[:] = 0.0
    for i in range(3):
        for j in range(3):
            unit, x, y = 1.0 if i == j else 0.0, c[i] / size, c[j] / size
            # second derivatives of p and s, above the diagonal of blocks
            p_ab, s_ab = cc * unit - c[i] * c[j], -size * _skew(c, i, j)
            p_ac = 2.0 * b[i] * c[j] - c[i] * b[j] - bc * unit
            s_ac = size * _skew(b, i, j) + by_a[i] * y
            p_bc = 2.0 * a[i] * c[j] - c[i] * a[j] - ac * unit
            s_bc = -size * _skew(a, i, j) + by_b[i] * y
            p_cc = 2.0 * ab * unit - a[i] * b[j] - b[i] * a[j]
            s_cc = triple * (unit - x * y) / size + by_c[i] * y + x * by_c[j]
            one, two, three = (p * s_ab - s * p_ab) / square, (p * s_ac - s * p_ac) / square, (p * s_bc - s * p_bc) / square
            hessian[i, 3 + j] = hessian[3 + j, i] = one
            hessian[i, 6 + j] = hessian[6 + j, i] = two
            hessian[3 + i, 6 + j] = hessian[6 + j, 3 + i] = three
            hessian[6 + i, 6 + j] = (p * s_cc - s * p_cc) / square
    for i in range(9):
        for j in range(9):
            hessian[i, j] -= along[i] * gradient[j] + gradient[i] * along[j]
