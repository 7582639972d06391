"""Report on a family of crease curves: table, warnings, numbers of `calibration.json`, figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fsm.calibrate.branches import FLAG_EXCLUDED, FLAG_USED, Flag, Sweep
from fsm.calibrate.crease_fit import Branch, FittedCurve, gap_covariance
from fsm.calibrate.report import Options, Quantity
from fsm.calibrate.uncertainty import Estimate
from fsm.case.loading.crease_family import CreaseFamily, time_text
from fsm.views.plots.calibration import CurvePlot

FAMILY = "crease.h5"
"""Name of the family file."""
_MAX_LOSS = 0.05
"""Largest reduction of the range of angles without a warning, as a fraction of the longest test."""
_MAX_SWING = 1.2
"""Ratio of the range of an interpolated curve to the range of its points, above which a warning is given."""


def quantities(curve: FittedCurve, options: Options) -> list[Quantity]:
    """Mean stiffness, moment at the largest angle, scale factor, and loop area of one curve.

    The scale factor is 1, with an interval from the scatter. This interval is the uncertainty of `crease.scale` of a case.
    """
    grid, values = curve.loading.fit.x, curve.loading.estimate.values
    weights = _slope_weights(grid)
    last = np.zeros(len(grid))
    last[-1] = 1.0
    found = [
        _linear(f"{curve.name}: mean stiffness", "N m/rad", weights, curve.loading, options),
        _linear(f"{curve.name}: moment at {math.degrees(grid[-1]):.3g} deg", "N m", last, curve.loading, options),
        _linear(f"{curve.name}: crease.scale", "", values / (values @ values), curve.loading, options),
    ]
    zero = _zero_moment(curve.loading)
    if zero is not None:
        found.append(_quantity(f"{curve.name}: zero moment at", zero[0], "rad", zero[1], curve.loading.estimate, options))
    if curve.unloading is not None:
        found.append(_loop_area(curve, options))
    return found


def _zero_moment(branch: Branch) -> tuple[float, float] | None:
    """Angle (rad) of a zero of the moment inside the measured range, and its standard error; None without a zero."""
    grid, values = branch.fit.x, branch.estimate.values
    inside = 0.02 * (grid[-1] - grid[0])
    for k in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        slope = (values[k + 1] - values[k]) / (grid[k + 1] - grid[k])
        at = float(grid[k] - values[k] / slope)
        if grid[0] + inside < at < grid[-1] - inside:
            return at, float(branch.estimate.standard_error[k] / abs(slope))
    return None


def _slope_weights(x: np.ndarray) -> np.ndarray:
    """Weights of values at x whose sum is the slope of the regression line."""
    centred = x - x.mean()
    return np.asarray(centred / (centred @ centred))


def _trapezoid_weights(x: np.ndarray) -> np.ndarray:
    step = np.diff(x)
    return 0.5 * (np.concatenate([step, [0.0]]) + np.concatenate([[0.0], step]))


def _linear(name: str, unit: str, weights: np.ndarray, branch: Branch, options: Options) -> Quantity:
    """Weighted sum of the moments of a branch, with its interval."""
    estimate = branch.estimate
    value = float(weights @ estimate.values)
    error = math.sqrt(max(float(weights @ estimate.covariance @ weights), 0.0))
    return _quantity(name, value, unit, error, estimate, options)


def _quantity(name: str, value: float, unit: str, error: float, estimate: Estimate, options: Options) -> Quantity:
    if error == 0.0:
        return Quantity(name, value, unit)
    half_width = estimate.quantile(options.level) * error
    return Quantity(name, value, unit, value - half_width, value + half_width, error)


def _loop_area(curve: FittedCurve, options: Options) -> Quantity:
    """Loop area int (L - U) do, which is the energy that one cycle dissipates."""
    loading, unloading = curve.loading, curve.unloading
    assert unloading is not None
    weights = _trapezoid_weights(loading.fit.x)
    value = float(weights @ (loading.estimate.values - unloading.estimate.values))
    error = math.sqrt(max(float(weights @ gap_covariance(loading, unloading) @ weights), 0.0))
    return _quantity(f"{curve.name}: loop area", value, "J", error, loading.estimate, options)


def lines(curves: Sequence[FittedCurve], flags: Sequence[Flag], options: Options) -> list[str]:
    """Lines below the table: tests, ranges, and the section of a case that uses the file."""
    texts = []
    for curve in curves:
        grid = np.degrees(curve.loading.fit.x)
        branches = "loading and unloading" if curve.unloading is not None else "one branch"
        tests = f"{len(curve.sweeps)} test{'s' * (len(curve.sweeps) > 1)}"
        scatter = f", scatter {1e3 * curve.loading.fit.scatter:.3g} N mm" if curve.loading.fit.scatter else ""
        texts.append(f"{curve.name}: {tests}, {branches}, {grid[0]:.4g} to {grid[-1]:.4g} deg{scatter}")
    if len(flags) and options.without_flagged:
        texts.append(f"{len(flags)} flagged row{'s' * (len(flags) > 1)} excluded")
    first = curves[0]
    keys = [f'file = "{FAMILY}"']
    keys += [f'press_time = "{time_text(first.press_time)}"'] if first.press_time is not None else []
    keys += [f"opening = {first.opening:g}"] if first.opening is not None else []
    texts.append(f"in a case: crease = {{ {', '.join(keys)} }}")
    return texts


def warnings(
    sweeps: Sequence[Sweep], curves: Sequence[FittedCurve], flags: Sequence[Flag], options: Options
) -> list[str]:
    """Warnings: notes on the files, flagged rows, and faults of the curves."""
    texts = list(dict.fromkeys(f"{s.table.source}: {note}" for s in sweeps for note in s.table.notes))
    treatment = FLAG_EXCLUDED if options.without_flagged else FLAG_USED
    texts += [f"{flag.message} ({treatment})" for flag in flags[:10]]
    if len(flags) > 10:
        texts.append(f"and {len(flags) - 10} more flagged rows; calibration.json lists all")
    for curve in curves:
        texts += _curve_warnings(curve, options)
    return texts


def _curve_warnings(curve: FittedCurve, options: Options) -> list[str]:
    warnings = []
    name, branch = curve.name, curve.loading
    if len(curve.sweeps) == 2:
        warnings.append(f"{name}: two repeats are too few for their scatter; intervals are wide, add a third repeat")
    if len(curve.sweeps) == 1 and options.fit == "interpolate":
        warnings.append(f"{name}: no interval: a curve through all points of a single test has no scatter; add a repeat")
    swing = np.ptp(branch.estimate.values) / max(float(np.ptp(branch.moment)), 1e-300)
    if options.fit == "interpolate" and swing > _MAX_SWING:
        what = f"{name}: the range of the interpolated curve is {swing:.3g} times the range of its points"
        warnings.append(f"{what} (more than {_MAX_SWING:g}); the points are too noisy, use --fit smooth")
    longest = max(float(np.ptp(s.table.columns["angle"][s.loading])) for s in curve.sweeps if len(s.loading))
    common = float(np.ptp(branch.fit.x))
    if common < (1.0 - _MAX_LOSS) * longest:
        what = f"{name}: tests or branches have only {math.degrees(common):.4g} of {math.degrees(longest):.4g} deg in common"
        warnings.append(f"{what}; the curve is extrapolated linearly outside this range")
    slope = np.gradient(branch.estimate.values, branch.fit.x)
    if branch.estimate.values[-1] < branch.estimate.values[0]:
        what = f"{name}: the moment falls as the angle grows, so the crease would spring open"
        warnings.append(f"{what}; a positive moment resists opening: check the signs of both columns")
    elif slope.min() < 0.0:
        at = math.degrees(branch.fit.x[int(np.argmin(slope))])
        warnings.append(f"{name}: the moment falls with the angle at {at:.4g} deg; use --fit monotone if this is scatter")
    if curve.crossing is not None:
        at = math.degrees(curve.crossing)
        exchanged = curve.unloading is not None and np.mean(curve.unloading.estimate.values > branch.estimate.values) > 0.5
        hint = "; the branches look exchanged, check the column branch and the signs" if exchanged else ""
        what = f"{name}: unloading lies above loading at {at:.4g} deg; with hysteresis this curve is an error{hint}"
        warnings.append(what)
    return warnings


def numbers(
    curves: Sequence[FittedCurve], family: CreaseFamily, flags: Sequence[Flag], options: Options
) -> dict[str, Any]:
    """Entries of the family in `calibration.json`."""
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


def _curve_numbers(curve: FittedCurve, options: Options) -> dict[str, Any]:
    numbers: dict[str, Any] = {
        "name": curve.name,
        "press_time_s": curve.press_time,
        "opening": curve.opening,
        "tests": len(curve.sweeps),
        "angle_rad": curve.loading.fit.x,
    }
    for name, branch in (("loading", curve.loading), ("unloading", curve.unloading)):
        if branch is None:
            continue
        half_width = branch.estimate.quantile(options.level) * branch.estimate.standard_error
        numbers[name] = {
            "moment_Nm": branch.estimate.values,
            "standard_error_Nm": branch.estimate.standard_error,
            "low_Nm": branch.estimate.values - half_width,
            "high_Nm": branch.estimate.values + half_width,
            "scatter_Nm": branch.fit.scatter,
            "smoothing": branch.fit.smoothing,
            "points": len(branch.angle),
        }
    return numbers


def curve_plot(curve: FittedCurve, options: Options) -> CurvePlot:
    """Data of the figures of one curve."""

    def band(branch: Branch | None) -> tuple[np.ndarray, ...] | None:
        if branch is None:
            return None
        half_width = branch.estimate.quantile(options.level) * branch.estimate.standard_error
        values = branch.estimate.values
        return branch.angle, branch.moment, branch.fit.x, values, values - half_width, values + half_width

    loading = band(curve.loading)
    assert loading is not None
    panel = "" if curve.press_time is None else f"pressed {time_text(curve.press_time)}"
    label = "" if curve.opening is None else f"opening {curve.opening:g}"
    gap_half_width = None
    if curve.unloading is not None:
        variance = np.maximum(np.diag(gap_covariance(curve.loading, curve.unloading)), 0.0)
        gap_half_width = curve.loading.estimate.quantile(options.level) * np.sqrt(variance)
    return CurvePlot(panel, label, loading, band(curve.unloading), gap_half_width, options.level)
