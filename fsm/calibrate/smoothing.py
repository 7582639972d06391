"""Curve through scattered points, with its covariance: smoothing spline, interpolation, or monotone curve.

The smoothing spline minimises sum w (y - f)^2 + lambda int f''^2. The smoothing parameter lambda minimises the generalised
cross-validation score (Craven and Wahba 1979)

    V = n sum w (y - f)^2 / (n - tr S)^2 ,   f = S y .

The variance of the scatter is sum w (y - f)^2/(n - tr S), and the covariance of the curve follows from f = S y.
Deviations that neighbouring points share, such as slow drift of an instrument, become part of the curve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, make_smoothing_spline
from scipy.optimize import isotonic_regression, minimize_scalar

MIN_POINTS = {"smooth": 5, "interpolate": 4, "monotone": 5}
"""Fewest different abscissas of each kind of fit."""
MAX_BINS = 200
"""Largest number of points in a fit; more points are averaged in bins."""
GRID = 201
"""Number of points of a fitted curve."""
_LOG_LAMBDA = (-13.0, 3.0)
"""Range of log10 lambda, for abscissas scaled to 0 to 1."""


@dataclass(frozen=True)
class CurveFit:
    """Fitted curve.

    Attributes
    ----------
    x, y : (n,) arrays
        Points of the curve, which is cubic between them (PCHIP for a monotone curve).
    weights : (n, m) array
        dy/d(point) of the m fitted points, each divided by the square root of the number of measurements in the point.
    scatter : float
        Standard deviation of one measurement.
    freedom : float
        Degrees of freedom of the scatter; 0 for a curve through all points.
    smoothing : float
        lambda, for abscissas scaled to 0 to 1; 0 for a curve through all points.
    """

    x: np.ndarray
    y: np.ndarray
    weights: np.ndarray
    scatter: float
    freedom: float
    smoothing: float

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of y, (n, n), from the scatter about the curve; zero for a curve through all points."""
        return np.asarray(self.scatter**2 * self.weights @ self.weights.T)

    @property
    def error(self) -> np.ndarray:
        """Standard errors of y, (n,)."""
        return np.asarray(self.scatter * np.linalg.norm(self.weights, axis=1))


def fit_curve(
    x: np.ndarray,
    y: np.ndarray,
    kind: str,
    grid: np.ndarray | None = None,
    smoothing: float | None = None,
) -> CurveFit:
    """Fit a curve to points.

    Parameters
    ----------
    x, y : (m,) arrays
        Points in any order, with at least `MIN_POINTS[kind]` different x.
    kind : "smooth", "interpolate" or "monotone"
    grid : (n,) array, optional
        Abscissas of the curve; by default 201 over the range, or for "interpolate" those of the points.
    smoothing : float, optional
        lambda; by default from cross-validation.
    """
    at, mean, weight = bin_points(x, y, None if kind == "interpolate" else MAX_BINS)
    if kind == "interpolate":
        where = at if grid is None else grid
        return CurveFit(where, CubicSpline(at, mean)(where), np.zeros((len(where), 0)), 0.0, 0.0, 0.0)
    where = np.linspace(at[0], at[-1], GRID) if grid is None else grid
    span = at[-1] - at[0]
    unit, unit_grid = (at - at[0]) / span, (where - at[0]) / span
    used_smoothing = _cross_validated(unit, mean, weight) if smoothing is None else smoothing
    spline = make_smoothing_spline(unit, np.eye(len(unit)), w=weight, lam=used_smoothing)
    hat, grid_weights = spline(unit), spline(unit_grid)
    freedom = len(unit) - float(np.trace(hat))
    squares = float(weight @ (mean - hat @ mean) ** 2)
    scatter = np.sqrt(squares / freedom) if freedom > 1e-6 * len(unit) else 0.0
    values = grid_weights @ mean
    if kind == "monotone":
        values = isotonic_regression(values, increasing=bool(values[-1] >= values[0])).x
    return CurveFit(where, values, grid_weights / np.sqrt(weight), float(scatter), freedom, used_smoothing)


def smoothing_for(x: np.ndarray, y: np.ndarray) -> float:
    """Smoothing parameter lambda from generalised cross-validation."""
    at, mean, weight = bin_points(x, y, MAX_BINS)
    return _cross_validated((at - at[0]) / (at[-1] - at[0]), mean, weight)


def bin_points(x: np.ndarray, y: np.ndarray, limit: int | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means of x and y in at most `limit` + 2 bins, and the number of points per bin; points of equal x share a bin.

    The smallest and the largest x have bins of their own, so that the curve reaches both ends of the data.
    """
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    starts = np.flatnonzero(np.concatenate([[True], np.diff(x) > 0.0]))
    if limit is not None and len(starts) > limit:
        # bins have equal numbers of points, and their edges never separate points of equal x
        edges = np.linspace(0, len(x), limit + 1)[:-1]
        chosen = starts[np.minimum(np.searchsorted(starts, edges), len(starts) - 1)]
        starts = np.unique([starts[0], starts[1], *chosen, starts[-1]])
    count = np.diff(np.concatenate([starts, [len(x)]])).astype(float)
    return np.add.reduceat(x, starts) / count, np.add.reduceat(y, starts) / count, count


def _cross_validated(x: np.ndarray, y: np.ndarray, weight: np.ndarray) -> float:
    count = len(x)
    identity = np.eye(count)

    def score(exponent: float) -> float:
        hat = make_smoothing_spline(x, identity, w=weight, lam=10.0**exponent)(x)
        freedom = max(count - float(np.trace(hat)), 1e-9 * count)
        return count * float(weight @ (y - hat @ y) ** 2) / freedom**2

    exponents = np.linspace(*_LOG_LAMBDA, 17)
    best = int(np.argmin([score(exponent) for exponent in exponents]))
    around = exponents[max(best - 1, 0)], exponents[min(best + 1, len(exponents) - 1)]
    return 10.0 ** float(minimize_scalar(score, bounds=around, method="bounded", options={"xatol": 0.05}).x)
