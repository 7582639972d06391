"""One case from description to files: the glue between scene, compiler, solver, results and plots."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from fsm import __version__
from fsm.analyses.analysis import Analysis
from fsm.analyses.choose import analysis_of
from fsm.analyses.deploy import Deployment
from fsm.analyses.deployed import film_of_deployment
from fsm.analyses.vibrate import VibrationAnalysis
from fsm.atomic_write import remove_partial_files
from fsm.errors import CaseError, ExpectationFailed
from fsm.folder_lock import locked_folder
from fsm.kernels import jit
from fsm.plots.figures import draw
from fsm.progress import say_anew, saying_what_compiles
from fsm.recorder import RecordedSolve
from fsm.results.curve import Curve
from fsm.results.export import write_contact_csv, write_force_csv, write_history_csv, write_points_csv
from fsm.results.quantities import touching_pairs
from fsm.results.solution import Solution
from fsm.results.store import part_path, read_solution
from fsm.results.summary_file import SUMMARY, write_summary
from fsm.scene.load_case import LoadedCase
from fsm.summary import joined, missed_expectations

__all__ = ["ENDING", "run_case", "run_in_locked_folder"]

ENDING = 30.0
"""Seconds that a run which goes on waits for the end of the one that was interrupted; that one writes its checkpoint."""


def run_case(
    loaded: LoadedCase, out: Path, *, progress: bool | Callable[[float], None] = True, resume: bool = False
) -> dict[str, Any]:
    """Run a case and write result.h5, summary.json, curves as CSV and plots into `out`.

    Which curves and plots depends on what there is: motion.png, energy.png of a deployment; force.csv and force.png
    with a drive, dynamic_force.csv if some of it is a motion; contact.csv and contact.png with a contact that carries
    force in a record; history.csv, history.png, spectrum.png, modes.png, tension.png and energy.png of a film.

    Parameters
    ----------
    loaded : LoadedCase
        With `stages`, each has a folder of its own in `out`, and summary.json is of both.
    out : folder for the results, made if needed
    progress : bool or callable
        A bar on standard error, or called with the fraction done.
    resume : bool
        Go on from the last checkpoint in `out` if there is one of this very case: to the bit as if it had never stopped,
        but that times in the summary are those of the last part. Of a case that is solved, only curves and plots are
        written. What is there of another case is begun anew, and said with the progress bar.

    Returns
    -------
    dict
        What summary.json holds.

    Raises
    ------
    CaseError
        Nothing has been written.
    CannotWrite
        Another run writes into `out`, or a file cannot be written.
    NotConverged, EnergyAbort
        What was solved until then is in result.part.h5.
    ExpectationFailed
        Everything has been written.
    KeyboardInterrupt
        A checkpoint has been written.
    """
    with locked_folder(out, wait=ENDING if resume else 0.0):
        return run_in_locked_folder(loaded, Path(out), progress=progress, resume=resume)


def run_in_locked_folder(
    loaded: LoadedCase, out: Path, *, progress: bool | Callable[[float], None] = True, resume: bool = False
) -> dict[str, Any]:
    """Do what `run_case` does, where the caller holds the lock on `out`."""
    if loaded.case.stages:
        summary = _run_stages(loaded, out, progress, resume)
    else:
        begun, warnings = _clocks(), list[str]()
        with saying_what_compiles(progress, _title(loaded), jit):
            analysis = analysis_of(loaded.case, str(loaded.path), warnings)
        summary = _run_analysis(loaded, analysis, out, progress, resume, warnings, begun).summary
    failed = missed_expectations(loaded.case, summary)
    if failed:
        raise ExpectationFailed("\n".join(failed))
    return summary


def _run_analysis(
    loaded: LoadedCase,
    analysis: Analysis,
    out: Path,
    progress: bool | Callable[[float], None],
    resume: bool,
    warnings: list[str],
    begun: tuple[float, float],
) -> Solution:
    """Solve one analysis and write all that there is of it into its folder; with `resume` not again what is solved."""
    solution = _solved(loaded, out, progress) if resume else None
    if solution is not None:
        remove_partial_files(out)
        _write(solution, out)
        return solution
    with saying_what_compiles(progress, _title(loaded), jit):
        analysis.make_ready(warnings)
    out.mkdir(parents=True, exist_ok=True)
    remove_partial_files(out)
    solution = RecordedSolve(loaded, analysis, out, resume, warnings).run(progress, *begun)
    _write(solution, out)
    return solution


def _run_stages(
    loaded: LoadedCase, out: Path, progress: bool | Callable[[float], None], resume: bool
) -> dict[str, Any]:
    """Deploy, and let what is deployed vibrate, each in a folder of its own; both summaries together."""
    case, source = loaded.case, str(loaded.path)
    (out / SUMMARY).unlink(missing_ok=True)
    begun, warnings = _clocks(), list[str]()
    with saying_what_compiles(progress, _title(loaded), jit):
        deployment = analysis_of(case, source, warnings)
    first = _run_analysis(loaded, deployment, out / "deploy", progress, resume, warnings, begun)
    begun = _clocks()
    assert isinstance(deployment, Deployment)
    vibration = VibrationAnalysis(case, source, film_of_deployment(case, first, deployment.system))
    second = _run_analysis(loaded, vibration, out / "vibrate", progress, resume, [], begun)
    summary = joined(first.summary, second.summary)
    write_summary(summary, out / SUMMARY)
    return summary


def _clocks() -> tuple[float, float]:
    """What time it is, and how much of it went into compiling, s."""
    return time.perf_counter(), jit.compile_time()


def _title(loaded: LoadedCase) -> str:
    return loaded.case.title or str(loaded.path)


def _solved(loaded: LoadedCase, folder: Path, progress: bool | Callable[[float], None]) -> Solution | None:
    """The results of this very case, by this version, if they are there and nothing newer was begun."""
    result = folder / "result.h5"
    if not result.is_file() or part_path(result).is_file():
        return None
    try:
        solution = read_solution(result)
    except CaseError:  # damaged: solved again
        return None
    if solution.layout.case_text != loaded.text:
        say_anew(progress, result)
        return None
    return solution if solution.layout.provenance.get("fsm") == __version__ else None


def _write(solution: Solution, out: Path) -> None:
    """Curves, plots, and summary.json last and whole, so that its presence means the case is done."""
    curve = Curve.of_solution(solution)
    tables: dict[str, Callable[[Solution, Path], None] | None] = {
        "force.csv": write_force_csv if solution.travel.shape[1] else None,
        "dynamic_force.csv": (
            partial(write_force_csv, dynamic=True) if curve.has_quasi_static and curve.dynamic.any() else None
        ),
        "contact.csv": write_contact_csv if touching_pairs(solution.pair_force) else None,
        "history.csv": write_history_csv if len(solution.samples.time) else None,
        "points.csv": write_points_csv if solution.array is not None else None,
    }
    for name, write in tables.items():
        if write is not None:
            write(solution, out / name)
        else:  # that of another run in this folder
            (out / name).unlink(missing_ok=True)
    draw(solution, out)
    write_summary(solution.summary, out / SUMMARY)
