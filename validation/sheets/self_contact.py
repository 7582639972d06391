"""Flexible sheets that touch themselves, checked by an independent test for intersections, `ipctk.has_intersections`.

A zigzag of six panels is pushed together until its panels lie on each other. The stiffness of its creases and of its
contact is in proportion to that of its panels.

With `--random`, Miura sheets of bars with random shapes, thicknesses of 20 um to 1 mm and friction coefficients of 0 to 1
are packed to three thicknesses for each column, or until the force is 20 N for each N m/rad/m of the creases. With
`--flashers`, flashers of bars with random shapes fold themselves from flat. With `--released`, the same Miura sheets are
packed without friction and pulled back; a sheet that is not stuck has its first shape again.

    python -m validation.sheets.self_contact [--first 3] [--random 100] [--flashers 20] [--released 20]
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
from fsm.results.solution import Solution
from fsm.results.store import read_solution

__all__ = ["CASES", "closing_zigzag", "intersecting", "packed_miura", "random_flasher", "solved"]

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

    The sheet is pushed until its length is three thicknesses for each column, or until it locks. The force of
    the creases alone is at most a few N for each N m/rad/m of their stiffness. Under one N for each N m/rad/m, a whole face
    has a penetration of 1/5000 of the thickness.
    """
    dice = np.random.default_rng(seed)
    columns, rows = int(dice.integers(3, 6)), int(dice.integers(2, 4))
    thickness, friction = float(f"{10.0 ** dice.uniform(-4.7, -3.0):.2g}"), round(float(dice.uniform(0.0, 1.0)), 1)
    sector, fold = math.radians(float(dice.integers(55, 80))), math.radians(float(dice.integers(30, 60)))
    along = math.cos(fold) * math.sin(sector)
    length = columns * 0.03 * along / math.hypot(math.cos(sector), along)
    travel = length - 3.0 * thickness * columns
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


def random_flasher(seed: int) -> tuple[dict[str, Any], str]:
    """Case of a random flasher that folds itself to the angles of its flat-folded state, and its text for the table.

    Contact keeps the double flaps apart. Its stiffness is chosen as in `packed_miura`.
    """
    dice = np.random.default_rng([seed, 1])
    sides, height = int(dice.integers(4, 9)), round(float(dice.uniform(0.02, 0.06)), 3)
    thickness, friction = float(f"{10.0 ** dice.uniform(-4.7, -3.3):.2g}"), round(float(dice.uniform(0.0, 1.0)), 1)
    crease = 0.05 * (thickness / 2e-4) ** 3
    stiffness = 5e3 * crease / thickness
    sheet = {
        "kind": "flasher", "sides": sides, "outer_radius": "100 mm", "height": height, "thickness": thickness,
        "facets": "bars", "fold_to": 1.0, "support": [{"at": "edge hub"}],
    }  # fmt: skip
    slides = {"friction": {"law": "tanh", "mu_dynamic": friction, "v_static": "0.1 mm/s"}} if friction else {}
    case = {
        "sheet": sheet, "material": {"young": 3e9, "poisson": 0.3, "density": 1400.0, "damping": "0.1 s"},
        "crease": {"stiffness_per_length": crease},
        "contact": {"law": "linear", "stiffness": f"{stiffness:g} N/m", "damping": f"{1e-3 * stiffness:g} N s/m"},
        "solve": {"method": "static", "end_time": "100 s"}, "save": {"interval": "2 s"},
    } | slides  # fmt: skip
    return case, f"{seed} | {sides} x {1e3 * height:g} mm | {1e6 * thickness:g} | {friction:g}"


def solved(case: dict[str, Any]) -> Solution | str:
    """Solution of a case, or the message of its failure."""
    with TemporaryDirectory() as folder:
        try:
            fsm.load(case, folder=folder).run(Path(folder) / "out", figures=False)
        except FsmError as error:
            return str(error)[:200]
        return read_solution(Path(folder) / "out" / "result.h5")


def _row(text: str, case: dict[str, Any]) -> tuple[int, int, int]:
    """Print the row of one case; return the numbers of saved states, and of states with intersections and with contact."""
    begun = time.process_time()
    solution = solved(case)
    if isinstance(solution, str):
        print(f"| {text} | failed: {solution} | | | | |", flush=True)
        return 0, 0, 0
    used, found = time.process_time() - begun, intersecting(solution.shape)
    touching = int((solution.pair_force > 0.0).any(axis=1).sum())
    folded = solution.summary.get("folded")
    end = f"folded {folded['least']:.2f} (least), {folded['median']:.2f} (median)" if folded else ""
    if solution.travel.shape[1]:
        limited = any(event["kind"] == "force limit" for event in solution.summary["events"])
        end = f"{1e3 * solution.travel[-1, 0]:.4g} mm{', force limit' if limited else ''}"
    print(f"| {text} | {len(solution.shape)} | {touching} | {len(found)} | {end} | {used:.0f} |", flush=True)
    return len(solution.shape), len(found), touching


def _released(seed: int) -> str:
    """Row of a sheet that is packed without friction and pulled back to its first length.

    The way back begins just before the travel at which the force limit was reached.
    """
    case, text = packed_miura(seed)
    case.pop("friction", None)
    packed = solved(case)
    if isinstance(packed, str):
        return f"| {text} | failed: {packed} | | | |"
    drive, travel = case["drive"][0], 0.99 * float(packed.travel[-1, 0])
    for key in ("speed", "travel"):
        drive.pop(key)
    there = {"kind": "table", "time": [0.0, 100.0, 200.0], "value": [0.0, 1.0, 0.0]}
    case |= {"solve": {"method": "static"}, "save": {"interval": 4.0}}
    back = solved(case | {"drive": [drive | {"travel": travel, "time": there}]})
    if isinstance(back, str):
        return f"| {text} | failed: {back} | | | |"
    size = float(np.ptp(back.shape[0].reshape(-1, 3), axis=0).max())
    off = float(np.linalg.norm(back.shape[-1] - back.shape[0], axis=-1).max()) / size
    force = abs(float(back.force[-1, 0])) / float(np.abs(back.force[:, 0]).max())
    return f"| {text} | {len(back.shape)} | {len(intersecting(back.shape))} | {1e3 * travel:.4g} | {off:.1e} | {force:.1e} |"


def main() -> None:
    """Table of all cases."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=len(CASES), help="number of cases of the zigzag")
    parser.add_argument("--random", type=int, default=0, help="number of random Miura sheets, in place of the zigzag")
    parser.add_argument("--flashers", type=int, default=0, help="number of random flashers, in place of the zigzag")
    parser.add_argument("--released", type=int, default=0, help="number of Miura sheets that are packed and pulled back")
    parser.add_argument("--from", type=int, default=0, dest="begin", help="first seed")
    given = parser.parse_args()
    results = "saved states | with contact | with intersections | end | processor time (s)"
    drawn = [packed_miura(given.begin + k) for k in range(given.random)]
    drawn += [random_flasher(given.begin + k) for k in range(given.flashers)]
    if drawn:
        print(f"| seed | size | thickness (um) | friction | {results} |\n|{'---|' * 9}")
        counts = np.array([_row(text, case) for case, text in drawn])
        solved, touching = (int((counts[:, k] > 0).sum()) for k in (0, 2))
        states, found, _ = counts.sum(axis=0).tolist()
        print(f"\n{solved} of {len(drawn)} solved, {touching} with contact")
        print(f"{found} of {states} saved states have intersections")
    if given.released:
        ends = "travel (mm) | largest difference from the first shape, over the size | final over peak force"
        columns = f"seed | size | thickness (um) | friction (not used) | saved states | with intersections | {ends}"
        print(f"| {columns} |\n|{'---|' * 9}")
        for k in range(given.released):
            print(_released(given.begin + k), flush=True)
    if drawn or given.released:
        return
    print(f"| thickness (um) | friction | {results} |\n|{'---|' * 7}")
    for thickness, friction in CASES[: given.first]:
        _row(f"{1e6 * thickness:g} | {friction:g}", closing_zigzag(thickness, friction))


if __name__ == "__main__":
    main()
