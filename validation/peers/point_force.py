"""Open cylinder pulled out by point forces (Sze, Liu and Lo, 2004): solids of CalculiX with and without transverse shear.

    python -m validation.peers.point_force [--meshes 12x8 24x16]

An eighth of the cylinder has one layer of C3D20R solids. The second run of each mesh has 100 times the stiffness against
transverse shear, and is otherwise equal. Lines have the displacements of the points A (under the force), B and C at half and
full force, m. A run that stops between half and full force prints only the first displacements.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

__all__ = ["displacements", "main", "solid_input"]

_RADIUS, _LENGTH, _THICKNESS, _YOUNG, _POISSON, _FORCE = 4.953, 10.35, 0.094, 10.5e6, 0.3125, 10_000.0
_LIMIT = 900.0


def solid_input(around: int, along: int, shear: float) -> str:
    """Input file; `shear` is a factor on both moduli of transverse shear."""
    number = np.arange(1, (2 * around + 1) * (2 * along + 1) * 3 + 1).reshape(2 * around + 1, 2 * along + 1, 3)
    lines, elements = ["*NODE, NSET=ALL"], []
    for i in range(0, 2 * around, 2):
        for j in range(0, 2 * along, 2):
            q = number[i : i + 3, j : j + 3]
            corners, middles = (q[0, 0], q[2, 0], q[2, 2], q[0, 2]), (q[1, 0], q[2, 1], q[1, 2], q[0, 1])
            layers = [(corners, 0), (corners, 2), (middles, 0), (middles, 2), (corners, 1)]
            elements.append([int(column[layer]) for columns, layer in layers for column in columns])
    used = set(np.unique(elements).tolist())
    for i, j, k in np.ndindex(number.shape):
        if int(number[i, j, k]) in used:
            angle, r = 0.25 * math.pi * i / around, _RADIUS + 0.5 * (k - 1) * _THICKNESS
            y = 0.25 * _LENGTH * j / along
            lines.append(f"{number[i, j, k]}, {r * math.sin(angle):.12g}, {y:.12g}, {r * math.cos(angle):.12g}")
    lines.append("*ELEMENT, TYPE=C3D20R, ELSET=SHEET")
    for k, nodes in enumerate(elements, 1):
        text = [str(one) for one in (k, *nodes)]
        lines += [", ".join(text[:15]) + ",", ", ".join(text[15:])]
    modulus = 0.5 * _YOUNG / (1.0 + _POISSON)
    across = ", ".join([f"{_YOUNG}"] * 3 + [f"{_POISSON}"] * 3 + [f"{shear * modulus}"] * 2)
    lines += ["*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL", "0, 0, 0, 0, 1, 0", "*MATERIAL, NAME=M"]  # 1: along the radius
    lines += ["*ELASTIC, TYPE=ENGINEERING CONSTANTS", across, f"{modulus}, 0"]
    lines += ["*SOLID SECTION, ELSET=SHEET, MATERIAL=M, ORIENTATION=O", "*BOUNDARY"]
    for plane, axis in ((number[0], 1), (number[-1], 3), (number[:, 0], 2)):
        lines += [f"{node}, {axis}" for node in plane.ravel().tolist() if node in used]
    points = ", ".join(str(line[1]) for line in (number[0, 0], number[-1, 0], number[-1, -1]))
    lines += ["*NSET, NSET=POINTS", points]
    for part in (0.5, 1.0):
        lines += ["*STEP, NLGEOM, INC=2000", "*STATIC", "0.02, 1.0, 1e-6, 0.1", "*CLOAD"]
        lines += [f"{node}, 3, {part * _FORCE * w}" for node, w in zip(number[0, 0], (1 / 6, 4 / 6, 1 / 6), strict=True)]
        lines += ["*NODE PRINT, NSET=POINTS, FREQUENCY=9999", "U", "*END STEP"]
    return "\n".join([*lines, ""])


def displacements(around: int, along: int, shear: float) -> list[tuple[float, float, float]]:
    """Displacements of A, B and C at half and at full force, m."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "cylinder.inp").write_text(solid_input(around, along, shear))
        one = {"OMP_NUM_THREADS": "1"}
        subprocess.run(
            ["ccx", "-i", "cylinder"], cwd=folder, env=os.environ | one, capture_output=True, timeout=_LIMIT, check=False
        )
        words = [line.split() for line in (folder / "cylinder.dat").read_text().splitlines()]
    rows = [[float(word) for word in line[1:4]] for line in words if line and line[0].isdigit()]
    return [(a[2], -b[0], -c[0]) for a, b, c in zip(rows[::3], rows[1::3], rows[2::3], strict=True)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each mesh and shear stiffness."""
    parser = argparse.ArgumentParser(prog="python -m validation.peers.point_force", description=__doc__.split("\n")[0])
    parser.add_argument("--meshes", nargs="+", default=["8x6", "12x8", "16x12", "24x16"], help="cells around and along")
    for mesh in parser.parse_args(arguments).meshes:
        around, along = (int(text) for text in mesh.split("x"))
        for shear in (1.0, 100.0):
            for part, found in zip((0.5, 1.0), displacements(around, along, shear), strict=False):
                texts = ", ".join(f"{value:.4f}" for value in found)
                print(f"{mesh}, shear stiffness x {shear:g}, force x {part}: {texts}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
