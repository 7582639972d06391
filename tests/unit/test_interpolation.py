"""Piecewise cubic curves against SciPy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline, PchipInterpolator

from fsm.kernels.interpolation import hermite_cubic, monotone_cubic, spline

CURVES = {"spline": (spline, CubicSpline), "monotone": (monotone_cubic, PchipInterpolator)}


def table(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random data with unequal intervals; some of them are flat, and some change direction."""
    random = np.random.default_rng(seed)
    x = np.cumsum(random.uniform(0.05, 1.0, n) ** 3)
    y = np.cumsum(random.normal(size=n).round(1) * (random.random(n) > 0.2))
    return x, y


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("n", [2, 3, 4, 5, 40])
@pytest.mark.parametrize("kind", CURVES)
def test_curves_are_those_of_scipy(kind: str, n: int, seed: int) -> None:
    ours, theirs = CURVES[kind]
    x, y = table(n, seed)
    curve, reference = ours(x, y), theirs(x, y)
    at = np.concatenate([x, np.linspace(x[0] - 0.5, x[-1] + 0.5, 301)])
    for order in (0, 1, 2):
        expected = reference(at, order)
        np.testing.assert_allclose(curve(at, order), expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max())
        assert float(curve(float(at[7]), order)) == curve(at, order)[7]
    areas = [reference.integrate(a, b) for a, b in pairwise(x)]
    np.testing.assert_allclose(curve.integrals(), areas, rtol=1e-9, atol=1e-12 * np.abs(areas).max())


def test_cubic_of_given_slopes() -> None:
    x, y = table(12, 1)
    slope = np.random.default_rng(2).normal(size=12)
    curve, reference = hermite_cubic(x, y, slope), CubicHermiteSpline(x, y, slope)
    np.testing.assert_allclose(curve.coefficients, reference.c, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(curve(x[:-1]), y[:-1])
    np.testing.assert_array_equal(curve(x[:-1], 1), slope[:-1])


def test_a_spline_reproduces_a_cubic() -> None:
    x = np.array([0.0, 0.1, 0.5, 1.2, 1.3, 2.0])
    curve = spline(x, x**3 - x)
    at = np.linspace(-1.0, 3.0, 50)
    np.testing.assert_allclose(curve(at), at**3 - at, atol=1e-11)
    np.testing.assert_allclose(curve(at, 2), 6.0 * at, atol=1e-10)
