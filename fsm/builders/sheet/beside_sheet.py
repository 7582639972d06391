"""Parts of a [scene] beside a [sheet]: frames and seams on the sheet, so that bodies, films, cables and beams join it.

A frame on rigid facets is a point of a facet. A frame on bars is a vertex of their truss, and a frame on flexible facets is
a node of their mesh.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple, TypeVar

import numpy as np

from fsm.builders.patterns.cuts import FacetFrames, facet_frames, quaternions
from fsm.builders.patterns.mesh_places import MeshPlace, mesh_place
from fsm.builders.patterns.of_sheet import Place, pattern_of, place_of
from fsm.builders.sheet.sheet_loads import facet_name, facets_of_vertices
from fsm.case.derived.frame_bodies import as_assembled, nearest_body, quaternion_matrix
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import MeshPoint
from fsm.case.models.flexible import SceneFrame, SceneSeam
from fsm.case.models.flexible_facets import SHEET, FlexibleFacets
from fsm.case.models.joint import SceneJoint
from fsm.case.models.law_keys import BodyPoint, PointElement
from fsm.case.models.loads import Load
from fsm.case.models.scene import GROUND, Body, ForceElement, Quaternion, Scene
from fsm.case.models.sheet_parts import Box
from fsm.case.models.spring import SceneCord, SceneSpring
from fsm.case.pattern_files.pattern import Pattern
from fsm.case.schema.known_names import nearest_name
from fsm.errors import CaseError, Fault

_Between = TypeVar("_Between", SceneJoint, SceneSpring, SceneCord)


def with_sheet_frames(case: Case, scene: Scene, more: Scene) -> tuple[Scene, Scene]:
    """Scene of a sheet and the [scene] beside it; frames and seams on the sheet refer to its facets or points.

    Parameters
    ----------
    case : Case
    scene : Scene
        Scene of the sheet.
    more : Scene
        The [scene] of the case.

    Returns
    -------
    Scene, Scene
        The scene of the sheet with these frames, and the [scene] without them. Rigid facets have no frames: elements and
        loads act on points of facets instead.

    Raises
    ------
    CaseError
        A frame or a seam names a place that the sheet does not have.
    """
    assert case.sheet is not None
    for number, frame in enumerate(more.frames):
        _check_keys(frame, f"scene.frames.{number}")
    placed = {number: frame for number, frame in enumerate(more.frames) if frame.on == SHEET}
    seams = {number: seam for number, seam in enumerate(more.seams) if seam.film == SHEET}
    rest = more.model_copy(
        update={
            "frames": tuple(frame for frame in more.frames if frame.on != SHEET),
            "seams": tuple(seam for seam in more.seams if seam.film != SHEET),
        }
    )
    if not placed and not seams:
        return scene, rest
    on: _OnMesh | _OnTruss | _OnFacets
    if scene.facets is not None:
        on = _OnMesh(scene.facets)
    elif case.sheet.facets == "bars":
        on = _OnTruss(pattern_of(case.sheet))
    else:
        on = _OnFacets(pattern_of(case.sheet))
    for number, frame in placed.items():
        assert frame.place is not None
        on.add(frame.name, frame.place, f"scene.frames.{number}.place")
    springs = list[ForceElement]()
    for number, seam in seams.items():
        springs += _springs(on, seam, more.bodies, f"scene.seams.{number}")
    rest = rest.model_copy(update={"elements": (*rest.elements, *springs)})
    if isinstance(on, _OnFacets):
        return on.replaced(scene), on.replaced(rest)
    frames, bodies = (*scene.frames, *on.frames), (*scene.bodies, *on.bodies)
    return scene.model_copy(update={"frames": frames, "bodies": bodies}), rest


def frame_of_mesh(facets: FlexibleFacets, name: str, point: MeshPoint) -> tuple[SceneFrame, Body]:
    """Frame at a point of the mesh of flexible facets, added to `facets`, and its body at the start."""
    mesh = facets.mesh
    vectors = np.concatenate([mesh.positions[:, None], mesh.slopes], axis=1).reshape(-1, 3)
    x, y, z = (point.weights @ vectors[point.vectors]).tolist()
    facets.points[name] = point
    body = Body(name=name, mass=0.0, inertia=(0.0, 0.0, 0.0), position=(x, y, z), held=True)
    if point.along.any():
        along, across = (part @ vectors[point.vectors] for part in (point.along, point.across))
        axes = np.array([along, np.cross(np.cross(along, across), along), np.cross(along, across)])
        turned = quaternions((axes / np.linalg.norm(axes, axis=1)[:, None]).T[None])[0]
        body = body.model_copy(update={"orientation": tuple(turned.tolist())})
    return SceneFrame(name=name, on=SHEET), body


def _check_keys(frame: SceneFrame, path: str) -> None:
    """Raise the fault of a frame with keys that it does not use."""
    if frame.on != SHEET and frame.place is not None:
        text = 'only a frame with on = "sheet" has a place; give `at`, or `point` of a truss'
        raise CaseError(Fault(f"{path}.place", text))
    if frame.on == SHEET and frame.place is None:
        raise CaseError(Fault(f"{path}.place", 'missing; give one vertex of the sheet, for example "vertex 3"'))
    if frame.on == SHEET and (frame.at or frame.point is not None):
        key = "at" if frame.at else "point"
        raise CaseError(Fault(f"{path}.{key}", "is not used on a sheet; give `place` only"))


def _springs(
    on: _OnMesh | _OnTruss | _OnFacets, seam: SceneSeam, bodies: tuple[Body, ...], path: str
) -> list[ForceElement]:
    """Springs between the points of a seam on an edge of the sheet and bodies."""
    known = {body.name: body for body in bodies}
    for name in seam.bodies:
        if name not in known:
            raise CaseError(Fault(f"{path}.bodies", f"no body is called {name!r}{nearest_name(name, [*known])}"))
    if not seam.bodies:
        raise CaseError(Fault(f"{path}.bodies", "there are none; give at least one body"))
    found = []
    for name, place, length in on.along(seam.name, f"edge {seam.edge}", f"{path}.edge"):
        body = nearest_body(place, [known[name] for name in seam.bodies])
        x, y, z = (quaternion_matrix(body.orientation).T @ (place - np.array(body.position))).tolist()
        stiffness = seam.stiffness * length
        found.append(
            ForceElement(
                name=name, inner=name, outer=body.name, point_outer=(x, y, z),
                translation=(stiffness, stiffness, stiffness),
            )
        )  # fmt: skip
    return found


def _one(count: int, name: str, path: str) -> None:
    """Raise the fault of a place with more or less than one point."""
    if count != 1:
        raise CaseError(Fault(path, f"{name} has {count} vertices; a frame needs one, for example \"vertex 3\""))


class _OnMesh:
    """Frames at nodes of flexible facets, with axes: x along the first direction of the mesh, z normal to the facet."""

    def __init__(self, facets: FlexibleFacets) -> None:
        self.facets, self.frames, self.bodies = facets, list[SceneFrame](), list[Body]()

    def add(self, name: str, at: str | Box, path: str) -> None:
        place = self._place(at, path)
        _one(len(place.sectors), place.name, path)
        self._frame(name, self.facets.mesh.at_node(int(place.sectors[0]), oriented=True))

    def along(self, name: str, at: str, path: str) -> list[tuple[str, np.ndarray, float]]:
        """Names, positions (3,) in m and lengths in m of the points of an edge."""
        mesh, found = self.facets.mesh, list[tuple[str, np.ndarray, float]]()
        for point, length in (part for edge in self._place(at, path).edges for part in mesh.on_edge(edge)):
            none = np.zeros(len(point.vectors))
            body = self._frame(f"{name} ({len(found) + 1})", point._replace(along=none, across=none))
            found.append((body.name, np.array(body.position), length))
        return found

    def _frame(self, name: str, point: MeshPoint) -> Body:
        frame, body = frame_of_mesh(self.facets, name, point)
        self.frames.append(frame)
        self.bodies.append(body)
        return body

    def _place(self, at: str | Box, path: str) -> MeshPlace:
        try:
            return mesh_place(self.facets.mesh, at)
        except ValueError as error:
            raise CaseError(Fault(path, str(error))) from None


class _OnVertices(ABC):
    """Frames at vertices of a pattern; `_frame` makes one of them."""

    def __init__(self, pattern: Pattern) -> None:
        self.pattern = pattern

    def add(self, name: str, at: str | Box, path: str) -> None:
        place = self._place(at, path)
        _one(len(place.vertices), place.name, path)
        self._frame(name, place.vertices[0])

    def along(self, name: str, at: str, path: str) -> list[tuple[str, np.ndarray, float]]:
        """Names, positions (3,) in m and lengths in m of the vertices of an edge; half of each side belongs to each end."""
        vertices, pattern, found = self._place(at, path).vertices, self.pattern, list[tuple[str, np.ndarray, float]]()
        inside = np.isin(pattern.edges, vertices).all(axis=1) & (pattern.edge_faces < 0).any(axis=1)
        halves = np.repeat(0.5 * pattern.lengths[inside], 2)
        lengths = np.bincount(pattern.edges[inside].ravel(), halves, len(pattern.vertices))
        for number, vertex in enumerate(vertices, 1):
            part = f"{name} ({number})"
            self._frame(part, vertex)
            found.append((part, pattern.vertices[vertex], float(lengths[vertex])))
        return found

    def _place(self, at: str | Box, path: str) -> Place:
        try:
            return place_of(self.pattern, at)
        except ValueError as error:
            raise CaseError(Fault(path, str(error))) from None

    @abstractmethod
    def _frame(self, name: str, vertex: int) -> None:
        """Add a frame at a vertex."""


class _OnTruss(_OnVertices):
    """Frames at points of the truss of a sheet of bars; they carry no moment."""

    def __init__(self, pattern: Pattern) -> None:
        super().__init__(pattern)
        self.frames, self.bodies = list[SceneFrame](), list[Body]()

    def _frame(self, name: str, vertex: int) -> None:
        self.frames.append(SceneFrame(name=name, on=SHEET, point=vertex))


class _FacetPoint(NamedTuple):
    """Point of a facet: name, orientation and point (m, facet axes)."""

    facet: str
    turned: Quaternion
    point: np.ndarray


def points_on_facets(case: Case) -> dict[str, tuple[str, tuple[float, float, float]]]:
    """Facet and point in its axes, m, of every frame of [scene] on a sheet of rigid facets, whose frames are no bodies."""
    if case.sheet is None or case.scene is None or case.sheet.facets not in ("rigid", "bend-lines"):
        return {}
    frames = [(number, frame) for number, frame in enumerate(case.scene.frames) if frame.on == SHEET]
    if not frames:
        return {}
    on = _OnFacets(pattern_of(case.sheet))
    for number, frame in frames:
        assert frame.place is not None
        on.add(frame.name, frame.place, f"scene.frames.{number}.place")
    return {name: (point.facet, _moved(point, (0.0, 0.0, 0.0))) for name, point in on.points.items()}


class _OnFacets(_OnVertices):
    """Points of rigid facets by the names of frames; each lies on the first facet of its vertex and has the facet's axes."""

    def __init__(self, pattern: Pattern) -> None:
        super().__init__(pattern)
        self.points = dict[str, _FacetPoint]()
        self._facets: Mapping[int, int] = facets_of_vertices(pattern)
        self._frames: FacetFrames = facet_frames(pattern)

    def _frame(self, name: str, vertex: int) -> None:
        facet = self._facets[vertex]
        point = self._frames.local(np.array([facet]), self.pattern.vertices[vertex][None])[0]
        w, x, y, z = quaternions(self._frames.axes[facet][None])[0].tolist()
        self.points[name] = _FacetPoint(facet_name(facet), (w, x, y, z), point)

    def replaced(self, scene: Scene) -> Scene:
        """Scene whose elements and loads act on points of facets instead of the frames."""
        turned = {GROUND: (1.0, 0.0, 0.0, 0.0)} | {body.name: body.orientation for body in scene.bodies}
        turned |= {name: point.turned for name, point in self.points.items()}
        return scene.model_copy(
            update={
                "elements": tuple(self._element(element, turned) for element in scene.elements),
                "point_elements": tuple(self._point_element(element) for element in scene.point_elements),
                "loads": tuple(self._load(load) for load in scene.loads),
                "joints": tuple(self._named(joint) for joint in scene.joints),
                "springs": tuple(self._named(spring) for spring in scene.springs),
                "cords": tuple(self._named(cord) for cord in scene.cords),
            }
        )

    def _element(self, element: ForceElement, turned: dict[str, Quaternion]) -> ForceElement:
        if not {element.inner, element.outer} & self.points.keys():
            return element
        element, update = as_assembled(element, turned), dict[str, object]()
        for end in ("inner", "outer"):
            name = getattr(element, end)
            if name in self.points:
                point = self.points[name]
                update |= {end: point.facet, f"point_{end}": _moved(point, getattr(element, f"point_{end}"))}
        return element.model_copy(update=update)

    def _named(self, item: _Between) -> _Between:
        """Joint, spring or cord on facets; its points are in inertial axes, so they stay."""
        update: dict[str, object] = {}
        for end in ("first", "second"):
            if getattr(item, end) in self.points:
                update[end] = self.points[getattr(item, end)].facet
        if isinstance(item, SceneCord):
            update["over"] = tuple(
                pulley.model_copy(update={"body": self.points[pulley.body].facet}) if pulley.body in self.points else pulley
                for pulley in item.over
            )
        return item.model_copy(update=update)

    def _point_element(self, element: PointElement) -> PointElement:
        ends = tuple(self._body_point(end) for end in element.points)
        return element.model_copy(update={"points": ends})

    def _body_point(self, end: BodyPoint) -> BodyPoint:
        if end.body not in self.points:
            return end
        point = self.points[end.body]
        return BodyPoint(body=point.facet, point=_moved(point, end.point))

    def _load(self, load: Load) -> Load:
        if load.body not in self.points:
            return load
        point = self.points[load.body]
        return load.model_copy(update={"body": point.facet, "point": _moved(point, load.point)})


def _moved(frame: _FacetPoint, point: tuple[float, float, float]) -> tuple[float, float, float]:
    """Point in the axes of the facet, m, of a point in the axes of the frame, which are parallel."""
    x, y, z = (frame.point + np.array(point)).tolist()
    return x, y, z
