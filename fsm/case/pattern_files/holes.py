"""Loops of edges in the plane, and flat lines that join holes and ends of cuts inside of facets to other lines.

A facet with a hole is divided by two flat lines at each hole, at its first and last vertex along x. Rigid facets remain
rigid across flat lines, and flexible facets bend across them as a plate.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from fsm.case.models.sheet import MOST_FACETS

_MOST_GROUPS = 1000
"""Largest number of groups of lines that do not touch each other."""

Pair = tuple[int, int]


def loops(flat: np.ndarray, edges: Iterable[Pair]) -> list[tuple[list[int], float]]:
    """Vertices and area of each loop of directed edges with its area on the left; the outside of lines has an area of zero
    or less.

    Raises
    ------
    ValueError
        The edges enclose too many facets.
    """
    pairs = list(edges)
    around: dict[int, list[int]] = {}
    for u, v in pairs:
        around.setdefault(u, []).append(v)
        around.setdefault(v, []).append(u)
    for v, others in around.items():
        others.sort(key=lambda u, v=v: math.atan2(flat[u, 1] - flat[v, 1], flat[u, 0] - flat[v, 0]))  # type: ignore[misc]
    if len(pairs) - len(around) > MOST_FACETS:
        text = f"the lines of the pattern enclose about {len(pairs) - len(around):,} facets"
        raise ValueError(f"{text}; at most {MOST_FACETS:,} are allowed")
    following = {(u, v): others[k - 1] for v, others in around.items() for k, u in enumerate(others)}
    left = {pair for u, v in pairs for pair in ((u, v), (v, u))}
    found = []
    for first in sorted(left):
        if first not in left:
            continue
        loop, pair = [], first
        while pair in left:
            left.remove(pair)
            loop.append(pair[0])
            pair = pair[1], following[pair]  # the next edge clockwise, so that the loop is on the left
        found.append((loop, area(flat[loop])))
    return found


def area(points: np.ndarray) -> float:
    """Area of a polygon (k, 2), positive if its points are counter-clockwise."""
    after = np.roll(points, -1, axis=0)
    return 0.5 * float(np.sum(points[:, 0] * after[:, 1] - points[:, 1] * after[:, 0]))


class _Group(NamedTuple):
    """Lines that touch each other: their vertices, and the face around them of another group (-1: none)."""

    vertices: np.ndarray
    around: int


def joining_lines(flat: np.ndarray, letters: Mapping[Pair, str], near: float) -> tuple[list[Pair], int]:
    """Pairs of vertices of flat lines that join holes, slits and ends of cuts inside of facets to other lines.

    Parameters
    ----------
    flat : (n, 2) positions
    letters : letter of each edge
    near : distance below which a line must not pass a vertex

    Returns
    -------
    pairs : vertices of each line
    count : number of holes, slits and ends of cuts

    Raises
    ------
    ValueError
        There are too many separate groups of lines.
    """
    degree = np.bincount(np.array(list(letters)).ravel(), minlength=len(flat))
    one_group = _parts(letters, len(flat))
    cut_ends = {v for pair, letter in letters.items() if letter in "BC" for v in pair if degree[v] == 1}
    if len(one_group) == 1 and not cut_ends:
        return [], 0
    traced = loops(flat, letters)
    faces = [loop for loop, size in traced if size > 0.0]
    inside = _Inside(flat, faces)
    groups = [_Group(vertices, inside.face_around(vertices)) for vertices in one_group]
    holes = _holes(faces, letters, groups)
    creases = {v for pair, letter in letters.items() if letter not in "BC" for v in pair if degree[v] == 1}
    beside: dict[int, list[int]] = {}
    for u, v in letters:
        beside.setdefault(u, []).append(v)
        beside.setdefault(v, []).append(u)
    found: list[Pair] = []
    count = 0
    for number, face in enumerate(faces):
        inner = [group for group in groups if group.around == number]
        inner = [] if number in holes else [g for g in inner if not creases & set(g.vertices.tolist())]
        own = np.unique(face)
        ends = [v for v in own.tolist() if v in cut_ends]
        if not inner and not ends:
            continue
        members = set(own.tolist()) | {int(v) for group in inner for v in group.vertices}
        lines = _Lines(flat, [pair for pair in letters if pair[0] in members and pair[1] in members], near)
        order = np.lexsort((flat[:, 1], flat[:, 0]))
        rank = np.empty(len(flat), dtype=np.int64)
        rank[order] = np.arange(len(flat))
        at = np.array(sorted(members))
        joined: set[int] = set()
        for group in sorted(inner, key=lambda g: int(rank[g.vertices].min())):
            first, last = group.vertices[np.argmin(rank[group.vertices])], group.vertices[np.argmax(rank[group.vertices])]
            for v, others in ((int(first), at[rank[at] < rank[first]]), (int(last), at[rank[at] > rank[last]])):
                found += lines.join(v, others)
                joined.add(v)
            ends += [v for v in group.vertices.tolist() if v in cut_ends]
            count += 1
        for v in ends:
            if v not in joined:
                found += lines.join(v, at[~np.isin(at, _chain(v, beside))])
                count += v in own
    return found, count


def _chain(end: int, beside: Mapping[int, list[int]]) -> list[int]:
    """Vertices of the line from a free end to the next vertex at which it branches, this one included."""
    chain = [end]
    while len(chain) == 1 or len(beside[chain[-1]]) == 2:
        further = [v for v in beside[chain[-1]] if v not in chain[-2:]]
        if not further:
            break
        chain.append(further[0])
    return chain


def _parts(edges: Iterable[Pair], count: int) -> list[np.ndarray]:
    """Vertices of each group of edges that touch each other."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs = np.array(list(edges))
    used = np.unique(pairs)
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    label = connected_components(graph, directed=False)[1][used]
    order = np.argsort(label, kind="stable")
    groups = np.split(used[order], np.flatnonzero(np.diff(label[order])) + 1)
    if len(groups) > _MOST_GROUPS:
        text = f"the lines of the pattern form {len(groups):,} groups that do not touch each other"
        raise ValueError(f"{text}; at most {_MOST_GROUPS:,} are allowed")
    return groups


class _Inside:
    """Search for the smallest face around some vertices."""

    def __init__(self, flat: np.ndarray, faces: list[list[int]]) -> None:
        self.flat, self.faces = flat, faces
        self.low = np.array([flat[face].min(axis=0) for face in faces]).reshape(-1, 2)
        self.high = np.array([flat[face].max(axis=0) for face in faces]).reshape(-1, 2)
        self.area = np.array([area(flat[face]) for face in faces])

    def face_around(self, vertices: np.ndarray) -> int:
        """Number of the face of other vertices that contains the first of the vertices; -1 for none."""
        point, own = self.flat[vertices[0]], set(vertices.tolist())
        around = np.flatnonzero(((self.low < point) & (point < self.high)).all(axis=1))
        for number in around[np.argsort(self.area[around], kind="stable")].tolist():
            face = self.faces[number]
            if face[0] not in own and _contains(self.flat[face], point):
                return number
        return -1


def _contains(corners: np.ndarray, point: np.ndarray) -> bool:
    """Whether a point (2,) is inside of a polygon (k, 2)."""
    a, b = corners - point, np.roll(corners, -1, axis=0) - point
    crosses = (a[:, 1] > 0.0) != (b[:, 1] > 0.0)
    rise = np.where(crosses, b[:, 1] - a[:, 1], 1.0)
    return bool(np.count_nonzero(crosses & (a[:, 0] - a[:, 1] * (b[:, 0] - a[:, 0]) / rise > 0.0)) % 2)


def _holes(faces: list[list[int]], letters: Mapping[Pair, str], groups: list[_Group]) -> set[int]:
    """Numbers of faces that are holes: boundaries and cuts enclose them, and a facet is around them."""
    group_of = {int(v): number for number, group in enumerate(groups) for v in group.vertices}
    sides = [list(zip(face, [*face[1:], face[0]], strict=True)) for face in faces]
    owner = {pair: number for number, own in enumerate(sides) for pair in own}
    closed = [all(letters[min(pair), max(pair)] in "BC" for pair in own) for own in sides]
    found: dict[int, bool] = {}

    def is_hole(number: int) -> bool:
        chain = [number]
        while chain[-1] not in found:  # from the inside to the outside
            around = groups[group_of[faces[chain[-1]][0]]].around
            if around < 0 or around in chain:
                break
            chain.append(around)
        for face in reversed(chain):
            if face not in found:
                around = groups[group_of[faces[face][0]]].around
                beside = any((v, u) in owner and owner[v, u] != face for u, v in sides[face])
                found[face] = closed[face] and (beside or (around >= 0 and not found.get(around, False)))
        return found[number]

    return {number for number in range(len(faces)) if is_hole(number)}


class _Lines:
    """Lines that a new line must not cross."""

    def __init__(self, flat: np.ndarray, pairs: list[Pair], near: float) -> None:
        self.flat, self.near = flat, near
        self.pairs, self.lines = set(pairs), np.array(pairs)

    def join(self, vertex: int, others: np.ndarray) -> list[Pair]:
        """New line from a vertex to the nearest of others that is visible from it."""
        distance = np.linalg.norm(self.flat[others] - self.flat[vertex], axis=1)
        for other in others[np.argsort(distance, kind="stable")].tolist():
            pair = min(vertex, other), max(vertex, other)
            if other != vertex and pair not in self.pairs and self._is_free(vertex, other):
                self.pairs.add(pair)
                self.lines = np.vstack([self.lines, pair])
                return [pair]
        return []

    def _is_free(self, first: int, last: int) -> bool:
        start, along = self.flat[first], self.flat[last] - self.flat[first]
        length = float(np.hypot(*along))
        if length <= self.near:
            return False
        a, b = self.flat[self.lines[:, 0]] - start, self.flat[self.lines[:, 1]] - start
        off_a, off_b = (along[0] * p[:, 1] - along[1] * p[:, 0] for p in (a, b))
        across = b - a
        side = across[:, 0] * -a[:, 1] - across[:, 1] * -a[:, 0]
        other = across[:, 0] * (along[1] - a[:, 1]) - across[:, 1] * (along[0] - a[:, 0])
        if np.any((off_a * off_b < 0.0) & (side * other < 0.0)):
            return False
        for end, off, points in ((self.lines[:, 0], off_a, a), (self.lines[:, 1], off_b, b)):
            within = (points @ along > 0.0) & (points @ along < length**2) & (np.abs(off) <= self.near * length)
            if np.any(within & (end != first) & (end != last)):
                return False
        return True
