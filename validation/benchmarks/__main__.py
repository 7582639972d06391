"""Work-precision plots of all solvers, cost against the number of segments, run times and memory; see README.md.

    python -m validation.benchmarks [--scenes strip,pendulum] [--methods Radau,BDF] [--quick] [--plot-only]

Everything goes into out/benchmarks, as CSV and PNG; tables in Markdown are printed.
"""

from __future__ import annotations

import argparse
import csv
import os
import statistics
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from validation.benchmarks import one_thread  # this import comes first, before any import that loads NumPy
from validation.benchmarks.broad_phase import (
    BROAD_PHASE,
    BROAD_PHASE_COLUMNS,
    BROAD_PHASE_COUNTS,
    QUICK_BROAD_PHASE_COUNTS,
    broad_phase_table,
    measure_broad_phase,
)
from validation.benchmarks.demo import OUT, Times, machine
from validation.benchmarks.demo import measure as measure_demo
from validation.benchmarks.linear_algebra import LINEAR, LINEAR_COLUMNS, linear_table, measure_linear
from validation.benchmarks.memory import measure_memory
from validation.benchmarks.methods import METHODS, QUICK_TOLERANCES
from validation.benchmarks.plots import plot_all_scenes, plot_scene, plot_segments
from validation.benchmarks.precision import PRECISION, measure, precision_table, read, reference, say, write, write_rows
from validation.benchmarks.problem import Problem, Tight
from validation.benchmarks.scenes import PROBLEMS, QUICK
from validation.benchmarks.segments import COUNTS, QUICK_COUNTS, SEGMENTS, SEGMENTS_COLUMNS, measure_segments, segments_table

PARTS = ("precision", "segments", "linear", "broad_phase", "demo", "memory")


def options(arguments: list[str] | None = None) -> argparse.Namespace:
    """Options of the command line."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmarks", description=__doc__.splitlines()[0])
    parser.add_argument("--parts", default=None, help=f"of {','.join(PARTS)}; all, or precision,segments with --quick")
    parser.add_argument("--scenes", default=",".join(PROBLEMS), help="of the work-precision part: %(default)s")
    parser.add_argument("--methods", default=",".join(METHODS), help="%(default)s")
    parser.add_argument("--tolerances", help="instead of each method's own, for example 1e-3,1e-5")
    parser.add_argument("--repeat", type=int, default=3, help="runs that a time is the median of")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds for a run; tighter tolerances are then skipped")
    parser.add_argument("--quick", action="store_true", help="smaller scenes, four tolerances, a few minutes")
    parser.add_argument("--plot-only", action="store_true", help="draw from the CSV files that are there")
    parser.add_argument("--renew", action="store_true", help="compute tight references anew: the forces have changed")
    parser.add_argument("--out", type=Path, default=None, help="out/benchmarks, or out/benchmarks/quick")
    chosen = parser.parse_args(arguments)
    chosen.scenes = _listed(parser, "--scenes", chosen.scenes, PROBLEMS)
    chosen.methods = _listed(parser, "--methods", chosen.methods, METHODS)
    parts = chosen.parts or ("precision,segments" if chosen.quick else ",".join(PARTS))
    chosen.parts = _listed(parser, "--parts", parts, dict.fromkeys(PARTS))
    chosen.out = chosen.out or (OUT / "quick" if chosen.quick else OUT)
    if chosen.quick:
        chosen.repeat, chosen.limit = 1, min(chosen.limit, 5.0)
    return chosen


def _listed(parser: argparse.ArgumentParser, option: str, text: str, known: Mapping[str, object]) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in known:
            parser.error(f"{option}: there is no {name!r}; there are {', '.join(known)}")
    return names


def problem(name: str, quick: bool) -> Problem:
    """A scene; for a quick run the small scene, whose reference has a larger tolerance."""
    if not quick:
        return PROBLEMS[name]()
    small = QUICK[name]()
    return replace(small, reference=Tight("Radau", 1e-7)) if isinstance(small.reference, Tight) else small


def run_precision(chosen: argparse.Namespace, about: dict[str, str]) -> None:
    """Work and precision; the file is updated after every method."""
    for name in (name for name in chosen.scenes if name in QUICK or not chosen.quick):
        scene = problem(name, chosen.quick)
        methods = [METHODS[method] for method in chosen.methods if METHODS[method].applies(scene)]
        if not methods:
            continue
        expected = reference(scene, chosen.out / "references", chosen.renew)
        for method in methods:
            tolerances = QUICK_TOLERANCES if chosen.quick else method.tolerances
            if chosen.tolerances:
                tolerances = tuple(float(text) for text in chosen.tolerances.split(","))
            wanted = [tolerance for tolerance in tolerances if tolerance >= 0.999 * scene.tightest]
            rows = measure(scene, method, expected, wanted, chosen.repeat, chosen.limit)
            write(chosen.out / PRECISION, rows, about)


def draw_precision(chosen: argparse.Namespace) -> None:
    """All work-precision plots for which the file has rows, and the table."""
    known = QUICK if chosen.quick else PROBLEMS
    rows = [row for row in read(chosen.out / PRECISION) if row["scene"] in known]
    scenes = {name: problem(name, chosen.quick) for name in known if any(row["scene"] == name for row in rows)}
    if not scenes:
        return
    methods = list(METHODS)
    for name, scene in scenes.items():
        own = [row for row in rows if row["scene"] == name]
        plot_scene(chosen.out / f"{name}.png", own, scene.title, scene.measure, methods)
    plot_all_scenes(chosen.out / "work_precision.png", rows, {name: name.replace("_", " ") for name in scenes}, methods)
    print(precision_table(sorted(rows, key=lambda row: list(PROBLEMS).index(row["scene"]))), end="\n\n")


def run_segments(chosen: argparse.Namespace, about: dict[str, str]) -> None:
    """Cost against the number of segments."""
    counts = QUICK_COUNTS if chosen.quick else COUNTS
    for rows in measure_segments(counts, chosen.methods, chosen.repeat, chosen.limit):
        write_rows(chosen.out / SEGMENTS, SEGMENTS_COLUMNS, rows, about)


def draw_segments(chosen: argparse.Namespace) -> None:
    """Plot and table of the cost against the number of segments."""
    rows = read(chosen.out / SEGMENTS)
    if rows:
        plot_segments(chosen.out / "segments.png", rows)
        print(segments_table(rows), end="\n\n")


def run_linear(chosen: argparse.Namespace, about: dict[str, str]) -> None:
    """Factorisation and solution."""
    write_rows(chosen.out / LINEAR, LINEAR_COLUMNS, list(measure_linear()), about)


def draw_linear(chosen: argparse.Namespace) -> None:
    """Its table."""
    rows = read(chosen.out / LINEAR)
    if rows:
        print(linear_table(rows), end="\n\n")


def run_broad_phase(chosen: argparse.Namespace, about: dict[str, str]) -> None:
    """Cost of the broad phase of contact."""
    counts = QUICK_BROAD_PHASE_COUNTS if chosen.quick else BROAD_PHASE_COUNTS
    for rows in measure_broad_phase(counts, chosen.repeat):
        write_rows(chosen.out / BROAD_PHASE, BROAD_PHASE_COLUMNS, rows, about)


def draw_broad_phase(chosen: argparse.Namespace) -> None:
    """Its table."""
    rows = read(chosen.out / BROAD_PHASE)
    if rows:
        print(broad_phase_table(rows), end="\n\n")


def run_demo(chosen: argparse.Namespace, about: dict[str, str]) -> None:
    """Processor times of the demo table, cold and warm, and of one run, medians over repeats."""
    found: list[dict[str, Times]] = []
    for number in range(chosen.repeat):
        say(f"demo table, {number + 1} of {chosen.repeat}")
        found.append(measure_demo())
    medians = {name: statistics.median(times[name].processor for times in found) for name in found[0]}
    _write_values(chosen.out / "demo_times.csv", medians, about)


def run_memory(chosen: argparse.Namespace, about: dict[str, str]) -> None:
    """Peak memory."""
    _write_values(chosen.out / "memory.csv", measure_memory(), about)


def _write_values(path: Path, values: Mapping[str, float], about: dict[str, str]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["what", "value", *about])
        writer.writerows([name, f"{value:.4g}", *about.values()] for name, value in values.items())


def draw_values(chosen: argparse.Namespace, file: str, head: str) -> None:
    """A table of names and values."""
    rows = read(chosen.out / file)
    if rows:
        print(f"| {head} |\n|---|---|")
        print("\n".join(f"| {row['what']} | {row['value']} |" for row in rows), end="\n\n")


def main(arguments: list[str] | None = None) -> int:
    """Measure the selected parts, then draw all results."""
    chosen = options(arguments)
    about = machine() | {"threads": os.environ[one_thread.VARIABLES[0]]}
    runs: dict[str, Callable[[argparse.Namespace, dict[str, str]], None]] = {
        "precision": run_precision,
        "segments": run_segments,
        "linear": run_linear,
        "broad_phase": run_broad_phase,
        "demo": run_demo,
        "memory": run_memory,
    }
    for part in () if chosen.plot_only else chosen.parts:
        runs[part](chosen, about)
    print(", ".join(f"{name} {value}" for name, value in about.items()), end="\n\n")
    draw_precision(chosen)
    draw_segments(chosen)
    draw_linear(chosen)
    draw_broad_phase(chosen)
    draw_values(chosen, "demo_times.csv", "demo table | processor time (s)")
    draw_values(chosen, "memory.csv", "job | peak memory (MB)")
    say(f"written to {chosen.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
