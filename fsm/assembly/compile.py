"""Compilation of a scene with films and cables: elements to a mesh, frames to bodies that the mesh carries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.ancf.build import BeamMaterial, CableMaterial, FilmGrid, MeshBuilder
from fsm.ancf.film import FilmMaterial
from fsm.ancf.loading import Loading
from fsm.ancf.mesh import Mesh
from fsm.ancf.shape import cable_shape, membrane_shape
from fsm.ancf.system import AncfSystem
from fsm.assembly.drawn_lines import DrawnLines
from fsm.assembly.frames import FramePoint, Frames
from fsm.assembly.system import JoinedSystem
from fsm.errors import CaseError
from fsm.scene.contact_points import contact_points
from fsm.scene.flexible import SceneBeam, SceneCable, SceneFilm, SceneFrame, unstressed_length
from fsm.scene.frame_bodies import cable_axes, frame_faults, quaternion_matrix, with_frames
from fsm.scene.scene import Scene
from fsm.segments.check_scene import check_scene
from fsm.segments.compile import SceneCompiler, compile_scene
from fsm.segments.system import SegmentSystem

__all__ = ["compile_model"]

_PIECES = 3
"""Straight lines that an element of a cable is drawn with."""


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
    if not scene.flexible:
        return compile_scene(scene, spatial)
    scene = with_frames(scene)
    faults = check_scene(scene)
    if faults:
        raise CaseError(faults)
    parts = _Parts.of(scene)
    row = {body.name: 1 + i for i, body in enumerate(scene.bodies)}  # the ground is the first
    rows = np.array([row[frame.name] for frame in scene.frames], dtype=np.int64)
    touching = {point.frame.name for points in contact_points(scene).values() for point in points}
    points = (parts.point(frame) for frame in scene.frames)
    frames = Frames.of(
        rows,
        tuple(_unoriented(p) if frame.name in touching else p for frame, p in zip(scene.frames, points, strict=True)),
    )
    elements = AncfSystem(parts.mesh, Loading(gravity=scene.gravity))
    compiler = SceneCompiler(scene, True)
    return compiler.switched(JoinedSystem(*compiler.parts(), elements, frames, parts.drawn()))


@dataclass(frozen=True)
class _Parts:
    """Mesh of all films, cables and beams of a scene, and where each of them is in it."""

    mesh: Mesh
    films: dict[str, tuple[SceneFilm, FilmGrid]]
    cables: dict[str, tuple[SceneCable | SceneBeam, np.ndarray]]

    @classmethod
    def of(cls, scene: Scene) -> _Parts:
        builder = MeshBuilder(size=9 if scene.films else 6)
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
        return cls(builder.build(), films, cables)

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
        films = tuple(name for name, (film, _) in self.films.items() for _ in range(film.mesh[0] * film.mesh[1]))
        return DrawnLines(np.concatenate(vectors), np.concatenate(weights), np.concatenate(halves), names, films)

    def point(self, frame: SceneFrame) -> FramePoint:
        """Frame as sums of nodal vectors."""
        if frame.on in self.films:
            return _film_point(*self.films[frame.on], frame)
        return _cable_point(*self.cables[frame.on], frame)


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


def _film_point(film: SceneFilm, grid: FilmGrid, frame: SceneFrame) -> FramePoint:
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
    """Frame without axes, on which contact acts with forces alone."""
    used = np.abs(point.weights) > 1e-12
    none = np.zeros(int(used.sum()))
    return FramePoint(point.vectors[used], point.weights[used], none, none, np.zeros(3))


def _point(vectors: np.ndarray, weights: np.ndarray, along: np.ndarray, across: np.ndarray, fixed: np.ndarray) -> FramePoint:
    """Frame without the vectors that it does not depend on."""
    used = (np.abs(weights) > 1e-12) | (along != 0.0) | (across != 0.0)
    return FramePoint(vectors[used], weights[used], along[used], across[used], fixed)
