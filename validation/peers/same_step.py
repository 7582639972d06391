"""fsm and Exudyn with the same step, the same mesh and the same kind of method: comparison of times.

    python -m validation.peers.same_step [--only heavy_top ...] [--repeat 7]

Runs of each pair alternate, and the table has the median processor time of each program. Exit code 2 without Exudyn.
"""

from __future__ import annotations

from validation.benchmarks import one_thread  # isort: skip  # before NumPy

import argparse
import statistics
import sys

from validation.benchmarks.demo import machine
from validation.peers.cases import ALL
from validation.peers.common import THERE, quiet
from validation.peers.sweep import FSM, PEER, Run

__all__ = ["pairs"]

CASES = ("heavy_top", "A04", "flexible_pendulum", "cantilever", "bouncing_stack")
_OWN = ("generalized-alpha", "Newton")
_OTHER = ("RK44", "trapezoidal", "angle")
"""Methods and coordinates of Exudyn that fsm does not have."""
_REDUCED = "about the point"
"""Coordinates of the top's rotation alone; pairs with them have a separate row."""


def pairs(runs: list[Run], reduced: bool = False) -> list[tuple[str, list[Run], list[Run]]]:
    """Settings that both programs run, with the runs of fsm and of Exudyn; for Exudyn the fastest method counts."""
    own: dict[str, list[Run]] = {}
    others: dict[str, list[Run]] = {}
    for run in runs:
        if run.tool == FSM and run.method in _OWN:
            own.setdefault(run.setting, []).append(run)
        has = run.tool == PEER and not any(word in run.method for word in _OTHER)
        if has and reduced == run.method.startswith(_REDUCED):
            others.setdefault(run.setting, []).append(run)
    return [(name, found, others[name.split(", k =")[0]]) for name, found in own.items() if name.split(", k =")[0] in others]


def _median(times: list[float]) -> float:
    return 1e3 * statistics.median(times)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--repeat", type=int, default=7, help="runs of each program")
    options = parser.parse_args()
    if not THERE:
        print("Exudyn is not installed: pip install 'fsm[peers]'", file=sys.stderr)
        return 2
    assert one_thread.VARIABLES
    quiet()
    print(", ".join(f"{name} {value}" for name, value in machine().items()) + "\n")
    print("| case | step | fsm (ms) | Exudyn (ms) | fsm / Exudyn |\n|---|---|---|---|---|")
    for case in options.only:
        runs = ALL[case]().runs()
        rows = [(case, *pair) for pair in pairs(runs)]
        rows += [(f"{case}, Exudyn {_REDUCED}", *pair) for pair in pairs(runs, reduced=True)]
        for name, setting, own, others in rows:
            taken: dict[int, list[float]] = {}
            for number in range(options.repeat + 1):
                for k, run in enumerate([*own, *others]):
                    seconds = run.solve()[0]
                    if number:  # the first run compiles kernels
                        taken.setdefault(k, []).append(seconds)
            mine = _median(taken[0])
            peer = min(_median(taken[k]) for k in range(len(own), len(own) + len(others)))
            print(f"| {name} | {setting} | {mine:.3g} | {peer:.3g} | {mine / peer:.2f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
