"""Crease patterns: geometry of the generators, facets, bend lines and places."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fsm.builders.patterns.cuts import facet_frames, quaternions
from fsm.builders.patterns.foldability import foldability
from fsm.builders.patterns.folding import fold_pattern
from fsm.builders.patterns.generators import cone, flasher, kresling, miura, miura_tube, tube, waterbomb, yoshimura, zigzag
from fsm.builders.patterns.of_sheet import place_of
from fsm.case.loading.load_case import load_case
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError
from fsm.views.pictures.sheet_picture import draw_sheet

SHAPES = {
    "miura": miura(4, 3, 0.03, 0.02, math.radians(55.0), math.radians(35.0)),
    "zigzag": zigzag(5, 0.02, 0.03, math.radians(40.0)),
    "waterbomb": waterbomb(3, 2, 0.02),
    "kresling": kresling(6, 2, 0.05, 0.04, math.radians(35.0)),
    "yoshimura": yoshimura(6, 3, 0.05, 0.02),
    "miura-tube": miura_tube(3, 0.04, 0.06, math.radians(70.0), math.radians(80.0)),
}


def interior_sums(pattern: Pattern, values: np.ndarray) -> dict[int, float]:
    """Sum of the values of the edges at each vertex without boundary edges."""
    on_boundary = {v for edge, letter in zip(pattern.edges, pattern.assignment, strict=True) if letter == "B" for v in edge}
    sums: dict[int, float] = {}
    for edge, value in zip(pattern.edges, values, strict=True):
        for vertex in set(edge.tolist()) - on_boundary:
            sums[vertex] = sums.get(vertex, 0.0) + float(value)
    return sums


@pytest.mark.parametrize("fold", [1e-3, 0.6, 1.5])
def test_miura_panels(fold: float) -> None:
    """Panels are parallelograms with the given sides and sector angle at the fold angle with the mean plane."""
    a, b, sector = 0.03, 0.02, math.radians(55.0)
    pattern = miura(4, 3, a, b, sector, fold)
    assert len(pattern.faces) == 12 and len(pattern.vertices) == 20
    for face in pattern.faces:
        p = pattern.vertices[list(face)]
        along_x, along_y = p[1] - p[0], p[3] - p[0]
        assert np.linalg.norm(along_x) == pytest.approx(b) and np.linalg.norm(along_y) == pytest.approx(a)
        cosine = abs(along_x @ along_y) / (a * b)
        assert cosine == pytest.approx(math.cos(sector))
        np.testing.assert_allclose(p[2], p[1] + p[3] - p[0], atol=1e-15)
    np.testing.assert_allclose(np.abs(pattern.normals()[:, 2]), math.cos(fold), rtol=1e-12)
    left, right = (pattern.vertices[list(pattern.groups[name]), 0] for name in ("left", "right"))
    assert np.ptp(left) == np.ptp(right) == 0.0 and right[0] > left[0]


def test_miura_fold_angles_and_assignment() -> None:
    """The closed form of both fold angles; each inner vertex has three folds of one kind and one of the other."""
    fold, sector = math.radians(35.0), math.radians(55.0)
    pattern = SHAPES["miura"]
    angles = pattern.fold_angles()
    inner = np.array([letter in "MV" for letter in pattern.assignment])
    along_row = np.isclose(pattern.lengths, 0.02)
    np.testing.assert_allclose(np.abs(angles[inner & along_row]), 2.0 * fold, rtol=1e-12)
    other = 2.0 * math.asin(math.sin(fold) * math.cos(sector) / math.sqrt(1.0 - (math.sin(fold) * math.sin(sector)) ** 2))
    np.testing.assert_allclose(np.abs(angles[inner & ~along_row]), other, rtol=1e-12)
    kinds = interior_sums(pattern, np.sign(angles))
    assert len(kinds) == 6 and set(np.abs(list(kinds.values()))) == {2.0}


def test_a_valley_is_positive() -> None:
    """Two squares whose outer sides rise towards the normals fold as a valley."""
    vertices = np.array([[0, 0, 0], [0, 1, 0], [-0.8, 1, 0.6], [-0.8, 0, 0.6], [0.8, 0, 0.6], [0.8, 1, 0.6]], dtype=float)
    pattern = Pattern.of_faces(vertices, [(0, 1, 2, 3), (0, 4, 5, 1)])
    assert (pattern.normals()[:, 2] > 0.0).all()
    assert [letter for letter in pattern.assignment if letter != "B"] == ["V"]
    assert pattern.fold_angles().max() == pytest.approx(2.0 * math.asin(0.6))


@pytest.mark.parametrize("name", SHAPES)
def test_faces_join(name: str) -> None:
    """Euler characteristic of a disc or a tube, and normals on one side of neighbouring flat faces."""
    pattern = SHAPES[name]
    closed = name in ("kresling", "yoshimura", "miura-tube")
    assert len(pattern.vertices) - len(pattern.edges) + len(pattern.faces) == (0 if closed else 1)
    left, right = pattern.edge_faces.T
    boundary = np.array([letter == "B" for letter in pattern.assignment])
    np.testing.assert_array_equal((left < 0) | (right < 0), boundary)
    if pattern.flat is not None:
        flat = np.column_stack([pattern.flat, np.zeros(len(pattern.flat))])
        assert (pattern.normals(flat)[:, 2] > 1.0 - 1e-12).all()
        lengths = np.linalg.norm(np.diff(flat[pattern.edges], axis=1)[:, 0], axis=1)
        np.testing.assert_allclose(lengths, pattern.lengths, rtol=1e-12)


def test_waterbomb_vertices_fold_flat() -> None:
    """Maekawa's condition at every inner vertex: the numbers of mountains and valleys differ by 2."""
    pattern = SHAPES["waterbomb"]
    kinds = interior_sums(pattern, np.sign(pattern.target))
    assert len(kinds) > 5 and set(kinds.values()) <= {-2.0, 2.0}


def test_kresling_rings() -> None:
    """All triangles are congruent, and the sides between the rings have alternate assignments."""
    pattern = SHAPES["kresling"]
    sides = {tuple(sorted(np.round(np.linalg.norm(np.roll(p, 1, axis=0) - p, axis=1), 12)))
             for p in (pattern.vertices[list(face)] for face in pattern.faces)}  # fmt: skip
    assert len(sides) == 1
    between = Counter(
        letter for (u, v), letter in zip(pattern.edges, pattern.assignment, strict=True)
        if pattern.vertices[u, 2] != pattern.vertices[v, 2]
    )  # fmt: skip
    assert between["M"] == between["V"] == 12


@pytest.mark.parametrize("fold", [0.3, 1.5])
def test_miura_tube_panels(fold: float) -> None:
    """Facets are flat parallelograms with the given sides and angle, normals point outwards, and the volume is exact."""
    a, b, sector = 0.04, 0.06, math.radians(70.0)
    pattern = miura_tube(3, a, b, sector, fold)
    volume = 0.0
    for face in pattern.faces:
        p = pattern.vertices[list(face)]
        ring, along = p[1] - p[0], p[3] - p[0]
        assert np.linalg.norm(along) == pytest.approx(b) and np.linalg.norm(ring) == pytest.approx(a)
        assert abs(along @ ring) / (a * b) == pytest.approx(math.cos(sector))
        np.testing.assert_allclose(p[2], p[1] + p[3] - p[0], atol=1e-15)
        volume += float((p.mean(axis=0) * [0.0, 1.0, 1.0]) @ np.cross(ring, along)) / 2.0
    assert volume == pytest.approx(3.0 * a * a * b * math.sin(sector) ** 2 * math.sin(2.0 * fold))


def test_facet_moments() -> None:
    """Moments of a rectangle, and of a triangle as a half of it, about principal axes."""
    rectangle = facet_frames(zigzag(1, 0.04, 0.03, 0.0))
    assert rectangle.area[0] == pytest.approx(0.04 * 0.03)
    np.testing.assert_allclose(rectangle.moments[0], [0.04 * 0.03**3 / 12.0, 0.03 * 0.04**3 / 12.0], rtol=1e-12)
    corners = np.array([[0.1, 0.2, 0.3], [0.14, 0.2, 0.3], [0.1, 0.23, 0.3]])
    triangle = facet_frames(Pattern.of_faces(corners, [(0, 1, 2)]))
    np.testing.assert_allclose(triangle.centre[0], corners.mean(axis=0))
    assert triangle.moments[0].sum() == pytest.approx(0.04 * 0.03 * (0.04**2 + 0.03**2) / 36.0)
    back = triangle.centre[0] + triangle.outlines[0] @ triangle.axes[0][:, :2].T
    np.testing.assert_allclose(back, corners, atol=1e-15)


def test_quaternions_of_all_quadrants() -> None:
    rng = np.random.default_rng(5)
    q = rng.normal(size=(200, 4))
    q /= np.linalg.norm(q, axis=1)[:, None]
    w, x, y, z = q.T
    matrices = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]).transpose(2, 0, 1)  # fmt: skip
    found = quaternions(matrices)
    np.testing.assert_allclose(np.abs(np.sum(found * q, axis=1)), 1.0, rtol=1e-12)


def test_bend_lines_take_the_short_diagonal() -> None:
    pattern = SHAPES["miura"].with_bend_lines()
    assert len(pattern.faces) == 24 and Counter(pattern.assignment)["J"] == 12
    corners = [SHAPES["miura"].vertices[list(face)] for face in SHAPES["miura"].faces]
    short = min(np.linalg.norm(p[[0, 1]] - p[[2, 3]], axis=1).min() for p in corners)
    lines = [k for k, letter in enumerate(pattern.assignment) if letter == "J"]
    np.testing.assert_allclose(pattern.lengths[lines], short)
    assert (pattern.edge_faces[lines] >= 0).all()
    np.testing.assert_allclose(pattern.fold_angles()[lines], 0.0, atol=1e-7)


def test_bend_lines_of_a_concave_face_lie_inside() -> None:
    corners = np.array([[0, 0, 0], [4, 0, 0], [4, 3, 0], [2, 0.5, 0], [0, 3, 0]], dtype=float)
    whole = Pattern.of_faces(corners, [(0, 1, 2, 3, 4)])
    pattern = whole.with_bend_lines()
    assert facet_frames(pattern).area.sum() == pytest.approx(facet_frames(whole).area[0])
    assert (pattern.normals()[:, 2] > 0.0).all()


def test_places() -> None:
    pattern = SHAPES["miura"]
    assert place_of(pattern, "edge left").vertices == (0, 1, 2, 3)
    assert place_of(pattern, "vertices 3, 1").vertices == (2, 0)
    assert place_of(pattern, "facet 12").facet == 11
    right = float(pattern.vertices[:, 0].max())
    assert place_of(pattern, ((right, -1.0, -1.0), (right, 1.0, 1.0))).vertices == pattern.groups["right"]


@pytest.mark.parametrize(
    ("at", "message"),
    [
        ("edge front", 'its edges are "edge left", "edge right", "edge bottom", "edge top"'),
        ("vertex 21", "there is no number 21; the sheet has 20 vertices"),
        ("facet 0", "there is no number 0; the sheet has 12 facets"),
        ("corner", "is not a place of the sheet"),
        (((1.0, 1.0, 1.0), (2.0, 2.0, 2.0)), "the box contains no vertex of the sheet, which extends over x 0 to"),
    ],
)
def test_unknown_places(at: object, message: str) -> None:
    with pytest.raises(ValueError, match=message.replace("(", r"\(")):
        place_of(SHAPES["miura"], at)  # type: ignore[arg-type]


def test_faces_of_opposite_orientation_are_refused() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    with pytest.raises(ValueError, match="two faces on one side"):
        Pattern.of_faces(corners, [(0, 1, 2), (0, 3, 2), (0, 1, 3)])


def test_picture_of_a_pattern(tmp_path: Path) -> None:
    """`fsm preview` of a sheet writes a PNG, and refuses other names."""
    case = load_case(Path(__file__).parents[2] / "folding_cases" / "fold_file" / "case.toml").case
    draw_sheet(case, tmp_path / "pattern.png")
    assert (tmp_path / "pattern.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(CaseError, match=r"give --out FILE\.png"):
        draw_sheet(case, tmp_path / "pattern.gif")


@pytest.mark.parametrize("kind", ["flexible", "plate", "boom"])
def test_picture_of_a_mesh(kind: str, tmp_path: Path) -> None:
    template = Path(__file__).parents[2] / "fsm" / "cli" / "templates" / f"{kind}.toml"
    draw_sheet(load_case(template).case, tmp_path / "mesh.png")
    assert (tmp_path / "mesh.png").read_bytes().startswith(b"\x89PNG")


def test_conditions_for_folding_at_inner_vertices() -> None:
    """A Miura sheet and a waterbomb sheet fold flat; a moved vertex, other letters or three creases prevent it."""
    for pattern in (miura(4, 4, 1.0, 1.2, 1.1, 0.4), waterbomb(3, 3, 1.0)):
        found = foldability(pattern)
        assert found is not None and found.folds_flat and len(found.inner) >= 9
    sheet = miura(2, 2, 1.0, 1.2, 1.1, 0.4)
    assert sheet.flat is not None
    moved = sheet.flat.copy()
    moved[4] += [0.05, 0.02]
    assert foldability(replace(sheet, flat=moved)) == ((4,), (), (), (4,), ())
    letters = ["V" if letter == "M" else letter for letter in sheet.assignment]
    assert foldability(sheet.assigned(letters, sheet.target)) == ((4,), (), (4,), (), (4,))
    places = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-0.5, 0.9, 0.0], [-0.5, -0.9, 0.0]])
    star = Pattern.of_faces(places, [[0, 1, 2], [0, 2, 3], [0, 3, 1]], places[:, :2])
    found = foldability(star.assigned(["V" if letter != "B" else "B" for letter in star.assignment], star.target))
    assert found is not None and found.rigid == (0,)
    assert foldability(kresling(6, 1, 1.0, 1.0, 0.5)) is None


@pytest.mark.parametrize(
    ("lines", "blocked"),
    [
        ({0: "V", 90: "V", 180: "V", 270: "M"}, True),  # two straight lines that cross
        ({0: "V", 90: "V", 180: "V", 270: "M", 315: "J"}, False),  # a bend line helps
        ({0: "V", 80: "V", 180: "V", 260: "M"}, True),
        ({0: "V", 100: "V", 220: "V", 290: "M"}, False),
        ({0: "M", 100: "M", 200: "M", 290: "M"}, True),
        ({45: "V", 135: "V", 225: "V", 315: "V", 0: "M", 180: "M"}, False),  # waterbomb
        ({0: "V", 30: "V", 60: "M", 120: "M"}, True),
    ],
)
def test_mountains_and_valleys_that_fold_from_flat(lines: dict[int, str], blocked: bool) -> None:
    """Condition of Abel et al. at one vertex; where it holds, a state with all creases on their sides exists."""
    order = sorted(lines)
    turns = np.radians(order)
    places = np.vstack([np.zeros(2), np.column_stack([np.cos(turns), np.sin(turns)])])
    count = len(order)
    faces = [[0, k, k % count + 1] for k in range(1, count + 1)]
    if max(np.diff([*order, order[0] + 360])) > 180:  # a wide sector has an additional corner
        faces[-1] = [0, count, count + 1, 1]
        places = np.vstack([places, -places[1:].mean(axis=0)])
    pattern = Pattern.of_faces(np.column_stack([places, np.zeros(len(places))]), faces, places)
    letters = ["B" if 0 not in edge else lines[order[max(edge) - 1]] for edge in pattern.edges.tolist()]
    pattern = pattern.assigned(letters, [{"M": -math.pi, "V": math.pi}.get(letter, 0.0) for letter in letters])
    found = foldability(pattern, bends=True)
    assert found is not None and (found.blocked == (0,)) is blocked and found.rigid == ()
    if not blocked and "J" not in letters:
        angles = fold_pattern(pattern, 0.2).fold_angles()
        signs = {"M": -1.0, "V": 1.0}
        assert all(signs[letter] * angle > 0.02 for letter, angle in zip(letters, angles, strict=True) if letter in "MV")


def test_pleated_cone_folds_with_rigid_facets() -> None:
    """Mountains and valleys alternate; a folded state keeps the facets, and all pleats have the same angles."""
    ring = cone(5, 0.02, 0.06)
    assert Counter(ring.assignment) == {"B": 20, "M": 5, "V": 5}
    assert len(ring.groups["inner"]) == len(ring.groups["outer"]) == 10
    folded = fold_pattern(ring, 0.4)
    np.testing.assert_allclose(folded.lengths, ring.lengths, rtol=1e-10)
    angles = folded.fold_angles()
    for letter, sign in (("M", -1.0), ("V", 1.0)):
        own = sign * angles[[k for k in range(len(angles)) if ring.assignment[k] == letter]]
        assert own.min() > math.radians(20.0)
        assert np.ptp(own) < 1e-6


@pytest.mark.parametrize("sides", [3, 4, 6, 11])
def test_flasher_has_its_folded_state(sides: int) -> None:
    """Facets that turn about the creases by their targets meet again around each corner, with walls of the height."""
    sheet = flasher(sides, 0.1, 0.03)
    assert sheet.flat is not None and Counter(sheet.assignment) == {"B": 2 * sides, "V": 2 * sides, "M": sides}
    np.testing.assert_allclose(np.linalg.norm(sheet.flat[sides : 2 * sides], axis=1), 0.1)
    found = foldability(sheet)
    assert found is not None and found.inner == tuple(range(sides)) and found.blocked == ()
    edges = {frozenset(edge): angle for edge, angle in zip(sheet.edges.tolist(), sheet.target, strict=True)}
    for corner in range(sides):
        turn = np.eye(3)
        for other in ((corner + 1) % sides, sides + corner, 2 * sides + corner, (corner - 1) % sides):
            x, y = sheet.flat[other] - sheet.flat[corner]
            along = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]]) / math.hypot(x, y)
            angle = edges[frozenset((corner, other))]
            turn = turn @ (np.eye(3) + math.sin(angle) * along + (1.0 - math.cos(angle)) * along @ along)
        np.testing.assert_allclose(turn, np.eye(3), atol=1e-12)
    with pytest.raises(ValueError, match=r"height = 0\.1 m leaves no hub; it must be less than"):
        flasher(sides, 0.1, 0.1)


def test_folded_tube_has_the_conditions_of_flat_folding() -> None:
    """Three layers of a flattened tube: all inner vertices fold flat, and mirrored rows give the shape of a Z."""
    sheet = tube(4, 0.05, 0.03)
    assert sheet.flat is not None
    np.testing.assert_allclose(np.ptp(sheet.flat, axis=0), [2.0 * math.pi * 0.05, 0.12])
    found = foldability(sheet)
    assert found is not None and found.folds_flat and len(found.inner) == 3
    across = [k for k in sheet.creases if abs(np.diff(sheet.flat[sheet.edges[k], 0])[0]) > 0.0]
    letters = {tuple(np.round(sheet.flat[sheet.edges[k]].mean(axis=0), 6)): sheet.assignment[k] for k in across}
    for (x, y), letter in letters.items():
        for (other_x, other_y), other in letters.items():
            steps = round((y - other_y) / 0.03) + (abs(x - other_x) > 0.05)
            assert (letter == other) == (steps % 2 == 0)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"kind": "cone", "sides": 5, "inner_radius": 0.1, "outer_radius": 0.1}, "must be less than outer_radius"),
        ({"kind": "cone", "sides": 5, "outer_radius": 0.1}, 'kind = "cone" needs `inner_radius`'),
        ({"kind": "tube", "rows": 5, "radius": 0.1, "height": 0.1, "a": 0.1}, '`a` is not used by kind = "tube"'),
    ],
)
def test_faults_of_cone_and_tube(keys: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Sheet.model_validate(keys | {"thickness": 1e-4})
