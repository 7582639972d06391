"""Shape functions of the ANCF elements, and Gauss points on [0, 1].

Natural coordinates x = X/b, y = Y/c run from 0 to 1. Slopes are derivatives along the material lines X and Y (m/m). The
shape functions of slopes therefore contain the lengths b and c of the element. The kernels use the functions of a unit
element (b = c = 1) with slopes times length. One table then serves elements of all sizes.

Membrane: the 12 terms 1, x, y, x^2, xy, y^2, x^3, x^2 y, x y^2, y^3, x^3 y, x y^3 of Adini, Clough and Melosh. Along an
edge the position is a cubic function of the nodes of that edge. The slope across the edge is not continuous (the element is
nonconforming), so the element converges for rectangles only. Node order A(0,0), B(1,0), C(1,1), D(0,1).
"""

from __future__ import annotations

import numpy as np

CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
"""Natural coordinates of the nodes A, B, C, D."""

_CABLE_POWERS = np.arange(4)
_POWERS = np.array(
    [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (3, 1), (1, 3)]
)


def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights (count,) of the Gauss rule on [0, 1], exact for polynomials of degree 2 count - 1."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (points + 1.0), 0.5 * weights


def _powers(x: np.ndarray, power: np.ndarray, derivative: int) -> np.ndarray:
    """Derivatives of x^power, (..., n_powers)."""
    factor = np.ones(len(power))
    for k in range(derivative):
        factor = factor * (power - k)
    return np.asarray(factor * x[..., None] ** np.maximum(power - derivative, 0))


_CABLE_TERMS = np.linalg.inv(
    np.array([_powers(np.asarray(x), _CABLE_POWERS, d) for x in (0.0, 1.0) for d in (0, 1)])
).round()


def _monomials(x: np.ndarray, y: np.ndarray, derivative: tuple[int, int]) -> np.ndarray:
    """Derivatives of the 12 terms, (..., 12)."""
    return _powers(x, _POWERS[:, 0], derivative[0]) * _powers(y, _POWERS[:, 1], derivative[1])


_MEMBRANE_TERMS = np.linalg.inv(
    np.array(
        [_monomials(corner[0], corner[1], d) for corner in CORNERS for d in ((0, 0), (1, 0), (0, 1))]
    )
).round()
"""Coefficients (12 terms, 12 functions): integers, computed from the nodal values of the functions."""


def cable_shape(x: np.ndarray | float, length: float = 1.0, derivative: int = 0) -> np.ndarray:
    """Shape functions of r_A, r_A', r_B, r_B' of a cable element.

    S = (1 - 3x^2 + 2x^3, L(x - 2x^2 + x^3), 3x^2 - 2x^3, L(x^3 - x^2))

    Parameters
    ----------
    x : (...,) array
        Natural coordinate.
    length : m
    derivative : order of the derivative with respect to the length

    Returns
    -------
    (..., 4) array
    """
    values = _powers(np.asarray(x, dtype=float), _CABLE_POWERS, derivative) @ _CABLE_TERMS
    return np.asarray(values * np.array([1.0, length, 1.0, length]) / length**derivative)


def membrane_shape(
    x: np.ndarray | float, y: np.ndarray | float, b: float = 1.0, c: float = 1.0, derivative: tuple[int, int] = (0, 0)
) -> np.ndarray:
    """Shape functions of (r, r_X, r_Y) at the nodes A, B, C, D of a membrane element.

    Parameters
    ----------
    x, y : (...,) arrays
        Natural coordinates.
    b, c : m
        Sides along X and Y.
    derivative : orders of the derivatives along X and Y

    Returns
    -------
    (..., 12) array
    """
    x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    values = _monomials(x, y, derivative) @ _MEMBRANE_TERMS
    return np.asarray(values * np.tile([1.0, b, c], 4) / (b ** derivative[0] * c ** derivative[1]))
