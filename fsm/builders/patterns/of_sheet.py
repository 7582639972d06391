"""Pattern of a section [sheet], and the stiffness of its bend lines."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from fsm.builders.patterns.cuts import open_cuts
from fsm.builders.patterns.foldability import bad_lines
from fsm.builders.patterns.folding import fold_pattern
from fsm.builders.patterns.generators import cone, flasher, kresling, miura, miura_tube, tube, waterbomb, yoshimura, zigzag
from fsm.builders.patterns.slits import slits
from fsm.case.models.case import Case
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.pattern import ASSIGNMENTS, Pattern, edge_groups
from fsm.errors import CaseError, Fault


@lru_cache(maxsize=4)
def pattern_of(sheet: Sheet) -> Pattern:
    """Pattern of a sheet at its start, with the bend lines of its facets; the last few are cached.

    Raises
    ------
    CaseError
        The pattern is faulty.
    """
    try:
        pattern = _generated(sheet)
    except ValueError as error:
        raise CaseError(Fault("sheet", str(error))) from None
    pattern = pattern if sheet.facets in ("rigid", "flexible") else pattern.with_bend_lines()
    try:
        pattern = fold_pattern(pattern, sheet.fold)
    except ValueError as error:
        stuck = bad_lines(pattern, sheet.facets != "rigid")
        raise CaseError(Fault("sheet.fold", "; ".join([str(error), *stuck]))) from None
    try:
        return pattern if sheet.align is None else _in_mean_plane(pattern)
    except ValueError as error:
        raise CaseError(Fault("sheet.align", str(error))) from None


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
