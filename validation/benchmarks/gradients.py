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
from pathlib import Path
from typing import Any

import numpy as np

import fsm
from fsm.studies.problem import case_problem, evaluate, nominal_value
from fsm.studies.sensitivity import response_named

TEMPLATES = Path(fsm.__file__).parent / "cli" / "templates"
TRIAL = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
DRAWN = 0.1
"""Largest relative change of a number in a random case."""
STEPS = 1e-3, 2e-3
"""Relative steps of differences of runs."""

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

FINE = {"solve.rtol": 1e-9}
"""Changes of runs for differences."""

Spec = tuple[Path, Mapping[str, Any], list[str], str]
CASES: dict[str, Spec] = {
    "trial strip": (TRIAL, {"expect": None, "contact.damping": "10 N s/m", "contact.stiffness": 1e9}, STRIP, "peak_force"),
    "strip": (
        TEMPLATES / "strip.toml",
        {"strip.segments_per_panel": 10},
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


def differences(case: fsm.Case, of: str, paths: list[str]) -> dict[str, float]:
    """Differences of runs less exact derivatives, relative to the response, for a relative change of each number."""
    found = case.sensitivity(of, paths)
    problem, _ = case_problem(case._tables, TRIAL, (), paths, (response_named(of),), "")
    ratio, off = (STEPS[1] / STEPS[0]) ** 2, {}
    for one in found.derivatives:
        size, slopes = abs(one.value) or 1.0, []
        for step in STEPS:
            high, low = (evaluate(problem, {one.path: one.value + k * step * size}).responses[found.name] for k in (1, -1))
            slopes.append((high - low) / (2.0 * step))
        off[one.path] = ((ratio * slopes[0] - slopes[1]) / (ratio - 1.0) - one.slope * size) / found.value
    return off


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
                off = differences(case.set(FINE | gravity), of, paths)
                worst = sorted(off, key=lambda path: -abs(off[path]))[:4]
                print("   ", ", ".join(f"{path} {off[path]:.1e}" for path in worst), flush=True)


if __name__ == "__main__":
    main()
