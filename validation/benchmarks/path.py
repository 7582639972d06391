"""Whole path of the trial strip, 0 to 120 mm, by the path follower: time, steps, iterations, peak.

    python -m validation.benchmarks.path [--segments 20 40] [--repeat 5]
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import statistics
import sys
import time

import numpy as np

from fsm.case.loading.load_case import load_case
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem
from fsm.results.quantities import peak
from fsm.solve.settings import PathSettings
from fsm.solve.statics.static import follow
from validation.benchmarks.demo import machine
from validation.strip_trial.check import CASE

TRAVEL = "120 mm"
RTOL = 1e-3
FIRST = 200
"""Part of the travel that the first step takes, one over it."""


def strip(segments: int, spatial: bool) -> SegmentSystem:
    """All pairs of panels have contact."""
    overrides = [
        f"strip.segments_per_panel={segments}",
        f'drive.0.travel="{TRAVEL}"',
        "expect=none",
        f"solve.spatial={str(spatial).lower()}",
    ]
    return compile_case(load_case(CASE, overrides).case)[1]


def main() -> int:
    """Run all and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--segments", type=int, nargs="+", default=[20, 40], help="segments per panel")
    parser.add_argument("--repeat", type=int, default=5, help="runs that a time is the median of, after one that warms up")
    chosen = parser.parse_args()
    print(", ".join(f"{name} {value}" for name, value in machine().items()), end="\n\n")
    print("| segments per panel | model | processor time, s | shortest | steps | refused | iterations | peak, N | events |")
    print("|---|---|---|---|---|---|---|---|---|")
    for segments in chosen.segments:
        for spatial in (False, True):
            system = strip(segments, spatial)
            motion = system.motions[0]
            settings = PathSettings(motion.end_time, motion.time_of(motion.travel / FIRST), rtol=RTOL)
            seconds = []
            for _ in range(chosen.repeat + 1):
                begun = time.process_time()
                found, _ = follow(system, settings, [motion.end_time], lambda state: None)
                seconds.append(time.process_time() - begun)
            travel, force = np.array([(drive.travel[0], drive.force[0]) for drive, *_ in found.points]).T
            print(
                f"| {segments} | {'space' if spatial else 'plane'} | {statistics.median(seconds[1:]):.2f} "
                f"| {min(seconds[1:]):.2f} | {found.steps} | {found.rejected} | {found.newton_iterations} "
                f"| {peak(travel, force)[0]:.4f} | {', '.join(event.kind for event in found.events) or 'none'} |",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
