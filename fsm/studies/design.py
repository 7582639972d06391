"""Designs of a study: the values of all parameters in every run."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from fsm.case.loading.table import read_rows
from fsm.case.models.study import StudyDesign
from fsm.errors import CaseError, Fault
from fsm.studies.problem import Problem, si_value
from fsm.studies.scatter import Scatter, groups_of, values_at

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
