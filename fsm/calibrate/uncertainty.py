"""Estimates with their covariance: Laplace's about a least-squares fit, or from refits of resampled repeats.

Near the best fit, the sum of squares of weighted residuals r(p) is that of the linear model r + J (p - p*), and the
parameters are spread with the covariance

    C = s^2 (J^T J)^-1 ,        s^2 = |r|^2 / (m - n)

for m residuals and n parameters (Seber & Wild, Nonlinear Regression, ch. 5); s is known where the scatter of repeats has
given the weights, and is estimated otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm, t

__all__ = ["Estimate", "bootstrap", "fit_gain", "from_samples", "identifiability", "laplace"]

_ALIKE = 0.98
"""Correlation of two estimates above which data are said not to tell them apart."""
_LOOSE = 0.5
"""Standard error over the estimate above which data are said to know little of it."""
_NOTHING = 1e-9
"""Singular value over the largest, of columns of equal length, below which data know nothing of a combination."""


@dataclass(frozen=True)
class Estimate:
    """Estimated parameters.

    Attributes
    ----------
    names : names
    values : (n,) array
    covariance : (n, n) array
    freedom : float
        Degrees of freedom that the scale of the covariance was estimated with; 0 where it is known.
    positive : names
        Parameters that can only be positive: their intervals are those of their logarithms.
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
        """Lower and upper bound of every parameter at a level of confidence, (n, 2)."""
        reach = self.quantile(level) * self.standard_error
        plain = np.column_stack([self.values - reach, self.values + reach])
        positive = np.isin(self.names, self.positive)
        # others may be next to nothing, and their reach a power of it
        ratio = np.where(positive, reach, 0.0) / np.where(self.values > 0.0, self.values, 1.0)
        with np.errstate(over="ignore"):  # what the data know nothing of may be anything
            factor = np.exp(ratio)
        around = np.column_stack([self.values / factor, self.values * factor])
        return np.where(positive[:, None], around, plain)

    def quantile(self, level: float = 0.95) -> float:
        """Standard errors that a two-sided interval reaches to: Student's t, or the normal law where the scale is known."""
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
    names : of the n parameters
    values : (n,) array
        The best fit.
    jacobian : (m, n) array
        d(residual)/d(parameter) at the best fit.
    residuals : (m,) array
        Weighted residuals there.
    scale : float, optional
        Standard deviation of a weighted residual if it is known (1 where each is divided by its own); absent: estimated
        from the residuals.

    Raises
    ------
    ValueError
        Fewer residuals than the estimate needs.

    Notes
    -----
    A combination of parameters that the data know nothing of gets an enormous variance instead of an infinite one;
    `identifiability` names it.
    """
    count, size = jacobian.shape
    freedom = 0 if scale is not None else count - size
    if count < size or (scale is None and freedom == 0):
        raise ValueError(f"{count} data do not give {size} parameters and their scatter")
    inverse = fit_gain(jacobian)
    squared = scale**2 if scale is not None else float(residuals @ residuals) / freedom
    covariance = squared * (inverse @ inverse.T)
    return Estimate(tuple(names), np.asarray(values, dtype=float), covariance, freedom)


def fit_gain(jacobian: np.ndarray) -> np.ndarray:
    """d(parameter)/d(-residual) of a least-squares fit, (n, m): the pseudo-inverse of the Jacobian (m, n).

    A combination of parameters that no residual depends on gets an enormous gain instead of an infinite one.
    """
    length = np.linalg.norm(jacobian, axis=0)
    length = np.where(length > 0.0, length, 1.0)
    left, singular, rows = np.linalg.svd(jacobian / length, full_matrices=False)
    floor = _NOTHING * max(float(singular.max(initial=0.0)), 1e-300)
    return np.asarray((rows.T / np.maximum(singular, floor)) @ left.T / length[:, None])


def bootstrap(
    fit: Callable[[np.ndarray], np.ndarray], repeats: int, count: int = 400, seed: int = 0
) -> np.ndarray:
    """Parameters fitted to repeats that are drawn again with replacement.

    Parameters
    ----------
    fit : callable
        Takes the numbers of the drawn repeats, (repeats,) int array, and gives the parameters, (n,).
    repeats : int
        How many there are; at least 2.
    count : int
        Draws.
    seed : int

    Returns
    -------
    (count, n) array
    """
    if repeats < 2:
        raise ValueError("one test has no scatter to draw from; a bootstrap needs at least two repeats")
    draws = np.random.default_rng(seed).integers(repeats, size=(count, repeats))
    return np.array([fit(draw) for draw in draws])


def from_samples(names: Sequence[str], values: np.ndarray, samples: np.ndarray, repeats: int) -> Estimate:
    """Estimate whose covariance is that of bootstrap samples.

    Drawing from n repeats underestimates the variance by (n - 1)/n, which is put right; the interval is Student's with n - 1
    degrees of freedom, as that of a mean of n.
    """
    covariance = np.atleast_2d(np.cov(samples, rowvar=False)) * repeats / (repeats - 1)
    return Estimate(tuple(names), np.asarray(values, dtype=float), covariance, repeats - 1)


def identifiability(estimate: Estimate) -> list[str]:
    """What the data cannot tell, in words; empty if they tell everything.

    Pairs of estimates whose correlation is above 0.98 in size, and estimates whose standard error is more than half of them.
    """
    warnings = []
    names, correlation, error = estimate.names, estimate.correlation, estimate.standard_error
    for i in range(len(names)):
        for j in range(i + 1, len(names)):
            if abs(correlation[i, j]) > _ALIKE:
                warnings.append(
                    f"the data hardly tell {names[i]} and {names[j]} apart (correlation {correlation[i, j]:.4f}); "
                    "hold one of them, or add a test that loads them differently"
                )
    for name, value, spread in zip(names, estimate.values.tolist(), error.tolist(), strict=True):
        if spread > _LOOSE * abs(value):
            warnings.append(
                f"the data hardly know {name}: {value:.4g} with a standard error of {spread:.2g}; "
                "hold it, or add a test that depends on it"
            )
    return warnings
