"""Runs of a study on all cores or on a cluster: the one place that knows where rows run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from typing import NamedTuple

from fsm.case.loading.load_case import LoadedCase
from fsm.errors import CaseError, FsmError
from fsm.run.workers import run_jobs
from fsm.studies.problem import Problem, Run, evaluate
from fsm.views.plots.beside import can_copy
from fsm.views.plots.drawing import in_two_processes


class _Job(NamedTuple):
    """A problem and the values (SI) of its paths; for other machines also the case, because they may not have its files."""

    problem: Problem
    point: dict[str, float]
    loaded: LoadedCase | None


def run_all(
    problem: Problem, points: Sequence[dict[str, float]], workers: int | None, on: str | None = None
) -> Iterator[tuple[int, Run | None, str]]:
    """Number, result and error of each run in the order of completion; a run that fails has no result.

    Parameters
    ----------
    problem : Problem
    points : values (SI) of each run
    workers : number of processes; 1: this process alone
    on : cluster, see `fsm.run.workers.run_jobs`
    """
    if workers == 1 and on is None:
        yield from _in_this_process(problem, points)
        return
    jobs = [_Job(problem, point, None) for point in points] if on is None else (_with_case(problem, one) for one in points)
    copies = on is None and in_two_processes() and can_copy()
    with closing(run_jobs(_solve, jobs, workers, copies, on)) as outcomes:
        for outcome in outcomes:
            yield outcome.job, outcome.value, " ".join(outcome.error or ())


def _with_case(problem: Problem, point: dict[str, float]) -> _Job:
    """Job with its case; a faulty case is reported by the worker, as all others."""
    loaded = None
    if problem.tables is not None:
        with suppress(CaseError):
            loaded = problem.case(point)
    return _Job(problem, point, loaded)


def _in_this_process(problem: Problem, points: Sequence[dict[str, float]]) -> Iterator[tuple[int, Run | None, str]]:
    for number, point in enumerate(points):
        try:
            run, error = evaluate(problem, point), ""
        except FsmError as failure:
            run, error = None, " ".join(str(failure).splitlines())
        yield number, run, error


def _solve(job: _Job) -> Run:
    return evaluate(*job)
