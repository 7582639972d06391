"""Crease patterns from FOLD and SVG files: reading, units, and refusals."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.scene.patterns.fold_file import read_fold
from fsm.scene.patterns.planar import Line, planar_pattern
from fsm.scene.patterns.svg_file import read_svg

ROOT = Path(__file__).parents[2]

SQUARE: dict[str, Any] = {
    "file_spec": 1.2,
    "frame_unit": "cm",
    "vertices_coords": [[0, 0], [2, 0], [2, 2], [0, 2]],
    "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]],
    "edges_assignment": ["B", "B", "B", "B", "M"],
}
FOLDED: dict[str, Any] = {
    "frame_classes": ["foldedForm"],
    "vertices_coords": [[0, 0, 0], [0, 1, 0], [-0.8, 0, 0.6], [0.8, 0, 0.6]],
    "edges_vertices": [[0, 1], [1, 2], [2, 0], [0, 3], [3, 1]],
    "edges_assignment": ["V", "B", "B", "B", "B"],
    "faces_vertices": [[0, 1, 2], [0, 3, 1]],
}

HEAD = '<svg xmlns="http://www.w3.org/2000/svg">'
FRAME = '<rect x="10" y="20" width="100" height="60" fill="none" stroke="#000000"/>'
VALLEY = '<line x1="10" y1="50" x2="110" y2="50" stroke="#0000FF" opacity="0.5"/>'


def fold(base: dict[str, Any], **changes: Any) -> str:
    return json.dumps({key: value for key, value in (base | changes).items() if value is not None})


def svg(*parts: str) -> str:
    return HEAD + "".join(parts) + "</svg>"


def test_flat_fold_file() -> None:
    """Faces follow from the edges, lengths from frame_unit, and fold angles from the assignment."""
    pattern = read_fold(fold(SQUARE), None)
    assert len(pattern.faces) == 2
    assert pattern.extent() == pytest.approx(0.02)
    (crease,) = pattern.creases
    assert pattern.assignment[crease] == "M" and pattern.target[crease] == -math.pi
    assert pattern.groups["left"] and set(pattern.groups) == {"left", "right", "bottom", "top"}


def test_scale_replaces_the_unit() -> None:
    assert read_fold(fold(SQUARE), 0.1).extent() == pytest.approx(0.2)
    with pytest.raises(ValueError, match=r"frame_unit 'unit', which has no length in m; give sheet\.scale"):
        read_fold(fold(SQUARE, frame_unit=None), None)


@pytest.mark.parametrize("key", ["edges_foldAngle", "edges_foldAngles"])
def test_fold_angles_of_both_versions(key: str) -> None:
    pattern = read_fold(fold(SQUARE, file_spec=1.0, **{key: [0, 0, 0, 0, -35.0]}), None)
    assert pattern.target[pattern.creases[0]] == pytest.approx(math.radians(-35.0))


def test_folded_frame_is_the_start() -> None:
    """The folded frame of a file with two frames, which inherits the edges of its parent."""
    flat = {"vertices_coords": [[0, 0], [0, 1], [-1, 0], [1, 0]], "frame_classes": ["creasePattern"]}
    own = {key: FOLDED[key] for key in ("vertices_coords", "frame_classes")}
    frames = [{"frame_parent": 0, "frame_inherit": True, **own}]
    pattern = read_fold(fold(FOLDED, file_frames=frames, **flat), 1.0)
    (crease,) = pattern.creases
    assert pattern.fold_angles()[crease] == pytest.approx(2.0 * math.asin(0.6))
    assert pattern.assignment[crease] == "V" and pattern.flat is None


def test_faces_in_the_other_order() -> None:
    """If all faces are listed from behind, the assignment decides on the normals."""
    pattern = read_fold(fold(FOLDED, faces_vertices=[[2, 1, 0], [1, 3, 0]]), 1.0)
    assert pattern.fold_angles()[pattern.creases[0]] > 0.0


def test_closed_crease_has_the_sign_of_its_assignment() -> None:
    closed = [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 0, 0]]
    for letter, sign in (("V", 1.0), ("M", -1.0)):
        pattern = read_fold(fold(FOLDED, vertices_coords=closed, edges_assignment=[letter, "B", "B", "B", "B"]), 1.0)
        assert pattern.target[pattern.creases[0]] == pytest.approx(sign * math.pi)


@pytest.mark.parametrize(
    ("base", "changes", "message"),
    [
        (SQUARE, {"vertices_coords": None}, "has no vertices_coords"),
        (SQUARE, {"edges_vertices": None}, "has no edges_vertices"),
        (SQUARE, {"file_spec": 3}, "has file_spec 3"),
        (SQUARE, {"edges_assignment": ["B", "B"]}, "5 edges, 2 assignments and 5 fold angles"),
        (SQUARE, {"edges_assignment": ["B", "B", "B", "B", "X"]}, "edge 4 with the assignment 'X'"),
        (SQUARE, {"edges_foldAngle": [0, 0, 0, 0, 90]}, "edge 4, a mountain, with the fold angle 90 deg"),
        (SQUARE, {"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 9]]}, r"edge 4 with the vertices \[0, 9\]"),
        (SQUARE, {"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [2, 2]]}, "mountain crease at .2, 2. has zero length"),
        (SQUARE, {"faces_vertices": [[0, 1, 2]]}, "has 1 faces_vertices, but its edges enclose 2 facets"),
        (SQUARE, {"edges_vertices": [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3]]}, "edges cross at"),
        (SQUARE, {"vertices_coords": [[0, 0], [2, 0], [2, "a"], [0, 2]]}, "not lists of two or three"),
        (SQUARE, {"faces_vertices": [[0, 1, 2], [0, 1, 2]]}, r"face 1 with the vertices \[0, 1, 2\] twice"),
        (SQUARE, {"faces_vertices": [[0, 1, 3], [0, 2, 3]]}, "its edges enclose no such facet"),
        (SQUARE, {"faces_vertices": 3}, "faces_vertices that are not a list"),
        (SQUARE, {"edges_vertices": 5}, "edges_vertices that are not a list"),
        (SQUARE, {"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], 3]}, "edge 4 with the vertices 3"),
        (SQUARE, {"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [True, 3]]}, r"edge 4 with the vertices \[True, 3\]"),
        (SQUARE, {"edges_vertices": [[0, 1], [1, 2], [2, 3], [0, 2]], "edges_assignment": list("BBBV")},
         "from .2, 2. to .0, 2. is a side of no facet; complete the boundary"),
        (FOLDED, {"faces_vertices": [[0, 1, 2, 3]], "vertices_coords": [[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]},
         "whose sides cross; list them around the face"),
        (FOLDED, {"faces_vertices": None}, "folded frame without faces_vertices"),
        (FOLDED, {"faces_vertices": [[0, 1, 2], [0, 1, 3]]}, "two faces on one side"),
        (FOLDED, {"faces_vertices": [[0, 1, 2, 3]]}, "which is not planar"),
        (FOLDED, {"faces_vertices": [[0, 1, 7]]}, "has face 0 with the vertices"),
        (FOLDED, {"vertices_coords": [*FOLDED["vertices_coords"], [5, 0, 0]]}, "has the vertex 4, which is in no face"),
        (FOLDED, {"vertices_coords": [[1e9 * x for x in row] for row in FOLDED["vertices_coords"]]}, "1e-06 to 10000 m"),
        (FOLDED, {"faces_vertices": [[0, 1, 2], [3, 4, 5]], "edges_vertices": [[0, 1]], "edges_assignment": ["B"],
                  "vertices_coords": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 1]]},
         "has 2 separate parts: no creases join the faces 0 and 1"),
        (SQUARE, {"vertices_coords": [[0, 0], [10**400, 0], [2, 2], [0, 2]]}, "lists of two or three finite numbers"),
        (SQUARE, {"vertices_coords": [[0, 0], [1e300, 0], [2, 2], [0, 2]]}, "size of 1e.300 m; it must be"),
        (SQUARE, {"frame_classes": 3}, "has frame_classes 3; give a list of texts"),
        (SQUARE, {"file_frames": [{"frame_inherit": True, "frame_parent": 1}]}, "frame 1 with the parent 1"),
        (SQUARE, {"file_frames": [{"frame_inherit": True, "frame_parent": False}]}, "frame 1 with the parent False"),
    ],
)
def test_fold_files_that_are_refused(base: dict[str, Any], changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_fold(fold(base, **changes), 1.0)


def test_not_json() -> None:
    for text in ("{", "[]", '"text"'):
        with pytest.raises(ValueError, match="is not a FOLD file"):
            read_fold(text, 1.0)


def test_svg_colours_opacity_and_crossings() -> None:
    """Two lines that cross give four facets; y points up; the opacity is the part of 180 degrees."""
    path = '<g style="stroke:#f00"><path d="M60,20 v60"/></g>'
    pattern = read_svg(svg(FRAME, VALLEY, path), 1e-3)
    assert len(pattern.faces) == 4 and Counter(pattern.assignment) == {"B": 8, "V": 2, "M": 2}
    np.testing.assert_allclose(np.ptp(pattern.vertices, axis=0), [0.1, 0.06, 0.0], atol=1e-15)
    targets = {letter: float(pattern.target[k]) for k, letter in enumerate(pattern.assignment)}
    assert targets["V"] == pytest.approx(math.pi / 2) and targets["M"] == pytest.approx(-math.pi)
    assert pattern.vertices[:, 1].max() == pytest.approx(-0.02)


def test_svg_transforms_and_near_points() -> None:
    """A rotated and moved group; line ends at a small distance from the frame count as on it."""
    line = '<g transform="translate(60 50) rotate(90)"><line x1="-30.02" y1="0" x2="29.99" y2="0" stroke="blue"/></g>'
    pattern = read_svg(svg(FRAME, line), 1.0)
    assert len(pattern.faces) == 2 and Counter(pattern.assignment)["V"] == 1


def test_svg_lines_beyond_the_outline() -> None:
    """Lines that continue beyond the outline end there, and leave no vertices without a facet."""
    pattern = read_svg(svg(FRAME, '<path d="M60,0 V200" stroke="#ff0000"/>'), 1.0)
    assert len(pattern.vertices) == 6 and len(pattern.faces) == 2
    assert {v for face in pattern.faces for v in face} == set(range(6))


def test_svg_curve_is_divided() -> None:
    curve = '<path d="M10,50 c30,-20 70,-20 100,0" stroke="#ff00ff" fill="none"/>'
    pattern = read_svg(svg(FRAME, curve), 1.0)
    assert len(pattern.faces) == 2 and Counter(pattern.assignment)["U"] == 8


def test_inner_boundaries_are_cuts() -> None:
    slit = '<path d="M10,50 h50" stroke="#000000"/>'
    rest = '<path d="M60,50 h50" stroke="#0000ff"/>'
    assert Counter(read_svg(svg(FRAME, slit, rest), 1.0).assignment)["C"] == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<svg", "is not an SVG file"),
        ("<html/>", "its root is <html>"),
        (svg('<line x1="0" y1="0" x2="1" y2="1" stroke="#123456"/>'), "no lines with the stroke colours"),
        (svg(FRAME, '<line x1="10" y1="50" x2="60" y2="50" stroke="#ff0000"/>'), "a line ends inside of a facet"),
        (svg(FRAME, VALLEY, VALLEY.replace("0000FF", "ff0000")), "is a mountain and a valley"),
        (svg(FRAME, '<rect x="200" y="20" width="10" height="10" stroke="black"/>'), "the pattern has 2 separate parts"),
        (svg('<path d="M0,0 A5,5 0 0 1 10,0" stroke="red"/>'), "command 'A', which is not supported"),
        (svg('<line x1="1" y1="1" x2="1" y2="1" stroke="red"/>'), "zero length"),
        (svg(FRAME, '<rect x="30" y="30" width="20" height="20" stroke="red"/>'), "a facet contains a closed line at"),
        (svg(FRAME, '<line x1="10%" y1="50" x2="110" y2="50" stroke="blue"/>'), "x1 is '10%', not a number"),
        (svg(FRAME, '<polyline points="10,nan 110,50" stroke="blue"/>'), "a <polyline> with 'nan' among its numbers"),
        (svg(FRAME, '<polyline points="10,50,110" stroke="blue"/>'), "3 coordinates, an odd number"),
        (svg(FRAME, '<path d="L110,50" stroke="blue"/>'), "begins with 'L'; a path begins with M or m"),
        (svg(FRAME, '<path d="M10,50 ~ L110,50" stroke="blue"/>'), "a path with '~' among its numbers"),
        (svg(FRAME, '<line x1="10" y1="50" x2="110" y2="50" stroke="blue" opacity="nan"/>'), "opacity 'nan', which is not"),
        (svg(FRAME, '<g transform="rotate(1,2)"/>'), "has the transform 'rotate.1,2.', which is not supported"),
        (svg(FRAME, '<use href="#a"/>'), "has a <use> element, which is not supported"),
        (svg("<g>" * 3000, "</g>" * 3000), "has no lines with the stroke colours"),
    ],
)
def test_svg_files_that_are_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_svg(text, 1.0)


def test_svg_styles_units_and_hidden_lines() -> None:
    """Classes of a style sheet, `style` before attributes, lengths with units, and lines that are not shown."""
    sheet = "<style>/* a */ .m, .n { stroke: #ff0000; opacity: 0.25 } line { stroke: #00f }</style>"
    frame = '<rect x="0" y="0" width="100mm" height="50mm" stroke="black"/>'
    lines = [
        '<line class="x m" x1="0" y1="10mm" x2="10cm" y2="10mm"/>',
        '<line x1="0" y1="20mm" x2="10cm" y2="20mm" stroke="#ff00ff"/>',
        '<line x1="0" y1="30mm" x2="10cm" y2="30mm" class="m" style="stroke:rgb(255,255,0);opacity:1"/>',
        '<g display="none"><line x1="0" y1="40mm" x2="10cm" y2="40mm" stroke="red"/></g>',
    ]
    pattern = read_svg(svg(sheet, frame, *lines), 1.0)
    assert Counter(pattern.assignment) == {"B": 10, "M": 1, "V": 1, "J": 1}
    np.testing.assert_allclose(np.ptp(pattern.flat, axis=0), [100 * 96 / 25.4, 50 * 96 / 25.4])
    assert pattern.target.min() == pytest.approx(-math.pi / 4)


def test_holes_are_no_facets() -> None:
    """A frame with a window: creases join the corners; without the window, lines and the file of faces agree."""
    window = '<rect x="40" y="35" width="40" height="30" fill="none" stroke="black"/>'
    ends = [((10, 20), (40, 35)), ((110, 20), (80, 35)), ((110, 80), (80, 65)), ((10, 80), (40, 65))]
    lines = [f'<path d="M{a[0]},{a[1]} L{b[0]},{b[1]}" stroke="red"/>' for a, b in ends]
    pattern = read_svg(svg(FRAME, window, *lines), 1.0)
    assert len(pattern.faces) == 4 and Counter(pattern.assignment) == {"B": 8, "M": 4}
    disc = '<circle cx="60" cy="50" r="20" stroke="black"/><path d="M10,50 h30 M80,50 h30" stroke="red"/>'
    ring = read_svg(svg(FRAME, disc), 1.0)
    assert len(ring.faces) == 2 and Counter(ring.assignment)["M"] == 2


def test_too_many_facets_are_refused_before_they_are_made() -> None:
    grid = [f'<path d="M10,{20 + 60 * k / 400} h100 M{10 + k / 4},20 v60" stroke="red"/>' for k in range(1, 400)]
    with pytest.raises(ValueError, match="cross at more than 100,000 places; at most 20,000 facets"):
        read_svg(svg(FRAME, *grid), 1.0)
    fewer = [f'<path d="M10,{20 + 60 * k / 150} h100 M{10 + k / 1.5},20 v60" stroke="red"/>' for k in range(1, 150)]
    with pytest.raises(ValueError, match=r"enclose about 22,[0-9]{3} facets; at most 20,000 are allowed"):
        read_svg(svg(FRAME, *fewer), 1.0)


def test_random_lines_cover_their_square() -> None:
    """Random chords of a square: the areas of the facets add up, and Euler's formula holds."""
    rng = np.random.default_rng(7)
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    frame = [Line(a, b, "B", 0.0) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    for _ in range(20):
        chords = [
            Line((0.0, float(rng.uniform(0.05, 0.95))), (1.0, float(rng.uniform(0.05, 0.95))), "V", math.pi)
            for _ in range(int(rng.integers(1, 7)))
        ]
        pattern = planar_pattern(frame + chords, 1.0)
        assert pattern.flat is not None
        areas = [
            0.5 * abs(np.sum(p[:, 0] * np.roll(p[:, 1], -1) - p[:, 1] * np.roll(p[:, 0], -1)))
            for p in (pattern.flat[list(face)] for face in pattern.faces)
        ]
        assert sum(areas) == pytest.approx(1.0, abs=1e-12)
        used = {v for face in pattern.faces for v in face}
        assert len(used) - len(pattern.edges) + len(pattern.faces) == 1


def test_order_of_a_fold_file_is_kept() -> None:
    """Vertices, edges and faces have the numbers of the file, in any order."""
    at = [[60, 60], [0, 0], [30, 60], [30, 0], [60, 0], [0, 60]]
    edges = [[2, 3], [0, 2], [1, 3], [3, 4], [4, 0], [2, 5], [5, 1]]
    data = {
        "vertices_coords": at, "edges_vertices": edges, "edges_assignment": [*"VBBBBBB"],
        "faces_vertices": [[3, 4, 0, 2], [1, 3, 2, 5]], "frame_unit": "mm",
    }  # fmt: skip
    pattern = read_fold(json.dumps(data), None)
    np.testing.assert_allclose(pattern.vertices[:, :2], 1e-3 * np.array(at), atol=1e-12)
    assert [set(edge) for edge in pattern.edges.tolist()] == [set(edge) for edge in edges]
    assert [set(face) for face in pattern.faces] == [{0, 2, 3, 4}, {1, 2, 3, 5}]
    assert pattern.assignment == tuple("VBBBBBB") and pattern.groups["right"] == (0, 4)
