"""The same tape spring by CalculiX (S8R shells, large displacements): moment over turn up to the peak."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np

from validation.boom.tape import NU, RADIUS, STEEL, YOUNG

__all__ = ["calculix_input", "moments"]

_LIMIT, _LENGTH = 900.0, 80e-3


def calculix_input(mesh: tuple[int, int], turn: float, sense: float = 1.0, largest: float = 0.05) -> str:
    """Input file of half a tape spring whose end turns by `turn` (rad); `largest`: increment over the whole turn.

    The cells are those of `validation.boom.tape.tape_spring`. The rigid end can translate; its rotations are prescribed.
    """
    nx, ny = mesh
    number = np.arange(1, (2 * nx + 1) * (2 * ny + 1) + 1).reshape(2 * nx + 1, 2 * ny + 1)
    elements = []
    for i in range(0, 2 * nx, 2):
        for j in range(0, 2 * ny, 2):
            q = number[i : i + 3, j : j + 3]
            elements.append([q[0, 0], q[2, 0], q[2, 2], q[0, 2], q[1, 0], q[2, 1], q[1, 2], q[0, 1]])
    used = set(np.unique(elements).tolist())
    x = np.linspace(0.0, _LENGTH, 2 * nx + 1)
    across = np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, ny + 1))
    phi = 0.5 * STEEL.angle * np.interp(np.arange(2 * ny + 1), np.arange(0, 2 * ny + 1, 2), across)
    lines = ["*NODE, NSET=ALL"]
    for i, j in np.ndindex(number.shape):
        if int(number[i, j]) in used:
            y, z = RADIUS * np.sin(phi[j]), RADIUS * (np.cos(phi[j]) - 1.0)
            lines.append(f"{number[i, j]}, {x[i]:.12g}, {y:.12g}, {z:.12g}")
    ref = number.size + 1
    lines.append(f"{ref}, {_LENGTH:.12g}, 0, 0.1")
    lines.append("*ELEMENT, TYPE=S8R, ELSET=SHEET")
    lines += [", ".join(map(str, (k + 1, *nodes))) for k, nodes in enumerate(elements)]
    lines += ["*NSET, NSET=END", *(str(node) for node in number[-1]), "*NSET, NSET=REF", f"{ref}"]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{YOUNG}, {NU}", "*SHELL SECTION, ELSET=SHEET, MATERIAL=M"]
    lines.append(str(STEEL.thickness))
    first = number[-1, 0]
    lines.append("*EQUATION")
    for j, node in enumerate(number[-1].tolist()):
        apart = RADIUS * (np.cos(phi[j]) - np.cos(phi[0]))
        if node != first:
            lines += [
                "3",
                f"{node}, 1, 1., {first}, 1, -1., {ref}, 1, {-apart:.12g}",
                "2",
                f"{node}, 3, 1., {first}, 3, -1.",
            ]
    lines.append("*BOUNDARY")
    for node in number[0]:
        lines += [f"{node}, 1, 1", f"{node}, 5, 5"]  # rotations about z too would hold the section
    lines += [f"{number[0, ny]}, 2, 3", *(f"{node}, 2, 2" for node in number[-1])]
    lines += ["*STEP, NLGEOM, INC=2000", "*STATIC", f"{0.5 * largest}, 1.0, 1e-5, {largest}", "*BOUNDARY"]
    lines += [f"{ref}, 1, 1, {-sense * turn:.12g}"]
    lines += ["*NODE PRINT, NSET=REF", "U", "*EL PRINT, ELSET=SHEET, TOTALS=ONLY", "ELSE", "*END STEP", ""]
    return "\n".join(lines)


def moments(folder: Path, mesh: tuple[int, int], turn: float, sense: float = 1.0) -> np.ndarray:
    """Turn (rad) and moment (N m) of all increments until the statics of CalculiX ends, (n, 2)."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "tape.inp").write_text(calculix_input(mesh, turn, sense))
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    subprocess.run(
        ["ccx", "-i", "tape"], cwd=folder, env=os.environ | one, capture_output=True, timeout=_LIMIT, check=False
    )  # CalculiX ends with an error at the peak, beyond which no equilibrium is near
    turns, energies = [0.0], [0.0]
    lines = iter((folder / "tape.dat").read_text().splitlines())
    for line in lines:
        if "displacements" in line:
            next(lines)
            turns.append(abs(float(next(lines).split()[1])))
        elif "total internal energy" in line:
            next(lines)
            energies.append(float(next(lines)))
    at, energy = np.array(turns), np.array(energies)
    return np.column_stack([0.5 * (at[1:] + at[:-1]), np.diff(energy) / np.diff(at)])
