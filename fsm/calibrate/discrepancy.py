"""Covariance of fitted parameters from whole repeats of a test and from the misfit of the model's form.

Points of one repeat are not independent: specimens differ as wholes. Near the best fit, parameters move with the measured
forces as dp = sum_k H_k dF_k, where H_k are the columns of test k in the pseudo-inverse of the weighted Jacobian. So each
whole repeat r of a test gives its own dp = H_k (F_kr - mean F_k), and the variance of their mean is the sample variance
over the number of repeats (a cluster-robust covariance; Liang & Zeger 1986), whatever the correlation along the curve is.

The mean residual e_k = F_k - F_k(p) holds more than that scatter where the form of the model is wrong (Kennedy & O'Hagan
2001). The rest is taken as a stationary Gaussian process of variance s_k^2 along the travel, with the correlation
exp(-(x - x')^2/(2 l^2)). It changes its sign z = range/(pi l) times on average, and 1/l^2 is the mean squared slope over the
variance (Rice 1944); both are those of the residual less those of the scatter, with 1 <= z <= sign changes of the residual.
Its variance is that which explains the squared residuals,

    |e_k|^2 = sum_j tr(P_kj (S_j + s_j^2 C_j) P_kj^T) ,     P_kj = delta_kj - J_k H_j ,

with S_j the covariance of a mean curve. It moves parameters as scatter does, and widens every predicted force. What the
misfit shares with a change of parameters cannot be seen in residuals; the process stands for that part, too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

__all__ = ["Rows", "Spread", "spread_of"]

_LIKE_NOISE = 0.4
"""Sign changes per step between neighbours from which on residuals are independent; half of the steps on average."""


@dataclass(frozen=True)
class Rows:
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
        Measured forces of whole repeats; r = 0 where they are not known.
    covariance : (n, n) array, N^2, or None
        Of the mean curve, where there are no repeats; None where nothing is known of it.
    """

    travel: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    gain: np.ndarray
    repeats: np.ndarray
    covariance: np.ndarray | None


@dataclass(frozen=True)
class Spread:
    """What tests say of the spread of parameters.

    Attributes
    ----------
    covariance : (p, p) array
    freedom : float
        Degrees of freedom (Welch 1947, Satterthwaite 1946), the least of all parameters; inf where all variances are known.
    discrepancy : (k,) array, N
        Standard deviation of that misfit in each test, s_k.
    """

    covariance: np.ndarray
    freedom: float
    discrepancy: np.ndarray


def spread_of(tests: Sequence[Rows], known: np.ndarray) -> Spread:
    """Covariance of parameters that were fitted to several tests.

    Parameters
    ----------
    tests : sequence of Rows
    known : (p, p) array
        Covariance that does not come from tests: of priors and of zeros of load cells.
    """
    factors = [_factor(test) for test in tests]
    lengths = [_changes(test, factor) for test, factor in zip(tests, factors, strict=True)]
    forms = [_correlation(test, changes) for test, changes in zip(tests, lengths, strict=True)]
    variance = _form_variance(tests, factors, forms)
    parts: list[tuple[np.ndarray, float]] = [(known, math.inf)]
    for test, factor, form, size, changes in zip(tests, factors, forms, variance, lengths, strict=True):
        moved = test.gain @ factor
        parts.append((moved @ moved.T, len(test.repeats) - 1.0 if len(test.repeats) else math.inf))
        white = changes >= _LIKE_NOISE * (len(test.travel) - 1)
        freedom = len(test.travel) - test.jacobian.shape[1] if white else changes
        parts.append((size * (test.gain @ form @ test.gain.T), max(freedom, 1.0)))
    covariance = sum((part for part, _ in parts), np.zeros_like(known))
    freedom = _freedom(parts, np.diag(covariance))
    return Spread(covariance, freedom, np.sqrt(variance))


def _factor(test: Rows) -> np.ndarray:
    """Matrix (n, m) whose product with its transpose is the covariance of the mean curve."""
    count = len(test.repeats)
    if count:
        return np.asarray((test.repeats - test.repeats.mean(axis=0)).T / math.sqrt(count * (count - 1)))
    if test.covariance is None:
        return np.zeros((len(test.travel), 0))
    return np.linalg.cholesky(test.covariance)


def _changes(test: Rows, factor: np.ndarray) -> float:
    """Sign changes of the misfit along a curve, one at least."""
    signs = np.sign(test.residual[test.residual != 0.0])
    seen = max(float(np.count_nonzero(np.diff(signs))), 1.0)
    steps = np.diff(test.travel)
    slope = np.mean((np.diff(test.residual) / steps) ** 2) - np.sum((np.diff(factor, axis=0) / steps[:, None]) ** 2) / len(
        steps
    )
    power = np.mean(test.residual**2) - np.sum(factor**2) / len(test.travel)
    if power <= 0.0 or slope <= 0.0:
        return 1.0
    return float(np.clip(np.ptp(test.travel) / math.pi * math.sqrt(slope / power), 1.0, seen))


def _correlation(test: Rows, changes: float) -> np.ndarray:
    """Correlation of the misfit along the travel, (n, n)."""
    if changes >= _LIKE_NOISE * (len(test.travel) - 1):
        return np.eye(len(test.travel))
    length = np.ptp(test.travel) / (math.pi * changes)
    return np.asarray(np.exp(-0.5 * ((test.travel[:, None] - test.travel) / length) ** 2))


def _form_variance(tests: Sequence[Rows], factors: Sequence[np.ndarray], forms: Sequence[np.ndarray]) -> np.ndarray:
    """Variances s_k^2 that explain the squared residuals, none of them negative."""
    count = len(tests)
    matrix, right = np.zeros((count, count)), np.zeros(count)
    for j, (source, factor, form) in enumerate(zip(tests, factors, forms, strict=True)):
        moved, moved_form = source.gain @ factor, source.gain @ form
        for k, test in enumerate(tests):
            left = -test.jacobian @ moved + (factor if j == k else 0.0)
            right[k] -= np.sum(left**2)
            matrix[k, j] = np.einsum("ip,pq,iq->", test.jacobian, moved_form @ source.gain.T, test.jacobian)
            if j == k:
                matrix[k, j] += np.trace(form) - 2.0 * np.einsum("ip,pi->", test.jacobian, moved_form)
    right += [float(test.residual @ test.residual) for test in tests]
    scale = np.maximum(np.abs(matrix).max(axis=1), 1e-300)
    found, _ = nnls(matrix / scale[:, None], right / scale)
    return np.asarray(found)


def _freedom(parts: Sequence[tuple[np.ndarray, float]], total: np.ndarray) -> float:
    """Least number of degrees of freedom of a sum of variances, over the parameters."""
    uncertain = sum(np.diag(part) ** 2 / freedom for part, freedom in parts)
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = np.where(uncertain > 0.0, total**2 / uncertain, math.inf)
    return float(freedom.min(initial=math.inf))
