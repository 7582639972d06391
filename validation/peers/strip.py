"""The compared strip, the models of fsm, and the difference of a force curve from the converged curve."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem
from fsm.solve.equations.newton import equilibrium
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

try:
    from fsm.solve.settings import PathSettings
    from fsm.solve.statics.static import follow
except ImportError:  # not there yet
    follow = None  # type: ignore[assignment]

__all__ = [
    "FSM_METHODS",
    "TRAVELS",
    "Curve",
    "FsmMethod",
    "Times",
    "distance",
    "fsm_curve",
    "static_path",
    "strip_case",
    "timed_runs",
]

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
STRIP = ("strip.thickness=1e-4", "strip.half_cell=false", "crease.stiffness=0.02", "expect=none")
FREE = "contact=none"
PRESSED = "contact.pairs=[[3,4]]"
TRAVELS = np.linspace(0.0, 0.04, 81)
LONG = 2.0
"""Runs of more seconds are measured once."""
AT_LEAST = 0.1
MOST = 50
"""Short runs are repeated up to this time (s) and up to this number of times."""

Curve = tuple[np.ndarray, np.ndarray]
"""Travel (m), increasing, and pull force (N)."""


def strip_case(segments: int, contact: bool = False, spatial: bool = False, overrides: Sequence[str] = ()) -> Case:
    """The trial strip with a third of its thickness, nearly rigid creases and no half-cell correction."""
    own = [*STRIP, PRESSED if contact else FREE, f"strip.segments_per_panel={segments}"]
    return load_case(CASE, [*own, f"solve.spatial={str(spatial).lower()}", *overrides]).case


@dataclass(frozen=True)
class Times:
    """Median and shortest time of `runs` runs, s; they differ if the machine does other work."""

    median: float
    shortest: float
    runs: int


@dataclass(frozen=True)
class FsmMethod:
    """A way fsm solves.

    Attributes
    ----------
    run : function of a system and a setting that returns the curve
    settings, unit : the varied settings, and the name of the quantity
    overrides : changes of the case
    contact : whether the method can solve a case with contact
    most, most_in_space : largest number of segments per panel that is measured
    """

    run: Callable[[SegmentSystem, Any], Curve]
    settings: tuple[Any, ...]
    unit: str
    overrides: tuple[str, ...] = ()
    contact: bool = False
    most: int = 1000
    most_in_space: int = 1000


def _radau(system: SegmentSystem, rtol: float) -> Curve:
    motion = system.motions[0]
    times = [motion.time_of(float(x)) for x in TRAVELS]
    saved: list[tuple[float, float]] = []
    simulate(
        system,
        Settings("Radau", rtol, motion.end_time),
        times,
        lambda state: saved.append((state.observation.drive.travel[0], state.observation.drive.force[0])),
    )
    travel, force = np.array(saved).T
    return travel, force


def _equilibrium(system: SegmentSystem, steps: int) -> Curve:
    motion = system.motions[0]
    times = np.array([motion.time_of(float(x)) for x in np.linspace(0.0, motion.travel, steps + 1)])
    found: list[tuple[float, float]] = []

    def keep(t: float, q: np.ndarray) -> None:
        drive = system.observe(t, q, None).drive
        found.append((drive.travel[0], drive.force[0]))

    equilibrium(system, system.initial()[0], times, on_state=keep)
    travel, force = np.array(found).T
    return travel, force


def static_path(system: SegmentSystem, rtol: float, first: float = 2e-3) -> Curve:
    """All states of the path, without requested states; `first`: travel of the first step, m."""
    motion = system.motions[0]
    statistics, _ = follow(system, PathSettings(motion.end_time, motion.time_of(first), rtol=rtol), [], lambda state: None)
    travel = np.array([drive.travel[0] for drive, *_ in statistics.points])
    force = np.array([drive.force[0] for drive, *_ in statistics.points])
    return travel, force


FSM_METHODS: dict[str, FsmMethod] = {
    "Radau": FsmMethod(_radau, (1e-4,), "rtol", contact=True, most=10, most_in_space=4),
    "Newton at even travels": FsmMethod(_equilibrium, (5, 7, 10, 14, 20, 40, 80), "steps"),
}
"""Methods of fsm by name: a function of (system, setting) that gives (travel, force), and its settings."""
if follow is not None:
    # the damping of the springs, 0.1 % of the force, is omitted; Radau needs it
    FSM_METHODS["static"] = FsmMethod(static_path, (1e-2, 1e-3, 1e-4, 1e-6), "rtol", ("material.damping=0",), contact=True)


def fsm_curve(case: Case, method: str, setting: Any, repeat: int = 1) -> tuple[Times, np.ndarray, np.ndarray]:
    """Times of the solver of fsm, without building and compiling the case; travel (m) and pull force (N)."""
    _, system = compile_case(case)
    times, (travel, force) = timed_runs(lambda: _clocked(FSM_METHODS[method].run, system, setting), repeat)
    return times, travel, force


def _clocked(run: Callable[..., Curve], *arguments: Any) -> tuple[float, Curve]:
    begun = time.perf_counter()
    curve = run(*arguments)
    return time.perf_counter() - begun, curve


def timed_runs(run: Callable[[], tuple[float, Curve]], repeat: int) -> tuple[Times, Curve]:
    """Times of `repeat` runs after a warm-up run; more runs if they are short, and one run if it is long."""
    run()
    first, curve = run()
    count = max(repeat, min(MOST, round(AT_LEAST / first))) if repeat > 1 and first < LONG else 1
    seconds = [first, *(run()[0] for _ in range(count - 1))]
    return Times(statistics.median(seconds), min(seconds), count), curve


def distance(curve: Curve, reference: Curve) -> float:
    """RMS difference of two force curves at `TRAVELS`, by cubic interpolation, over the peak of the reference."""
    wanted = _at_travels(reference)
    return float(np.sqrt(np.mean((_at_travels(curve) - wanted) ** 2)) / np.abs(wanted).max())


def _at_travels(curve: Curve) -> np.ndarray:
    travel, force = curve
    new = np.concatenate([[True], np.diff(np.maximum.accumulate(travel)) > 1e-12])
    return np.asarray(CubicSpline(travel[new], force[new])(TRAVELS))
