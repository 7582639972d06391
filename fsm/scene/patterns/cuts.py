"""Cuts of a sheet: each side of a cut has its own vertices and edges.

Files and the keys of a case describe a cut by one edge between two facets. The pattern of a sheet has open cuts: a cut is
two edges of one facet each, like the outline. A vertex on a cut becomes one vertex for each group of facets that creases,
bend lines and flat edges join around the vertex. The end of a cut inside of the sheet remains one vertex, because its facets
are joined around it. All later code therefore treats both sides of a cut as parts of the outline.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fsm.scene.patterns.pattern import Pattern

__all__ = ["facets_across_cuts", "open_cuts", "sides_of_cuts"]


def open_cuts(pattern: Pattern) -> Pattern:
    """Pattern with open cuts; a pattern in which no cut lies between two facets is returned as it is.

    The side with the first facet keeps the number of a vertex. The vertices of other sides follow after all vertices of the
    pattern, in the order of these vertices and of their first facets. The first facet of a cut keeps the number of the
    edge, and the edges of second facets follow after all edges.
    """
    faces = pattern.edge_faces
    between = (faces >= 0).all(axis=1)
    cut = between & np.array([letter in "BC" for letter in pattern.assignment], dtype=bool)
    if not cut.any():
        return pattern
    number, added = _split_corners(pattern, np.unique(pattern.edges[cut]), np.flatnonzero(between & ~cut))
    uncut = np.concatenate([np.arange(len(pattern.vertices)), added])

    def own(face: int, vertex: int) -> int:
        return number.get((face, vertex), vertex)

    first = np.where(faces[:, 0] >= 0, faces[:, 0], faces[:, 1]).tolist()
    edges = [(own(face, u), own(face, v)) for face, (u, v) in zip(first, pattern.edges.tolist(), strict=True)]
    edges += [
        (own(face, v), own(face, u))
        for face, (u, v) in zip(faces[cut, 1].tolist(), pattern.edges[cut].tolist(), strict=True)
    ]
    letters = ["C" if is_cut else letter for is_cut, letter in zip(cut, pattern.assignment, strict=True)]
    more = len(edges) - len(letters)
    return replace(
        pattern, vertices=pattern.vertices[uncut], flat=None if pattern.flat is None else pattern.flat[uncut],
        edges=np.array(edges, dtype=np.int64), assignment=(*letters, *more * ("C",)),
        target=np.concatenate([np.where(cut, 0.0, pattern.target), np.zeros(more)]),
        faces=tuple(tuple(own(face, v) for v in corners) for face, corners in enumerate(pattern.faces)),
        groups={name: tuple(np.flatnonzero(np.isin(uncut, group)).tolist()) for name, group in pattern.groups.items()},
        uncut=tuple(uncut.tolist()),
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
    """Vertices at one place on a cut, for all such places; numbers from 0."""
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
