"""Lines of `fsm check` on a sheet: pattern, joints, bend lines, supports and driven vertices.

Lines of `fsm check` on flexible facets: mesh, supports, loaded and driven places, probes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np

from fsm.builders.patterns.cuts import sides_of_cuts
from fsm.builders.patterns.foldability import foldability
from fsm.builders.patterns.mesh_places import mesh_place, mirrored_place
from fsm.builders.patterns.of_sheet import facets_named, pattern_of, place_of
from fsm.builders.sheet.reach import taut_travels
from fsm.builders.sheet.sheet import has_loops, rigid_factor
from fsm.builders.sheet.sheet_bars import bar_areas
from fsm.builders.sheet.sheet_joints import sheet_joints
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import FacetMesh
from fsm.case.models.loads import Load
from fsm.case.models.sheet import Sheet
from fsm.case.models.sheet_parts import BarsOfSheet, Box
from fsm.case.models.truss import AXIAL_LAWS
from fsm.case.pattern_files.pattern import ASSIGNMENTS, Pattern
from fsm.case.plan.step_items import loads_of
from fsm.check.view import CheckContext
from fsm.text.shown_units import count, material_text, shown, shown_points, shown_range, shown_size

_LISTED_FACETS = 4
"""Number of nodes of a place whose positions are listed."""


def facet_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the mesh of flexible facets."""
    facets = view.scene.built.facets
    if facets is None:
        return
    mesh = facets.mesh
    sides = shown_size(*np.ptp(mesh.positions, axis=0).tolist())
    yield f"flexible facets, {sides}, {shown(mesh.area, 'm^2')}; edges: {', '.join(mesh.edges)}"
    thick = f"{shown(facets.thickness, 'm')} thick"
    if facets.laminate is None:
        yield f"{thick}; {material_text(facets.young, facets.poisson, facets.density)}"
    elif view.case.sheet is not None:
        plies = count(len(view.case.sheet.ply), "ply", "plies")
        yield f"{thick}; {plies}, {facets.laminate.areal_density:.4g} kg/m^2; rows of the stiffness for x, y, xy:"
        for name, unit, matrix in zip("ABD", ("N/m", "N", "N m"), facets.laminate[:3], strict=True):
            yield f"  {name} ({unit}): {'; '.join(', '.join(f'{x:.4g}' for x in row) for row in matrix)}"
    if view.case.sheet is not None and not view.case.sheet.is_shell:
        yield from cut_lines(pattern_of(view.case.sheet))
    edges = shown_range(float(mesh.lengths.min()), float(mesh.lengths.max()), "m")
    nodes = len(mesh.nodes)
    yield f"{count(len(mesh.triangles), 'triangle')} (ANCF-DKT) with edges of {edges}, {count(nodes, 'node')}"
    unknowns = 3 * nodes + 6 * len(mesh.owner) - sum(len(components) for components in facets.held.values())
    yield f"{unknowns} unknowns: positions, and slopes along two directions on each side of a crease"
    if facets.folds is not None:
        angles = np.abs(facets.folds.start)
        between = shown_range(float(angles.min()), float(angles.max()), "rad")
        yield f"{count(len(mesh.creases), 'joint')} between facets, fold angles {between}; facets bend up to the creases"
    if facets.rounding is not None:
        yield "tension field: no compression in the facets; wrinkles are not resolved, and their bending has no energy"
        yield f"  kinks of the law are rounded over strains of {facets.rounding:g}; strains of this size are not accurate"
    if mesh.curved:
        yield "curved at the start without stress"
    if mesh.curved and view.case.sheet is not None and not view.case.sheet.is_shell:
        yield "  facets with an angle of at most 45 deg at a line that does not fold are smooth there, over one cell"
    if view.case.sheet is not None and view.case.sheet.is_boom:
        yield from _boom_lines(view.case.sheet, mesh, view.scene.contact is not None)
    slender = facets.thickness / float(mesh.lengths.max())
    if slender > 1.0:
        yield f"the thickness is {slender:.3g} times the longest edge: thin plates have no transverse shear strain"


def cut_lines(pattern: Pattern) -> Iterator[str]:
    """Lines on the cuts of a sheet: the vertices on both sides."""
    cuts = sum(letter == "C" for letter in pattern.assignment)
    if not cuts:
        return
    sides = sides_of_cuts(pattern)
    listed = ", ".join(
        f"{' and '.join(str(v + 1) for v in vertices)} at {shown_points([pattern.vertices[vertices[0]]])}"
        for vertices in sides[:_LISTED_FACETS]
    )
    more = f" and {count(len(sides) - _LISTED_FACETS, 'other place')}" if len(sides) > _LISTED_FACETS else ""
    own = f"; each side has its own vertices: {listed}{more}" if sides else ""
    yield f"cuts are open, with {count(cuts, 'edge')} on both sides{own}"


def _boom_lines(sheet: Sheet, mesh: FacetMesh, touching: bool) -> Iterator[str]:
    """Lines on the section of a boom, on its mesh and on its contact with itself."""
    assert sheet.radius is not None and sheet.subtended_angle is not None
    yield f"section: radius {shown(sheet.radius, 'm')}, subtended angle {shown(sheet.subtended_angle, 'rad')}"
    if sheet.kind == "lenticular":
        yield "both shells are joined by nearly rigid joints along their edges, without flanges"
    layer, along = math.sqrt(sheet.radius * sheet.thickness), mesh.edges["left"]
    at_edge = float(mesh.lengths[along[0, 0], along[0, 1]])
    if at_edge > layer:
        yield (
            f"cells of {shown(at_edge, 'm')} at the free edges are larger than sqrt(R t) = {shown(layer, 'm')}, "
            "over which curvature varies there; use more cells, or `mesh_grading`"
        )
    if not touching:
        yield "no [contact]: the shell does not touch itself; parts of a folded or coiled boom can pass through each other"


def facet_support_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the nodes of supports, loads, drives and probes."""
    case, facets = view.case, view.scene.built.facets
    if facets is None or case.sheet is None:
        return
    mesh = facets.mesh
    for support in case.sheet.support:
        held = f"fixed along {', '.join(support.fixed)}"
        held = held if support.mirror is None else f"plane of symmetry normal to {support.mirror}"
        yield f"{_place_of(mesh, support.at, support.mirror)}: {held}{', clamped' if support.clamped else ''}"
    for load in case.load:
        if load.at is None:
            continue
        if load.pressure is not None:
            yield pressure_line(load, mesh.facet_areas)
            continue
        given = (("force", "N"), ("moment", "N m"), ("force_per_length", "N/m"), ("moment_per_length", "N"))
        known = [(name.replace("_", " "), getattr(load, name), unit) for name, unit in given]
        texts = [f"{name} {shown_points([vector], unit)}" for name, vector, unit in known if any(vector)]
        yield f"{_place_of(mesh, load.at)}: {', '.join(texts) or 'no force'}{', follower' if load.follower else ''}"
    for drive in case.drive:
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        if at is not None:
            guided = "cannot move in other directions" if drive.guide else "can move in other directions"
            if drive.turn is not None:
                guided = "turns about a fixed axis" if drive.guide else "turns and can translate"
                guided = f"clamped in a rigid end that {guided}"
            yield f"{_place_of(mesh, at)}: driven, {guided}"
    for probe in case.sheet.probe:
        yield f"probe {probe.name}: {_place_of(mesh, probe.at)}"
    if not case.sheet.support:
        yield "none: the sheet can move as a whole"


def pressure_line(load: Load, areas: np.ndarray) -> str:
    """Line on a pressure on facets with areas (n,), m^2."""
    assert isinstance(load.at, str) and load.pressure is not None
    facets = facets_named(load.at, len(areas))
    kind = load.time.kind if load.time else "constant"
    return (
        f"{load.called}: pressure {shown(load.pressure, 'Pa')} normal to {count(len(facets), 'facet')} of "
        f"{shown(float(areas[list(facets)].sum()), 'm^2')}, {kind}"
    )


def _place_of(mesh: FacetMesh, at: str | Box, mirror: str | None = None) -> str:
    place = mesh_place(mesh, at)
    place = place if mirror is None else mirrored_place(mesh, place, mirror, "sheet.support")
    chosen = place.sectors[:_LISTED_FACETS] if len(place.sectors) <= _LISTED_FACETS else place.sectors[[0, -1]]
    points = shown_points(mesh.positions[chosen], between=" and ")
    length = ""
    if len(place.edges):
        length = f", {shown(float(mesh.lengths[place.edges[:, 0], place.edges[:, 1]].sum()), 'm')} long"
    between = "from" if len(place.sectors) > _LISTED_FACETS else "at"
    return f"{place.name}, {count(len(place.sectors), 'node')}{length}, {between} {points}"


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
