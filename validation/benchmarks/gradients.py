"""Cost of exact derivatives by 16 to 20 numbers, relative to the run alone, and their difference to differences of runs.

    python -m validation.benchmarks.gradients [--cases "strip;wing"] [--draws 2] [--repeats 5] [--differences]

Each case is the shipped one, and `--draws` more whose numbers are random, within 10 %. Processor times are medians of
alternated repeats, with OMP_NUM_THREADS=1. Differences of runs are central, with two steps.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import fsm
from fsm.errors import FsmError
from fsm.studies.problem import case_problem, evaluate, nominal_value
from fsm.studies.sensitivity import Derivative, response_named

TEMPLATES = Path(fsm.__file__).parent / "cli" / "templates"
TRIAL = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
DRAWN = 0.1
"""Largest relative change of a number in a random case."""
LONGEST, SHORTER, LENGTHS = 0.03, 3.0, 8
"""Longest relative step of differences of runs, ratio of successive steps, and number of steps."""
NOISY, ROUND_OFF = 2, 1e-14
"""Number of pairs of steps that show the noise of a response, and its least size relative to the response."""
JUDGED, WANTED = 3e-6, 1e-5
"""Largest relative uncertainty of a reference with which a derivative is judged, and the bound of its difference."""

STRIP = [
    "strip.length", "strip.width", "strip.thickness", "strip.fold_angle", "strip.grading", "material.young",
    "material.poisson", "material.density", "material.damping", "crease.stiffness", "contact.stiffness",
    "contact.exponent", "contact.damping", "drive.0.speed", "gravity.0", "gravity.2",
]  # fmt: skip
FRICTION = ["mu_static", "mu_dynamic", "v_static", "v_dynamic"]
SHEET = [
    "sheet.a", "sheet.b", "sheet.sector_angle", "sheet.fold_angle", "sheet.thickness", "material.young",
    "material.poisson", "material.density", "crease.stiffness_per_length", "gravity.0", "gravity.1", "gravity.2",
    "drive.0.speed", "drive.0.travel", "load.0.force.0", "load.0.force.1", "load.0.force.2", "load.1.force.0",
    "load.1.force.1", "load.1.force.2",
]  # fmt: skip
RAMP = {"kind": "ramp", "end": "1 s"}
LOADS = [
    {"at": "vertex 5", "force": ["0.1 mN", "0.2 mN", "-0.3 mN"], "time": RAMP},
    {"at": "vertex 8", "force": ["0.2 mN", "-0.1 mN", "0.1 mN"], "time": RAMP},
]
WING = [
    "length", "width", "thickness", "mass", "gap", "yoke.length", "yoke.width", "yoke.mass", "hinge.spring.stiffness",
    "hinge.spring.rest", "hinge.damper.coefficient", "hinge.stop.lower", "hinge.stop.stiffness", "hinge.stop.damping",
    "hinge.latch.at", "hinge.latch.play", "hinge.latch.stiffness", "hinge.latch.damping", "hinge.stop.upper",
]  # fmt: skip

FINE = {"solve.rtol": 1e-10}
"""Changes of motions for differences. Paths keep their tolerance: their equilibria are exact, and their steps the same."""

Spec = tuple[Path, Mapping[str, Any], list[str], str]
CASES: dict[str, Spec] = {
    "trial strip": (TRIAL, {"expect": None, "contact.damping": "10 N s/m", "contact.stiffness": 1e9}, STRIP, "peak_force"),
    "strip": (
        TEMPLATES / "strip.toml",
        {"strip.segments_per_panel": 10, "contact.stiffness": 8.34e10},
        [*STRIP, *(f"friction.{name}" for name in FRICTION)],
        "peak_force",
    ),
    "sheet": (TEMPLATES / "sheet.toml", {"load": LOADS}, SHEET, "peak_force"),
    "flexible": (TEMPLATES / "flexible.toml", {"load": LOADS, "sheet.mesh_size": "5.5 mm"}, SHEET, "peak_force"),
    "wing": (TEMPLATES / "wing.toml", {}, [f"wing.{name}" for name in WING], "latch_time"),
    "wing, stop": (TEMPLATES / "wing.toml", {}, [f"wing.{name}" for name in WING], "min of joint.root.stop"),
}  # fmt: skip


def drawn(case: fsm.Case, paths: list[str], rng: np.random.Generator) -> fsm.Case:
    """Case whose numbers are random."""
    problem, base = case_problem(case._tables, TRIAL, (), paths, (), "")
    values = {path: nominal_value(problem, base, path) or 0.0 for path in paths}
    return case.set({path: value * (1.0 + DRAWN * rng.uniform(-1.0, 1.0)) for path, value in values.items() if value})


def timed(work: Callable[[], Any]) -> float:
    """Processor time, s."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def cost(case: fsm.Case, of: str, paths: list[str], repeats: int) -> tuple[float, float]:
    """Processor times (s) of a run alone, and of the derivatives together with their run."""
    works = (lambda: case.run(figures=False)), (lambda: case.sensitivity(of, paths))
    times = np.array([[timed(work) for work in works] for _ in range(repeats + 1)])[1:]
    return float(np.median(times[:, 0])), float(np.median(times[:, 1]))


@dataclass(frozen=True)
class Reference:
    """Slope from differences of whole runs, and its uncertainty (SI)."""

    slope: float
    uncertainty: float


def reference(response: Callable[[float], float], size: float) -> Reference:
    """Slope of a response at a change of 0 by central differences and Richardson's extrapolation (Ridders 1982).

    The first step is `LONGEST` times `size`, and each is shorter than the one before by `SHORTER`. Each column of the table
    removes one more power of the step squared. The result is the entry that differs least from its neighbours. Its
    uncertainty is this difference and the effect of noise, which is what a parabola leaves of the response at the shortest
    steps. A response that jumps between two steps has a large uncertainty there.
    """
    steps, own = LONGEST * size / SHORTER ** np.arange(LENGTHS), response(0.0)
    ends = np.array([[_tried(response, sign * step) for sign in (1.0, -1.0)] for step in steps.tolist()])
    even = ends.sum(axis=1) - 2.0 * own
    left = np.abs(even[:-1] - SHORTER**2 * even[1:])[-NOISY:] / SHORTER**2
    noise = max(float(np.nanmax(left)), ROUND_OFF * abs(own))
    table, best = np.zeros((LENGTHS, LENGTHS)), Reference(math.nan, math.inf)
    table[:, 0] = (ends[:, 0] - ends[:, 1]) / (2.0 * steps)
    for row in range(1, LENGTHS):
        for column in range(1, row + 1):
            fine, coarse = table[row, column - 1], table[row - 1, column - 1]
            table[row, column] = fine + (fine - coarse) / (SHORTER ** (2 * column) - 1.0)
            uncertainty = max(abs(table[row, column] - other) for other in (fine, coarse)) + noise / (2.0 * steps[row])
            if uncertainty < best.uncertainty:
                best = Reference(float(table[row, column]), float(uncertainty))
    return best


def _tried(response: Callable[[float], float], by: float) -> float:
    """Response at a change; NaN if the run fails, as with impossible values."""
    try:
        return response(by)
    except FsmError:
        return math.nan


def compare(case: fsm.Case, of: str, paths: list[str]) -> list[tuple[Derivative, Reference]]:
    """Derivatives of a case and their references."""
    found = case.sensitivity(of, paths)
    problem, _ = case_problem(case._tables, TRIAL, (), paths, (response_named(of),), "")

    def response(path: str, value: float) -> float:
        return evaluate(problem, {path: value}).responses[found.name]

    return [
        (one, reference(lambda by, one=one: response(one.path, one.value + by), abs(one.value) or 1.0))  # type: ignore[misc]
        for one in found.derivatives
    ]


def rows_of(pairs: list[tuple[Derivative, Reference]], value: float) -> list[str]:
    """One line for each number: gradient, reference, and relative uncertainty and difference of the two.

    Numbers with an uncertainty above `JUDGED` are not judged; their difference is relative to the response, for a relative
    change of the number.
    """
    lines = []
    for one, known in pairs:
        off, size = one.slope - known.slope, abs(known.slope)
        unsure = known.uncertainty / size if size else math.inf
        text = f"    {one.path:28} {one.slope:+.8e} {known.slope:+.8e} {unsure:8.1e} "
        if unsure <= JUDGED:
            text += f"{off / size:+9.1e}{'' if abs(off) <= WANTED * size else '  OFF'}"
        else:
            scale = (abs(one.value) or 1.0) / abs(value)
            text += f"not judged; {off * scale:+.1e} of the response, uncertainty {known.uncertainty * scale:.1e}"
        lines.append(text + ("" if one.exact else "  (differences)"))
    return lines


def main() -> None:
    """Print one line for each case, and the largest differences."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmarks.gradients", description=__doc__.splitlines()[0])
    parser.add_argument("--cases", default=";".join(CASES), help="separated by semicolons; default: %(default)s")
    parser.add_argument("--draws", type=int, default=0, help="random cases of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--differences", action="store_true", help="compare with differences of runs")
    chosen = parser.parse_args()
    for name in chosen.cases.split(";"):
        file, changes, paths, of = CASES[name]
        given = fsm.load(file).set(changes)
        rng = np.random.default_rng(chosen.seed)
        for number in range(chosen.draws + 1):
            case = drawn(given, paths, rng) if number else given
            found = case.sensitivity(of, paths)
            exact = sum(one.exact for one in found.derivatives)
            run, whole = cost(case, of, paths, chosen.repeats) if chosen.repeats else (math.nan, math.nan)
            print(f"{name} {number}: {exact} of {len(paths)} exact; run {run:.3f} s, with derivatives {whole:.3f} s, "
                  f"{whole / run:.2f} runs", *found.warnings, flush=True)
            if chosen.differences:
                gravity = {} if "gravity" in case._tables else {"gravity": [0.0, 0.0, 0.0]}
                fine = {} if of == "peak_force" else FINE
                print(*rows_of(compare(case.set(fine | gravity), of, paths), found.value), sep="\n", flush=True)


if __name__ == "__main__":
    main()
