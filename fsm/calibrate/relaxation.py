"""Relaxation of the rest angle of a crease, theta_r(t) = theta_r0 + A log(1 + t/tau), from angles measured over time.

The data have the columns `angle` and `time`, and `repeat` if several creases were measured. The fit is by least squares.
For a given tau it is linear in theta_r0 and A. The best tau on a grid gives the start values.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from fsm.calibrate.branches import FLAG_EXCLUDED, FLAG_USED, find_outliers
from fsm.calibrate.data import MeasuredTable, read_table
from fsm.calibrate.report import Calibration, Options, Quantity
from fsm.calibrate.smoothing import bin_points
from fsm.calibrate.uncertainty import Estimate, bootstrap, from_samples, laplace
from fsm.case.loading.crease_family import time_text
from fsm.errors import CaseError, Fault
from fsm.views.plots.calibration import FitPlot, plot_fit

QUANTITIES = {"angle": "angle", "time": "time", "repeat": "number"}
NAMES = ("theta_r0", "A", "log tau")
MIN_TIMES = 5
"""Fewest different times of a test."""
MIN_REPEATS = 3
"""Fewest creases for an interval from the differences between creases."""
_MAX_BINS = 2000
"""Largest number of points in a fit; more points are averaged in bins."""
_STARTS = 25
"""Number of values of tau that are tried as the start of the fit."""
_DRAWS = 200
"""Bootstrap samples."""
_REPORTED_TIMES = (60.0, 600.0, 3600.0, 86400.0, 604800.0)
"""Times, s, at which the rest angle is reported if they lie within the test."""
_TAU_RANGE = 100.0
"""Bounds of tau: the shortest time over this factor, and the longest time multiplied by it."""

_TIME_RANGE = (1e-9, 1e12)
"""Admissible positive times of a test, s."""


def relaxed_angle(time: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Rest angle theta_r(t), rad, with the parameters theta_r0 (rad), A (rad) and log tau (tau in s)."""
    start, slope, log_tau = parameters
    return np.asarray(start + slope * np.log1p(time * math.exp(-log_tau)))


def _gradient(time: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """d(theta_r)/d(parameters), (n, 3)."""
    _, slope, log_tau = parameters
    ratio = time * math.exp(-log_tau)
    return np.column_stack([np.ones(len(time)), np.log1p(ratio), -slope * ratio / (1.0 + ratio)])


def fit_relaxation(time: np.ndarray, angle: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Parameters (theta_r0, A, log tau) by weighted least squares.

    Parameters
    ----------
    time, angle, weight : (n,) arrays
        Times, s; angles, rad; number of rows that each point represents.
    """
    root = np.sqrt(weight)
    positive = time[time > 0.0]
    low, high = math.log(positive.min() / _TAU_RANGE), math.log(positive.max() * _TAU_RANGE)

    def linear(log_tau: float) -> tuple[np.ndarray, float]:
        matrix = np.column_stack([np.ones(len(time)), np.log1p(time * math.exp(-log_tau))]) * root[:, None]
        found, *_ = np.linalg.lstsq(matrix, angle * root, rcond=None)
        return found, float(np.sum((matrix @ found - angle * root) ** 2))

    starts = np.linspace(low, high, _STARTS)
    log_tau = float(starts[int(np.argmin([linear(start)[1] for start in starts]))])
    solution = least_squares(
        lambda p: root * (relaxed_angle(time, p) - angle),
        np.array([*linear(log_tau)[0], log_tau]),
        jac=lambda p: root[:, None] * _gradient(time, p),
        bounds=([-np.inf, -np.inf, low], [np.inf, np.inf, high]),
        x_scale="jac",
        ftol=1e-14,
        xtol=1e-14,
        gtol=1e-14,
    )
    return np.asarray(solution.x)


def calibrate_relaxation(data: Path, options: Options) -> Calibration:
    """Fit the relaxation law to a CSV file.

    Raises
    ------
    CaseError
        The data have faults; all are listed.
    """
    table = read_table(data, QUANTITIES, ["angle", "time"])
    faults = _faults(table)
    if faults:
        raise CaseError(faults, str(data))
    time, angle = table.columns["time"], table.columns["angle"]
    flagged = _flagged(table)
    used = np.setdiff1d(np.arange(len(time)), flagged) if options.without_flagged else np.arange(len(time))
    repeats = table.columns.get("repeat", np.zeros(len(time)))[used]
    time, angle = time[used], angle[used]
    estimate = _estimate(time, angle, repeats, options)
    quantities, reported = _quantities(estimate, time, options)
    return Calibration(
        kind="relaxation",
        sources=(data,),
        quantities=quantities,
        numbers=_numbers(estimate, table, flagged, options),
        lines=_lines(estimate, time, reported),
        warnings=_warnings(table, estimate, time, angle, repeats, flagged, options),
        plots=[("relaxation.png", partial(plot_fit, _plot(estimate, time, angle, options)))],
    )


def _faults(table: MeasuredTable) -> list[Fault]:
    time, angle = table.columns["time"], table.columns["angle"]
    faults = []
    negative = np.flatnonzero(time < 0.0)
    if len(negative):
        first = int(negative[0])
        what = f"time is {table.shown('time', first)}; it must be at least 0, counted from the release of the crease"
        faults.append(table.fault(first, what))
    outside = np.flatnonzero((time > 0.0) & ((time < _TIME_RANGE[0]) | (time > _TIME_RANGE[1])))
    if len(outside):
        limits = f"{_TIME_RANGE[0]:g} to {_TIME_RANGE[1]:g} s"
        what = f"time is {table.shown('time', int(outside[0]))}, outside {limits}; check the unit"
        faults.append(table.fault(int(outside[0]), what))
    large = np.flatnonzero(np.abs(angle) > 2 * math.pi * (1 + 1e-9))
    if len(large):
        first = int(large[0])
        what = f"angle is {table.shown('angle', first)}, more than a turn; if in degrees, write angle [deg]"
        faults.append(table.fault(first, what))
    if faults:
        return faults
    different = len(np.unique(time))
    if different < MIN_TIMES:
        rows = f"{len(time)} row{'s' * (len(time) != 1)} at {different} different time{'s' * (different != 1)}"
        faults.append(Fault("", f"has {rows}; the law has three parameters and needs at least {MIN_TIMES} different times"))
    elif np.ptp(angle) == 0.0:
        what = f"angle is {table.shown('angle', 0)} in all {len(angle)} rows; a constant angle cannot be fitted"
        faults.append(Fault("", what))
    return faults


def _flagged(table: MeasuredTable) -> np.ndarray:
    """Row indices of outliers among the neighbours in time, for each crease separately."""
    repeat = table.columns.get("repeat", np.zeros(len(table)))
    flagged = []
    for number in np.unique(repeat):
        rows = np.flatnonzero(repeat == number)
        if len(rows) < 8:
            continue
        time = np.log1p(table.columns["time"][rows])
        order = rows[np.argsort(time, kind="stable")]
        found = find_outliers(np.sort(time), table.columns["angle"][order])
        flagged += order[list(found)].tolist()
    return np.array(sorted(flagged), dtype=np.int64)


def _estimate(time: np.ndarray, angle: np.ndarray, repeats: np.ndarray, options: Options) -> Estimate:
    """Fit with its covariance, from the scatter about the fit or, with enough creases, from their differences."""
    at, mean, weight = bin_points(time, angle, _MAX_BINS)
    best = fit_relaxation(at, mean, weight)
    numbers = np.unique(repeats)
    if len(numbers) >= MIN_REPEATS:
        each = [bin_points(time[repeats == n], angle[repeats == n], _MAX_BINS) for n in numbers]

        def refit(draw: np.ndarray) -> np.ndarray:
            drawn = [each[k] for k in draw]
            return fit_relaxation(*(np.concatenate([part[i] for part in drawn]) for i in range(3)))

        samples = bootstrap(refit, len(each), _DRAWS, options.seed)
        return from_samples(NAMES, best, samples, len(each))
    root = np.sqrt(weight)
    residuals = root * (relaxed_angle(at, best) - mean)
    return laplace(NAMES, best, root[:, None] * _gradient(at, best), residuals)


def _derived(name: str, unit: str, value: float, gradient: np.ndarray, estimate: Estimate, level: float) -> Quantity:
    error = math.sqrt(max(float(gradient @ estimate.covariance @ gradient), 0.0))
    half_width = estimate.quantile(level) * error
    return Quantity(name, value, unit, value - half_width, value + half_width, error)


def _quantities(estimate: Estimate, time: np.ndarray, options: Options) -> tuple[list[Quantity], list[float]]:
    """Parameters, change per decade of time, and rest angles at the reported times; and these times, s."""
    start, slope, log_tau = estimate.values.tolist()
    unit = np.eye(3)
    level = options.level
    low, high = np.exp(estimate.interval(level)[2])
    tau = math.exp(log_tau)
    found = [
        _derived("theta_r0", "rad", start, unit[0], estimate, level),
        _derived("A", "rad", slope, unit[1], estimate, level),
        Quantity("tau", tau, "s", float(low), float(high), tau * float(estimate.standard_error[2])),
        _derived("A ln 10, per decade of time", "rad", slope * math.log(10.0), math.log(10.0) * unit[1], estimate, level),
    ]
    reported = [t for t in _REPORTED_TIMES if time.min() <= t <= time.max()] or [float(time.max())]
    for t in reported:
        at = np.array([t])
        value, gradient = float(relaxed_angle(at, estimate.values)[0]), _gradient(at, estimate.values)[0]
        found.append(_derived(f"theta_r after {time_text(t)}", "rad", value, gradient, estimate, level))
    return found, reported


def _numbers(estimate: Estimate, table: MeasuredTable, flagged: np.ndarray, options: Options) -> dict[str, Any]:
    return {
        "law": "theta_r(t) = theta_r0 + A log(1 + t/tau)",
        "parameters": dict(zip(NAMES, estimate.values.tolist(), strict=True)),
        "covariance": estimate.covariance,
        "correlation": estimate.correlation,
        "freedom": estimate.freedom,
        "longest_time_s": float(table.columns["time"].max()),
        "flagged": [{"row": int(table.rows[k]), "used": not options.without_flagged} for k in flagged],
    }


def _lines(estimate: Estimate, time: np.ndarray, reported: list[float]) -> list[str]:
    at = relaxed_angle(np.array([reported[-1]]), estimate.values)[0]
    return [
        f"measured from {time_text(float(time.min()))} to {time_text(float(time.max()))}",
        f'in a case, {time_text(reported[-1])} after release: crease.rest_angle = "{math.degrees(at):.4g} deg",'
        " if angles were measured from the flat sheet",
    ]


def _warnings(
    table: MeasuredTable,
    estimate: Estimate,
    time: np.ndarray,
    angle: np.ndarray,
    repeats: np.ndarray,
    flagged: np.ndarray,
    options: Options,
) -> list[str]:
    warnings = list(table.notes)
    treatment = FLAG_EXCLUDED if options.without_flagged else FLAG_USED
    for k in flagged[:10]:
        where = f"angle {table.shown('angle', int(k))} at {table.shown('time', int(k))}"
        warnings.append(f"row {table.rows[k]}: outlier: {where} is far from its neighbours ({treatment})")
    if len(flagged) > 10:
        warnings.append(f"and {len(flagged) - 10} more flagged rows; calibration.json lists all")
    tau = math.exp(estimate.values[2])
    positive = time[time > 0.0]
    if tau < 0.1 * positive.min():
        what = f"tau ({tau:.3g} s) is much shorter than the first time ({positive.min():.3g} s): theta_r0 and tau are not"
        warnings.append(f"{what} separately identifiable; A and angles in the test are. Measure sooner after release")
    elif tau > positive.max():
        what = f"tau ({tau:.3g} s) is longer than the test ({positive.max():.3g} s)"
        warnings.append(f"{what}: only the initial slope A/tau is identifiable; measure longer")
    if len(np.unique(repeats)) == 2:
        warnings.append("two creases are too few to compare; the interval is from the scatter, add a third crease")
    residual = angle - relaxed_angle(time, estimate.values)
    share = 1.0 - float(residual @ residual) / float(np.sum((angle - angle.mean()) ** 2))
    if share < 0.5:
        what = f"the law explains only {100 * share:.0f} % of the variance of the angles (less than 50 %)"
        warnings.append(f"{what}; look at relaxation.png")
    return warnings


def _plot(estimate: Estimate, time: np.ndarray, angle: np.ndarray, options: Options) -> FitPlot:
    positive = time > 0.0
    at = np.geomspace(time[positive].min(), time.max(), 200)
    gradient = _gradient(at, estimate.values)
    variance = np.einsum("ij,jk,ik->i", gradient, estimate.covariance, gradient)
    half_width = estimate.quantile(options.level) * np.sqrt(np.maximum(variance, 0.0))
    curve = relaxed_angle(at, estimate.values)
    degrees: Callable[[np.ndarray], np.ndarray] = np.degrees
    label = f"theta_r0 + A log(1 + t/tau), {100 * options.level:g} % band"
    curves = [(label, at, degrees(curve), degrees(curve - half_width), degrees(curve + half_width))]
    return FitPlot(time[positive], degrees(angle[positive]), curves, "time (s)", "rest angle (deg)", logarithmic=True)
