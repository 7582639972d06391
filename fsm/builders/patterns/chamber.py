"""Closed chambers of a sheet: open edges, planes and lids that close them, and the enclosed volume at the start.

The volume is the flux of a field of divergence 1 through the facets and lids,

    V = 1/d sum_a int (x_a - o_a) n_a dA

over the d axes a that are not normal to two planes of symmetry; o_a is the position of the plane normal to a, or arbitrary
without a plane. With this choice the planes have no flux.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from fsm.builders.patterns.of_sheet import facets_named
from fsm.case.models.chambers import Chamber, Lid
from fsm.case.models.gas import Gas
from fsm.errors import CaseError, Fault, fault_at
from fsm.text.shown_units import count, shown_points

_NEAR = 1e-9
"""Distance of a node from a plane, relative to the size of the sheet, below which the node lies in the plane."""
_EMPTY = 1e-12
"""Volume relative to the 3/2 power of the area; a chamber below this value counts as flat."""


@dataclass(frozen=True, eq=False)
class SheetSurface:
    """Surface of a sheet as triangles of nodes, at the start.

    Attributes
    ----------
    positions : (n, 3) array, m
    triangles : (m, 3) int array of nodes, counter-clockwise around the normals
    facet : (m,) int array
        Facet of each triangle.
    held : components (0, 1, 2) along which nodes do not move, by node
    groups : nodes of named edges of the sheet
    vertices : (v,) int array
        Nodes of the vertices of the pattern.
    across_cuts : pairs of facets on both sides of a cut
    """

    positions: np.ndarray
    triangles: np.ndarray
    facet: np.ndarray
    held: Mapping[int, Collection[int]]
    groups: Mapping[str, tuple[int, ...]]
    vertices: np.ndarray
    across_cuts: tuple[tuple[int, int], ...] = ()


def chamber_of(gas: Gas, surface: SheetSurface, path: str) -> Chamber:
    """Chamber of a gas, with its closing planes and lids.

    Raises
    ------
    CaseError
        The chamber is open or has a cut, its planes do not give its volume, or it has no volume for the gas at the start.
    """
    with fault_at(f"{path}.at"):
        facets = facets_named(gas.at, int(surface.facet.max()) + 1)
    own = np.isin(surface.facet, facets)
    triangles = surface.triangles[own]
    axes, origin = _field(gas, path)
    free = _open_edges(triangles)
    _check_cuts(gas, surface, _on_cuts(surface, triangles, surface.facet[own], free), path)
    caps = tuple(_lid(gas, number, surface, free, path) for number, one in enumerate(gas.closed_by) if one.cap is not None)
    _check_closed(gas, surface, free, path)
    corners = surface.positions[triangles]
    area = float(np.linalg.norm(_areas(corners), axis=1).sum())
    for lid in caps:
        at = surface.positions[lid.nodes]
        tip = np.broadcast_to(lid.tip(at), (len(lid.edges), 1, 3))
        corners = np.concatenate([corners, np.concatenate([tip, at[lid.edges]], axis=1)])
    mean = corners.mean(axis=1) - origin
    volume = float((mean * _areas(corners))[:, axes].sum()) / len(axes)
    flat = abs(volume) <= _EMPTY * area**1.5
    if flat and gas.supply_pressure is None:
        text = "the chamber has no volume at the start, so its gas has no pressure; fold it, or give `supply_pressure`"
        raise CaseError(Fault(f"{path}.at", text))
    sign = -1.0 if volume < 0.0 and not flat else 1.0
    return Chamber(gas, facets, axes, origin, caps, sign, 0.0 if flat else abs(volume), area)


def _areas(corners: np.ndarray) -> np.ndarray:
    """Normals (m, 3) of triangles (m, 3, 3) of the length of their areas, m^2."""
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0)


def _field(gas: Gas, path: str) -> tuple[tuple[int, ...], np.ndarray]:
    """Axes of the field, and its origin."""
    at: dict[int, set[float]] = {0: set(), 1: set(), 2: set()}
    for plane in gas.closed_by:
        if plane.axis is not None:
            at["xyz".index(plane.axis)].add(plane.at)
    axes = tuple(axis for axis, places in at.items() if len(places) < 2)
    if not axes:
        text = "two planes normal to each of the three axes do not give the volume; leave one plane to the facets"
        raise CaseError(Fault(f"{path}.closed_by", text))
    return axes, np.array([next(iter(at[axis]), 0.0) if axis in axes else 0.0 for axis in range(3)])


def _open_edges(triangles: np.ndarray) -> dict[int, int]:
    """Next node along each open edge; an open edge has a triangle on its left side only."""
    pairs = {(a, b) for face in triangles.tolist() for a, b in zip(face, (*face[1:], face[0]), strict=True)}
    return {a: b for a, b in pairs if (b, a) not in pairs}


def _lid(gas: Gas, number: int, surface: SheetSurface, free: dict[int, int], path: str) -> Lid:
    """Lid over a ring, or over a part of one between planes; removes the edges of the ring from the open edges."""
    cap = gas.closed_by[number].cap
    assert cap is not None
    key = f"{path}.closed_by.{number}.cap"
    word, _, name = cap.strip().partition(" ")
    nodes = surface.groups.get(name, ()) if word == "edge" else ()
    if word == "vertex" and name.isdigit() and 0 < int(name) <= len(surface.vertices):
        nodes = (int(surface.vertices[int(name) - 1]),)
    if not nodes:
        names = ", ".join(f'"edge {known}"' for known in surface.groups)
        text = f'give {names + ", or " if names else ""}a vertex of the ring, "vertex 1" to "vertex {len(surface.vertices)}"'
        raise CaseError(Fault(key, f'"{cap}" is not a place of the sheet; {text}'))
    inside = frozenset(nodes) if len(nodes) > 1 else frozenset(free)  # a named edge may end in a plane
    edges = {a: b for a, b in free.items() if {a, b} <= inside and not _in_planes(gas, surface, (a, b))}
    before = {b: a for a, b in edges.items()}
    start = here = next((node for node in nodes if node in edges or node in before), None)
    while here in before and before[here] != start:
        here = before[here]
    found = list[int]()
    while here in edges:
        found.append(here)
        del free[here]
        here = edges.pop(here)
    whole = not found or here == found[0]
    planes = []
    if not whole and here is not None:
        found.append(here)
        planes = _planes_between(gas, surface, (found[0], here))
    if len(found) + len(planes) < (3 if whole else 4) or (not whole and not planes):
        text = "is not on a closed ring of open edges of the chamber, or on a line that ends in a plane of `closed_by`"
        raise CaseError(Fault(key, f"{cap} {text}, which a lid needs"))
    # the facets are on one side of the edges of the ring and the lid is on the other side
    ring = np.array(found[::-1], dtype=np.int64)
    at, margin = surface.positions[ring], _near(surface)
    images = np.ones(len(ring))  # of every node in the planes
    for axis, place in planes:
        images *= np.where(np.abs(at[:, axis] - place) <= margin, 1.0, 2.0)
    return Lid(ring, whole, images / images.sum(), tuple(planes))


def _planes_between(gas: Gas, surface: SheetSurface, ends: tuple[int, int]) -> list[tuple[int, float]]:
    """Plane in which both ends of a part of a ring lie, or two planes normal to each other with one end each; else none."""
    at, margin = surface.positions[list(ends)], _near(surface)
    first, last = ([plane for plane in _planes(gas) if abs(end[plane[0]] - plane[1]) <= margin] for end in at)
    for plane in first:
        if plane in last:
            return [plane]
    return next(([a, b] for a in first for b in last if a[0] != b[0]), [])


def _planes(gas: Gas) -> list[tuple[int, float]]:
    """Axes and positions of the planes that close a chamber."""
    return [("xyz".index(plane.axis), plane.at) for plane in gas.closed_by if plane.axis is not None]


def _in_planes(gas: Gas, surface: SheetSurface, nodes: tuple[int, ...]) -> set[int]:
    """Axes of the planes in which all of some nodes lie."""
    at, margin = surface.positions[list(nodes)], _near(surface)
    return {axis for axis, place in _planes(gas) if np.all(np.abs(at[:, axis] - place) <= margin)}


def _near(surface: SheetSurface) -> float:
    """Distance from a plane below which a node lies in it, m."""
    return _NEAR * float(np.ptp(surface.positions, axis=0).max())


def _on_cuts(
    surface: SheetSurface, triangles: np.ndarray, facet: np.ndarray, free: Mapping[int, int]
) -> list[tuple[int, int]]:
    """Open edges that lie on an open edge of the facet across a cut at the start."""
    across, of_facet = set(surface.across_cuts), dict[int, list[tuple[int, int]]]()
    near = {number for pair in across for number in pair}
    for face, number in zip(triangles.tolist(), facet.tolist(), strict=True):
        if number in near:
            sides = zip(face, (*face[1:], face[0]), strict=True)
            of_facet.setdefault(number, []).extend((a, b) for a, b in sides if free.get(a) == b)
    found = list[tuple[int, int]]()
    for one, two in sorted(across):
        edges, others = of_facet.get(one, []), of_facet.get(two, [])
        if edges and others:
            ends, back = surface.positions[np.array(edges)], surface.positions[np.array(others)[:, ::-1]]
            apart = np.linalg.norm(ends[:, None] - back[None], axis=3).max(axis=2)
            found += [edges[row] for row in np.flatnonzero((apart <= _near(surface)).any(axis=1))]
    return found


def _check_cuts(gas: Gas, surface: SheetSurface, cuts: list[tuple[int, int]], path: str) -> None:
    """Check that no cut lies in the wall of a chamber, also under a lid; a cut may lie in a closing plane."""
    inside = [edge for edge in cuts if not _in_planes(gas, surface, edge)]
    if inside:
        more = f" and {count(len(inside) - 1, 'other edge')}" if len(inside) > 1 else ""
        text = f"the chamber is open at the cut {_ends(surface, inside[0])}{more}; a cut does not hold gas"
        ways = "give it the letter of a crease or of a flat line, or leave its facets out of `at`"
        raise CaseError(Fault(f"{path}.at", f"{text}: {ways}"))


def _ends(surface: SheetSurface, edge: tuple[int, int]) -> str:
    """Both ends of an edge, for messages."""
    return shown_points(surface.positions[list(edge)], between=" to ")


def _check_closed(gas: Gas, surface: SheetSurface, free: dict[int, int], path: str) -> None:
    """Check that every open edge lies in a plane that supports hold it in."""
    for edge in free.items():
        axes = _in_planes(gas, surface, edge)
        where = _ends(surface, edge)
        if not axes:
            text = f"the chamber is open at the edge {where} and {len(free) - 1} others"
            ways = 'add facets, or close it by `closed_by`: { axis = "z", at = 0 } for a plane of symmetry'
            raise CaseError(Fault(f"{path}.at", f"{text}; {ways}"))
        if not all(axes & set(surface.held.get(node, ())) for node in edge):
            text = f"the edge {where} lies in the plane but may leave it; hold it along {'xyz'[min(axes)]} by a support"
            raise CaseError(Fault(f"{path}.closed_by", text))
