"""Path of a strip without contact: Newton's method in one call (`fsm.solve.stepping.quasi_static`) and kernel by kernel.

    python -m validation.benchmarks.one_call [--segments 4 10 20] [--repeat 200]

Times of one path, 0 to 40 mm in 7 steps, with compiled kernels: median and shortest time; the results agree to the last bit.
With an empty folder of compiled kernels (`NUMBA_CACHE_DIR`) it also prints the compile times.
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import statistics
import sys
import time

from fsm.kernels import jit
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem
from validation.benchmarks.demo import machine
from validation.peers.strip import static_path, strip_case

RTOL = 1e-2
ALONE = ("kernel by kernel", "in one call")


def systems(segments: int, spatial: bool, damping: float) -> list[SegmentSystem]:
    """The same strip twice; the first copy is solved in Python, as if it had elements other than springs."""
    case = strip_case(segments, spatial=spatial, overrides=(f"material.damping={damping}",))
    both = [compile_case(case)[1] for _ in ALONE]
    both[0].__dict__["static_arrays"] = lambda ready: None
    return both


def main() -> int:
    """Run all and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--segments", type=int, nargs="+", default=[4, 10, 20], help="segments per panel")
    parser.add_argument("--repeat", type=int, default=200, help="paths of each, after one that compiles")
    chosen = parser.parse_args()
    print(", ".join(f"{name} {value}" for name, value in machine().items()), end="\n\n")
    print("| segments per panel | model | damping | kernel by kernel, ms | in one call, ms | ratio | compiled first, s |")
    print("|---|---|---|---|---|---|---|")
    for segments in chosen.segments:
        for spatial, damping in ((False, 0.0), (False, 0.01), (True, 0.0), (True, 0.01)):
            both = systems(segments, spatial, damping)
            compiled = []
            for system in both:
                before = jit.compile_time()
                static_path(system, RTOL)
                compiled.append(jit.compile_time() - before)
            times: list[list[float]] = [[], []]
            for _ in range(chosen.repeat):
                for k, system in enumerate(both):
                    begun = time.perf_counter()
                    static_path(system, RTOL)
                    times[k].append(1e3 * (time.perf_counter() - begun))
            slow, quick = map(statistics.median, times)
            print(
                f"| {segments} | {'space' if spatial else 'plane'} | {damping:g} | {slow:.2f} (least {min(times[0]):.2f}) "
                f"| {quick:.2f} (least {min(times[1]):.2f}) | {slow / quick:.2f} | {compiled[0]:.1f} + {compiled[1]:.1f} |",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
