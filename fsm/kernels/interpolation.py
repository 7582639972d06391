"""Piecewise cubic interpolation of tables: not-a-knot splines, monotone cubics, and cubics with given slopes.

The curves are those of `scipy.interpolate` (`CubicSpline`, `PchipInterpolator`, `CubicHermiteSpline`). SciPy is not
used here, because its import takes longer than the solution of a small model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PiecewiseCubic:
    """Cubic pieces c0 s^3 + c1 s^2 + c2 s + c3 with s = x - knot, also used for extrapolation.

    Attributes
    ----------
    knots : (n,) array, increasing
    coefficients : (4, n - 1) array
        c0 to c3 of each piece.
    """

    knots: np.ndarray
    coefficients: np.ndarray

    def __call__(self, x: float | np.ndarray, derivative: int = 0) -> np.ndarray:
        """Value, or derivative of order 1 or 2, at x; at a knot, the piece on its right counts."""
        x = np.asarray(x, dtype=float)
        piece = np.clip(np.searchsorted(self.knots, x, side="right") - 1, 0, len(self.knots) - 2)
        s = x - self.knots[piece]
        c0, c1, c2, c3 = self.coefficients[:, piece]
        if derivative == 0:
            return np.asarray(c3 + c2 * s + c1 * (s * s) + c0 * (s * s * s))
        if derivative == 1:
            return np.asarray(c2 + c1 * s * 2.0 + c0 * (s * s) * 3.0)
        return np.asarray(c1 * 2.0 + c0 * s * 6.0)

    def integrals(self) -> np.ndarray:
        """Integral over each piece, (n - 1,)."""
        s = np.diff(self.knots)
        c0, c1, c2, c3 = self.coefficients
        return np.asarray(c3 * s + c2 * (s * s) / 2.0 + c1 * (s * s * s) / 3.0 + c0 * (s * s * s * s) / 4.0)


def interpolate(x: np.ndarray, y: np.ndarray, interpolation: str) -> PiecewiseCubic:
    """Interpolation "cubic" (`spline`) or "pchip" (`monotone_cubic`)."""
    return spline(x, y) if interpolation == "cubic" else monotone_cubic(x, y)


def hermite_cubic(x: np.ndarray, y: np.ndarray, slope: np.ndarray) -> PiecewiseCubic:
    """Cubic pieces with values `y` and derivatives `slope` at the knots `x`, all (n,)."""
    x, y, slope = (np.asarray(values, dtype=float) for values in (x, y, slope))
    width = np.diff(x)
    secant = np.diff(y) / width
    t = (slope[:-1] + slope[1:] - 2.0 * secant) / width
    return PiecewiseCubic(x, np.stack([t / width, (secant - slope[:-1]) / width - t, slope[:-1], y[:-1]]))


def monotone_cubic(x: np.ndarray, y: np.ndarray) -> PiecewiseCubic:
    """Interpolation that is monotone where the data are (Fritsch and Butland, 1984); once differentiable."""
    return hermite_cubic(x, y, monotone_slopes(x, y))


def monotone_slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Derivatives (n,) of `monotone_cubic` at the data: weighted harmonic means of the slopes on both sides."""
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    width = np.diff(x)
    secant = np.diff(y) / width
    if len(x) == 2:
        return np.repeat(secant, 2)
    turns = (np.sign(secant[1:]) != np.sign(secant[:-1])) | (secant[1:] == 0.0) | (secant[:-1] == 0.0)
    first, second = 2.0 * width[1:] + width[:-1], width[1:] + 2.0 * width[:-1]
    slope = np.zeros(len(x))
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (first / secant[:-1] + second / secant[1:]) / (first + second)
        slope[1:-1] = np.where(turns, 0.0, 1.0 / mean)
    slope[0] = _end_slope(width[0], width[1], secant[0], secant[1])
    slope[-1] = _end_slope(width[-1], width[-2], secant[-1], secant[-2])
    return slope


def _end_slope(width: float, next_width: float, secant: float, next_secant: float) -> float:
    """Slope at an end of a monotone cubic: slope of the parabola through three points, limited so that the curve stays
    monotone.
    """
    slope = ((2.0 * width + next_width) * secant - width * next_secant) / (width + next_width)
    if np.sign(slope) != np.sign(secant):
        return 0.0
    if np.sign(secant) != np.sign(next_secant) and abs(slope) > 3.0 * abs(secant):
        return 3.0 * secant
    return slope


def spline(x: np.ndarray, y: np.ndarray) -> PiecewiseCubic:
    """Spline with two continuous derivatives; the third is continuous at the second and at the last but one point.

    Two points give a straight line, three points a parabola.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    width = np.diff(x)
    secant = np.diff(y) / width
    if len(x) == 2:
        return hermite_cubic(x, y, np.repeat(secant, 2))
    if len(x) == 3:
        middle = (width[0] * secant[1] + width[1] * secant[0]) / (width[0] + width[1])
        return hermite_cubic(x, y, np.array([2.0 * secant[0] - middle, middle, 2.0 * secant[1] - middle]))
    right = np.empty(len(x))
    right[1:-1] = 3.0 * (width[1:] * secant[:-1] + width[:-1] * secant[1:])
    begin, end = x[2] - x[0], x[-1] - x[-3]
    right[0] = ((width[0] + 2.0 * begin) * width[1] * secant[0] + width[0] ** 2 * secant[1]) / begin
    right[-1] = (width[-1] ** 2 * secant[-2] + (2.0 * end + width[-1]) * width[-2] * secant[-1]) / end
    lower, upper = np.append(width[1:], end), np.concatenate([[begin], width[:-1]])
    middle = np.concatenate([width[1:2], 2.0 * (width[:-1] + width[1:]), width[-2:-1]])
    return hermite_cubic(x, y, _tridiagonal(lower.tolist(), middle.tolist(), upper.tolist(), right.tolist()))


def _tridiagonal(lower: list[float], middle: list[float], upper: list[float], right: list[float]) -> np.ndarray:
    """Solution of tridiagonal equations by Gaussian elimination with row exchange; changes the arguments."""
    n = len(middle)
    second = [0.0] * n  # this is the second upper diagonal, which row exchanges fill
    for k in range(n - 1):
        if abs(middle[k]) >= abs(lower[k]):
            ratio = lower[k] / middle[k]
            middle[k + 1] -= ratio * upper[k]
            right[k + 1] -= ratio * right[k]
            continue
        ratio = middle[k] / lower[k]
        middle[k], upper[k], middle[k + 1] = lower[k], middle[k + 1], upper[k] - ratio * middle[k + 1]
        if k < n - 2:
            second[k], upper[k + 1] = upper[k + 1], -ratio * upper[k + 1]
        right[k], right[k + 1] = right[k + 1], right[k] - ratio * right[k + 1]
    found = np.zeros(n)
    for k in range(n - 1, -1, -1):
        value = right[k]
        if k < n - 1:
            value -= upper[k] * found[k + 1]
        if k < n - 2:
            value -= second[k] * found[k + 2]
        found[k] = value / middle[k]
    return found
