"""How the rest angle of a crease creeps: theta_r(t) = theta_r0 + A log(1 + t/tau), from angles measured over time.

Columns `angle` and `time`, and `repeat` where several creases were watched. The fit is by least squares; given tau it is
linear in theta_r0 and A, so that tau alone is searched for, from many beginnings.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from fsm.calibrate.branches import standing_out
from fsm.calibrate.data import Table, read_table
from fsm.calibrate.report import Calibration, Options, Quantity
from fsm.calibrate.smoothing import gathered
from fsm.calibrate.uncertainty import Estimate, bootstrap, from_samples, laplace
from fsm.errors import CaseError, Fault
from fsm.plots.calibration import FitPlot, plot_fit
from fsm.scene.crease_family import time_text

__all__ = ["calibrate_relaxation", "fit_relaxation", "relaxed_angle"]

QUANTITIES = {"angle": "angle", "time": "time", "repeat": "number"}
NAMES = ("theta_r0", "A", "log tau")
FEWEST_TIMES = 5
FEWEST_REPEATS = 3
"""Creases from which on their scatter is taken from what they differ by."""
_MOST = 2000
_STARTS = 25
_DRAWS = 200
_ASKED = (60.0, 600.0, 3600.0, 86400.0, 604800.0)
"""Times, s, at which the rest angle is told, where they were measured."""
_BEYOND = 100.0
"""tau over the longest time, or the shortest over tau, from which on data know only one end of the law."""

_TIMES = (1e-9, 1e12)
"""Times, s, that a test may have."""


def relaxed_angle(time: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """theta_r(t), rad; `parameters`: theta_r0 (rad), A (rad), log tau (tau in s)."""
    start, slope, log_tau = parameters
    return np.asarray(start + slope * np.log1p(time * math.exp(-log_tau)))


def _gradient(time: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """d(theta_r)/d(parameters), (n, 3)."""
    _, slope, log_tau = parameters
    ratio = time * math.exp(-log_tau)
    return np.column_stack([np.ones(len(time)), np.log1p(ratio), -slope * ratio / (1.0 + ratio)])


def fit_relaxation(time: np.ndarray, angle: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Parameters (theta_r0, A, log tau) of least weighted squares.

    Parameters
    ----------
    time, angle, weight : (n,) arrays, s, rad, and how many rows each stands for
    """
    root = np.sqrt(weight)
    positive = time[time > 0.0]
    low, high = math.log(positive.min() / _BEYOND), math.log(positive.max() * _BEYOND)

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
    """Fit the law to a CSV file.

    Raises
    ------
    CaseError
    """
    table = read_table(data, QUANTITIES, ["angle", "time"])
    faults = _faults(table)
    if faults:
        raise CaseError(faults, str(data))
    time, angle = table.columns["time"], table.columns["angle"]
    flagged = _flagged(table)
    kept = np.setdiff1d(np.arange(len(time)), flagged) if options.without_flagged else np.arange(len(time))
    repeats = table.columns.get("repeat", np.zeros(len(time)))[kept]
    time, angle = time[kept], angle[kept]
    estimate = _estimate(time, angle, repeats, options)
    quantities, asked = _quantities(estimate, time, options)
    return Calibration(
        kind="relaxation",
        sources=(data,),
        quantities=quantities,
        numbers=_numbers(estimate, table, flagged, options),
        lines=_lines(estimate, time, asked),
        warnings=_warnings(table, estimate, time, angle, repeats, flagged, options),
        plots=[("relaxation.png", partial(plot_fit, _plot(estimate, time, angle, options)))],
    )


def _faults(table: Table) -> list[Fault]:
    time, angle = table.columns["time"], table.columns["angle"]
    faults = []
    negative = np.flatnonzero(time < 0.0)
    if len(negative):
        first = int(negative[0])
        what = f"time is {table.shown('time', first)}; count it from the release of the crease, so that it is never negative"
        faults.append(table.fault(first, what))
    odd = np.flatnonzero((time > 0.0) & ((time < _TIMES[0]) | (time > _TIMES[1])))
    if len(odd):
        what = f"time is {table.shown('time', int(odd[0]))}; no test takes that, is the unit the right one?"
        faults.append(table.fault(int(odd[0]), what))
    large = np.flatnonzero(np.abs(angle) > 2 * math.pi * (1 + 1e-9))
    if len(large):
        first = int(large[0])
        what = f"angle is {table.shown('angle', first)}, more than a turn; if in degrees, write angle [deg]"
        faults.append(table.fault(first, what))
    if faults:
        return faults
    different = len(np.unique(time))
    if different < FEWEST_TIMES:
        rows = f"{len(time)} row{'s' * (len(time) != 1)} at {different} different time{'s' * (different != 1)}"
        faults.append(Fault("", f"has {rows}; the law has three numbers, measure at {FEWEST_TIMES} times at least"))
    elif np.ptp(angle) == 0.0:
        what = f"angle is {table.shown('angle', 0)} in all {len(angle)} rows; nothing relaxes that could be fitted"
        faults.append(Fault("", what))
    return faults


def _flagged(table: Table) -> np.ndarray:
    """Rows that are far from their neighbours in time, of each crease."""
    repeat = table.columns.get("repeat", np.zeros(len(table)))
    out = []
    for number in np.unique(repeat):
        rows = np.flatnonzero(repeat == number)
        if len(rows) < 8:
            continue
        time = np.log1p(table.columns["time"][rows])
        order = rows[np.argsort(time, kind="stable")]
        found = standing_out(np.sort(time), table.columns["angle"][order])
        out += order[list(found)].tolist()
    return np.array(sorted(out), dtype=np.int64)


def _estimate(time: np.ndarray, angle: np.ndarray, repeats: np.ndarray, options: Options) -> Estimate:
    """The fit with its covariance: of the scatter about it, or, of several creases, of what they differ by."""
    at, mean, weight = gathered(time, angle, _MOST)
    best = fit_relaxation(at, mean, weight)
    numbers = np.unique(repeats)
    if len(numbers) >= FEWEST_REPEATS:
        each = [gathered(time[repeats == n], angle[repeats == n], _MOST) for n in numbers]

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
    reach = estimate.quantile(level) * error
    return Quantity(name, value, unit, value - reach, value + reach, error)


def _quantities(estimate: Estimate, time: np.ndarray, options: Options) -> tuple[list[Quantity], list[float]]:
    """The three numbers, what a decade of time brings, and the rest angle at round times that were measured."""
    start, slope, log_tau = estimate.values.tolist()
    unit = np.eye(3)
    level = options.level
    low, high = np.exp(estimate.interval(level)[2])
    tau = math.exp(log_tau)
    found = [
        _derived("theta_r0", "rad", start, unit[0], estimate, level),
        _derived("A", "rad", slope, unit[1], estimate, level),
        Quantity("tau", tau, "s", float(low), float(high), tau * float(estimate.standard_error[2])),
        _derived("A ln 10, a decade of time", "rad", slope * math.log(10.0), math.log(10.0) * unit[1], estimate, level),
    ]
    asked = [t for t in _ASKED if time.min() <= t <= time.max()] or [float(time.max())]
    for t in asked:
        at = np.array([t])
        value, gradient = float(relaxed_angle(at, estimate.values)[0]), _gradient(at, estimate.values)[0]
        found.append(_derived(f"theta_r after {time_text(t)}", "rad", value, gradient, estimate, level))
    return found, asked


def _numbers(estimate: Estimate, table: Table, flagged: np.ndarray, options: Options) -> dict[str, Any]:
    return {
        "law": "theta_r(t) = theta_r0 + A log(1 + t/tau)",
        "parameters": dict(zip(NAMES, estimate.values.tolist(), strict=True)),
        "covariance": estimate.covariance,
        "correlation": estimate.correlation,
        "freedom": estimate.freedom,
        "longest_time_s": float(table.columns["time"].max()),
        "flagged": [{"row": int(table.rows[k]), "used": not options.without_flagged} for k in flagged],
    }


def _lines(estimate: Estimate, time: np.ndarray, asked: list[float]) -> list[str]:
    at = relaxed_angle(np.array([asked[-1]]), estimate.values)[0]
    return [
        f"measured from {time_text(float(time.min()))} to {time_text(float(time.max()))}",
        f'in a case, {time_text(asked[-1])} after release: crease.rest_angle = "{math.degrees(at):.4g} deg",'
        " if angles were measured from the flat sheet",
    ]


def _warnings(
    table: Table,
    estimate: Estimate,
    time: np.ndarray,
    angle: np.ndarray,
    repeats: np.ndarray,
    flagged: np.ndarray,
    options: Options,
) -> list[str]:
    warnings = list(table.notes)
    verb = "left out" if options.without_flagged else "used all the same; --without-flagged leaves it out"
    for k in flagged[:10]:
        where = f"angle {table.shown('angle', int(k))} at {table.shown('time', int(k))}"
        warnings.append(f"row {table.rows[k]}: outlier: {where} is far from its neighbours ({verb})")
    if len(flagged) > 10:
        warnings.append(f"and {len(flagged) - 10} more flagged rows; calibration.json has all")
    tau = math.exp(estimate.values[2])
    positive = time[time > 0.0]
    if tau < 0.1 * positive.min():
        what = f"all times are long against tau ({tau:.3g} s): A and the angle at measured times are known, theta_r0 and tau"
        warnings.append(f"{what} not apart; measure sooner after release")
    elif tau > positive.max():
        what = f"tau ({tau:.3g} s) is longer than the test ({positive.max():.3g} s): only the first slope A/tau is known"
        warnings.append(f"{what}; measure longer")
    if len(np.unique(repeats)) == 2:
        warnings.append("two creases say little of what creases differ by; the interval is of the scatter, watch a third")
    off = angle - relaxed_angle(time, estimate.values)
    share = 1.0 - float(off @ off) / float(np.sum((angle - angle.mean()) ** 2))
    if share < 0.5:
        warnings.append(f"the law explains {100 * share:.0f} % of the scatter of the angles only; look at relaxation.png")
    return warnings


def _plot(estimate: Estimate, time: np.ndarray, angle: np.ndarray, options: Options) -> FitPlot:
    positive = time > 0.0
    at = np.geomspace(time[positive].min(), time.max(), 200)
    gradient = _gradient(at, estimate.values)
    variance = np.einsum("ij,jk,ik->i", gradient, estimate.covariance, gradient)
    reach = estimate.quantile(options.level) * np.sqrt(np.maximum(variance, 0.0))
    curve = relaxed_angle(at, estimate.values)
    shown: Callable[[np.ndarray], np.ndarray] = np.degrees
    label = f"theta_r0 + A log(1 + t/tau), {100 * options.level:g} % band"
    curves = [(label, at, shown(curve), shown(curve - reach), shown(curve + reach))]
    return FitPlot(time[positive], shown(angle[positive]), curves, "time (s)", "rest angle (deg)", logarithmic=True)
