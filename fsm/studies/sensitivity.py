"""Derivatives of a response with respect to numbers of a case.

Exact derivatives of the peak force follow from implicit differentiation of the equilibrium path, see
`fsm.calibrate.sensitivity`, and those of motions from the variational equations, see `fsm.studies.motion_derivatives`.
Where there are none, the response is differentiated by central differences of complete runs with two steps h
and 2h: D = (4 D(h) - D(2h))/3, with the error estimate |D(h) - D(2h)|/3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from fsm.calibrate.response import PathStates, PeakResponse, peak_of_run
from fsm.case.loading.model_file import read_file
from fsm.case.models.case import Case
from fsm.case.models.study import StudyFile, StudyResponse
from fsm.errors import CaseError, Fault, FsmError
from fsm.studies.motion_derivatives import STEP_OF_MOTION, derivatives_of_motion, motion_response
from fsm.studies.problem import Problem, Run, case_problem, evaluate, nominal_value, run_all
from fsm.studies.scatter import correlation_matrix, scatter_of

STEP = 0.01
"""Smaller step h of differences, relative to the value of the parameter."""
PEAK = "peak_force"
"""Response with exact derivatives."""
_SAME = 1e-6
"""Largest relative difference between the peak of the states and that of the summary, which may be on another path."""
_QUANTILES = np.linspace(0.0005, 0.9995, 1000)


@dataclass(frozen=True)
class Derivative:
    """Derivative with respect to one number.

    Attributes
    ----------
    path, unit : path of the number and its SI unit
    value : SI
    slope : SI unit of the response per SI unit of the number
    exact : whether the slope comes from the equilibrium path or the equations of motion, else from differences of runs
    error : estimated error of the slope; 0 if exact
    sigma : standard deviation of the number, SI; None if it is not known
    """

    path: str
    unit: str
    value: float
    slope: float
    exact: bool
    error: float = 0.0
    sigma: float | None = None


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of one response.

    Attributes
    ----------
    name, unit : response and its SI unit
    value : SI
    derivatives : tuple of Derivative
    correlation : (p, p) array
        Correlation of the numbers.
    warnings : tuple of str
    """

    name: str
    unit: str
    value: float
    derivatives: tuple[Derivative, ...]
    correlation: np.ndarray
    warnings: tuple[str, ...] = ()

    def __getitem__(self, path: str) -> Derivative:
        """Derivative with respect to the number at a path."""
        for one in self.derivatives:
            if one.path == path:
                return one
        raise KeyError(path)

    def elasticity(self, one: Derivative) -> float:
        """Change of the response in per cent for a change of the number by one per cent."""
        return one.slope * one.value / self.value if self.value else float("nan")

    def deviation(self) -> float | None:
        """Standard deviation of the response by first-order propagation; None if the scatter of a number is not known."""
        if any(one.sigma is None for one in self.derivatives):
            return None
        parts = np.array([one.slope * (one.sigma or 0.0) for one in self.derivatives])
        return float(np.sqrt(max(parts @ self.correlation @ parts, 0.0)))


def sensitivity(
    tables: Mapping[str, Any],
    file: Path,
    of: str = "peak_force",
    by: Sequence[str] = (),
    changes: Sequence[str] = (),
    study: Path | None = None,
    workers: int | None = None,
) -> Sensitivity:
    """Derivatives of a response of a case.

    Parameters
    ----------
    tables : tables of the case as read from TOML
    file : case file
    of : number of the summary; `max of CHANNEL` or `min of CHANNEL` for the extreme of a channel
    by : paths of numbers; default: the parameters of the study
    changes : ``"path=value"`` texts
    study : study file with the scatter of the numbers; its changes of the case come before the others
    workers : number of processes for differences

    Raises
    ------
    CaseError
        A path has no number, the case has no such response, or the study has faults.
    FsmError
        The run of the case itself, or one of its differences, failed.
    """
    file_of_study = read_file(study, StudyFile) if study is not None else None
    if file_of_study is not None:
        changes = [*file_of_study.set, *changes]
    paths = list(dict.fromkeys(by or [one.path for one in file_of_study.parameter] if file_of_study else by))
    if not paths:
        raise CaseError("name the numbers to differentiate by, for example --by strip.thickness,crease.stiffness", str(file))
    problem, base = case_problem(tables, file, changes, paths, (response_named(of),), str(file))
    nominal = {path: nominal_value(problem, base, path) for path in paths}
    for path, value in nominal.items():
        if value is None:
            raise CaseError(Fault(path, "the case has no number there; add it, or correct the path"), str(file))
        if path in problem.whole:
            raise CaseError(
                Fault(path, f"is {value:g}, a whole number; only continuous numbers have derivatives"), str(file)
            )
    values = {path: float(value) for path, value in nominal.items() if value is not None}
    states = PathStates()
    summary: dict[str, Any] = {}
    run = evaluate(problem, {}, base, states.add if of == PEAK else None, summary.update)
    key = problem.responses[0].key
    warnings = []
    if run.snaps:
        warnings.append(
            f"the structure snaps {run.snaps} times; near a snap the response may jump, and its derivative says nothing"
        )
    slopes, why = _exact(base.case, of, paths, states, run, warnings)
    if of != PEAK:
        slopes, why = _of_motion(problem, base.case, of, values, summary, warnings)
    left = [path for path in paths if path not in slopes]
    if left:
        warnings.append(f"differences of runs in place of exact derivatives{': ' + why if why else ''}")
    found = _differences(problem, key, values, left, run, workers, why) if left else {}
    sigmas, correlation = _scatter(file_of_study, study, problem, nominal, paths)
    derivatives = tuple(
        Derivative(
            path, problem.units[path], values[path], slopes[path] if path in slopes else found[path][0], path in slopes,
            0.0 if path in slopes else found[path][1], sigmas.get(path),
        )
        for path in paths
    )  # fmt: skip
    return Sensitivity(key, run.units[key], run.responses[key], derivatives, correlation, tuple(warnings))


def response_named(name: str) -> StudyResponse:
    """Response of the command line: a number of the summary, or `max of CHANNEL`."""
    extreme, of, channel = name.partition(" of ")
    if of and extreme in ("max", "min"):
        return StudyResponse(channel=channel, of=extreme)
    return StudyResponse(name=name)


def differentiated_peak(problem: Problem, values: Mapping[str, float], paths: Sequence[str]) -> tuple[Run, np.ndarray]:
    """Run at values (SI) of the varied paths, and exact derivatives (p,) of its peak force; NaN if the peak is at a snap.

    Raises
    ------
    CaseError
        The case has no such derivatives.
    NotConverged
        The run failed.
    """
    states = PathStates()
    loaded = problem.case(values)
    run = evaluate(problem, values, loaded, states.add)
    return run, np.asarray(_peak(loaded.case, states, paths, run).gradient)


def _peak(case: Case, states: PathStates, paths: Sequence[str], run: Run) -> PeakResponse:
    peak = peak_of_run(case, states, list(paths))
    value = run.responses.get(PEAK, peak.force)
    if abs(peak.force - value) > _SAME * abs(value):
        raise CaseError(Fault("drive", f"the equilibrium path has a peak of {peak.force:.5g} N, the run of {value:.5g} N"))
    return peak


def _exact(
    case: Case, of: str, paths: Sequence[str], states: PathStates, run: Run, warnings: list[str]
) -> tuple[dict[str, float], str]:
    """Exact derivatives by path, as far as there are any, and the reason for those that are missing."""
    if of != PEAK:
        return {}, ""
    try:
        peak = _peak(case, states, paths, run)
    except CaseError as error:
        return {}, "; ".join(str(fault) for fault in error.faults)
    except FsmError as error:
        return {}, str(error)
    warnings += peak.warnings
    slopes = dict(zip(paths, np.asarray(peak.gradient).tolist(), strict=True))
    slopes = {path: slope for path, slope in slopes.items() if np.isfinite(slope)}
    if not slopes and not peak.without:
        warnings.append("the peak is at a snap, where the force has no derivative")
    return slopes, "; ".join(map(str, peak.without)) or "the peak is at a snap"


def _of_motion(
    problem: Problem, case: Case, of: str, values: Mapping[str, float], summary: Mapping[str, Any], warnings: list[str]
) -> tuple[dict[str, float], str]:
    """Derivatives of a response of a motion by path, and the reason if there are none; warnings are appended."""
    found = motion_response(of, summary)
    if found is None:
        return {}, "only the peak force, and in motions the latch time and channels except reactions, have exact derivatives"
    steps = {path: STEP_OF_MOTION * (abs(value) or 1.0) for path, value in values.items()}
    try:
        cases = [problem.case({path: values[path] + step}).case for path, step in steps.items()]
        slopes = derivatives_of_motion(case, cases, list(steps.values()), *found, warnings)
    except CaseError as error:
        return {}, "; ".join(str(fault) for fault in error.faults)
    except FsmError as error:
        return {}, str(error)
    return dict(zip(values, slopes.tolist(), strict=True)), ""


def _differences(
    problem: Problem, key: str, values: Mapping[str, float], paths: Sequence[str], run: Run, workers: int | None,
    why: str,
) -> dict[str, tuple[float, float]]:
    """Slopes and their errors from runs with two steps to either side; `why` there are no exact ones.

    Raises
    ------
    FsmError
        A run failed.
    """
    steps = {path: STEP * (abs(values[path]) or 1.0) for path in paths}
    points = [{path: values[path] + k * steps[path]} for path in paths for k in (-2, -1, 1, 2)]
    responses = np.full(len(points), np.nan)
    for number, other, error in run_all(problem, points, workers):
        if other is None:
            ((path, value),) = points[number].items()
            text = f"{path} = {value:.6g} {problem.units[path]}: {error}; this number has no difference of runs"
            raise FsmError(f"{text}, and no exact derivative: {why}" if why else text)
        responses[number] = other.responses[key]
    found = {}
    for path, (far_less, less, more, far_more) in zip(paths, responses.reshape(-1, 4), strict=True):
        near, far = (more - less) / (2.0 * steps[path]), (far_more - far_less) / (4.0 * steps[path])
        found[path] = (float((4.0 * near - far) / 3.0), float(abs(near - far) / 3.0))
    return found


def _scatter(
    file: StudyFile | None, study: Path | None, problem: Problem, nominal: Mapping[str, float | None], paths: Sequence[str]
) -> tuple[dict[str, float], np.ndarray]:
    """Standard deviations by path and the correlation of the numbers from a study."""
    if file is None or study is None:
        return {}, np.eye(len(paths))
    own = [one for one in file.parameter if one.path in paths]
    try:
        scatters = [scatter_of(one, k, problem, nominal[one.path], file.level, study.parent) for k, one in enumerate(own)]
        pairs = [pair for pair in file.correlation if all(path in paths for path in pair.between)]
        among = correlation_matrix(own, pairs, study.parent)
    except CaseError as error:
        raise CaseError(error.faults, error.source or str(study)) from None
    correlation, order = np.eye(len(paths)), [paths.index(one.path) for one in own]
    correlation[np.ix_(order, order)] = among
    return {one.path: float(np.std(one.quantile(_QUANTILES))) for one in scatters}, correlation


def sensitivity_lines(found: Sensitivity) -> list[str]:
    """Lines for the terminal, the largest effect first."""
    lines = [f"{found.name} = {found.value:.6g} {found.unit}".rstrip()]
    order = sorted(found.derivatives, key=lambda one: -abs(one.slope * (one.sigma or one.value)))
    width = max(len(one.path) for one in found.derivatives)
    for one in order:
        text = f"{one.path:{width}}  {found.elasticity(one):+8.4f} % for 1 % ({one.slope:+.6g} {_per(found.unit, one.unit)})"
        text += f", {one.slope * one.sigma:+.4g} {found.unit} for its scatter" if one.sigma is not None else ""
        text += ", exact" if one.exact else f", differences, error {abs(one.error / one.slope) if one.slope else 0.0:.1g}"
        lines.append(text)
    deviation = found.deviation()
    if deviation is not None:
        half = float(stats.norm.ppf(0.975)) * deviation
        low, high = found.value - half, found.value + half
        lines.append(
            f"first-order scatter of {found.name}: standard deviation {deviation:.4g} {found.unit}, "
            f"95 % band {low:.5g} to {high:.5g} {found.unit}"
        )
    return [*lines, *(f"warning: {text}" for text in found.warnings)]


def _per(response: str, number: str) -> str:
    """Unit of a slope."""
    return f"{response or '1'} per {number}" if number else response


def draw_sensitivity(found: Sensitivity, path: Path) -> None:
    """Draw a tornado: changes of the response for the scatter of each number, or for one per cent of it."""
    from fsm.views.plots.studies import plot_tornado

    known = all(one.sigma is not None for one in found.derivatives)
    sizes = np.array(
        [one.slope * (one.sigma if known and one.sigma else 0.01 * abs(one.value)) for one in found.derivatives]
    )
    ends = found.value + np.column_stack([-sizes, sizes])
    note = "linear, for one standard deviation" if known else "linear, for 1 % of each number"
    plot_tornado(path, [one.path for one in found.derivatives], [(found.name, found.unit, found.value, ends)], note)
