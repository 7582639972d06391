"""Flexible sheets that touch themselves, checked by an independent test for intersections, `ipctk.has_intersections`.

A zigzag of six panels is pushed together until its panels lie on each other. The stiffness of its creases and of its
contact is in proportion to that of its panels.

With `--random`, Miura sheets of bars with random shapes, thicknesses of 20 um to 1 mm and friction coefficients of 0 to 1
are packed to three thicknesses for each column, or until the force is 20 N for each N m/rad/m of the creases.

    python -m validation.sheets.self_contact [--first 3] [--random 100] [--frictionless]
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import fsm
from fsm.errors import FsmError
from fsm.results.store import read_solution

__all__ = ["CASES", "closing_zigzag", "intersecting", "packed_miura"]

CASES = ((0.5e-3, 0.0), (0.5e-3, 0.3), (0.5e-3, 1.0), (1e-3, 0.0), (1e-4, 0.3), (2e-5, 0.0))
"""Thickness (m) and friction coefficient."""


def closing_zigzag(thickness: float, friction: float) -> dict[str, Any]:
    """Case of a zigzag that is pushed together."""
    part = (thickness / 0.5e-3) ** 3
    sheet = {
        "kind": "zigzag", "columns": 6, "a": "40 mm", "b": "30 mm", "fold_angle": "60 deg", "thickness": thickness,
        "facets": "flexible", "mesh_size": "20 mm",
        "support": [{"at": "edge left", "fixed": ["x", "y", "z"]}],
    }  # fmt: skip
    slides = {"friction": {"law": "tanh", "mu_dynamic": friction, "v_static": "1 mm/s"}} if friction else {}
    return {
        "sheet": sheet, "material": {"young": 3e9, "poisson": 0.3, "density": 1000.0, "damping": "10 ms"},
        "crease": {"stiffness_per_length": 0.05 * part}, "contact": {"law": "linear", "stiffness": f"{1e6 * part:g} N/m"},
        "drive": [{"edge": "right", "direction": [-1, 0, 0], "speed": "1 mm/s", "travel": "104 mm"}],
        "solve": {"method": "static"}, "save": {"every": "1 mm"},
    } | slides  # fmt: skip


def packed_miura(seed: int) -> tuple[dict[str, Any], str]:
    """Case of a random Miura sheet that is pushed together along x, and its text for the table.

    The sheet is pushed until its length is three thicknesses for each column, at least 3 mm, or until it locks: the force of
    the creases alone is at most a few N for each N m/rad/m of their stiffness k. At k in N, a whole face has a penetration of
    1/5000 of the thickness.
    """
    dice = np.random.default_rng(seed)
    columns, rows = int(dice.integers(3, 6)), int(dice.integers(2, 4))
    thickness, friction = float(f"{10.0 ** dice.uniform(-4.7, -3.0):.2g}"), round(float(dice.uniform(0.0, 1.0)), 1)
    sector, fold = math.radians(float(dice.integers(55, 80))), math.radians(float(dice.integers(30, 60)))
    along = math.cos(fold) * math.sin(sector)
    length = columns * 0.03 * along / math.hypot(math.cos(sector), along)
    travel = length - max(3.0 * thickness, 3e-3) * columns
    sheet = {
        "kind": "miura", "columns": columns, "rows": rows, "a": "25 mm", "b": "30 mm", "sector_angle": sector,
        "fold_angle": fold, "thickness": thickness, "facets": "bars",
        "support": [
            {"at": "edge left", "fixed": ["x"]}, {"at": "vertex 1", "fixed": ["y", "z"]}, {"at": "vertex 3", "fixed": ["z"]},
        ],
    }  # fmt: skip
    slides = {"friction": {"law": "tanh", "mu_dynamic": friction, "v_static": "0.1 mm/s"}} if friction else {}
    drive = {"edge": "right", "direction": [-1, 0, 0], "speed": travel / 100.0, "travel": travel, "guide": False}
    crease = 0.05 * (thickness / 2e-4) ** 3
    stiffness = 5e3 * crease / thickness
    case = {
        "sheet": sheet, "material": {"young": 3e9, "poisson": 0.3, "density": 1400.0, "damping": "0.1 s"},
        "crease": {"stiffness_per_length": crease},
        "contact": {"law": "linear", "stiffness": f"{stiffness:g} N/m", "damping": f"{1e-3 * stiffness:g} N s/m"},
        "drive": [drive], "solve": {"method": "static", "force_limit": 20.0 * crease}, "save": {"every": travel / 50.0},
    } | slides  # fmt: skip
    return case, f"{seed} | {columns} x {rows} | {1e6 * thickness:g} | {friction:g}"


def intersecting(shape: np.ndarray) -> list[int]:
    """Numbers of the saved states (n, triangles, 3 or 4, 3) in which triangles without a common node intersect."""
    import ipctk

    corners = shape[:, :, :3].astype(float)
    places = corners[0].reshape(-1, 3)
    _, first, number = np.unique(np.round(places / 1e-6).astype(np.int64), axis=0, return_index=True, return_inverse=True)
    faces = number.reshape(-1, 3)
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    edges = np.unique(np.sort(sides, axis=1), axis=0)
    mesh = ipctk.CollisionMesh(np.asfortranarray(places[first]), edges, faces)
    return [k for k, state in enumerate(corners) if ipctk.has_intersections(mesh, state.reshape(-1, 3)[first])]


def _row(text: str, case: dict[str, Any]) -> None:
    """Print the row of one case."""
    begun = time.process_time()
    with TemporaryDirectory() as folder:
        try:
            fsm.load(case, folder=folder).run(Path(folder) / "out", figures=False)
            solution = read_solution(Path(folder) / "out" / "result.h5")
        except FsmError as error:
            print(f"| {text} | failed: {str(error)[:200]} | | | |", flush=True)
            return
    used, found = time.process_time() - begun, intersecting(solution.shape)
    travel = 1e3 * float(solution.travel[-1, 0])
    print(f"| {text} | {len(solution.shape)} | {len(found)} | {travel:.4g} | {used:.0f} |", flush=True)


def main() -> None:
    """Table of all cases."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=len(CASES), help="number of cases of the zigzag")
    parser.add_argument("--random", type=int, default=0, help="number of random Miura sheets, in place of the zigzag")
    given = parser.parse_args()
    results = "saved states | with intersections | travel (mm) | processor time (s)"
    if given.random:
        print(f"| seed | columns x rows | thickness (um) | friction | {results} |\n|{'---|' * 8}")
        for seed in range(given.random):
            case, text = packed_miura(seed)
            _row(text, case)
        return
    print(f"| thickness (um) | friction | {results} |\n|{'---|' * 6}")
    for thickness, friction in CASES[: given.first]:
        _row(f"{1e6 * thickness:g} | {friction:g}", closing_zigzag(thickness, friction))


if __name__ == "__main__":
    main()
