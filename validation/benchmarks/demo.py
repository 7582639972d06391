"""Time of the table of pulled strips, with and without compiled kernels, of one run, and of the start of the command.

`python -m validation.benchmarks.demo` from the root of the repository; prints medians, writes out/benchmarks/demo.csv.
"""

from __future__ import annotations

import csv
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "folding_cases" / "strip_pull" / "table.csv"
OUT = ROOT / "out" / "benchmarks"
STARTS = 5


class Times(NamedTuple):
    """Wall and processor time, s."""

    wall: float
    processor: float


def machine() -> dict[str, str]:
    """Machine on which the times were measured."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        lines = info.read_text(encoding="utf-8").splitlines()
        model = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), model)
    return {
        "date": time.strftime("%Y-%m-%d"),
        "cpu": model,
        "cores": str(os.cpu_count()),
        "load": f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown",
        "python": platform.python_version(),
        "numba": numba.__version__,
    }


def clock(environment: Mapping[str, str], *arguments: str) -> Times:
    """Wall and processor time of one `fsm ...` with its workers, s."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "fsm", *arguments], env=dict(environment), capture_output=True, text=True, check=False
    )
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise SystemExit(f"fsm {' '.join(arguments)} ended with {done.returncode}:\n{done.stderr}")
    return Times(wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def median(times: Sequence[Times]) -> Times:
    """Medians of wall and processor time."""
    return Times(*(statistics.median(column) for column in zip(*times, strict=True)))


def measure(table: Path = TABLE, starts: int = STARTS) -> dict[str, Times]:
    """Times by name."""
    times: dict[str, Times] = {}
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(Path(folder) / "kernels")}
        for name in ("cold", "warm"):
            out = Path(folder) / name
            times[f"table, {name}"] = clock(environment, "table", str(table), "--out", str(out), "--quiet")
        times["table, compilation"] = Times(*np.subtract(times["table, cold"], times["table, warm"]).tolist())
        case, out = str(table.with_name("case.toml")), str(Path(folder) / "run")
        runs = [clock(environment, "run", case, "--out", out, "--quiet") for _ in range(starts)]
        times[f"fsm run, median of {starts}"] = median(runs)
        times[f"fsm run, shortest of {starts}"] = Times(*(min(column) for column in zip(*runs, strict=True)))
        times[f"fsm --help, median of {starts}"] = median([clock(environment, "--help") for _ in range(starts)])
    return times


def main() -> int:
    """Measure, print and write."""
    about = machine()
    print(", ".join(f"{name} {value}" for name, value in about.items()))
    times = measure()
    print("| what | wall time (s) | processor time (s) |\n|---|---|---|")
    for name, (wall, processor) in times.items():
        print(f"| {name} | {wall:.2f} | {processor:.2f} |")
    OUT.mkdir(parents=True, exist_ok=True)
    with (OUT / "demo.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*about, "what", "wall time (s)", "processor time (s)"])
        writer.writerows([*about.values(), name, *(f"{value:.3f}" for value in both)] for name, both in times.items())
    print(f"written to {(OUT / 'demo.csv').relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
