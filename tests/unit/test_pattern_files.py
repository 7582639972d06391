"""Crease patterns from FOLD and SVG files: reading, units, and refusals."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.scene.patterns.file import with_pattern
from fsm.scene.patterns.fold_file import read_fold
from fsm.scene.patterns.planar import Line, planar_pattern
from fsm.scene.patterns.reading import PatternFault, Reading
from fsm.scene.patterns.svg_file import read_svg
from fsm.scene.sheet import Sheet

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
        (
            SQUARE,
            {"edges_vertices": [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3]], "faces_vertices": [[0, 1, 2]]},
            "edges cross at",
        ),
        (SQUARE, {"vertices_coords": [[0, 0], [2, 0], [2, "a"], [0, 2]]}, "not lists of two or three"),
        (SQUARE, {"faces_vertices": [[0, 1, 2], [0, 1, 2]]}, r"face 1 with the vertices \[0, 1, 2\] twice"),
        (SQUARE, {"faces_vertices": [[0, 1, 3], [0, 2, 3]]}, "its edges enclose no such facet"),
        (SQUARE, {"faces_vertices": 3}, "faces_vertices that are not a list"),
        (SQUARE, {"edges_vertices": 5}, "edges_vertices that are not a list"),
        (SQUARE, {"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], 3]}, "edge 4 with the vertices 3"),
        (SQUARE, {"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [True, 3]]}, r"edge 4 with the vertices \[True, 3\]"),
        (
            SQUARE,
            {"edges_vertices": [[0, 1], [1, 2], [2, 3], [0, 2]], "edges_assignment": list("BBBV")},
            "from .2, 2. to .0, 2. is a side of no facet; complete the boundary",
        ),
        (
            FOLDED,
            {"faces_vertices": [[0, 1, 2, 3]], "vertices_coords": [[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]},
            "whose sides cross; list them around the face",
        ),
        (FOLDED, {"faces_vertices": None}, "folded frame without faces_vertices"),
        (
            FOLDED,
            {
                "faces_vertices": [[0, 1, 2], [0, 3, 1], [0, 1, 4]],
                "vertices_coords": [*FOLDED["vertices_coords"], [0, 0, -1]],
            },
            "two faces on one side",
        ),
        (FOLDED, {"faces_vertices": [[0, 1, 2, 3]]}, "which is not planar"),
        (FOLDED, {"faces_vertices": [[0, 1, 7]]}, "has face 0 with the vertices"),
        (FOLDED, {"vertices_coords": [*FOLDED["vertices_coords"], [5, 0, 0]]}, "has the vertex 4, which is in no face"),
        (FOLDED, {"vertices_coords": [[1e9 * x for x in row] for row in FOLDED["vertices_coords"]]}, "1e-06 to 10000 m"),
        (
            FOLDED,
            {
                "faces_vertices": [[0, 1, 2], [3, 4, 5]],
                "edges_vertices": [[0, 1]],
                "edges_assignment": ["B"],
                "vertices_coords": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 1]],
            },
            "has 2 separate parts, which no creases join: 1 with 1 face, 2 with 1 face; choose one by its number",
        ),
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
        (svg('<path d="M0,0 B5,5 0 0 1 10,0" stroke="red"/>'), "command 'B', which SVG does not have"),
        (svg('<line x1="1" y1="1" x2="1" y2="1" stroke="red"/>'), "zero length"),
        (svg(FRAME, '<line x1="10%" y1="50" x2="110" y2="50" stroke="blue"/>'), "x1 is '10%', not a number"),
        (svg(FRAME, '<polyline points="10,nan 110,50" stroke="blue"/>'), "a <polyline> with 'nan' among its numbers"),
        (svg(FRAME, '<polyline points="10,50,110" stroke="blue"/>'), "3 coordinates, an odd number"),
        (svg(FRAME, '<path d="L110,50" stroke="blue"/>'), "begins with 'L'; a path begins with M or m"),
        (svg(FRAME, '<path d="M10,50 ~ L110,50" stroke="blue"/>'), "a path with '~' among its numbers"),
        (svg(FRAME, '<line x1="10" y1="50" x2="110" y2="50" stroke="blue" opacity="nan"/>'), "opacity 'nan', which is not"),
        (svg(FRAME, '<g transform="rotate(1,2)"/>'), "has the transform 'rotate.1,2.', which is not supported"),
        (svg(FRAME, '<g transform="rotate(1e400)"/>'), "has the transform 'rotate.1e400.', which is not supported"),
        (svg(FRAME, '<g id="a"><use href="#a"/></g>'), "a <use> that repeats itself"),
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


@pytest.mark.parametrize(
    ("stroke", "letter"),
    [
        ("#ed1c24", "M"), ("crimson", "M"), ("rgb(100%, 0%, 0%)", "M"), ("rgba(230 20 30 / 0.5)", "M"), ("#F00F", "M"),
        ("#ff000080", "M"), ("hsl(240, 100%, 50%)", "V"), ("#2e3192", "V"), ("navy", "V"), ("#1f77b4", "V"),
        ("#231f20", "B"),        ("#39b54a", "C"), ("gold", "J"), ("#ec008c", "U"), ("rgb(255,0,255) icc-color(x, 1)", "U"),
        ("orange", None), ("#888", None), ("white", None), ("#00aeef", None), ("url(#a) red", None),
        ("hsl(180deg 50% 50%)", None),
    ],
)  # fmt: skip
def test_stroke_colours_are_classes(stroke: str, letter: str | None) -> None:
    """Near colours count as the colour of their hue, with a note; all others are counted in a note."""
    line = f'<line x1="10" y1="40" x2="110" y2="40" stroke="{stroke}"/>'
    pattern = read_svg(svg(FRAME, VALLEY, line), 1.0)
    found = Counter(pattern.assignment)
    exact = stroke in ("rgb(100%, 0%, 0%)", "#F00F", "#ff000080", "hsl(240, 100%, 50%)", "rgb(255,0,255) icc-color(x, 1)")
    if letter is None:
        assert found == {"B": 6, "V": 1}
        assert pattern.notes[0].startswith("1 line is ignored, because the colour is not one of a crease pattern: 1 in ")
        return
    if letter in "BC":  # the part above the line has no crease
        assert found == {"B": 6, "V": 1} and "1 area without creases is cut off" in pattern.notes[-1]
        return
    assert found == Counter({"B": 8, "V": 1}) + Counter({letter: 1})
    assert bool(pattern.notes) != exact
    if stroke in ("#ff000080", "rgba(230 20 30 / 0.5)"):
        target = float(pattern.target[pattern.assignment.index("M")])
        assert target == pytest.approx(-math.pi * (128 / 255 if stroke == "#ff000080" else 0.5))


def test_ignored_lines_are_counted_by_colour() -> None:
    """One note for all ignored lines, and one for lines that are not shown."""
    lines = [
        f'<line x1="10" y1="{y}" x2="110" y2="{y}" stroke="{c}"/>'
        for y, c in ((30, "#888"), (35, "#888888"), (40, "orange"))
    ]
    hidden = [
        '<g style="visibility:hidden"><path d="M10,45 h100 m-100,2 h100" stroke="red"/></g>',
        '<path d="M10,55 h100" stroke="red" opacity="0"/>',
        '<path d="M10,65 h100" stroke="red" stroke-width="0px"/>',
        '<g display="none"><g visibility="visible"><path d="M10,70 h100" stroke="blue"/></g></g>',
    ]
    notes = read_svg(svg(FRAME, VALLEY, *lines, *hidden), 1.0).notes
    assert notes == (
        "3 lines are ignored, because the colour is not one of a crease pattern: 2 in #888888, 1 in #ffa500",
        "5 lines that are not shown (display, visibility, opacity or stroke-width) ignored",
    )


def test_selectors_and_their_order() -> None:
    """Compound, child, descendant, sibling and attribute selectors; specificity, order, `!important` and inheritance."""
    sheet = """<style><![CDATA[
        @media print { line { stroke: black } }
        .edge.m { stroke: red } g.valleys > line, #u { stroke: #00f } svg g line.w { stroke: yellow }
        line[data-kind="cut"] { stroke: lime !important } line + line.after { stroke: magenta }
        .x { stroke: blue } .x { stroke: red } line { stroke: grey }
        g:nth-child(7) line { stroke: red }
    ]]></style>"""
    at = 'x1="10" x2="110"'
    parts = [
        f'<line class="edge m" {at} y1="25" y2="25"/>',
        f'<g class="valleys"><line {at} y1="30" y2="30"/><g><line class="w" {at} y1="35" y2="35"/></g></g>',
        f'<line data-kind="cut" style="stroke:red" x1="20" x2="60" y1="40" y2="40"/>'
        f'<line class="after" {at} y1="45" y2="45"/>',
        f'<line class="x" {at} y1="50" y2="50"/>',
        '<g stroke="blue" color="red"><path d="M10,55 h100"/><path stroke="currentColor" d="M10,60 h100"/></g>',
        f'<line {at} y1="65" y2="65"/>',
    ]
    pattern = read_svg(svg(sheet, FRAME, *parts), 1.0)
    found = [pattern.assignment[k] for k in pattern.creases] + ["C"] * pattern.assignment.count("C")
    assert Counter(found) == {"M": 3, "V": 2, "J": 1, "C": 1, "U": 1, "F": 2}
    assert pattern.notes[:2] == (
        "1 line is ignored, because the colour is not one of a crease pattern: 1 in #808080",
        'style rules that are not read: "g:nth-child(7) line"',
    )


def test_use_symbols_and_inner_svg() -> None:
    """Repeated lines have the style and the transform of their <use>; a symbol fits its viewBox into its box."""
    defs = (
        '<defs><path id="p" d="M10,0 h100"/><symbol id="s" viewBox="0 0 10 10" width="100" height="100">'
        '<path d="M0,5 h10"/></symbol></defs>'
    )
    parts = [
        '<use href="#p" y="30" stroke="red"/><g stroke="blue"><use xlink:href="#p" transform="translate(0 10)" y="30"/></g>',
        '<use href="#s" x="10" y="0" stroke="yellow"/><use href="#none"/>',
        '<svg x="10" y="20" width="100" height="60" viewBox="0 0 50 30"><path d="M0,25 h50" stroke="magenta"/></svg>',
    ]
    head = HEAD.replace(">", ' xmlns:xlink="http://www.w3.org/1999/xlink">')
    pattern = read_svg(head + defs + FRAME + "".join(parts) + "</svg>", 1.0)
    heights = {pattern.assignment[k]: float(pattern.flat[pattern.edges[k, 0], 1]) for k in pattern.creases}
    assert heights == {"M": -30.0, "V": -40.0, "J": -50.0, "U": -70.0}
    assert pattern.notes == ('<use> elements without their element in this file: "#none"',)


def test_arcs_and_rounded_corners() -> None:
    """Points of an arc lie on its circle, on the side that the flags choose; rx rounds the corners of a rectangle."""
    for flags, middle in (("0 1", 110.0), ("0 0", 70.0), ("1 1", 170.0), ("1 0", 10.0)):
        radius = 50.0
        frame = '<rect x="0" y="0" width="300" height="300" stroke="black"/>'
        arc = f'<path d="M90,0 V110 A50 50 0 {flags} 90,190 V300" stroke="red"/>'
        pattern = read_svg(svg(frame, arc), 1.0)
        points = pattern.flat[np.unique(pattern.edges[pattern.creases])]
        inside = points[np.abs(points[:, 1] + 150.0) < 40.0 - 1e-9]
        centre = middle + (-radius if flags[-1] == "1" else radius)
        assert len(inside) >= 7 and np.abs(np.hypot(inside[:, 0] - centre, inside[:, 1] + 150.0) - radius).max() < 1e-9
        assert (inside[:, 0] > 90.0).all() == (flags[-1] == "1")
    compact = read_svg(svg(FRAME, '<path d="M10 30a60 40 0 00100 0" stroke="red"/>'), 1.0)
    assert Counter(compact.assignment)["M"] == 11  # 2 asin(5/6) = 112.9 degrees
    box = '<rect x="0" y="0" width="100" height="60" rx="20" stroke="black"/><path d="M50,0 V60" stroke="red"/>'
    rounded = read_svg(svg(box), 1.0)
    area = sum(0.5 * np.sum(p[:, 0] * np.roll(p[:, 1], -1) - p[:, 1] * np.roll(p[:, 0], -1))
               for p in (rounded.flat[list(face)] for face in rounded.faces))  # fmt: skip
    polygon = 16.0 * 400.0 * math.sin(2.0 * math.pi / 32.0)  # regular polygon with 32 corners on the circle
    assert area == pytest.approx(100.0 * 60.0 - (1600.0 - polygon))
    percent = svg(FRAME, '<line x1="10%" y1="50%" x2="110%" y2="50%" stroke="blue"/>').replace(
        "<svg ", '<svg viewBox="0 0 100 100" '
    )
    assert Counter(read_svg(percent, 1.0).assignment)["V"] == 1


@pytest.mark.parametrize("rx", ["2", "0.3"])
def test_short_lines_of_curves_leave_no_gap(rx: str) -> None:
    """Rounded corners of lines that are shorter than the tolerance (0.4): the outline stays closed."""
    box = f'<rect x="0" y="0" width="400" height="400" rx="{rx}" stroke="black"/><path d="M0,200 H400" stroke="red"/>'
    pattern = read_svg(svg(box), 1.0)
    assert len(pattern.faces) == 2 and Counter(pattern.assignment)["M"] == 1


def test_slivers_and_gaps_disappear() -> None:
    """Collinear creases that overlap by 0.15 % of the size, and a crease that ends as far from the outline."""
    frame = '<rect x="20" y="20" width="400" height="400" stroke="black"/>'
    cross = '<path d="M20,220 H220.6 M220,20 V420" stroke="red"/><path d="M220,220 H419.4" stroke="blue"/>'
    pattern = read_svg(svg(frame, cross), 1e-3)
    assert len(pattern.faces) == 4 and Counter(pattern.assignment) == {"B": 8, "M": 3, "V": 1}
    assert pattern.notes == ("points up to 0.6 mm apart are one vertex; the limit is sheet.merge = 0.8 mm",)
    with pytest.raises(ValueError, match="is a mountain and a valley"):
        read_svg(svg(frame, cross), 1e-3, Reading(merge=0.4e-3))
    far = '<path d="M20,220 H420 M220,20 V220" stroke="red"/><path d="M220,220 V410" stroke="blue"/>'
    assert len(read_svg(svg(frame, far), 1e-3, Reading(merge=11e-3)).faces) == 4
    with pytest.raises(PatternFault, match=r"ends inside of a facet near .0.22, -0.41. m") as caught:
        read_svg(svg(frame, far), 1e-3)
    np.testing.assert_allclose(caught.value.places, [[0.22, -0.41]])
    assert len(caught.value.lines) == len(caught.value.letters) == 7


def test_tolerance_keeps_fine_patterns() -> None:
    """Pleats of 0.05 % of the length of the sheet are not merged."""
    pleats = "".join(f'<path d="M{k},0 V400" stroke="{"red" if k % 2 else "blue"}"/>' for k in range(1, 2000))
    pattern = read_svg(svg('<rect width="2000" height="400" stroke="black"/>' + pleats), 1e-3)
    assert len(pattern.faces) == 2000


def test_edges_given_twice() -> None:
    """The letter that is used is in a note; a mountain that is a valley is an error with its place."""
    twice = [*SQUARE["edges_vertices"], [2, 0]]
    for pair in ("FM", "MF", "JM"):
        pattern = read_fold(fold(SQUARE, edges_vertices=twice, edges_assignment=[*"BBBB", *pair]), 1.0)
        other = {"F": "flat", "J": "bend line"}[pair.replace("M", "")]
        assert Counter(pattern.assignment) == {"B": 4, "M": 1}
        assert pattern.notes == (
            f"1 edge (from (0, 0) to (2, 2)) is given twice, as mountain and as {other}; mountain is used",
        )
    same = read_fold(fold(SQUARE, edges_vertices=twice, edges_assignment=[*"BBBBMM"]), 1.0)
    assert same.notes == ()
    angles = read_fold(
        fold(SQUARE, edges_vertices=twice, edges_assignment=[*"BBBBMM"], edges_foldAngle=[0, 0, 0, 0, -9, -8]), 1.0
    )
    assert "with two fold angles; the first is used" in angles.notes[0]
    assert angles.target[angles.creases[0]] == pytest.approx(math.radians(-9))
    for base in (SQUARE, FOLDED):
        again = [*base["edges_vertices"], base["edges_vertices"][0 if base is FOLDED else 4]]
        opposite = [*base["edges_assignment"], "M" if base is FOLDED else "V"]
        with pytest.raises(PatternFault, match=r"a mountain and a.* valley") as caught:
            read_fold(fold(base, edges_vertices=again, edges_assignment=opposite), 1.0)
        assert len(caught.value.places) == 1
    folded = read_fold(fold(FOLDED, edges_vertices=[*FOLDED["edges_vertices"], [1, 0]], edges_assignment=[*"FBBBBV"]), 1.0)
    assert folded.notes == ("edge 1, 0 is given twice, as valley and as flat; valley is used",)


def test_auxiliary_lines_are_ignored() -> None:
    """Flat lines inside a facet, free or with one end on a crease, and a closed one."""
    at = [*SQUARE["vertices_coords"], [1, 0.2], [1.5, 0.4], [1, 1], [1.7, 0.6], [1.8, 1.2]]
    lines = [[4, 5], [6, 4], [7, 8], [8, 5], [5, 7]]
    change = {"vertices_coords": at, "edges_vertices": [*SQUARE["edges_vertices"][:4], [0, 6], [6, 2], *lines]}
    pattern = read_fold(fold(SQUARE, edges_assignment=[*"BBBBMMFFFFF"], **change), 1.0)
    assert len(pattern.faces) == 2 and Counter(pattern.assignment) == {"B": 4, "M": 2}
    assert pattern.notes[0].startswith("5 flat creases and bend lines bound no facet and are ignored")
    with pytest.raises(ValueError, match="ends inside of a facet"):
        read_fold(fold(SQUARE, edges_assignment=[*"BBBBMMMFFFF"], **change), 1.0)


def test_facets_with_holes_and_slits() -> None:
    """Flat lines divide a facet with holes, a slit and the end of a cut; the area of the sheet is that without the holes."""
    window = '<rect x="60" y="40" width="20" height="20" stroke="black"/>'
    disc = '<circle cx="85" cy="80" r="10" stroke="lime"/>'
    slit = '<path d="M40,15 L90,25 M100,70 L95,68" stroke="lime"/>'
    frame = '<rect width="100" height="100" stroke="black"/><path d="M30,0 V100" stroke="red"/>'
    pattern = read_svg(svg(frame, window, disc, slit), 1.0)
    area = sum(0.5 * np.sum(p[:, 0] * np.roll(p[:, 1], -1) - p[:, 1] * np.roll(p[:, 0], -1))
               for p in (pattern.flat[list(face)] for face in pattern.faces))  # fmt: skip
    assert area == pytest.approx(10_000.0 - 400.0 - 16.0 * 100.0 * math.sin(2.0 * math.pi / 32.0))
    counts = Counter(pattern.assignment)
    assert counts["M"] == 1 and counts["F"] == 7 and counts["C"] == 2
    assert "4 holes and ends of cuts" in pattern.notes[-1]
    inner = '<rect x="35" y="35" width="10" height="10" stroke="black"/><path d="M35,40 H45" stroke="red"/>'
    with pytest.raises(ValueError, match="has 2 separate parts"):
        read_svg(svg('<rect width="100" height="100" stroke="black"/>', inner), 1.0)


def test_parts_are_chosen_by_number() -> None:
    """The largest part is number 1, in flat and in folded frames."""
    parts = [
        FRAME,
        VALLEY,
        '<rect x="200" y="20" width="10" height="10" stroke="black"/><path d="M200,25 h10" stroke="red"/>',
    ]
    with pytest.raises(
        PatternFault, match=r"2 separate parts: 1 with 2 facets around .* choose one by its number"
    ) as caught:
        read_svg(svg(*parts), 1.0)
    assert len(caught.value.places) == 2 and caught.value.labels == ("1", "2")
    for part, letter in ((1, "V"), (2, "M")):
        pattern = read_svg(svg(*parts), 1.0, Reading(part=part))
        assert Counter(pattern.assignment) == {"B": 6, letter: 1}
        assert f"part {part} of 2 is the sheet (sheet.part)" in pattern.notes
    with pytest.raises(ValueError, match=r"sheet\.part = 2, but the pattern is one part"):
        read_svg(svg(FRAME, VALLEY), 1.0, Reading(part=2))
    more = {
        "vertices_coords": [*FOLDED["vertices_coords"], [5, 0, 0], [6, 0, 0], [5, 1, 1]],
        "faces_vertices": [*FOLDED["faces_vertices"], [4, 5, 6]],
        "edges_vertices": [*FOLDED["edges_vertices"], [4, 5], [5, 6], [6, 4]], "edges_assignment": [*"VBBBBBBB"],
    }  # fmt: skip
    first, second = (read_fold(fold(FOLDED, **more), 1.0, None, Reading(part=part)) for part in (1, 2))
    assert (len(first.faces), len(second.faces)) == (2, 1)
    np.testing.assert_allclose(second.vertices[:, 0], [5, 6, 5])


def test_facets_that_are_not_quite_planar() -> None:
    """Rounded coordinates: the digits of the file set the limit; facets that are divided need not be planar."""
    quad = {
        "vertices_coords": [[0, 0, 0], [0, 1, 0], [-0.8, 0, 0.6], [0.8, 0, 0.6], [0.8, 1, 0.6]],
        "edges_vertices": [[0, 1], [1, 2], [2, 0], [0, 3], [3, 4], [4, 1]], "edges_assignment": [*"VBBBBB"],
        "faces_vertices": [[0, 1, 2], [0, 3, 4, 1]],
    }  # fmt: skip

    def raised(by: float) -> str:
        at = [*quad["vertices_coords"][:4], [0.8, 1, 0.6 + by]]
        return fold(FOLDED, **quad | {"vertices_coords": at})

    assert read_fold(raised(0.0), 1.0).notes == ()
    slightly = read_fold(raised(3e-5), 1.0)
    assert (
        len(slightly.faces) == 2
        and "off the planes of their facets; the limit is sheet.merge = 0.16 mm" in slightly.notes[0]
    )
    assert len(read_fold(raised(1e-3), 1.0).faces) == 2  # three digits
    with pytest.raises(PatternFault, match=r"face 1, which is not planar: a vertex is 3\.976 mm off") as caught:
        read_fold(raised(0.02), 1.0)
    np.testing.assert_allclose(caught.value.places, [[0.4, 0.5, 0.305]])
    for reading in (Reading(divided=True), Reading(merge=5e-3)):
        assert len(read_fold(raised(0.02), 1.0, None, reading).faces) == 2


def test_fold_files_of_other_programs() -> None:
    """Version as text, faces in opposite orders, and edges that cross where a file without faces has no vertex."""
    assert len(read_fold(fold(SQUARE, file_spec="1.1"), None).faces) == 2
    for version in ("2.0", "one", True, None, [1]):
        with pytest.raises(ValueError, match="has file_spec"):
            read_fold(json.dumps(SQUARE | {"file_spec": version}), None)
    turned = read_fold(fold(FOLDED, faces_vertices=[[0, 1, 2], [0, 1, 3]]), 1.0)
    assert turned.fold_angles()[turned.creases[0]] == pytest.approx(2.0 * math.asin(0.6))
    crossed = fold(SQUARE, edges_vertices=[*SQUARE["edges_vertices"], [1, 3]], edges_assignment=[*"BBBBMV"])
    pattern = read_fold(crossed, None)
    assert len(pattern.faces) == 4 and pattern.notes == (
        "edges cross where the file has no vertex; vertices are added there",
    )
    np.testing.assert_allclose(pattern.vertices[:4, :2], 0.01 * np.array(SQUARE["vertices_coords"]), atol=1e-12)


def test_files_of_oripa_and_oriedita(tmp_path: Path) -> None:
    """The same square with a mountain and an auxiliary line in all three formats."""
    rows = [(1, 0, 0, 9, 0), (1, 9, 0, 9, 9), (1, 9, 9, 0, 9), (1, 0, 9, 0, 0), (2, 0, 0, 9, 9), (4, 2, 1, 3, 1)]
    lines = "".join(
        f'<void index="{k}"><object class="oripa.OriLineProxy">'
        + "".join(
            f'<void property="{n}"><double>{v}</double></void>'
            for n, v in zip(("x0", "y0", "x1", "y1"), row[1:], strict=True)
            if v
        )
        + f'<void property="type"><int>{row[0]}</int></void></object></void>'
        for k, row in enumerate(rows)
    )
    colours = {1: "BLACK_0", 2: "RED_1", 4: "CYAN_3"}
    texts = {
        "cp": "\n".join(" ".join(str(x) for x in row) for row in rows),
        "opx": f'<?xml version="1.0" encoding="UTF-8"?><java><object class="oripa.DataSet">{lines}</object></java>',
        "ori": json.dumps(
            {"lineSegments": [{"a": f"{x},{y}", "b": f"{u},{v}", "color": colours[k]} for k, x, y, u, v in rows]}
        ),
    }
    for suffix, text in texts.items():
        (tmp_path / f"p.{suffix}").write_text(text, encoding="utf-8")
        sheet, faults = with_pattern(Sheet(pattern=f"p.{suffix}", scale="1 mm", thickness="0.1 mm"), tmp_path)
        assert not faults and Counter(sheet.assignment or ()) == {"B": 4, "M": 1}
        assert sheet.notes[0] == "1 auxiliary line is a flat crease" and "bound no facet" in sheet.notes[1]
        assert np.ptp(np.array(sheet.vertices), axis=0).tolist() == pytest.approx([0.009, 0.009, 0.0])
    (tmp_path / "bad.cp").write_text("2 0 0 1\n", encoding="utf-8")
    _, faults = with_pattern(Sheet(pattern="bad.cp", scale="1 mm", thickness="0.1 mm"), tmp_path)
    assert "has line 1 with '2 0 0 1'; a line has a kind" in str(faults[0])


def test_text_of_xml_files(tmp_path: Path) -> None:
    """Encodings that the file names, UTF-16, and entities of Illustrator."""
    text = svg(FRAME, VALLEY, "<!-- \u00e4 -->")
    entity = text.replace('"http://www.w3.org/2000/svg"', '"&ns;"')
    files = {
        "latin": b'<?xml version="1.0" encoding="iso-8859-1"?>' + text.encode("latin-1"),
        "utf16": text.encode("utf-16"),
        "entity": ('<!DOCTYPE svg [ <!ENTITY ns "http://www.w3.org/2000/svg"> ]>' + entity).encode(),
    }  # fmt: skip
    for name, data in files.items():
        (tmp_path / f"{name}.svg").write_bytes(data)
        sheet, faults = with_pattern(Sheet(pattern=f"{name}.svg", scale="1 mm", thickness="0.1 mm"), tmp_path)
        assert not faults and len(sheet.faces or ()) == 2


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (['<path stroke="red" d="M', "1e" * 400_000, '"/>'], "a path with 'e1e1e1e1e1e1e1e1e1e1...' among"),
        (['<g transform="', "a(" * 400_000, '"/>'], "is not a list of functions"),
        (["<style>", "a" * 400_000, "/*" * 200_000, "</style>"], None),
        (["<style>", "g " * 400_000, "line{stroke:red}</style>", "<g>" * 2000, "</g>" * 2000], None),
        (["<g/>" * 110_000], "more than 100,000 elements"),
        (["<defs><path id='a0' d='M0,0h1' stroke='grey'/>",
          *(f"<g id='a{k + 1}'>{f'<use href=chr#a{k}chr/>' * 20}</g>".replace("chr", "'") for k in range(9)),
          "</defs><use href='#a9'/>"], "more than 100,000 elements"),
        ([f'<path d="M{0.7 * k},40 H{1000 - 0.7 * k}" stroke="red"/>' for k in range(700)], "more than 400,000 pieces"),
    ],
)  # fmt: skip
def test_long_files_take_little_time(parts: list[str], message: str | None) -> None:
    """Texts that made regular expressions quadratic, and lines that multiply: refused, or read in linear time."""
    text = svg(FRAME, *parts)
    if message is None:
        assert len(read_svg(text, 1.0).faces) == 1
        return
    with pytest.raises(ValueError, match=message) as caught:
        read_svg(text, 1.0)
    assert len(str(caught.value)) < 200


def test_frames_are_made_when_they_are_asked_for() -> None:
    """Frames that inherit from each other: many are refused; the vertices of their common parent are read once."""
    frames = [{"frame_inherit": True, "frame_parent": k} for k in range(1500)]
    many = {"vertices_coords": [[k % 100, k // 100] for k in range(10_000)]} | {"file_frames": frames}
    with pytest.raises(ValueError, match="has no edges_vertices"):
        read_fold(json.dumps(many), 1.0)
    with pytest.raises(ValueError, match="has 2,000 frames; at most"):
        read_fold(json.dumps(many | {"file_frames": [{}] * 2000}), 1.0)
    two = fold(FOLDED, file_frames=[{"frame_inherit": True, "frame_classes": ["foldedForm"]}])
    assert read_fold(two, 1.0).notes == ("frame 0 of 2 is the start; sheet.frame selects another",)
