"""Lines of `fsm check` on flexible facets: mesh, supports, loaded and driven places, probes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fsm.builders.patterns.cuts import sides_of_cuts
from fsm.builders.patterns.mesh_places import mesh_place, mirrored_place
from fsm.builders.patterns.of_sheet import facets_named, pattern_of
from fsm.case.models.facet_mesh import FacetMesh
from fsm.case.models.loads import Load
from fsm.case.models.sheet import Sheet
from fsm.case.models.sheet_parts import Box
from fsm.case.pattern_files.pattern import Pattern
from fsm.check.view import CheckContext
from fsm.text.shown_units import count, material_text, shown, shown_points, shown_range, shown_size

_LISTED = 4
"""Number of nodes of a place whose positions are listed."""


def facet_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the mesh of flexible facets."""
    facets = view.scene.facets
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
        for vertices in sides[:_LISTED]
    )
    more = f" and {count(len(sides) - _LISTED, 'other place')}" if len(sides) > _LISTED else ""
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
    case, facets = view.case, view.scene.facets
    if facets is None or case.sheet is None:
        return
    mesh = facets.mesh
    for support in case.sheet.support:
        held = f"fixed along {', '.join(support.fixed)}"
        held = held if support.mirror is None else f"plane of symmetry normal to {support.mirror}"
        yield f"{_place(mesh, support.at, support.mirror)}: {held}{', clamped' if support.clamped else ''}"
    for load in case.load:
        if load.at is None:
            continue
        if load.pressure is not None:
            yield pressure_line(load, mesh.facet_areas)
            continue
        given = (("force", "N"), ("moment", "N m"), ("force_per_length", "N/m"), ("moment_per_length", "N"))
        known = [(name.replace("_", " "), getattr(load, name), unit) for name, unit in given]
        texts = [f"{name} {shown_points([vector], unit)}" for name, vector, unit in known if any(vector)]
        yield f"{_place(mesh, load.at)}: {', '.join(texts) or 'no force'}{', follower' if load.follower else ''}"
    for drive in case.drive:
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        if at is not None:
            guided = "cannot move in other directions" if drive.guide else "can move in other directions"
            if drive.turn is not None:
                guided = "turns about a fixed axis" if drive.guide else "turns and can translate"
                guided = f"clamped in a rigid end that {guided}"
            yield f"{_place(mesh, at)}: driven, {guided}"
    for probe in case.sheet.probe:
        yield f"probe {probe.name}: {_place(mesh, probe.at)}"
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


def _place(mesh: FacetMesh, at: str | Box, mirror: str | None = None) -> str:
    place = mesh_place(mesh, at)
    place = place if mirror is None else mirrored_place(mesh, place, mirror, "sheet.support")
    chosen = place.sectors[:_LISTED] if len(place.sectors) <= _LISTED else place.sectors[[0, -1]]
    points = shown_points(mesh.positions[chosen], between=" and ")
    length = ""
    if len(place.edges):
        length = f", {shown(float(mesh.lengths[place.edges[:, 0], place.edges[:, 1]].sum()), 'm')} long"
    between = "from" if len(place.sectors) > _LISTED else "at"
    return f"{place.name}, {count(len(place.sectors), 'node')}{length}, {between} {points}"
