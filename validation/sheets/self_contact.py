"""Flexible sheets that touch themselves, checked by an independent test for intersections, `ipctk.has_intersections`.

A zigzag of six panels is pushed together until its panels lie on each other. The stiffness of its creases and of its
contact is in proportion to that of its panels.

    python -m validation.sheets.self_contact [--first 3]
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import fsm
from fsm.errors import FsmError
from fsm.results.store import read_solution

__all__ = ["CASES", "closing_zigzag", "intersecting"]

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


def main() -> None:
    """Table of all cases."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=len(CASES), help="number of cases")
    print("| thickness (um) | friction | saved states | with intersections | travel (mm) | processor time (s) |")
    print("|---|---|---|---|---|---|")
    for thickness, friction in CASES[: parser.parse_args().first]:
        begun = time.process_time()
        with TemporaryDirectory() as folder:
            try:
                fsm.load(closing_zigzag(thickness, friction), folder=folder).run(Path(folder) / "out", figures=False)
                solution = read_solution(Path(folder) / "out" / "result.h5")
            except FsmError as error:
                print(f"| {1e6 * thickness:g} | {friction:g} | failed: {str(error)[:120]} | | | |", flush=True)
                continue
        used, found = time.process_time() - begun, intersecting(solution.shape)
        travel = 1e3 * float(solution.travel[-1, 0])
        print(
            f"| {1e6 * thickness:g} | {friction:g} | {len(solution.shape)} | {len(found)} | {travel:.4g} | {used:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
