"""Lines of `fsm check` on a sheet: pattern, joints, bend lines, supports and driven vertices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from fsm.report_text import count, degrees, material_text, millimetres
from fsm.scene.builders.sheet import rigid_factor, sheet_joints
from fsm.scene.patterns.of_sheet import pattern_of
from fsm.scene.patterns.pattern import ASSIGNMENTS, Pattern
from fsm.scene.patterns.places import place_of
from fsm.scene.sheet import Box
from fsm.segments.report_view import CheckContext

__all__ = ["sheet_lines", "sheet_support_lines"]

_LISTED = 4
"""Number of vertices of a place whose positions are listed."""


def sheet_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the pattern, its facets and joints."""
    case = view.case
    sheet, material = case.sheet, case.material
    if sheet is None or material is None:
        return
    pattern = pattern_of(sheet)
    sides = " x ".join(millimetres(float(side)) for side in np.ptp(pattern.vertices, axis=0))
    yield f"{count(len(pattern.faces), 'facet')} and {count(len(pattern.vertices), 'vertex', 'vertices')}, {sides}"
    letters = Counter(pattern.assignment)
    yield "edges: " + ", ".join(f"{letters[letter]} {name}" for letter, name in ASSIGNMENTS.items() if letters[letter])
    yield f"{millimetres(sheet.thickness)} thick; {material_text(material.young, material.poisson, material.density)}"
    joints = sheet_joints(case, pattern)
    angles = np.abs(pattern.fold_angles())
    for kind, name in (("crease", "creases"), ("bend line", "bend lines"), ("rigid", "rigid joints")):
        edges = [joint.edge for joint in joints if joint.kind == kind]
        if not edges:
            continue
        stiffness = [1e3 * joint.stiffness / float(pattern.lengths[joint.edge]) for joint in joints if joint.kind == kind]
        first, last = (degrees(float(angle)) for angle in (angles[edges].min(), angles[edges].max()))
        text = f"{len(edges)} {name}, fold angles {first if first == last else f'{first} to {last}'}"
        if kind != "rigid":
            low, high = f"{min(stiffness):.4g}", f"{max(stiffness):.4g}"
            text += f", stiffness {low if low == high else f'{low} to {high}'} mN m/rad per m"
        yield text
    if sheet.facets == "bend-lines" and sheet.bend_stiffness_per_length is None:
        preset = "G (L/t)^(1/3)/L, G = E t^3/(12 (1 - nu^2))"
        yield f"the stiffness of bend lines is a preset, the fit of Liu and Paulino (2017) to plates: {preset}"
    yield f"rigid joints are springs, {rigid_factor(case):.0e} times as stiff as the stiffest crease"


def sheet_support_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the vertices of supports and drives."""
    case = view.case
    if case.sheet is None:
        return
    pattern = pattern_of(case.sheet)
    for support in case.sheet.support:
        yield f"{_place(pattern, support.at)}: fixed along {', '.join(support.fixed)}"
    for drive in case.drive:
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        if at is not None:
            guided = "cannot move in other directions" if drive.guide else "can move in other directions"
            yield f"{_place(pattern, at)}: driven, {guided}"
    if not case.sheet.support:
        yield "none: the sheet can move as a whole"


def _place(pattern: Pattern, at: str | Box) -> str:
    place = place_of(pattern, at)
    if place.facet is not None:
        return place.name
    shown = [f"({', '.join(f'{1e3 * x:.4g}' for x in pattern.vertices[v])})" for v in place.vertices[:_LISTED]]
    more = f" and {len(place.vertices) - _LISTED} more" if len(place.vertices) > _LISTED else ""
    return f"{place.name}, {count(len(place.vertices), 'vertex', 'vertices')} at {', '.join(shown)}{more} mm"
