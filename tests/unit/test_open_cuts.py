"""Vertices and edges of both sides of cuts."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from fsm.builders.patterns.cuts import facets_across_cuts, open_cuts, sides_of_cuts
from fsm.builders.patterns.generators import miura
from fsm.builders.patterns.of_sheet import place_of
from fsm.case.pattern_files.fold_file import read_fold
from fsm.case.pattern_files.pattern import Line, Pattern
from fsm.case.pattern_files.planar import planar_pattern


def grid(columns: int, rows: int, letters: dict[tuple[tuple[int, int], tuple[int, int]], str]) -> Pattern:
    """Sheet of unit squares, with open cuts; lines inside are flat except for the given ones (ends in units)."""
    lines = []
    for x in range(columns + 1):
        for y in range(rows + 1):
            for end in ((x + 1, y), (x, y + 1)):
                if end[0] <= columns and end[1] <= rows:
                    outer = (x == end[0] and x in (0, columns)) or (y == end[1] and y in (0, rows))
                    letter = "B" if outer else letters.get(((x, y), end), "F")
                    lines.append(Line((x, y), end, letter, 0.0))
    return open_cuts(planar_pattern(lines, 1.0))


def copies(pattern: Pattern) -> dict[tuple[float, float], int]:
    """Number of vertices at each place that has more than one."""
    assert pattern.flat is not None
    places, counts = np.unique(pattern.flat, axis=0, return_counts=True)
    return {(float(x), float(y)): int(n) for (x, y), n in zip(places, counts, strict=True) if n > 1}


def row(y: int, *columns: int) -> dict[tuple[tuple[int, int], tuple[int, int]], str]:
    """Cuts along a row of edges."""
    return {((x, y), (x + 1, y)): "C" for x in columns}


def column(x: int, *rows: int) -> dict[tuple[tuple[int, int], tuple[int, int]], str]:
    return {((x, y), (x, y + 1)): "C" for y in rows}


@pytest.mark.parametrize(
    ("cuts", "expected"),
    [
        (row(1, 1), {(1.5, 1): 2}),  # one edge: both ends are inside, and the middle is open
        (row(1, 1, 2), {(2, 1): 2}),  # the ends remain one vertex
        (row(1, 0, 1), {(0, 1): 2, (1, 1): 2}),  # open to the outline
        (row(2, 0, 1, 2) | column(2, 1, 2), {(0, 2): 2, (1, 2): 2, (2, 2): 4}),  # two cuts that cross
        (row(2, 0, 1) | column(2, 1, 2), {(0, 2): 2, (1, 2): 2, (2, 2): 3}),  # a cut that ends on another one
        (row(1, 1) | row(2, 1) | column(1, 1), {(1, 1): 2, (1, 2): 2}),  # a flap
    ],
)
def test_vertices_are_split_where_the_material_is_not_joined(
    cuts: dict[tuple[tuple[int, int], tuple[int, int]], str], expected: dict[tuple[int, int], int]
) -> None:
    pattern, uncut = grid(4, 4, cuts), grid(4, 4, {})
    assert copies(pattern) == expected
    assert {len(vertices) for vertices in sides_of_cuts(pattern)} == set(expected.values())
    pieces = [2 if (place[0] % 1) else 1 for place in expected]
    more = sum(pieces) - len(pieces)  # a cut with a vertex in its middle has two pieces
    assert len(pattern.edges) == len(uncut.edges) + len(cuts) + 2 * more and len(pattern.faces) == len(uncut.faces)
    # each edge of a cut belongs to one facet, on its left, and joins no facets
    on_cuts = [k for k, letter in enumerate(pattern.assignment) if letter == "C"]
    assert len(on_cuts) == 2 * (len(cuts) + more)
    assert len({frozenset(ends) for ends in pattern.edges.tolist()}) == len(pattern.edges)
    assert (pattern.edge_faces[on_cuts, 0] >= 0).all() and (pattern.edge_faces[on_cuts, 1] < 0).all()
    assert len(pattern.creases) == len(uncut.creases) - len(cuts)
    # numbers of the uncut sheet remain, and the numbers of edges too
    count = len(uncut.vertices)
    np.testing.assert_array_equal(pattern.vertices[:count], uncut.vertices)
    old = [v for v in pattern.uncut if v < count]
    np.testing.assert_array_equal(pattern.vertices[: len(old)], uncut.vertices[old])
    np.testing.assert_array_equal(np.array(pattern.uncut)[pattern.edges[: len(uncut.edges), 0]], uncut.edges[:, 0])
    # the facets beside each cut have no contact where they touch
    beside = {tuple(sorted(uncut.edge_faces[k].tolist())) for k in on_cuts if k < len(uncut.edges)}
    assert beside <= set(facets_across_cuts(pattern))


def test_the_side_of_the_first_facet_keeps_the_number() -> None:
    pattern = grid(2, 2, row(1, 0))
    at = {k: tuple(place) for k, place in enumerate(pattern.flat.tolist())}  # type: ignore[union-attr]
    lower, upper = sorted(k for k, place in at.items() if place == (0, 1))
    assert upper == len(at) - 1
    owner = {v: min(k for k, face in enumerate(pattern.faces) if v in face) for v in (lower, upper)}
    assert owner[lower] < owner[upper]
    assert {lower, upper} <= set(place_of(pattern, "edge left").vertices)
    assert place_of(pattern, ((-0.1, 0.9, -1), (0.1, 1.1, 1))).vertices == (lower, upper)
    assert place_of(pattern, f"vertex {upper + 1}").vertices == (upper,)


def test_a_pattern_without_cuts_is_the_same_object() -> None:
    for pattern in (miura(2, 2, 1.0, 1.0, 1.0, 0.5), grid(3, 3, {})):
        assert open_cuts(pattern) is pattern
    cut = grid(3, 3, row(1, 0))
    assert open_cuts(cut) is cut


def test_cuts_of_a_folded_fold_file() -> None:
    """A folded frame with common vertices on its cut, and the letter B or C between two faces."""
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 1], [0, 1, 0], [1, 1, 0], [2, 1, 1], [0, 2, 0], [1, 2, 0], [2, 2, 1]]
    edges = [[0, 1], [1, 2], [2, 5], [5, 8], [8, 7], [7, 6], [6, 3], [3, 0], [1, 4], [4, 7], [3, 4], [4, 5]]
    for letter in "BC":
        data: dict[str, Any] = {
            "frame_classes": ["foldedForm"], "vertices_coords": points, "edges_vertices": edges,
            "edges_assignment": [*"BBBBBBBBVVF", letter],
            "faces_vertices": [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]],
        }  # fmt: skip
        pattern = open_cuts(read_fold(json.dumps(data), 1.0))
        assert sides_of_cuts(pattern) == [(5, 9)]
        assert pattern.faces[3] == (4, 9, 8, 7) and pattern.faces[1] == (1, 2, 5, 4)
        assert facets_across_cuts(pattern) == ((1, 3),)
