"""Printed Kresling tube: geometry by its construction, and its case between two plates."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from fsm.case.loading.load_case import LoadedCase, load_case
from fsm.run.run_case import run_case

__all__ = ["COMPRESSED", "MESH", "RADIUS", "SIDES", "YOUNG", "angles", "force", "height", "tube_case", "wall_thickness"]

SIDES = 6
RADIUS, WALL, COMPRESSED = 30e-3, 1e-3, 10e-3
"""Circumradius of the outer polygons, wall along the radius, height of the compressed tube, m; from the script."""
POISSON, DENSITY = 0.45, 1200.0
"""Values of a polyurethane. The density has no influence, because the test is slow."""
YOUNG = 100e6
"""Young's modulus of the runs, Pa. All stiffness is proportional to it, and so is the force."""
MESH = 7.5e-3
"""Largest cell, m."""
WELDED = 200.0
"""Stiffness of the folds of flexible facets, over that of a wall as long as a cell: the wall is printed in one piece."""


def angles(ratio: float) -> tuple[float, float]:
    """Rotation of the top over the bottom, rad, of the tube as printed and as compressed."""
    range_of_angle = math.pi - 2.0 * math.pi / SIDES
    return (1.0 - ratio) * range_of_angle, ratio * range_of_angle


def height(ratio: float) -> float:
    """Height as printed, m. Both slanted edges of the facets then have the same lengths as in the compressed tube."""
    printed, compressed = (math.cos(angle + 2.0 * math.pi / SIDES) for angle in angles(ratio))
    return math.sqrt(COMPRESSED**2 + 2.0 * RADIUS**2 * (printed - compressed))


def wall_thickness(ratio: float) -> float:
    """Mean thickness of a facet along its normal, m.

    In each plane z the inner surface is the outer one, smaller by the wall.
    """
    low, up = _ring(RADIUS, 0.0, 0.0), _ring(RADIUS, height(ratio), angles(ratio)[0])
    facet = np.array([low[0], low[1], up[1]])
    inner = facet * [1.0 - WALL / RADIUS, 1.0 - WALL / RADIUS, 1.0]
    normal = np.cross(facet[1] - facet[0], facet[2] - facet[0])
    return float(np.abs((facet - inner) @ normal).mean() / np.linalg.norm(normal))


def tube_case(
    path: Path, ratio: float, thickness: float, travel: float, facets: str = "flexible", fold: float = 0.0,
    mesh: float = MESH,
) -> LoadedCase:  # fmt: skip
    """Write the case of a tube that is compressed by `travel` between two plates, and read it.

    The lower edge is held, and clamped if the facets are flexible. The upper edge is on a rigid plate that can rotate.

    Parameters
    ----------
    path : of the case file
    ratio : ratio of angles of the tube
    thickness : of the wall, m
    travel : m
    facets : kind of facets
    fold : stiffness of the folds, N m/rad per m; 0: flexible facets without hinges between them
    mesh : largest cell of flexible facets, m
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    top, flexible = height(ratio), facets == "flexible"
    rigidity = YOUNG * thickness**3 / (12.0 * (1.0 - POISSON**2))
    path.write_text(
        f"""# Kresling tube between two plates. The lower plate is held; the upper one comes down and can rotate.
[sheet]
kind = "kresling"
sides = {SIDES}
rows = 1
radius = {RADIUS - 0.5 * WALL!r}   # of the middle surface
height = {top!r}
twist = {angles(ratio)[0]!r}
facets = "{facets}"
thickness = {thickness!r}
{f"mesh_size = {mesh!r}" if flexible else ""}

[[sheet.support]]
at = "edge bottom"
{"clamped = true" if flexible else ""}

[material]
young = {YOUNG!r}
poisson = {POISSON}
density = {DENSITY}
damping = "0.1 s"

[crease]
stiffness_per_length = {fold or WELDED * rigidity / mesh!r}

[[scene.bodies]]
name = "plate"
mass = "5 g"
inertia = [1e-6, 1e-6, 1e-6]
position = [0, 0, {top!r}]

[[scene.seams]]
name = "upper edge"
film = "sheet"
edge = "top"
bodies = ["plate"]
stiffness = "1 GPa"

[[scene.bodies]]
name = "machine"
mass = "5 g"
inertia = [1e-6, 1e-6, 1e-6]
position = [0, 0, {top!r}]

[[scene.elements]]
name = "bearing of the plate"
inner = "machine"
outer = "plate"
translation = [1e7, 1e7, 1e7]
rotation = [1e3, 1e3, 0]

[[drive]]
body = "machine"
direction = [0, 0, -1]
speed = "1 mm/s"
travel = {travel!r}

[solve]
method = "static"
rtol = 1e-3
""",
        encoding="utf-8",
    )
    return load_case(path)


def force(
    folder: Path, ratio: float, thickness: float, travel: np.ndarray, facets: str = "flexible", fold: float = 0.0,
    mesh: float = MESH,
) -> np.ndarray:  # fmt: skip
    """Force with `YOUNG` at increasing travels, N; the results are in `folder`."""
    longer = 1.02 * float(travel[-1])  # the drive begins gently, so it is one hundredth of its travel late
    loaded = tube_case(folder / "case.toml", ratio, thickness, longer, facets, fold, mesh)
    run_case(loaded, folder, progress=False, figures=False)
    found = np.genfromtxt(folder / "force.csv", delimiter=",", skip_header=1)
    return np.interp(travel, found[:, 0], found[:, 1])


def _ring(radius: float, z: float, turn: float) -> np.ndarray:
    at = 2.0 * np.pi * np.arange(SIDES) / SIDES + turn
    return np.column_stack([radius * np.cos(at), radius * np.sin(at), np.full(SIDES, z)])
