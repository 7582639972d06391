"""Tension field in flexible facets: corrections of the plain law where it would carry compression.

The energy of stretch of a triangle is the sum of its energies per area W at the middles of its edges, times a third of its
area, plus a term that ties slopes to positions. The strain there is S_p e, with the strains e of `FacetArrays.rest`. Facets
without compression have the relaxed energy of `fsm.model.nodes.tension_field` in place of W:

    U = U_plain + sum_p A/3 (W_relaxed(S_p e) - W(S_p e))

At taut points the correction is zero.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.model.nodes.tension_field import film_energy, film_stress, film_tangent

REMAINDER = 1e-6
"""Stiffness of wrinkled and slack facets relative to the plain law. A balloon of two discs shortens by a quarter around its
rim. With 1e-2 the remainder carries a compression of the size of the tension there, and the path ends."""


@kernel(inline=True)
def _strain(points: np.ndarray, strains: np.ndarray, p: int) -> tuple[float, float, float]:
    """Strains exx, eyy, exy at a point from the strains (5, 3) of the triangle."""
    xx = yy = xy = 0.0
    for j in range(15):
        e = strains[j // 3, j % 3]
        xx += points[p, 0, j] * e
        yy += points[p, 1, j] * e
        xy += points[p, 2, j] * e
    return xx, yy, 0.5 * xy


@kernel
def relax_energy(points: np.ndarray, tension: np.ndarray, strains: np.ndarray) -> float:
    """Correction of the energy of a triangle, J.

    Parameters
    ----------
    points : (3, 3, 15) array
        S_p.
    tension : (5,) array
        Third of the area, C, Poisson's ratio, remainder, width (`fsm.model.nodes.tension_field`).
    strains : (5, 3) array
    """
    weight, plain, poisson, remainder, width = tension
    total = 0.0
    for p in range(3):
        xx, yy, xy = _strain(points, strains, p)
        own = film_energy(xx, yy, xy, plain, poisson, remainder, width)
        total += weight * (own - film_energy(xx, yy, xy, plain, poisson, 1.0, width))
    return total


@kernel
def relax_efforts(points: np.ndarray, tension: np.ndarray, strains: np.ndarray, efforts: np.ndarray) -> None:
    """Add the correction of the efforts (5, 3) of a triangle; other arguments as in `relax_energy`."""
    weight, plain, poisson, remainder, width = tension
    for p in range(3):
        xx, yy, xy = _strain(points, strains, p)
        a, b, c = film_stress(xx, yy, xy, plain, poisson, remainder, width)
        a0, b0, c0 = film_stress(xx, yy, xy, plain, poisson, 1.0, width)
        a, b, c = weight * (a - a0), weight * (b - b0), weight * (c - c0)
        if a != 0.0 or b != 0.0 or c != 0.0:
            for j in range(15):
                efforts[j // 3, j % 3] += a * points[p, 0, j] + b * points[p, 1, j] + c * points[p, 2, j]


@kernel
def relax_moduli(points: np.ndarray, tension: np.ndarray, strains: np.ndarray, moduli: np.ndarray) -> None:
    """Add the correction of the moduli (15, 15) of a triangle; other arguments as in `relax_energy`."""
    weight, plain, poisson, remainder, width = tension
    for p in range(3):
        xx, yy, xy = _strain(points, strains, p)
        a, b, c, d, e, f = film_tangent(xx, yy, xy, plain, poisson, remainder, width)
        a0, b0, c0, d0, e0, f0 = film_tangent(xx, yy, xy, plain, poisson, 1.0, width)
        a, b, c = weight * (a - a0), weight * (b - b0), weight * (c - c0)
        d, e, f = weight * (d - d0), weight * (e - e0), weight * (f - f0)
        if a == 0.0 and b == 0.0 and c == 0.0 and d == 0.0 and e == 0.0 and f == 0.0:
            continue
        for i in range(15):
            x = a * points[p, 0, i] + b * points[p, 1, i] + c * points[p, 2, i]
            y = b * points[p, 0, i] + d * points[p, 1, i] + e * points[p, 2, i]
            z = c * points[p, 0, i] + e * points[p, 1, i] + f * points[p, 2, i]
            for j in range(15):
                moduli[i, j] += x * points[p, 0, j] + y * points[p, 1, j] + z * points[p, 2, j]
