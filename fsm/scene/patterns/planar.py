"""Flat crease pattern from lines: vertices at their ends and crossings, and faces between them."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from fsm.scene.patterns.pattern import ASSIGNMENTS, Pattern, box_groups

__all__ = ["Line", "TOLERANCE", "planar_pattern", "unit_targets"]

TOLERANCE = 1e-3
"""Distance relative to the size of the pattern below which points are one vertex."""
_RANK = "BCMVUFJ"
"""Letters in the order in which they replace each other where lines coincide."""


class Line(NamedTuple):
    """Straight line of a pattern: ends (2,), letter, and fold angle in the folded state, rad (NaN: none)."""

    first: tuple[float, float]
    last: tuple[float, float]
    letter: str
    target: float


def unit_targets(letter: str, part: float = 1.0) -> float:
    """Fold angle of an assignment: a part of 180 degrees for mountains and valleys; NaN for unassigned creases."""
    return {"M": -math.pi * part, "V": math.pi * part, "U": math.nan}.get(letter, 0.0)


def planar_pattern(lines: list[Line], scale: float, split: bool = True, tolerance: float = TOLERANCE) -> Pattern:
    """Pattern of lines in the plane.

    Parameters
    ----------
    lines : list of Line
    scale : length of one unit of the lines, m
    split : bool
        Whether lines are split where they cross; false: crossing lines are refused.
    tolerance : distance below which points are one vertex, relative to the size of the pattern

    Raises
    ------
    ValueError
        The pattern is empty, has a crease of zero length, lines that cross or contradict each other, a line that ends inside
        of a facet, or separate parts.
    """
    if not lines:
        raise ValueError("the pattern has no lines")
    ends = np.array([(line.first, line.last) for line in lines], dtype=float)
    if not np.isfinite(ends).all():
        raise ValueError("a coordinate of the pattern is not a finite number")
    size = float(np.ptp(ends.reshape(-1, 2), axis=0).max())
    near = tolerance * size
    short = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) <= near
    for k in np.flatnonzero(short):
        if lines[k].letter in "MVU" and not split:
            x, y = ends[k, 0]
            raise ValueError(f"the {ASSIGNMENTS[lines[k].letter]} crease at ({x:g}, {y:g}) has zero length; remove it")
    kept = [line for line, gone in zip(lines, short, strict=True) if not gone]
    if not kept:
        raise ValueError("all lines of the pattern have zero length")
    points, edges = _split(kept, ends[~short], near, split)
    return _with_faces(points * scale, edges)


def _split(
    lines: list[Line], ends: np.ndarray, near: float, split: bool
) -> tuple[np.ndarray, dict[tuple[int, int], tuple[str, float]]]:
    """Vertices (n, 2), and the letter and fold angle of each edge, with lines split at vertices and crossings."""
    points: list[np.ndarray] = []
    cells: dict[tuple[int, int], list[int]] = {}

    def vertex(point: np.ndarray) -> int:
        column, row = int(point[0] // near), int(point[1] // near)
        for i in (-1, 0, 1):
            for j in (-1, 0, 1):
                for number in cells.get((column + i, row + j), ()):
                    if float(np.hypot(*(points[number] - point))) <= near:
                        return number
        cells.setdefault((column, row), []).append(len(points))
        points.append(point)
        return len(points) - 1

    for pair in ends:
        vertex(pair[0])
        vertex(pair[1])
    for crossing in _crossings(ends, near):
        before = len(points)
        if vertex(crossing) == before and not split:
            x, y = crossing
            raise ValueError(f"edges cross at ({x:g}, {y:g}), where no vertex is; add a vertex there")
    places = np.array(points)
    edges: dict[tuple[int, int], tuple[str, float]] = {}
    for line, (start, end) in zip(lines, ends, strict=True):
        along = end - start
        length = float(np.hypot(*along))
        distance = (places - start) @ along / length
        off = np.abs((places - start) @ np.array([-along[1], along[0]])) / length
        on = np.flatnonzero((off <= near) & (distance >= -near) & (distance <= length + near))
        chain = on[np.argsort(distance[on])].tolist()
        for u, v in itertools.pairwise(chain):
            _add(edges, (min(u, v), max(u, v)), line, places)
    return places, edges


def _add(
    edges: dict[tuple[int, int], tuple[str, float]], pair: tuple[int, int], line: Line, places: np.ndarray
) -> None:
    old = edges.get(pair)
    if old is not None and {old[0], line.letter} == {"M", "V"}:
        (x, y), (x2, y2) = places[pair[0]], places[pair[1]]
        where = f"from ({x:g}, {y:g}) to ({x2:g}, {y2:g})"
        raise ValueError(f"the crease {where} is a mountain and a valley; remove one of them")
    if old is None or _RANK.index(line.letter) < _RANK.index(old[0]):
        edges[pair] = line.letter, line.target


def _crossings(ends: np.ndarray, near: float) -> list[np.ndarray]:
    """Points at which two lines cross."""
    found: list[np.ndarray] = []
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    for k in range(len(ends) - 1):
        other, apart = along[k + 1 :], start[k + 1 :] - start[k]
        cross = along[k, 0] * other[:, 1] - along[k, 1] * other[:, 0]
        parallel = np.abs(cross) <= 1e-9 * length[k] * length[k + 1 :]
        safe = np.where(parallel, 1.0, cross)
        s = (apart[:, 0] * other[:, 1] - apart[:, 1] * other[:, 0]) / safe
        t = (apart[:, 0] * along[k, 1] - apart[:, 1] * along[k, 0]) / safe
        within = near / length[k], near / length[k + 1 :]
        hit = ~parallel & (s >= -within[0]) & (s <= 1 + within[0]) & (t >= -within[1]) & (t <= 1 + within[1])
        found += [start[k] + s[i] * along[k] for i in np.flatnonzero(hit)]
    return found


def _with_faces(flat: np.ndarray, edges: dict[tuple[int, int], tuple[str, float]]) -> Pattern:
    """Pattern with the faces that the edges enclose."""
    around: dict[int, list[int]] = {}
    for u, v in edges:
        around.setdefault(u, []).append(v)
        around.setdefault(v, []).append(u)
    for v, others in around.items():
        others.sort(key=lambda u, v=v: math.atan2(flat[u, 1] - flat[v, 1], flat[u, 0] - flat[v, 0]))  # type: ignore[misc]
    left = {pair for u, v in edges for pair in ((u, v), (v, u))}
    faces: list[list[int]] = []
    while left:
        first = min(left)
        face, pair = [], first
        while pair in left:
            left.remove(pair)
            face.append(pair[0])
            others = around[pair[1]]
            pair = pair[1], others[others.index(pair[0]) - 1]  # the next edge clockwise, so that the face is on the left
        if _area(flat[face]) > 0.0:
            faces.append(face)
    if not faces:
        raise ValueError("the lines of the pattern enclose no facet")
    for face in faces:
        twice = [v for v in face if face.count(v) > 1]
        if twice:
            x, y = flat[twice[0]]
            raise ValueError(
                f"a line ends inside of a facet near ({x:g}, {y:g}) m; continue it to another line, or remove it"
            )
    _check_joined(faces, edges, flat)
    pattern = Pattern.of_faces(np.column_stack([flat, np.zeros(len(flat))]), faces, flat, box_groups(flat))
    found = [edges[min(u, v), max(u, v)] for u, v in pattern.edges.tolist()]
    letters = ["B" if old == "B" else "C" if letter == "B" else letter
               for old, (letter, _) in zip(pattern.assignment, found, strict=True)]  # fmt: skip
    targets = [0.0 if letter in "BCJ" else target for letter, (_, target) in zip(letters, found, strict=True)]
    return pattern.assigned(letters, targets)


def _check_joined(faces: list[list[int]], edges: dict[tuple[int, int], tuple[str, float]], flat: np.ndarray) -> None:
    """Raise a ValueError if facets have no common crease with the others."""
    owner: dict[tuple[int, int], int] = {}
    parent = list(range(len(faces)))

    def root(k: int) -> int:
        while parent[k] != k:
            k = parent[k]
        return k

    for number, face in enumerate(faces):
        for u, v in zip(face, [*face[1:], face[0]], strict=True):
            pair = min(u, v), max(u, v)
            if pair in owner and edges[pair][0] not in "BC":
                parent[root(number)] = root(owner[pair])
            owner.setdefault(pair, number)
    parts = {root(k) for k in range(len(faces))}
    if len(parts) > 1:
        smallest = min(parts, key=lambda part: sum(root(k) == part for k in range(len(faces))))
        x, y = flat[faces[smallest]].mean(axis=0)
        text = f"the pattern has {len(parts)} separate parts, one of them at ({x:g}, {y:g}) m; give one connected sheet"
        raise ValueError(text)


def _area(points: np.ndarray) -> float:
    following = np.roll(points, -1, axis=0)
    return 0.5 * float(np.sum(points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]))
