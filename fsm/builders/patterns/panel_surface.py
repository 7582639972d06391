"""Closed surfaces of rigid panels around chambers of gas.

Panels have separate corners, because the springs of the joints let panels separate slightly. A chamber is bounded by its
panels, by a strip between the two sides of each joint, and by a polygon between the corners at each vertex. This surface is
closed at any positions of the panels. The gradient of its volume is therefore the exact force of a unit pressure: the area
of each flat panel along its normal, at its centroid, and a force in proportion to the area of the strips on both sides of
each joint.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fsm.case.models.chambers import Lid

Faces = Sequence[Sequence[int]]


def panel_triangles(faces: Faces) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (m, 3) of vertices that divide polygons, and the number (m,) of the polygon of each."""
    found = [(number, face[0], *pair) for number, face in enumerate(faces) for pair in pairwise(face[1:])]
    table = np.array(found, dtype=np.int64)
    return table[:, 1:], table[:, 0]


def sealed(faces: Faces, chosen: Collection[int], lids: Sequence[Lid]) -> tuple[np.ndarray, tuple[Lid, ...]]:
    """Closed surface of a chamber, without its lids and planes.

    Parameters
    ----------
    faces : vertices of every panel, counter-clockwise around its normal
        The corners of all panels have numbers in this order.
    chosen : numbers of the panels around the chamber
    lids : lids over rings of vertices

    Returns
    -------
    (m, 3) array
        Triangles of corners.
    tuple of Lid
        Lids over rings of corners. A vertex of two panels with an open edge has two of them. All corners have the same part
        in a tip: a vertex in a plane of symmetry has a corner on each side of it.
    """
    first = np.cumsum([0, *map(len, faces)])
    corner, left, after = dict[tuple[int, int], int](), dict[tuple[int, int], int](), dict[tuple[int, int], int]()
    found = list[tuple[int, int, int]]()
    for panel in chosen:
        face = list(faces[panel])
        corner |= {(vertex, panel): int(first[panel]) + k for k, vertex in enumerate(face)}
        left |= dict.fromkeys(zip(face, [*face[1:], face[0]], strict=True), panel)
        found += _polygon([corner[vertex, panel] for vertex in face])
    for (u, v), panel in left.items():
        other = left.get((v, u))
        if other is None:
            continue
        after[v, panel] = other  # the polygon at the vertex v continues on the panel across the edge that ends there
        if u < v:
            found += _polygon([corner[v, panel], corner[u, panel], corner[u, other], corner[v, other]])
    begins = set(corner) - {(vertex, panel) for (vertex, _), panel in after.items()}
    found += _around_vertices(corner, after, begins)
    covers = list[Lid]()
    for lid in lids:
        vertices, ring = lid.nodes.tolist(), list[int]()
        for a, b in lid.edges.tolist():
            u, v = vertices[a], vertices[b]
            ring += [corner[u, left[v, u]], corner[v, left[v, u]]]  # the edge (v, u) is that of the panel
        ring = [here for k, here in enumerate(ring) if here != ring[k - 1]]
        covers.append(replace(lid, nodes=np.array(ring, dtype=np.int64), weights=np.full(len(ring), 1.0 / len(ring))))
    return np.array(found, dtype=np.int64), tuple(covers)


def _around_vertices(
    corner: Mapping[tuple[int, int], int], after: Mapping[tuple[int, int], int], begins: Collection[tuple[int, int]]
) -> list[tuple[int, int, int]]:
    """Triangles between the corners at all vertices; open sequences of panels begin at `begins`."""
    left, found = dict(corner), list[tuple[int, int, int]]()
    for key in [*sorted(begins), *sorted(corner)]:
        vertex, panel = key
        ring = list[int]()
        while (vertex, panel) in left:
            ring.append(left.pop((vertex, panel)))
            panel = after.get((vertex, panel), -1)
        found += _polygon(ring)
    return found


def _polygon(corners: Sequence[int]) -> list[tuple[int, int, int]]:
    return [(corners[0], a, b) for a, b in pairwise(corners[1:])]
