"""Slit annulus of shells (Sze, Liu and Lo, 2004): error and time of fsm, CalculiX and Kratos on several meshes.

    python -m validation.peers.shells [--only fsm calculix kratos] [--quick]

CalculiX is the program `ccx`. Kratos needs KratosMultiphysics, KratosStructuralMechanicsApplication and
KratosLinearSolversApplication, possibly on PYTHONPATH. If a program is missing, one line states that it is skipped.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import json
import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from validation.peers.sweep import Point, time_to_error

__all__ = [
    "INNER", "LIFT", "OUTER", "REFERENCE", "THICKNESS", "YOUNG", "Found", "calculix_input", "main", "radii", "table",
]  # fmt: skip

YOUNG, THICKNESS, INNER, OUTER, LIFT = 21e6, 0.03, 6.0, 10.0, 0.8
"""Young's modulus (Pa), thickness and radii (m), force per length of the lifted edge (N/m); Poisson's ratio is 0."""
REFERENCE = (13.847, 17.485)
"""Heights of the inner and outer end of the lifted edge at full load: limits of all three programs for fine meshes, which
agree to 0.02 %. Sze, Liu and Lo (2004) have 13.891 and 17.528 by S4R on 10 x 80 cells."""
CASE = Path(__file__).parents[2] / "folding_cases" / "slit_annulus" / "case.toml"
STEPS = (20, 30, 40, 60, 80)
"""Load steps of Kratos; the first number that converges counts. Loads are (k/n)^2, since the flat plate is the softest."""
_LIMIT = 900.0
_MODULES = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, sys.path)])}


class Found(NamedTuple):
    """One run: heights of both ends, number of unknowns, processor time of the whole process in s."""

    program: str
    mesh: tuple[int, int]
    unknowns: int
    inner: float
    outer: float
    seconds: float

    def error(self, reference: tuple[float, float] = REFERENCE) -> float:
        """Larger relative error of both heights."""
        return max(abs(self.inner / reference[0] - 1.0), abs(self.outer / reference[1] - 1.0))


MESHES: dict[str, tuple[tuple[int, int], ...]] = {
    "fsm": ((4, 30), (6, 40), (8, 64), (10, 80)),
    "CalculiX S8R": ((3, 20), (4, 30), (6, 40)),
    "CalculiX S6": ((6, 40), (10, 80)),
    "Kratos thin 4N": ((4, 30), (6, 40), (10, 80), (14, 112)),
    "Kratos thin 3N": ((4, 30), (6, 40), (10, 80), (14, 112)),
}
"""Cells along the radius and around. The cells of fsm are graded along the radius; the other programs have smaller errors
with equal cells."""


def radii(cells: int) -> np.ndarray:
    """Radii of the ends of equal cells, m."""
    return np.linspace(INNER, OUTER, cells + 1)


def _timed(command: Sequence[str], folder: Path, more: dict[str, str] | None = None) -> tuple[str, float]:
    """Output and processor time of a process with one thread."""
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command, cwd=folder, env=os.environ | one | (more or {}), capture_output=True, text=True, timeout=_LIMIT, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RuntimeError((done.stderr or done.stdout).strip().splitlines()[-1])
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


# CalculiX ---------------------------------------------------------------------------------------------------------------


def calculix_input(element: str, radial: int, around: int) -> tuple[str, int]:
    """Input file, and the number of unknowns of the shell; `element` is "S8R" or "S6"."""
    number = np.arange(1, (2 * radial + 1) * (2 * around + 1) + 1).reshape(2 * radial + 1, 2 * around + 1)
    elements = []
    for i in range(0, 2 * radial, 2):
        for j in range(0, 2 * around, 2):
            q = number[i : i + 3, j : j + 3]
            if element == "S8R":
                elements.append([q[0, 0], q[2, 0], q[2, 2], q[0, 2], q[1, 0], q[2, 1], q[1, 2], q[0, 1]])
            else:
                elements.append([q[0, 0], q[2, 0], q[2, 2], q[1, 0], q[2, 1], q[1, 1]])
                elements.append([q[0, 0], q[2, 2], q[0, 2], q[1, 1], q[1, 2], q[0, 1]])
    used, ends = np.unique(elements), radii(radial)
    radius = np.interp(np.arange(2 * radial + 1), np.arange(0, 2 * radial + 1, 2), ends)

    def corner(i: int, j: int) -> np.ndarray:
        r, angle = radius[i], math.tau * j / (2 * around)
        return np.array([r * math.cos(angle), r * math.sin(angle)])

    lines = ["*NODE, NSET=ALL"]
    for i, j in np.ndindex(number.shape):
        if number[i, j] in used:
            straight = element == "S6" and i % 2 and j % 2  # the middle of a diagonal
            x, y = 0.5 * (corner(i - 1, j - 1) + corner(i + 1, j + 1)) if straight else corner(i, j)
            lines.append(f"{number[i, j]}, {x:.12g}, {y:.12g}, 0")
    lines.append(f"*ELEMENT, TYPE={element}, ELSET=SHEET")
    lines += [", ".join(map(str, (k + 1, *nodes))) for k, nodes in enumerate(elements)]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{YOUNG}, 0.0", "*SHELL SECTION, ELSET=SHEET, MATERIAL=M", str(THICKNESS)]
    lines += ["*BOUNDARY", *(f"{node}, 1, 6" for node in number[:, 0])]
    lines += ["*NSET, NSET=ENDS", f"{number[0, -1]}, {number[-1, -1]}"]
    lines += ["*STEP, NLGEOM, INC=2000", "*STATIC", "0.1, 1.0", "*CLOAD"]
    load = np.zeros(2 * radial + 1)
    for i in range(0, 2 * radial, 2):  # Simpson's rule on each edge
        load[i : i + 3] += LIFT * (radius[i + 2] - radius[i]) * np.array([1.0, 4.0, 1.0]) / 6.0
    lines += [f"{node}, 3, {force:.12g}" for node, force in zip(number[:, -1], load, strict=True)]
    lines += ["*NODE PRINT, NSET=ENDS, FREQUENCY=9999", "U", "*END STEP", ""]
    return "\n".join(lines), 6 * (len(used) - 2 * radial - 1)


def _calculix(name: str, mesh: tuple[int, int], folder: Path) -> Found:
    text, unknowns = calculix_input(name.split()[1], *mesh)
    (folder / "annulus.inp").write_text(text)
    _, taken = _timed(["ccx", "-i", "annulus"], folder)
    last = [line.split() for line in (folder / "annulus.dat").read_text().splitlines() if line.strip()][-2:]
    return Found(name, mesh, unknowns, float(last[0][3]), float(last[1][3]), taken)


# Kratos -----------------------------------------------------------------------------------------------------------------


def _kratos(name: str, mesh: tuple[int, int], folder: Path) -> Found:
    element = f"ShellThinElementCorotational3D{name.split()[-1]}"
    for steps in STEPS:
        command = [sys.executable, "-m", "validation.peers.kratos_shell", element, *map(str, mesh), str(steps)]
        output, taken = _timed(command, folder, _MODULES)
        found = json.loads(next(line for line in output.splitlines() if line.startswith("{")))
        if found["converged"]:
            return Found(name, mesh, found["unknowns"], found["inner"], found["outer"], taken)
    raise RuntimeError(f"no convergence with {STEPS[-1]} load steps")


# fsm --------------------------------------------------------------------------------------------------------------------


def _fsm(name: str, mesh: tuple[int, int], folder: Path) -> Found:
    command = [sys.executable, "-m", "fsm", "run", str(CASE), "--quiet", "--out", "out", "--set", "save.interval=1"]
    for setting in ("solve.rtol=1e-2", f"sheet.mesh=[{mesh[0]}, {mesh[1]}]", "sheet.mesh_grading=[1, 0]"):
        command += ["--set", setting]
    _, taken = _timed(command, folder, _MODULES)
    summary = json.loads((folder / "out" / "summary.json").read_text())
    if summary["compile_time_s"]:  # the first run compiles kernels
        shutil.rmtree(folder / "out")
        return _fsm(name, mesh, folder)
    inner, outer = (float(summary["probe_displacement"][end][2]) for end in ("inner", "outer"))
    return Found(name, mesh, 9 * (mesh[0] + 1) * mesh[1], inner, outer, taken)


# table ------------------------------------------------------------------------------------------------------------------

PROGRAMS: dict[str, tuple[Callable[[str, tuple[int, int], Path], Found], Callable[[], bool]]] = {
    "fsm": (_fsm, CASE.exists),
    "CalculiX": (_calculix, lambda: shutil.which("ccx") is not None),
    "Kratos": (_kratos, lambda: importlib.util.find_spec("KratosMultiphysics") is not None),
}


def runs(chosen: Sequence[str], coarsest: int) -> Iterator[Found]:
    """Run the installed programs on the coarsest meshes of each."""
    for name, meshes in MESHES.items():
        program = name.split()[0]
        solve, there = PROGRAMS[program]
        if program.lower() not in chosen:
            continue
        if not there():
            print(f"{name}: not installed, skipped", flush=True)
            continue
        for mesh in meshes[:coarsest]:
            with tempfile.TemporaryDirectory() as folder:
                try:
                    found = solve(name, mesh, Path(folder))
                except (RuntimeError, subprocess.TimeoutExpired) as error:
                    print(f"{name}, {mesh[0]} x {mesh[1]}: {error}", flush=True)
                    continue
            print(f"{name}, {mesh[0]} x {mesh[1]}: {found.inner:.4f} {found.outer:.4f}, {found.seconds:.2f} s", flush=True)
            yield found


def table(found: Sequence[Found], reference: tuple[float, float] = REFERENCE) -> str:
    """Runs and the time to 0.1 %, in Markdown."""
    lines = ["| program | mesh | unknowns | inner, m | outer, m | error, % | time, s |", "|---" * 7 + "|"]
    for one in found:
        mesh, error = f"{one.mesh[0]} x {one.mesh[1]}", f"{100 * one.error(reference):.2f}"
        lines.append(
            f"| {one.program} | {mesh} | {one.unknowns} | {one.inner:.4f} | {one.outer:.4f} | {error} | {one.seconds:.1f} |"
        )
    lines += ["", "| program | to 1 %, s | to 0.1 %, s |", "|---|---|---|"]
    for name in dict.fromkeys(one.program for one in found):
        points = [Point(name, name, "", one.seconds, one.error(reference)) for one in found if one.program == name]
        times = [time_to_error(points, error) for error in (1e-2, 1e-3)]
        lines.append(f"| {name} | " + " | ".join("not reached" if t is None else f"{t.seconds:.1f}" for t in times) + " |")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, print the table and write `out/peers/shells.csv`."""
    parser = argparse.ArgumentParser(prog="python -m validation.peers.shells", description=__doc__.split("\n")[0])
    parser.add_argument("--only", nargs="+", choices=["fsm", "calculix", "kratos"], default=["fsm", "calculix", "kratos"])
    parser.add_argument("--quick", action="store_true", help="two meshes of each program")
    parser.add_argument("--out", type=Path, default=Path("out/peers"))
    chosen = parser.parse_args(arguments)
    found = list(runs(chosen.only, 2 if chosen.quick else 99))
    if not found:
        return 2
    print(table(found))
    chosen.out.mkdir(parents=True, exist_ok=True)
    with (chosen.out / "shells.csv").open("w", newline="") as file:
        writer: Any = csv.writer(file)
        writer.writerow((*Found._fields, "error"))
        writer.writerows((*one, one.error()) for one in found)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
