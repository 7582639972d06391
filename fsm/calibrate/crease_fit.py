"""The fit of one curve of a crease family: both ways, repeats and their scatter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fsm.calibrate.branches import Sweep
from fsm.calibrate.report import Options
from fsm.calibrate.smoothing import FEWEST, GRID, CurveFit, fit_curve, smoothing_for
from fsm.calibrate.uncertainty import Estimate, bootstrap, from_samples
from fsm.errors import CaseError, Fault
from fsm.scene.crease_family import FamilyCurve

__all__ = ["Branch", "Curve", "fit_family_curve", "gap_covariance"]

_DRAWS = 1000
_SCATTER, _CROSSING = 3.0, 0.02
"""Standard errors, and parts of the largest distance of the branches, by which scatter may put unloading above loading."""


@dataclass(frozen=True)
class Branch:
    """One way of one curve: points, the fit, its estimate on the fit's angles; repeats fitted apart (repeats, n)."""

    angle: np.ndarray
    moment: np.ndarray
    fit: CurveFit
    estimate: Estimate
    repeats: np.ndarray


@dataclass(frozen=True)
class Curve:
    """A curve of the family with its two ways."""

    press_time: float | None
    opening: float | None
    loading: Branch
    unloading: Branch | None
    sweeps: tuple[Sweep, ...]

    @property
    def family(self) -> FamilyCurve:
        """What the file keeps of it."""
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
        """Angle (rad) at which unloading lies above loading by more than scatter can do; None where it does not."""
        if self.unloading is None:
            return None
        gap = self.loading.estimate.values - self.unloading.estimate.values
        error = np.sqrt(np.maximum(np.diag(gap_covariance(self.loading, self.unloading)), 0.0))
        # a few repeats may agree by chance: never less than what the scatter of points makes of them
        chance = np.hypot(self.loading.fit.scatter, self.unloading.fit.scatter) / math.sqrt(len(self.loading.repeats))
        allowed = np.maximum(_SCATTER * np.maximum(error, chance), _CROSSING * np.abs(gap).max())
        worst = int(np.argmax(-gap - allowed))
        return float(self.loading.fit.x[worst]) if -gap[worst] > allowed[worst] else None

    @property
    def name(self) -> str:
        """What it is called."""
        return self.family.name


def fit_family_curve(
    press_time: float | None,
    opening: float | None,
    sweeps: Sequence[Sweep],
    left_out: set[tuple[str, int]],
    options: Options,
) -> Curve:
    """Both ways of one curve, on the angles that all its tests have.

    Parameters
    ----------
    press_time, opening : s and -, None where the tests do not state them
    sweeps : the tests
    left_out : (source, row of the table) of rows that are not to be used
    options : Options
    """
    there = [sweep for sweep in sweeps if len(sweep.loading)]
    back = [sweep for sweep in sweeps if len(sweep.unloading)]
    if not there:
        raise CaseError(Fault("", "has unloading only; the way up is wanted too"), sweeps[0].table.source)
    up = [_points(sweep, sweep.loading, left_out) for sweep in there]
    down = [_points(sweep, sweep.unloading, left_out) for sweep in back]
    for (angle, _), sweep in zip([*up, *down], [*there, *back], strict=True):
        _check_enough(angle, sweep, options.fit)
    grid = None
    if len(up) + len(down) > 1:
        low, high = max(a.min() for a, _ in [*up, *down]), min(a.max() for a, _ in [*up, *down])
        if high <= low:
            what = f"the tests of {_name(sweeps[0])}, or their ways up and back, have no angles in common"
            raise CaseError(Fault("", f"{what}; check the columns opening and branch"), sweeps[0].table.source)
        grid = np.linspace(low, high, GRID)
    unloading = _fit_branch(down, options, grid) if down else None
    return Curve(press_time, opening, _fit_branch(up, options, grid), unloading, tuple(sweeps))


def _points(sweep: Sweep, rows: np.ndarray, left_out: set[tuple[str, int]]) -> tuple[np.ndarray, np.ndarray]:
    kept = [row for row in rows.tolist() if (sweep.table.source, row) not in left_out] if left_out else rows
    return sweep.table.columns["angle"][kept], sweep.table.columns["moment"][kept]


def _fit_branch(
    points: Sequence[tuple[np.ndarray, np.ndarray]], options: Options, grid: np.ndarray | None
) -> Branch:
    """One way: a fit to every repeat, their mean and its scatter."""
    angle = np.concatenate([a for a, _ in points])
    moment = np.concatenate([m for _, m in points])
    if len(points) == 1:
        fit = fit_curve(angle, moment, options.fit, grid)
        estimate = Estimate(_names(fit.x), fit.y, fit.covariance, max(int(fit.freedom), 0))
        return Branch(angle, moment, fit, estimate, fit.y[None])
    # the penalty is shared by all points: of each repeat, its part
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
    """Enough different angles for the fit, or a fault that says what is there."""
    different = len(np.unique(angle))
    if different >= FEWEST[fit]:
        return
    if len(angle) > 1 and different == 1:
        what = f"angle is {math.degrees(angle[0]):.6g} deg in all {len(angle)} rows; a curve needs different angles"
    else:
        rows = f"{len(angle)} row{'s' * (len(angle) != 1)}"
        what = f"{_name(sweep)} has {rows} of {different} different angles; the fit \"{fit}\" needs {FEWEST[fit]}"
        if 4 <= different < FEWEST[fit]:
            what += ", --fit interpolate only 4"
    raise CaseError(Fault("", what), sweep.table.source)


def gap_covariance(loading: Branch, unloading: Branch) -> np.ndarray:
    """Covariance of L - U: of repeats that came back, whose ways vary together; else of independent ways."""
    if len(loading.repeats) == len(unloading.repeats) > 1:
        gaps = loading.repeats - unloading.repeats
        return np.asarray(np.cov(gaps, rowvar=False) / len(gaps))
    return loading.estimate.covariance + unloading.estimate.covariance
