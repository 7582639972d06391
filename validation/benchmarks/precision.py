"""Work and precision: every method on every scene at every tolerance; the results are stored in one CSV file."""

from __future__ import annotations

import csv
import statistics
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from fsm.errors import FsmError
from validation.benchmarks.methods import METHODS, Method, Run, TooSlow
from validation.benchmarks.problem import Problem, Tight

__all__ = ["PRECISION", "measure", "precision_table", "read", "reference", "say", "write", "write_rows"]

PRECISION = "work_precision.csv"
COLUMNS = (
    "scene", "method", "tolerance", "status", "error", "time_s", "wall_s", "repeats", "steps", "newton_iterations",
    "energy_error", "message",
)  # fmt: skip
ENOUGH = 30.0
"""A run is not repeated when it and those before it took longer, s: what takes long varies little."""

Row = dict[str, str]


def say(text: str) -> None:
    """A line of progress."""
    print(text, file=sys.stderr, flush=True)


def reference(problem: Problem, folder: Path, renew: bool = False) -> np.ndarray:
    """Reference of a problem; a computed reference is stored in a file under a digest of its inputs."""
    tight = problem.reference
    if not isinstance(tight, Tight):
        return tight
    path = folder / f"{problem.name}-{problem.digest()}.npy"
    if path.is_file() and not renew:
        return np.load(path)
    say(f"{problem.name}: reference, {tight.method} at {tight.rtol:g}")
    run = METHODS[tight.method].run(problem, tight.rtol)
    say(f"{problem.name}: reference took {run.seconds:.1f} s, energy balance {run.energy_error:.1e}")
    folder.mkdir(parents=True, exist_ok=True)
    np.save(path, run.values)
    return run.values


def measure(
    problem: Problem,
    method: Method,
    expected: np.ndarray,
    tolerances: Iterable[float],
    repeat: int,
    limit: float,
) -> list[Row]:
    """One row for each tolerance, from large to small; after a run that took too long, smaller tolerances are skipped."""
    rows: list[Row] = []
    method.warm_up(problem)
    slow = ""
    for tolerance in sorted(tolerances, reverse=True):
        row = dict.fromkeys(COLUMNS, "") | {
            "scene": problem.name, "method": method.name, "tolerance": f"{tolerance:g}"
        }  # fmt: skip
        if slow:
            row |= {"status": "skipped", "message": slow}
        else:
            row |= _outcome(problem, method, expected, tolerance, repeat, limit)
            if row["status"] == "too slow":
                slow = f"took more than {limit:g} s at {tolerance:g}"
        rows.append(row)
        told = f"error {row['error']}, {row['time_s']} s" if row["status"] == "ok" else f"{row['status']}: {row['message']}"
        say(f"{problem.name}, {method.name}, {tolerance:g}: {told}")
    return rows


def _outcome(
    problem: Problem, method: Method, expected: np.ndarray, tolerance: float, repeat: int, limit: float
) -> Row:
    """Status, error and time of one tolerance. A failure of any kind counts as a result, and is printed."""
    runs: list[Run] = []
    try:
        while len(runs) < repeat and sum(run.seconds for run in runs) < ENOUGH:
            runs.append(method.run(problem, tolerance, limit))
    except TooSlow as error:
        return {"status": "too slow", "message": str(error)}
    except FsmError as error:
        return {"status": "failed", "message": str(error)}
    except Exception as error:  # an unfinished solver fails in the same way as an unsuitable one
        return {"status": "failed", "message": f"{type(error).__name__}: {error}"}
    last = runs[-1]
    return {
        "status": "ok",
        "error": f"{problem.error(last.values, expected):.4g}",
        "time_s": f"{statistics.median(run.seconds for run in runs):.4g}",
        "wall_s": f"{statistics.median(run.wall for run in runs):.4g}",
        "repeats": str(len(runs)),
        "steps": str(last.steps),
        "newton_iterations": str(last.iterations),
        "energy_error": f"{last.energy_error:.2e}",
    }


def read(path: Path) -> list[Row]:
    """Rows of an earlier run; an empty list if there was no earlier run."""
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write(path: Path, new: Sequence[Row], about: dict[str, str]) -> None:
    """Replace the rows of the same scene and method in the file, and write the machine of the measurement."""
    replaced = {(row["scene"], row["method"]) for row in new}
    kept = [row for row in read(path) if (row["scene"], row["method"]) not in replaced]
    write_rows(path, COLUMNS, [*kept, *(row | about for row in new)], about)


def write_rows(path: Path, columns: Sequence[str], rows: Sequence[Row], about: dict[str, str]) -> None:
    """Complete file of rows, each with the machine on which it was measured; rows that already name a machine keep this
    name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".part")
    with partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [*columns, *about])
        writer.writeheader()
        writer.writerows(about | row for row in rows)
    partial.replace(path)


def precision_table(rows: Sequence[Row], targets: Sequence[float] = (1e-2, 1e-3, 1e-4, 1e-6)) -> str:
    """Shortest time (s) to an error no larger than each target, in Markdown, with the number of failed and slow runs."""
    lines = [
        "| scene | method | "
        + " | ".join(f"s to {target:g}" for target in targets)
        + " | smallest error | failed | too slow |",
        "|---" * (len(targets) + 5) + "|",
    ]
    for scene, method in dict.fromkeys((row["scene"], row["method"]) for row in rows):
        own = [row for row in rows if (row["scene"], row["method"]) == (scene, method)]
        done = [(float(row["error"]), float(row["time_s"])) for row in own if row["status"] == "ok"]
        times = [min((seconds for error, seconds in done if error <= target), default=None) for target in targets]
        cells = ["-" if seconds is None else f"{seconds:.3g}" for seconds in times]
        best = f"{min(error for error, _ in done):.1e}" if done else "-"
        failed = sum(row["status"] == "failed" for row in own)
        slow = sum(row["status"] in ("too slow", "skipped") for row in own)
        lines.append(f"| {scene} | {method} | {' | '.join(cells)} | {best} | {failed or ''} | {slow or ''} |")
    return "\n".join(lines)
