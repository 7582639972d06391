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
        (FOLDED, {"faces_vertices": None}, "folded frame without faces_vertices"),
        (FOLDED, {"faces_vertices": [[0, 1, 2], [0, 1, 3]]}, "two faces on one side"),
        (FOLDED, {"faces_vertices": [[0, 1, 2, 3]]}, "which is not planar"),
        (FOLDED, {"faces_vertices": [[0, 1, 7]]}, "has face 0 with the vertices"),
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
    """A rotated and moved group; ends that miss the frame by little are on it."""
    line = '<g transform="translate(60 50) rotate(90)"><line x1="-30.02" y1="0" x2="29.99" y2="0" stroke="blue"/></g>'
    pattern = read_svg(svg(FRAME, line), 1.0)
    assert len(pattern.faces) == 2 and Counter(pattern.assignment)["V"] == 1


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
    ],
)
def test_svg_files_that_are_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_svg(text, 1.0)


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
