"""Patterns of lines of all formats: near points, holes, parts, and files of ORIPA and Oriedita."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.file import with_pattern
from fsm.case.pattern_files.fold_file import read_fold
from fsm.case.pattern_files.pattern import Line, PatternFault, Reading
from fsm.case.pattern_files.planar import planar_pattern
from fsm.case.pattern_files.svg_file import read_svg
from tests.case_texts import FOLDED, fold

HEAD = '<svg xmlns="http://www.w3.org/2000/svg">'
FRAME = '<rect x="10" y="20" width="100" height="60" fill="none" stroke="#000000"/>'
VALLEY = '<line x1="10" y1="50" x2="110" y2="50" stroke="#0000FF" opacity="0.5"/>'




def svg(*parts: str) -> str:
    return HEAD + "".join(parts) + "</svg>"


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
