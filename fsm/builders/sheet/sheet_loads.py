"""Loads on places of a sheet, as loads on facets, on frames at vertices, or on frames of the mesh of flexible facets.

Check that supports and drives of a sheet prevent its motion as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache

import numpy as np

from fsm.builders.patterns.cuts import FacetFrames, facet_frames
from fsm.builders.patterns.mesh_places import MeshPlace, mesh_place
from fsm.builders.patterns.of_sheet import Place, facets_named, flexible_mesh, pattern_of, place_of
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import FacetMesh, MeshPoint
from fsm.case.models.loads import PART, Load
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError, Fault, fault_at
from fsm.text.shown_units import shown_points


def loads_on_mesh(case: Case, loads: Iterable[Load]) -> tuple[Load, ...]:
    """Loads that each act on a body; for a load on a place, this body is a frame of the mesh.

    Raises
    ------
    CaseError
        There is no such place, or a load per length acts on a place that is not an edge.
    """
    assert case.sheet is not None
    mesh, found = flexible_mesh(case.sheet), list[Load]()
    for number, load in enumerate(loads):
        if load.pressure is not None:
            pressed_facets(mesh, load, f"load.{number}")
        placed = load.at is not None and load.pressure is None
        found += [part for part, _ in load_parts(mesh, load, f"load.{number}")] if placed else [load]
    return tuple(found)


def pressed_facets(mesh: FacetMesh, load: Load, path: str) -> tuple[int, ...]:
    """Numbers (from 0) of the facets on which a pressure acts; raises the same errors as `loads_on_mesh`."""
    assert isinstance(load.at, str)
    with fault_at(f"{path}.at"):
        return facets_named(load.at, int(mesh.facet.max()) + 1)


def load_parts(mesh: FacetMesh, load: Load, path: str) -> list[tuple[Load, MeshPoint]]:
    """Parts of a load on a place, with the points of their frames; takes the arguments and raises the errors of
    `loads_on_mesh`.
    """
    assert load.at is not None
    with fault_at(f"{path}.at"):
        place = mesh_place(mesh, load.at)
    of_line = np.array([load.force_per_length, load.moment_per_length])
    if of_line.any() and not len(place.edges):
        text = f'{place.name} has no length; give `force` or `moment`, or an edge, for example "edge left"'
        raise CaseError(Fault(f"{path}.at", text))
    if any(load.point):
        raise CaseError(Fault(f"{path}.point", "is not used beside `at`; remove this key"))
    oriented = load.follower or any(load.moment) or any(load.moment_per_length)
    length = float(mesh.lengths[place.edges[:, 0], place.edges[:, 1]].sum())
    whole = np.array([load.force, load.moment]) + length * of_line
    none = (0.0, 0.0, 0.0)
    # frames belong to the place, because a load of a later step may act on the same place, also under the same name
    frames, found = f"{'oriented load' if oriented else 'load'} on {place.name}", []
    for number, (name, point, share) in enumerate(place_points(mesh, place, frames, oriented), 1):
        force, moment = (tuple(vector.tolist()) for vector in share * whole)
        update = {
            "name": f"{load.called}{PART}{number}", "at": None, "body": name, "force": force, "moment": moment,
            "force_per_length": none, "moment_per_length": none,
        }  # fmt: skip
        found.append((load.model_copy(update=update), point))
    return found


def place_points(mesh: FacetMesh, place: MeshPlace, name: str, oriented: bool) -> Iterator[tuple[str, MeshPoint, float]]:
    """Points of a place, with the names of their frames and their shares of a load; nodes have equal shares."""
    points = [(point, length) for edge in place.edges for point, length in mesh.on_edge(edge)]
    if not len(place.edges):
        points = [(mesh.at_node(sector, oriented), 1.0) for sector in place.sectors.tolist()]
    whole = sum(length for _, length in points)
    for number, (point, length) in enumerate(points, 1):
        none = np.zeros(len(point.vectors))
        yield f"{name} ({number})", point if oriented else point._replace(along=none, across=none), length / whole


Frames = Callable[[], FacetFrames]
"""Frames of the facets, computed once when they are needed."""


def facet_name(number: int) -> str:
    """Name of the body of a facet; facet numbers start at 0 here, and at 1 in names."""
    return f"facet {number + 1}"


def vertex_name(number: int) -> str:
    """Name of the frame at a vertex of a sheet of bars; numbers as in `facet_name`."""
    return f"vertex {number + 1}"


def facets_of_vertices(pattern: Pattern) -> dict[int, int]:
    """First facet of each vertex, by number."""
    return {vertex: face for face, vertices in reversed(list(enumerate(pattern.faces))) for vertex in vertices}


def placed_loads(case: Case, loads: Iterable[Load]) -> tuple[Load, ...]:
    """Parts of the loads, each of which acts on one body; a force on several vertices of a sheet acts on each of them in
    equal parts.

    Raises
    ------
    CaseError
        There is no such place, or the vertices of the place cannot carry the load.
    """
    loads = tuple(loads)
    if case.sheet is None or not any(load.at is not None for load in loads):
        return loads
    if case.sheet.facets == "flexible":
        return loads_on_mesh(case, loads)
    pattern = pattern_of(case.sheet)
    frames = cache(lambda: facet_frames(pattern))
    found: list[Load] = []
    for number, load in enumerate(loads):
        found += [load] if load.at is None else _placed(case, pattern, frames, load, f"load.{number}")
    return tuple(found)


def _placed(case: Case, pattern: Pattern, frames: Frames, load: Load, path: str) -> list[Load]:
    """Loads on the bodies of a place."""
    assert case.sheet is not None and load.at is not None
    if load.pressure is not None:
        return _pressed(case, pattern, frames, load, path)
    with fault_at(f"{path}.at"):
        place = place_of(pattern, load.at)
    bars = case.sheet.facets == "bars"
    if place.facet is not None and not bars:
        return [load.model_copy(update={"at": None, "body": facet_name(place.facet)})]
    if any(load.moment):
        raise CaseError(Fault(f"{path}.moment", "vertices carry no moment; give a facet of rigid facets, or a force only"))
    if bars and load.follower:
        text = 'vertices of facets = "bars" do not rotate, so a load cannot follow them; remove this key'
        raise CaseError(Fault(f"{path}.follower", text))
    if any(load.point):
        raise CaseError(Fault(f"{path}.point", "is not used beside `at` with vertices; remove this key"))
    return _on_vertices(pattern, None if bars else frames(), load, place)


def _pressed(case: Case, pattern: Pattern, frames: Frames, load: Load, path: str) -> list[Load]:
    """Pressure on facets; rigid facets have a force at each centroid that rotates with the facet."""
    assert case.sheet is not None and isinstance(load.at, str) and load.pressure is not None
    with fault_at(f"{path}.at"):
        facets = facets_named(load.at, len(pattern.faces))
    if case.sheet.facets == "bars":
        return [load]
    area = frames().area
    return [
        load.model_copy(
            update={
                "at": None, "pressure": None, "body": facet_name(facet), "follower": True,
                "name": load.called if len(facets) == 1 else f"{load.called}{PART}{facet + 1}",
                "force": (0.0, 0.0, load.pressure * float(area[facet])),
            }
        )
        for facet in facets
    ]  # fmt: skip


def _on_vertices(pattern: Pattern, frames: FacetFrames | None, load: Load, place: Place) -> list[Load]:
    vertices = place.vertices if place.facet is None else pattern.faces[place.facet]
    share = tuple(component / len(vertices) for component in load.force)
    facets = {} if frames is None else facets_of_vertices(pattern)
    found = []
    for vertex in vertices:
        name = load.called if len(vertices) == 1 else f"{load.called}{PART}{vertex + 1}"
        update = {"at": None, "name": name, "force": share, "body": vertex_name(vertex)}
        if frames is not None:
            facet = facets[vertex]
            point = frames.local(np.array([facet]), pattern.vertices[vertex][None])[0]
            update |= {"body": facet_name(facet), "point": tuple(point.tolist())}
        found.append(load.model_copy(update=update))
    return found


_FREE = 1e-7
"""Relative singular value below which a motion is free; the reference is the largest singular value."""


def check_supports(case: Case, pattern: Pattern) -> None:
    """Raise a CaseError if a static sheet can move as a whole.

    Cases with steps, which may change drives, are not checked. Dynamic cases need no supports and are not checked either,
    nor are sheets that joints, springs, cords, seams or force elements of a [scene] may hold.
    """
    scene = case.scene
    held = scene is not None and (scene.joints or scene.springs or scene.cords or scene.seams or scene.elements)
    if case.step or held or case.solve.method not in ("static", "arc-length"):
        return
    free = free_motions(case, pattern)
    if free:
        motions = " and ".join(free) if len(free) < 6 else "move freely"
        text = f"supports and drives let the sheet {motions}; statics needs a support that prevents it"
        raise CaseError(Fault("sheet.support", text))


def free_motions(case: Case, pattern: Pattern) -> list[str]:
    """Text of the rigid-body motions of the sheet that no support and no drive prevents."""
    assert case.sheet is not None
    middle, size = pattern.vertices.mean(axis=0), max(pattern.extent(), 1e-300)
    rows = [np.zeros((1, 6))]
    for support in case.sheet.support:
        rows.append(_rows(pattern, support.at, np.eye(3)[["xyz".index(axis) for axis in support.fixed]], middle, size))
    for drive in case.drive:
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        if at is None:  # a facet
            return []
        along = np.array(drive.direction)[None] / np.linalg.norm(drive.direction)
        rows.append(_rows(pattern, at, np.eye(3) if drive.guide else along, middle, size))
    _, values, motions = np.linalg.svd(np.concatenate(rows))
    values = np.concatenate([values, np.zeros(6 - len(values))])
    return [_text(motion, middle, size) for motion, value in zip(motions, values, strict=True) if value <= _FREE * values[0]]


def _rows(pattern: Pattern, at: object, directions: np.ndarray, middle: np.ndarray, size: float) -> np.ndarray:
    """Displacements at a place along directions (d, 3) due to the six rigid-body motions, three translations and three
    rotations.
    """
    place = place_of(pattern, at)  # type: ignore[arg-type]
    vertices = place.vertices if place.facet is None else pattern.faces[place.facet]
    directions = directions if place.facet is None else np.eye(3)
    arms = (pattern.vertices[list(vertices)] - middle) / size
    turns = np.cross(arms[:, None], directions[None])
    return np.concatenate([np.broadcast_to(directions, turns.shape), turns], axis=2).reshape(-1, 6)


def _text(motion: np.ndarray, middle: np.ndarray, size: float) -> str:
    """Text of a motion: translation, or rotation about an axis."""
    move, turn = motion[:3], motion[3:]
    rate = float(np.linalg.norm(turn))
    if rate < 1e-6:
        return f"move along {_vector(_upright(move))}"
    point = middle + size * np.cross(turn, move) / rate**2
    return f"rotate about {_vector(_upright(turn))} through {shown_points([point])}"


def _vector(values: np.ndarray) -> str:
    small = np.abs(values) < 1e-6 * float(np.abs(values).max())
    return f"({', '.join(f'{value:.3g}' for value in np.where(small, 0.0, values))})"


def _upright(vector: np.ndarray) -> np.ndarray:
    """Unit vector whose largest component is positive."""
    return np.asarray(vector / np.linalg.norm(vector) * np.sign(vector[np.argmax(np.abs(vector))]))
