"""Fit of one curve of a crease family: loading and unloading branch, repeats and their scatter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fsm.calibrate.branches import Sweep
from fsm.calibrate.report import Options
from fsm.calibrate.smoothing import GRID, MIN_POINTS, CurveFit, fit_curve, smoothing_for
from fsm.calibrate.uncertainty import Estimate, bootstrap, from_samples
from fsm.case.loading.crease_family import FamilyCurve
from fsm.errors import CaseError, Fault

_DRAWS = 1000
"""Bootstrap samples."""
_CROSSING_ERRORS, _CROSSING_PART = 3.0, 0.02
"""Crossing of the branches that scatter explains: in standard errors, and as a fraction of their largest distance."""


@dataclass(frozen=True)
class Branch:
    """Loading or unloading branch of a curve.

    Attributes
    ----------
    angle, moment : (m,) arrays, rad, N m
        Measured points.
    fit : CurveFit
    estimate : Estimate
        Moments at the angles of the fit, with their covariance.
    repeats : (repeats, n) array, N m
        Separate fit to each repeat, at the angles of the fit.
    """

    angle: np.ndarray
    moment: np.ndarray
    fit: CurveFit
    estimate: Estimate
    repeats: np.ndarray


@dataclass(frozen=True)
class FittedCurve:
    """Curve of the family with its loading branch and, if measured, its unloading branch."""

    press_time: float | None
    opening: float | None
    loading: Branch
    unloading: Branch | None
    sweeps: tuple[Sweep, ...]

    @property
    def family(self) -> FamilyCurve:
        """Curve in the form that is written to the family file."""
        back = self.unloading
        unloading = None if back is None else back.estimate.values
        if unloading is not None and not self.crossing:
            unloading = np.minimum(unloading, self.loading.estimate.values)
        return FamilyCurve(
            angle=self.loading.fit.x,
            loading=self.loading.estimate.values,
            loading_error=self.loading.estimate.standard_error,
            unloading=unloading,
            unloading_error=None if back is None else back.estimate.standard_error,
            press_time=self.press_time,
            opening=self.opening,
            repeats=len(self.sweeps),
        )

    @property
    def crossing(self) -> float | None:
        """Angle (rad) at which unloading exceeds loading by more than the scatter explains; None if there is none."""
        if self.unloading is None:
            return None
        gap = self.loading.estimate.values - self.unloading.estimate.values
        error = np.sqrt(np.maximum(np.diag(gap_covariance(self.loading, self.unloading)), 0.0))
        # a few repeats may agree by chance, so the standard error is at least that from the scatter of the points
        lowest = np.hypot(self.loading.fit.scatter, self.unloading.fit.scatter) / math.sqrt(len(self.loading.repeats))
        allowed = np.maximum(_CROSSING_ERRORS * np.maximum(error, lowest), _CROSSING_PART * np.abs(gap).max())
        worst = int(np.argmax(-gap - allowed))
        return float(self.loading.fit.x[worst]) if -gap[worst] > allowed[worst] else None

    @property
    def name(self) -> str:
        """Name of the curve."""
        return self.family.name


def fit_family_curve(
    press_time: float | None,
    opening: float | None,
    sweeps: Sequence[Sweep],
    excluded: set[tuple[str, int]],
    options: Options,
) -> FittedCurve:
    """Fit both branches of one curve, on the range of angles that all its tests share.

    Parameters
    ----------
    press_time, opening : s and -, None if not given in the tests
    sweeps : tests of this curve
    excluded : (source, row of the table) of the excluded rows
    options : Options

    Raises
    ------
    CaseError
        There is no loading branch, too few different angles, or no common range of angles.
    """
    loaded = [sweep for sweep in sweeps if len(sweep.loading)]
    unloaded = [sweep for sweep in sweeps if len(sweep.unloading)]
    if not loaded:
        raise CaseError(Fault("", "has an unloading branch only; add the loading branch"), sweeps[0].table.source)
    up = [_points(sweep, sweep.loading, excluded) for sweep in loaded]
    down = [_points(sweep, sweep.unloading, excluded) for sweep in unloaded]
    for (angle, _), sweep in zip([*up, *down], [*loaded, *unloaded], strict=True):
        _check_enough(angle, sweep, options.fit)
    grid = None
    if len(up) + len(down) > 1:
        low, high = max(a.min() for a, _ in [*up, *down]), min(a.max() for a, _ in [*up, *down])
        if high <= low:
            what = f"the tests of {_name(sweeps[0])}, or their loading and unloading branches, have no angles in common"
            raise CaseError(Fault("", f"{what}; check the columns opening and branch"), sweeps[0].table.source)
        grid = np.linspace(low, high, GRID)
    unloading = _fit_branch(down, options, grid) if down else None
    return FittedCurve(press_time, opening, _fit_branch(up, options, grid), unloading, tuple(sweeps))


def _points(sweep: Sweep, rows: np.ndarray, excluded: set[tuple[str, int]]) -> tuple[np.ndarray, np.ndarray]:
    used = [row for row in rows.tolist() if (sweep.table.source, row) not in excluded] if excluded else rows
    return sweep.table.columns["angle"][used], sweep.table.columns["moment"][used]


def _fit_branch(
    points: Sequence[tuple[np.ndarray, np.ndarray]], options: Options, grid: np.ndarray | None
) -> Branch:
    """Fits to all repeats of a branch, with the mean of the fits and its covariance."""
    angle = np.concatenate([a for a, _ in points])
    moment = np.concatenate([m for _, m in points])
    if len(points) == 1:
        fit = fit_curve(angle, moment, options.fit, grid)
        estimate = Estimate(_names(fit.x), fit.y, fit.covariance, max(int(fit.freedom), 0))
        return Branch(angle, moment, fit, estimate, fit.y[None])
    # the smoothing parameter was determined for all points together, and each repeat has only a part of the points
    smoothing = None if options.fit == "interpolate" else smoothing_for(angle, moment) / len(points)
    fits = [fit_curve(a, m, options.fit, grid, smoothing) for a, m in points]
    each = np.array([fit.y for fit in fits])
    samples = bootstrap(lambda draw: each[draw].mean(axis=0), len(each), _DRAWS, options.seed)
    estimate = from_samples(_names(fits[0].x), each.mean(axis=0), samples, len(each))
    fit = replace(fits[0], y=each.mean(axis=0), scatter=float(np.mean([f.scatter for f in fits])))
    return Branch(angle, moment, fit, estimate, each)


def _names(angle: np.ndarray) -> tuple[str, ...]:
    return tuple(f"M({a:.4g})" for a in angle)


def _name(sweep: Sweep) -> str:
    none = np.zeros(0)
    return FamilyCurve(none, none, none, press_time=sweep.press_time, opening=sweep.opening).name


def _check_enough(angle: np.ndarray, sweep: Sweep, fit: str) -> None:
    """Check that a branch has enough different angles for the fit."""
    different = len(np.unique(angle))
    if different >= MIN_POINTS[fit]:
        return
    if len(angle) > 1 and different == 1:
        what = f"angle is {math.degrees(angle[0]):.6g} deg in all {len(angle)} rows; a curve needs different angles"
    else:
        rows = f"{len(angle)} row{'s' * (len(angle) != 1)}"
        what = f"{_name(sweep)} has {rows} of {different} different angles; the fit \"{fit}\" needs {MIN_POINTS[fit]}"
        if 4 <= different < MIN_POINTS[fit]:
            what += "; --fit interpolate needs 4"
    raise CaseError(Fault("", what), sweep.table.source)


def gap_covariance(loading: Branch, unloading: Branch) -> np.ndarray:
    """Covariance of L - U, from repeats with both branches if possible; otherwise the branches are treated as
    independent.
    """
    if len(loading.repeats) == len(unloading.repeats) > 1:
        gaps = loading.repeats - unloading.repeats
        return np.asarray(np.cov(gaps, rowvar=False) / len(gaps))
    return loading.estimate.covariance + unloading.estimate.covariance
