"""How long the table of pulled strips takes: cold, warm, each case, and the start of the command itself.

`python -m validation.benchmarks.demo` from the root of the repository; prints medians, writes out/benchmarks/demo.csv.
"""

from __future__ import annotations

import csv
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

import numba

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "folding_cases" / "strip_pull" / "table.csv"
OUT = ROOT / "out" / "benchmarks"
STARTS = 5


def machine() -> dict[str, str]:
    """What the times were measured on."""
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


def clock(environment: Mapping[str, str], *arguments: str) -> float:
    """Wall time of one `fsm ...`, s."""
    begun = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "fsm", *arguments], env=dict(environment), capture_output=True, text=True, check=False
    )
    taken = time.perf_counter() - begun
    if done.returncode != 0:
        raise SystemExit(f"fsm {' '.join(arguments)} ended with {done.returncode}:\n{done.stderr}")
    return taken


def measure(table: Path = TABLE, starts: int = STARTS) -> dict[str, float]:
    """Times by name, s."""
    times: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(Path(folder) / "kernels")}
        for name in ("cold", "warm"):
            out = Path(folder) / name
            times[f"table, {name}"] = clock(environment, "table", str(table), "--out", str(out), "--quiet")
        with (Path(folder) / "warm" / "summary.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        times |= {f"solve, {row['case']}": float(row["solve_time_s"]) for row in rows}
        times["solve, median of the cases"] = statistics.median(float(row["solve_time_s"]) for row in rows)
        times[f"fsm --help, median of {starts}"] = statistics.median(clock(environment, "--help") for _ in range(starts))
    return times


def main() -> int:
    about = machine()
    print(", ".join(f"{name} {value}" for name, value in about.items()))
    times = measure()
    print("| what | time (s) |\n|---|---|")
    for name, value in times.items():
        print(f"| {name} | {value:.2f} |")
    OUT.mkdir(parents=True, exist_ok=True)
    with (OUT / "demo.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*about, "what", "time (s)"])
        writer.writerows([*about.values(), name, f"{value:.3f}"] for name, value in times.items())
    print(f"written to {(OUT / 'demo.csv').relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
