"""Run of a table of cases on all cores, with a summary of their results."""

from __future__ import annotations

import itertools
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from fsm.case.loading.load_case import LoadedCase
from fsm.case.loading.table import OVERLAY, STUDY, TableCase, load_reference, load_table
from fsm.errors import CannotWrite, CaseError, Fault, OutOfMemory
from fsm.io.atomic_write import atomic_write, remove_partial_files
from fsm.io.folder_lock import ENDING, locked_folder
from fsm.io.gc_startup import imports_outside_gc, plain_matplotlib
from fsm.results.summary_file import SUMMARY, read_summary
from fsm.run.pool import JobOutcome, run_jobs
from fsm.run.table_files import flat_numbers, write_extremes, write_summaries
from fsm.run.table_text import progress_line
from fsm.views.plots.beside import can_copy
from fsm.views.plots.drawing import FORMATS, drawing, file_format, in_two_processes, selected

if TYPE_CHECKING:
    from fsm.analyses.analysis import Analysis

Figures = Literal["none", "first", "all"]
"""Rows whose figures are drawn."""

RESOLVED = "case.resolved.toml"
"""File with the complete case of a row, in the folder of its results."""

RESULT = "result.h5"
_MOST_KEPT = 100_000
"""Degrees of freedom of all compiled cases that are kept for workers; a case of 100 takes about 1 MB."""
_compiled: dict[str, tuple[Analysis, list[str]]] = {}
"""Compiled cases with their warnings, by the names of rows."""
FAILURE = "error.txt"
"""File with the error of a row that failed; finished and interrupted rows have no such file."""


@dataclass(frozen=True)
class Job:
    """Row of a table for a worker: the case, its folder, and whether to restart from a checkpoint there."""

    loaded: LoadedCase
    out: Path
    resume: bool
    style: tuple[str, str]
    """Arguments of `fsm.views.plots.drawing.drawing`."""
    figures: bool
    """Whether figures of the row are drawn."""


def run_table(
    path: str | Path,
    out: str | Path,
    overrides: Sequence[str] = (),
    workers: int | None = None,
    resume: bool = False,
    method: str | None = None,
    progress: bool = True,
    figures: Figures = "none",
) -> list[dict[str, Any]]:
    """Run every row of a table.

    Write ``summary.csv``, ``extremes.csv`` of recorded channels, ``overlay.png`` (``study.png`` for films), and a folder
    for each row with its complete case and its results.

    Parameters
    ----------
    path : str or Path
        Table file, see `fsm.case.loading.table`.
    out : str or Path
        Folder for the results.
    overrides : sequence of str
        ``"path=value"``, for all rows.
    workers : int, optional
        Number of processes; default: the number of cores, and at most one for each row.
    resume : bool
        Skip finished rows with the same case, restart interrupted rows, and repeat rows that failed.
    method : str, optional
        Integration method, for all rows.
    progress : bool
        Show progress on standard error.
    figures : "none", "first" or "all"
        Rows whose folders get figures. ``overlay.png`` and ``study.png`` are always drawn.

    Returns
    -------
    list of dict
        One item for each row, in the order of the table: `case` (its name), the cells, and the summary as
        `fsm.run.table_files.flat_numbers` gives it. A row that failed also has `error` (text) and `exit_code`.

    Raises
    ------
    CaseError
        All faults of all rows; no row was run and no file was written.
    KeyboardInterrupt
        The table was interrupted; ``summary.csv`` holds the finished rows.
    """
    cases = load_table(path, [*overrides, *([f"solve.method={method}"] if method else [])])
    reference = load_reference(path)
    copies = in_two_processes() and can_copy()
    kernels = _compile(cases, str(path), copies)
    with locked_folder(out, wait=ENDING if resume else 0.0):
        return _run_cases(cases, Path(out), kernels, reference, workers, resume, progress, figures, copies)


def _run_cases(
    cases: Sequence[TableCase],
    folder: Path,
    kernels: set[str],
    reference: Mapping[str, Mapping[str, float]],
    workers: int | None,
    resume: bool,
    progress: bool,
    figures: Figures,
    copies: bool,
) -> list[dict[str, Any]]:
    """Run the rows that are not solved yet, and write the files of the whole table."""
    rows: dict[int, dict[str, Any]] = {}
    jobs: dict[int, Job] = {}
    for index, case in enumerate(cases):
        where = folder / case.name
        same = resume and _same_case(where, case.loaded) and not (where / FAILURE).exists()
        if same and _is_solved(where):
            rows[index] = _row(case, where)
        else:
            jobs[index] = Job(case.loaded, where, same, selected(), figures == "all" or (figures == "first" and index == 0))
    remove_partial_files(folder)
    try:
        _run_rows(cases, jobs, rows, kernels, workers, progress, copies)
    finally:
        _compiled.clear()
        done = [rows[index] for index in sorted(rows)]
        paths = dict.fromkeys(path for case in cases for path in case.overrides)
        write_summaries(folder, done, list(paths))
        write_extremes(folder, done)
    _plot_overlay(folder, done)
    _plot_study(folder, done, list(paths), reference)
    return done


def _is_solved(folder: Path) -> bool:
    """Whether the folder holds an undamaged summary."""
    try:
        read_summary(folder / SUMMARY)
    except CaseError:
        return False
    return True


def failures(rows: Sequence[Mapping[str, Any]]) -> int:
    """Exit code of a table: 0 without failures, 4 if all failed rows missed an expectation, else 3."""
    codes = {row["exit_code"] for row in rows if row.get("error")}
    return 0 if not codes else 4 if codes == {4} else 3


def run_row(job: Job) -> dict[str, Any]:
    """Run one row in a worker; the complete case is written to the folder before the run starts."""
    run_in_locked_folder = _ready(job.figures)
    try:
        job.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = f"the folder cannot be created ({error.strerror}); remove the file of this name, or rename the row"
        raise CannotWrite(f"{job.out}: {why}") from None
    with locked_folder(job.out, wait=ENDING if job.resume else 0.0):
        for name in (SUMMARY, FAILURE):
            (job.out / name).unlink(missing_ok=True)
        with atomic_write(job.out / RESOLVED) as part:
            part.write_text(job.loaded.text, encoding="utf-8")
        with drawing(*job.style):
            return run_in_locked_folder(
                job.loaded, job.out, progress=False, resume=job.resume, figures=job.figures,
                compiled=_compiled.pop(job.out.name, None),
            )  # fmt: skip


def _ready(figures: bool) -> Callable[..., dict[str, Any]]:
    """Import what a row needs."""
    with imports_outside_gc(), plain_matplotlib():
        from fsm.run.run_case import run_in_locked_folder

        if figures:
            from fsm.views.plots import motion  # noqa: F401  # this imports Matplotlib
    return run_in_locked_folder


def _same_case(folder: Path, loaded: LoadedCase) -> bool:
    """Whether the folder belongs to the same case."""
    try:
        return (folder / RESOLVED).read_text(encoding="utf-8") == loaded.text
    except (OSError, UnicodeDecodeError):
        return False


def _compile(cases: Sequence[TableCase], source: str, copies: bool) -> set[str]:
    """Compile every case, so that faults are found before the first case runs.

    Workers that are `copies` of this process find the compiled cases there, as long as these are small.

    Returns
    -------
    set of str
        Kinds of kernels that the cases use, see `fsm.run.warm_up.KINDS`.
    """
    from fsm.run.run_case import compile_case

    faults, kernels, kept = [], set[str](), 0
    for case in cases:
        try:
            compiled = compile_case(case.loaded)
            kernels.update(compiled[0].kernels)
            if hasattr(compiled[0], "system"):  # films and scissor arrays get theirs when they are initialised
                kept += compiled[0].system.nu
            if copies and kept <= _MOST_KEPT:
                _compiled[case.name] = compiled
        except CaseError as error:
            faults += [Fault(f"{case.name}: {f.path}" if f.path else case.name, f.message) for f in error.faults]
        except MemoryError as error:
            faults.append(Fault(case.name, str(OutOfMemory(error))))
    if faults:
        _compiled.clear()
        raise CaseError(faults, source)
    return kernels


def _run_rows(
    cases: Sequence[TableCase],
    jobs: Mapping[int, Job],
    rows: dict[int, dict[str, Any]],
    kernels: set[str],
    workers: int | None,
    progress: bool,
    copies: bool,
) -> None:
    """Run the jobs and add their rows in the order of completion."""
    if not jobs:
        return
    from fsm.run.warm_up import compile_ahead

    compile_ahead(sorted(kernels), progress)
    if copies:
        _ready(any(job.figures for job in jobs.values()))
    numbers = list(jobs)
    count = min(workers or os.cpu_count() or 1, len(numbers))
    with (
        _progress(len(cases), len(rows), progress) as report,
        closing(run_jobs(run_row, list(jobs.values()), count, copies)) as outcomes,
    ):
        for outcome in outcomes:
            index = numbers[outcome.job]
            rows[index] = _row(cases[index], jobs[index].out, outcome)
            report(rows[index])


def _row(case: TableCase, folder: Path, outcome: JobOutcome | None = None) -> dict[str, Any]:
    """Row of the summary: name, cells, numbers, and the error if there is one."""
    row: dict[str, Any] = {"case": case.name, **case.overrides}
    with suppress(CaseError):
        row |= flat_numbers(read_summary(folder / SUMMARY))
    if outcome is not None and outcome.error:
        row |= {"error": "\n".join(outcome.error), "exit_code": outcome.exit_code}
        try:
            with atomic_write(folder / FAILURE) as part:
                part.write_text(f"{row['error']}\n{outcome.trace}", encoding="utf-8")
        except OSError:  # the folder may be unwritable, which may be the error itself
            return row
        if outcome.trace:
            row["error"] += f" (more in {folder / FAILURE})"
    return row


def _plot_overlay(folder: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw the force curves of all rows with a drive; if there are none, the loads over their displacements."""
    path = _figure(folder / OVERLAY)
    path.unlink(missing_ok=True)
    solved = [row for row in rows if "frequency_hz" not in row and (folder / row["case"] / RESULT).is_file()]
    pulled = [row["case"] for row in solved if row.get("peak_force") is not None]
    loaded = [row["case"] for row in solved if row.get("loads")]
    if not pulled and not loaded:
        return
    from fsm.results.store import read_solution
    from fsm.views.plots.force import plot_overlay
    from fsm.views.plots.load import plot_load_overlay

    plot = plot_overlay if pulled else plot_load_overlay
    plot([(name, read_solution(folder / name / RESULT, records=False)) for name in pulled or loaded], path)


def _plot_study(
    folder: Path,
    rows: Sequence[Mapping[str, Any]],
    columns: Sequence[str],
    reference: Mapping[str, Mapping[str, float]],
) -> None:
    """Draw frequency and amplitudes of all rows that vibrate."""
    films = [row for row in rows if row.get("frequency_hz") is not None]
    if films:
        from fsm.views.plots.study import plot_study

        plot_study(films, columns, reference, _figure(folder / STUDY))


def _figure(path: Path) -> Path:
    """Path of a figure in the selected format; its files in other formats, of an earlier run, are deleted."""
    for suffix in FORMATS:
        if suffix != file_format():
            path.with_suffix(suffix).unlink(missing_ok=True)
    return path.with_suffix(file_format())


@contextmanager
def _progress(total: int, done: int, show: bool) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """Function that reports a finished row on standard error: by a bar on a terminal, else by a line."""
    if not show:
        yield lambda row: None
    elif sys.stderr.isatty():
        from tqdm import tqdm

        with tqdm(total=total, initial=done, unit="case") as bar:
            yield lambda row: _advance(bar, row)
    else:
        count = itertools.count(done + 1)
        yield lambda row: print(f"[{next(count)}/{total}] {progress_line(row)}", file=sys.stderr, flush=True)


def _advance(bar: Any, row: Mapping[str, Any]) -> None:
    bar.update()
    bar.set_postfix_str(progress_line(row))
