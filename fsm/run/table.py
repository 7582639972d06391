"""Run of a table of cases on all cores or on a cluster, with a summary of their results."""

from __future__ import annotations

import itertools
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any, Literal

from fsm.case.loading.table import OVERLAY, PEAKS, STUDY, Table, TableCase, inputs_of, load_reference, read_table
from fsm.errors import CaseError, Fault, OutOfMemory
from fsm.io.atomic_write import atomic_write, remove_partial_files
from fsm.io.folder_lock import ENDING, locked_folder
from fsm.results.summary_file import SUMMARY, read_summary
from fsm.run.row_store import Entry, RowStore, StoredRows, hash_of
from fsm.run.rows import FAILURE, RESOLVED, Job, Row, ready, run_rows
from fsm.run.table_files import flat_numbers, progress_line, write_extremes, write_summaries
from fsm.views.plots.beside import can_copy
from fsm.views.plots.drawing import FORMATS, file_format, in_two_processes

Figures = Literal["none", "first", "all"]
"""Rows whose figures are drawn."""
Keep = Literal["all", "none"]
"""Rows that have a folder with all files of the run."""

RESULT = "result.h5"
MOST_FOLDERS = 500
"""Number of rows above which rows have no folder, unless one is asked for."""
_MOST_ROWS = 200_000
"""Largest number of rows of a run; more rows are run in parts."""
_NUMBER = re.compile(r"[-+]?[\d.]+(e[-+]?\d+)?")
_MOST_KINDS = 20
"""Number of kinds of rows whose first row is compiled before the table runs."""


def run_table(
    path: str | Path,
    out: str | Path,
    overrides: Sequence[str] = (),
    workers: int | None = None,
    resume: bool = False,
    method: str | None = None,
    progress: bool = True,
    figures: Figures = "none",
    keep: Keep | None = None,
    on: str | None = None,
    part: tuple[int, int] = (1, 1),
) -> StoredRows:
    """Run every row of a table.

    Write ``summary.csv``, ``extremes.csv`` of recorded channels, ``study.parquet`` (with pyarrow), ``rows.db``, and, for
    rows with folders, ``overlay.png`` (``study.png`` for films) and a folder for each row with its complete case and its
    results. A row is in ``rows.db`` as soon as it is finished.

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
        Rows whose folders get figures. If not "none", the peak is drawn over each parameter too.
    keep : "all" or "none", optional
        Whether each row has a folder with all its files; default: up to 500 rows, on this machine.
    on : str, optional
        Cluster that runs the rows, see `fsm.run.workers.run_jobs`. Folders of rows need a disk that all machines share.
    part : (int, int)
        (3, 10): the third of ten parts of the table. `merge_tables` joins the parts.

    Returns
    -------
    sequence of dict
        One item for each row, in the order of the table: `case` (its name), the cells in SI, and the summary as
        `fsm.run.table_files.flat_numbers` gives it. A row that failed also has `error` (text) and `exit_code`. Items are
        read from ``rows.db`` when they are asked for; `list` keeps them for a time after another run into this folder.

    Raises
    ------
    CaseError
        Faults of rows; no row was run and no file was written.
    KeyboardInterrupt
        The table was interrupted; ``summary.csv`` holds the finished rows.
    """
    table = read_table(path, [*overrides, *([f"solve.method={method}"] if method else [])], part, _MOST_ROWS)
    kernels = _compile(table, str(path))
    folders = (keep or ("none" if on or len(table.cases) > MOST_FOLDERS else "all")) == "all"
    run = _TableRun(table, Path(out), folders, resume, figures)
    with locked_folder(out, wait=ENDING if resume else 0.0), RowStore(Path(out)) as store:
        remove_partial_files(Path(out))
        return run.run(store, kernels, workers, on, progress, load_reference(path))


class _TableRun:
    """Run of a table into a folder."""

    def __init__(self, table: Table, folder: Path, folders: bool, resume: bool, figures: Figures) -> None:
        self.table, self.folder, self.folders, self.resume, self.figures = table, folder, folders, resume, figures
        self._inputs: dict[int, dict[str, Any]] = {}  # of the rows under way

    def run(
        self,
        store: RowStore,
        kernels: set[str],
        workers: int | None,
        on: str | None,
        progress: bool,
        reference: Mapping[str, Mapping[str, float]],
    ) -> StoredRows:
        """Run the rows that are not solved yet, and write the files of the whole table."""
        cases = self.table.cases
        entries = [Entry(case.number, case.name, hash_of(case.hash)) for case in cases]
        done = store.begin(entries, {"rows": self.table.rows, "units": self.table.units}, self.resume)
        if self.folders:
            lost = [case.number for case in cases if case.number in done and not _is_solved(self.folder / case.name)]
            store.drop(lost)
            done -= set(lost)
        left = [case for case in cases if case.number not in done]
        try:
            if left:
                self._run_rows(left, store, kernels, workers, on, progress)
        finally:
            rows = write_files(self.folder, store)
        self._draw(rows, reference)
        return rows

    def _run_rows(
        self,
        cases: Sequence[TableCase],
        store: RowStore,
        kernels: set[str],
        workers: int | None,
        on: str | None,
        progress: bool,
    ) -> None:
        """Run rows, and store each one when it comes."""
        copies = on is None and in_two_processes() and can_copy()
        if on is None:
            from fsm.run.warm_up import compile_ahead

            compile_ahead(sorted(kernels), progress)
        if copies:
            ready(self.figures != "none")
        total = len(self.table.cases)
        with (
            _progress(total, total - len(cases), progress) as report,
            closing(run_rows(_Jobs(self, cases), on=on, workers=workers, copies=copies)) as found,
        ):
            for one in found:
                case = cases[one.number]
                row = self._row(case, one)
                store.put(case.number, row)
                report(row)

    def job(self, case: TableCase) -> Job:
        """Job of a row."""
        where, loaded = self.folder / case.name, case.loaded
        self._inputs[case.number] = inputs_of(loaded.case, case.overrides, self.table.units)
        drawn = self.figures == "all" or (self.figures == "first" and case is self.table.cases[0])
        if not self.folders:
            return Job(loaded)
        same = self.resume and _same_case(where, loaded.text) and not (where / FAILURE).exists()
        return Job(loaded, where, same, drawn)

    def _row(self, case: TableCase, found: Row) -> dict[str, Any]:
        """Row of the summary: name, cells, numbers, and the error if there is one."""
        row: dict[str, Any] = {"case": case.name, **self._inputs.pop(case.number), **flat_numbers(found.summary)}
        where, error = self.folder / case.name, found.error
        if self.folders and not error and not (where / SUMMARY).is_file():
            error = f"its worker wrote {where} on another machine; give a folder that all machines share, or --keep none"
        if error:
            row |= {"error": error, "exit_code": found.exit_code or 2}
            if self.folders:
                with suppress(OSError):  # the folder may be unwritable, which may be the error itself
                    with atomic_write(where / FAILURE) as part:
                        part.write_text(f"{error}\n{found.trace}", encoding="utf-8")
                    row["error"] += f" (more in {where / FAILURE})" if found.trace else ""
        return row

    def _draw(self, rows: Sequence[Mapping[str, Any]], reference: Mapping[str, Mapping[str, float]]) -> None:
        """Draw the figures of the whole table."""
        if self.folders:
            _plot_overlay(self.folder, rows)
        films = [row for row in rows if row.get("frequency_hz") is not None]
        if films:
            from fsm.views.plots.study import plot_study

            plot_study(films, self.table.units, reference, _figure(self.folder / STUDY))
        if self.figures != "none" and any(row.get("peak_force") is not None for row in rows):
            from fsm.views.plots.parameters import plot_parameters

            plot_parameters(rows, self.table.units, _figure(self.folder / PEAKS))


class _Jobs:
    """Jobs of rows, each made when it is asked for."""

    def __init__(self, run: _TableRun, cases: Sequence[TableCase]) -> None:
        self.run, self.cases = run, cases

    def __len__(self) -> int:
        return len(self.cases)

    def __iter__(self) -> Iterator[Job]:
        return map(self.run.job, self.cases)


def write_files(folder: Path, store: RowStore) -> StoredRows:
    """Write the files of a table from its finished rows, and return these rows."""
    rows = store.rows()
    write_summaries(folder, rows, store.about().get("units", {}))
    write_extremes(folder, rows)
    return rows


def merge_tables(parts: Sequence[Path], out: Path) -> tuple[StoredRows, int]:
    """Join the results of parts of a table in one folder; folders of rows stay in those of the parts.

    Returns
    -------
    sequence of dict
        Rows as `run_table` returns them.
    int
        Number of rows of the table that no part has finished.

    Raises
    ------
    CaseError
        A folder is no part of a table, or two parts have rows of different cases under one number.
    """
    if out.resolve() in [folder.resolve() for folder in parts]:
        raise CaseError("is a part itself; give another folder", f"--out {out}")
    found: dict[int, tuple[Entry, Path, bool]] = {}
    about: dict[str, Any] = {}
    for folder in parts:
        with locked_folder(folder), RowStore(folder, make=False) as store:
            about = store.about()
            for entry, row in store.results():
                other = found.get(entry.number)
                if other is not None and other[0] != entry:
                    text = f"row {entry.number + 1} is {entry.name!r}, in another part another case; run both from one table"
                    raise CaseError(text, str(folder))
                if other is None or other[2]:  # a row that was repeated elsewhere
                    found[entry.number] = entry, folder, bool(row.get("error"))
    with locked_folder(out), RowStore(out) as joined:
        joined.begin([found[number][0] for number in sorted(found)], about, keep=False)
        for folder in dict.fromkeys(parts):
            with locked_folder(folder), RowStore(folder, make=False) as store:
                for entry, row in store.results():
                    if found[entry.number][1] == folder:
                        joined.put(entry.number, row)
        return write_files(out, joined), about.get("rows", 0) - len(found)


def part_of(text: str | None) -> tuple[int, int]:
    """Number of a part, and number of parts, from "3/10"; (1, 1) without a text."""
    if text is None:
        return 1, 1
    match = re.fullmatch(r"\s*(\d+)\s*/\s*(\d+)\s*", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise CaseError(f'"{text}" is no part of a table; write K/N with K from 1 to N, for example 3/10', "--part")
    return int(match[1]), int(match[2])


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


def _same_case(folder: Path, text: str) -> bool:
    """Whether the folder belongs to the same case."""
    try:
        return (folder / RESOLVED).read_text(encoding="utf-8") == text
    except (OSError, UnicodeDecodeError):
        return False


def _compile(table: Table, source: str) -> set[str]:
    """Compile the first row of each kind, so that faults of the base case are found before a row runs.

    Rows with numbers in the same cells and the same texts in the others are of one kind. A fault that only the compilation
    of another row finds is the error of this row.

    Returns
    -------
    set of str
        Kinds of kernels that the cases use, see `fsm.run.warm_up.KINDS`.
    """
    from fsm.run.run_case import compile_case

    kinds: dict[tuple[tuple[str, str], ...], TableCase] = {}
    for case in table.cases:
        kinds.setdefault(tuple((path, _NUMBER.sub("0", cell)) for path, cell in case.overrides.items()), case)
    faults, kernels = [], set[str]()
    for case in itertools.islice(kinds.values(), _MOST_KINDS):
        try:
            kernels.update(compile_case(case.loaded)[0].kernels)
        except CaseError as error:
            faults += [Fault(f"{case.name}: {f.path}" if f.path else case.name, f.message) for f in error.faults]
        except MemoryError as error:
            faults.append(Fault(case.name, str(OutOfMemory(error))))
    if faults:
        raise CaseError(faults, source)
    return kernels


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
