"""Steps of a run, for all analyses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fsm.case.models.steps import Kind
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.statics.arc_length import ArcSettings

States = dict[str, np.ndarray]
"""Poses, rates, nodes and memory at the end of a step, from which the next step begins."""


@dataclass(frozen=True)
class RunStep:
    """Step of a run.

    Attributes
    ----------
    name, kind : see `fsm.case.models.steps.Step`
    start, end : s
    method, reason : method of the solver, and the reason
    settings : settings of the solver; None if nothing is solved
    record_times, sample_times : times of records and of samples of probes, s
    modes : number of natural modes
    """

    name: str
    kind: Kind
    start: float
    end: float
    method: str
    reason: str
    settings: Settings | PathSettings | ArcSettings | None
    record_times: list[float]
    sample_times: list[float] = field(default_factory=list)
    modes: int = 0


@dataclass
class StepResult:
    """Result of a step, for the summary and for a restart.

    Attributes
    ----------
    name, kind, method, start, end : see `RunStep`
    counters : counters of the solver
    n_points : number of points of the curve at the end of the step
    events, frequencies : events, and natural frequencies in Hz
    path : program time, stability and loads at all points of a path by arc length (`fsm.solve.statics.arc_run`)
    loads : size of every load at the end, and displacement of its point along the load since the start of the step
    """

    name: str
    kind: str
    method: str
    start: float
    end: float
    counters: dict[str, Any]
    n_points: int
    events: list[dict[str, Any]] = field(default_factory=list)
    frequencies: list[float] = field(default_factory=list)
    path: dict[str, Any] = field(default_factory=dict)
    loads: dict[str, tuple[float, float]] = field(default_factory=dict)


