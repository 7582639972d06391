"""Swing and twist of a relative rotation, with derivatives (docs/theory.md).

q = swing(s1, 0, s3) twist(psi about e2):   psi = 2 atan2(q2, q0),   (s1, s3) = the swing's rotation vector.

With the same psi, the swing can be measured in the axes half-way between both bodies instead of the outer body's axes:

    q = twist(psi/2) swing(s1, 0, s3) twist(psi/2):   (s1, s3) = f(n) (q1, q3),   n = sqrt(q0^2 + q2^2)

All three change their sign if the bodies are exchanged (q becomes its conjugate). Therefore none of the three contains
a product of the other two. In the axes of the outer body, s1 contains psi s3/2, and s3 contains psi s1/2.

The relative quaternion of two joint frames is q = conj(q_b) q_a. For body-axis increments d_a, d_b (in joint axes)

    dq = 1/2 q d_a - 1/2 d_b q ,    d(dq_a,i)/dd_a,j = 1/4 q e_j e_i ,   d(dq_a,i)/dd_b,j = -1/4 e_j q e_i , ...

A quaternion that evolves continuously carries psi through +-180 degrees. The joint axes are anchored at the initial angle,
so the range is the initial angle +-360 degrees.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.tensor import Matrix, Quaternion, Vector, quaternion_product

Slopes = tuple[float, float, float, float, float, float, float, float, float, float, float]
"""Derivatives of a measure with respect to q: 0, 1, 2, 3, then 00, 02, 22, 01, 12, 03, 23; those for 11, 13, 33 are zero."""

_SERIES: Final = tuple(2.0 * math.prod(k / (2 * k + 1) for k in range(1, order + 1)) for order in range(12))


@kernel(inline=True)
def product(p: np.ndarray, r: np.ndarray, out: np.ndarray) -> None:
    """Write the quaternion product p r into `out` (4,)."""
    out[0] = p[0] * r[0] - p[1] * r[1] - p[2] * r[2] - p[3] * r[3]
    out[1] = p[0] * r[1] + p[1] * r[0] + p[2] * r[3] - p[3] * r[2]
    out[2] = p[0] * r[2] - p[1] * r[3] + p[2] * r[0] + p[3] * r[1]
    out[3] = p[0] * r[3] + p[1] * r[2] - p[2] * r[1] + p[3] * r[0]


@kernel
def relative_quaternion(
    pose_a: np.ndarray, pose_b: np.ndarray, axes_a: np.ndarray, axes_b: np.ndarray, work: np.ndarray, out: np.ndarray
) -> None:
    """Write conj(q_b axes_b) q_a axes_a into `out` (4,); `work` (2, 4) is scratch."""
    product(pose_a[3:], axes_a, work[0])
    product(pose_b[3:], axes_b, work[1])
    work[1, 1] = -work[1, 1]
    work[1, 2] = -work[1, 2]
    work[1, 3] = -work[1, 3]
    product(work[1], work[0], out)


@kernel
def increments(q: np.ndarray, out: np.ndarray) -> None:
    """Write dq/d(increments) into `out` (6, 4): rows 0-2 inner body, 1/2 q e_i; rows 3-5 outer body, -1/2 e_i q."""
    w, x, y, z = 0.5 * q[0], 0.5 * q[1], 0.5 * q[2], 0.5 * q[3]
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = -x, w, z, -y
    out[1, 0], out[1, 1], out[1, 2], out[1, 3] = -y, -z, w, x
    out[2, 0], out[2, 1], out[2, 2], out[2, 3] = -z, y, -x, w
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = x, -w, z, -y
    out[4, 0], out[4, 1], out[4, 2], out[4, 3] = y, -z, -w, x
    out[5, 0], out[5, 1], out[5, 2], out[5, 3] = z, y, -x, -w


@kernel
def second_increment(row: int, column: int, steps: np.ndarray, out: np.ndarray) -> None:
    """Write d(dq_row)/d(increment column) into `out` (4,), from the `increments`.

    dq_row = 1/2 q e_i for the inner body, so its change is 1/2 (dq_column) e_i; for the outer body it is -1/2 e_i
    (dq_column).
    """
    d0, d1, d2, d3 = 0.5 * steps[column, 0], 0.5 * steps[column, 1], 0.5 * steps[column, 2], 0.5 * steps[column, 3]
    if row == 0:
        out[0], out[1], out[2], out[3] = -d1, d0, d3, -d2
    elif row == 1:
        out[0], out[1], out[2], out[3] = -d2, -d3, d0, d1
    elif row == 2:
        out[0], out[1], out[2], out[3] = -d3, d2, -d1, d0
    elif row == 3:
        out[0], out[1], out[2], out[3] = d1, -d0, d3, -d2
    elif row == 4:
        out[0], out[1], out[2], out[3] = d2, -d3, -d0, d1
    else:
        out[0], out[1], out[2], out[3] = d3, d2, -d1, -d0


@kernel(inline=True)
def twist_slopes(q: Quaternion) -> tuple[float, Slopes]:
    """psi = 2 atan2(q2, q0) and its derivatives with respect to q."""
    square = q[0] * q[0] + q[2] * q[2]
    s00 = 4.0 * q[0] * q[2] / (square * square)
    s02 = 2.0 * (q[2] * q[2] - q[0] * q[0]) / (square * square)
    slopes = (-2.0 * q[2] / square, 0.0, 2.0 * q[0] / square, 0.0, s00, s02, -s00, 0.0, 0.0, 0.0, 0.0)
    return 2.0 * np.arctan2(q[2], q[0]), slopes


@kernel
def twist_measure(q: np.ndarray, first: np.ndarray, second: np.ndarray) -> float:
    """psi = 2 atan2(q2, q0), its gradient `first` (4,) and Hessian `second` (4, 4) with respect to q."""
    value, slopes = twist_slopes((q[0], q[1], q[2], q[3]))
    _fill(slopes, first, second)
    return value


@kernel
def _fill(slopes: Slopes, first: np.ndarray, second: np.ndarray) -> None:
    """Slopes as a vector (4,) and a symmetric matrix (4, 4)."""
    first[0], first[1], first[2], first[3], s00, s02, s22, s01, s12, s03, s23 = slopes
    second[:] = 0.0
    second[0, 0], second[2, 2] = s00, s22
    second[0, 2] = second[2, 0] = s02
    second[0, 1] = second[1, 0] = s01
    second[1, 2] = second[2, 1] = s12
    second[0, 3] = second[3, 0] = s03
    second[2, 3] = second[3, 2] = s23


@kernel
def _stretch(n: float) -> tuple[float, float, float]:
    """f = 2 acos(n)/sqrt(1 - n^2), ratio of the swing's rotation vector to its vector part, and two derivatives."""
    e = 1.0 - n
    if e < 0.02:
        # f = 2 sum_k k!/(2k+1)!! e^k
        value = first = half_second = 0.0
        for k in range(len(_SERIES) - 1, -1, -1):
            half_second = half_second * e + first
            first = first * e + value
            value = value * e + _SERIES[k]
        return value, -first, 2.0 * half_second
    square = 1.0 - n * n
    value = 2.0 * np.arccos(n) / np.sqrt(square)
    first = (n * value - 2.0) / square
    second = (value + 3.0 * n * first) / square
    return value, first, second


@kernel(inline=True)
def swing_slopes(q: Quaternion, half_way: bool) -> tuple[float, float, Slopes, Slopes]:
    """s1 and s3 in the axes of the outer body or half-way between both bodies, and their derivatives with respect to q.

    n = sqrt(q0^2 + q2^2),  s1 = f(n) (q1 q0 + q3 q2)/n,  s3 = f(n) (q3 q0 - q1 q2)/n  in the axes of the outer body.
    This is s = f(n)/n * B(q) with a bilinear form B; h(n) = f/n. Half-way, B is linear and h = f.
    """
    if q[0] == 0.0 and q[2] == 0.0:
        # at 180 degrees the values exist but not the slopes; the twist of `twist_slopes` is zero
        q = (1e-100, q[1], 0.0, q[3])
    n = np.sqrt(q[0] * q[0] + q[2] * q[2])
    f, f1, f2 = _stretch(min(n, 1.0))
    if half_way:
        n0, n2 = q[0] / n, q[2] / n
        return (
            f * q[1],
            f * q[3],
            _swing_slopes(q[1], 0.0, 1.0, 0.0, 0.0, f, f1, f2, n, n0, n2, 0.0, 0.0),
            _swing_slopes(q[3], 0.0, 0.0, 0.0, 1.0, f, f1, f2, n, n0, n2, 0.0, 0.0),
        )
    h = f / n
    h1 = (f1 - h) / n
    h2 = (f2 - 2.0 * h1) / n
    # gradient and Hessian of n with respect to (q0, q2)
    n0, n2 = q[0] / n, q[2] / n
    form = q[1] * q[0] + q[3] * q[2]
    b0, b1, b2, b3 = q[1], q[0], q[3], q[2]
    slopes_1 = _swing_slopes(form, b0, b1, b2, b3, h, h1, h2, n, n0, n2, 1.0, 0.0)
    value_1 = h * form
    form = q[3] * q[0] - q[1] * q[2]
    b0, b1, b2, b3 = q[3], -q[2], -q[1], q[0]
    slopes_3 = _swing_slopes(form, b0, b1, b2, b3, h, h1, h2, n, n0, n2, 0.0, 1.0)
    return value_1, h * form, slopes_1, slopes_3


@kernel(inline=True)
def _swing_slopes(
    form: float, b0: float, b1: float, b2: float, b3: float,
    h: float, h1: float, h2: float, n: float, n0: float, n2: float, first: float, third: float,
) -> Slopes:  # fmt: skip
    """Derivatives of h(n) B from B (`form`) and its gradient; `first` or `third` is 1 to select s1 or s3."""
    n00, n22, n02 = n2 * n2 / n, n0 * n0 / n, -n0 * n2 / n
    return (
        h1 * n0 * form + h * b0,
        h * b1,
        h1 * n2 * form + h * b2,
        h * b3,
        (h2 * n0 * n0 + h1 * n00) * form + 2.0 * h1 * n0 * b0,
        (h2 * n0 * n2 + h1 * n02) * form + h1 * (n0 * b2 + n2 * b0),
        (h2 * n2 * n2 + h1 * n22) * form + 2.0 * h1 * n2 * b2,
        h1 * n0 * b1 + first * h,
        h1 * n2 * b1 - third * h,
        h1 * n0 * b3 + third * h,
        h1 * n2 * b3 + first * h,
    )


@kernel(inline=True)
def _along(f: Quaternion, q: Quaternion) -> Vector:
    """f . dq for the rotations dq = 1/2 e_i q about the joint axes."""
    return (
        0.5 * (f[1] * q[0] - f[0] * q[1] + f[3] * q[2] - f[2] * q[3]),
        0.5 * (f[2] * q[0] - f[3] * q[1] - f[0] * q[2] + f[1] * q[3]),
        0.5 * (f[3] * q[0] + f[2] * q[1] - f[1] * q[2] - f[0] * q[3]),
    )


@kernel(inline=True)
def turn_gradient(slopes: Slopes, q: Quaternion) -> Vector:
    """Gradient g of a measure of q with respect to rotations about the joint axes."""
    return _along((slopes[0], slopes[1], slopes[2], slopes[3]), q)


@kernel(inline=True)
def turn_curvature(slopes: Slopes, q: Quaternion, w: Vector) -> Vector:
    """Product S w of a measure's second derivatives S with w; d2q = 1/8 (e_i e_j + e_j e_i) q, which is -q/4 or zero."""
    d = quaternion_product((0.0, 0.5 * w[0], 0.5 * w[1], 0.5 * w[2]), q)
    f0, f1, f2, f3, s00, s02, s22, s01, s12, s03, s23 = slopes
    change = (
        s00 * d[0] + s01 * d[1] + s02 * d[2] + s03 * d[3],
        s01 * d[0] + s12 * d[2],
        s02 * d[0] + s12 * d[1] + s22 * d[2] + s23 * d[3],
        s03 * d[0] + s23 * d[2],
    )
    out = _along(change, q)
    own = 0.25 * (f0 * q[0] + f1 * q[1] + f2 * q[2] + f3 * q[3])
    return out[0] - own * w[0], out[1] - own * w[1], out[2] - own * w[2]


@kernel(inline=True)
def curvature_matrix(slopes: Slopes, q: Quaternion) -> Matrix:
    """Second derivatives S of a measure of q, or of a sum of measures."""
    x = turn_curvature(slopes, q, (1.0, 0.0, 0.0))
    y = turn_curvature(slopes, q, (0.0, 1.0, 0.0))
    z = turn_curvature(slopes, q, (0.0, 0.0, 1.0))
    return x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]
