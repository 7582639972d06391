"""Flat crease pattern from lines: vertices at their ends and crossings, and faces between them."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fsm.scene.patterns.holes import area, joining_lines, loops
from fsm.scene.patterns.pattern import ASSIGNMENTS, Pattern, edge_groups
from fsm.scene.patterns.reading import PatternFault, Reading
from fsm.scene.sheet import MOST_FACETS
from fsm.shown_units import shown, shown_points

__all__ = ["Line", "RANK", "TOLERANCE", "check_size", "counted", "last_digit", "planar_pattern", "unit_targets"]

TOLERANCE = 1e-3
"""Distance relative to the size of the pattern below which points are one vertex."""
RANK = "BCMVUFJ"
"""Letters in the order in which they replace each other where lines coincide."""
_SIZES = 1e-6, 1e4
"""Smallest and largest size of a pattern, m."""
_SAME = 1e-9
"""Distance relative to the size up to which points coincide by round-off."""
_MOST_TRIED = 5_000
"""Largest number of lines for which several distances of points are tried."""
_MOST_PIECES = 20 * MOST_FACETS
"""Largest number of vertices on all lines."""
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


def planar_pattern(
    lines: list[Line], scale: float, split: bool = True, reading: Reading | None = None, notes: Sequence[str] = ()
) -> Pattern:
    """Pattern of lines in the plane.

    Without `reading.merge`, points are one vertex up to a distance that follows from the file (`_tolerances`); if the
    pattern is faulty with this distance, some smaller and larger ones are tried.

    Parameters
    ----------
    lines : list of Line
    scale : length of one unit of the lines, m
    split : bool
        Whether lines are split where they cross; if false, crossing lines are an error, and points are one vertex only if
        the digits of the coordinates do not distinguish them.
    reading : choices of the section [sheet]
    notes : notes of the file, in front of those of the pattern

    Raises
    ------
    PatternFault
        The pattern has a crease of zero length, lines that cross or contradict each other, a line that ends inside of a
        facet, or separate parts.
    ValueError
        The pattern is empty, or too large.
    """
    reading = Reading() if reading is None else reading
    if not lines:
        raise ValueError("the pattern has no lines; draw the outline and the creases")
    ends = np.array([(line.first, line.last) for line in lines], dtype=float)
    if not np.isfinite(ends).all():
        raise ValueError("a coordinate of the pattern is not a finite number; correct the coordinate")
    with np.errstate(over="ignore"):
        size = float(np.ptp(ends.reshape(-1, 2), axis=0).max())
        if size:
            check_size(size * scale)
    nothing = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) <= _SAME * size
    if nothing.all():
        raise ValueError("all lines of the pattern have zero length; correct the coordinates or the scale")
    letters = [line.letter for line in lines]
    for k in np.flatnonzero(nothing):
        if letters[k] in "MVU" and not split:
            x, y = ends[k, 0]
            text = f"the {ASSIGNMENTS[letters[k]]} crease at ({x:g}, {y:g}) has zero length; remove it"
            raise PatternFault(text, ends[k, :1] * scale).among(ends * scale, letters)
    first: PatternFault | None = None
    for near in _tolerances(ends, size, split) if reading.merge is None else (reading.merge / scale,):
        try:
            pattern = _with_tolerance(lines, ends, scale, max(near, _SAME * size), split, reading.part)
            return replace(pattern, notes=(*notes, *pattern.notes))
        except PatternFault as fault:
            first = first or fault
            if isinstance(fault, _Parts):
                first = fault
                break
    assert first is not None
    raise first.among(ends * scale, letters)


def _tolerances(ends: np.ndarray, size: float, drawn: bool) -> list[float]:
    """Distances below which points are one vertex, in the order in which they are tried.

    Lines that are drawn: 0.1 % of the size, then twice and four times as much, then less. Vertices with numbers: round-off,
    then five units of the last digit of the coordinates, then up to 0.1 % of the size. All distances are below 0.3 of the
    length of short lines (the fifth percentile), and separate the vertices (`_separates`). Large patterns have one distance.
    """
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    most = 0.3 * float(np.percentile(lengths[lengths > _SAME * size], 5.0))
    if drawn:
        base = min(TOLERANCE * size, most)
        tried = [base, min(2.0 * base, most), min(4.0 * base, most), base / 4.0, base / 16.0, base / 256.0]
    else:
        tried = [_SAME * size, *sorted((5.0 * last_digit(ends), 1e-6 * size, 1e-5 * size, 1e-4 * size, TOLERANCE * size))]
        tried = [near for near in tried if near <= min(most, TOLERANCE * size)]
    kept = [near for near in dict.fromkeys(tried) if near == _SAME * size or _separates(ends, near)]
    kept = kept or [min(tried, default=most)]
    return kept if len(ends) <= _MOST_TRIED else kept[:1]


def _separates(ends: np.ndarray, near: float) -> bool:
    """Whether a distance separates vertices: points that are nearer to each other form groups, and no group is longer than
    twice the distance.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    points = 0.25 * near * np.unique(np.round(ends.reshape(-1, 2) / (0.25 * near)), axis=0)
    pairs = KDTree(points).query_pairs(near, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(points),) * 2)
    label = connected_components(graph, directed=False)[1]
    order = np.argsort(label, kind="stable")
    first = np.flatnonzero(np.diff(label[order], prepend=-1))
    grouped = points[order]
    sides = np.maximum.reduceat(grouped, first) - np.minimum.reduceat(grouped, first)
    return bool(np.hypot(*sides.T).max() <= 2.0 * near)


def last_digit(coordinates: np.ndarray) -> float:
    """Unit of the last decimal digit of any coordinate, for example 1e-5 of 0.74396."""
    texts = (repr(float(x)) for x in np.unique(coordinates.ravel()))
    return 10.0 ** -max(
        0 if "e+" in t else int(t.partition("e-")[2] or 0) + len(t.partition("e")[0].partition(".")[2]) for t in texts
    )


def _with_tolerance(
    lines: list[Line], ends: np.ndarray, scale: float, near: float, split: bool, part: int | None
) -> Pattern:
    points, edges, notes = _split(lines, ends, near, split, scale)
    edges, ignored = _without_loose(edges)
    if ignored:
        first = shown_points([scale * points[ignored[0][0]]])
        notes.append(f"{counted(len(ignored), 'flat crease or bend line', 'flat creases and bend lines')} bound no facet "
                     f"and are ignored, the first at {first}")  # fmt: skip
    joined, holes = joining_lines(points, {pair: letter for pair, (letter, _) in edges.items()}, near)
    edges |= dict.fromkeys(joined, ("F", 0.0))
    if joined:
        text = counted(holes, "hole or end of a cut", "holes and ends of cuts")
        notes.append(
            f"{counted(len(joined), 'flat line', 'flat lines')} added between the outline and {text} inside of facets"
        )
    _check_ends(points * scale, edges)
    try:
        pattern = _with_faces(points * scale, edges)
        if part is not None and part > 1:
            raise PatternFault(f"sheet.part = {part}, but the pattern is one part; remove sheet.part")
    except _Parts as fault:
        if part is None or part > len(fault.parts):
            raise
        sides = {(min(u, v), max(u, v)) for f in fault.parts[part - 1] for u, v in zip(f, [*f[1:], f[0]], strict=True)}
        edges = {pair: found for pair, found in edges.items() if pair in sides}
        pattern = _with_faces(points * scale, edges)
        notes.append(f"part {part} of {len(fault.parts)} is the sheet (sheet.part)")
    outside = len(edges) - len(pattern.edges)
    if outside and split:
        notes.append(f"{counted(outside, 'line or part of a line', 'lines or parts of lines')} outside of all facets "
                     "are ignored")  # fmt: skip
    return replace(pattern, notes=(*notes, *pattern.notes))


Edges = dict[tuple[int, int], tuple[str, float]]
"""Letter and fold angle of each pair of vertices."""


def counted(number: int, one: str, many: str) -> str:
    """Number with its noun."""
    return f"{number:,} {one if number == 1 else many}"


def _split(
    lines: list[Line], ends: np.ndarray, near: float, split: bool, scale: float
) -> tuple[np.ndarray, Edges, list[str]]:
    """Vertices (n, 2), the letter and fold angle of each edge, with lines split at vertices and crossings, and notes."""
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

    numbers = np.array([(vertex(pair[0]), vertex(pair[1])) for pair in ends])
    moved = np.linalg.norm(np.array(points)[numbers] - ends, axis=2)
    kept = np.flatnonzero(numbers[:, 0] != numbers[:, 1])
    if not len(kept):
        raise PatternFault(
            "no line of the pattern is longer than sheet.merge; give a smaller sheet.merge", ends[:1, 0] * scale
        )
    straight = np.array(points)[numbers[kept]]
    before = len(points)
    for crossing in _crossings(straight, near):
        vertex(crossing)
    crossed = points[before:]
    if crossed and not split:
        x, y = crossed[0]
        text = f"edges cross at ({x:g}, {y:g}), where no vertex is{_others(len(crossed))}; add a vertex there"
        raise PatternFault(text, np.array(crossed) * scale)
    places = np.array(points)
    orders = [np.argsort(places[:, axis], kind="stable") for axis in (0, 1)]
    sorted_by = [places[order, axis] for axis, order in enumerate(orders)]
    found = _Edges(places, scale)
    bent = 0.0
    for k, (start, end) in zip(kept.tolist(), straight, strict=True):
        along = end - start
        length = float(np.hypot(*along))
        slices = []
        for axis in (0, 1):
            first, last = sorted((float(start[axis]), float(end[axis])))
            bounds = np.searchsorted(sorted_by[axis], (first - 2.0 * near, np.nextafter(last + 2.0 * near, math.inf)))
            slices.append((int(bounds[1] - bounds[0]), axis, bounds))
        _, axis, bounds = min(slices, key=lambda option: option[:2])
        around = orders[axis][bounds[0] : bounds[1]]
        low, high = np.minimum(start, end) - 2.0 * near, np.maximum(start, end) + 2.0 * near
        beside = places[around, 1 - axis]
        around = np.sort(around[(beside >= low[1 - axis]) & (beside <= high[1 - axis])])
        apart = places[around] - start
        distance = apart @ along / length
        off = np.abs(apart @ np.array([-along[1], along[0]])) / length
        on = np.flatnonzero((off <= near) & (distance >= -near) & (distance <= length + near))
        bent = max(bent, float(off[on].max()))
        found.add(around[on[np.argsort(distance[on], kind="stable")]].tolist(), lines[k])
    notes = found.notes()
    most = max(float(moved.max()), bent)
    if most > 1e-6 * float(np.ptp(places, axis=0).max()):
        text = f"points up to {shown(scale * most, 'm')} apart are one vertex"
        notes.append(f"{text}; the limit is sheet.merge = {shown(scale * near, 'm')}")
    return places, found.edges, notes


def _others(count: int) -> str:
    """Text on further places of a fault."""
    return f" ({counted(count - 1, 'other place', 'other places')} too)" if count > 1 else ""


class _Edges:
    """Edges of a pattern, with what is given twice."""

    def __init__(self, places: np.ndarray, scale: float) -> None:
        self.places, self.scale = places, scale
        self.edges: Edges = {}
        self.twice: dict[tuple[str, str], list[tuple[int, int]]] = {}
        self.pieces = 0

    def add(self, chain: list[int], line: Line) -> None:
        """Add the edges between successive vertices of a line."""
        self.pieces += len(chain)
        if self.pieces > _MOST_PIECES:
            raise ValueError(f"the lines of the pattern have more than {_MOST_PIECES:,} pieces; draw no line several times")
        for u, v in itertools.pairwise(chain):
            pair = min(u, v), max(u, v)
            old = self.edges.get(pair)
            used = line.letter, line.target
            if old is not None:
                used = min(used, old, key=lambda found: RANK.index(found[0]))
                used = old if used[0] == old[0] else used
                if old[0] != line.letter or not _equal(old[1], line.target):
                    other = line.letter if used[0] == old[0] else old[0]
                    self.twice.setdefault((used[0], other), []).append(pair)
            self.edges[pair] = used

    def notes(self) -> list[str]:
        """Notes on edges that are given twice; an error for mountains that are also valleys."""
        opposite = self.twice.get(("M", "V"), []) + self.twice.get(("V", "M"), [])
        if opposite:
            text = (
                f"the crease {self._at(opposite[0])} is a mountain and a valley{_others(len(opposite))}; remove one of them"
            )
            raise PatternFault(text, self.scale * self.places[np.array(opposite)].mean(axis=1))
        found = []
        for (used, other), pairs in self.twice.items():
            if {used, other} == {"B", "C"}:
                continue
            what = f"as {ASSIGNMENTS[used]} and as {ASSIGNMENTS[other]}; {ASSIGNMENTS[used]} is used"
            if used == other:
                what = f"as {ASSIGNMENTS[used]} with two fold angles; the first is used"
            verb = "is" if len(pairs) == 1 else "are"
            where = self._at(pairs[0]) if len(pairs) == 1 else f"the first {self._at(pairs[0])}"
            found.append(f"{counted(len(pairs), 'edge', 'edges')} ({where}) {verb} given twice, {what}")
        return found

    def _at(self, pair: tuple[int, int]) -> str:
        (x, y), (x2, y2) = self.places[pair[0]], self.places[pair[1]]
        return f"from ({x:g}, {y:g}) to ({x2:g}, {y2:g})"


def _equal(one: float, other: float) -> bool:
    """Whether two fold angles (rad) are equal, or both absent."""
    return abs(one - other) < 1e-6 if math.isfinite(one) and math.isfinite(other) else math.isnan(one) == math.isnan(other)


def _without_loose(edges: Edges) -> tuple[Edges, list[tuple[int, int]]]:
    """Edges without flat creases and bend lines that cannot bound a facet, and these: chains with a free end, and groups
    that touch other lines at one vertex or at none.
    """
    around: dict[int, set[tuple[int, int]]] = {}
    for pair in edges:
        for v in pair:
            around.setdefault(v, set()).add(pair)
    plain = {pair for pair, (letter, _) in edges.items() if letter in "FJ"}
    waiting = [v for v, pairs in around.items() if len(pairs) == 1]
    loose: dict[tuple[int, int], None] = {}
    while waiting:
        v = waiting.pop()
        for pair in [*around[v]] if len(around[v]) == 1 else ():
            if pair in plain:
                loose[pair] = None
                for end in pair:
                    around[end].discard(pair)
                waiting.append(pair[0] + pair[1] - v)
    # groups of plain lines that touch other lines at one vertex or at none
    seen = set(loose)
    for first in [pair for pair in edges if pair in plain]:
        if first in seen:
            continue
        group, stack, touched = {first: None}, [first], set[int]()
        while stack:
            for v in stack.pop():
                for pair in sorted(around[v]):
                    if pair not in plain:
                        touched.add(v)
                    elif pair not in group:
                        group[pair] = None
                        stack.append(pair)
        seen |= set(group)
        if len(touched) < 2:
            loose |= group
    return {pair: found for pair, found in edges.items() if pair not in loose}, list(loose)


def _check_ends(flat: np.ndarray, edges: Edges) -> None:
    """Raise a PatternFault if lines end inside of a facet."""
    degree: dict[int, int] = {}
    for pair in edges:
        for v in pair:
            degree[v] = degree.get(v, 0) + 1
    if min(degree.values()) > 1:
        return
    bad = sorted({v for loop, area in loops(flat, edges) if area > 0.0 for v in loop if degree[v] == 1})
    if bad:
        x, y = flat[bad[0]]
        text = f"a line ends inside of a facet near ({x:g}, {y:g}) m{_others(len(bad))}"
        raise PatternFault(f"{text}; continue it to another line, or remove it", flat[bad])


def _crossings(ends: np.ndarray, near: float) -> list[np.ndarray]:
    """Points at which two lines cross."""
    found: list[np.ndarray] = []
    low_x = ends[:, :, 0].min(axis=1) - 2.0 * near
    order = np.argsort(low_x, kind="stable")
    start, along = ends[order, 0], np.diff(ends[order], axis=1)[:, 0]
    length = np.linalg.norm(along, axis=1)
    last = np.searchsorted(low_x[order], ends[order, :, 0].max(axis=1) + 2.0 * near, "right")
    low_y, high_y = ends[order, :, 1].min(axis=1) - 2.0 * near, ends[order, :, 1].max(axis=1) + 2.0 * near
    for k in range(len(ends) - 1):
        after = slice(k + 1, int(last[k]))
        others = k + 1 + np.flatnonzero((low_y[after] <= high_y[k]) & (high_y[after] >= low_y[k]))
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


def _with_faces(flat: np.ndarray, edges: Edges) -> Pattern:
    """Pattern with the faces that the edges enclose."""
    faces = [loop for loop, area in loops(flat, edges) if area > 0.0]
    if not faces:
        raise PatternFault("the lines of the pattern enclose no facet; close the outline", _free_ends(flat, edges))
    for face in faces:
        if len(set(face)) < len(face):
            place = next(v for v, count in Counter(face).items() if count > 1)
            x, y = flat[place]
            raise PatternFault(
                f"a facet touches itself at ({x:g}, {y:g}) m; separate its corners there, or join them by a line",
                flat[[place]],
            )
    faces, cut_off = _joined(faces, edges, flat)
    used = np.unique(np.concatenate(faces))  # the outline without the ends of lines that extend beyond it
    number = {int(v): k for k, v in enumerate(used)}
    faces = [[number[v] for v in face] for face in faces]
    edges = {(number[u], number[v]): found for (u, v), found in edges.items() if u in number and v in number}
    flat = flat[used]
    pattern = Pattern.of_faces(np.column_stack([flat, np.zeros(len(flat))]), faces, flat, edge_groups(flat, faces))
    found = [edges[min(u, v), max(u, v)] for u, v in pattern.edges.tolist()]
    letters = ["B" if old == "B" else "C" if letter == "B" else letter
               for old, (letter, _) in zip(pattern.assignment, found, strict=True)]  # fmt: skip
    targets = [0.0 if letter in "BCJ" else target for letter, (_, target) in zip(letters, found, strict=True)]
    notes: tuple[str, ...] = ()
    if cut_off:
        text = counted(len(cut_off), "area without creases is", "areas without creases are")
        notes = (f"{text} cut off from the sheet and left out, the first around {shown_points(cut_off[:1])}",)
    return replace(pattern.assigned(letters, targets), notes=notes)


def _joined(faces: list[list[int]], edges: Edges, flat: np.ndarray) -> tuple[list[list[int]], list[np.ndarray]]:
    """Facets that creases join, and the middles of areas beside the outline that are left out. Other areas that boundaries
    and cuts enclose are holes.

    Raises
    ------
    _Parts
        Creases do not join all facets.
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
        both = Counter((min(pair), max(pair)) for face in faces for pair in zip(face, [*face[1:], face[0]], strict=True))
        left_out = [faces[part[0]] for part in parts.values() if part is not sheets[0]]
        outer = [
            face for face in left_out
            if any(both[min(pair), max(pair)] == 1 for pair in zip(face, [*face[1:], face[0]], strict=True))
        ]  # fmt: skip
        return [faces[number] for number in sheets[0]], [flat[face].mean(axis=0) for face in outer]
    raise _Parts(flat, [[faces[number] for number in part] for part in sheets or parts.values()])


class _Parts(PatternFault):
    """Separate parts of a pattern, from the largest; `parts` has the faces of each part."""

    def __init__(self, flat: np.ndarray, parts: list[list[list[int]]]) -> None:
        areas = [sum(area(flat[face]) for face in part) for part in parts]
        order = sorted(range(len(parts)), key=lambda k: (-float(f"{areas[k]:.9e}"), *flat[parts[k][0][0]]))
        self.parts = [parts[k] for k in order]
        middles = [flat[np.unique(np.concatenate(part))].mean(axis=0) for part in self.parts]
        listed = [
            f"{number} with {counted(len(part), 'facet', 'facets')} around {shown_points([middle])}"
            for number, (part, middle) in enumerate(zip(self.parts, middles, strict=True), 1)
        ]
        more = f" and {len(listed) - 4} more" if len(listed) > 4 else ""
        text = f"the pattern has {len(parts)} separate parts: {', '.join(listed[:4])}{more}"
        super().__init__(
            f"{text}; choose one by its number, for example sheet.part = 1", middles, [str(k + 1) for k in range(len(parts))]
        )


def _free_ends(flat: np.ndarray, edges: Edges) -> np.ndarray:
    """Positions of vertices with one line only."""
    vertices, counts = np.unique(np.array(list(edges)).ravel(), return_counts=True)
    return flat[vertices[counts == 1]]
