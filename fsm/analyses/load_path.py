"""Loads over their displacements along a static step, from its records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fsm.results.solution import Solution
from fsm.segments.system import SegmentSystem
from fsm.solve.run_io import CurvePoint

__all__ = ["static_load_path"]


def static_load_path(
    system: SegmentSystem, whole: SegmentSystem, solution: Solution, number: int, points: Sequence[CurvePoint]
) -> dict[str, Any]:
    """Program time, negative modes, and size and displacement of every load at the equilibria that a static step has saved.

    Parameters
    ----------
    system, whole : system of the step, and of all steps
    solution : records so far
    number : number of the step, from 1
    points : points of the curve of the step; they show which states are equilibria and which belong to a snap

    Returns
    -------
    dict
        Arrays as in `fsm.solve.arc_run.ArcRun.loads`; the dict is empty if no load changes in the step.
    """
    records = np.flatnonzero(solution.step == number)
    moving = {point.time for point in points if point.path % 2}
    records = records[[float(t) not in moving for t in solution.time[records]]]
    if not len(records):
        return {}
    origin = max(int(records[0]) - 1, 0) if number > 1 else int(records[0])  # this is the last record of the previous step
    first = _state(system, whole, solution, origin)
    ways: dict[str, list[list[float]]] = {}
    for record in records.tolist():
        here = _state(system, whole, solution, record)
        for name, pair in system.load_displacements(first, here).items():
            ways.setdefault(name, []).append(list(pair))
    if all(len({size for size, _ in rows}) == 1 for rows in ways.values()):
        return {}
    negative = [int(count) for count in solution.negative_pivots[records]]
    return {"time": solution.time[records].tolist(), "negative_modes": negative, "loads": ways}


def _state(system: SegmentSystem, whole: SegmentSystem, solution: Solution, record: int) -> tuple[float, np.ndarray]:
    """Time of a record, and its configuration in the system of the step."""
    t, q = float(solution.time[record]), solution.q[record]
    if system is not whole:
        q, _ = system.from_states(whole.all_states(t, q, np.zeros(whole.nu)))
    return t, q
