"""Printed Kresling tube: geometry by its construction, and its case of bars and hinges."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from fsm.case.loading.load_case import LoadedCase, load_case
from fsm.run.run_case import run_case

__all__ = ["COMPRESSED", "RADIUS", "SIDES", "WALL", "angles", "force", "height", "preset", "tube_case", "wall_thickness"]

SIDES = 6
RADIUS, WALL, COMPRESSED = 30e-3, 1e-3, 10e-3
"""Circumradius of the outer polygons, wall along the radius, height of the compressed tube, m; from the script."""
POISSON, DENSITY = 0.45, 1200.0
"""Values of a polyurethane. These values do not affect the force: the stiffnesses are calibrated, and the test is slow."""


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


def preset(ratio: float, young: float, thickness: float) -> float:
    """Stiffness of a fold that is as stiff as the sheet, N m/rad per m: 0.55 G (L/t)^(1/3)/L, mean of the creases.

    Liu and Paulino (2017), G = E t^3/(12 (1 - nu^2)).
    """
    rigidity = young * thickness**3 / (12.0 * (1.0 - POISSON**2))
    lengths = np.array([RADIUS, *_slanted(ratio)])
    return float(0.55 * rigidity * np.mean((lengths / thickness) ** (1.0 / 3.0) / lengths))


def tube_case(path: Path, ratio: float, young: float, thickness: float, crease: float, travel: float) -> LoadedCase:
    """Write the case of a tube between two plates that is compressed by `travel`, and read it.

    Parameters
    ----------
    path : of the case file
    ratio : ratio of angles of the tube
    young : of the bars, Pa
    thickness : m
    crease : N m/rad per m
    travel : m
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    vertices, faces = _surface(ratio)
    edges, letters, folds = _folds(vertices, faces)
    bottom = [*range(1, SIDES + 1), 2 * SIDES + 1]
    top = [*range(SIDES + 1, 2 * SIDES + 1), 2 * SIDES + 2]
    path.write_text(
        f"""# Kresling tube with a plate at each end. The lower plate is held, the upper one comes down and can rotate.
[sheet]
facets = "bars"
thickness = {thickness!r}
vertices = {vertices.tolist()}
faces = {faces}
edges = {edges}
assignment = {str(letters).replace("'", '"')}
angles = {folds}

[[sheet.support]]
at = "vertices {", ".join(map(str, bottom))}"

[material]
young = {young!r}
poisson = {POISSON}
density = {DENSITY}

[crease]
stiffness_per_length = {crease!r}

[[drive]]
at = "vertices {", ".join(map(str, top))}"
direction = [0, 0, -1]
guide = false
speed = "1 mm/s"
travel = {travel!r}

[solve]
method = "static"
end_time = {travel / 1e-3!r}
""",
        encoding="utf-8",
    )
    return load_case(path)


def force(folder: Path, ratio: float, young: float, thickness: float, crease: float, travel: np.ndarray) -> np.ndarray:
    """Force at increasing travels, N; the results are in `folder`."""
    longer = 1.02 * float(travel[-1])  # the drive begins gently, so it is one hundredth of its travel late
    loaded = tube_case(folder / "case.toml", ratio, young, thickness, crease, longer)
    run_case(loaded, folder, progress=False, figures=False)
    found = np.genfromtxt(folder / "force.csv", delimiter=",", skip_header=1)
    return np.interp(travel, found[:, 0], found[:, 1])


def _slanted(ratio: float) -> tuple[float, float]:
    """Lengths of both slanted edges, m."""
    printed = angles(ratio)[0]
    turns = (printed, printed + 2.0 * math.pi / SIDES)
    first, second = (math.sqrt(height(ratio) ** 2 + 2.0 * RADIUS**2 * (1.0 - math.cos(turn))) for turn in turns)
    return first, second


def _ring(radius: float, z: float, turn: float) -> np.ndarray:
    at = 2.0 * np.pi * np.arange(SIDES) / SIDES + turn
    return np.column_stack([radius * np.cos(at), radius * np.sin(at), np.full(SIDES, z)])


def _surface(ratio: float) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices and outward triangles of the middle surface: bottom ring, top ring, centres of both plates."""
    middle = RADIUS - 0.5 * WALL
    top = height(ratio)
    vertices = np.vstack([_ring(middle, 0.0, 0.0), _ring(middle, top, angles(ratio)[0]), [[0.0, 0.0, 0.0], [0.0, 0.0, top]]])
    faces: list[list[int]] = []
    for i in range(SIDES):
        j = (i + 1) % SIDES
        faces += [[i, j, SIDES + j], [i, SIDES + j, SIDES + i]]
        faces += [[j, i, 2 * SIDES], [SIDES + i, SIDES + j, 2 * SIDES + 1]]
    return vertices, faces


def _folds(vertices: np.ndarray, faces: list[list[int]]) -> tuple[list[list[int]], list[str], list[float]]:
    """Edges, letters and fold angles of a closed surface; lines of the plates are bend lines."""
    corners = vertices[np.array(faces)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    found: dict[tuple[int, int], list[int]] = {}
    for number, face in enumerate(faces):
        for u, v in zip(face, [*face[1:], face[0]], strict=True):
            found.setdefault((min(u, v), max(u, v)), []).append(number)
    edges, letters, folds = [], [], []
    for (u, v), (one, other) in found.items():
        face = faces[one]
        forward = face[(face.index(u) + 1) % 3] == v
        along = (vertices[v] - vertices[u]) * (1.0 if forward else -1.0)
        sine = np.cross(normals[one], normals[other]) @ along / np.linalg.norm(along)
        angle = -math.atan2(float(sine), float(normals[one] @ normals[other]))
        flat = abs(angle) < 1e-9
        edges.append([u, v])
        letters.append("J" if flat else "V" if angle > 0.0 else "M")
        folds.append(0.0 if flat else angle)
    return edges, letters, folds
