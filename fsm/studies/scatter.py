"""Scatter of the parameters of a study: range, distribution or calibrated posterior, and their correlation.

Designs of a study: the values of all parameters in every run.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats
from scipy.optimize import brentq
from scipy.stats import qmc

from fsm.case.loading.table import read_rows
from fsm.case.models.study import StudyCorrelation, StudyDesign, StudyParameter
from fsm.case.schema.units import did_you_mean
from fsm.errors import CaseError, Fault
from fsm.studies.problem import Problem, si_value

_SMALLEST_PIVOT = 1e-10
"""Smallest eigenvalue of a correlation matrix."""
_SYMMETRIC = 1e-6
"""Relative difference of both parts of an interval that is symmetric in the logarithm."""


@dataclass(frozen=True)
class Scatter:
    """Scatter of one parameter.

    Attributes
    ----------
    path : str
    unit : SI unit
    quantile : callable
        Values (SI) at probabilities.
    low, high : float
        Ends of the range; of a distribution without ends its quantiles at the level of the study.
    nominal : float
        Value of the case; the median if the case has none.
    text : str
        Scatter in words.
    """

    path: str
    unit: str
    quantile: Callable[[np.ndarray], np.ndarray]
    low: float
    high: float
    nominal: float
    text: str


def scatter_of(
    one: StudyParameter, number: int, problem: Problem, nominal: float | None, level: float, folder: Path
) -> Scatter:
    """Scatter of a parameter in SI.

    Parameters
    ----------
    one : parameter as in the file
    number : its number, for messages
    problem : units of the paths
    nominal : value of the case (SI), or None
    level : level of the study, for the ends of distributions
    folder : folder of the study, for the files of posteriors

    Raises
    ------
    CaseError
        Values have wrong units or do not fit together, or the posterior has no such quantity.
    """
    where = f"parameter.{number}"

    def read(key: str) -> float | None:
        given = getattr(one, key)
        return None if given is None else si_value(given, one.path, problem, f"{where}.{key}")

    def needed(key: str) -> float:
        value = read(key)
        if value is None and nominal is None:
            raise CaseError(Fault(f"{where}.{key}", f"missing, and the case has no number at {one.path}; give it here"))
        return float(nominal if value is None else value)  # type: ignore[arg-type]

    unit = problem.units[one.path]
    if one.values is not None:
        values = np.array([si_value(v, one.path, problem, f"{where}.values.{k}") for k, v in enumerate(one.values)])
        return _scatter(one.path, unit, stats.randint(0, len(values)), nominal, level, f"{len(values)} values", values)
    if one.posterior is not None:
        value, error, freedom, positive = _posterior(one, where, folder)
        law = stats.t(freedom) if freedom else stats.norm()
        if positive:
            found = lambda p: value * np.exp(error / value * law.ppf(p))  # noqa: E731
        else:
            found = lambda p: value + error * law.ppf(p)  # noqa: E731
        text = f"calibrated: {value:.5g} ± {error:.3g}"
        return _of_quantile(one.path, unit, found, nominal, level, text)
    kind = one.distribution or "uniform"
    if kind in ("uniform", "triangular"):
        low, high = needed("low"), needed("high")
        if not low < high:
            raise CaseError(Fault(where, f"{one.path}: low = {one.low} is not below high = {one.high}"))
        if kind == "uniform":
            return _scatter(one.path, unit, stats.uniform(low, high - low), nominal, 1.0, "uniform")
        mode = needed("mode")
        if not low <= mode <= high:
            raise CaseError(
                Fault(f"{where}.mode", f"{mode:.6g} {unit} is not between low = {one.low} and high = {one.high}")
            )
        law = stats.triang((mode - low) / (high - low), low, high - low)
        return _scatter(one.path, unit, law, nominal, 1.0, "triangular")
    mean = needed("mean")
    sigma = _sigma(one, where, mean, read)
    if kind == "normal":
        return _scatter(one.path, unit, stats.norm(mean, sigma), nominal, level, "normal")
    if mean <= 0.0:
        raise CaseError(Fault(f"{where}.mean", f"is {mean:.6g} {unit}; a lognormal number has a mean above 0"))
    log_sigma = math.sqrt(math.log1p((sigma / mean) ** 2))
    law = stats.lognorm(log_sigma, scale=mean * math.exp(-0.5 * log_sigma**2))
    return _scatter(one.path, unit, law, nominal, level, "lognormal")


def _sigma(one: StudyParameter, where: str, mean: float, read: Callable[[str], float | None]) -> float:
    """Standard deviation, SI; a percentage is a part of the mean."""
    if isinstance(one.sigma, str) and one.sigma.strip().endswith("%"):
        try:
            sigma = 0.01 * abs(mean) * float(one.sigma.strip()[:-1])
        except ValueError:
            raise CaseError(Fault(f"{where}.sigma", f'"{one.sigma}" is no percentage; write, for example, "5 %"')) from None
    else:
        sigma = float(read("sigma"))  # type: ignore[arg-type]
    if not sigma > 0.0:
        raise CaseError(
            Fault(f"{where}.sigma", f"is {one.sigma}; a standard deviation is above 0, use --set for a fixed value")
        )
    return sigma


def _scatter(
    path: str, unit: str, law: Any, nominal: float | None, level: float, text: str, values: np.ndarray | None = None
) -> Scatter:
    if values is None:
        return _of_quantile(path, unit, law.ppf, nominal, level, text)
    ordered = np.sort(values)
    take = lambda p: ordered[np.clip((np.asarray(p) * len(ordered)).astype(int), 0, len(ordered) - 1)]  # noqa: E731
    return _of_quantile(path, unit, take, nominal, 1.0, text)


def _of_quantile(
    path: str, unit: str, quantile: Callable[[np.ndarray], np.ndarray], nominal: float | None, level: float, text: str
) -> Scatter:
    low, middle, high = (float(quantile(np.array(p))) for p in (0.5 - 0.5 * level, 0.5, 0.5 + 0.5 * level))
    return Scatter(path, unit, quantile, low, high, middle if nominal is None else nominal, text)


def _posterior_file(one: StudyParameter, folder: Path) -> Path:
    assert one.posterior is not None
    file = folder / one.posterior
    return file.with_name("calibration.json") if file.suffix == ".h5" else file


def _read_posterior(file: Path, where: str) -> dict[str, Any]:
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        assert isinstance(data["quantities"], list)
    except (OSError, ValueError, LookupError, TypeError, AssertionError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is no report of a calibration"
        raise CaseError(
            Fault(f"{where}.posterior", f"cannot read {file}: {why}; give calibration.json of fsm calibrate")
        ) from None
    return dict(data)


def _posterior(one: StudyParameter, where: str, folder: Path) -> tuple[float, float, float, bool]:
    """Value, standard error, degrees of freedom (0: normal) and whether the parameter is positive."""
    file = _posterior_file(one, folder)
    data = _read_posterior(file, where)
    wanted = one.quantity or one.path
    known = {str(entry["name"]): entry for entry in data["quantities"] if entry.get("standard_error")}
    names = [name for name in known if name == wanted] or [name for name in known if name.endswith(f": {wanted}")]
    if len(names) != 1:
        near = did_you_mean(wanted, known) if not names else f"; name one of them in `quantity`: {', '.join(names)}"
        what = f"has {len(names) or 'no'} quantit{'y' if len(names) == 1 else 'ies'} {wanted} with a standard error{near}"
        if not names and not near:
            what += f"; it has {', '.join(known) or 'none'}"
        raise CaseError(Fault(f"{where}.posterior", f"{file} {what}"))
    return _law(known[names[0]], float(data.get("options", {}).get("level", 0.95)))


def _law(entry: Mapping[str, Any], level: float) -> tuple[float, float, float, bool]:
    """Value, standard error, degrees of freedom and sign, so that quantiles at the level are the interval of a quantity.

    An interval that is wider than that of a normal number is of Student's t distribution. One that is symmetric in the
    logarithm is of a positive number.
    """
    value, error = float(entry["value"]), float(entry["standard_error"])
    low, high = entry.get("low"), entry.get("high")
    if low is None or high is None:
        return value, error, 0.0, False
    positive = low > 0.0 and abs(math.log(high / value) + math.log(low / value)) < _SYMMETRIC * math.log(high / low)
    half = value * math.log(high / value) if positive else 0.5 * (high - low)
    tail = 0.5 + 0.5 * level
    if half / error <= stats.norm.ppf(tail) * (1.0 + 1e-6):
        return value, error, 0.0, positive
    freedom = brentq(lambda nu: stats.t.ppf(tail, nu) - half / error, 0.5, 1e7)
    return value, error, float(freedom), positive


def correlation_matrix(parameters: Sequence[StudyParameter], pairs: Sequence[StudyCorrelation], folder: Path) -> np.ndarray:
    """Correlation of the normal scores of all parameters, (p, p), from the file and from posteriors.

    Raises
    ------
    CaseError
        The correlations contradict each other: the matrix is not positive definite.
    """
    paths = [one.path for one in parameters]
    matrix = np.eye(len(paths))
    for a, b, value in [*_posterior_pairs(parameters, folder), *((*pair.between, pair.value) for pair in pairs)]:
        i, j = paths.index(a), paths.index(b)
        matrix[i, j] = matrix[j, i] = value
    lowest = float(np.linalg.eigvalsh(matrix)[0])
    if lowest < _SMALLEST_PIVOT:
        text = f"contradict each other: the smallest eigenvalue of their matrix is {lowest:.3g}; make them smaller"
        raise CaseError(Fault("correlation", text))
    return matrix


def _posterior_pairs(parameters: Sequence[StudyParameter], folder: Path) -> list[tuple[str, str, float]]:
    """Correlations of parameters of the same calibration."""
    found: list[tuple[str, str, float]] = []
    by_file: dict[Path, list[StudyParameter]] = {}
    for number, one in enumerate(parameters):
        if one.posterior is not None:
            by_file.setdefault(_posterior_file(one, folder), []).append(one)
            _read_posterior(_posterior_file(one, folder), f"parameter.{number}")
    for file, own in by_file.items():
        data: Mapping[str, Any] = _read_posterior(file, "parameter")
        names = [str(entry["name"]) for entry in data["quantities"]]
        matrix = data.get("correlation")
        if matrix is None:
            continue
        for k, one in enumerate(own):
            for other in own[:k]:
                a, b = one.quantity or one.path, other.quantity or other.path
                if a in names and b in names and max(names.index(a), names.index(b)) < len(matrix):
                    found.append((one.path, other.path, float(matrix[names.index(a)][names.index(b)])))
    return found


def groups_of(correlation: np.ndarray) -> list[list[int]]:
    """Numbers of parameters that are correlated, directly or through others; independent parameters are alone."""
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(correlation != 0.0, directed=False)
    return [np.flatnonzero(label == k).tolist() for k in range(count)]


def values_at(scatters: Sequence[Scatter], correlation: np.ndarray, unit_cube: np.ndarray) -> np.ndarray:
    """Values (n, p) of the parameters at points (n, p) of the unit cube with independent uniform coordinates.

    Correlated parameters have the Gaussian copula of `correlation`.
    """
    points = np.clip(unit_cube, 1e-12, 1.0 - 1e-12)
    if np.any(correlation != np.eye(len(correlation))):
        points = stats.norm.cdf(stats.norm.ppf(points) @ np.linalg.cholesky(correlation).T)
    return np.column_stack([one.quantile(points[:, k]) for k, one in enumerate(scatters)])


MOST = 100_000
"""Largest number of runs of a study."""


@dataclass(frozen=True)
class Design:
    """Runs of a study.

    Attributes
    ----------
    values : (n, p) array, SI
    groups : list of list of int
        Groups of parameters of "sobol"; its runs are A, B, and A with each group of columns from B, each `sample` rows.
    sample : int
        Rows of the base sample of "sobol"; else 0.
    varied : (n,) array of int
        Number of the parameter that a run of "one-at-a-time" varies, -1 for none and for other designs.
    """

    values: np.ndarray
    groups: list[list[int]]
    sample: int = 0
    varied: np.ndarray | None = None


def design_of(
    wanted: StudyDesign, scatters: Sequence[Scatter], correlation: np.ndarray, problem: Problem, seed: int, folder: Path
) -> Design:
    """Runs of a design; equal inputs and seeds give equal runs.

    Raises
    ------
    CaseError
        The design has too many runs, or the CSV file does not fit.
    """
    count, groups = len(scatters), groups_of(correlation)
    kind, sample = wanted.kind, wanted.sample
    runs = {
        "sobol": sample * (len(groups) + 2), "latin": sample,
        "grid": wanted.points**count, "one-at-a-time": wanted.points * count,
    }.get(kind, 0)  # fmt: skip
    if runs > MOST:
        key = "points" if kind in ("grid", "one-at-a-time") else "sample"
        also = ", or use latin" if kind == "grid" else ""
        raise CaseError(
            Fault(f"design.{key}", f"makes {runs:,} runs; at most {MOST:,} are allowed: give a smaller number{also}")
        )
    generator = np.random.default_rng(seed)
    if kind == "sobol":
        both = qmc.Sobol(2 * count, scramble=True, rng=generator).random(sample)
        a, b = both[:, :count], both[:, count:]
        parts = [a, b]
        for group in groups:
            mixed = a.copy()
            mixed[:, group] = b[:, group]
            parts.append(mixed)
        return Design(values_at(scatters, correlation, np.vstack(parts)), groups, sample)
    if kind == "latin":
        points = qmc.LatinHypercube(count, rng=generator).random(sample)
        return Design(values_at(scatters, correlation, points), groups)
    if kind == "csv":
        assert wanted.file is not None
        return Design(_csv_values(folder / wanted.file, scatters, problem), groups)
    levels = [_levels(one, wanted.points) for one in scatters]
    if kind == "grid":
        return Design(np.array(list(itertools.product(*levels))), groups)
    nominal = np.array([one.nominal for one in scatters])
    rows = [np.where(np.arange(count) == k, value, nominal) for k in range(count) for value in levels[k]]
    return Design(np.array(rows), groups, 0, np.repeat(np.arange(count), [len(each) for each in levels]))


def _levels(one: Scatter, points: int) -> np.ndarray:
    """Equally spaced values of a parameter between its ends; of given values each once."""
    if one.text.endswith(" values"):
        return np.unique(one.quantile(np.linspace(0.0, 1.0 - 1e-9, 10_001)))
    return np.linspace(one.low, one.high, points)


def _csv_values(file: Path, scatters: Sequence[Scatter], problem: Problem) -> np.ndarray:
    header, rows = read_rows(file)
    paths = [one.path for one in scatters]
    for name in header:
        if name not in paths:
            raise CaseError(
                Fault(f"column {name}", f"is no [[parameter]] of the study; the parameters are {', '.join(paths)}"),
                str(file),
            )
    for path in paths:
        if path not in header:
            raise CaseError(Fault(path, "has no column; add one with this heading"), str(file))
    if len(rows) > MOST:
        raise CaseError(f"has {len(rows):,} rows; at most {MOST:,} are allowed", str(file))
    try:
        return np.array([
            [si_value(cells[path], path, problem, f"row {number}: {path}") for path in paths] for number, cells in rows
        ])  # fmt: skip
    except CaseError as error:
        raise CaseError(error.faults, str(file)) from None
