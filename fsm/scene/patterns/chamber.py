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

from fsm.errors import CaseError, Fault
from fsm.scene.gas import Gas
from fsm.scene.patterns.places import facets_named

__all__ = ["Chamber", "SheetSurface", "chamber_of"]

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
    """

    positions: np.ndarray
    triangles: np.ndarray
    facet: np.ndarray
    held: Mapping[int, Collection[int]]
    groups: Mapping[str, tuple[int, ...]]
    vertices: np.ndarray


@dataclass(frozen=True, eq=False)
class Chamber:
    """Chamber of a gas.

    Attributes
    ----------
    gas : Gas
    facets : numbers of its facets
    axes : axes a of the sum for the volume
    origin : (3,) array, m
    caps : rings of nodes of the lids, ordered counter-clockwise around the normal of the lid
    sign : 1, or -1 if the normals of the facets point into the chamber
    volume : m^3
        At the start, with straight edges.
    area : m^2
    """

    gas: Gas
    facets: tuple[int, ...]
    axes: tuple[int, ...]
    origin: np.ndarray
    caps: tuple[np.ndarray, ...]
    sign: float
    volume: float
    area: float


def chamber_of(gas: Gas, surface: SheetSurface, path: str) -> Chamber:
    """Chamber of a gas, with its closing planes and lids.

    Raises
    ------
    CaseError
        The chamber is open, its planes do not give its volume, or it has no volume for the gas at the start.
    """
    try:
        facets = facets_named(gas.at, int(surface.facet.max()) + 1)
    except ValueError as error:
        raise CaseError(Fault(f"{path}.at", str(error))) from None
    triangles = surface.triangles[np.isin(surface.facet, facets)]
    axes, origin = _field(gas, path)
    free = _open_edges(triangles)
    caps = tuple(_ring(gas, number, surface, free, path) for number, one in enumerate(gas.closed_by) if one.cap is not None)
    if caps and len(axes) < 3:
        text = "two planes normal to one axis and a lid do not go together; close the chamber by one kind"
        raise CaseError(Fault(f"{path}.closed_by", text))
    _check_closed(gas, surface, free, path)
    corners = surface.positions[triangles] - origin
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0
    volume = float((corners.mean(axis=1) * normals)[:, axes].sum()) / len(axes)
    for ring in caps:
        at = surface.positions[ring] - origin
        volume += float(at.mean(axis=0) @ np.cross(at, np.roll(at, -1, axis=0)).sum(axis=0)) / 6.0
    area = float(np.linalg.norm(normals, axis=1).sum())
    flat = abs(volume) <= _EMPTY * area**1.5
    if flat and gas.supply_pressure is None:
        text = "the chamber has no volume at the start, so its gas has no pressure; fold it, or give `supply_pressure`"
        raise CaseError(Fault(f"{path}.at", text))
    sign = -1.0 if volume < 0.0 and not flat else 1.0
    return Chamber(gas, facets, axes, origin, caps, sign, 0.0 if flat else abs(volume), area)


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


def _ring(gas: Gas, number: int, surface: SheetSurface, free: dict[int, int], path: str) -> np.ndarray:
    """Ring of a lid, ordered counter-clockwise around the normal of the lid; removes the edges of the ring from the open
    edges.
    """
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
    found = list[int]()
    here = next((node for node in nodes if node in free), None)
    while here is not None and here in free:
        found.append(here)
        here = free.pop(here)
    if len(found) < 3 or here != found[0]:
        raise CaseError(Fault(key, f"{cap} is not on a closed ring of open edges of the chamber, which a lid needs"))
    # the facets are on one side of the edges of the ring and the lid is on the other side
    return np.array(found[::-1], dtype=np.int64)


def _check_closed(gas: Gas, surface: SheetSurface, free: dict[int, int], path: str) -> None:
    """Check that every open edge lies in a plane that supports hold it in."""
    planes = [("xyz".index(plane.axis), plane.at) for plane in gas.closed_by if plane.axis is not None]
    margin = _NEAR * float(np.ptp(surface.positions, axis=0).max())
    for edge in free.items():
        ends = surface.positions[list(edge)]
        axes = {axis for axis, at in planes if np.all(np.abs(ends[:, axis] - at) <= margin)}
        where = " to ".join(f"({', '.join(f'{round(1e3 * x, 6) + 0.0:.4g}' for x in end)})" for end in ends)
        if not axes:
            text = f"the chamber is open at the edge {where} mm and {len(free) - 1} others"
            ways = 'add facets, or close it by `closed_by`: { axis = "z", at = 0 } for a plane of symmetry'
            raise CaseError(Fault(f"{path}.at", f"{text}; {ways}"))
        if not all(axes & set(surface.held.get(node, ())) for node in edge):
            text = f"the edge {where} mm lies in the plane but may leave it; hold it along {'xyz'[min(axes)]} by a support"
            raise CaseError(Fault(f"{path}.closed_by", text))
