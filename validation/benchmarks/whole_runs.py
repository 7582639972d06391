"""Processor time of whole runs without figures, with this and with another version of the program; the runs alternate.

    python -m validation.benchmarks.whole_runs OTHER [--cases strip_trial film_on_strip] [--repeat 3]

OTHER is the folder of the other version, for example of `git worktree add OTHER COMMIT`. A case is a folder of
`folding_cases`, or a name of `VARIANTS`. Each time is the shortest of several runs in several processes, after one run that
compiles.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from validation.benchmarks.demo import machine

HERE = Path(__file__).parents[2]
VARIANTS = {
    "strip_trial in space": ("strip_trial/case.toml", ["solve.spatial=true"]),
    "strip_pull, 10 segments": ("strip_pull/case.toml", ["strip.segments_per_panel=10"]),
    "tape_spring, coil": ("tape_spring/coil.toml", []),
}
"""File and overrides of cases by name."""
CASES = ("strip_trial", *VARIANTS, "strip_pull", "z_tube", "pleated_cone", "gas_kresling", "film_on_strip", "wrapped_film")
_RUN = """
import sys, time
from importlib import import_module
from pathlib import Path

def found(name, *modules):  # earlier versions have the functions elsewhere
    for module in modules:
        try:
            function = getattr(import_module(module), name)
        except (ImportError, AttributeError):
            continue
        if callable(function):
            return function
    raise ImportError(name)

run = found("run_case", "fsm.run.run_case", "fsm.run")
load = found("load_case", "fsm.case.loading.load_case", "fsm.scene.load_case")
times = []
for _ in range(1 + int(sys.argv[1])):
    begun = time.process_time()
    summary = run(load(Path(sys.argv[2]), sys.argv[4:]), Path(sys.argv[3]), progress=False, figures=False)
    times.append(time.process_time() - begun)
print(min(times[1:]), summary["steps"], summary["newton_iterations"], repr(summary.get("peak_force", float("nan"))))
"""


def measured(version: Path, case: str, runs: int, out: str) -> list[float]:
    """Shortest time of a case in one process (s), steps, iterations and peak force (N)."""
    file, overrides = VARIANTS.get(case, (f"{case}/case.toml", []))
    own = {"PYTHONPATH": str(version), "OPENBLAS_NUM_THREADS": "1"}
    arguments = [str(runs), str(version / "folding_cases" / file), out, *overrides]
    done = subprocess.run(
        [sys.executable, "-c", _RUN, *arguments], capture_output=True, text=True, env=os.environ | own, cwd=out, check=True
    )
    return [float(number) for number in done.stdout.split()]


def main() -> int:
    """Measure all cases and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("other", type=Path, help="folder of the other version")
    parser.add_argument("--cases", nargs="+", default=list(CASES), help="cases to measure")
    parser.add_argument("--repeat", type=int, default=3, help="processes for each version and case, and runs in each")
    chosen = parser.parse_args()
    print(", ".join(f"{name} {value}" for name, value in machine().items()), end="\n\n")
    print("| case | other, s | this, s | ratio | steps | iterations | relative change of the peak |")
    print("|---|---|---|---|---|---|---|")
    for case in chosen.cases:
        rows: list[list[list[float]]] = [[], []]
        for _ in range(chosen.repeat):
            for version, row in zip((chosen.other.resolve(), HERE), rows, strict=True):
                with tempfile.TemporaryDirectory() as out:
                    row.append(measured(version, case, chosen.repeat, out))
        other, this = (min(row) for row in rows)
        peak = f"{this[3] / other[3] - 1.0:.1e}" if other[3] else "-"
        counts = " | ".join(f"{a:.0f}, {b:.0f}" for a, b in zip(other[1:3], this[1:3], strict=True))
        print(f"| {case} | {other[0]:.3f} | {this[0]:.3f} | {other[0] / this[0]:.1f} | {counts} | {peak} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
