"""Exudyn and fsm in one run: time to an error of 1 % and of 0.1 % for every problem that both programs can model.

    python -m validation.peers [--only strip_10_plane A01 ...] [--repeat 3] [--out out/peers]

The command prints the table and writes table.md, and a CSV file and a figure for every problem. Exit code 2 means that
Exudyn is not installed.
"""

from __future__ import annotations

from validation.benchmarks import one_thread  # isort: skip  # before NumPy

import argparse
import importlib.metadata
import sys
import time
from pathlib import Path

from validation.benchmarks.demo import machine
from validation.peers.cases import ALL
from validation.peers.common import THERE, quiet
from validation.peers.sweep import PEER, PLAIN, measure, plot, table, verdict, write_csv


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=list(ALL), default=list(ALL))
    parser.add_argument("--repeat", type=int, default=3, help="runs that the shortest is taken of; long ones run once")
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[2] / "out" / "peers")
    options = parser.parse_args()
    if not THERE:
        print("Exudyn is not installed: pip install 'fsm[peers]'", file=sys.stderr)
        return 2
    assert one_thread.VARIABLES
    quiet()
    about = machine() | {"exudyn": importlib.metadata.version("exudyn")}
    head = ", ".join(f"{name} {value}" for name, value in about.items() if name != "date")
    print(head)
    done = []
    for name in options.only:
        begun = time.perf_counter()
        case = ALL[name]()
        print(f"{case.title}", flush=True)
        case.points.extend(measure(case.runs(), options.repeat))
        write_csv(case, about, options.out / f"{name}.csv")
        plot(case, options.out / f"{name}.png")
        for target in (1e-2, 1e-3):
            peers = [peer for peer in (PEER, PLAIN) if any(point.tool == peer for point in case.points)]
            verdicts = [f"beside {peer}: {verdict(case.points, target, peer)}" for peer in peers]
            print(f"    {100 * target:g} %: {'; '.join(verdicts)}")
        print(f"    {time.perf_counter() - begun:.0f} s", flush=True)
        done.append(case)
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "table.md").write_text(f"{head}\n\n{table(done)}", encoding="utf-8")
    print("\n" + table(done))
    return 0


if __name__ == "__main__":
    sys.exit(main())
