"""A curve through scattered points, with what is known of it: smoothing splines, interpolation, monotone curves.

The smoothing spline minimises sum w (y - f)^2 + lambda int f''^2; lambda is the one of least generalised cross-validation

    V = n sum w (y - f)^2 / (n - tr S)^2 ,   f = S y

(Craven & Wahba 1979), the scatter sum w (y - f)^2/(n - tr S), and what the curve is uncertain by follows from f = S y.
Cross-validation takes what neighbours share for the curve: slow drift of an instrument is not seen as scatter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, make_smoothing_spline
from scipy.optimize import isotonic_regression, minimize_scalar

__all__ = ["FEWEST", "GRID", "CurveFit", "fit_curve", "gathered", "smoothing_for"]

FEWEST = {"smooth": 5, "interpolate": 4, "monotone": 5}
"""Fewest different abscissas of each kind of fit."""
MOST = 200
"""Points that more are gathered into."""
GRID = 201
_LAMBDA = (-13.0, 3.0)
"""Range of log10 lambda, abscissas from 0 to 1."""


@dataclass(frozen=True)
class CurveFit:
    """A fitted curve.

    Attributes
    ----------
    x, y : (n,) arrays
        Where and what; between them cubic, or PCHIP for monotone curves.
    weights : (n, m) array
        y of the m points it was fitted to, divided by the roots of how many each stands for.
    scatter : float
        Standard deviation of one point.
    freedom : float
        Degrees of freedom of the scatter; 0 where there are none.
    smoothing : float
        lambda, for abscissas from 0 to 1; 0 for a curve through all points.
    """

    x: np.ndarray
    y: np.ndarray
    weights: np.ndarray
    scatter: float
    freedom: float
    smoothing: float

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of y, (n, n), from the scatter about the curve; zero where the curve goes through all points."""
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
    """Fit a curve.

    Parameters
    ----------
    x, y : (m,) arrays, in any order; at least `FEWEST[kind]` different x
    kind : "smooth", "interpolate" or "monotone"
    grid : (n,) array, optional
        Where the curve is wanted; absent: at 201 places over the range, or at the points it goes through.
    smoothing : float, optional
        lambda; absent: as cross-validation says.
    """
    at, mean, weight = gathered(x, y, None if kind == "interpolate" else MOST)
    if kind == "interpolate":
        where = at if grid is None else grid
        return CurveFit(where, CubicSpline(at, mean)(where), np.zeros((len(where), 0)), 0.0, 0.0, 0.0)
    where = np.linspace(at[0], at[-1], GRID) if grid is None else grid
    span = at[-1] - at[0]
    unit, asked = (at - at[0]) / span, (where - at[0]) / span
    chosen = _cross_validated(unit, mean, weight) if smoothing is None else smoothing
    spline = make_smoothing_spline(unit, np.eye(len(unit)), w=weight, lam=chosen)
    hat, reach = spline(unit), spline(asked)
    freedom = len(unit) - float(np.trace(hat))
    squares = float(weight @ (mean - hat @ mean) ** 2)
    scatter = np.sqrt(squares / freedom) if freedom > 1e-6 * len(unit) else 0.0
    values = reach @ mean
    if kind == "monotone":
        values = isotonic_regression(values, increasing=bool(values[-1] >= values[0])).x
    return CurveFit(where, values, reach / np.sqrt(weight), float(scatter), freedom, chosen)


def smoothing_for(x: np.ndarray, y: np.ndarray) -> float:
    """The lambda of least cross-validation."""
    at, mean, weight = gathered(x, y, MOST)
    return _cross_validated((at - at[0]) / (at[-1] - at[0]), mean, weight)


def gathered(x: np.ndarray, y: np.ndarray, most: int | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means of points of one abscissa, or of as many neighbours as leave at most so many; and how many each stands for."""
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    starts = np.flatnonzero(np.concatenate([[True], np.diff(x) > 0.0]))
    if most is not None and len(starts) > most:
        # places of equal count, but never between two points of one abscissa
        wanted = np.linspace(0, len(x), most + 1)[:-1]
        starts = np.unique(starts[np.minimum(np.searchsorted(starts, wanted), len(starts) - 1)])
    count = np.diff(np.concatenate([starts, [len(x)]])).astype(float)
    return np.add.reduceat(x, starts) / count, np.add.reduceat(y, starts) / count, count


def _cross_validated(x: np.ndarray, y: np.ndarray, weight: np.ndarray) -> float:
    count = len(x)
    identity = np.eye(count)

    def score(exponent: float) -> float:
        hat = make_smoothing_spline(x, identity, w=weight, lam=10.0**exponent)(x)
        left = max(count - float(np.trace(hat)), 1e-9 * count)
        return count * float(weight @ (y - hat @ y) ** 2) / left**2

    exponents = np.linspace(*_LAMBDA, 17)
    best = int(np.argmin([score(exponent) for exponent in exponents]))
    around = exponents[max(best - 1, 0)], exponents[min(best + 1, len(exponents) - 1)]
    return 10.0 ** float(minimize_scalar(score, bounds=around, method="bounded", options={"xatol": 0.05}).x)
