"""Loads on places of flexible facets, as loads on frames of the mesh."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from fsm.builders.patterns.flexible_mesh import flexible_mesh
from fsm.builders.patterns.mesh_places import MeshPlace, mesh_place
from fsm.builders.patterns.places import facets_named
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import FacetMesh, MeshPoint
from fsm.case.models.loads import PART, Load
from fsm.errors import CaseError, Fault


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
    try:
        return facets_named(load.at, int(mesh.facet.max()) + 1)
    except ValueError as error:
        raise CaseError(Fault(f"{path}.at", str(error))) from None


def load_parts(mesh: FacetMesh, load: Load, path: str) -> list[tuple[Load, MeshPoint]]:
    """Parts of a load on a place, with the points of their frames; takes the arguments and raises the errors of
    `loads_on_mesh`.
    """
    assert load.at is not None
    try:
        place = mesh_place(mesh, load.at)
    except ValueError as error:
        raise CaseError(Fault(f"{path}.at", str(error))) from None
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
