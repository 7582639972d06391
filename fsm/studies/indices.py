"""What a study says about its parameters: Sobol indices, standardised regression, tornado.

The estimators of the Sobol indices are those of `scipy.stats.sobol_indices` (Saltelli et al. 2010, Comput. Phys. Commun.
181, 259, table 2 b and f). That function itself accepts only a power of 2 of complete rows, which a run that fails prevents;
here rows with a failed run are left out of the base sample, and their number is stated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

_RESAMPLES = 999
"""Number of bootstrap samples of an interval."""
_FEWEST = 8
"""Smallest number of complete rows of the base sample for indices."""


@dataclass(frozen=True)
class Indices:
    """Sobol indices of one response.

    Attributes
    ----------
    first, total : (g,) arrays
        Part of the variance that a group of parameters causes alone, and with all its interactions.
    first_interval, total_interval : (g, 2) arrays
        Bootstrap intervals (percentiles).
    rows, lost : int
        Complete rows of the base sample, and rows left out because a run of them failed.
    """

    first: np.ndarray
    total: np.ndarray
    first_interval: np.ndarray
    total_interval: np.ndarray
    rows: int
    lost: int


def sobol_indices(response: np.ndarray, sample: int, level: float, seed: int) -> Indices | None:
    """Indices from the responses of a "sobol" design.

    Parameters
    ----------
    response : ((g + 2) sample,) array
        Responses of A, B, and A with each group from B; NaN for runs that failed.
    sample : int
        Rows of the base sample.
    level : -
        Level of the intervals.
    seed : int
        Seed of the bootstrap.

    Returns
    -------
    Indices or None
        None with fewer than 8 complete rows, or if the response does not vary.
    """
    parts = response.reshape(-1, sample)
    complete = np.isfinite(parts).all(axis=0)
    rows = int(complete.sum())
    if rows < _FEWEST or np.ptp(parts[:2, complete]) == 0.0:
        return None
    kept = parts[:, complete] - parts[:2, complete].mean()
    first, total = _estimate(kept)
    generator = np.random.default_rng(seed)
    drawn = [_estimate(kept[:, generator.integers(0, rows, rows)]) for _ in range(_RESAMPLES)]
    edges = [0.5 - 0.5 * level, 0.5 + 0.5 * level]
    with np.errstate(invalid="ignore"):
        bounds = [np.nanquantile([one[k] for one in drawn], edges, axis=0).T for k in (0, 1)]
    return Indices(first, total, bounds[0], bounds[1], rows, sample - rows)


def _estimate(parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices from centred responses (g + 2, n)."""
    a, b, mixed = parts[0], parts[1], parts[2:]
    variance = np.var(parts[:2])
    if variance == 0.0:
        return np.full(len(mixed), np.nan), np.full(len(mixed), np.nan)
    return np.mean(b * (mixed - a), axis=1) / variance, 0.5 * np.mean((a - mixed) ** 2, axis=1) / variance


@dataclass(frozen=True)
class Regression:
    """Linear regression of one response on all parameters.

    Attributes
    ----------
    slope : (p,) array
        Change of the response for a change of the parameter, SI; NaN for a parameter that does not vary.
    standardised : (p,) array
        Slopes in standard deviations of the response per standard deviation of the parameter.
    interval : (p, 2) array
        Intervals of `standardised`.
    determination : -
        Part of the variance that the regression explains, R^2.
    """

    slope: np.ndarray
    standardised: np.ndarray
    interval: np.ndarray
    determination: float


def regression(values: np.ndarray, response: np.ndarray, level: float) -> Regression | None:
    """Regression of responses (n,) with NaN for failed runs on values (n, p); None if there are too few runs.

    Intervals are those of least squares with independent errors of equal size.
    """
    good = np.isfinite(response)
    x, y = values[good], response[good]
    if len(y) == 0:
        return None
    spread, size = x.std(axis=0), float(y.std())
    varied = spread > 1e-12 * np.abs(x).max(axis=0)
    freedom = len(y) - int(varied.sum()) - 1
    if freedom < 1 or size == 0.0 or not varied.any():
        return None
    scores = (x[:, varied] - x[:, varied].mean(axis=0)) / spread[varied]
    target = (y - y.mean()) / size
    found, _, rank, _ = np.linalg.lstsq(scores, target, rcond=None)
    if rank < scores.shape[1]:
        return None
    left = target - scores @ found
    error = np.sqrt(float(left @ left) / freedom * np.diag(np.linalg.inv(scores.T @ scores)))
    half = stats.t.ppf(0.5 + 0.5 * level, freedom) * error
    standardised, interval = np.full(len(varied), np.nan), np.full((len(varied), 2), np.nan)
    standardised[varied], interval[varied] = found, np.column_stack([found - half, found + half])
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = standardised * size / spread
    return Regression(slope, standardised, interval, 1.0 - float(left @ left) / len(y))


def tornado(
    values: np.ndarray,
    response: np.ndarray,
    varied: np.ndarray | None,
    low: np.ndarray,
    high: np.ndarray,
    found: Regression | None,
) -> np.ndarray:
    """Response at the low and the high end of each parameter, (p, 2).

    From the runs of "one-at-a-time" at the ends; from other designs by the regression, with the others at their means.
    """
    ends = np.full((len(low), 2), np.nan)
    if varied is not None:
        for k in range(len(low)):
            own = np.flatnonzero(varied == k)
            if len(own):
                ends[k] = response[own[np.argmin(values[own, k])]], response[own[np.argmax(values[own, k])]]
    elif found is not None:
        middle, mean = values[np.isfinite(response)].mean(axis=0), float(np.nanmean(response))
        ends = mean + found.slope[:, None] * (np.column_stack([low, high]) - middle[:, None])
    return ends
