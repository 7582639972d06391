"""Lines of `fsm check` on a sheet: pattern, joints, bend lines, supports and driven vertices."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np

from fsm.builders.patterns.foldability import foldability
from fsm.builders.patterns.of_sheet import pattern_of, place_of
from fsm.builders.sheet.reach import taut_travels
from fsm.builders.sheet.sheet import has_loops, rigid_factor
from fsm.builders.sheet.sheet_bars import bar_areas
from fsm.builders.sheet.sheet_joints import sheet_joints
from fsm.case.models.case import Case
from fsm.case.models.sheet_parts import BarsOfSheet, Box
from fsm.case.models.truss import AXIAL_LAWS
from fsm.case.pattern_files.pattern import ASSIGNMENTS, Pattern
from fsm.case.plan.step_items import loads_of
from fsm.check.facets import cut_lines, facet_lines, facet_support_lines
from fsm.check.view import CheckContext
from fsm.text.shown_units import count, material_text, shown, shown_points, shown_range, shown_size

_LISTED = 4
"""Number of vertices of a place whose positions are listed."""
_NAMED = 20
"""Number of vertices that violate a condition whose numbers are listed."""


def sheet_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the pattern, its facets and joints."""
    case = view.case
    sheet, material = case.sheet, case.material
    if sheet is None or material is None:
        return
    yield from (f"pattern file: {note}" for note in sheet.notes)
    if sheet.facets == "flexible":
        yield from facet_lines(view)
        return
    pattern = pattern_of(sheet)
    sides = shown_size(*np.ptp(pattern.vertices, axis=0).tolist())
    yield f"{count(len(pattern.faces), 'facet')} and {count(len(pattern.vertices), 'vertex', 'vertices')}, {sides}"
    letters = Counter(pattern.assignment)
    yield "edges: " + ", ".join(f"{letters[letter]} {name}" for letter, name in ASSIGNMENTS.items() if letters[letter])
    yield from cut_lines(pattern)
    yield from _foldability_lines(pattern, sheet.facets != "rigid")
    yield f"{shown(sheet.thickness, 'm')} thick; {material_text(material.young, material.poisson, material.density)}"
    joints = sheet_joints(case, pattern)
    angles = np.abs(pattern.fold_angles()).round(9)  # bend lines are flat up to round-off
    for kind, name in (("crease", "crease"), ("bend line", "bend line"), ("rigid", "rigid joint")):
        edges = [joint.edge for joint in joints if joint.kind == kind]
        if not edges:
            continue
        stiffness = [joint.stiffness / float(pattern.lengths[joint.edge]) for joint in joints if joint.kind == kind]
        between = shown_range(float(angles[edges].min()), float(angles[edges].max()), "rad")
        text = f"{count(len(edges), name)}, fold angles {between}"
        if kind != "rigid":
            text += f", stiffness {shown_range(min(stiffness), max(stiffness), 'N m/rad/m')}"
        yield text
    if any(joint.kind == "bend line" for joint in joints) and sheet.bend_stiffness_per_length is None:
        preset = "G (L/t)^(1/3)/L, G = E t^3/(12 (1 - nu^2))"
        yield f"the stiffness of bend lines is a preset, the fit of Liu and Paulino (2017) to plates: {preset}"
    if sheet.facets == "bars":
        yield from _bar_lines(case, pattern)
    else:
        times = f"{rigid_factor(case, pattern):.0e} times as stiff as the stiffest crease"
        yield f"rigid joints are springs, {times}" if not has_loops(pattern) else (
            f"rigid joints do not deform in statics, except near a flat state, where motions across the joints meet hardly "
            f"any resistance; there and in motions they are springs, {times}; natural modes leave them closed"
        )


def _foldability_lines(pattern: Pattern, bends: bool) -> Iterator[str]:
    """Conditions for folding at the inner vertices of a flat pattern."""
    found = foldability(pattern, bends)
    if found is None or not found.inner:
        return
    inner = count(len(found.inner), "inner vertex", "inner vertices")
    if found.folds_flat:
        yield f"{inner}: all meet the conditions of Kawasaki and Maekawa for flat folding"
    parts = [
        (found.rigid, "fewer than four creases: rigid facets cannot fold there"),
        (found.blocked, "mountains and valleys that cannot all fold from flat at the same time (Abel et al., 2016)"),
        (found.kawasaki, "do not fold flat (Kawasaki: alternating sum of the angles)"),
        (found.maekawa, "do not fold flat (Maekawa: numbers of mountains and valleys do not differ by 2)"),
    ]
    for vertices, text in parts:
        if vertices:
            listed = ", ".join(str(v + 1) for v in vertices[:_NAMED]) + (" ..." if len(vertices) > _NAMED else "")
            verb = "" if text.startswith("do not") else "have " if len(vertices) > 1 else "has "
            words = text if len(vertices) > 1 else text.replace("do not fold", "does not fold")
            yield f"{inner}: {count(len(vertices), 'vertex', 'vertices')} ({listed}) {verb}{words}"


def _bar_lines(case: Case, pattern: Pattern) -> Iterator[str]:
    """Lines on the bars of a sheet."""
    assert case.sheet is not None and case.material is not None
    bars = case.sheet.bars or BarsOfSheet()
    areas = bar_areas(case, pattern)
    young = case.material.young if bars.young is None else bars.young
    exponents = f" with exponents {bars.exponents[0]:g} and {bars.exponents[1]:g}" if bars.law == "ogden" else ""
    law = AXIAL_LAWS[bars.law] + exponents
    preset = "" if bars.area is not None else " (preset: with the energy of the plate in a uniform expansion)"
    area = shown_range(float(areas.min()), float(areas.max()), "m^2")
    yield f"{count(len(areas), 'bar')}, E {shown(young, 'Pa')}, area {area}{preset}; {law}"
    if bars.linear_to < math.pi:
        limit = shown(bars.linear_to, "rad")
        yield f"moments of springs rise steeply beyond a fold angle of {limit}, so facets do not penetrate"


def sheet_support_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the travels at which the sheet is taut, and on the vertices of supports and drives."""
    case = view.case
    if case.sheet is None:
        return
    for drive, travel in taut_travels(case):
        yield f"{drive.called}: the sheet is taut at {shown(travel, 'm')} of travel, and more travel stretches its facets"
    if case.sheet.facets == "flexible":
        yield from facet_support_lines(view)
        return
    pattern = pattern_of(case.sheet)
    for _, load in loads_of(case):
        if load.at is not None:
            yield f"{_place(pattern, load.at)}: loaded, in equal parts"
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
    points = shown_points(pattern.vertices[list(place.vertices[:_LISTED])])
    more = f" and {len(place.vertices) - _LISTED} more" if len(place.vertices) > _LISTED else ""
    return f"{place.name}, {count(len(place.vertices), 'vertex', 'vertices')} at {points}{more}"
