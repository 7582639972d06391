"""Estimates with their covariance: Laplace approximation of a least-squares fit, or bootstrap of repeats.

Near the best fit p* the weighted residuals are r + J (p - p*). The covariance of n parameters from m residuals is

    C = s^2 (J^T J)^-1 ,        s^2 = |r|^2 / (m - n)

(Seber and Wild 1989, Nonlinear Regression, ch. 5). If the weights come from the scatter of repeats, s is known; otherwise it
is estimated from the residuals.

Covariance of fitted parameters from the scatter of whole repeats and from the model discrepancy.

Points of one repeat are correlated, because each repeat has its own specimen. Near the best fit the parameters change with
the measured forces as dp = sum_k H_k dF_k. Here H_k are the columns of test k in the pseudo-inverse of the weighted
Jacobian. Each repeat r of a test gives one change dp = H_k (F_kr - mean F_k). The variance of their mean is the sample
variance over the number of repeats (cluster-robust covariance; Liang and Zeger 1986). This estimate is valid for any
correlation along the curve.

The mean residual e_k = F_k - F_k(p) contains scatter and the model discrepancy (Kennedy and O'Hagan 2001). The discrepancy
is modelled as a stationary Gaussian process of variance s_k^2 along the travel, with the correlation exp(-(x - x')^2/(2
l^2)). The process's mean number of sign changes is z = range/(pi l), and 1/l^2 is its mean squared slope over its variance
(Rice 1944). Slope and variance of the residual are reduced by the slope and variance of the scatter, with 1 <= z <= sign
changes of the residual. The variances s_k^2 explain the squared residuals:

    |e_k|^2 = sum_j tr(P_kj (S_j + s_j^2 C_j) P_kj^T) ,     P_kj = delta_kj - J_k H_j ,

with S_j the covariance of the mean curve of test j. Like scatter, the discrepancy adds to the variance of the parameters.
The discrepancy also widens every predicted force. A discrepancy with the same effect on the force as a parameter change
leaves no residual; the process includes an estimate of this part.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls
from scipy.stats import norm, t

from fsm.text.short_repr import ShortRepr

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


_WHITE_NOISE = 0.4
"""Sign changes per interval above which residuals count as independent; independent residuals have 0.5 on average."""


@dataclass(frozen=True)
class LinearisedTest:
    """One test in a linearised fit.

    Attributes
    ----------
    travel : (n,) array, m
    residual : (n,) array, N
        Mean measured force minus fitted force.
    jacobian : (n, p) array
        d(force)/d(parameter).
    gain : (p, n) array
        d(parameter)/d(measured force) of the fit, H_k.
    repeats : (r, n) array, N
        Measured forces of whole repeats; r = 0 without repeats.
    covariance : (n, n) array, N^2, or None
        Covariance of the mean curve of a test without repeats, if known.
    """

    travel: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    gain: np.ndarray
    repeats: np.ndarray
    covariance: np.ndarray | None


@dataclass(frozen=True, repr=False)
class ParameterSpread(ShortRepr):
    """Covariance of parameters from several tests.

    Attributes
    ----------
    covariance : (p, p) array
    freedom : float
        Smallest number of degrees of freedom of all parameters (Welch 1947, Satterthwaite 1946); inf if all variances are
        known.
    discrepancy : (k,) array, N
        Standard deviation of the discrepancy in each test, s_k.
    """

    covariance: np.ndarray
    freedom: float
    discrepancy: np.ndarray


def parameter_spread(tests: Sequence[LinearisedTest], known: np.ndarray) -> ParameterSpread:
    """Covariance of parameters that were fitted to several tests.

    Parameters
    ----------
    tests : sequence of LinearisedTest
    known : (p, p) array
        Covariance from priors and from zero errors of load cells.
    """
    factors = [_covariance_factor(test) for test in tests]
    sign_changes = [_sign_changes(test, factor) for test, factor in zip(tests, factors, strict=True)]
    correlations = [_correlation(test, changes) for test, changes in zip(tests, sign_changes, strict=True)]
    variances = _discrepancy_variances(tests, factors, correlations)
    parts: list[tuple[np.ndarray, float]] = [(known, math.inf)]
    for test, factor, correlation, variance, changes in zip(
        tests, factors, correlations, variances, sign_changes, strict=True
    ):
        deviation = test.gain @ factor
        parts.append((deviation @ deviation.T, len(test.repeats) - 1.0 if len(test.repeats) else math.inf))
        white = changes >= _WHITE_NOISE * (len(test.travel) - 1)
        freedom = len(test.travel) - test.jacobian.shape[1] if white else changes
        parts.append((variance * (test.gain @ correlation @ test.gain.T), max(freedom, 1.0)))
    covariance = sum((part for part, _ in parts), np.zeros_like(known))
    freedom = _freedom(parts, np.diag(covariance))
    return ParameterSpread(covariance, freedom, np.sqrt(variances))


def _covariance_factor(test: LinearisedTest) -> np.ndarray:
    """Matrix (n, m) whose product with its transpose is the covariance of the mean curve."""
    count = len(test.repeats)
    if count:
        return np.asarray((test.repeats - test.repeats.mean(axis=0)).T / math.sqrt(count * (count - 1)))
    if test.covariance is None:
        return np.zeros((len(test.travel), 0))
    return np.linalg.cholesky(test.covariance)


def _sign_changes(test: LinearisedTest, factor: np.ndarray) -> float:
    """Expected number of sign changes of the discrepancy along a curve, at least 1."""
    signs = np.sign(test.residual[test.residual != 0.0])
    counted = max(float(np.count_nonzero(np.diff(signs))), 1.0)
    steps = np.diff(test.travel)
    slope = np.mean((np.diff(test.residual) / steps) ** 2) - np.sum((np.diff(factor, axis=0) / steps[:, None]) ** 2) / len(
        steps
    )
    power = np.mean(test.residual**2) - np.sum(factor**2) / len(test.travel)
    if power <= 0.0 or slope <= 0.0:
        return 1.0
    return float(np.clip(np.ptp(test.travel) / math.pi * math.sqrt(slope / power), 1.0, counted))


def _correlation(test: LinearisedTest, changes: float) -> np.ndarray:
    """Correlation of the discrepancy along the travel, (n, n)."""
    if changes >= _WHITE_NOISE * (len(test.travel) - 1):
        return np.eye(len(test.travel))
    length = np.ptp(test.travel) / (math.pi * changes)
    return np.asarray(np.exp(-0.5 * ((test.travel[:, None] - test.travel) / length) ** 2))


def _discrepancy_variances(
    tests: Sequence[LinearisedTest], factors: Sequence[np.ndarray], correlations: Sequence[np.ndarray]
) -> np.ndarray:
    """Non-negative variances s_k^2 that explain the squared residuals."""
    count = len(tests)
    matrix, right = np.zeros((count, count)), np.zeros(count)
    for j, (source, factor, correlation) in enumerate(zip(tests, factors, correlations, strict=True)):
        by_factor, by_correlation = source.gain @ factor, source.gain @ correlation
        for k, test in enumerate(tests):
            residual = -test.jacobian @ by_factor + (factor if j == k else 0.0)
            right[k] -= np.sum(residual**2)
            matrix[k, j] = np.einsum("ip,pq,iq->", test.jacobian, by_correlation @ source.gain.T, test.jacobian)
            if j == k:
                matrix[k, j] += np.trace(correlation) - 2.0 * np.einsum("ip,pi->", test.jacobian, by_correlation)
    right += [float(test.residual @ test.residual) for test in tests]
    scale = np.maximum(np.abs(matrix).max(axis=1), 1e-300)
    found, _ = nnls(matrix / scale[:, None], right / scale)
    return np.asarray(found)


def _freedom(parts: Sequence[tuple[np.ndarray, float]], total: np.ndarray) -> float:
    """Smallest number of degrees of freedom of a sum of variances, over the parameters."""
    uncertain = sum(np.diag(part) ** 2 / freedom for part, freedom in parts)
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = np.where(uncertain > 0.0, total**2 / uncertain, math.inf)
    return float(freedom.min(initial=math.inf))
