"""What is told of a family of crease curves: the table, warnings, numbers and figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fsm.calibrate.branches import Flag, Sweep
from fsm.calibrate.crease_fit import Branch, Curve, gap_covariance
from fsm.calibrate.report import Options, Quantity
from fsm.calibrate.uncertainty import Estimate
from fsm.plots.calibration import CurvePlot
from fsm.scene.crease_family import CreaseFamily, time_text

__all__ = ["FAMILY", "lines", "numbers", "plotted", "quantities", "warnings"]

FAMILY = "crease.h5"
_SHORTER = 0.05
"""Part of the range of a curve by which repeats may be shorter unnoticed."""


_SWING = 1.2
"""Range of an interpolated curve over that of its points, above which it is not believed."""


def quantities(curve: Curve, options: Options) -> list[Quantity]:
    """Mean stiffness, moment at the largest angle, factor on the curve, and area of the loop of one curve.

    The factor is 1 with the interval that the scatter leaves it: what `crease.scale` of a case is uncertain by.
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
    free = _free_of_moment(curve.loading)
    if free is not None:
        found.append(_quantity(f"{curve.name}: free of moment at", free[0], "rad", free[1], curve.loading.estimate, options))
    if curve.unloading is not None:
        found.append(_loop_area(curve, options))
    return found


def _free_of_moment(branch: Branch) -> tuple[float, float] | None:
    """Angle (rad) at which the moment changes its sign well inside the data, and its standard error."""
    grid, values = branch.fit.x, branch.estimate.values
    inside = 0.02 * (grid[-1] - grid[0])
    for k in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        slope = (values[k + 1] - values[k]) / (grid[k + 1] - grid[k])
        at = float(grid[k] - values[k] / slope)
        if grid[0] + inside < at < grid[-1] - inside:
            return at, float(branch.estimate.standard_error[k] / abs(slope))
    return None


def _slope_weights(x: np.ndarray) -> np.ndarray:
    """The slope of the straight line through values at x, as weights of the values."""
    off = x - x.mean()
    return np.asarray(off / (off @ off))


def _trapezoid_weights(x: np.ndarray) -> np.ndarray:
    step = np.diff(x)
    return 0.5 * (np.concatenate([step, [0.0]]) + np.concatenate([[0.0], step]))


def _linear(name: str, unit: str, weights: np.ndarray, branch: Branch, options: Options) -> Quantity:
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


def _loop_area(curve: Curve, options: Options) -> Quantity:
    """int (L - U) do: what a cycle dissipates; of repeats that came back, each with its own area."""
    loading, unloading = curve.loading, curve.unloading
    assert unloading is not None
    weights = _trapezoid_weights(loading.fit.x)
    value = float(weights @ (loading.estimate.values - unloading.estimate.values))
    error = math.sqrt(max(float(weights @ gap_covariance(loading, unloading) @ weights), 0.0))
    return _quantity(f"{curve.name}: loop area", value, "J", error, loading.estimate, options)


def lines(curves: Sequence[Curve], flags: Sequence[Flag], options: Options) -> list[str]:
    """What is printed below the table: tests, ranges, how a case names the file."""
    said = []
    for curve in curves:
        grid = np.degrees(curve.loading.fit.x)
        ways = "loading and unloading" if curve.unloading is not None else "one way"
        tests = f"{len(curve.sweeps)} test{'s' * (len(curve.sweeps) > 1)}"
        scatter = f", scatter {1e3 * curve.loading.fit.scatter:.3g} N mm" if curve.loading.fit.scatter else ""
        said.append(f"{curve.name}: {tests}, {ways}, {grid[0]:.4g} to {grid[-1]:.4g} deg{scatter}")
    if len(flags) and options.without_flagged:
        said.append(f"{len(flags)} flagged row{'s' * (len(flags) > 1)} left out")
    first = curves[0]
    choice = [f'file = "{FAMILY}"']
    choice += [f'press_time = "{time_text(first.press_time)}"'] if first.press_time is not None else []
    choice += [f"opening = {first.opening:g}"] if first.opening is not None else []
    said.append(f"in a case: crease = {{ {', '.join(choice)} }}")
    return said


def warnings(
    sweeps: Sequence[Sweep], curves: Sequence[Curve], flags: Sequence[Flag], options: Options
) -> list[str]:
    """What the user should know: notes on the files, flagged rows, what is odd about curves."""
    said = list(dict.fromkeys(f"{s.table.source}: {note}" for s in sweeps for note in s.table.notes))
    verb = "left out" if options.without_flagged else "used all the same; --without-flagged leaves it out"
    said += [f"{flag.message} ({verb})" for flag in flags[:10]]
    if len(flags) > 10:
        said.append(f"and {len(flags) - 10} more flagged rows; calibration.json has all")
    for curve in curves:
        said += _curve_warnings(curve, options)
    return said


def _curve_warnings(curve: Curve, options: Options) -> list[str]:
    warnings = []
    name, branch = curve.name, curve.loading
    if len(curve.sweeps) == 2:
        warnings.append(f"{name}: two repeats say little of their scatter; intervals are wide, test a third")
    if len(curve.sweeps) == 1 and options.fit == "interpolate":
        warnings.append(f"{name}: one test, and the curve goes through all its points: nothing is known of its scatter")
    swing = np.ptp(branch.estimate.values) / max(float(np.ptp(branch.moment)), 1e-300)
    if options.fit == "interpolate" and swing > _SWING:
        warnings.append(f"{name}: the interpolated curve swings far beyond its points; they are too noisy, --fit smooth")
    longest = max(float(np.ptp(s.table.columns["angle"][s.loading])) for s in curve.sweeps if len(s.loading))
    kept = float(np.ptp(branch.fit.x))
    if kept < (1.0 - _SHORTER) * longest:
        what = f"{name}: tests or branches have only {math.degrees(kept):.4g} of {math.degrees(longest):.4g} deg in common"
        warnings.append(f"{what}; beyond it the curve goes straight on")
    slope = np.gradient(branch.estimate.values, branch.fit.x)
    if branch.estimate.values[-1] < branch.estimate.values[0]:
        what = f"{name}: the moment falls as the angle grows, so that the crease would spring open"
        warnings.append(f"{what}; moments resist opening: check the signs of both columns")
    elif slope.min() < 0.0:
        at = math.degrees(branch.fit.x[int(np.argmin(slope))])
        warnings.append(f"{name}: the moment falls with the angle at {at:.4g} deg; --fit monotone if that is scatter")
    if curve.crossing is not None:
        at = math.degrees(curve.crossing)
        exchanged = curve.unloading is not None and np.mean(curve.unloading.estimate.values > branch.estimate.values) > 0.5
        hint = "; they look exchanged, check the column branch and the signs" if exchanged else ""
        warnings.append(f"{name}: unloading lies above loading at {at:.4g} deg; with hysteresis a case is refused{hint}")
    return warnings


def numbers(
    curves: Sequence[Curve], family: CreaseFamily, flags: Sequence[Flag], options: Options
) -> dict[str, Any]:
    """What `calibration.json` holds of the family."""
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


def _curve_numbers(curve: Curve, options: Options) -> dict[str, Any]:
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


def plotted(curve: Curve, options: Options) -> CurvePlot:
    """A curve as it is drawn."""

    def band(branch: Branch | None) -> tuple[np.ndarray, ...] | None:
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
        variance = np.maximum(np.diag(gap_covariance(curve.loading, curve.unloading)), 0.0)
        reach = curve.loading.estimate.quantile(options.level) * np.sqrt(variance)
    return CurvePlot(panel, label, loading, band(curve.unloading), reach, options.level)
