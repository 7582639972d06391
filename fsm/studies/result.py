"""Result of a study: responses of its runs, and what these say about the parameters.

What a study says about its parameters: Sobol indices, standardised regression, tornado.

The estimators of the Sobol indices are those of `scipy.stats.sobol_indices` (Saltelli et al. 2010, Comput. Phys. Commun.
181, 259, table 2 b and f). That function itself accepts only a power of 2 of complete rows, which a run that fails prevents;
here rows with a failed run are left out of the base sample, and their number is stated.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from fsm.case.models.study import StudyFile
from fsm.errors import FsmError
from fsm.studies.problem import CURVE, Run
from fsm.studies.scatter import Design, Scatter

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


RANDOM = ("sobol", "latin")
"""Designs whose runs are a sample of the scatter, so that quantiles have their probabilities."""


@dataclass(frozen=True)
class StudyResult:
    """Result of a study.

    Attributes
    ----------
    file : StudyFile
    source : Path
        Study file.
    scatters : list of Scatter
    design : Design
    nominal : Run
        Run with the nominal values.
    runs : list of Run or None
        Runs in the order of the design; None for a run that failed.
    errors : list of str
        Causes of failures; empty for other runs.
    """

    file: StudyFile
    source: Path
    scatters: list[Scatter]
    design: Design
    nominal: Run
    runs: list[Run | None]
    errors: list[str]

    @property
    def paths(self) -> list[str]:
        """Paths of the parameters."""
        return [one.path for one in self.scatters]

    @property
    def groups(self) -> list[str]:
        """Names of independent groups of parameters."""
        return [" + ".join(self.paths[k] for k in group) for group in self.design.groups]

    @property
    def failed(self) -> int:
        """Number of runs that failed."""
        return sum(run is None for run in self.runs)

    def response(self, key: str) -> np.ndarray:
        """Values (n,) of a response, SI; NaN for runs that failed."""
        return np.array([np.nan if run is None else run.responses[key] for run in self.runs])

    def quantiles(self, key: str) -> tuple[float, float, float]:
        """Lower end, median and upper end of a response at the level of the study; without probabilities its range."""
        values = self.response(key)
        values = values[np.isfinite(values)]
        if not len(values):
            return np.nan, np.nan, np.nan
        part = self.file.level if self.file.design.kind in RANDOM else 1.0
        low, middle, high = np.quantile(values, [0.5 - 0.5 * part, 0.5, 0.5 + 0.5 * part])
        return float(low), float(middle), float(high)

    def indices(self, key: str) -> Indices | None:
        """Sobol indices of a response; None for other designs, or with too few complete rows."""
        if not self.design.sample:
            return None
        return sobol_indices(self.response(key), self.design.sample, self.file.level, self.file.seed)

    def regression(self, key: str) -> Regression | None:
        """Linear regression of a response; None with too few runs."""
        return regression(self.design.values, self.response(key), self.file.level)

    def tornado(self, key: str) -> np.ndarray:
        """Response at the low and high end of each parameter, (p, 2)."""
        low, high = (np.array([getattr(one, end) for one in self.scatters]) for end in ("low", "high"))
        return tornado(self.design.values, self.response(key), self.design.varied, low, high, self.regression(key))

    def curves(self) -> tuple[np.ndarray, np.ndarray]:
        """Travels (m,) up to the smallest travel of all runs, m, and forces (n, m), N, of the runs with a curve."""
        kept = [run for run in self.runs if run is not None and run.curve]
        if not kept:
            return np.zeros(0), np.zeros((0, 0))
        travel = np.linspace(0.0, min(run.travel for run in kept), CURVE)
        return travel, np.array([np.interp(travel, np.linspace(0.0, run.travel, CURVE), run.curve) for run in kept])

    def causes(self) -> list[tuple[str, int, list[int]]]:
        """Causes of failures: text of the first run, number of runs, their numbers; texts that differ in numbers are one."""
        kinds = [re.sub(r"[-+]?\d[\d.,e+-]*", "#", error) for error in self.errors]
        return [
            (self.errors[kinds.index(kind)], count, [k for k, one in enumerate(kinds) if one == kind])
            for kind, count in Counter(kind for kind in kinds if kind).most_common()
        ]


def result_lines(result: StudyResult) -> list[str]:
    """Lines for the terminal: responses, indices or regression, failures."""
    file, lines = result.file, []
    low_text = f"{100 * file.level:g} % band" if file.design.kind in RANDOM else "range"
    for one in file.response:
        unit = result.nominal.units[one.key]
        low, middle, high = result.quantiles(one.key)
        lines.append(
            f"{one.key}: nominal {result.nominal.responses[one.key]:.5g}, median {middle:.5g}, "
            f"{low_text} {low:.5g} to {high:.5g} {unit}".rstrip()
        )
        found, fitted = result.indices(one.key), result.regression(one.key)
        if found is not None:
            for name, s, t, bs, bt in zip(
                result.groups, found.first, found.total, found.first_interval, found.total_interval, strict=True
            ):
                lines.append(
                    f"  {name}: first index {s:.3f} ({bs[0]:.3f} to {bs[1]:.3f}), total {t:.3f} ({bt[0]:.3f} to {bt[1]:.3f})"
                )
            if found.lost:
                lines.append(
                    f"  {found.lost} of {found.lost + found.rows} rows of the base sample left out: a run of them failed"
                )
        elif result.design.varied is not None:
            for name, (a, b) in zip(result.paths, result.tornado(one.key), strict=True):
                lines.append(f"  {name}: {a:.5g} to {b:.5g} {unit}")
        elif fitted is not None:
            lines.append(f"  regression explains {100 * fitted.determination:.3g} % of the variance")
            lines += [
                f"  {name}: standardised slope {b:+.3f}" for name, b in zip(result.paths, fitted.standardised, strict=True)
            ]
    for text, count, numbers in result.causes():
        shown = ", ".join(map(str, numbers[:5])) + (", ..." if count > 5 else "")
        lines.append(f"failed: {count} of {len(result.runs)} runs ({shown}): {text}")
    return lines


def check_failed(result: StudyResult) -> None:
    """Raise an error if runs failed.

    Raises
    ------
    FsmError
    """
    if result.failed:
        error = FsmError(f"{result.failed} of {len(result.runs)} runs failed")
        error.exit_code = 3
        raise error
