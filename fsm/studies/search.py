"""Search of values of a case: every run once, with its history; a search that is continued makes no run twice.

Journal of runs: one line of JSON for each finished run, so that a study or a search can be continued.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from fsm.errors import CannotWrite, CaseError, FsmError
from fsm.io.csv_file import write_csv
from fsm.io.gc_startup import imports_outside_gc, plain_matplotlib
from fsm.io.provenance import made_by
from fsm.studies.problem import Problem, Run, evaluate

JOURNAL = "runs.jsonl"
"""Name of the journal in the folder of the results."""


class Journal:
    """Finished runs by the digest of the problem and the values; only this process writes.

    Parameters
    ----------
    folder : folder of the results
    problem : Problem
    text : complete case, or the text of the file of the function
    resume : whether to keep the runs of an earlier journal
    """

    def __init__(self, folder: Path, problem: Problem, text: str, resume: bool) -> None:
        self.path = folder / JOURNAL
        responses = [one.model_dump(mode="json") for one in problem.responses]
        start = json.dumps([text, problem.function, responses, made_by()["source"]], sort_keys=True)
        self._start = hashlib.sha256(start.encode())
        self._known: dict[str, Run] = dict(_read(self.path)) if resume else {}
        try:
            folder.mkdir(parents=True, exist_ok=True)
            _cut(self.path, keep=resume)
        except OSError as error:
            raise CannotWrite(f"{self.path}: {error.strerror}") from None

    def find(self, values: Mapping[str, float]) -> Run | None:
        """Finished run with these values; None if there is none."""
        return self._known.get(self._key(values))

    def add(self, values: Mapping[str, float], run: Run) -> None:
        """Append a finished run.

        Raises
        ------
        CannotWrite
            The disk is full; earlier runs are kept.
        """
        key = self._key(values)
        self._known[key] = run
        try:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"key": key, **asdict(run)}) + "\n")
        except OSError as error:
            raise CannotWrite(f"{self.path}: {error.strerror}; the runs before are kept, continue with --resume") from None

    def _key(self, values: Mapping[str, float]) -> str:
        digest = self._start.copy()
        digest.update(json.dumps(dict(values), sort_keys=True).encode())
        return digest.hexdigest()[:24]


def _read(path: Path) -> Iterator[tuple[str, Run]]:
    """Runs of a journal; a line that was cut off when a process was killed is left out."""
    if not path.is_file():
        return
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            data = json.loads(line)
            yield data.pop("key"), Run(**{**data, "curve": tuple(data["curve"])})
        except (ValueError, LookupError, TypeError):
            continue


def _cut(path: Path, keep: bool) -> None:
    """Begin a journal; a kept one ends with a whole line."""
    if not keep or not path.is_file():
        path.write_text("", encoding="utf-8")
        return
    data = path.read_bytes()
    if data and not data.endswith(b"\n"):
        path.write_bytes(data[: data.rfind(b"\n") + 1])


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
            "run", *(heading_of(path, self.problem.units[path]) for path in self.paths),
            *(heading_of(one, units[one]) for one in keys),
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


def heading_of(name: str, unit: str) -> str:
    """Heading of a column with its unit."""
    return f"{name} ({unit})" if unit else name
