"""Pattern of a section [sheet], and the stiffness of its bend lines.

Places on a sheet by name or by geometry: edges, vertices, facets, and boxes.

Mesh of the flexible facets of a sheet.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from fsm.builders.patterns.cuts import open_cuts
from fsm.builders.patterns.foldability import bad_lines
from fsm.builders.patterns.folding import fold_pattern
from fsm.builders.patterns.generators import cone, flasher, kresling, miura, miura_tube, tube, waterbomb, yoshimura, zigzag
from fsm.builders.patterns.pattern_mesh import pattern_mesh
from fsm.builders.patterns.plates import boom_mesh, plate_mesh
from fsm.builders.patterns.slits import slits
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import FacetMesh
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.pattern import ASSIGNMENTS, Pattern, edge_groups
from fsm.errors import CaseError, Fault, fault_at


@lru_cache(maxsize=4)
def pattern_of(sheet: Sheet) -> Pattern:
    """Pattern of a sheet at its start, with the bend lines of its facets; the last few are cached.

    Raises
    ------
    CaseError
        The pattern is faulty.
    """
    with fault_at("sheet"):
        pattern = _generated(sheet)
    pattern = pattern if sheet.facets in ("rigid", "flexible") else pattern.with_bend_lines()
    try:
        pattern = fold_pattern(pattern, sheet.fold)
    except ValueError as error:
        stuck = bad_lines(pattern, sheet.facets != "rigid")
        raise CaseError(Fault("sheet.fold", "; ".join([str(error), *stuck]))) from None
    with fault_at("sheet.align"):
        return pattern if sheet.align is None else _in_mean_plane(pattern)


def _in_mean_plane(pattern: Pattern) -> Pattern:
    """Pattern after the smallest rotation that makes the plane of least squares through its vertices horizontal, with this
    plane at z = 0; the mean of the vertices keeps x and y, and most of the area of the facets is seen from above as before.

    Raises
    ------
    ValueError
        The vertices have no such plane.
    """
    middle = pattern.vertices.mean(axis=0)
    _, sizes, axes = np.linalg.svd(pattern.vertices - middle, full_matrices=False)
    if sizes[1] - sizes[2] <= 1e-6 * sizes[0]:
        raise ValueError("the vertices have no mean plane, because they extend as far in two directions; remove `align`")
    normal = axes[2]
    points = pattern.vertices - middle
    sums = [np.cross(points[list(face)], points[[*face[1:], face[0]]]).sum(axis=0) for face in pattern.faces]
    area = np.sum(sums, axis=0)
    before, after = float(area[2]), float(normal @ area)
    same = before * after if abs(before) > 1e-6 * float(np.linalg.norm(area)) else float(normal[2])
    normal = -normal if same < 0.0 else normal
    across, cosine = np.cross(normal, [0.0, 0.0, 1.0]), float(normal[2])
    if cosine <= -1.0 + 1e-12:
        turn = np.diag([1.0, -1.0, -1.0])
    else:
        skew = np.cross(np.eye(3), across)  # the matrix of the cross product with this axis
        turn = np.eye(3) + skew + skew @ skew / (1.0 + cosine)
    turned = (pattern.vertices - middle) @ turn.T
    return replace(pattern, vertices=turned + [middle[0], middle[1], 0.0])


def _generated(sheet: Sheet) -> Pattern:
    def given(name: str) -> float:
        return float(getattr(sheet, name))

    if sheet.kind is None:
        return _written(sheet)
    columns, rows, sides = sheet.columns or 1, sheet.rows or 1, sheet.sides or 3
    if sheet.kind == "miura":
        return miura(columns, rows, given("a"), given("b"), given("sector_angle"), given("fold_angle"))
    if sheet.kind == "miura-tube":
        return miura_tube(columns, given("a"), given("b"), given("sector_angle"), given("fold_angle"))
    if sheet.kind == "zigzag":
        return zigzag(columns, given("a"), given("b"), given("fold_angle"))
    if sheet.kind == "waterbomb":
        return waterbomb(columns, rows, given("a"))
    if sheet.kind == "kresling":
        return kresling(sides, rows, given("radius"), given("height"), given("twist"), sheet.taper or 1.0)
    if sheet.kind == "cone":
        return cone(sides, given("inner_radius"), given("outer_radius"))
    if sheet.kind == "flasher":
        return flasher(sides, given("outer_radius"), given("height"))
    if sheet.kind == "tube":
        return tube(rows, given("radius"), given("height"))
    if sheet.kind == "slits":
        shift = 0.5 if sheet.shift is None else sheet.shift
        sizes = given("spacing"), given("slit_length"), given("ligament"), sheet.slit_width or 0.0
        return slits(given("periods"), rows, *sizes, shift, sheet.margin)
    return yoshimura(sides, rows, given("radius"), given("height"))


def _written(sheet: Sheet) -> Pattern:
    """Pattern of the keys `vertices`, `edges`, `assignment`, `angles` and `faces`, with open cuts."""
    vertices, faces = np.array(sheet.vertices or (), dtype=float).reshape(-1, 3), sheet.faces or ()
    count = len(vertices)
    if not faces:
        raise ValueError("`faces` is empty; give the vertices of each face")
    for number, face in enumerate(faces):
        if len(set(face)) < max(len(face), 3) or not all(0 <= v < count for v in face):
            text = f"it needs three or more different vertices from 0 to {count - 1}"
            raise ValueError(f"faces.{number} is {list(face)}; {text}")
    flat = vertices[:, :2] if not np.ptp(vertices[:, 2]) else None
    pattern = Pattern.of_faces(vertices, faces, flat, edge_groups(vertices[:, :2], faces))
    edges, letters, angles = sheet.edges or (), sheet.assignment or (), sheet.angles or ()
    if not len(edges) == len(letters) == len(angles):
        raise ValueError("`edges`, `assignment` and `angles` must have as many items")
    known = {frozenset(pair): (letter, angle) for pair, letter, angle in zip(edges, letters, angles, strict=True)}
    found = [known.get(frozenset(pair), ("B", 0.0)) for pair in pattern.edges.tolist()]
    return open_cuts(pattern.assigned([letter for letter, _ in found], [angle for _, angle in found]))


def folding_letters(sheet: Sheet) -> str:
    """Letters of the edges that are creases: mountains, valleys, unassigned edges, and flat edges with their own law."""
    flat = any(" ".join(own.of.split()) == ASSIGNMENTS["F"] for own in sheet.crease)
    return "MVUF" if flat else "MVU"


def bend_stiffness_per_length(case: Case, length: float) -> float:
    """Stiffness of a bend line over its length, N m/rad per m: as given, or the fit of Liu and Paulino (2017).

    k/L = G (L/t)^(1/3)/L with G = E t^3/(12 (1 - nu^2)). The fit is for the short diagonal of a facet.
    """
    sheet, material = case.sheet, case.material
    assert sheet is not None and material is not None
    if sheet.bend_stiffness_per_length is not None:
        return sheet.bend_stiffness_per_length
    plate = material.young * sheet.thickness**3 / (12.0 * (1.0 - material.poisson**2))
    return plate * (length / sheet.thickness) ** (1.0 / 3.0) / length


_NUMBERS = re.compile(r"(vertex|vertices|facet)\s+(\d+(?:\s*,\s*\d+)*)")
_FACETS = re.compile(r"facets?\s+(\d+(?:\s*,\s*\d+)*)")


class Place(NamedTuple):
    """Place on a sheet: its name, and its vertices or its facet (numbers from 0)."""

    name: str
    vertices: tuple[int, ...]
    facet: int | None = None


def place_of(pattern: Pattern, at: str | tuple[tuple[float, float, float], tuple[float, float, float]]) -> Place:
    """Vertices or facet at a place.

    Parameters
    ----------
    pattern : Pattern
    at : str, or two opposite corners of a box in m
        "edge left", "vertex 12", "vertices 3, 4, 5", "facet 7" (numbers from 1), or a box around vertices at the start.

    Raises
    ------
    ValueError
        There is no such place; the message lists the places.
    """
    if not isinstance(at, str):
        return _in_box(pattern, np.array(at))
    word, _, rest = at.strip().partition(" ")
    if word == "edge":
        if rest not in pattern.groups:
            names = ", ".join(f'"edge {name}"' for name in pattern.groups)
            raise ValueError(f'"{at}" is not an edge of the sheet; its edges are {names or "not named, give vertices"}')
        return Place(at.strip(), pattern.groups[rest])
    match = _NUMBERS.fullmatch(at.strip())
    if match is None:
        text = 'give "edge left", "vertex 12", "vertices 3, 4, 5", "facet 7", or a box [[x, y, z], [x, y, z]]'
        raise ValueError(f'"{at}" is not a place of the sheet; {text}')
    numbers = tuple(int(number) - 1 for number in match[2].split(","))
    if match[1] == "facet":
        if len(numbers) > 1:
            raise ValueError(f'"{at}" names {len(numbers)} facets; give one facet for each item')
        _check(numbers, len(pattern.faces), "facets")
        return Place(f"facet {numbers[0] + 1}", (), numbers[0])
    _check(numbers, len(pattern.vertices), "vertices")
    return Place(at.strip(), tuple(dict.fromkeys(numbers)))


def facets_named(at: str, count: int) -> tuple[int, ...]:
    """Numbers from 0 of facets on which a pressure acts: "all", "facet 3", or "facets 1, 2".

    Parameters
    ----------
    at : str
    count : number of facets of the sheet

    Raises
    ------
    ValueError
        There is no such facet.
    """
    if at.strip() == "all":
        return tuple(range(count))
    match = _FACETS.fullmatch(at.strip())
    if match is None:
        raise ValueError(f'"{at}" names no facets; a pressure needs "all", "facet 3" or "facets 1, 2"')
    numbers = tuple(dict.fromkeys(int(number) - 1 for number in match[1].split(",")))
    _check(numbers, count, "facets")
    return numbers


def _check(numbers: tuple[int, ...], count: int, what: str) -> None:
    """Raise a ValueError if a number is out of range."""
    for number in numbers:
        if not 0 <= number < count:
            raise ValueError(f"there is no number {number + 1}; the sheet has {count} {what}, numbered from 1")


def _in_box(pattern: Pattern, corners: np.ndarray) -> Place:
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = 1e-9 * max(pattern.extent(), 1e-300)
    inside = ((pattern.vertices >= low - margin) & (pattern.vertices <= high + margin)).all(axis=1)
    if not inside.any():
        sides = "; ".join(f"{x} {a:.4g} to {b:.4g} m" for x, a, b in zip("xyz", *_bounds(pattern), strict=True))
        raise ValueError(f"the box contains no vertex of the sheet, which extends over {sides}; move or enlarge the box")
    return Place("box " + " ".join(f"{x:g}" for x in corners.ravel()), tuple(np.flatnonzero(inside).tolist()))


def _bounds(pattern: Pattern) -> tuple[list[float], list[float]]:
    return pattern.vertices.min(axis=0).tolist(), pattern.vertices.max(axis=0).tolist()


@lru_cache(maxsize=4)
def flexible_mesh(sheet: Sheet) -> FacetMesh:
    """Mesh of the flexible facets of a sheet; the last few are cached.

    Raises
    ------
    CaseError
        The pattern is faulty, or the mesh is too large.
    """
    if sheet.kind == "plate":
        return plate_mesh(sheet)
    if sheet.is_shell:
        return boom_mesh(sheet)
    assert sheet.mesh_size is not None
    pattern = pattern_of(sheet)
    mirrors = {}
    for support in sheet.support:
        with suppress(ValueError):  # places that do not exist are refused by name when supports are built
            if support.mirror is not None:
                mirrors[frozenset(place_of(pattern, support.at).vertices)] = "xyz".index(support.mirror)
    return pattern_mesh(pattern, sheet.mesh_size, sheet.mesh_grading[0], folding_letters(sheet), mirrors)


def mesh_as_pattern(sheet: Sheet) -> Pattern:
    """Pattern whose facets are the triangles of the mesh; edges inside a facet become bend lines.

    The vertices are the nodes in the order of `FacetMesh.nodes`. The pattern is flat if the sheet starts flat.
    """
    pattern, mesh = pattern_of(sheet), flexible_mesh(sheet)
    number = np.full(len(mesh.owner), -1)
    number[mesh.nodes] = np.arange(len(mesh.nodes))
    number = number[mesh.owner]
    vertices = mesh.positions[mesh.nodes]
    flat = None if pattern.flat is None or np.ptp(vertices[:, 2]) else vertices[:, :2]
    fine = Pattern.of_faces(vertices, [tuple(face) for face in number[mesh.triangles].tolist()], flat)
    letters = ["B" if face < 0 else "J" for face in fine.edge_faces.min(axis=1).tolist()]
    target = np.zeros(len(letters))
    edges = {frozenset(pair): k for k, pair in enumerate(fine.edges.tolist())}
    coarse = pattern.with_bend_lines(most=4)
    for crease in mesh.creases:
        nodes = number[crease.sectors[:, 0]].tolist()
        for pair in pairwise(nodes):
            letters[edges[frozenset(pair)]] = coarse.assignment[crease.edge]
            target[edges[frozenset(pair)]] = coarse.target[crease.edge]
    return fine.assigned(letters, target)


def mesh_of_result(case: Mapping[str, Any], triangles: int) -> FacetMesh | None:
    """Mesh of the flexible facets of a solved case, if the result has this number of triangles; None for other results."""
    from fsm.case.models.case import Case

    sheet = case.get("sheet")
    if not isinstance(sheet, Mapping) or sheet.get("facets") != "flexible":
        return None
    try:
        found = Case.model_validate(case).sheet
        mesh = flexible_mesh(found) if found is not None else None
    except (CaseError, ValueError, TypeError, OSError):  # the case was written by another version
        return None
    return mesh if mesh is not None and len(mesh.triangles) == triangles else None
