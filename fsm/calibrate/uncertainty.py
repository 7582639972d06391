"""Estimates with their covariance: Laplace approximation of a least-squares fit, or bootstrap of repeats.

Near the best fit p* the weighted residuals are r + J (p - p*). The covariance of n parameters from m residuals is

    C = s^2 (J^T J)^-1 ,        s^2 = |r|^2 / (m - n)

(Seber and Wild 1989, Nonlinear Regression, ch. 5). If the weights come from the scatter of repeats, s is known; otherwise it
is estimated from the residuals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm, t

_STRONG_CORRELATION = 0.98
"""Correlation of two estimates above which a warning is given."""
_LARGE_ERROR = 0.5
"""Ratio of the standard error to the estimate above which a warning is given."""
_MIN_SINGULAR = 1e-9
"""Smallest ratio of a singular value to the largest one, for a Jacobian with columns of unit length."""


@dataclass(frozen=True)
class Estimate:
    """Estimated parameters with their covariance.

    Attributes
    ----------
    names : tuple of str
    values : (n,) array
    covariance : (n, n) array
    freedom : float
        Degrees of freedom of the scale of the covariance; 0 if the scale is known.
    positive : tuple of str
        Names of positive parameters; their intervals are symmetric in the logarithm.
    """

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    freedom: float = 0
    positive: tuple[str, ...] = ()

    @property
    def standard_error(self) -> np.ndarray:
        """Standard errors, (n,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation matrix, (n, n); zero beside a parameter without spread."""
        error = self.standard_error
        safe = np.where(error > 0.0, error, 1.0)
        matrix = self.covariance / np.outer(safe, safe)
        np.fill_diagonal(matrix, 1.0)
        return np.asarray(matrix)

    def interval(self, level: float = 0.95) -> np.ndarray:
        """Lower and upper bound of every parameter at a confidence level, (n, 2)."""
        half_width = self.quantile(level) * self.standard_error
        symmetric = np.column_stack([self.values - half_width, self.values + half_width])
        positive = np.isin(self.names, self.positive)
        ratio = np.where(positive, half_width, 0.0) / np.where(self.values > 0.0, self.values, 1.0)
        with np.errstate(over="ignore"):  # an unidentifiable parameter has an infinite factor
            factor = np.exp(ratio)
        logarithmic = np.column_stack([self.values / factor, self.values * factor])
        return np.where(positive[:, None], logarithmic, symmetric)

    def quantile(self, level: float = 0.95) -> float:
        """Half width of a two-sided interval in standard errors: Student's t, or normal if the scale is known."""
        tail = 0.5 + 0.5 * level
        return float(t.ppf(tail, self.freedom) if self.freedom else norm.ppf(tail))


def laplace(
    names: Sequence[str],
    values: np.ndarray,
    jacobian: np.ndarray,
    residuals: np.ndarray,
    scale: float | None = None,
) -> Estimate:
    """Estimate with the covariance of a least-squares fit.

    Parameters
    ----------
    names : names of the n parameters
    values : (n,) array
        Best fit.
    jacobian : (m, n) array
        d(residual)/d(parameter) at the best fit.
    residuals : (m,) array
        Weighted residuals at the best fit.
    scale : float, optional
        Standard deviation of a weighted residual, if known; by default it is estimated from the residuals.

    Raises
    ------
    ValueError
        There are fewer residuals than parameters, or equally many while `scale` is None.

    Notes
    -----
    An unidentifiable combination of parameters gets a very large variance instead of an infinite one; see `identifiability`.
    """
    count, size = jacobian.shape
    freedom = 0 if scale is not None else count - size
    if count < size or (scale is None and freedom == 0):
        raise ValueError(
            f"{count} data points cannot determine {size} parameters and the scatter of the data; "
            f"give at least {size + 1} data points"
        )
    inverse = fit_gain(jacobian)
    squared = scale**2 if scale is not None else float(residuals @ residuals) / freedom
    covariance = squared * (inverse @ inverse.T)
    return Estimate(tuple(names), np.asarray(values, dtype=float), covariance, freedom)


def fit_gain(jacobian: np.ndarray) -> np.ndarray:
    """Gain d(parameter)/d(-residual) of a least-squares fit, (n, m): the pseudo-inverse of the Jacobian (m, n).

    An unidentifiable combination of parameters gets a very large gain instead of an infinite one.
    """
    length = np.linalg.norm(jacobian, axis=0)
    length = np.where(length > 0.0, length, 1.0)
    left, singular, rows = np.linalg.svd(jacobian / length, full_matrices=False)
    floor = _MIN_SINGULAR * max(float(singular.max(initial=0.0)), 1e-300)
    return np.asarray((rows.T / np.maximum(singular, floor)) @ left.T / length[:, None])


def bootstrap(
    fit: Callable[[np.ndarray], np.ndarray], repeats: int, count: int = 400, seed: int = 0
) -> np.ndarray:
    """Parameters fitted to repeats that are resampled with replacement.

    Parameters
    ----------
    fit : callable
        Fit to the repeats with the given indices, (repeats,) int array; returns the parameters, (n,).
    repeats : int
        Number of repeats, at least 2.
    count : int
        Number of bootstrap samples.
    seed : int

    Returns
    -------
    (count, n) array

    Raises
    ------
    ValueError
        There are fewer than 2 repeats.
    """
    if repeats < 2:
        raise ValueError(f"{repeats} repeat has no scatter; a bootstrap needs at least two repeats")
    draws = np.random.default_rng(seed).integers(repeats, size=(count, repeats))
    return np.array([fit(draw) for draw in draws])


def from_samples(names: Sequence[str], values: np.ndarray, samples: np.ndarray, repeats: int) -> Estimate:
    """Estimate with the covariance of bootstrap samples.

    Resampling n repeats underestimates the variance by the factor (n - 1)/n, which is corrected. Intervals use Student's t
    with n - 1 degrees of freedom, as for a mean of n.
    """
    covariance = np.atleast_2d(np.cov(samples, rowvar=False)) * repeats / (repeats - 1)
    return Estimate(tuple(names), np.asarray(values, dtype=float), covariance, repeats - 1)


def identifiability(estimate: Estimate) -> list[str]:
    """Warnings about parameters that the data do not determine.

    A warning concerns a pair of parameters with a correlation above 0.98 in magnitude, or an estimate with a standard error
    above half its value.
    """
    warnings = []
    names, correlation, error = estimate.names, estimate.correlation, estimate.standard_error
    for i in range(len(names)):
        for j in range(i + 1, len(names)):
            if abs(correlation[i, j]) > _STRONG_CORRELATION:
                warnings.append(
                    f"{names[i]} and {names[j]} are strongly correlated ({correlation[i, j]:.4f}): not separately "
                    "identifiable; fix one of them, or add a test that loads them differently"
                )
    for name, value, spread in zip(names, estimate.values.tolist(), error.tolist(), strict=True):
        if spread > _LARGE_ERROR * abs(value):
            warnings.append(
                f"{name} is poorly identifiable: {value:.4g} with a standard error of {spread:.2g} "
                f"(more than {100 * _LARGE_ERROR:g} %); fix it, or add a test that depends on it"
            )
    return warnings
