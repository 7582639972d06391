"""The whole path of the trial strip at every fold angle, mesh and first increment: outcome, peak, jumps, stability.

    python -m validation.strip_trial.paths [--angles 70,72,...] [--segments 5,10,20,40] [--first 0.5] [--limit 300]

Prints a table with a line for each run of 0 to 120 mm. The row of a run states if it ends early, or takes longer than the
limit (s). Saved states every 2 mm are examined again: a state at rest (residual without dampers below 1e-3 of the largest
reaction) whose stiffness is not positive definite is an unstable equilibrium. Exit code 1 means that a run ends early, or
that a state with intersections exists.
"""

from __future__ import annotations

import argparse
import signal
import sys
import time
from pathlib import Path
from types import FrameType

import numpy as np

from fsm.case.loading.load_case import load_case
from fsm.errors import FsmError
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem
from fsm.results.quantities import peak
from fsm.solve.equations.newton import negative_pivots
from fsm.solve.interface.records import DriveState
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import PathSettings
from fsm.solve.statics.static import follow

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
EVERY, AT_REST = 2e-3, 1e-3


class OutOfTime(Exception):
    """A run exceeded its time limit."""


def stop(number: int, frame: FrameType | None) -> None:
    """Handler of the alarm."""
    raise OutOfTime


def strip(angle: float, segments: int) -> SegmentSystem:
    """The trial strip, pulled by 120 mm."""
    changes = ["expect=none", f"strip.segments_per_panel={segments}", f'strip.fold_angle="{angle} deg"']
    return compile_case(load_case(CASE, [*changes, 'drive.0.travel="120 mm"']).case)[1]


def resting_unstably(system: SegmentSystem, state: SavedState, largest: float) -> bool:
    """Whether a state is an unstable equilibrium."""
    if not negative_pivots(system, state.time, state.q):
        return False
    scales = system.scales()
    left_over = np.abs(system.force(state.time, state.q, None) * scales.length / scales.increment)
    return bool(left_over.max() < AT_REST * largest)


def line(angle: float, segments: int, first: float, limit: int) -> tuple[str, bool]:
    """A line of the table, and whether the run passes."""
    system = strip(angle, segments)
    motion = system.motions[0]
    seen: list[tuple[DriveState, np.ndarray]] = []
    saved: list[SavedState] = []
    jumps, outcome, begun = "", "whole", time.perf_counter()
    signal.alarm(limit)
    try:
        times = [motion.time_of(x) for x in np.arange(EVERY, motion.travel, EVERY)]
        settings = PathSettings(motion.end_time, motion.time_of(1e-3 * first))
        statistics, _ = follow(system, settings, times, saved.append, points=seen)
        jumps = ", ".join(f"{1e3 * e.travel:.1f} to {1e3 * e.end_travel:.1f}" for e in statistics.events)
    except OutOfTime:
        outcome = "out of time"
    except FsmError as error:
        outcome = str(error)
    signal.alarm(0)
    taken = time.perf_counter() - begun
    travel = np.array([drive.travel[0] for drive, *_ in seen])
    force = np.array([drive.force[0] for drive, *_ in seen])
    order = np.argsort(travel, kind="stable")
    top, at = peak(travel[order], force[order])
    largest = max((state.observation.reaction for state in saved), default=0.0)
    unstable = sum(resting_unstably(system, state, largest) for state in saved)
    text = (
        f"| {angle:g} | {segments} | {first:g} | {outcome} | {top:.4f} | {1e3 * at:.2f} | {unstable} | {jumps} "
        f"| {taken:.0f} |"
    )
    return text, outcome == "whole" and not unstable


def numbers(text: str) -> list[float]:
    """Numbers between commas."""
    return [float(part) for part in text.split(",")]


def main() -> int:
    """Run all and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--angles", type=numbers, default=list(range(70, 87, 2)))
    parser.add_argument("--segments", type=numbers, default=[5, 10, 20, 40])
    parser.add_argument("--first", type=numbers, default=[0.5], help="first increments, mm")
    parser.add_argument("--limit", type=int, default=300, help="longest time of a run, s")
    options = parser.parse_args()
    signal.signal(signal.SIGALRM, stop)
    print("| angle | segments | first, mm | outcome | peak, N | at, mm | unstable | jumps, mm | time, s |")
    print("|---|---|---|---|---|---|---|---|---|")
    well = True
    for segments in options.segments:
        for angle in options.angles:
            for first in options.first:
                text, good = line(angle, int(segments), first, options.limit)
                print(text, flush=True)
                well &= good
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
