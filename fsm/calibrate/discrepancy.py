"""Covariance of fitted parameters from the scatter of whole repeats and from the model discrepancy.

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
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from fsm.text.short_repr import ShortRepr

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
