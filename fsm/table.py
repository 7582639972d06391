"""Run of a table of cases on all cores, with a summary of their results."""

from __future__ import annotations

import csv
import itertools
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsm.atomic_write import atomic_write, remove_partial_files
from fsm.errors import CannotWrite, CaseError, Fault, OutOfMemory
from fsm.folder_lock import locked_folder
from fsm.gc_startup import imports_outside_gc, plain_matplotlib
from fsm.plots.drawing import FORMATS, drawing, file_format, selected
from fsm.pool import JobOutcome, run_jobs
from fsm.results.summary_file import SUMMARY, read_summary
from fsm.scene.load_case import LoadedCase
from fsm.scene.table import COLLECTED, OVERLAY, STUDY, TableCase, load_reference, load_table

__all__ = ["RESOLVED", "failures", "format_comparison", "format_table", "run_table"]

RESOLVED = "case.resolved.toml"
"""File with the complete case of a row, in the folder of its results."""

RESULT = "result.h5"
FAILURE = "error.txt"
"""File with the error of a row that failed; finished and interrupted rows have no such file."""


@dataclass(frozen=True)
class Job:
    """Row of a table for a worker: the case, its folder, and whether to restart from a checkpoint there."""

    loaded: LoadedCase
    out: Path
    resume: bool
    style: tuple[str, str]
    """Arguments of `fsm.plots.drawing.drawing`."""


def run_table(
    path: str | Path,
    out: str | Path,
    overrides: Sequence[str] = (),
    workers: int | None = None,
    resume: bool = False,
    method: str | None = None,
    progress: bool = True,
) -> list[dict[str, Any]]:
    """Run every row of a table.

    Write ``summary.csv``, ``overlay.png`` (``study.png`` for films), and a folder for each row with its complete case and
    its results.

    Parameters
    ----------
    path : str or Path
        Table file, see `fsm.scene.table`.
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

    Returns
    -------
    list of dict
        One item for each row, in the order of the table: `case` (its name), the cells, and the numbers of the summary
        (stages as ``stage_<name>_travel``). A row that failed also has `error` (text) and `exit_code`.

    Raises
    ------
    CaseError
        All faults of all rows; no row was run and no file was written.
    KeyboardInterrupt
        The table was interrupted; ``summary.csv`` holds the finished rows.
    """
    cases = load_table(path, [*overrides, *([f"solve.method={method}"] if method else [])])
    reference = load_reference(path)
    kernels = _check_scenes(cases, str(path))
    with locked_folder(out):
        return _run_cases(cases, Path(out), kernels, reference, workers, resume, progress)


def _run_cases(
    cases: Sequence[TableCase],
    folder: Path,
    kernels: set[str],
    reference: Mapping[str, Mapping[str, float]],
    workers: int | None,
    resume: bool,
    progress: bool,
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
            jobs[index] = Job(case.loaded, where, same, selected())
    remove_partial_files(folder)
    try:
        _run_rows(cases, jobs, rows, kernels, workers, progress)
    finally:
        done = [rows[index] for index in sorted(rows)]
        paths = dict.fromkeys(path for case in cases for path in case.overrides)
        _write_csv(folder / COLLECTED, done, ["case", *paths])
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


_Column = tuple[str, str, float, int]
"""Column: heading, key of the row, factor, digits."""
_OF_PULL: tuple[_Column, ...] = (("peak force (N)", "peak_force", 1.0, 4), ("at travel (mm)", "peak_travel", 1e3, 2))
_OF_FILM: tuple[_Column, ...] = (
    ("frequency (Hz)", "frequency_hz", 1.0, 3),
    ("center (mm)", "amplitude_center", 1e3, 4),
    ("patch (mm)", "amplitude_patch", 1e3, 4),
    ("decay (1/s)", "decay_rate", 1.0, 2),
    ("largest stress (MPa)", "tension_state_largest_stress", 1e-6, 2),
)
_OF_RUN: tuple[_Column, ...] = (
    ("steps", "steps", 1.0, 0),
    ("run time (s)", "wall_time_s", 1.0, 2),
    ("warnings", "warnings", 1.0, 0),
)


def format_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Results as text: one line for each case, lengths in mm, with the errors of failed rows below the table."""
    stages = list(dict.fromkeys(key for row in rows for key in row if _stage_name(key)))
    own = _OF_FILM if any("frequency_hz" in row for row in rows) else _OF_PULL
    columns = [*own, *((f"{_stage_name(key)} from (mm)", key, 1e3, 2) for key in stages), *_OF_RUN]
    lines = [["condition", *(heading for heading, *_ in columns)]]
    for row in rows:
        lines.append([str(row["case"]), *(_cell(row.get(key), factor, digits) for _, key, factor, digits in columns)])
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    text = [
        "  ".join([line[0].ljust(widths[0]), *map(str.rjust, line[1:], widths[1:])]).rstrip()
        for line in lines
    ]
    text.insert(1, "-" * (sum(widths) + 2 * len(widths) - 2))
    text += [f"{row['case']}: {line}" for row in rows for line in str(row.get("error", "")).splitlines()]
    return "\n".join(text)


def format_comparison(path: str | Path, rows: Sequence[Mapping[str, Any]]) -> str:
    """Comparison with the reference of a table, one line for each row and number; empty without a reference."""
    from fsm.plots.study import STUDY_RESULTS, relative_changes

    reference = load_reference(path)
    lines = []
    for name in STUDY_RESULTS:
        for row, found in zip(rows, relative_changes(rows, reference, name), strict=True):
            if found is not None:
                ours, theirs, band = found
                off = abs((100.0 + ours) / (100.0 + theirs) - 1.0)
                said = "within" if off <= 0.01 * band + 1e-12 else "outside"
                lines.append(
                    f"{row['case']}: {name} {ours:+.2f} %, reference {theirs:+.2f} %"
                    + (f", {said} its band of {band:g} %" if band else "")
                )
    return "\n".join(lines)


def _cell(value: object, factor: float, digits: int) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "-"
    return f"{value * factor:.{digits}f}"


def _stage_name(key: str) -> str:
    """Name of a stage from the key of its travel; empty for any other key."""
    match = re.fullmatch(r"stage_(.+)_travel", key)
    return match[1].replace("_", " ") if match else ""


def run_row(job: Job) -> dict[str, Any]:
    """Run one row in a worker; the complete case is written to the folder before the run starts."""
    with imports_outside_gc(), plain_matplotlib():
        from fsm.run import ENDING, run_in_locked_folder

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
            return run_in_locked_folder(job.loaded, job.out, progress=False, resume=job.resume)


def _same_case(folder: Path, loaded: LoadedCase) -> bool:
    """Whether the folder belongs to the same case."""
    try:
        return (folder / RESOLVED).read_text(encoding="utf-8") == loaded.text
    except (OSError, UnicodeDecodeError):
        return False


def _check_scenes(cases: Sequence[TableCase], source: str) -> set[str]:
    """Compile every case, so that faults are found before the first case runs.

    Returns
    -------
    set of str
        Kinds of kernels that the cases use, see `fsm.warm_up.KINDS`.
    """
    from fsm.analyses.choose import analysis_of

    faults, kernels = [], set[str]()
    for case in cases:
        try:
            kernels.update(analysis_of(case.loaded.case).kernels)
        except CaseError as error:
            faults += [
                Fault(f"{case.name}: {f.path}" if f.path else case.name, f.message) for f in error.faults
            ]
        except MemoryError as error:
            faults.append(Fault(case.name, str(OutOfMemory(error))))
    if faults:
        raise CaseError(faults, source)
    return kernels


def _run_rows(
    cases: Sequence[TableCase],
    jobs: Mapping[int, Job],
    rows: dict[int, dict[str, Any]],
    kernels: set[str],
    workers: int | None,
    progress: bool,
) -> None:
    """Run the jobs and add their rows in the order of completion."""
    if not jobs:
        return
    from fsm.warm_up import compile_ahead

    compile_ahead(sorted(kernels), progress)
    numbers = list(jobs)
    count = min(workers or os.cpu_count() or 1, len(numbers))
    with (
        _progress(len(cases), len(rows), progress) as report,
        closing(run_jobs(run_row, list(jobs.values()), count)) as outcomes,
    ):
        for outcome in outcomes:
            index = numbers[outcome.job]
            rows[index] = _row(cases[index], jobs[index].out, outcome)
            report(rows[index])


def _row(case: TableCase, folder: Path, outcome: JobOutcome | None = None) -> dict[str, Any]:
    """Row of the summary: name, cells, numbers, and the error if there is one."""
    row: dict[str, Any] = {"case": case.name, **case.overrides}
    with suppress(CaseError):
        row |= _scalars(read_summary(folder / SUMMARY))
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


def _scalars(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers and strings of a summary; stages give their start, and warnings their number."""
    flat: dict[str, Any] = {}
    for key, value in summary.items():
        if key == "stages":
            flat |= {f"stage_{stage['name'].replace(' ', '_')}_travel": stage["travel"] for stage in value}
        elif key == "warnings":
            flat[key] = len(value)
        elif isinstance(value, Mapping):
            flat |= {f"{key}_{below}": number for below, number in _scalars(value).items()}
        elif not isinstance(value, list):
            flat[key] = value
    return flat


def _write_csv(path: Path, rows: Sequence[Mapping[str, Any]], first: Sequence[str]) -> None:
    """Write the rows with the columns `first` at the start and the error at the end."""
    if not rows:
        return
    last = ("error", "exit_code")
    columns = list(dict.fromkeys([*first, *(key for row in rows for key in row if key not in last), *last]))
    with atomic_write(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, restval="")
        writer.writeheader()
        writer.writerows({**row, "error": row.get("error", "").replace("\n", "; ")} for row in rows)


def _plot_overlay(folder: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw the force curves of all rows with a drive."""
    pulled = [row for row in rows if "peak_force" in row and "frequency_hz" not in row]
    names = [row["case"] for row in pulled if (folder / row["case"] / RESULT).is_file()]
    if not names:
        return
    from fsm.plots.force import plot_overlay
    from fsm.results.store import read_solution

    plot_overlay([(name, read_solution(folder / name / RESULT)) for name in names], _figure(folder / OVERLAY))


def _plot_study(
    folder: Path,
    rows: Sequence[Mapping[str, Any]],
    columns: Sequence[str],
    reference: Mapping[str, Mapping[str, float]],
) -> None:
    """Draw frequency and amplitudes of all rows that vibrate."""
    films = [row for row in rows if row.get("frequency_hz") is not None]
    if films:
        from fsm.plots.study import plot_study

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
        yield lambda row: print(f"[{next(count)}/{total}] {_line(row)}", file=sys.stderr, flush=True)


def _advance(bar: Any, row: Mapping[str, Any]) -> None:
    bar.update()
    bar.set_postfix_str(_line(row))


def _line(row: Mapping[str, Any]) -> str:
    if row.get("error"):
        return f"{row['case']}: failed: {str(row['error']).splitlines()[0]}"
    if "frequency_hz" in row:
        return f"{row['case']}: {_cell(row['frequency_hz'], 1, 3)} Hz, {_cell(row.get('wall_time_s'), 1, 1)} s"
    force, travel = _cell(row.get("peak_force"), 1, 4), _cell(row.get("peak_travel"), 1e3, 2)
    return f"{row['case']}: peak {force} N at {travel} mm, {_cell(row.get('wall_time_s'), 1, 1)} s"
