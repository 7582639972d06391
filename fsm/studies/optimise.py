"""Best values of numbers of a case under bounds and constraints.

SLSQP (Kraft 1988) with exact derivatives, if all responses have them: the peak force of strips, lattices and rigid sheets,
and the mass. Else COBYQA (Ragonneau 2022), which needs no derivatives and few runs. Both are those of SciPy.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from fsm.case.loading.model_file import read_file
from fsm.case.loading.toml_file import read_text, read_toml
from fsm.case.models.study import Constraint, OptimiseFile, StudyResponse
from fsm.case.schema.units import to_si
from fsm.errors import CaseError, Fault, FsmError, NotConverged, fault_at
from fsm.io.folder_lock import ENDING, locked_folder
from fsm.io.json_values import finite_values
from fsm.io.provenance import provenance
from fsm.studies.problem import MASS, Problem, case_problem, function_problem, mass_of, nominal_value, si_value
from fsm.studies.search import EnoughRuns, Journal, Search
from fsm.studies.sensitivity import differentiated_peak

REPORT = "optimise.json"
"""File with the result."""
_EXACT = ("peak_force", MASS)
"""Responses with derivatives."""
_MASS_STEP = 1e-4
"""Step of the differences of the mass, relative to the range of a variable."""


@dataclass(frozen=True)
class Optimum:
    """Result of an optimisation.

    Attributes
    ----------
    values : dict of float, SI
    responses : dict of float, SI
    search : Search
        All runs.
    method : "SLSQP" or "COBYQA"
    kept : whether all constraints are kept within the tolerance
    message : end of the search in words
    """

    values: dict[str, float]
    responses: dict[str, float]
    search: Search
    method: str
    kept: bool
    message: str


@dataclass
class _Task:
    """Functions of the search in variables from 0 to 1."""

    file: OptimiseFile
    search: Search
    low: np.ndarray
    high: np.ndarray
    start: np.ndarray
    bounds: list[tuple[float, float]]
    """Bounds of each constraint, SI."""
    scale: float = 1.0

    def values(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self.low + np.clip(x, 0.0, 1.0) * (self.high - self.low))

    def responses(self, x: np.ndarray) -> dict[str, float] | None:
        run = self.search.run(self.values(x).tolist())
        return None if run is None else run.responses

    def sign(self) -> float:
        return -1.0 if self.file.objective.goal == "maximise" else 1.0

    def objective(self, x: np.ndarray) -> float:
        found = self.responses(x)
        if found is None:  # worse than all others, so that a search without derivatives avoids it
            known = self.search.response(self.file.objective.key)
            known = known[np.isfinite(known)]
            return float(np.max(self.sign() * known, initial=0.0) / self.scale + 1.0)
        return self.sign() * found[self.file.objective.key] / self.scale

    def excess(self, found: dict[str, float]) -> np.ndarray:
        """Relative amounts by which constraints are missed, 0 if they are kept."""
        missed = []
        for one, (low, high) in zip(self.file.constraint, self.bounds, strict=True):
            value, size = found[one.key], _size(low, high)
            missed.append(max(low - value, value - high, 0.0) / size)
        return np.array(missed)

    def constraints(self, x: np.ndarray) -> np.ndarray:
        """Constrained responses, relative to the sizes of their bounds; of a failed run far outside."""
        found = self.responses(x)
        rows = []
        for one, (low, high) in zip(self.file.constraint, self.bounds, strict=True):
            size = _size(low, high)
            far = (low - size if np.isfinite(low) else high + size) / size
            rows.append(far if found is None else found[one.key] / size)
        return np.array(rows)


def _size(low: float, high: float) -> float:
    sizes = [abs(end) for end in (low, high) if np.isfinite(end) and end != 0.0]
    return max(sizes, default=1.0)


def optimise(
    path: str | Path, out: str | Path, changes: Sequence[str] = (), resume: bool = False, progress: bool = True
) -> Optimum:
    """Optimise a case as a file describes it.

    Parameters
    ----------
    path : file of the optimisation
    out : folder for the history, the result and the case with the best values
    changes : ``"path=value"`` texts
    resume : whether to use finished runs in `out`
    progress : whether to print a line for each run on standard error

    Raises
    ------
    CaseError
        The file or its case have faults.
    NotConverged
        No run keeps all constraints.
    """
    path, out = Path(path), Path(out)
    file = read_file(path, OptimiseFile)
    paths = [one.path for one in file.variable]
    own = {
        one.key: StudyResponse(name=one.name, channel=one.channel, of=one.of) for one in (file.objective, *file.constraint)
    }
    base = None
    if file.case is not None:
        case = path.parent / file.case
        problem, base = case_problem(read_toml(case), case, [*file.set, *changes], paths, tuple(own.values()), str(path))
        if problem.whole:
            raise CaseError(
                Fault(problem.whole[0], "has whole numbers; only continuous numbers can be optimised"), str(path)
            )
        text = base.text
    else:
        assert file.function is not None
        problem = function_problem(file.function, path.parent, dict.fromkeys(paths, ""), tuple(own.values()), str(path))
        text = read_text(problem.source)
    try:
        ends = np.array([
            [si_value(getattr(one, end), one.path, problem, f"variable.{k}.{end}") for end in ("low", "high")]
            for k, one in enumerate(file.variable)
        ])  # fmt: skip
        start = np.array([_start(one, k, problem, base, *ends[k]) for k, one in enumerate(file.variable)])
    except CaseError as error:
        raise CaseError(error.faults, error.source or str(path)) from None
    with locked_folder(out, wait=ENDING if resume else 0.0):
        search = Search(problem, tuple(paths), Journal(out, problem, text, resume), file.runs, progress)
        first = search.run(start.tolist())
        if first is None:
            raise NotConverged(f"the first run failed: {search.errors[0]}; give another start")
        bounds = [_bounds(one, k, first.units[one.key], str(path)) for k, one in enumerate(file.constraint)]
        task = _Task(file, search, ends[:, 0], ends[:, 1], start, bounds, abs(first.responses[file.objective.key]) or 1.0)
        exact = base is not None and all(key in _EXACT for key in own) and _has_derivatives(problem, search.points[0])
        method, message = _search(task, exact)
        result = _best(task, method, message, file.tolerance)
        _write(task, result, out, path)
    if not result.kept:
        missed = [
            one.key
            for one, part in zip(file.constraint, task.excess(result.responses), strict=True)
            if part > file.tolerance
        ]
        text = f"no run keeps all constraints; the nearest, {search.text(result.values)}, misses {', '.join(missed)}"
        raise NotConverged(f"{text}; give other bounds or more runs")
    return result


def _start(one: Any, number: int, problem: Problem, base: Any, low: float, high: float) -> float:
    where = f"variable.{number}"
    if not low < high:
        raise CaseError(Fault(where, f"{one.path}: low = {one.low} is not below high = {one.high}"))
    if one.start is not None:
        start = si_value(one.start, one.path, problem, f"{where}.start")
        if not low <= start <= high:
            raise CaseError(Fault(f"{where}.start", f"{one.start} is not between low = {one.low} and high = {one.high}"))
        return start
    nominal = None if base is None else nominal_value(problem, base, one.path)
    return nominal if nominal is not None and low <= nominal <= high else 0.5 * (low + high)


def _bounds(one: Constraint, number: int, unit: str, source: str) -> tuple[float, float]:
    """Bounds of a constraint, SI."""

    def read(key: str, absent: float) -> float:
        given = getattr(one, key)
        with fault_at(f"constraint.{number}.{key}", source):
            return absent if given is None else to_si(given, unit)

    if one.value is not None:
        value = read("value", 0.0)
        return value, value
    low, high = read("low", -np.inf), read("high", np.inf)
    if not low <= high:
        raise CaseError(Fault(f"constraint.{number}", f"low = {one.low} is above high = {one.high}"), source)
    return low, high


def _has_derivatives(problem: Problem, point: dict[str, float]) -> bool:
    """Whether the peak of the case has exact derivatives."""
    if all(one.name == MASS for one in problem.responses):
        return True
    try:
        return bool(np.isfinite(_peak_slopes(problem, point)).all())
    except FsmError:
        return False


def _peak_slopes(problem: Problem, point: dict[str, float]) -> np.ndarray:
    return differentiated_peak(problem, point, list(point))[1]


def _slopes(task: _Task, key: str, x: np.ndarray) -> np.ndarray:
    """Derivatives (p,) of a response with respect to the variables from 0 to 1."""
    problem, paths = task.search.problem, task.search.paths
    point = dict(zip(paths, task.values(x).tolist(), strict=True))
    if key == MASS:
        found = np.zeros(len(x))
        for k in range(len(x)):
            shift = np.where(np.arange(len(x)) == k, _MASS_STEP, 0.0)
            ends = [task.low + (x + sign * shift) * (task.high - task.low) for sign in (-1.0, 1.0)]
            less, more = (mass_of(problem.case(dict(zip(paths, end.tolist(), strict=True)))) for end in ends)
            found[k] = (more - less) / (2.0 * _MASS_STEP)
        return found
    return _peak_slopes(problem, point) * (task.high - task.low)


def _search(task: _Task, exact: bool) -> tuple[str, str]:
    """Run the optimiser; returns its name and how it ended."""
    x = (task.start - task.low) / (task.high - task.low)
    bounds = Bounds(np.zeros(len(x)), np.ones(len(x)))
    sizes = [_size(*one) for one in task.bounds]
    low, high = (np.array([one[k] / size for one, size in zip(task.bounds, sizes, strict=True)]) for k in (0, 1))
    method = "SLSQP" if exact else "COBYQA"
    options: dict[str, Any] = {"maxiter": 10 * task.file.runs}
    others: dict[str, Any] = {}
    if exact:
        key = task.file.objective.key
        options["ftol"] = 0.1 * task.file.tolerance
        others["jac"] = lambda x: task.sign() * _slopes(task, key, x) / task.scale

        def rows(x: np.ndarray) -> np.ndarray:
            return np.array(
                [_slopes(task, one.key, x) / size for one, size in zip(task.file.constraint, sizes, strict=True)]
            )

        constraints = [NonlinearConstraint(task.constraints, low, high, jac=rows)] if sizes else []
    else:
        options |= {"initial_tr_radius": 0.2, "final_tr_radius": task.file.tolerance, "maxfev": task.file.runs}
        options["feasibility_tol"] = 0.1 * task.file.tolerance
        constraints = [NonlinearConstraint(task.constraints, low, high)] if sizes else []
    try:
        found = minimize(task.objective, x, method=method, bounds=bounds, constraints=constraints, options=options, **others)
    except EnoughRuns:
        return method, f"stopped after {task.file.runs} runs"
    return method, str(found.message)


def _best(task: _Task, method: str, message: str, tolerance: float) -> Optimum:
    """Best run that keeps all constraints, of equally good ones the nearest to them; else the run that misses them least."""
    excess = [np.inf if run is None else float(np.max(task.excess(run.responses), initial=0.0)) for run in task.search.runs]
    objective = task.sign() * np.nan_to_num(task.search.response(task.file.objective.key), nan=np.inf * task.sign())
    kept = np.array(excess) <= tolerance
    good = kept & (objective <= np.min(objective, where=kept, initial=np.inf) + tolerance * task.scale)
    best = int(np.argmin(np.where(good, excess, np.inf))) if kept.any() else int(np.argmin(excess))
    run = task.search.runs[best]
    assert run is not None
    return Optimum(task.search.points[best], run.responses, task.search, method, bool(kept[best]), message)


def _write(task: _Task, result: Optimum, out: Path, source: Path) -> None:
    tolerance = task.file.tolerance
    kept = np.array([
        run is not None and bool(np.max(task.excess(run.responses), initial=0.0) <= tolerance) for run in task.search.runs
    ])  # fmt: skip
    best = task.search.points.index(result.values)
    task.search.write(out, task.file.objective.key, None, kept, best)
    contents = {
        "optimisation": str(source), "values": result.values, "responses": result.responses, "units": task.search.units(),
        "runs": len(task.search.points), "failed": sum(run is None for run in task.search.runs), "method": result.method,
        "constraints_kept": result.kept, "end": result.message, "provenance": provenance(),
    }  # fmt: skip
    (out / REPORT).write_text(json.dumps(finite_values(contents), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def optimum_lines(result: Optimum) -> list[str]:
    """Lines for the terminal."""
    units, search = result.search.units(), result.search
    lines = [f"{path} = {value:.6g} {search.problem.units[path]}".rstrip() for path, value in result.values.items()]
    lines += [f"{key} = {value:.6g} {units[key]}".rstrip() for key, value in result.responses.items()]
    failed = sum(run is None for run in search.runs)
    end = f"{len(search.points)} runs{f', {failed} of them failed' if failed else ''}, {result.method}: {result.message}"
    return [*lines, end]
