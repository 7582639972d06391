"""The kind "force": parameters of a case from force-displacement tests, and what they predict."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls
from scipy.stats import norm

from fsm.calibrate.band import Band, linear_band, sampled_band, widened
from fsm.calibrate.data import Table, read_table
from fsm.calibrate.identify import Identification, Measured, Parameter, Prior, identify
from fsm.calibrate.parameters import unit_of, value_at, with_values
from fsm.calibrate.report import Calibration, Options, quantities_of
from fsm.calibrate.respond import respond
from fsm.calibrate.study import Curve, Predict, Study, read_study
from fsm.calibrate.uncertainty import Estimate
from fsm.errors import CaseError, Fault
from fsm.kernels import jit
from fsm.plots.identification import TestPlot, plot_tests
from fsm.progress import Progress
from fsm.scene.case import Case
from fsm.scene.load_case import load_case, read_toml
from fsm.scene.units import to_si

__all__ = ["calibrate_force", "identification_of", "measured_curve", "misfit_part", "run_study"]

QUANTITIES = {"displacement": "length", "force": "force", "half_band": "force", "repeat": "number"}
_REWEIGHTED, _LEAST = 10, 1e-6
"""Rounds in which the variance of repeats is fitted, and the least part of its mean that is believed."""
_MOST_POINTS = 2000
"""Of one curve."""
_NOTHING = 1e-9
"""Part of the largest force that is round-off."""
_SEARCH = 0.7
"""Part of the work, for the bar, that the search takes where a band is sampled after it."""


def calibrate_force(data: Path, options: Options) -> Calibration:
    """Identify the parameters of a study file (docs/calibration.md, "force")."""
    study = read_study(data)
    with Progress(options.progress, 1.0, study.title or data.name, jit) as bar:
        return run_study(study, data, options, lambda fraction: bar.step(fraction, 0))


def run_study(
    study: Study, path: Path, options: Options, tell: Callable[[float], None] = lambda fraction: None
) -> Calibration:
    """Carry out a study that was read from `path`; arguments as of all kinds."""
    tests, parameters, priors = identification_of(study, path)
    part = _SEARCH if study.predict and study.predict.samples else 1.0
    found = identify(tests, parameters, priors, study.starts, options.seed, lambda done: tell(part * done))
    estimate = _of_parameters(found, len(parameters))
    bands = [
        widened(linear_band(response, estimate, options.level), np.full(len(response.travel), size), options.level)
        for response, size in zip(found.responses, found.discrepancy.tolist(), strict=True)
    ]
    files = [path.parent / study.case, *(path.parent / curve.data for curve in study.curve)]
    result = Calibration("force", (path, *files))
    names = found.estimate.names
    shown = [*(unit_of(tests[0].case, one.path) for one in parameters), *["N"] * (len(names) - len(parameters))]
    result.quantities = quantities_of(names, shown, found.estimate, options.level)
    result.numbers = _numbers(found, tests, bands)
    result.warnings = list(found.warnings)
    together = list(zip(tests, bands, found.added, strict=True))
    result.lines = [f"{test.name}: {_fitted(test, band, added)}" for test, band, added in together]
    drawn = [_drawn(test, band, added, options.level) for test, band, added in together]
    result.plots.append(("fit.png", partial(plot_tests, drawn)))
    if study.predict is not None:
        misfit = misfit_part(tests, found)
        _predict(
            result, study.predict, study, path, estimate, misfit, options, lambda done: tell(part + (1.0 - part) * done)
        )
    return result


def identification_of(study: Study, path: Path) -> tuple[list[Measured], list[Parameter], list[Prior]]:
    """Tests, parameters and priors of a study that was read from `path`, in SI.

    Raises
    ------
    CaseError
        Faults of the case, the data and the study.
    """
    tests = _tests(study, path)
    units = str(read_toml(path.parent / study.case).get("units", "SI"))
    parameters = [_parameter(one, number, tests[0].case, units, path) for number, one in enumerate(study.parameter)]
    return tests, parameters, [_prior(one, tests[0].case, units) for one in study.prior]


def _drawn(test: Measured, band: Band, added: np.ndarray, level: float) -> TestPlot:
    half = test.deviation * norm.ppf(0.5 + 0.5 * level) if test.known else None
    low, high = band.low + added, band.high + added
    return TestPlot(test.name, band.travel, band.force + added, low, high, test.force, half)


def _tests(study: Study, path: Path) -> list[Measured]:
    tests, faults = [], []
    for number, curve in enumerate(study.curve):
        case = load_case(path.parent / study.case, curve.set).case
        file = path.parent / curve.data
        table = read_table(file, QUANTITIES, ("displacement", "force"))
        try:
            tests.append(measured_curve(curve, case, table))
        except ValueError as error:
            faults.append(Fault(f"curve.{number}", f"{file}: {error}"))
    if faults:
        raise CaseError(faults, str(path))
    return tests


def measured_curve(curve: Curve, case: Case, table: Table) -> Measured:
    """A test with its mean curve and scatter."""
    travel, force = table.columns["displacement"], table.columns["force"]
    repeats = np.zeros((0, 0))
    if len(travel) < 2:
        raise ValueError("one row is no curve; give at least two")
    most = _MOST_POINTS * (len(np.unique(table.columns["repeat"])) if "repeat" in table.columns else 1)
    if len(travel) > most:
        text = f"every point of a curve is an equilibrium to solve; give {_MOST_POINTS} at most"
        raise ValueError(f"has {len(travel)} rows; {text}, say one row in {len(travel) // most + 1}")
    if "repeat" in table.columns:
        travel, force, deviation, repeats = _mean(travel, force, table.columns["repeat"])
        known = True
    elif "half_band" in table.columns:
        half = table.columns["half_band"]
        if half.min() <= 0.0:
            row = table.rows[int(np.argmin(half))]
            raise ValueError(f"row {row}: the half band is {half.min():g} N; it must be positive")
        deviation, known = half / norm.ppf(0.5 + 0.5 * curve.coverage), True
    else:
        deviation, known = np.ones(len(force)), False
    back = np.flatnonzero(np.diff(travel) <= 0.0)
    if len(back):
        row = table.rows[min(int(back[0]) + 1, len(table.rows) - 1)]
        text = "the displacement does not increase; give every test its own file, or a `repeat` column"
        raise ValueError(f"row {row}: {text}")
    return Measured(
        curve.name, case, travel, force, deviation, known, curve.alike, curve.zero, curve.drag, curve.drag_over, repeats
    )


def _mean(
    travel: np.ndarray, force: np.ndarray, repeat: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mean curve of repeats at the same displacements, the standard error of the mean, which weighs points, and all repeats.

    The variance of one repeat is a^2 + (b F)^2, with a and b from the sample variances of all points: that of a few repeats
    at one point says little.
    """
    numbers = np.unique(repeat)
    curves = [(travel[repeat == number], force[repeat == number]) for number in numbers]
    if len(curves) < 2:
        raise ValueError("the column `repeat` names one repeat only; it has no scatter, leave the column out")
    at = np.sort(curves[0][0])
    if any(len(x) != len(at) or not np.allclose(np.sort(x), at, rtol=1e-9, atol=0.0) for x, _ in curves):
        raise ValueError("repeats must have the same displacements; resample them")
    values = np.array([y[np.argsort(x)] for x, y in curves])
    mean = values.mean(axis=0)
    sampled = values.var(axis=0, ddof=1)
    variance, terms = np.full(len(at), sampled.mean()), np.column_stack([np.ones(len(at)), mean**2])
    for _ in range(_REWEIGHTED if sampled.mean() > 0.0 else 0):  # a sample variance scatters in proportion to itself
        share, _ = nnls(terms / variance[:, None], sampled / variance)
        variance = np.maximum(terms @ share, _LEAST * sampled.mean())
    if not np.all(variance > 0.0):
        raise ValueError("the repeats do not differ; leave the column `repeat` out")
    return at, mean, np.sqrt(variance / len(numbers)), values


def _parameter(one: Any, number: int, case: Case, units: str, path: Path) -> Parameter:
    value, unit = value_at(case, one.path), unit_of(case, one.path)
    numbers = {}
    for key in ("lower", "upper", "start"):
        given = getattr(one, key)
        try:
            numbers[key] = value if given is None else to_si(given, unit, units)
        except ValueError as error:
            raise CaseError(Fault(f"parameter.{number}.{key}", str(error)), str(path)) from None
    if not numbers["lower"] < numbers["upper"]:
        raise CaseError(Fault(f"parameter.{number}", f"lower = {one.lower} is not below upper = {one.upper}"), str(path))
    lower, upper, start = numbers["lower"], numbers["upper"], numbers["start"]
    return Parameter(one.path, lower, upper, min(max(start, lower), upper))


def _prior(one: Any, case: Case, units: str) -> Prior:
    scale = to_si(1.0, unit_of(case, one.above), units) / to_si(1.0, unit_of(case, one.below), units)
    reach = math.log(one.upper / one.lower)
    return Prior(one.above, one.below, scale * math.sqrt(one.lower * one.upper), reach / math.sqrt(12.0))


def _of_parameters(found: Identification, count: int) -> Estimate:
    """The estimate without what tests add."""
    whole = found.estimate
    return replace(
        whole, names=whole.names[:count], values=whole.values[:count], covariance=whole.covariance[:count, :count]
    )


def _numbers(found: Identification, tests: list[Measured], bands: list[Band]) -> dict[str, Any]:
    return {
        "correlation": found.estimate.correlation,
        "freedom": found.estimate.freedom,
        "discrepancy_N": {test.name: size for test, size in zip(tests, found.discrepancy.tolist(), strict=True)},
        "covariance": found.estimate.covariance,
        "cost": found.cost,
        "points": found.data,
        "starts": [{"start": start, "cost": cost, "end": end} for start, cost, end in found.starts],
        "curves": {
            test.name: {
                "displacement_m": test.travel, "measured_N": test.force, "deviation_N": test.deviation, "added_N": added,
                "fit_N": band.force + added, "low_N": band.low + added, "high_N": band.high + added,
            }
            for test, band, added in zip(tests, bands, found.added, strict=True)
        },
    }  # fmt: skip


def _fitted(test: Measured, band: Band, added: np.ndarray) -> str:
    off = np.abs(band.force + added - test.force)
    if not test.known:
        return f"fit off by {off.max():.3g} N at most, {np.sqrt(np.mean(off**2)):.3g} N in the mean square"
    worst = int(np.argmax(off / test.deviation))
    return (
        f"fit off by {off[worst] / test.deviation[worst]:.2g} standard deviations at most, {1e3 * test.travel[worst]:.4g} mm"
    )


def _predict(
    result: Calibration,
    wanted: Predict,
    study: Study,
    path: Path,
    estimate: Estimate,
    misfit: float,
    options: Options,
    tell: Callable[[float], None],
) -> None:
    """Add a prediction with its band; `misfit` is that of the model's form in the tests, as a part of the force."""
    values = dict(zip(estimate.names, estimate.values.tolist(), strict=True))
    case = with_values(load_case(path.parent / study.case, wanted.set).case, values)
    travel = np.linspace(0.0, value_at(case, "drive.0.travel"), wanted.points)
    response = respond(case, travel, list(estimate.names))
    linear = linear_band(response, estimate, options.level)
    band = linear
    if wanted.samples:
        band = sampled_band(case, response, estimate, options.level, wanted.samples, options.seed, tell=tell)
    test = Measured(
        wanted.name, case, travel, band.force, np.ones(len(travel)),
        zero=wanted.zero, drag=wanted.drag, drag_over=wanted.drag_over,
    )  # fmt: skip
    form = misfit * float(np.sqrt(np.mean(band.force**2)))
    deviation = np.sqrt(sum(((size * shape) ** 2 for _, shape, size in test.extras), np.full(len(travel), form**2)))
    band = widened(band, deviation, options.level)
    result.numbers["prediction"] = {
        "name": wanted.name, "displacement_m": band.travel, "force_N": band.force, "low_N": band.low, "high_N": band.high,
        "linear_low_N": linear.low, "linear_high_N": linear.high, "peak_N": band.peak, "samples": band.samples,
        "lost": band.lost, "misfit": misfit,
    }  # fmt: skip
    value, low, high = band.peak
    result.lines.append(
        f"{wanted.name}: the band holds the scatter of the tests and the misfit of the model in them "
        f"({100 * misfit:.2g} % of the force); it leaves out errors of the model that only this loading brings about"
    )
    result.lines.append(f"{wanted.name}: peak {value:.4g} N, {100 * options.level:g} % interval {low:.4g} to {high:.4g} N")
    result.plots.append(("prediction.png", partial(plot_tests, [
        TestPlot(wanted.name, band.travel, band.force, band.low, band.high, None, None)])))  # fmt: skip
    result.files.append(("prediction.csv", partial(_write_prediction, band)))


def misfit_part(tests: list[Measured], found: Identification) -> float:
    """Misfit of the model's form over the force, root mean square over all tests."""
    parts = [size**2 / np.mean(test.force**2) for test, size in zip(tests, found.discrepancy.tolist(), strict=True)]
    return float(np.sqrt(np.mean(parts)))


def _write_prediction(band: Band, path: Path) -> None:
    rows = np.column_stack([1e3 * band.travel, band.force, band.low, band.high])
    rows[np.abs(rows) < _NOTHING * np.abs(rows).max(axis=0)] = 0.0
    np.savetxt(path, rows, fmt="%.6g", delimiter=",", header="displacement_mm,force_N,low_N,high_N", comments="")
