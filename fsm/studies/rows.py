"""Runs of a study on all cores: the one place that knows where rows run."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import closing

from fsm.errors import FsmError
from fsm.run.pool import run_jobs
from fsm.studies.problem import Problem, Run, evaluate
from fsm.views.plots.beside import can_copy
from fsm.views.plots.drawing import in_two_processes

Job = tuple[Problem, dict[str, float]]
"""A problem and the values (SI) of its paths."""


def run_all(
    problem: Problem, points: Sequence[dict[str, float]], workers: int | None
) -> Iterator[tuple[int, Run | None, str]]:
    """Number, result and error of each run in the order of completion; a run that fails has no result."""
    if workers == 1:
        yield from _in_this_process(problem, points)
        return
    jobs: list[Job] = [(problem, point) for point in points]
    copies = in_two_processes() and can_copy()
    with closing(run_jobs(_solve, jobs, min(workers or os.cpu_count() or 1, len(jobs)), copies)) as outcomes:
        for outcome in outcomes:
            yield outcome.job, outcome.value, " ".join(outcome.error or ())


def _in_this_process(problem: Problem, points: Sequence[dict[str, float]]) -> Iterator[tuple[int, Run | None, str]]:
    for number, point in enumerate(points):
        try:
            run, error = evaluate(problem, point), ""
        except FsmError as failure:
            run, error = None, " ".join(str(failure).splitlines())
        yield number, run, error


def _solve(job: Job) -> Run:
    return evaluate(*job)
