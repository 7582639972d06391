"""Cuts of a sheet: each side of a cut has its own vertices and edges.

Files and the keys of a case describe a cut by one edge between two facets. The pattern of a sheet has open cuts: a cut is
two edges of one facet each, like the outline. A vertex on a cut becomes one vertex for each group of facets that creases,
bend lines and flat edges join around the vertex. The end of a cut inside of the sheet remains one vertex, because its facets
are joined around it. All later code therefore treats both sides of a cut as parts of the outline.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fsm.case.pattern_files.pattern import Pattern


def open_cuts(pattern: Pattern) -> Pattern:
    """Pattern with open cuts; a pattern in which no cut lies between two facets is returned as it is.

    The side with the first facet keeps the number of a vertex. The vertices of other sides follow after all vertices of the
    pattern, in the order of these vertices and of their first facets. A cut of one edge whose ends are both inside of the
    sheet gets a vertex in the middle of each side; these vertices come last. The first facet of a cut keeps the number of
    the edge, and other edges follow after all edges.
    """
    faces = pattern.edge_faces
    between = (faces >= 0).all(axis=1)
    cut = between & np.array([letter in "BC" for letter in pattern.assignment], dtype=bool)
    if not cut.any():
        return pattern
    number, added = _split_corners(pattern, np.unique(pattern.edges[cut]), np.flatnonzero(between & ~cut))
    corners = [[number.get((face, v), v) for v in old] for face, old in enumerate(pattern.faces)]

    def ends(face: int, edge: int) -> tuple[int, int]:
        u, v = pattern.edges[edge].tolist()
        return number.get((face, u), u), number.get((face, v), v)

    edges = [ends(max(side) if min(side) < 0 else side[0], edge) for edge, side in enumerate(faces.tolist())]
    uncut, middles, more = [*range(len(pattern.vertices)), *added], list[int](), list[tuple[int, int]]()
    for edge in np.flatnonzero(cut).tolist():
        (u, v), (left, right) = edges[edge], faces[edge].tolist()
        if ends(right, edge) != (u, v):
            more.append(ends(right, edge)[::-1])
            continue
        one, other = len(uncut), len(uncut) + 1
        uncut += 2 * [len(pattern.vertices) + len(middles)]  # no vertex of the uncut sheet
        middles.append(edge)
        corners[left].insert(corners[left].index(u) + 1, one)
        corners[right].insert(corners[right].index(v) + 1, other)
        edges[edge] = u, one
        more += [(one, v), (v, other), (other, u)]
    letters = ["C" if is_cut else letter for is_cut, letter in zip(cut, pattern.assignment, strict=True)]

    def placed(points: np.ndarray) -> np.ndarray:
        return np.concatenate([points, points[pattern.edges[middles]].mean(axis=1)])[uncut]

    return replace(
        pattern, vertices=placed(pattern.vertices), flat=None if pattern.flat is None else placed(pattern.flat),
        edges=np.array(edges + more, dtype=np.int64), assignment=(*letters, *len(more) * ("C",)),
        target=np.concatenate([np.where(cut, 0.0, pattern.target), np.zeros(len(more))]),
        faces=tuple(map(tuple, corners)), uncut=tuple(uncut),
        groups={name: tuple(np.flatnonzero(np.isin(uncut, group)).tolist()) for name, group in pattern.groups.items()},
    )  # fmt: skip


def _split_corners(
    pattern: Pattern, on_cuts: np.ndarray, joints: np.ndarray
) -> tuple[dict[tuple[int, int], int], list[int]]:
    """New numbers of vertices by facet and old number, and the old numbers of all added vertices.

    Parameters
    ----------
    pattern : Pattern
    on_cuts : vertices on cuts
    joints : edges that join two facets
    """
    split = set(on_cuts.tolist())
    above = {(face, v): (face, v) for face, corners in enumerate(pattern.faces) for v in corners if v in split}

    def top(corner: tuple[int, int]) -> tuple[int, int]:
        while above[corner] != corner:
            above[corner] = above[above[corner]]
            corner = above[corner]
        return corner

    for edge in joints.tolist():
        left, right = pattern.edge_faces[edge].tolist()
        for v in split.intersection(pattern.edges[edge].tolist()):
            one, other = sorted((top((left, v)), top((right, v))))
            above[other] = one  # the top of each group is its first facet
    groups = sorted({(v, face) for face, v in map(top, above)})
    new, added, kept = dict[tuple[int, int], int](), list[int](), set[int]()
    for v, face in groups:
        new[face, v] = v if v not in kept else len(pattern.vertices) + len(added)
        added += [v] if v in kept else []
        kept.add(v)
    return {corner: new[top(corner)] for corner in above}, added


def sides_of_cuts(pattern: Pattern) -> list[tuple[int, ...]]:
    """Vertices at one place on a cut, for all such places, in order; numbers from 0."""
    found: dict[int, list[int]] = {}
    for vertex, before in enumerate(pattern.uncut):
        found.setdefault(before, []).append(vertex)
    return [tuple(vertices) for vertices in found.values() if len(vertices) > 1]


def facets_across_cuts(pattern: Pattern) -> tuple[tuple[int, int], ...]:
    """Pairs of facets with different vertices at one place on a cut, which touch there in the flat sheet; sorted."""
    sides = sides_of_cuts(pattern)
    around: dict[int, set[int]] = {v: set() for vertices in sides for v in vertices}
    for face, corners in enumerate(pattern.faces):
        for v in around.keys() & set(corners):
            around[v].add(face)
    found = {
        (min(one, other), max(one, other))
        for vertices in sides for k, v in enumerate(vertices) for w in vertices[:k]
        for one in around[v] for other in around[w]
    }  # fmt: skip
    return tuple(sorted(found))
