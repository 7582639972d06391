"""Study of a case: from its file to its runs and results."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fsm.case.loading.model_file import read_file
from fsm.case.loading.toml_file import read_text, read_toml
from fsm.case.models.study import StudyFile
from fsm.errors import CaseError
from fsm.io.folder_lock import ENDING, locked_folder
from fsm.studies.problem import Problem, Run, case_problem, evaluate, function_problem, nominal_value, run_all
from fsm.studies.result import StudyResult
from fsm.studies.scatter import Design, Scatter, correlation_matrix, design_of, scatter_of
from fsm.studies.search import Journal
from fsm.studies.write import write_study


def run_study(
    path: str | Path,
    out: str | Path,
    overrides: Sequence[str] = (),
    workers: int | None = None,
    resume: bool = False,
    progress: bool = True,
    page: bool = True,
    on: str | None = None,
) -> StudyResult:
    """Run a study and write its tables, figures and page.

    Parameters
    ----------
    path : study file
    out : folder for the results
    overrides : ``"path=value"`` texts for all runs, after those of the file
    workers : number of processes; default: the number of cores
    resume : whether to keep finished runs of the same study in `out`
    progress : whether to show progress on standard error
    page : whether to draw figures and to write the page
    on : cluster, see `fsm.run.workers.run_jobs`; default: this machine

    Raises
    ------
    CaseError
        The study or its case have faults, or the nominal run failed with one; no other run was made.
    FsmError
        The nominal run failed.
    CannotWrite
        A file cannot be written; finished runs are kept.
    """
    path, out = Path(path), Path(out)
    file = read_file(path, StudyFile)
    problem, scatters, design, text = _prepare(file, path, overrides)
    with locked_folder(out, wait=ENDING if resume else 0.0):
        journal = Journal(out, problem, text, resume)
        nominal = _nominal(problem, scatters, journal)
        runs, errors = _run(problem, design, scatters, journal, workers, on, progress)
        result = StudyResult(file, path, scatters, design, nominal, runs, errors)
        write_study(result, out, page)
    return result


def _prepare(file: StudyFile, path: Path, overrides: Sequence[str]) -> tuple[Problem, list[Scatter], Design, str]:
    """Problem, scatter of the parameters, design, and the text that identifies the problem."""
    folder, paths = path.parent, [one.path for one in file.parameter]
    if file.case is not None:
        case = folder / file.case
        problem, base = case_problem(read_toml(case), case, [*file.set, *overrides], paths, file.response, str(path), True)
        text = base.text
        nominal = {one: nominal_value(problem, base, one) for one in paths}
    else:
        assert file.function is not None
        if file.set or overrides:
            raise CaseError("set changes a case; a function has none", str(path))
        units = {one.path: one.unit for one in file.parameter}
        problem = function_problem(file.function, folder, units, file.response, str(path))
        text, nominal = read_text(problem.source), dict.fromkeys(paths)
    try:
        scatters = [
            scatter_of(one, k, problem, nominal[one.path], file.level, folder) for k, one in enumerate(file.parameter)
        ]
        correlation = correlation_matrix(file.parameter, file.correlation, folder)
        design = design_of(file.design, scatters, correlation, problem, file.seed, folder)
    except CaseError as error:
        raise CaseError(error.faults, error.source or str(path)) from None
    return problem, scatters, design, text


def _nominal(problem: Problem, scatters: Sequence[Scatter], journal: Journal) -> Run:
    """Run with the nominal values: it finds faults of responses and compiles kernels before other processes start."""
    values = {one.path: one.nominal for one in scatters}
    run = journal.find(values)
    if run is None:
        try:
            run = evaluate(problem, values)
        except CaseError as error:
            raise CaseError(error.faults, error.source or str(problem.source)) from None
        journal.add(values, run)
    return run


def _run(
    problem: Problem,
    design: Design,
    scatters: Sequence[Scatter],
    journal: Journal,
    workers: int | None,
    on: str | None,
    progress: bool,
) -> tuple[list[Run | None], list[str]]:
    """All runs of the design and their errors; finished runs of the journal are not repeated."""
    points = [dict(zip((one.path for one in scatters), row, strict=True)) for row in design.values.tolist()]
    runs = [journal.find(point) for point in points]
    errors = [""] * len(runs)
    left = [k for k, run in enumerate(runs) if run is None]
    with _progress(len(runs), len(runs) - len(left), progress) as report:
        for number, run, error in run_all(problem, [points[k] for k in left], workers, on) if left else ():
            runs[left[number]], errors[left[number]] = run, error
            if run is not None:
                journal.add(points[left[number]], run)
            report()
    return runs, errors


@contextmanager
def _progress(total: int, done: int, show: bool) -> Iterator[Callable[[], None]]:
    """Function that counts a finished run in a bar on standard error."""
    if not show:
        yield lambda: None
        return
    from tqdm import tqdm

    with tqdm(total=total, initial=done, unit="run", mininterval=1.0, file=sys.stderr) as bar:
        yield lambda: bar.update() and None
