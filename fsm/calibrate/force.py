"""Calibration of the kind "force": parameters of a case from force-displacement tests, and predictions with them."""

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

from fsm.calibrate import study as study_file
from fsm.calibrate.band import Band, linear_band, sampled_band, widen_band
from fsm.calibrate.data import MeasuredTable, read_table
from fsm.calibrate.identify import ForceTest, Identification, Parameter, Prior, identify
from fsm.calibrate.report import Calibration, Options, quantities_of
from fsm.calibrate.response import force_response
from fsm.calibrate.study import MeasuredCurve, Predict, Study, StudyParameter, StudyPrior, Value
from fsm.calibrate.uncertainty import Estimate
from fsm.case.loading.load_case import load_case
from fsm.case.loading.toml_file import read_toml
from fsm.case.models.case import Case
from fsm.case.schema.units import to_si
from fsm.errors import CaseError, Fault, fault_at
from fsm.kernels import jit
from fsm.run.progress import Progress
from fsm.views.plots.calibration import TestPlot, plot_tests

QUANTITIES = {"displacement": "length", "force": "force", "half_band": "force", "repeat": "number"}
_REWEIGHTINGS, _MIN_VARIANCE = 10, 1e-6
"""Iterations of the fit of the variance of repeats, and the lower bound of the variance as a fraction of its mean."""
_MAX_POINTS = 2000
"""Largest number of points of one curve."""
_ROUND_OFF = 1e-9
"""Round-off of a predicted force, as a fraction of the largest force."""
_SEARCH_PART = 0.7
"""Share of the search in the progress bar of a study with a sampled band."""


def calibrate_force(data: Path, options: Options) -> Calibration:
    """Identify the parameters of a study file (docs/calibration.md, "force").

    Raises
    ------
    CaseError
        The study, its case or its data have faults.
    FsmError
        The model cannot be solved at any starting point of the fit, or too many Monte Carlo samples fail.
    """
    study = study_file.read_study(data)
    with Progress(options.progress, 1.0, study.title or data.name, jit) as bar:
        return run_study(study, data, options, lambda fraction: bar.step(fraction, 0))


def run_study(
    study: Study, path: Path, options: Options, report_progress: Callable[[float], None] = lambda fraction: None
) -> Calibration:
    """Identify the parameters of a study that was read from `path`, and compute its prediction.

    `report_progress` is called with the completed fraction of the work. The function raises the errors of `calibrate_force`.
    """
    tests, parameters, priors = read_tests(study, path)
    part = _SEARCH_PART if study.predict and study.predict.samples else 1.0
    found = identify(tests, parameters, priors, study.starts, options.seed, lambda done: report_progress(part * done))
    estimate = _parameter_estimate(found, len(parameters))
    bands = [
        widen_band(linear_band(response, estimate, options.level), np.full(len(response.travel), size), options.level)
        for response, size in zip(found.responses, found.discrepancy.tolist(), strict=True)
    ]
    files = [path.parent / study.case, *(path.parent / curve.data for curve in study.curve)]
    result = Calibration("force", (path, *files))
    names = found.estimate.names
    units = [*(study_file.unit_of(tests[0].case, one.path) for one in parameters), *["N"] * (len(names) - len(parameters))]
    result.quantities = quantities_of(names, units, found.estimate, options.level)
    result.numbers = _numbers(found, tests, bands)
    result.warnings = list(found.warnings)
    fits = list(zip(tests, bands, found.added, strict=True))
    result.lines = [f"{test.name}: {_fit_text(test, band, added)}" for test, band, added in fits]
    plots = [_test_plot(test, band, added, options.level) for test, band, added in fits]
    result.plots.append(("fit.png", partial(plot_tests, plots)))
    if study.predict is not None:
        misfit = relative_misfit(tests, found)
        left_out = left_out_errors(tests, parameters, priors, found, options.seed) if study.predict.leave_out else {}
        _predict(
            result, study.predict, study, path, estimate, misfit, left_out, options,
            lambda done: report_progress(part + (1.0 - part) * done),
        )  # fmt: skip
    return result


def read_tests(study: Study, path: Path) -> tuple[list[ForceTest], list[Parameter], list[Prior]]:
    """Tests, parameters and priors of a study that was read from `path`, in SI units.

    Raises
    ------
    CaseError
        The case, the data or the study have faults.
    """
    tests = _tests(study, path)
    units = str(read_toml(path.parent / study.case).get("units", "SI"))
    parameters = [_parameter(one, number, tests[0].case, units, path) for number, one in enumerate(study.parameter)]
    return tests, parameters, [_prior(one, number, tests[0].case, units, path) for number, one in enumerate(study.prior)]


def _test_plot(test: ForceTest, band: Band, added: np.ndarray, level: float) -> TestPlot:
    half_band = test.deviation * norm.ppf(0.5 + 0.5 * level) if test.known else None
    low, high = band.low + added, band.high + added
    return TestPlot(test.name, band.travel, band.force + added, low, high, test.force, half_band, level)


def _tests(study: Study, path: Path) -> list[ForceTest]:
    tests, faults = [], []
    for number, curve in enumerate(study.curve):
        case = load_case(path.parent / study.case, curve.set).case
        file = path.parent / curve.data
        table = read_table(file, QUANTITIES, ("displacement", "force"))
        try:
            tests.append(force_test(curve, case, table))
        except ValueError as error:
            faults.append(Fault(f"curve.{number}", f"{file}: {error}"))
    if faults:
        raise CaseError(faults, str(path))
    return tests


def force_test(curve: MeasuredCurve, case: Case, table: MeasuredTable) -> ForceTest:
    """Test with its mean curve and scatter.

    Raises
    ------
    ValueError
        The rows of the table do not form a curve.
    """
    travel, force = table.columns["displacement"], table.columns["force"]
    repeats = np.zeros((0, 0))
    if len(travel) < 2:
        raise ValueError(f"has {len(travel)} row; a curve needs at least 2")
    limit = _MAX_POINTS * (len(np.unique(table.columns["repeat"])) if "repeat" in table.columns else 1)
    if len(travel) > limit:
        text = f"has {len(travel)} rows; at most {limit} are allowed, because every point requires an equilibrium"
        raise ValueError(f"{text}; keep, for example, one row in {len(travel) // limit + 1}")
    if "repeat" in table.columns:
        travel, force, deviation, repeats = _mean_curve(travel, force, table.columns["repeat"])
        known = True
    elif "half_band" in table.columns:
        half = table.columns["half_band"]
        if half.min() <= 0.0:
            row = table.rows[int(np.argmin(half))]
            raise ValueError(f"row {row}: half_band is {half.min():g} N; it must be greater than 0")
        deviation, known = half / norm.ppf(0.5 + 0.5 * curve.coverage), True
    else:
        deviation, known = np.ones(len(force)), False
    back = np.flatnonzero(np.diff(travel) <= 0.0)
    if len(back):
        row = table.rows[min(int(back[0]) + 1, len(table.rows) - 1)]
        text = "the displacement does not increase; give every test its own file, or a `repeat` column"
        raise ValueError(f"row {row}: {text}")
    return ForceTest(
        curve.name, case, travel, force, deviation, known, curve.alike, curve.zero, curve.drag, curve.drag_over, repeats
    )


def _mean_curve(
    travel: np.ndarray, force: np.ndarray, repeat: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Travel, mean force, standard error of the mean, and forces of all repeats; repeats share their displacements.

    The variance of one repeat is modelled as a^2 + (b F)^2, fitted to the sample variances of all points.
    The sample variance at a single point is too uncertain with few repeats.
    """
    numbers = np.unique(repeat)
    curves = [(travel[repeat == number], force[repeat == number]) for number in numbers]
    if len(curves) < 2:
        raise ValueError("the column `repeat` has a single number, so there is no scatter; delete the column")
    at = np.sort(curves[0][0])
    if any(len(x) != len(at) or not np.allclose(np.sort(x), at, rtol=1e-9, atol=0.0) for x, _ in curves):
        raise ValueError("the repeats have different displacements; resample them to the same ones")
    values = np.array([y[np.argsort(x)] for x, y in curves])
    mean = values.mean(axis=0)
    sampled = values.var(axis=0, ddof=1)
    variance, terms = np.full(len(at), sampled.mean()), np.column_stack([np.ones(len(at)), mean**2])
    # the weights are 1/variance, because the standard error of a sample variance is proportional to the variance
    for _ in range(_REWEIGHTINGS if sampled.mean() > 0.0 else 0):
        share, _ = nnls(terms / variance[:, None], sampled / variance)
        variance = np.maximum(terms @ share, _MIN_VARIANCE * sampled.mean())
    if not np.all(variance > 0.0):
        raise ValueError("the repeats do not differ, so there is no scatter; delete the column `repeat`")
    return at, mean, np.sqrt(variance / len(numbers)), values


def _parameter(one: StudyParameter, number: int, case: Case, units: str, path: Path) -> Parameter:
    value, unit = study_file.value_at(case, one.path), study_file.unit_of(case, one.path)
    lower, upper = _bounds(one, unit, units, f"parameter.{number}", path)
    start = value if one.start is None else _in_si(one.start, unit, units, f"parameter.{number}.start", path)
    return Parameter(one.path, lower, upper, min(max(start, lower), upper))


def _prior(one: StudyPrior, number: int, case: Case, units: str, path: Path) -> Prior:
    place = f"prior.{number}"
    lower, upper = _bounds(one, study_file.unit_of(case, one.above), units, place, path)
    if lower <= 0.0:
        raise CaseError(Fault(f"{place}.lower", f"is {one.lower}; the bounds of a prior must be greater than 0"), str(path))
    scale = to_si(1.0, study_file.unit_of(case, one.below), units) if one.below else 1.0
    return Prior(one.above, one.below, math.sqrt(lower * upper) / scale, math.log(upper / lower) / math.sqrt(12.0))


def _bounds(one: StudyParameter | StudyPrior, unit: str, units: str, place: str, path: Path) -> tuple[float, float]:
    """Bounds in SI units."""
    lower, upper = (_in_si(getattr(one, key), unit, units, f"{place}.{key}", path) for key in ("lower", "upper"))
    if not lower < upper:
        raise CaseError(Fault(place, f"lower = {one.lower} is not below upper = {one.upper}"), str(path))
    return lower, upper


def _in_si(value: Value, unit: str, units: str, place: str, path: Path) -> float:
    with fault_at(place, str(path)):
        return to_si(value, unit, units)


def _parameter_estimate(found: Identification, count: int) -> Estimate:
    """Estimate of the parameters alone, without zero errors and drags."""
    full = found.estimate
    return replace(full, names=full.names[:count], values=full.values[:count], covariance=full.covariance[:count, :count])


def _numbers(found: Identification, tests: list[ForceTest], bands: list[Band]) -> dict[str, Any]:
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


def _fit_text(test: ForceTest, band: Band, added: np.ndarray) -> str:
    residual = np.abs(band.force + added - test.force)
    if not test.known:
        return f"residual of the fit at most {residual.max():.3g} N, root mean square {np.sqrt(np.mean(residual**2)):.3g} N"
    worst = int(np.argmax(residual / test.deviation))
    multiple = residual[worst] / test.deviation[worst]
    return f"residual of the fit at most {multiple:.2g} standard deviations, at {1e3 * test.travel[worst]:.4g} mm"


def _predict(
    result: Calibration,
    request: Predict,
    study: Study,
    path: Path,
    estimate: Estimate,
    misfit: float,
    left_out: dict[str, float],
    options: Options,
    report_progress: Callable[[float], None],
) -> None:
    """Add a prediction with its band to the result.

    `misfit` is the relative model discrepancy in the tests, and `left_out` the result of `left_out_errors`.
    """
    values = dict(zip(estimate.names, estimate.values.tolist(), strict=True))
    case = study_file.with_values(load_case(path.parent / study.case, request.set).case, values)
    travel = np.linspace(0.0, study_file.value_at(case, "drive.0.travel"), request.points)
    response = force_response(case, travel, list(estimate.names))
    linear = linear_band(response, estimate, options.level)
    band = linear
    if request.samples:
        band = sampled_band(
            case, response, estimate, options.level, request.samples, options.seed, report_progress=report_progress
        )
    test = ForceTest(
        request.name, case, travel, band.force, np.ones(len(travel)),
        zero=request.zero, drag=request.drag, drag_over=request.drag_over,
    )  # fmt: skip
    discrepancy = misfit * float(np.sqrt(np.mean(band.force**2)))
    added = [(size * shape) ** 2 for _, shape, size in test.added_forces]
    if left_out:
        transfer = float(np.sqrt(np.mean(np.square(list(left_out.values())))))
        added.append((transfer * band.force) ** 2)
        each = ", ".join(f"{name} {100 * size:.2g} %" for name, size in left_out.items())
        result.lines.append(
            f"{request.name}: the band includes the error of the model for a new loading, {100 * transfer:.2g} % of the "
            f"force; error of each test predicted from the others, beyond its scatter: {each}"
        )
    band = widen_band(band, np.sqrt(sum(added, np.full(len(travel), discrepancy**2))), options.level)
    result.numbers["prediction"] = {
        "name": request.name, "displacement_m": band.travel, "force_N": band.force, "low_N": band.low, "high_N": band.high,
        "linear_low_N": linear.low, "linear_high_N": linear.high, "peak_N": band.peak, "samples": band.samples,
        "lost": band.failed, "misfit": misfit, "left_out": left_out,
    }  # fmt: skip
    value, low, high = band.peak
    result.lines.append(
        f"{request.name}: the band includes the scatter of the tests and their model discrepancy "
        f"({100 * misfit:.2g} % of the force); it excludes model errors that occur only under this loading"
    )
    result.lines.append(f"{request.name}: peak {value:.4g} N, {100 * options.level:g} % interval {low:.4g} to {high:.4g} N")
    result.plots.append(("prediction.png", partial(plot_tests, [
        TestPlot(request.name, band.travel, band.force, band.low, band.high, None, None, options.level)])))  # fmt: skip
    result.files.append(("prediction.csv", partial(_write_prediction, band)))


def relative_misfit(tests: list[ForceTest], found: Identification) -> float:
    """Root mean square of the model discrepancy relative to the force, over all tests."""
    parts = [size**2 / np.mean(test.force**2) for test, size in zip(tests, found.discrepancy.tolist(), strict=True)]
    return float(np.sqrt(np.mean(parts)))


def left_out_errors(
    tests: list[ForceTest], parameters: list[Parameter], priors: list[Prior], whole: Identification, seed: int = 0
) -> dict[str, float]:
    """Error of every test predicted from the other tests, relative to its force (root mean square along the curve).

    The variances of the test itself (scatter, zero error, drag) are subtracted; the result is at least 0. The uncertainty of
    parameters that the other tests determine badly counts as an error. The search begins at the fit to all tests, `whole`.
    """
    values = dict(zip(whole.estimate.names, whole.estimate.values.tolist(), strict=True))
    begun = [replace(one, start=min(max(values[one.path], one.lower), one.upper)) for one in parameters]
    errors = {}
    for test in tests:
        found = identify([other for other in tests if other is not test], begun, priors, 1, seed)
        fitted = dict(zip(found.estimate.names, found.estimate.values.tolist(), strict=True))
        case = study_file.with_values(test.case, {one.path: fitted[one.path] for one in parameters})
        error = force_response(case, test.travel).force - test.force
        own = sum(((size * shape) ** 2 for _, shape, size in test.added_forces), np.zeros(len(error)))
        scatter = test.scatter()
        own += np.diag(scatter) if scatter is not None else 0.0
        errors[test.name] = math.sqrt(max(float(np.mean(error**2 - own) / np.mean(test.force**2)), 0.0))
    return errors


def _write_prediction(band: Band, path: Path) -> None:
    rows = np.column_stack([1e3 * band.travel, band.force, band.low, band.high])
    rows[np.abs(rows) < _ROUND_OFF * np.abs(rows).max(axis=0)] = 0.0
    np.savetxt(path, rows, fmt="%.6g", delimiter=",", header="displacement_mm,force_N,low_N,high_N", comments="")
