"""Lines on a sheet and points inside its facets, as sums of the vectors of its mesh or of the vertices of its pattern.

A line is a side of a facet between two vertices, or a named edge of the sheet. It runs around its facets
counter-clockwise; a side that is named in the other sense runs from its first vertex to its second.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from fsm.builders.patterns.mesh_places import mesh_place
from fsm.builders.patterns.of_sheet import place_of
from fsm.case.models.facet_mesh import FacetMesh, MeshPoint, line_mean
from fsm.case.pattern_files.pattern import Pattern, triangles_of_face
from fsm.interactions.triangles.cubic import cubic_shapes

_SIDE = re.compile(r"vertices\s+(\d+)\s*,\s*(\d+)")
_FACET = re.compile(r"facet\s+(\d+)")
_ON_LINE = 1e-9
"""Relative distance beyond the ends of a side up to which a place counts as the end."""
_FLAT, _CURVED = 1e-6, 1e-2
"""Distance from a flat and from a curved facet, relative to the sheet, up to which a place is on the facet."""


def is_line(at: object) -> bool:
    """Whether a place is a line: a named edge or two vertices."""
    return isinstance(at, str) and (at.strip().startswith("edge ") or _SIDE.fullmatch(at.strip()) is not None)


def facet_number(at: object) -> int | None:
    """Number from 0 of the facet that a place names; None for other places."""
    match = _FACET.fullmatch(at.strip()) if isinstance(at, str) else None
    return int(match[1]) - 1 if match else None


class SheetLine(NamedTuple):
    """Line on a sheet.

    Attributes
    ----------
    name : str
    lengths : length of each of its parts, m
    facets : facet of each part, from 0
    part : point of a part by its number and the place in it, from 0 to 1
    backwards : whether it is named against its direction
    """

    name: str
    lengths: tuple[float, ...]
    facets: tuple[int, ...]
    part: Callable[[int, float], MeshPoint]
    backwards: bool

    def frame(self) -> MeshPoint:
        """Mean of the line: see `line_mean`."""
        places, shares = np.polynomial.legendre.leggauss(3)  # exact for the products of a line and a cubic
        ends, half = np.cumsum([0.0, *self.lengths]), 0.5 * sum(self.lengths)
        parts = [
            (self.part(k, 0.5 + 0.5 * x), ends[k] + length * (0.5 + 0.5 * x) - half, 0.5 * share * length)
            for k, length in enumerate(self.lengths)
            for x, share in zip(places.tolist(), shares.tolist(), strict=True)
        ]
        return self._turned(line_mean(parts))

    def point(self, distance: float) -> MeshPoint:
        """Point at a distance in m from the first vertex.

        Raises
        ------
        ValueError
            The point is beyond the end.
        """
        whole = sum(self.lengths)
        if not -_ON_LINE * whole <= distance <= (1.0 + _ON_LINE) * whole:
            raise ValueError(f"{distance:g} m is beyond the side between {self.name}; give 0 to {whole:g} m")
        along = whole - distance if self.backwards else distance
        ends = np.cumsum([0.0, *self.lengths])
        k = int(np.clip(np.searchsorted(ends, along, side="right") - 1, 0, len(self.lengths) - 1))
        return self._turned(self.part(k, float(np.clip((along - ends[k]) / self.lengths[k], 0.0, 1.0))))

    def _turned(self, point: MeshPoint) -> MeshPoint:
        return point._replace(along=-point.along, across=-point.across) if self.backwards else point


def line_of_mesh(mesh: FacetMesh, at: str) -> SheetLine:
    """Named edge or side on the mesh of flexible facets; a side on a crease belongs to the first of its two facets.

    Raises
    ------
    ValueError
        There is no such line.
    """
    place, backwards = mesh_place(mesh, at), False
    if len(place.edges):
        ends = mesh.owner[mesh.ends(place.edges)].tolist()
        edges = place.edges[_in_order(ends, at)]
    else:
        first, last = mesh.owner[place.sectors].tolist()
        found = _side(mesh, first, last)
        if found is None:
            found, backwards = _side(mesh, last, first), True
        if found is None:
            raise ValueError(f"no facet has a side between {at}; give the two ends of one side")
        edges = found
    lengths = tuple(mesh.lengths[edges[:, 0], edges[:, 1]].tolist())
    facets = tuple(mesh.facet[edges[:, 0]].tolist())
    return SheetLine(at.strip(), lengths, facets, lambda k, x: mesh.edge_point(edges[k], x), backwards)


def _side(mesh: FacetMesh, first: int, last: int) -> np.ndarray | None:
    """Edges (k, 2) of triangles along the side from one node to another of the first facet with this side; None without."""
    corners = set(mesh.owner[mesh.vertices].tolist())
    nodes = mesh.owner[mesh.triangles]
    shared = np.intersect1d(mesh.facet[(nodes == first).any(axis=1)], mesh.facet[(nodes == last).any(axis=1)])
    for facet in shared.tolist():
        rows = np.flatnonzero(mesh.facet == facet)
        sides = {
            (int(nodes[row, k]), int(nodes[row, (k + 1) % 3])): (row, k) for row in rows.tolist() for k in range(3)
        }
        border = {a: (b, edge) for (a, b), edge in sides.items() if (b, a) not in sides}
        at, found = first, list[tuple[int, int]]()
        while at in border and len(found) < len(border):
            at, edge = border[at]
            found.append(edge)
            if at in corners:
                break
        if at == last:
            return np.array(found, dtype=np.int64)
    return None


def line_of_pattern(pattern: Pattern, at: str) -> SheetLine:
    """Named edge or side of a pattern; a side on a crease belongs to the first of its two facets.

    Raises
    ------
    ValueError
        There is no such line.
    """
    vertices, backwards = place_of(pattern, at).vertices, False
    left, right = pattern.edge_faces.T
    if at.strip().startswith("edge "):
        rows = np.flatnonzero(np.isin(pattern.edges, vertices).all(axis=1) & (pattern.edge_faces < 0).any(axis=1))
    else:
        rows = np.flatnonzero(np.isin(pattern.edges, vertices).all(axis=1)) if len(vertices) == 2 else np.zeros(0, dtype=int)
        if not len(rows):
            raise ValueError(f"no facet has a side between {at}; give the two ends of one side")
    sides = list[tuple[int, int, int]]()
    for row in rows.tolist():
        face = min(face for face in (int(left[row]), int(right[row])) if face >= 0)
        a, b = pattern.edges[row].tolist()
        sides.append((face, a, b) if left[row] == face else (face, b, a))
    if at.strip().startswith("edge "):
        sides = [sides[k] for k in _in_order([[a, b] for _, a, b in sides], at)]
    else:
        backwards = sides[0][1] != vertices[0]
    points = pattern.vertices
    lengths = tuple(float(np.linalg.norm(points[b] - points[a])) for _, a, b in sides)
    facets = tuple(face for face, _, _ in sides)

    def part(k: int, x: float) -> MeshPoint:
        face, a, b = sides[k]
        corners = pattern.faces[face]
        return _in_triangle(points, (a, b, corners[(corners.index(b) + 1) % len(corners)]), np.array([1.0 - x, x, 0.0]))

    return SheetLine(at.strip(), lengths, facets, part, backwards)


def _in_triangle(points: np.ndarray, corners: tuple[int, int, int], at: np.ndarray) -> MeshPoint:
    """Point of a triangle with area coordinates `at` (3,), with the first axis along its first side."""
    way, out = points[list(corners[1:])] - points[corners[0]]
    length = float(np.linalg.norm(way))
    part = float(out @ way) / length**2
    height = float(np.linalg.norm(out - part * way))
    along, across = np.array([-1.0, 1.0, 0.0]) / length, np.array([part - 1.0, -part, 1.0]) / height
    return MeshPoint(np.array(corners), at, along, across)


def _in_order(ends: list[list[int]], at: str) -> list[int]:
    """Numbers of parts with given first and last points, in the order in which they follow each other.

    Raises
    ------
    ValueError
        They are not one open line.
    """
    following = {first: k for k, (first, _) in enumerate(ends)}
    starts = following.keys() - {last for _, last in ends}
    found = list[int]()
    if len(starts) == 1:
        at_point = starts.pop()
        while at_point in following:
            found.append(following[at_point])
            at_point = ends[found[-1]][1]
    if len(found) != len(ends):
        raise ValueError(f'{at} is not one open line; name one side by its ends, for example "vertices 3, 4"')
    return found


def point_of_mesh(mesh: FacetMesh, facet: int, place: np.ndarray, near: bool = False) -> MeshPoint:
    """Point of a flexible facet nearest to a place (3,) in m at the start, with axes along those of the facet.

    Raises
    ------
    ValueError
        There is no such facet, or the place is off it; with `near`, the place may be off it.
    """
    rows = np.flatnonzero(mesh.facet == facet)
    if not len(rows):
        raise ValueError(f"there is no facet {facet + 1}; the sheet has {int(mesh.facet.max()) + 1} facets, numbered from 1")
    found = [_nearest(mesh.positions[mesh.triangles[row]], place) for row in rows.tolist()]
    best = int(np.argmin([distance for _, distance in found]))
    at, distance = found[best]
    _check_on(facet, distance, place, np.ptp(mesh.positions, axis=0).max() * (_CURVED if mesh.curved else _FLAT), near)
    row = rows[[best]]
    weights, slopes = cubic_shapes(mesh.plane[row], mesh.angle[row], at[None])
    vectors = [v for s in mesh.triangles[row[0]].tolist() for v in (3 * int(mesh.owner[s]), 3 * s + 1, 3 * s + 2)]
    return MeshPoint(np.array(vectors), weights[0, 0], slopes[0, 0, 0], slopes[0, 0, 1])


def point_of_pattern(pattern: Pattern, facet: int, place: np.ndarray, near: bool = False) -> MeshPoint:
    """Point of a face nearest to a place, as `point_of_mesh`; its axes are those of the nearest triangle of the face."""
    if not 0 <= facet < len(pattern.faces):
        raise ValueError(f"there is no facet {facet + 1}; the sheet has {len(pattern.faces)} facets, numbered from 1")
    pieces, _ = triangles_of_face(pattern.vertices, pattern.faces[facet], pattern.normals()[facet])
    triangles = [(a, b, c) for a, b, c in pieces]
    found = [_nearest(pattern.vertices[list(triangle)], place) for triangle in triangles]
    best = int(np.argmin([distance for _, distance in found]))
    at, distance = found[best]
    _check_on(facet, distance, place, _FLAT * pattern.extent(), near)
    return _in_triangle(pattern.vertices, triangles[best], at)


def _check_on(facet: int, distance: float, place: Iterable[float], most: float, near: bool) -> None:
    if distance > most and not near:
        shown = ", ".join(f"{x:g}" for x in place)
        raise ValueError(f"({shown}) m is {distance:.3g} m off facet {facet + 1} at the start; give a point of this facet")


def _nearest(corners: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, float]:
    """Area coordinates (3,) of the point of a triangle (3, 3) nearest to a place, and its distance."""
    one, two = corners[1] - corners[0], corners[2] - corners[0]
    pair = np.stack([one, two], axis=1)
    x, y = np.linalg.lstsq(pair, place - corners[0], rcond=None)[0].tolist()
    candidates = [np.array([1.0 - x - y, x, y])]
    if min(candidates[0]) < 0.0:
        candidates = []
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            part = float(np.clip((place - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0))
            at = np.zeros(3)
            at[k], at[(k + 1) % 3] = 1.0 - part, part
            candidates.append(at)
    distances = [float(np.linalg.norm(at @ corners - place)) for at in candidates]
    best = int(np.argmin(distances))
    return candidates[best], distances[best]
