"""Vertices and edges of the lines of a pattern: near points are one vertex, and lines are divided where they meet."""

from __future__ import annotations

import itertools
import math

import numpy as np

from fsm.case.models.sheet import MOST_FACETS
from fsm.case.pattern_files.crossings import crossings, points_on_lines
from fsm.case.pattern_files.pattern import ASSIGNMENTS, RANK, TOLERANCE, Line, PatternFault, counted, others
from fsm.text.shown_units import shown

SAME = 1e-9
"""Distance relative to the size up to which points coincide by round-off."""
_MOST_TRIED = 5_000
"""Largest number of lines for which several distances of points are tried."""
_MOST_PIECES = 20 * MOST_FACETS
"""Largest number of vertices on all lines."""

Edges = dict[tuple[int, int], tuple[str, float]]
"""Letter and fold angle of each pair of vertices."""


def tolerances(ends: np.ndarray, size: float, drawn: bool) -> list[float]:
    """Distances below which points are one vertex, in the order in which they are tried.

    Lines that are drawn: 0.1 % of the size, then twice and four times as much, then less. Vertices with numbers: round-off,
    then five units of the last digit of the coordinates, then up to 0.1 % of the size. All distances are below 0.3 of the
    length of short lines (the fifth percentile), and separate the vertices (`_separates`). Large patterns have one distance.
    """
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    most = 0.3 * float(np.percentile(lengths[lengths > SAME * size], 5.0))
    if drawn:
        base = min(TOLERANCE * size, most)
        tried = [base, min(2.0 * base, most), min(4.0 * base, most), base / 4.0, base / 16.0, base / 256.0]
    else:
        tried = [SAME * size, *sorted((5.0 * last_digit(ends), 1e-6 * size, 1e-5 * size, 1e-4 * size, TOLERANCE * size))]
        tried = [near for near in tried if near <= min(most, TOLERANCE * size)]
    kept = [near for near in dict.fromkeys(tried) if near == SAME * size or _separates(ends, near)]
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


def merged(
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
    straight, before = np.array(points)[numbers[kept]], len(points)
    different = np.sort(np.unique(np.sort(numbers[kept], axis=1), axis=0, return_index=True)[1])
    for crossing in crossings(straight[different], numbers[kept][different], near):
        vertex(crossing)
    crossed = points[before:]
    if crossed and not split:
        x, y = crossed[0]
        text = f"edges cross at ({x:g}, {y:g}), where no vertex is{others(len(crossed))}; add a vertex there"
        raise PatternFault(text, np.array(crossed) * scale)
    places = np.array(points)
    found = _Edges(places, scale)
    line, on_line, off = points_on_lines(places, straight, near)
    if len(line) > _MOST_PIECES:
        raise ValueError(f"the lines of the pattern have more than {_MOST_PIECES:,} pieces; draw no line several times")
    chains = np.split(on_line, np.flatnonzero(np.diff(line)) + 1)
    for k, chain in zip(kept.tolist(), chains, strict=True):
        found.add(chain.tolist(), lines[k])
    notes = found.notes()
    most = max(float(moved.max()), float(off.max()))
    if most > 1e-6 * float(np.ptp(places, axis=0).max()):
        text = f"points up to {shown(scale * most, 'm')} apart are one vertex"
        notes.append(f"{text}; the limit is sheet.merge = {shown(scale * near, 'm')}")
    return places, found.edges, notes


class _Edges:
    """Edges of a pattern, with what is given twice."""

    def __init__(self, places: np.ndarray, scale: float) -> None:
        self.places, self.scale = places, scale
        self.edges: Edges = {}
        self.twice: dict[tuple[str, str], list[tuple[int, int]]] = {}

    def add(self, chain: list[int], line: Line) -> None:
        """Add the edges between successive vertices of a line."""
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
                f"the crease {self._at(opposite[0])} is a mountain and a valley{others(len(opposite))}; remove one of them"
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


def without_loose(edges: Edges) -> tuple[Edges, list[tuple[int, int]]]:
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
