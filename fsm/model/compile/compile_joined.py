"""Compilation of a scene with films and cables: elements to a mesh, frames to bodies that the mesh carries."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fsm.case.derived.contact_points import contact_points, points_inside
from fsm.case.derived.frame_bodies import cable_axes, edge_middle, frame_faults, quaternion_matrix, with_frames
from fsm.case.models.chambers import PanelSurface
from fsm.case.models.facet_mesh import MeshPoint, facet_vectors, line_mean
from fsm.case.models.flexible import SceneBeam, SceneCable, SceneFilm, SceneFrame, unstressed_length
from fsm.case.models.flexible_facets import SHEET, FlexibleFacets, FoldData
from fsm.case.models.gas import Orifice
from fsm.case.models.scene import Scene
from fsm.case.models.touching import SheetPoint
from fsm.case.models.truss import SceneTruss
from fsm.errors import CaseError, Fault
from fsm.model.compile.compile import SceneCompiler, compile_scene
from fsm.model.compile.fold_laws_of import fold_laws_of
from fsm.model.faults.check_scene import check_scene
from fsm.model.joined.chamber_surfaces import Surface
from fsm.model.joined.chambers import Chambers, OrificeArea
from fsm.model.joined.configuration import DrawnLines, Nodes
from fsm.model.joined.panel_gas import PanelGas
from fsm.model.joined.system import JoinedSystem
from fsm.model.nodes.facets.folds import BETWEEN_POINTS, FoldGroup
from fsm.model.nodes.facets.pressure import PressedFaces
from fsm.model.nodes.films.film import FilmMaterial, LaminateMaterial
from fsm.model.nodes.loading import Loading
from fsm.model.nodes.mesh import Mesh
from fsm.model.nodes.shape import cable_shape, gauss, membrane_shape
from fsm.model.nodes.system.build import BeamMaterial, CableMaterial, FilmGrid, MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.nodes.truss import BarGroup
from fsm.model.system.frames import FramePoint, Frames, frame_maps
from fsm.model.system.system import SegmentSystem

_ON_EDGE = 3
"""Number of Gauss points on the edge of an element; the products of a line and a cubic function are exact."""
_PIECES = 3
"""Number of straight lines with which an element of a cable is drawn."""


def compile_model(scene: Scene, spatial: bool = False) -> SegmentSystem:
    """Compile a scene, with or without films, cables and beams.

    Parameters
    ----------
    scene : Scene
    spatial : bool
        Six degrees of freedom a body even if the scene lies in one plane. A scene with films, cables or beams is spatial.

    Raises
    ------
    CaseError
        With all faults of the scene.
    """
    faults = list(frame_faults(scene))
    if faults:
        raise CaseError(faults)
    panels = scene.built.panels_of_gas
    if not scene.flexible:
        return compile_scene(scene, spatial) if panels is None else _panels_with_gas(scene, panels)
    if panels is not None:
        text = "gas in rigid panels is not available beside films, cables, beams and trusses"
        raise CaseError(Fault("gas", f'{text}; remove these, or give sheet.facets = "bars" or "flexible"'))
    scene = with_frames(scene)
    faults = check_scene(scene)
    if faults:
        raise CaseError(faults)
    parts = _Parts.of(scene)
    row = {body.name: 1 + i for i, body in enumerate(scene.bodies)}  # the first body is the ground
    rows = np.array([row[frame.name] for frame in scene.frames], dtype=np.int64)
    touching = {point.frame.name for points in contact_points(scene).values() for point in points}
    inside = points_inside(scene)
    points = (_frame_point(parts, scene, frame, inside) for frame in scene.frames)
    frames = Frames.of(
        rows,
        tuple(_unoriented(p) if frame.name in touching else p for frame, p in zip(scene.frames, points, strict=True)),
    )
    elements = AncfSystem(parts.mesh, Loading(gravity=scene.gravity))
    compiler = SceneCompiler(scene, True, _mobility(scene, elements, frames))
    pressures = tuple(load for load in scene.loads if load.pressure is not None)
    faces = parts.pressed(scene)
    nodes = Nodes(elements, frames, parts.drawn(), faces, parts.chambers(scene, faces))
    return compiler.switched(JoinedSystem(*compiler.parts(), nodes, pressures))


def _mobility(scene: Scene, elements: AncfSystem, frames: Frames) -> dict[str, np.ndarray]:
    """Inverse of the inertia (6,) of the frames that joints act on at the start, by name; zero along held coordinates."""
    used = {name for joint in scene.joints for name in (joint.first, joint.second)}
    maps = np.zeros((len(frames.vectors), 6, 3))
    frame_maps(frames, elements.start, np.zeros(elements.nu), maps, np.zeros((len(frames.bodies), 6)))
    found = {}
    for i, frame in enumerate(scene.frames):
        if frame.name in used:
            rows = np.zeros((6, elements.nu))
            for j in range(frames.first[i], frames.first[i + 1]):
                rows[:, frames.vectors[j] : frames.vectors[j] + 3] += maps[j]
            rows[:, elements.fixed] = 0.0
            found[frame.name] = np.array([row @ elements.mass_solve(row) for row in rows])
    return found


def _frame_point(parts: _Parts, scene: Scene, frame: SceneFrame, inside: dict[str, SheetPoint]) -> FramePoint:
    """Frame as sums of nodal vectors; a contact point inside a triangle of the sheet is a weighted sum of its nodes."""
    if frame.name not in inside or scene.built.touching is None:
        return parts.point(frame)
    point = inside[frame.name]
    nodes = [parts.point(scene.built.touching.frames[node]) for node in point.nodes]
    weights = np.concatenate([weight * node.weights for weight, node in zip(point.weights, nodes, strict=True)])
    none = np.zeros(len(weights))
    return FramePoint(np.concatenate([node.vectors for node in nodes]), weights, none, none, np.zeros(3))


def _panels_with_gas(scene: Scene, panels: PanelSurface) -> SegmentSystem:
    """System of rigid panels around chambers of gas."""
    faults = check_scene(scene)
    if faults:
        raise CaseError(faults)
    compiler = SceneCompiler(scene, True)
    none, planes = np.zeros((0, 3, 2)), np.zeros((0, 3))
    surfaces = []
    for chamber, triangles, lids in zip(scene.built.chambers, panels.triangles, panels.lids, strict=True):
        faces = PressedFaces(3 * triangles, np.zeros(len(triangles), dtype=np.int64), none, planes)
        surfaces.append(Surface(chamber, faces, [replace(lid, nodes=3 * lid.nodes) for lid in lids]))
    creases = list(dict.fromkeys(orifice.crease for orifice in scene.built.orifices if orifice.crease is not None))
    start = np.array([next(one.initial_angle for one in scene.elements if one.name == crease) for crease in creases])
    corners = 3 * np.array([panels.folds[crease] for crease in creases], dtype=np.int64).reshape(-1, 4)
    laws = fold_laws_of(FoldData.linear(np.zeros(len(creases)), start, start))
    folds = FoldGroup(corners, np.broadcast_to(BETWEEN_POINTS, (len(creases), 3, 4)), laws)
    areas = [
        OrificeArea(orifice, folds, np.array([float(orifice.crease == crease) for crease in creases]))
        if orifice.crease is not None
        else OrificeArea(orifice)
        for orifice in scene.built.orifices
    ]
    gases = tuple(chamber.gas for chamber in scene.built.chambers)
    chambers = Chambers(gases, tuple(surfaces), tuple(areas), panels.start.ravel())
    bodies, motions, groups, names = compiler.parts()
    rows = np.array([compiler.index[name] for name in panels.bodies], dtype=np.int64)
    gas = PanelGas(chambers, rows, np.ascontiguousarray(panels.points), len(bodies.names))
    return compiler.switched(SegmentSystem(bodies, motions, (*groups, gas), names))


@dataclass(frozen=True)
class _Parts:
    """Mesh of all films, cables, beams and trusses of a scene, and the places of each of them in the mesh."""

    mesh: Mesh
    films: dict[str, tuple[SceneFilm, FilmGrid]]
    cables: dict[str, tuple[SceneCable | SceneBeam, np.ndarray]]
    trusses: dict[str, tuple[SceneTruss, np.ndarray]]
    first: int

    @classmethod
    def of(cls, scene: Scene) -> _Parts:
        builder = MeshBuilder(size=9 if scene.films or scene.built.facets is not None else 6 if scene.lines else 3)
        films, cables = {}, {}
        for film in scene.films:
            first = builder.count
            x, y = (
                np.linspace(-0.5 * side, 0.5 * side, count + 1)
                for side, count in zip((film.length, film.width), film.mesh, strict=True)
            )
            material = FilmMaterial(film.young, film.poisson, film.density, film.thickness)
            grid = builder.film(x, y, (material,), viscosity=film.viscosity)
            builder.transform(first, quaternion_matrix(film.orientation), np.array(film.position), film.strain)
            for edge in film.held:
                builder.hold(_edge(grid, edge))
            films[film.name] = film, grid
        for cable in scene.lines.values():
            beam = isinstance(cable, SceneBeam)
            nodes = builder.cable(
                np.array(cable.start), np.array(cable.end), _line_material(cable), cable.elements,
                viscosity=cable.viscosity, name=cable.name, strain=cable.strain, energy="beam" if beam else "cable",
            )  # fmt: skip
            if beam:
                builder.hold(nodes, (1,))
            for end in cable.held:
                builder.hold(nodes[0 if end == "start" else -1, 0])
            cables[cable.name] = cable, nodes
        trusses = {truss.name: (truss, _add_truss(builder, truss, scene.built.folds)) for truss in scene.trusses}
        facets, first = scene.built.facets, 0
        if facets is not None:
            material = FilmMaterial(facets.young, facets.poisson, facets.density, facets.thickness)
            if (plies := facets.laminate) is not None:
                thickness = facets.thickness
                stiffest = float(plies.stretch.diagonal()[:2].max()) / thickness
                constants = stiffest, 0.0, plies.areal_density / thickness, thickness
                material = LaminateMaterial(*constants, plies.stretch, plies.bending)
            mesh = facets.mesh
            start = np.concatenate([mesh.positions[:, None], mesh.slopes], axis=1)
            numbers = facet_vectors(mesh)
            shape = start, mesh.owner, numbers, mesh.plane, mesh.angle
            first = builder.facets(*shape, material, mesh.curved, facets.viscosity, facets.rounding)
            if facets.folds is not None:
                builder.add(_facet_creases(facets, facets.folds, first))
            for vector, components in facets.held.items():
                builder.hold(first + 3 * vector, tuple(sorted(components)))
        return cls(builder.build(), films, cables, trusses, first)

    def drawn(self) -> DrawnLines:
        """Lines of cables and beams as they are drawn: three pieces of each element."""
        ends = np.linspace(0.0, 1.0, _PIECES + 1)
        vectors, weights, halves = [np.zeros((0, 4), dtype=np.int64)], [np.zeros((0, 2, 4))], [np.zeros(0)]
        for cable, nodes in self.cables.values():
            shape = cable_shape(ends, unstressed_length(cable) / cable.elements)
            vectors.append(np.repeat(np.concatenate([nodes[:-1], nodes[1:]], axis=1), _PIECES, axis=0))
            weights.append(np.tile(np.stack([shape[:-1], shape[1:]], axis=1), (cable.elements, 1, 1)))
            width = cable.width if isinstance(cable, SceneBeam) else 0.0
            halves.append(np.full(_PIECES * cable.elements, 0.5 * width))
        names = tuple(name for name, (line, _) in self.cables.items() for _ in range(_PIECES * line.elements))
        faces = [name for name, (film, _) in self.films.items() for _ in range(film.mesh[0] * film.mesh[1])]
        panels = np.full(len(self.mesh.quads), -1, dtype=np.int64)
        panels[len(faces) :] = 0
        faces += [f"facet {number}" for truss, _ in self.trusses.values() for number in range(1, len(truss.faces) + 1)]
        faces += [SHEET] * (len(panels) - len(faces))
        flat = np.concatenate(vectors), np.concatenate(weights), np.concatenate(halves)
        return DrawnLines(*flat, names, tuple(faces), panels)

    def pressed(self, scene: Scene) -> PressedFaces | None:
        """Triangles of the sheet that can carry a pressure."""
        if scene.built.facets is not None:
            mesh, faces = scene.built.facets.mesh, scene.built.facets.mesh.loaded
            vectors = self.first + 3 * facet_vectors(mesh, faces.triangles)
            return PressedFaces(vectors, faces.facet, faces.plane, faces.angle, faces.weight)
        for truss, places in self.trusses.values():
            if truss.faces and all(len(face) == 3 for face in truss.faces):
                vectors = places[np.array(truss.faces, dtype=np.int64)]
                return PressedFaces(vectors, np.arange(len(vectors)), np.zeros((0, 3, 2)), np.zeros((0, 3)))
        return None

    def chambers(self, scene: Scene, faces: PressedFaces | None) -> Chambers | None:
        """Chambers of gas of the sheet."""
        if not scene.built.chambers or faces is None:
            return None
        if scene.built.facets is not None:
            mesh, lids = scene.built.facets.mesh, any(chamber.caps for chamber in scene.built.chambers)
            if mesh.creases or lids:
                faces = faces.straight()
            places = self.first + 9 * np.arange(len(mesh.owner))
        else:
            places = next(places for truss, places in self.trusses.values() if truss.faces)
        surfaces = tuple(
            Surface(
                chamber, faces.of(np.array(chamber.facets)),
                [replace(lid, nodes=places[lid.nodes]) for lid in chamber.caps],
            )
            for chamber in scene.built.chambers
        )
        areas = tuple(self._area(scene, orifice) for orifice in scene.built.orifices)
        gases = tuple(chamber.gas for chamber in scene.built.chambers)
        return Chambers(gases, surfaces, areas, self.mesh.coordinates)

    def _area(self, scene: Scene, orifice: Orifice) -> OrificeArea:
        """Area of an orifice, with the folds of its crease."""
        data = scene.built.folds if scene.built.facets is None else scene.built.facets.folds
        if orifice.crease is None or data is None:
            return OrificeArea(orifice)
        group = next(one for one in self.mesh.groups if isinstance(one, FoldGroup) and one.name == "creases")
        part = data.part(slice(len(group.vectors)))  # creases come first
        own = part.joint == data.names.index(orifice.crease)
        return OrificeArea(orifice, group, np.where(own, part.length, 0.0))

    def point(self, frame: SceneFrame) -> FramePoint:
        """Frame as sums of nodal vectors."""
        if (point := frame.on_sheet) is not None:
            places = self.trusses[frame.on][1][point.vectors] if frame.on in self.trusses else self.first + 3 * point.vectors
            return _point(places, point.weights, point.along, point.across, np.zeros(3))
        if frame.on in self.films:
            return _film_point(*self.films[frame.on], frame)
        if frame.on in self.trusses:
            assert frame.point is not None
            vectors, none = self.trusses[frame.on][1][[frame.point]], np.zeros(1)
            return FramePoint(vectors, np.ones(1), none, none, np.zeros(3))
        return _cable_point(*self.cables[frame.on], frame)


def _add_truss(builder: MeshBuilder, truss: SceneTruss, data: FoldData | None) -> np.ndarray:
    """Add the points, bars and springs of a truss; returns the first coordinates of its points. If `data` is given, folds
    replace the springs.
    """
    places = builder.points(np.array(truss.points), truss.name, truss.faces)
    for place, mass in zip(places.tolist(), truss.mass, strict=True):
        builder.point_mass(place, mass)
    for point, axes in truss.held:
        builder.hold(places[point], tuple("xyz".index(axis) for axis in axes))
    at, bars = np.array(truss.points), np.array(truss.bars)
    length = np.linalg.norm(at[bars[:, 1]] - at[bars[:, 0]], axis=1)
    stiffness = np.array(truss.stiffness)
    builder.add(BarGroup(places[bars], length, stiffness, truss.law, truss.exponents, truss.viscosity))
    count = len(truss.folds) - truss.bend_lines
    data = _folds_of(truss) if data is None else data
    for name, part in (("creases", slice(count)), ("panels", slice(count, None))):
        folds = np.array(truss.folds[part], dtype=np.int64).reshape(-1, 4)
        if len(folds):
            weights = np.broadcast_to(BETWEEN_POINTS, (len(folds), 3, 4))
            builder.add(FoldGroup(places[folds], weights, fold_laws_of(data.part(part)), name))
    return places


def _folds_of(truss: SceneTruss) -> FoldData:
    """Linear springs of a truss. A closed fold may turn to either side of 180 degrees."""
    rest, stiffness = np.array(truss.fold_rest), np.array(truss.fold_stiffness)
    near = np.where(np.abs(rest) > 0.75 * np.pi, 0.5 * rest, 0.0)
    linear = FoldData.linear(stiffness, rest, near, truss.linear_to)
    return replace(linear, damping=truss.viscosity * stiffness)


def _facet_creases(facets: FlexibleFacets, folds: FoldData, first: int) -> FoldGroup:
    """Creases of flexible facets, whose vector 0 has the first coordinate `first`."""
    sectors = np.concatenate([crease.sectors for crease in facets.mesh.creases])
    along = np.concatenate([crease.along for crease in facets.mesh.creases])
    weights = np.zeros((len(sectors), 3, 4))
    # the vectors are: across the crease on the left (a), across it on the right (b), and the mean slope along it (c)
    for side in (0, 1):
        x, y = along[:, side].T
        weights[:, side, 2 * side], weights[:, side, 2 * side + 1] = -y, x
        weights[:, 2, 2 * side], weights[:, 2, 2 * side + 1] = 0.5 * x, 0.5 * y
    vectors = first + 3 * (3 * sectors[:, :, None] + np.array([1, 2])).reshape(-1, 4)
    return FoldGroup(vectors, weights, fold_laws_of(folds))


def _line_material(line: SceneCable | SceneBeam) -> CableMaterial | BeamMaterial:
    if isinstance(line, SceneBeam):
        return BeamMaterial(line.young, line.density, line.width, line.thickness)
    return CableMaterial(line.young, line.density, line.diameter)


def _edge(grid: FilmGrid, edge: str) -> np.ndarray:
    if edge == "corners":
        return grid.position[[0, 0, -1, -1], [0, -1, 0, -1]]
    return grid.edge(edge)


def _cell(lines: np.ndarray, at: float) -> tuple[int, float, float]:
    """Number of the interval between lines that holds a coordinate, the place in it from 0 to 1, and its size."""
    i = int(np.clip(np.searchsorted(lines, at, side="right") - 1, 0, len(lines) - 2))
    size = float(lines[i + 1] - lines[i])
    return i, (at - float(lines[i])) / size, size


def _edge_point(film: SceneFilm, grid: FilmGrid, edge: str) -> FramePoint:
    """Frame on an edge: means of position and of the slope across the edge, and the slope of the linear fit along it."""
    across = edge in ("left", "right")  # the edge runs along y
    lines = grid.y if across else grid.x
    fixed = edge_middle(film, edge)[0 if across else 1]
    places, shares = gauss(_ON_EDGE)
    parts = list[tuple[MeshPoint, float, float]]()
    for first, last in pairwise(lines.tolist()):
        for place, share in zip(places.tolist(), shares.tolist(), strict=True):
            along = first + place * (last - first)
            at = (fixed, along) if across else (along, fixed)
            (i, x, b), (j, y, c) = (_cell(cells, one) for cells, one in zip((grid.x, grid.y), at, strict=True))
            value, slope = membrane_shape(x, y, b, c), membrane_shape(x, y, b, c, derivative=(1, 0) if across else (0, 1))
            parts.append((MeshPoint(grid.vectors(i, j), value, np.zeros(len(value)), slope), along, share * (last - first)))
    vectors, weights, fit, slope = line_mean(parts)
    return _point(vectors, weights, *((slope, fit) if across else (fit, slope)), np.zeros(3))


def _film_point(film: SceneFilm, grid: FilmGrid, frame: SceneFrame) -> FramePoint:
    if frame.edge is not None:
        return _edge_point(film, grid, frame.edge)
    (i, x, b), (j, y, c) = (_cell(lines, at) for lines, at in zip((grid.x, grid.y), frame.at, strict=True))
    weights, along, across = (membrane_shape(x, y, b, c, derivative=d) for d in ((0, 0), (1, 0), (0, 1)))
    return _point(grid.vectors(i, j), weights, along, across, np.zeros(3))


def _cable_point(cable: SceneCable | SceneBeam, nodes: np.ndarray, frame: SceneFrame) -> FramePoint:
    length = unstressed_length(cable)
    i, x, size = _cell(np.linspace(0.0, length, cable.elements + 1), frame.at[0])
    weights, along = cable_shape(x, size), cable_shape(x, size, 1)
    across = cable_axes(cable, frame.normal)[1]
    return _point(np.concatenate([nodes[i], nodes[i + 1]]), weights, along, np.zeros(4), across)


def _unoriented(point: FramePoint) -> FramePoint:
    """Frame without axes, for contact forces without moments."""
    used = np.abs(point.weights) > 1e-12
    none = np.zeros(int(used.sum()))
    return FramePoint(point.vectors[used], point.weights[used], none, none, np.zeros(3))


def _point(vectors: np.ndarray, weights: np.ndarray, along: np.ndarray, across: np.ndarray, fixed: np.ndarray) -> FramePoint:
    """Frame with only those vectors on which it depends; vectors with zero factors are omitted."""
    used = (np.abs(weights) > 1e-12) | (along != 0.0) | (across != 0.0)
    return FramePoint(vectors[used], weights[used], along[used], across[used], fixed)
