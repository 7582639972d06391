"""Scene of a bar-and-hinge model: bars along all edges and bend lines of a sheet, and rotational springs about them."""

from __future__ import annotations

import numpy as np

from fsm.builders.patterns.chamber import SheetSurface
from fsm.builders.patterns.cuts import facet_frames, facets_across_cuts
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.builders.sheet.flexible_sheet import contact_of_nodes
from fsm.builders.sheet.sheet import sheet_place, vertex_springs
from fsm.builders.sheet.sheet_gas import with_gas
from fsm.builders.sheet.sheet_joints import Folds, facet_damping, sheet_joints
from fsm.builders.sheet.sheet_loads import check_supports, placed_loads, vertex_name
from fsm.case.models.case import Case
from fsm.case.models.flexible import SceneFrame
from fsm.case.models.flexible_facets import FoldData
from fsm.case.models.loads import Drive
from fsm.case.models.scene import Body, ForceElement, Scene
from fsm.case.models.sheet import Sheet
from fsm.case.models.sheet_parts import BarsOfSheet
from fsm.case.models.touching import TouchingSheet
from fsm.case.models.truss import SceneTruss
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError, Fault

SHEET = "sheet"
"""Name of the truss of a sheet."""
_RIGID = 1e3
"""Stiffness of the springs of driven vertices relative to the stiffest bar; round-off of the force increases with it."""


def build_bars(case: Case) -> Scene:
    """Scene of a sheet with `facets = "bars"`.

    Raises
    ------
    CaseError
        The pattern, a place or the crease law is faulty, or a key is not available with bars.
    """
    sheet = case.sheet
    assert sheet is not None and case.material is not None
    pattern = pattern_of(sheet)
    truss, folds = _truss(case, sheet, pattern)
    check_supports(case, pattern)
    stiffest = max(np.array(truss.stiffness) / pattern.lengths)
    loads = placed_loads(case, case.load)
    touching = _touching(case, sheet, pattern)
    lines: list[Body] = []
    springs: list[ForceElement] = []
    beside = {body.name for body in case.scene.bodies} if case.scene is not None else set[str]()
    drives = [
        drive if drive.moved and beside.issuperset(drive.moved)
        else _drive(pattern, f"drive.{k}", drive, _RIGID * stiffest, lines, springs)
        for k, drive in enumerate(case.drive)
    ]  # fmt: skip
    used = {load.target for load in loads if load.pressure is None} | {spring.inner for spring in springs}
    names = {vertex_name(vertex): vertex for vertex in range(len(pattern.vertices))}
    if touching is not None:
        used.update(names)
    frames = tuple(SceneFrame(name=name, on=SHEET, point=vertex) for name, vertex in names.items() if name in used)
    scene = Scene(
        bodies=tuple(lines), trusses=(truss,), frames=frames, elements=tuple(springs), loads=loads, drives=tuple(drives),
        gravity=case.gravity, **contact_of_nodes(case),
    )  # fmt: skip
    held = {vertex: {"xyz".index(axis) for axis in axes} for vertex, axes in truss.held}
    triangles = np.array(pattern.faces, dtype=np.int64)
    own = np.arange(len(pattern.vertices))
    across = facets_across_cuts(pattern)
    surface = SheetSurface(pattern.vertices, triangles, np.arange(len(triangles)), held, pattern.groups, own, across)
    scene = scene.with_parts(folds=folds, touching=touching, across_cuts=across)
    return with_gas(case, scene, surface)


def bar_areas(case: Case, pattern: Pattern) -> np.ndarray:
    """Cross-section of the bar of each edge, (m,), m^2: the given value, or a preset.

    With the preset, bars and plate have the same energy in a uniform expansion. A triangle of area S and thickness t
    with bars of the lengths L gives each bar the area 2 S t/((1 - nu) sum L) (Filipov, Liu, Tachi, Schenk and Paulino,
    2017).
    """
    sheet, material = case.sheet, case.material
    assert sheet is not None and material is not None
    bars = sheet.bars or BarsOfSheet()
    if bars.area is not None:
        return np.full(len(pattern.edges), bars.area)
    found = np.zeros(len(pattern.edges))
    for face, area in enumerate(_areas(pattern)):
        edges = np.flatnonzero((pattern.edge_faces == face).any(axis=1))
        share = 2.0 * area * sheet.thickness / ((1.0 - material.poisson) * float(pattern.lengths[edges].sum()))
        found[edges] += share
    return found


def _touching(case: Case, sheet: Sheet, pattern: Pattern) -> TouchingSheet | None:
    """Surface for contact: a third of the area of each triangle belongs to each of its vertices."""
    if case.contact is None:
        return None
    assert case.material is not None
    triangles, areas = np.array(pattern.faces, dtype=np.int64), _areas(pattern)
    own = np.bincount(triangles.ravel(), np.repeat(areas / 3.0, 3), len(pattern.vertices))
    bent = sum(letter == "J" for letter in pattern.assignment)  # two triangles beside a bend line are parts of one facet
    frames = tuple(SceneFrame(name=vertex_name(k), on=SHEET, point=k) for k in range(len(pattern.vertices)))
    local = facet_frames(pattern)
    return TouchingSheet(
        frames, pattern.vertices, own, triangles, np.arange(len(triangles)), np.stack(local.outlines),
        float(areas.sum()) / (len(triangles) - bent), sheet.thickness, case.material.density * sheet.thickness,
    )  # fmt: skip


def _areas(pattern: Pattern) -> np.ndarray:
    """Areas of triangles, (n,), m^2."""
    corners = pattern.vertices[np.array(pattern.faces)]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(0.5 * np.linalg.norm(cross, axis=1))


def _truss(case: Case, sheet: Sheet, pattern: Pattern) -> tuple[SceneTruss, FoldData]:
    """Truss of a pattern of triangles, with its folds."""
    material, bars = case.material, sheet.bars or BarsOfSheet()
    assert material is not None
    mass = np.zeros(len(pattern.vertices))
    np.add.at(mass, np.array(pattern.faces), (material.density * sheet.thickness / 3.0 * _areas(pattern))[:, None])
    young = material.young if bars.young is None else bars.young
    joints = sheet_joints(case, pattern)
    ordered = [joint for joint in joints if joint.kind == "crease"] + [joint for joint in joints if joint.kind != "crease"]
    angles, springs = pattern.start_angles(), Folds(case, pattern, bars.linear_to)
    for joint in ordered:
        springs.add(joint, float(angles[joint.edge]), pattern.lengths[[joint.edge]])
    data = springs.data()
    folds = [_fold(pattern, joint.edge) for joint in ordered]
    held: dict[int, set[str]] = {}
    for number, support in enumerate(sheet.support):
        place = sheet_place(pattern, support.at, f"sheet.support.{number}.at")
        for vertex in place.vertices if place.facet is None else pattern.faces[place.facet]:
            held.setdefault(vertex, set()).update(support.fixed)
    truss = SceneTruss(
        name=SHEET, points=tuple(tuple(row) for row in pattern.vertices.tolist()), mass=tuple(mass.tolist()),
        bars=tuple((u, v) for u, v in pattern.edges.tolist()), stiffness=tuple((young * bar_areas(case, pattern)).tolist()),
        law=bars.law, exponents=bars.exponents, folds=tuple(folds),
        fold_stiffness=tuple(joint.stiffness for joint in ordered),
        fold_rest=tuple(data.rest.tolist()), viscosity=facet_damping(case),
        bend_lines=sum(joint.kind != "crease" for joint in ordered), linear_to=bars.linear_to, faces=pattern.faces,
        held=tuple((vertex, "".join(sorted(axes))) for vertex, axes in sorted(held.items())),
    )  # fmt: skip
    return truss, data


def _fold(pattern: Pattern, edge: int) -> tuple[int, int, int, int]:
    """Vertices of a hinge: the vertex of the left facet, both ends of the edge, and the vertex of the right facet."""
    u, v = pattern.edges[edge].tolist()
    left, right = (next(w for w in pattern.faces[face] if w not in (u, v)) for face in pattern.edge_faces[edge].tolist())
    return left, u, v, right


def _drive(
    pattern: Pattern, path: str, drive: Drive, stiffness: float, lines: list[Body], springs: list[ForceElement]
) -> Drive:
    """Drive of a massless body that springs join to the vertices of the place."""
    at = f"edge {drive.edge}" if drive.edge is not None else drive.at
    if at is None:
        text = 'not available for a sheet of bars; give `edge` or `at`, for example at = "vertex 12"'
        raise CaseError(Fault(f"{path}.{'body' if drive.body is not None else 'bodies'}", text))
    place = sheet_place(pattern, at, f"{path}.edge" if drive.edge is not None else f"{path}.at")
    vertices = place.vertices if place.facet is None else pattern.faces[place.facet]
    centre = pattern.vertices[list(vertices)].mean(axis=0)
    name = f"driven {place.name}"
    lines.append(Body(name=name, mass=0.0, inertia=(0.0, 0.0, 0.0), position=tuple(centre.tolist())))
    springs += vertex_springs(pattern, vertices, name, centre, stiffness, drive)
    return drive.model_copy(update={"edge": None, "at": None, "body": name, "guide": True})
