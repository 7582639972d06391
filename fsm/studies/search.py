"""Search of values of a case: every run once, with its history; a search that is continued makes no run twice."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fsm.errors import CaseError, FsmError
from fsm.io.csv_file import write_csv
from fsm.io.gc_startup import imports_outside_gc, plain_matplotlib
from fsm.studies.journal import Journal
from fsm.studies.problem import Problem, Run, evaluate

HISTORY, FIGURE, SOLVED = "history.csv", "history.png", "solved.toml"
"""Files of a search: all runs, their figure, and the complete case with the values that were found."""


class EnoughRuns(Exception):
    """The search has made the largest number of runs."""


@dataclass
class Search:
    """Runs of a search in the order of their values.

    Attributes
    ----------
    problem : Problem
    paths : varied paths
    journal : finished runs of this and of an earlier process
    most : largest number of runs
    show : whether to print a line for each run on standard error
    points : values (SI) of each run
    runs : runs; None for a run that failed
    errors : causes of failures; empty for other runs
    """

    problem: Problem
    paths: tuple[str, ...]
    journal: Journal
    most: int
    show: bool = True
    points: list[dict[str, float]] = field(default_factory=list)
    runs: list[Run | None] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def run(self, values: Sequence[float]) -> Run | None:
        """Run with these values; None if it fails.

        Raises
        ------
        CaseError
            The first run of the search has a faulty case or response.
        EnoughRuns
            The search has made the largest number of runs.
        """
        point = dict(zip(self.paths, (float(value) for value in values), strict=True))
        if point in self.points:
            return self.runs[self.points.index(point)]
        if len(self.points) >= self.most:
            raise EnoughRuns
        run, error = self.journal.find(point), ""
        if run is None:
            try:
                run = evaluate(self.problem, point)
                self.journal.add(point, run)
            except FsmError as failure:
                if not self.points and isinstance(failure, CaseError):
                    raise CaseError(failure.faults, failure.source or str(self.problem.source)) from None
                error = " ".join(str(failure).splitlines())
        self.points.append(point)
        self.runs.append(run)
        self.errors.append(error)
        if self.show:
            print(f"run {len(self.points)}: {self.text(point)}: {self._responses(run, error)}", file=sys.stderr, flush=True)
        return run

    def text(self, point: Mapping[str, float]) -> str:
        """Values with their units."""
        return ", ".join(f"{path} = {value:.6g} {self.problem.units[path]}".rstrip() for path, value in point.items())

    def _responses(self, run: Run | None, error: str) -> str:
        if run is None:
            return f"failed: {error}"
        return ", ".join(f"{key} = {value:.6g} {run.units[key]}".rstrip() for key, value in run.responses.items())

    def units(self) -> dict[str, str]:
        """SI units of the responses."""
        return next((run.units for run in self.runs if run is not None), {one.key: "" for one in self.problem.responses})

    def response(self, key: str) -> np.ndarray:
        """Values (n,) of a response; NaN for runs that failed."""
        return np.array([np.nan if run is None else run.responses[key] for run in self.runs])

    def write(self, folder: Path, key: str, target: float | None, feasible: np.ndarray, best: int | None) -> None:
        """Write the history, its figure and the case of the best run; `key` is the response of the figure."""
        units = self.units()
        keys = [one.key for one in self.problem.responses]
        head = [
            "run", *(_head(path, self.problem.units[path]) for path in self.paths),
            *(_head(one, units[one]) for one in keys),
            "all bounds kept" if target is None else "within the tolerance", "error",
        ]  # fmt: skip
        rows = []
        every = zip(self.points, self.runs, feasible.tolist(), self.errors, strict=True)
        for number, (point, run, good, error) in enumerate(every, 1):
            found = ["" if run is None else run.responses[one] for one in keys]
            rows.append([number, *map(repr, point.values()), *found, int(good), error])
        write_csv(folder / HISTORY, head, rows)
        (folder / SOLVED).unlink(missing_ok=True)
        if best is not None and self.problem.tables is not None:
            (folder / SOLVED).write_text(self.problem.case(self.points[best]).text, encoding="utf-8")
        with imports_outside_gc(), plain_matplotlib():
            from fsm.views.plots.studies import Column, plot_search
        columns = [
            Column(path, self.problem.units[path], np.array([point[path] for point in self.points])) for path in self.paths
        ]
        plot_search(folder / FIGURE, key, units[key], self.response(key), feasible, target, columns)


def _head(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name
