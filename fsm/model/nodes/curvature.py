"""Curvatures of a surface r(X, Y) and their derivatives with respect to r_X, r_Y, r_XX, r_YY, r_XY (numbered 0 to 4).

    kappa_ij = r_ij . n/|n|,   n = r_X x r_Y

With N = n/|n|, P = 1 - N N^T and c_ij = P r_ij/|n|:

    dkappa_ij = N . dr_ij + c_ij . dn,   dn = dr_X x r_Y + r_X x dr_Y
    d^2 kappa_ij = 2 dr_ij . P dn/|n| + 2 c_ij . (dr_X x dr_Y)
                   - (2 (N . dn)(P r_ij . dn) + (N . r_ij) dn . P dn)/|n|^2
"""

from __future__ import annotations

import math

import numpy as np

from fsm.kernels.jit import kernel


@kernel(inline=True)
def normal(g: np.ndarray, n: np.ndarray) -> float:
    """Write the unit normal into `n` (3,), return |r_X x r_Y|; g (15,) holds the five derivatives."""
    n[0] = g[1] * g[5] - g[2] * g[4]
    n[1] = g[2] * g[3] - g[0] * g[5]
    n[2] = g[0] * g[4] - g[1] * g[3]
    size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    per_size = 1.0 / size
    for a in range(3):
        n[a] *= per_size
    return size


@kernel(inline=True)
def _cross(u: np.ndarray, v: np.ndarray, out: np.ndarray) -> None:
    out[0] = u[1] * v[2] - u[2] * v[1]
    out[1] = u[2] * v[0] - u[0] * v[2]
    out[2] = u[0] * v[1] - u[1] * v[0]


@kernel(inline=True)
def curvature_gradient(g: np.ndarray, n: np.ndarray, size: float, c: np.ndarray, out: np.ndarray) -> None:
    """Compute derivatives (3, 15) of kappa_XX, kappa_YY, kappa_XY; `n` and `size` from `normal`, `c` (3,) is scratch."""
    per_size = 1.0 / size
    for k in range(3):
        along = 0.0
        for a in range(3):
            along += n[a] * g[6 + 3 * k + a]
        for a in range(3):
            c[a] = (g[6 + 3 * k + a] - along * n[a]) * per_size
        for a in range(6, 15):
            out[k, a] = 0.0
        for a in range(3):
            out[k, 6 + 3 * k + a] = n[a]
        _cross(g[3:6], c, out[k, 0:3])
        _cross(c, g[0:3], out[k, 3:6])


@kernel(inline=True)
def curvature_effort(g: np.ndarray, n: np.ndarray, size: float, m: np.ndarray, c: np.ndarray, out: np.ndarray) -> None:
    """Compute the efforts of bending at a point: the product m . gradient (15,), without forming the gradient.

    Parameters
    ----------
    g : (15,) array
    n, size : results of `normal`
    m : (3,) array
    c : (3,) array, scratch
    out : (15,) array
    """
    along = 0.0
    for a in range(3):
        c[a] = m[0] * g[6 + a] + m[1] * g[9 + a] + m[2] * g[12 + a]
        along += n[a] * c[a]
    per_size = 1.0 / size
    for a in range(3):
        c[a] = (c[a] - along * n[a]) * per_size
    _cross(g[3:6], c, out[0:3])
    _cross(c, g[0:3], out[3:6])
    for k in range(3):
        for a in range(3):
            out[6 + 3 * k + a] = m[k] * n[a]


@kernel(inline=True)
def curvature_rates(g: np.ndarray, v: np.ndarray, n: np.ndarray, size: float, c: np.ndarray, out: np.ndarray) -> None:
    """Compute rates (3,) of the curvatures, gradient . v; v (15,) holds the rates of g, and `c` (3,) is scratch."""
    _cross(v[0:3], g[3:6], c)
    c[0] += g[1] * v[5] - g[2] * v[4]
    c[1] += g[2] * v[3] - g[0] * v[5]
    c[2] += g[0] * v[4] - g[1] * v[3]
    along = n[0] * c[0] + n[1] * c[1] + n[2] * c[2]
    per_size = 1.0 / size
    for a in range(3):
        c[a] = (c[a] - along * n[a]) * per_size
    for k in range(3):
        out[k] = 0.0
        for a in range(3):
            out[k] += n[a] * v[6 + 3 * k + a] + c[a] * g[6 + 3 * k + a]


@kernel(inline=True)
def curvature_gradient_rates(
    g: np.ndarray, v: np.ndarray, n: np.ndarray, size: float, work: np.ndarray, out: np.ndarray
) -> None:
    """Compute the rates (3, 15) of `curvature_gradient`; v (15,) holds the rates of g, and `work` (5, 3) is scratch."""
    turned, c, rate, part, other = work[0], work[1], work[2], work[3], work[4]
    _cross(v[0:3], g[3:6], turned)
    _cross(g[0:3], v[3:6], part)
    grown, per_size = 0.0, 1.0 / size
    for a in range(3):
        turned[a] += part[a]
        grown += n[a] * turned[a]
    for a in range(3):
        turned[a] = (turned[a] - grown * n[a]) * per_size  # the rate of n
    for k in range(3):
        along = changed = 0.0
        for a in range(3):
            along += n[a] * g[6 + 3 * k + a]
            changed += turned[a] * g[6 + 3 * k + a] + n[a] * v[6 + 3 * k + a]
        for a in range(3):
            c[a] = (g[6 + 3 * k + a] - along * n[a]) * per_size
            rate[a] = (v[6 + 3 * k + a] - changed * n[a] - along * turned[a] - grown * c[a]) * per_size
        for a in range(6, 15):
            out[k, a] = 0.0
        for a in range(3):
            out[k, 6 + 3 * k + a] = turned[a]
        _cross(v[3:6], c, part)
        _cross(g[3:6], rate, other)
        for a in range(3):
            out[k, a] = part[a] + other[a]
        _cross(rate, g[0:3], part)
        _cross(c, v[0:3], other)
        for a in range(3):
            out[k, 3 + a] = part[a] + other[a]


@kernel(inline=True)
def _normal_columns(g: np.ndarray, dn: np.ndarray) -> None:
    """Compute derivatives (3, 6) of n with respect to r_X and r_Y: dn = -[r_Y] dr_X + [r_X] dr_Y."""
    for k in range(2):
        first = 3 - 3 * k
        sign = 1.0 if k == 0 else -1.0
        x, y, z = sign * g[first], sign * g[first + 1], sign * g[first + 2]
        j = 3 * k
        dn[0, j], dn[0, j + 1], dn[0, j + 2] = 0.0, z, -y
        dn[1, j], dn[1, j + 1], dn[1, j + 2] = -z, 0.0, x
        dn[2, j], dn[2, j + 1], dn[2, j + 2] = y, -x, 0.0


@kernel(inline=True)
def add_curvature_hessian(
    g: np.ndarray, n: np.ndarray, size: float, m: np.ndarray, work: np.ndarray, out: np.ndarray
) -> None:
    """Add the second derivatives (15, 15) of m . (kappa_XX, kappa_YY, kappa_XY).

    Parameters
    ----------
    g : (15,) array
    n, size : results of `normal`
    m : (3,) array
    work : (8, 6) array, scratch
    out : (15, 15) array, changed in place
    """
    total, along = work[0], 0.0
    for a in range(3):
        total[a] = m[0] * g[6 + a] + m[1] * g[9 + a] + m[2] * g[12 + a]
    for a in range(3):
        along += n[a] * total[a]
    rest, c = work[1], work[2]
    for a in range(3):
        rest[a] = total[a] - along * n[a]
        c[a] = rest[a] / size
    on_n, on_rest = work[3], work[4]
    dn = work[5:8]
    _normal_columns(g, dn)
    for j in range(6):
        on_n[j] = n[0] * dn[0, j] + n[1] * dn[1, j] + n[2] * dn[2, j]
        on_rest[j] = rest[0] * dn[0, j] + rest[1] * dn[1, j] + rest[2] * dn[2, j]
    for k in range(3):
        factor = m[k] / size
        for a in range(3):
            for j in range(6):
                value = factor * (dn[a, j] - on_n[j] * n[a])
                out[6 + 3 * k + a, j] += value
                out[j, 6 + 3 * k + a] += value
    squared = 1.0 / (size * size)
    for i in range(6):
        for j in range(6):
            flat = dn[0, i] * dn[0, j] + dn[1, i] * dn[1, j] + dn[2, i] * dn[2, j] - on_n[i] * on_n[j]
            out[i, j] -= squared * (on_n[i] * on_rest[j] + on_rest[i] * on_n[j] + along * flat)
    # c . (dr_X x dr_Y) in both orders
    out[0, 4] += c[2]
    out[0, 5] -= c[1]
    out[1, 3] -= c[2]
    out[1, 5] += c[0]
    out[2, 3] += c[1]
    out[2, 4] -= c[0]
    out[4, 0] += c[2]
    out[5, 0] -= c[1]
    out[3, 1] -= c[2]
    out[5, 1] += c[0]
    out[3, 2] += c[1]
    out[4, 2] -= c[0]
