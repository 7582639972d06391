"""Travel at which a folded sheet is taut: the shortest way over the sheet, from a support to a drive, is straight there.

No fold makes two points of a sheet further apart than the shortest way between them on the sheet. Ways have corners at a few
points of each edge of the facets, so they are at most a few parts in a thousand too long.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from fsm.builders.patterns.of_sheet import pattern_of, place_of
from fsm.case.models.case import Case
from fsm.case.models.loads import Drive
from fsm.case.models.sheet_parts import SheetSupport
from fsm.case.pattern_files.pattern import Pattern
from fsm.case.plan.step_items import drives_of

_FOLDED = 1e-3
"""Travel relative to the extent of the sheet, below which the sheet is in line with the drive at the start."""
_POINTS, _MOST = 10_000, 10
"""Largest number of points inside all edges together, and inside one edge, where ways may have corners."""
_PLATES = "plate", "tape-spring", "lenticular", "cylinder"
_AXES = "xyz"


def taut_travels(case: Case) -> list[tuple[Drive, float]]:
    """Drives of a folded sheet with the travels (m) at which it is taut.

    Drives without a support along their direction, and sheets that are in line with the drive at the start, are left out.
    With several steps, where supports and drives change, the list is empty.
    """
    sheet = case.sheet
    if sheet is None or case.step or sheet.kind in _PLATES:
        return []
    pattern, found = pattern_of(sheet).with_bend_lines(), list[tuple[Drive, float]]()
    net = _Net(pattern)
    for drive in drives_of(case):
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        if at is None or drive.turn is not None:
            continue
        way = np.array(drive.direction) / np.linalg.norm(drive.direction)
        held = {vertex for support in sheet.support for vertex in _held(pattern, support, way)}
        driven = set(_vertices(pattern, at))
        if not held or not driven or held & driven:
            continue
        first, last = net.of_vertices(held), net.of_vertices(driven)
        along = net.points @ way
        travel = float(np.min(net.shortest_ways(first, along[first])[last] - along[last]))
        if np.isfinite(travel) and travel > _FOLDED * pattern.extent():
            found.append((drive, travel))
    return found


def _held(pattern: Pattern, support: SheetSupport, way: np.ndarray) -> tuple[int, ...]:
    """Vertices that a support holds along a direction."""
    fixed = support.fixed if support.mirror is None else (support.mirror,)
    if any(abs(way[_AXES.index(axis)]) > 0.0 for axis in _AXES if axis not in fixed):
        return ()
    return _vertices(pattern, support.at)


def _vertices(pattern: Pattern, at: str | tuple[tuple[float, float, float], tuple[float, float, float]]) -> tuple[int, ...]:
    place = place_of(pattern, at)
    return place.vertices if place.facet is None else pattern.faces[place.facet]


class _Net:
    """Points on the edges of a sheet of triangles, and straight lines between those of one triangle.

    Attributes
    ----------
    points : (n, 3) array, m; first the vertices, then the points inside each edge
    """

    def __init__(self, pattern: Pattern) -> None:
        self._pattern = pattern
        self._inside = min(max(_POINTS // max(len(pattern.edges), 1), 0), _MOST)
        parts = np.linspace(0.0, 1.0, self._inside + 2)[1:-1]
        ends = pattern.vertices[pattern.edges]
        inner = ends[:, None, 0] + parts[None, :, None] * (ends[:, None, 1] - ends[:, None, 0])
        self.points = np.concatenate([pattern.vertices, inner.reshape(-1, 3)])

    def _on_edges(self, edges: np.ndarray) -> np.ndarray:
        """Numbers of the points inside edges (n, number of points in each)."""
        return np.asarray(len(self._pattern.vertices) + self._inside * edges[:, None] + np.arange(self._inside))

    def of_vertices(self, vertices: set[int]) -> np.ndarray:
        """Numbers of some vertices, and of the points inside the edges between two of them."""
        chosen = np.array(sorted(vertices))
        between = np.flatnonzero(np.isin(self._pattern.edges, chosen).all(axis=1))
        return np.concatenate([chosen, self._on_edges(between).ravel()])

    def shortest_ways(self, starts: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        """Lengths of the shortest ways from some points to all points (n,), m; `offsets` (n_starts,) are added to them."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import dijkstra

        pattern, points = self._pattern, self.points
        count, edges, links = len(pattern.vertices), np.sort(pattern.edges, axis=1), [pattern.edges]
        order = np.argsort(edges @ [count, 1])
        known = (edges @ [count, 1])[order]
        for corners in sorted({len(face) for face in pattern.faces}):
            faces = np.array([face for face in pattern.faces if len(face) == corners])
            sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
            inner = self._on_edges(order[np.searchsorted(known, np.sort(sides, axis=1) @ [count, 1])])
            on = np.concatenate([sides, inner], axis=1).reshape(len(faces), corners, -1)
            for one, two in combinations(range(corners), 2):
                both = np.broadcast_arrays(on[:, one, :, None], on[:, two, None, :])
                links.append(np.stack(both, axis=-1).reshape(-1, 2))
        low, high = np.sort(np.concatenate(links), axis=1).T
        keys = np.sort((low * len(points) + high)[low != high])  # rows would be compared far more slowly
        keys = keys[np.append(True, keys[1:] != keys[:-1])]  # `np.unique` takes ten times as long
        pairs = np.stack(np.divmod(keys, len(points)), axis=1)
        lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        origin, least = len(points), offsets.min() - pattern.extent()  # one more point, at a distance that is not zero
        pairs = np.concatenate([pairs, np.stack([np.full_like(starts, origin), starts], axis=1)])
        lengths = np.concatenate([lengths, offsets - least])
        graph = coo_array((lengths, pairs.T), shape=(origin + 1, origin + 1)).tocsr()
        return np.asarray(dijkstra(graph, directed=False, indices=origin))[:-1] + least
