"""Rows: many cases, each solved on a worker, with its summary and chosen curves; for tables, studies and optimisations.

    jobs = (Job(loaded, curves=("force",)) for loaded in cases)
    for row in run_rows(jobs, on="tcp://HOST:PORT"):      # on=None: processes of this machine
        row.number, row.summary, row.curves["force"], row.error

Rows come in the order of completion; `number` is the place of the job. A row that fails has an `error`, and the others
go on. The bits of a row do not depend on the number of workers.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fsm.case.loading.load_case import LoadedCase
from fsm.errors import CannotWrite, ExpectationFailed
from fsm.io.atomic_write import atomic_write
from fsm.io.folder_lock import ENDING, locked_folder
from fsm.io.gc_startup import imports_outside_gc, plain_matplotlib
from fsm.results.solution import Solution
from fsm.results.summary_file import SUMMARY
from fsm.run.workers import run_jobs
from fsm.views.plots.drawing import drawing, selected

RESOLVED = "case.resolved.toml"
"""File with the complete case of a row, in the folder of its results."""
FAILURE = "error.txt"
"""File with the error of a row that failed; finished and interrupted rows have no such file."""
FORCE = "force"
"""Curve of the force of the first drive over its travel."""


@dataclass(frozen=True)
class Job:
    """Case for a worker.

    Attributes
    ----------
    loaded : LoadedCase
    out : Path, optional
        Folder that gets the complete case and all files of the run; default: nothing is written.
    resume : bool
        Whether to restart from a checkpoint in the folder.
    figures : bool
        Whether figures of the row are drawn.
    style : (str, str, ...)
        Arguments of `fsm.views.plots.drawing.drawing`.
    curves : sequence of str
        Curves that the row shall have: "force", or names of recorded channels (``save.channels``).
    """

    loaded: LoadedCase
    out: Path | None = None
    resume: bool = False
    figures: bool = False
    style: tuple[Any, ...] = field(default_factory=selected)
    curves: Sequence[str] = ()


@dataclass(frozen=True)
class Row:
    """Result of a job.

    Attributes
    ----------
    number : number of the job, from 0
    summary : content of summary.json; empty if the run failed
    curves : (2, n) arrays by name: travel (m or rad) of the first drive, or time (s) without a drive, and the value (SI)
    error : lines of the error; empty without an error
    exit_code : of the error
    trace : traceback of an unexpected error
    """

    number: int
    summary: dict[str, Any]
    curves: dict[str, np.ndarray]
    error: str = ""
    exit_code: int = 0
    trace: str = ""


def run_rows(
    jobs: Iterable[Job], *, on: str | None = None, workers: int | None = None, copies: bool = False
) -> Generator[Row, None, None]:
    """Solve cases on workers and yield their rows in the order of completion; see `fsm.run.workers.run_jobs`."""
    with closing(run_jobs(solve_row, jobs, workers, copies, on)) as outcomes:
        for outcome in outcomes:
            if outcome.error is not None:
                error = "\n".join(outcome.error)
                yield Row(outcome.job, {}, {}, error, outcome.exit_code, outcome.trace)
            else:
                summary, curves, missed = outcome.value
                code = ExpectationFailed.exit_code if missed else 0
                yield Row(outcome.job, summary, curves, "\n".join(missed), code)


def solve_row(job: Job) -> tuple[dict[str, Any], dict[str, np.ndarray], list[str]]:
    """Solve one case in a worker; gives its summary, its curves, and the numbers that missed their bounds."""
    run_in_locked_folder = ready(job.figures)
    options: dict[str, Any] = {"progress": False, "resume": job.resume, "figures": job.figures}
    if job.out is None:
        done = run_in_locked_folder(job.loaded, None, **options)
    else:
        try:
            job.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            why = f"the folder cannot be created ({error.strerror}); remove the file of this name, or rename the row"
            raise CannotWrite(f"{job.out}: {why}") from None
        with locked_folder(job.out, wait=ENDING if job.resume else 0.0), drawing(*job.style):
            for name in (SUMMARY, FAILURE):
                (job.out / name).unlink(missing_ok=True)
            with atomic_write(job.out / RESOLVED) as part:  # before the run starts
                part.write_text(job.loaded.text, encoding="utf-8")
            done = run_in_locked_folder(job.loaded, job.out, **options)
    return done.summary, curves_of(done.solution, job.curves), done.missed


def ready(figures: bool) -> Any:
    """Import what a row needs."""
    with imports_outside_gc(), plain_matplotlib():
        from fsm.run.run_case import run_in_locked_folder

        if figures:
            from fsm.views.plots import motion  # noqa: F401  # this imports Matplotlib
    return run_in_locked_folder


def curves_of(solution: Solution, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Curves of a result by name, see `Row`; a channel with several components gives a curve for each.

    A name that the result does not have gives no curve.
    """
    found: dict[str, np.ndarray] = {}
    if not names:
        return found
    driven = solution.travel.shape[1] > 0
    over = solution.travel[:, 0] if driven else solution.time
    for name in names:
        if name == FORCE and driven:
            curve = solution.force_curve
            found[name] = np.array([curve.travel[:, 0], curve.force[:, 0]])
        elif name in solution.channels:
            found |= {label: np.array([over, values]) for label, values in solution.channels[name].columns.items()}
    return found
