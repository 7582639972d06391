"""Crease patterns from FOLD files."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from typing import Any

import numpy as np
import pytest

from fsm.case.pattern_files.fold_file import read_fold
from fsm.case.pattern_files.pattern import PatternFault, Reading
from tests.case_texts import FOLDED, SQUARE, fold


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


@pytest.mark.parametrize(
    ("base", "changes", "message", "places"),
    [
        (SQUARE, {"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 9]]}, "edge 4 with the vertices", [[0, 0]]),
        (SQUARE, {"edges_assignment": [*"BBBBX"]}, "edge 4 with the assignment 'X'", [[1, 1]]),
        (SQUARE, {"edges_assignment": [*"BBB"]}, "these numbers must be equal", [[0, 1], [1, 1]]),
        (SQUARE, {"edges_assignment": [*"BBBBMM"]}, "these numbers must be equal", [[1, 1]]),
        (SQUARE, {"edges_foldAngle": [0, 0, 0, 0, 90]}, "edge 4, a mountain, with the fold angle 90", [[1, 1]]),
        (SQUARE, {"faces_vertices": [[0, 1, 2], [0, 3], [2, 3, 3]]}, "(1 other face too)", [[0, 1], [2 / 3, 2]]),
        (SQUARE, {"faces_vertices": [[0, 1, 2]]}, "enclose 2 facets", [[2 / 3, 4 / 3]]),
        (SQUARE, {"faces_vertices": [[0, 1, 2], [0, 1, 3]]}, "enclose no such facet", [[2 / 3, 4 / 3], [2 / 3] * 2]),
        (SQUARE, {"vertices_coords": [[0, 0], [2, 0], [2, 2], [0, "a"]]}, "vertex 3 is", [[1, 1]]),
        (FOLDED, {"faces_vertices": [[0, 1, 2], [0, 3, 1], [0, 2, 1]]}, "two faces on one side", [[0, 0.5, 0]]),
        (FOLDED, {"edges_assignment": [*"VBBBQ"]}, "edge 4 with the assignment", [[0.4, 0.5, 0.3]]),
    ],
)
def test_places_of_faults_in_lists(base: dict[str, Any], changes: dict[str, Any], message: str, places: list[Any]) -> None:
    """Vertices, edges and faces with faults have their places (in cm of the square), among the edges that can be drawn."""
    with pytest.raises(PatternFault, match=re.escape(message)) as raised:
        read_fold(fold(base, **changes), 1.0)
    fault = raised.value
    wanted = np.array([[*row, 0.0][: fault.places.shape[1]] for row in places])
    if changes.keys() == {"vertices_coords"}:
        wanted = wanted * 0.01  # the unit of the file
    np.testing.assert_allclose(fault.places, wanted, atol=1e-12)
    assert 3 <= len(fault.lines) == len(fault.letters)


def test_edges_of_faces_without_edges() -> None:
    """Common sides of faces are unassigned creases; overlapping faces are refused."""
    faces = [[0, 1, 2], [0, 2, 3]]
    pattern = read_fold(fold(SQUARE, edges_vertices=None, edges_assignment=None, faces_vertices=faces), 1.0)
    assert Counter(pattern.assignment) == {"B": 4, "U": 1}
    assert pattern.notes == ("the file has no edges_vertices; the common sides of its faces are unassigned creases",)
    with pytest.raises(PatternFault, match="has no edges_vertices, and the sides of its faces are no pattern: edges cross"):
        read_fold(fold(SQUARE, edges_vertices=None, edges_assignment=None, faces_vertices=[*faces, [0, 1, 3]]), 1.0)
