"""Crease patterns from SVG files: colours, styles, shapes."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.file import with_pattern
from fsm.case.pattern_files.svg_file import read_svg

HEAD = '<svg xmlns="http://www.w3.org/2000/svg">'
FRAME = '<rect x="10" y="20" width="100" height="60" fill="none" stroke="#000000"/>'
VALLEY = '<line x1="10" y1="50" x2="110" y2="50" stroke="#0000FF" opacity="0.5"/>'


def svg(*parts: str) -> str:
    return HEAD + "".join(parts) + "</svg>"


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
        g:current(7) line { stroke: red } g:nth-child(9) line { stroke: red }
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
        'style rules that are not read: "g:current(7) line"',
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
