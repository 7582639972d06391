"""A family of crease curves M(psi) over press time and opening number, from tests of creases.

Columns: `angle` and `moment`, or `angle`, `force` and `lever_arm` (one side clamped, the other turned by a force always
normal to it, M = F L; seed 003, section 4.1); and, as there are, `press_time`, `opening`, `repeat`, `branch`, `width`. DATA
is a CSV file, or a folder of them. Angles are opening angles: how far the crease is turned from its rest angle towards flat.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fsm.calibrate.branches import Flag, Sweep, sweeps_of
from fsm.calibrate.data import Table, read_table
from fsm.calibrate.report import Calibration, Options, Quantity
from fsm.calibrate.smoothing import FEWEST, GRID, CurveFit, fit_curve, smoothing_for
from fsm.calibrate.uncertainty import Estimate, bootstrap, from_samples
from fsm.errors import CaseError, Fault
from fsm.plots.calibration import CurvePlot, plot_curves, plot_loops, plot_residuals
from fsm.scene.crease_family import CreaseFamily, FamilyCurve, time_text, write_family

__all__ = ["calibrate_crease"]

QUANTITIES = {
    "angle": "angle",
    "moment": "moment",
    "force": "force",
    "lever_arm": "length",
    "press_time": "time",
    "opening": "number",
    "repeat": "number",
    "branch": "branch",
    "width": "length",
}
FAMILY = "crease.h5"
_DRAWS = 1000
_SHORTER = 0.05
"""Part of the range of a curve by which repeats may be shorter unnoticed."""
_KINDS = {"smooth": "cubic", "interpolate": "cubic", "monotone": "pchip"}


@dataclass(frozen=True)
class _Branch:
    """One way of one curve: points, the fit, its estimate on the fit's angles; repeats fitted apart (repeats, n)."""

    angle: np.ndarray
    moment: np.ndarray
    fit: CurveFit
    estimate: Estimate
    repeats: np.ndarray


@dataclass(frozen=True)
class _Curve:
    """A curve of the family with its two ways."""

    press_time: float | None
    opening: float | None
    loading: _Branch
    unloading: _Branch | None
    sweeps: tuple[Sweep, ...]

    @property
    def family(self) -> FamilyCurve:
        """What the file keeps of it."""
        back = self.unloading
        return FamilyCurve(
            angle=self.loading.fit.x,
            loading=self.loading.estimate.values,
            loading_error=self.loading.estimate.standard_error,
            unloading=None if back is None else back.estimate.values,
            unloading_error=None if back is None else back.estimate.standard_error,
            press_time=self.press_time,
            opening=self.opening,
            repeats=len(self.sweeps),
        )

    @property
    def name(self) -> str:
        """What it is called."""
        return self.family.name


def calibrate_crease(data: Path, options: Options) -> Calibration:
    """Fit a family of crease curves to a CSV file or a folder of them.

    Raises
    ------
    CaseError
        All faults of the first file that has any, with rows; or tests that make no family.
    """
    files = _files(data)
    sweeps = [sweep for file in files for sweep in _read(file)]
    flags = [flag for sweep in sweeps for flag in sweep.flags]
    left_out = {(flag.source, flag.index) for flag in flags} if options.without_flagged else set()
    groups = _by_curve(sweeps)
    curves = [_fit(key, groups[key], left_out, options) for key in sorted(groups, key=_order)]
    width = _width(sweeps)
    family = CreaseFamily(tuple(curve.family for curve in curves), _KINDS[options.fit], width)
    plots = [_plotted(curve, options) for curve in curves]
    drawn: list[tuple[str, Any]] = [
        ("curves.png", partial(plot_curves, plots)),
        ("residuals.png", partial(plot_residuals, plots)),
    ]
    if any(plot.unloading is not None for plot in plots):
        drawn.append(("loops.png", partial(plot_loops, plots)))
    return Calibration(
        kind="crease",
        sources=tuple(files),
        quantities=[quantity for curve in curves for quantity in _quantities(curve, options)],
        numbers=_numbers(curves, family, flags, options),
        lines=_lines(curves, flags, options),
        warnings=_warnings(sweeps, curves, flags, options),
        plots=drawn,
        files=[(FAMILY, partial(write_family, family))],
    )


# reading -------------------------------------------------------------------------------------------------------------


def _files(data: Path) -> list[Path]:
    if not data.is_dir():
        return [data]
    files = sorted(data.glob("*.csv"))
    if not files:
        raise CaseError(Fault("", "holds no CSV file; name a file, or a folder of them"), str(data))
    return files


def _read(file: Path) -> list[Sweep]:
    """The tests of one file, moments made of forces."""
    table = read_table(file, QUANTITIES, ["angle"])
    columns = dict(table.columns)
    faults = list(_range_faults(table))
    if "moment" not in columns:
        missing = [name for name in ("force", "lever_arm") if name not in columns]
        if missing:
            what = f"no column moment, and no {' and no '.join(missing)} either; give `moment [N mm]`, or `force [N]` and "
            faults.append(Fault("", what + "`lever_arm [mm]`"))
        else:
            columns["moment"] = columns["force"] * columns["lever_arm"]
    elif "force" in columns:
        faults.append(Fault("", "has both moment and force; leave one out, they may disagree"))
    if faults:
        raise CaseError(faults, str(file))
    units = {"moment": "N mm", **table.units}
    return sweeps_of(replace(table, columns=columns, units=units))


def _range_faults(table: Table) -> list[Fault]:
    """Values that no test can have, the first of each kind, and how many more."""
    checks = {
        "angle": (lambda a: np.abs(a) > 2 * math.pi * (1 + 1e-9), ", more than a turn; if in degrees, write angle [deg]"),
        "lever_arm": (lambda a: a <= 0.0, "; it must be greater than 0; give the sign to the force"),
        "press_time": (lambda a: a < 0.0, "; it must be at least 0"),
        "opening": (lambda a: (a < 1.0) | (a != np.round(a)), "; it must be a whole number from 1 on"),
        "width": (lambda a: a <= 0.0, "; it must be greater than 0"),
    }
    faults = []
    for name, (bad, what) in checks.items():
        if name not in table.columns:
            continue
        rows = np.flatnonzero(bad(table.columns[name]))
        if len(rows):
            more = f" (and {len(rows) - 1} more rows like this)" if len(rows) > 1 else ""
            faults.append(table.fault(int(rows[0]), f"{name} is {table.shown(name, int(rows[0]))}{what}{more}"))
    return faults


_Key = tuple[float | None, float | None]


def _by_curve(sweeps: Sequence[Sweep]) -> dict[_Key, list[Sweep]]:
    groups: dict[_Key, list[Sweep]] = {}
    for sweep in sweeps:
        groups.setdefault((sweep.press_time, sweep.opening), []).append(sweep)
    for place in range(2):
        name = ("press_time", "opening")[place]
        if len({key[place] is None for key in groups}) > 1:
            source = next(s.table.source for s in sweeps if getattr(s, name) is None)
            raise CaseError(Fault("", f"does not state `{name}`, which the other files do; add the column"), source)
    return groups


def _order(key: _Key) -> tuple[float, ...]:
    return tuple(-1.0 if value is None else value for value in key)


def _width(sweeps: Sequence[Sweep]) -> float | None:
    widths = np.concatenate([sweep.table.columns.get("width", np.zeros(0)) for sweep in sweeps])
    if not len(widths):
        return None
    if np.ptp(widths) > 1e-9:
        raise CaseError(
            Fault("", f"creases of {1e3 * widths.min():g} to {1e3 * widths.max():g} mm width make no family; one of each"),
            sweeps[0].table.source,
        )
    return float(widths[0])


# fitting -------------------------------------------------------------------------------------------------------------


def _fit(key: _Key, sweeps: Sequence[Sweep], left_out: set[tuple[str, int]], options: Options) -> _Curve:
    """Both ways of one curve, on the angles that all its tests have."""
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
    return _Curve(*key, _fit_branch(up, options, grid), unloading, tuple(sweeps))


def _points(sweep: Sweep, rows: np.ndarray, left_out: set[tuple[str, int]]) -> tuple[np.ndarray, np.ndarray]:
    kept = [row for row in rows.tolist() if (sweep.table.source, row) not in left_out] if left_out else rows
    return sweep.table.columns["angle"][kept], sweep.table.columns["moment"][kept]


def _fit_branch(
    points: Sequence[tuple[np.ndarray, np.ndarray]], options: Options, grid: np.ndarray | None
) -> _Branch:
    """One way: a fit to every repeat, their mean and its scatter."""
    angle = np.concatenate([a for a, _ in points])
    moment = np.concatenate([m for _, m in points])
    if len(points) == 1:
        fit = fit_curve(angle, moment, options.fit, grid)
        estimate = Estimate(_names(fit.x), fit.y, fit.covariance, max(int(fit.freedom), 0))
        return _Branch(angle, moment, fit, estimate, fit.y[None])
    # the penalty is shared by all points: of each repeat, its part
    smoothing = None if options.fit == "interpolate" else smoothing_for(angle, moment) / len(points)
    fits = [fit_curve(a, m, options.fit, grid, smoothing) for a, m in points]
    each = np.array([fit.y for fit in fits])
    samples = bootstrap(lambda draw: each[draw].mean(axis=0), len(each), _DRAWS, options.seed)
    estimate = from_samples(_names(fits[0].x), each.mean(axis=0), samples, len(each))
    fit = replace(fits[0], y=each.mean(axis=0), scatter=float(np.mean([f.scatter for f in fits])))
    return _Branch(angle, moment, fit, estimate, each)


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


# what is told --------------------------------------------------------------------------------------------------------


def _quantities(curve: _Curve, options: Options) -> list[Quantity]:
    """Mean stiffness, moment at the largest angle, and area of the loop of one curve."""
    grid = curve.loading.fit.x
    weights = _slope_weights(grid)
    last = np.zeros(len(grid))
    last[-1] = 1.0
    found = [
        _linear(f"{curve.name}: mean stiffness", "N m/rad", weights, curve.loading, options),
        _linear(f"{curve.name}: moment at {math.degrees(grid[-1]):.3g} deg", "N m", last, curve.loading, options),
    ]
    if curve.unloading is not None:
        found.append(_loop_area(curve, options))
    return found


def _slope_weights(x: np.ndarray) -> np.ndarray:
    """The slope of the straight line through values at x, as weights of the values."""
    off = x - x.mean()
    return np.asarray(off / (off @ off))


def _trapezoid_weights(x: np.ndarray) -> np.ndarray:
    step = np.diff(x)
    return 0.5 * (np.concatenate([step, [0.0]]) + np.concatenate([[0.0], step]))


def _linear(name: str, unit: str, weights: np.ndarray, branch: _Branch, options: Options) -> Quantity:
    """A linear functional of a branch with its interval."""
    estimate = branch.estimate
    value = float(weights @ estimate.values)
    error = math.sqrt(max(float(weights @ estimate.covariance @ weights), 0.0))
    return _quantity(name, value, unit, error, estimate, options)


def _quantity(name: str, value: float, unit: str, error: float, estimate: Estimate, options: Options) -> Quantity:
    if error == 0.0:
        return Quantity(name, value, unit)
    reach = estimate.quantile(options.level) * error
    return Quantity(name, value, unit, value - reach, value + reach, error)


def _loop_area(curve: _Curve, options: Options) -> Quantity:
    """int (L - U) do: what a cycle dissipates; of repeats that came back, each with its own area."""
    loading, unloading = curve.loading, curve.unloading
    assert unloading is not None
    weights = _trapezoid_weights(loading.fit.x)
    value = float(weights @ (loading.estimate.values - unloading.estimate.values))
    error = math.sqrt(max(float(weights @ _gap_covariance(loading, unloading) @ weights), 0.0))
    return _quantity(f"{curve.name}: loop area", value, "J", error, loading.estimate, options)


def _gap_covariance(loading: _Branch, unloading: _Branch) -> np.ndarray:
    """Covariance of L - U: of repeats that came back, whose ways vary together; else of independent ways."""
    if len(loading.repeats) == len(unloading.repeats) > 1:
        gaps = loading.repeats - unloading.repeats
        return np.asarray(np.cov(gaps, rowvar=False) / len(gaps))
    return loading.estimate.covariance + unloading.estimate.covariance


def _lines(curves: Sequence[_Curve], flags: Sequence[Flag], options: Options) -> list[str]:
    lines = []
    for curve in curves:
        grid = np.degrees(curve.loading.fit.x)
        ways = "loading and unloading" if curve.unloading is not None else "one way"
        tests = f"{len(curve.sweeps)} test{'s' * (len(curve.sweeps) > 1)}"
        scatter = f", scatter {1e3 * curve.loading.fit.scatter:.3g} N mm" if curve.loading.fit.scatter else ""
        lines.append(f"{curve.name}: {tests}, {ways}, {grid[0]:.4g} to {grid[-1]:.4g} deg{scatter}")
    if len(flags) and options.without_flagged:
        lines.append(f"{len(flags)} flagged row{'s' * (len(flags) > 1)} left out")
    first = curves[0]
    choice = [f'file = "{FAMILY}"']
    choice += [f'press_time = "{first.press_time:g} s"'] if first.press_time is not None else []
    choice += [f"opening = {first.opening:g}"] if first.opening is not None else []
    lines.append(f"in a case: crease = {{ {', '.join(choice)} }}")
    return lines


def _warnings(
    sweeps: Sequence[Sweep], curves: Sequence[_Curve], flags: Sequence[Flag], options: Options
) -> list[str]:
    warnings = list(dict.fromkeys(f"{s.table.source}: {note}" for s in sweeps for note in s.table.notes))
    verb = "left out" if options.without_flagged else "used all the same; --without-flagged leaves it out"
    warnings += [f"{flag.message} ({verb})" for flag in flags[:10]]
    if len(flags) > 10:
        warnings.append(f"and {len(flags) - 10} more flagged rows; calibration.json has all")
    for curve in curves:
        warnings += _curve_warnings(curve, options)
    return warnings


def _curve_warnings(curve: _Curve, options: Options) -> list[str]:
    warnings = []
    name, branch = curve.name, curve.loading
    if len(curve.sweeps) == 2:
        warnings.append(f"{name}: two repeats say little of their scatter; intervals are wide, test a third")
    if len(curve.sweeps) == 1 and options.fit == "interpolate":
        warnings.append(f"{name}: one test, and the curve goes through all its points: nothing is known of its scatter")
    longest = max(float(np.ptp(s.table.columns["angle"][s.loading])) for s in curve.sweeps if len(s.loading))
    kept = float(np.ptp(branch.fit.x))
    if kept < (1.0 - _SHORTER) * longest:
        what = f"{name}: tests or branches have only {math.degrees(kept):.4g} of {math.degrees(longest):.4g} deg in common"
        warnings.append(f"{what}; beyond it the curve goes straight on")
    slope = np.gradient(branch.estimate.values, branch.fit.x)
    if slope.min() < 0.0 < slope.max():
        at = math.degrees(branch.fit.x[int(np.argmin(slope))])
        warnings.append(f"{name}: the moment falls with the angle at {at:.4g} deg; --fit monotone if that is scatter")
    if curve.unloading is not None:
        above = curve.unloading.estimate.values - branch.estimate.values
        if above.max() > 0.02 * np.abs(above).max():
            at = math.degrees(branch.fit.x[int(np.argmax(above))])
            warnings.append(f"{name}: unloading lies above loading at {at:.4g} deg; hysteresis cannot be used there")
    return warnings


def _numbers(
    curves: Sequence[_Curve], family: CreaseFamily, flags: Sequence[Flag], options: Options
) -> dict[str, Any]:
    return {
        "fit": options.fit,
        "interpolation": family.interpolation,
        "width_m": family.width,
        "curves": [_curve_numbers(curve, options) for curve in curves],
        "flagged": [
            {"file": flag.source, "row": flag.row, "kind": flag.kind, "text": flag.text, "used": not options.without_flagged}
            for flag in flags
        ],
    }


def _curve_numbers(curve: _Curve, options: Options) -> dict[str, Any]:
    numbers: dict[str, Any] = {
        "name": curve.name,
        "press_time_s": curve.press_time,
        "opening": curve.opening,
        "tests": len(curve.sweeps),
        "angle_rad": curve.loading.fit.x,
    }
    for way, branch in (("loading", curve.loading), ("unloading", curve.unloading)):
        if branch is None:
            continue
        reach = branch.estimate.quantile(options.level) * branch.estimate.standard_error
        numbers[way] = {
            "moment_Nm": branch.estimate.values,
            "standard_error_Nm": branch.estimate.standard_error,
            "low_Nm": branch.estimate.values - reach,
            "high_Nm": branch.estimate.values + reach,
            "scatter_Nm": branch.fit.scatter,
            "smoothing": branch.fit.smoothing,
            "points": len(branch.angle),
        }
    return numbers


def _plotted(curve: _Curve, options: Options) -> CurvePlot:
    def band(branch: _Branch | None) -> tuple[np.ndarray, ...] | None:
        if branch is None:
            return None
        reach = branch.estimate.quantile(options.level) * branch.estimate.standard_error
        values = branch.estimate.values
        return branch.angle, branch.moment, branch.fit.x, values, values - reach, values + reach

    loading = band(curve.loading)
    assert loading is not None
    panel = "" if curve.press_time is None else f"pressed {time_text(curve.press_time)}"
    label = "" if curve.opening is None else f"opening {curve.opening:g}"
    reach = None
    if curve.unloading is not None:
        variance = np.maximum(np.diag(_gap_covariance(curve.loading, curve.unloading)), 0.0)
        reach = curve.loading.estimate.quantile(options.level) * np.sqrt(variance)
    return CurvePlot(panel, label, loading, band(curve.unloading), reach, options.level)
