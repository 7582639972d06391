"""Flat crease pattern from lines: vertices at their ends and crossings, and faces between them."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from fsm.scene.patterns.pattern import ASSIGNMENTS, Pattern, box_groups
from fsm.scene.sheet import MOST_FACETS

__all__ = ["Line", "TOLERANCE", "check_size", "planar_pattern", "unit_targets"]

TOLERANCE = 1e-3
"""Distance relative to the size of the pattern below which points are one vertex."""
_RANK = "BCMVUFJ"
"""Letters in the order in which they replace each other where lines coincide."""
_SIZES = 1e-6, 1e4
"""Smallest and largest size of a pattern, m."""
_MOST_CROSSINGS = 5 * MOST_FACETS
"""Largest number of crossings of lines; a crossing of several lines counts for each pair."""


class Line(NamedTuple):
    """Straight line of a pattern: ends (2,), letter, and fold angle in the folded state, rad (NaN: none)."""

    first: tuple[float, float]
    last: tuple[float, float]
    letter: str
    target: float


def unit_targets(letter: str, part: float = 1.0) -> float:
    """Fold angle of an assignment: a part of 180 degrees for mountains and valleys; NaN for unassigned creases."""
    return {"M": -math.pi * part, "V": math.pi * part, "U": math.nan}.get(letter, 0.0)


def check_size(size: float) -> None:
    """Raise a ValueError if the size of a pattern (m) is outside the range of sheets."""
    if not _SIZES[0] <= size <= _SIZES[1]:
        text = f"the pattern has a size of {size:.3g} m; it must be from {_SIZES[0]:g} to {_SIZES[1]:g} m"
        raise ValueError(f"{text}: correct the unit or the coordinates")


def planar_pattern(lines: list[Line], scale: float, split: bool = True, tolerance: float = TOLERANCE) -> Pattern:
    """Pattern of lines in the plane.

    Parameters
    ----------
    lines : list of Line
    scale : length of one unit of the lines, m
    split : bool
        Whether lines are split where they cross; if false, crossing lines are an error.
    tolerance : distance below which points are one vertex, relative to the size of the pattern

    Raises
    ------
    ValueError
        The pattern is empty, has a crease of zero length, lines that cross or contradict each other, a line that ends inside
        of a facet, or separate parts.
    """
    if not lines:
        raise ValueError("the pattern has no lines; draw the outline and the creases")
    ends = np.array([(line.first, line.last) for line in lines], dtype=float)
    if not np.isfinite(ends).all():
        raise ValueError("a coordinate of the pattern is not a finite number; correct the coordinate")
    with np.errstate(over="ignore"):
        size = float(np.ptp(ends.reshape(-1, 2), axis=0).max())
        if size:
            check_size(size * scale)
    near = tolerance * size
    short = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) <= near
    for k in np.flatnonzero(short):
        if lines[k].letter in "MVU" and not split:
            x, y = ends[k, 0]
            raise ValueError(f"the {ASSIGNMENTS[lines[k].letter]} crease at ({x:g}, {y:g}) has zero length; remove it")
    kept = [line for line, gone in zip(lines, short, strict=True) if not gone]
    if not kept:
        raise ValueError("all lines of the pattern have zero length; correct the coordinates or the scale")
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
    by_x = np.argsort(places[:, 0], kind="stable")
    sorted_x = places[by_x, 0]
    edges: dict[tuple[int, int], tuple[str, float]] = {}
    for line, (start, end) in zip(lines, ends, strict=True):
        along = end - start
        length = float(np.hypot(*along))
        low, high = (float(x) for x in sorted((start[0], end[0])))
        around = by_x[np.searchsorted(sorted_x, low - 2.0 * near) : np.searchsorted(sorted_x, high + 2.0 * near, "right")]
        apart = places[around] - start
        distance = apart @ along / length
        off = np.abs(apart @ np.array([-along[1], along[0]])) / length
        on = np.flatnonzero((off <= near) & (distance >= -near) & (distance <= length + near))
        chain = around[on[np.argsort(distance[on], kind="stable")]].tolist()
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
    low_x = ends[:, :, 0].min(axis=1) - 2.0 * near
    order = np.argsort(low_x, kind="stable")
    start, along = ends[order, 0], np.diff(ends[order], axis=1)[:, 0]
    length = np.linalg.norm(along, axis=1)
    last = np.searchsorted(low_x[order], ends[order, :, 0].max(axis=1) + 2.0 * near, "right")
    for k in range(len(ends) - 1):
        others = slice(k + 1, int(last[k]))
        other, apart = along[others], start[others] - start[k]
        cross = along[k, 0] * other[:, 1] - along[k, 1] * other[:, 0]
        parallel = np.abs(cross) <= 1e-9 * length[k] * length[others]
        safe = np.where(parallel, 1.0, cross)
        s = (apart[:, 0] * other[:, 1] - apart[:, 1] * other[:, 0]) / safe
        t = (apart[:, 0] * along[k, 1] - apart[:, 1] * along[k, 0]) / safe
        within = near / length[k], near / length[others]
        hit = ~parallel & (s >= -within[0]) & (s <= 1 + within[0]) & (t >= -within[1]) & (t <= 1 + within[1])
        # both lines end there
        hit &= ~(((s <= within[0]) | (s >= 1 - within[0])) & ((t <= within[1]) | (t >= 1 - within[1])))
        found += [start[k] + s[i] * along[k] for i in np.flatnonzero(hit)]
        if len(found) > _MOST_CROSSINGS:
            text = f"the lines of the pattern cross at more than {_MOST_CROSSINGS:,} places"
            raise ValueError(f"{text}; at most {MOST_FACETS:,} facets are allowed: give fewer lines")
    return found


def _with_faces(flat: np.ndarray, edges: dict[tuple[int, int], tuple[str, float]]) -> Pattern:
    """Pattern with the faces that the edges enclose."""
    around: dict[int, list[int]] = {}
    for u, v in edges:
        around.setdefault(u, []).append(v)
        around.setdefault(v, []).append(u)
    for v, others in around.items():
        others.sort(key=lambda u, v=v: math.atan2(flat[u, 1] - flat[v, 1], flat[u, 0] - flat[v, 0]))  # type: ignore[misc]
    if len(edges) - len(around) > MOST_FACETS:
        text = f"the lines of the pattern enclose about {len(edges) - len(around):,} facets"
        raise ValueError(f"{text}; at most {MOST_FACETS:,} are allowed")
    following = {(u, v): others[k - 1] for v, others in around.items() for k, u in enumerate(others)}
    left = {pair for u, v in edges for pair in ((u, v), (v, u))}
    faces: list[list[int]] = []
    for first in sorted(left):
        if first not in left:
            continue
        face, pair = [], first
        while pair in left:
            left.remove(pair)
            face.append(pair[0])
            pair = pair[1], following[pair]  # the next edge clockwise, so that the face is on the left
        if _area(flat[face]) > 0.0:
            faces.append(face)
    if not faces:
        raise ValueError("the lines of the pattern enclose no facet; close the outline")
    for face in faces:
        if len(set(face)) < len(face):
            x, y = flat[next(v for v in face if face.count(v) > 1)]
            raise ValueError(
                f"a line ends inside of a facet near ({x:g}, {y:g}) m; continue it to another line, or remove it"
            )
    faces = _joined(faces, edges, flat)
    used = np.unique(np.concatenate(faces))  # the outline without the ends of lines that extend beyond it
    number = {int(v): k for k, v in enumerate(used)}
    faces = [[number[v] for v in face] for face in faces]
    edges = {(number[u], number[v]): found for (u, v), found in edges.items() if u in number and v in number}
    flat = flat[used]
    pattern = Pattern.of_faces(np.column_stack([flat, np.zeros(len(flat))]), faces, flat, box_groups(flat))
    found = [edges[min(u, v), max(u, v)] for u, v in pattern.edges.tolist()]
    letters = ["B" if old == "B" else "C" if letter == "B" else letter
               for old, (letter, _) in zip(pattern.assignment, found, strict=True)]  # fmt: skip
    targets = [0.0 if letter in "BCJ" else target for letter, (_, target) in zip(letters, found, strict=True)]
    return pattern.assigned(letters, targets)


def _joined(
    faces: list[list[int]], edges: dict[tuple[int, int], tuple[str, float]], flat: np.ndarray
) -> list[list[int]]:
    """Facets that creases join. Other areas that boundaries and cuts enclose are holes; all other separate parts are
    errors.
    """
    owner: dict[tuple[int, int], int] = {}
    parent = list(range(len(faces)))
    beside: set[int] = set()

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    for number, face in enumerate(faces):
        for u, v in zip(face, [*face[1:], face[0]], strict=True):
            pair = min(u, v), max(u, v)
            if pair in owner:
                if edges[pair][0] in "BC":
                    beside |= {number, owner[pair]}
                else:
                    parent[root(number)] = root(owner[pair])
            owner.setdefault(pair, number)
    parts: dict[int, list[int]] = {}
    for number in range(len(faces)):
        parts.setdefault(root(number), []).append(number)
    sheets = [part for part in parts.values() if len(part) > 1 or part[0] not in beside]
    if len(sheets) == 1:
        return [faces[number] for number in sheets[0]]
    middles = [flat[faces[part[0]]].mean(axis=0) for part in sheets]
    for inner, (x, y) in enumerate(middles):
        outer = (part for number, part in enumerate(sheets) if number != inner)
        if any(_contains(flat[faces[number]], middles[inner]) for part in outer for number in part):
            text = f"a facet contains a closed line at ({x:g}, {y:g}) m that no line joins to its outline"
            raise ValueError(f"{text}; join both by a crease or a bend line")
    x, y = flat[faces[min(sheets or parts.values(), key=len)[0]]].mean(axis=0)
    count = len(sheets) or len(parts)
    text = f"the pattern has {count} separate parts, one of them at ({x:g}, {y:g}) m; give one connected sheet"
    raise ValueError(text)


def _contains(corners: np.ndarray, point: np.ndarray) -> bool:
    """Whether a point (2,) is inside of a polygon (k, 2)."""
    a, b = corners - point, np.roll(corners, -1, axis=0) - point
    crosses = (a[:, 1] > 0.0) != (b[:, 1] > 0.0)
    rise = np.where(crosses, b[:, 1] - a[:, 1], 1.0)
    return bool(np.count_nonzero(crosses & (a[:, 0] - a[:, 1] * (b[:, 0] - a[:, 0]) / rise > 0.0)) % 2)


def _area(points: np.ndarray) -> float:
    following = np.roll(points, -1, axis=0)
    return 0.5 * float(np.sum(points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]))
