"""Run of one case, from its description to files: compiler, solver, results and plots."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from fsm.analyses.analysis import Analysis
from fsm.analyses.choose import analysis_of
from fsm.analyses.deploy import Deployment
from fsm.case.derived.recorded import records_channels
from fsm.case.loading.load_case import LoadedCase
from fsm.case.models.case import Case
from fsm.errors import CaseError, EnergyAbort, ExpectationFailed, NotConverged
from fsm.io.atomic_write import remove_partial_files
from fsm.io.folder_lock import ENDING, locked_folder
from fsm.io.provenance import fsm_version
from fsm.kernels import jit
from fsm.registry import load_extensions
from fsm.results.channel import write_channels_csv
from fsm.results.export import when_columns, write_contact_csv, write_force_csv, write_history_csv, write_points_csv
from fsm.results.quantities import touching_pairs
from fsm.results.reported import write_events_csv
from fsm.results.solution import Solution
from fsm.results.step_data import write_load_path_csv
from fsm.results.store import part_path, read_solution
from fsm.results.summary_file import SUMMARY, write_summary
from fsm.run.progress import report_compilation, report_restart
from fsm.run.recorder import OnState, RecordedSolve
from fsm.run.summary import joined, missed_expectations
from fsm.views.plots.figures import begin_drawing, remove_figures


class Finished(NamedTuple):
    """Run that has ended.

    Attributes
    ----------
    summary : dict
        Content of summary.json.
    solution : Solution
        Result; of a case with stages, that of the first one.
    missed : list of str
        Numbers that missed their bounds.
    """

    summary: dict[str, Any]
    solution: Solution
    missed: list[str]


def run_case(
    loaded: LoadedCase,
    out: Path,
    *,
    progress: bool | Callable[[float], None] = True,
    resume: bool = False,
    figures: bool = True,
) -> dict[str, Any]:
    """Run a case and write result.h5, summary.json, curves as CSV and plots into `out`.

    The curves and plots depend on the case. A deployment has motion.png and energy.png. A drive adds force.csv and
    force.png, and dynamic_force.csv if part of the curve is dynamic. Contact that carries force in a record adds
    contact.csv and contact.png. A film has history.csv, history.png, spectrum.png, modes.png, tension.png and energy.png.

    Parameters
    ----------
    loaded : LoadedCase
        With `stages`, each stage has its own folder in `out`, and summary.json covers both.
    out : folder for the results, created if it does not exist
    progress : bool or callable
        Whether to show a bar on standard error, or a function that receives the completed fraction.
    resume : bool
        Restart from the last checkpoint in `out` if it belongs to the same case. The result is the same to the last bit;
        only the times in the summary cover the last part alone. If the case is already solved, only curves and plots are
        written. If the files belong to another case, the run starts from the beginning and reports it with the progress.
    figures : bool
        Whether to draw figures, in the style and format of `fsm.views.plots.drawing`; else figures of an earlier run are
        deleted.

    Returns
    -------
    dict
        Content of summary.json.

    Raises
    ------
    CaseError
        The case has faults; no file was written.
    CannotWrite
        Another run writes into `out`, or a file cannot be written.
    NotConverged, EnergyAbort
        The solve stopped; result.part.h5 holds its records.
    ExpectationFailed
        A number missed its bounds; all files were written.
    KeyboardInterrupt
        The run was interrupted; a checkpoint was written.
    """
    with locked_folder(out, wait=ENDING if resume else 0.0):
        done = run_in_locked_folder(loaded, Path(out), progress=progress, resume=resume, figures=figures)
    if done.missed:
        raise ExpectationFailed("\n".join(done.missed))
    return done.summary


def run_in_locked_folder(
    loaded: LoadedCase,
    out: Path | None,
    *,
    progress: bool | Callable[[float], None] = True,
    resume: bool = False,
    figures: bool = True,
    on_state: OnState | None = None,
) -> Finished:
    """Run a case as `run_case` does, for a caller that already holds the lock on `out`, or without files (None).

    `on_state` receives every state of the equilibrium paths of a case without stages.
    """
    # another process may have read the case
    _, faults = load_extensions(loaded.case.extensions, loaded.path.parent)
    if faults:
        raise CaseError(faults, str(loaded.path))
    begun, warnings = _clocks(), _file_notes(loaded.case)
    with report_compilation(progress, _title(loaded), jit):
        analysis, found = compile_case(loaded)
    warnings += found
    if records_channels(loaded.case, getattr(analysis, "scene", None)):
        from fsm.channels.sample import check_patterns  # this import loads all kinds of elements

        check_patterns(loaded.case, str(loaded.path), analysis)
    if loaded.case.event:
        from fsm.channels import conditions, sample

        conditions.EventWatch(sample.model_of_analysis(analysis), str(loaded.path))  # faults before any file is written
    if loaded.case.stages:
        summary, solution = _run_stages(loaded, analysis, out, progress, resume, figures, warnings, begun)
    else:
        solution = _run_analysis(loaded, analysis, out, progress, resume, figures, warnings, begun, on_state)
        summary = solution.summary
    return Finished(summary, solution, missed_expectations(loaded.case, summary))


def compile_case(loaded: LoadedCase) -> tuple[Analysis, list[str]]:
    """Compiled case, and warnings on changed values."""
    warnings: list[str] = []
    return analysis_of(loaded.case, str(loaded.path), warnings), warnings


def _run_analysis(
    loaded: LoadedCase,
    analysis: Analysis,
    out: Path | None,
    progress: bool | Callable[[float], None],
    resume: bool,
    figures: bool,
    warnings: list[str],
    begun: tuple[float, float],
    on_state: OnState | None = None,
) -> Solution:
    """Solve one analysis and write its files, if there is a folder; with `resume`, read an existing solution instead."""
    solution = _solved(loaded, out, progress) if resume and out is not None else None
    if solution is not None and out is not None:
        remove_partial_files(out)
        _write(solution, out, begin_drawing(solution, out, alone=True) if figures else None)
        return solution
    with report_compilation(progress, _title(loaded), jit):
        analysis.initialise(warnings)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        remove_partial_files(out)
    solve = RecordedSolve(loaded, analysis, out, resume, warnings, on_state)
    drawn: list[Callable[[], object]] = []

    def begin_figures(solution: Solution) -> None:
        if figures and out is not None:
            drawn.append(begin_drawing(solution, out, alone=True))

    try:
        solution = solve.run(progress, *begun, begin_figures)
    except (NotConverged, EnergyAbort) as error:  # a warning about the case may state the cause
        if not solve.warnings:
            raise
        raise type(error)(" ".join([f"{error}.", *(f"Warning: {text}." for text in solve.warnings)])) from error
    if out is not None:
        _write(solution, out, drawn[0] if drawn else None)
    return solution


def _run_stages(
    loaded: LoadedCase,
    deployment: Analysis,
    out: Path | None,
    progress: bool | Callable[[float], None],
    resume: bool,
    figures: bool,
    warnings: list[str],
    begun: tuple[float, float],
) -> tuple[dict[str, Any], Solution]:
    """Run the deployment and then the vibration of the deployed strip, each in its own folder.

    Return both summaries in one, and the result of the deployment.
    """
    from fsm.analyses.deployed import film_of_deployment
    from fsm.analyses.vibrate import VibrationAnalysis

    case, source = loaded.case, str(loaded.path)
    if out is not None:
        (out / SUMMARY).unlink(missing_ok=True)
    places = (None, None) if out is None else (out / "deploy", out / "vibrate")
    first = _run_analysis(loaded, deployment, places[0], progress, resume, figures, warnings, begun)
    begun = _clocks()
    assert isinstance(deployment, Deployment)
    vibration = VibrationAnalysis(case, source, film_of_deployment(case, first, deployment.system))
    second = _run_analysis(loaded, vibration, places[1], progress, resume, figures, [], begun)
    summary = joined(first.summary, second.summary)
    if out is not None:
        write_summary(summary, out / SUMMARY)
    return summary, first


def _file_notes(case: Case) -> list[str]:
    """Warnings on what was ignored or changed in the pattern file of a sheet."""
    return [] if case.sheet is None else [f"pattern file: {note}" for note in case.sheet.notes]


def _write_loads(solution: Solution, path: Path) -> None:
    if solution.load_path is not None:
        write_load_path_csv(solution.load_path, path)


def _write_channels(solution: Solution, path: Path) -> None:
    write_channels_csv(solution.channels, when_columns(solution), path)


def _clocks() -> tuple[float, float]:
    """Present clock, and compile time so far, s."""
    return time.perf_counter(), jit.compile_time()


def _title(loaded: LoadedCase) -> str:
    return loaded.case.title or str(loaded.path)


def _solved(loaded: LoadedCase, folder: Path, progress: bool | Callable[[float], None]) -> Solution | None:
    """Results of the same case by the same version; None if there are none or a newer run is unfinished."""
    result = folder / "result.h5"
    if not result.is_file() or part_path(result).is_file():
        return None
    try:
        solution = read_solution(result)
    except CaseError:  # the file is damaged, so the case is solved again
        return None
    if solution.layout.case_text != loaded.text:
        report_restart(progress, result)
        return None
    return solution if solution.layout.provenance.get("fsm") == fsm_version() else None


def _write_events(solution: Solution, path: Path) -> None:
    write_events_csv(solution.summary["joint_events"], path)


def _write(solution: Solution, out: Path, drawn: Callable[[], object] | None) -> None:
    """Write curves, and summary.json last, so that its presence means that the run is complete.

    `drawn` waits for the figures; None if there are none.
    """
    curve = solution.force_curve
    tables: dict[str, Callable[[Solution, Path], None] | None] = {
        "force.csv": write_force_csv if solution.travel.shape[1] else None,
        "dynamic_force.csv": (
            partial(write_force_csv, dynamic=True) if curve.has_quasi_static and curve.dynamic.any() else None
        ),
        "contact.csv": write_contact_csv if touching_pairs(solution.pair_force) else None,
        "history.csv": write_history_csv if len(solution.samples.time) else None,
        "points.csv": write_points_csv if solution.array is not None else None,
        "channels.csv": _write_channels if solution.channels else None,
        "load.csv": _write_loads if solution.load_path is not None else None,
        "events.csv": _write_events if solution.summary.get("joint_events") else None,
    }
    for name, write in tables.items():
        if write is not None:
            write(solution, out / name)
        else:  # this file belongs to an earlier run in the folder
            (out / name).unlink(missing_ok=True)
    if drawn is not None:
        drawn()
    else:  # these files belong to an earlier run in the folder
        remove_figures(out)
    write_summary(solution.summary, out / SUMMARY)
