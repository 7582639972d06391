"""Cuts of a sheet: each side of a cut has its own vertices and edges.

Files and the keys of a case describe a cut by one edge between two facets. The pattern of a sheet has open cuts: a cut is
two edges of one facet each, like the outline. A vertex on a cut becomes one vertex for each group of facets that creases,
bend lines and flat edges join around the vertex. The end of a cut inside of the sheet remains one vertex, because its facets
are joined around it. All later code therefore treats both sides of a cut as parts of the outline.

Frames, areas and moments of area of the facets of a pattern.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

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


class FacetFrames(NamedTuple):
    """Body axes of facets, along the principal axes of their area.

    Attributes
    ----------
    centre : (n, 3) array
        Centroids, m.
    axes : (n, 3, 3) array
        Body axes as columns; the third is the normal.
    area : (n,) array, m^2
    moments : (n, 2) array
        Second moments of area about the first and the second axis, m^4.
    outlines : corners of each facet in its body axes, (k, 2), m
    """

    centre: np.ndarray
    axes: np.ndarray
    area: np.ndarray
    moments: np.ndarray
    outlines: tuple[np.ndarray, ...]

    def local(self, facets: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Points (m, 3) in the body axes of facets (m,)."""
        return np.asarray(np.einsum("nji,nj->ni", self.axes[facets], points - self.centre[facets]))


_ROUND = 1e-5
"""Relative difference of both second moments below which all axes are principal; the first one is along a side then."""


def facet_frames(pattern: Pattern) -> FacetFrames:
    """Frames of all facets of a pattern at its start; facets with the same number of corners are computed together."""
    n, normals = len(pattern.faces), pattern.normals()
    centre, axes, area, moments = np.zeros((n, 3)), np.zeros((n, 3, 3)), np.zeros(n), np.zeros((n, 2))
    outlines: list[np.ndarray] = [np.zeros((0, 2))] * n
    for rows, faces in pattern.faces_by_size():
        points, normal = pattern.vertices[faces], normals[rows]  # (m, k, 3), (m, 3)
        origin = points.mean(axis=1)
        first = points[:, 1] - points[:, 0]
        first = first - np.einsum("mi,mi->m", first, normal)[:, None] * normal
        first /= np.linalg.norm(first, axis=1)[:, None]
        plane = np.stack([first, np.cross(normal, first)], axis=2)
        flat = (points - origin[:, None]) @ plane
        area[rows], centroid, tensor = _area_moments(flat)
        # second moments x x^T over the area: the larger value belongs to the direction of the longer side
        values, vectors = np.linalg.eigh(tensor)
        turned = vectors[:, :, ::-1].copy()
        turned[np.linalg.det(turned) < 0.0, :, 1] *= -1.0
        turned[values[:, 1] - values[:, 0] < _ROUND * values[:, 1]] = np.eye(2)
        centre[rows] = origin + np.einsum("mij,mj->mi", plane, centroid)
        axes[rows] = np.concatenate([plane @ turned, normal[:, :, None]], axis=2)
        # the moment about the first axis is the integral of the square of the second coordinate
        moments[rows] = values
        for row, outline in zip(rows.tolist(), (flat - centroid[:, None]) @ turned, strict=True):
            outlines[row] = outline
    return FacetFrames(centre, axes, area, moments, tuple(outlines))


def facet_areas(pattern: Pattern) -> np.ndarray:
    """Areas of all facets of a pattern, (n,), m^2."""
    return facet_frames(pattern).area


def _area_moments(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Areas (m,), centroids (m, 2), and integrals of x x^T about them (m, 2, 2), of polygons (m, k, 2) in counter-clockwise
    order.
    """
    following = np.roll(points, -1, axis=1)
    cross = points[:, :, 0] * following[:, :, 1] - points[:, :, 1] * following[:, :, 0]
    area = 0.5 * cross.sum(axis=1)
    both = points + following
    centroid = (cross[:, None] @ both)[:, 0] / (6.0 * area)[:, None]
    squares = [x[:, :, :, None] * x[:, :, None, :] for x in (points, following, both)]
    tensor = ((cross / 24.0)[:, :, None, None] * (squares[0] + squares[1] + squares[2])).sum(axis=1)
    return area, centroid, tensor - area[:, None, None] * centroid[:, :, None] * centroid[:, None, :]


def quaternions(matrices: np.ndarray) -> np.ndarray:
    """Unit quaternions (n, 4), scalar part first, of rotation matrices (n, 3, 3)."""
    m = matrices
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    # q q^T times 4: its largest diagonal entry gives the row that is well conditioned (Shepperd, 1978)
    outer = np.empty((len(m), 4, 4))
    outer[:, 0, 0] = 1.0 + trace
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        outer[:, i + 1, i + 1] = 1.0 + 2.0 * m[:, i, i] - trace
        outer[:, 0, i + 1] = outer[:, i + 1, 0] = m[:, k, j] - m[:, j, k]
        outer[:, j + 1, k + 1] = outer[:, k + 1, j + 1] = m[:, j, k] + m[:, k, j]
    best = np.argmax(np.einsum("nii->ni", outer), axis=1)
    rows = outer[np.arange(len(m)), best]
    return np.asarray(rows / np.linalg.norm(rows, axis=1)[:, None])
