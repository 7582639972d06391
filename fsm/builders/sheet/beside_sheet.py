"""Parts of a [scene] beside a [sheet]: frames and seams on the sheet, so that bodies, films, cables and beams join it.

A frame is a vertex, a side or an edge of the sheet, or a point of a facet. On rigid facets it is a point of a facet; on
bars and on flexible facets it is a sum of vectors of their truss or mesh. Joints, springs and cords name places of the
sheet themselves, as "sheet.left", "sheet.vertices 3, 4" and "facet 2".
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from typing import NamedTuple, TypeVar

import numpy as np

from fsm.builders.patterns.cuts import FacetFrames, facet_frames, quaternions
from fsm.builders.patterns.lines import (
    SheetLine,
    facet_number,
    is_line,
    line_of_mesh,
    line_of_pattern,
    point_of_mesh,
    point_of_pattern,
)
from fsm.builders.patterns.mesh_places import MeshPlace, mesh_place
from fsm.builders.patterns.of_sheet import Place, pattern_of, place_of
from fsm.builders.sheet.sheet_loads import facet_name, facets_of_vertices
from fsm.case.derived.frame_bodies import as_assembled, joined_to_body
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import MeshPoint
from fsm.case.models.flexible import Position, SceneFrame, SceneSeam
from fsm.case.models.flexible_facets import SHEET, FlexibleFacets
from fsm.case.models.joint import SceneJoint
from fsm.case.models.law_keys import BodyPoint, PointElement
from fsm.case.models.loads import Load
from fsm.case.models.scene import GROUND, Body, ForceElement, Quaternion, Scene
from fsm.case.models.sheet_parts import Box
from fsm.case.models.spring import SceneCord, SceneSpring
from fsm.case.pattern_files.pattern import Pattern
from fsm.case.schema.known_names import nearest_name
from fsm.errors import CaseError, Fault, fault_at

_STRAIGHT = 1e-6
"""Sine of the angle between parts of a line up to which it is straight."""
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
    on = _places_of(case, scene)
    for number, frame in enumerate(more.frames):
        _check_keys(frame, f"scene.frames.{number}")
    more = _with_named_places(on, scene, more)
    placed = {number: frame for number, frame in enumerate(more.frames) if frame.on == SHEET}
    seams = {number: seam for number, seam in enumerate(more.seams) if seam.film == SHEET}
    rest = more.model_copy(
        update={
            "frames": tuple(frame for frame in more.frames if frame.on != SHEET),
            "seams": tuple(seam for seam in more.seams if seam.film != SHEET),
        }
    )
    for number, frame in placed.items():
        on.add(frame, f"scene.frames.{number}.place")
    joined = list[SceneJoint | ForceElement]()
    for number, seam in seams.items():
        joined += _of_seam(on, seam, more.bodies, f"scene.seams.{number}")
    joints = (joint for joint in joined if isinstance(joint, SceneJoint))
    springs = (spring for spring in joined if isinstance(spring, ForceElement))
    rest = rest.model_copy(update={"elements": (*rest.elements, *springs), "joints": (*rest.joints, *joints)})
    if isinstance(on, _OnFacets):
        return on.replaced(scene), on.replaced(rest)
    frames, bodies = (*scene.frames, *on.frames), (*scene.bodies, *on.bodies)
    return scene.model_copy(update={"frames": frames, "bodies": bodies}), rest


def _places_of(case: Case, scene: Scene) -> _OnMesh | _OnTruss | _OnFacets:
    assert case.sheet is not None
    if scene.built.facets is not None:
        return _OnMesh(scene.built.facets)
    pattern = pattern_of(case.sheet)
    return _OnTruss(pattern) if case.sheet.facets == "bars" else _OnFacets(pattern)


def _with_named_places(on: _Places, scene: Scene, more: Scene) -> Scene:
    """The [scene] whose joints, springs and cords act on frames where they name places of the sheet.

    On a facet that is no body they act on the point nearest to their own point.
    """
    known = {part.name for of in (scene.bodies, more.bodies, more.frames) for part in of}
    edges, added = on.edge_names(), set[str]()

    def named(name: str, at: Position, item: str, path: str) -> str:
        own, facet = name, facet_number(name)
        if name in known or (facet is None and not name.startswith(f"{SHEET}.")):
            return name
        if facet is None:
            place = name.removeprefix(f"{SHEET}.")
            frame = SceneFrame(name=name, on=SHEET, place=f"edge {place}" if place in edges else place)
        else:
            own = f"{name} at {item}, {path.rpartition('.')[2]}"
            frame = SceneFrame(name=own, on=SHEET, place=name, at=at)
        if own not in added:
            on.add(frame, path, near=True)
            added.add(own)
        return own

    def on_frames(item: _Between, path: str) -> _Between:
        to = item.at if item.to is None else item.to
        update: dict[str, object] = {
            "first": named(item.first, item.at, item.name, f"{path}.first"),
            "second": named(item.second, to, item.name, f"{path}.second"),
        }
        if isinstance(item, SceneCord):
            update["over"] = tuple(
                pulley.model_copy(update={"body": named(pulley.body, pulley.at, item.name, f"{path}.over.{k}")})
                for k, pulley in enumerate(item.over)
            )
        return item.model_copy(update=update)

    return more.model_copy(
        update={
            key: tuple(on_frames(item, f"scene.{key}.{number}") for number, item in enumerate(getattr(more, key)))
            for key in ("joints", "springs", "cords")
        }
    )


def frame_on_sheet(vectors: np.ndarray, name: str, point: MeshPoint) -> tuple[SceneFrame, Body]:
    """Frame at a point of a sheet with given vectors (n, 3) at the start, and its body."""
    x, y, z = (point.weights @ vectors[point.vectors]).tolist()
    body = Body(name=name, mass=0.0, inertia=(0.0, 0.0, 0.0), position=(x, y, z), held=True)
    if point.along.any():
        along, across = (part @ vectors[point.vectors] for part in (point.along, point.across))
        axes = np.array([along, np.cross(np.cross(along, across), along), np.cross(along, across)])
        turned = quaternions((axes / np.linalg.norm(axes, axis=1)[:, None]).T[None])[0]
        body = body.model_copy(update={"orientation": tuple(turned.tolist())})
    return SceneFrame(name=name, on=SHEET).at_point(point), body


def _check_keys(frame: SceneFrame, path: str) -> None:
    """Raise the fault of a frame with keys that it does not use."""
    if frame.on != SHEET and frame.place is not None:
        text = 'only a frame with on = "sheet" has a place; give `at`, or `point` of a truss'
        raise CaseError(Fault(f"{path}.place", text))
    if frame.on != SHEET:
        return
    if frame.edge is not None:
        raise CaseError(Fault(f"{path}.edge", f'is of films; on a sheet, give place = "edge {frame.edge}"'))
    if frame.place is None:
        text = 'missing; give a place of the sheet, for example "vertex 3", "vertices 3, 4", "edge left" or "facet 2"'
        raise CaseError(Fault(f"{path}.place", text))
    if frame.point is not None:
        raise CaseError(Fault(f"{path}.point", "is not used on a sheet; give `place`"))
    facet = facet_number(frame.place) is not None
    count = 3 if facet else 1
    if (facet or frame.at) and (not (facet or is_line(frame.place)) or len(frame.at) != count):
        text = "is used on a facet, (x, y, z) at the start in m, and on a side, (s) from its first vertex in m"
        raise CaseError(Fault(f"{path}.at", f"{len(frame.at)} numbers; `at` {text}"))
    if frame.at and frame.place.strip().startswith("edge "):  # type: ignore[union-attr]
        text = 'an edge of the sheet has no first vertex; name a side by its ends, for example "vertices 3, 4"'
        raise CaseError(Fault(f"{path}.at", text))


def _of_seam(on: _Places, seam: SceneSeam, bodies: tuple[Body, ...], path: str) -> list[SceneJoint | ForceElement]:
    """Joints or springs between the points of a seam on an edge of the sheet and bodies."""
    known = {body.name: body for body in bodies}
    for name in seam.bodies:
        if name not in known and name != GROUND:
            raise CaseError(Fault(f"{path}.bodies", f"no body is called {name!r}{nearest_name(name, [GROUND, *known])}"))
    if not seam.bodies:
        raise CaseError(Fault(f"{path}.bodies", "there are none; give at least one body"))
    if seam.clamped and isinstance(on, _OnTruss):
        raise CaseError(Fault(f"{path}.clamped", 'vertices of facets = "bars" carry no moment; remove this key'))
    points = on.along(seam.name, f"edge {seam.edge}", seam.stiffness is None, f"{path}.edge")
    ways = np.array([point.way / np.linalg.norm(point.way) for point in points if point.way is not None]).reshape(-1, 3)
    if len(ways) and not seam.clamped and np.linalg.norm(np.cross(ways[:1], ways), axis=1).max() > _STRAIGHT:
        text = "is not straight and cannot turn about itself; give clamped = true, or a stiffness"
        raise CaseError(Fault(f"{path}.clamped", f"edge {seam.edge} {text}"))
    return [joined_to_body(seam, point.name, point.place, point.length, point.way, known) for point in points]


def _one(count: int, name: str, path: str) -> None:
    """Raise the fault of a place with more or less than one point."""
    if count != 1:
        text = 'a frame needs one, for example "vertex 3", or a side by its two ends, "vertices 3, 4"'
        raise CaseError(Fault(path, f"{name} has {count} vertices; {text}"))


class _SeamPoint(NamedTuple):
    """Frame of a seam: name, place (3,) in m, length of the edge in m, and direction (3,) of the edge if it has axes."""

    name: str
    place: np.ndarray
    length: float
    way: np.ndarray | None


class _Places(ABC):
    """Frames at places of a sheet."""

    @abstractmethod
    def edge_names(self) -> Collection[str]:
        """Names of the edges of the sheet."""

    @abstractmethod
    def line(self, at: str) -> SheetLine:
        """Named edge or side; a ValueError if there is none."""

    @abstractmethod
    def inside(self, facet: int, at: np.ndarray, near: bool) -> MeshPoint:
        """Point of a facet; a ValueError if there is none."""

    @abstractmethod
    def put(self, name: str, point: MeshPoint, facet: int) -> None:
        """Add a frame at a point of a facet."""

    @abstractmethod
    def at_vertex(self, name: str, at: str | Box, path: str) -> None:
        """Add a frame at a vertex."""

    @abstractmethod
    def along(self, name: str, at: str, ideal: bool, path: str) -> list[_SeamPoint]:
        """Frames of a seam along an edge; of an ideal seam, at its nodes."""

    def add(self, frame: SceneFrame, path: str, near: bool = False) -> None:
        """Add a frame at its place; with `near`, the point of a facet may be off it."""
        at, facet = frame.place, facet_number(frame.place)
        assert at is not None
        with fault_at(path):
            if facet is not None:
                self.put(frame.name, self.inside(facet, np.array(frame.at), near), facet)
            elif isinstance(at, str) and is_line(at):
                line = self.line(at)
                self.put(frame.name, line.point(frame.at[0]) if frame.at else line.frame(), self.facet_of(line))
            else:
                self.at_vertex(frame.name, at, path)

    def facet_of(self, line: SheetLine) -> int:
        """Facet that carries the frame of a line, from 0."""
        return line.facets[0]


class _OnMesh(_Places):
    """Frames on flexible facets.

    At nodes, x is along the first direction of the mesh, on lines along the line, in facets along the facet; z is normal.
    """

    def __init__(self, facets: FlexibleFacets) -> None:
        self.facets, self.frames, self.bodies = facets, list[SceneFrame](), list[Body]()

    def edge_names(self) -> Collection[str]:
        """See `_Places`."""
        return self.facets.mesh.edges.keys()

    def line(self, at: str) -> SheetLine:
        """See `_Places`."""
        return line_of_mesh(self.facets.mesh, at)

    def inside(self, facet: int, at: np.ndarray, near: bool) -> MeshPoint:
        """See `_Places`."""
        return point_of_mesh(self.facets.mesh, facet, at, near)

    def put(self, name: str, point: MeshPoint, facet: int) -> None:
        """See `_Places`."""
        self._frame(name, point)

    def at_vertex(self, name: str, at: str | Box, path: str) -> None:
        """See `_Places`."""
        place = self._place(at, path)
        _one(len(place.sectors), place.name, path)
        self._frame(name, self.facets.mesh.at_node(int(place.sectors[0]), oriented=True))

    def along(self, name: str, at: str, ideal: bool, path: str) -> list[_SeamPoint]:
        """See `_Places`."""
        mesh, found, edges = self.facets.mesh, list[_SeamPoint](), self._place(at, path).edges
        if not ideal:
            for point, length in (part for edge in edges for part in mesh.on_edge(edge)):
                none = np.zeros(len(point.vectors))
                body = self._frame(f"{name} ({len(found) + 1})", point._replace(along=none, across=none))
                found.append(_SeamPoint(body.name, np.array(body.position), length, None))
            return found
        ends, lengths = mesh.ends(edges), mesh.lengths[edges[:, 0], edges[:, 1]]
        for sector in np.unique(ends).tolist():  # on a crease, both facets
            own = (ends == sector).any(axis=1)
            way = np.diff(mesh.positions[ends[own]], axis=1).sum(axis=(0, 1))
            body = self._frame(f"{name} ({len(found) + 1})", mesh.at_node(sector, oriented=True))
            found.append(_SeamPoint(body.name, np.array(body.position), 0.5 * float(lengths[own].sum()), way))
        return found

    def _frame(self, name: str, point: MeshPoint) -> Body:
        frame, body = frame_on_sheet(self.facets.mesh.vectors, name, point)
        self.frames.append(frame)
        self.bodies.append(body)
        return body

    def _place(self, at: str | Box, path: str) -> MeshPlace:
        with fault_at(path):
            return mesh_place(self.facets.mesh, at)


class _OnVertices(_Places):
    """Frames on a pattern; `_frame` makes one of them at a vertex."""

    def __init__(self, pattern: Pattern) -> None:
        self.pattern = pattern

    def edge_names(self) -> Collection[str]:
        """See `_Places`."""
        return self.pattern.groups.keys()

    def line(self, at: str) -> SheetLine:
        """See `_Places`."""
        return line_of_pattern(self.pattern, at)

    def inside(self, facet: int, at: np.ndarray, near: bool) -> MeshPoint:
        """See `_Places`."""
        return point_of_pattern(self.pattern, facet, at, near)

    def at_vertex(self, name: str, at: str | Box, path: str) -> None:
        """See `_Places`."""
        place = self._place(at, path)
        _one(len(place.vertices), place.name, path)
        self._frame(name, place.vertices[0])

    def along(self, name: str, at: str, ideal: bool, path: str) -> list[_SeamPoint]:
        """See `_Places`; half of each side belongs to each of its ends."""
        vertices, pattern, found = self._place(at, path).vertices, self.pattern, list[_SeamPoint]()
        inside = np.isin(pattern.edges, vertices).all(axis=1) & (pattern.edge_faces < 0).any(axis=1)
        halves = np.repeat(0.5 * pattern.lengths[inside], 2)
        lengths = np.bincount(pattern.edges[inside].ravel(), halves, len(pattern.vertices))
        for number, vertex in enumerate(vertices, 1):
            part = f"{name} ({number})"
            self._frame(part, vertex)
            found.append(_SeamPoint(part, pattern.vertices[vertex], float(lengths[vertex]), None))
        return found

    def _place(self, at: str | Box, path: str) -> Place:
        with fault_at(path):
            return place_of(self.pattern, at)

    @abstractmethod
    def _frame(self, name: str, vertex: int) -> None:
        """Add a frame at a vertex."""


class _OnTruss(_OnVertices):
    """Frames on the truss of a sheet of bars; at a vertex they have no axes and carry no moment."""

    def __init__(self, pattern: Pattern) -> None:
        super().__init__(pattern)
        self.frames, self.bodies = list[SceneFrame](), list[Body]()

    def _frame(self, name: str, vertex: int) -> None:
        self.frames.append(SceneFrame(name=name, on=SHEET, point=vertex))

    def put(self, name: str, point: MeshPoint, facet: int) -> None:
        """See `_Places`."""
        frame, body = frame_on_sheet(self.pattern.vertices, name, point)
        self.frames.append(frame)
        self.bodies.append(body)


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
        on.add(frame, f"scene.frames.{number}.place")
    return {name: (point.facet, _moved(point, (0.0, 0.0, 0.0))) for name, point in on.points.items()}


class _OnFacets(_OnVertices):
    """Points of rigid facets by the names of frames, with the axes of the facet: the first one of a vertex or a side."""

    def __init__(self, pattern: Pattern) -> None:
        super().__init__(pattern)
        self.points = dict[str, _FacetPoint]()
        self._facets: Mapping[int, int] = facets_of_vertices(pattern)
        self._frames: FacetFrames = facet_frames(pattern)

    def _frame(self, name: str, vertex: int) -> None:
        one, none = np.ones(1), np.zeros(1)
        self.put(name, MeshPoint(np.array([vertex]), one, none, none), self._facets[vertex])

    def facet_of(self, line: SheetLine) -> int:
        """See `_Places`."""
        if len(set(line.facets)) > 1:
            own = ", ".join(facet_name(facet) for facet in sorted(set(line.facets)))
            text = f'{line.name} is on several rigid facets, {own}; name one side by its ends, for example "vertices 3, 4"'
            raise ValueError(text)
        return line.facets[0]

    def put(self, name: str, point: MeshPoint, facet: int) -> None:
        """See `_Places`."""
        place = point.weights @ self.pattern.vertices[point.vectors]
        local = self._frames.local(np.array([facet]), place[None])[0]
        w, x, y, z = quaternions(self._frames.axes[facet][None])[0].tolist()
        self.points[name] = _FacetPoint(facet_name(facet), (w, x, y, z), local)

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
