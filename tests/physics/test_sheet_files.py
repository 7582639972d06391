"""Export of sheets to FOLD files, and creases with their own laws."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from fsm.analyses.sheet_motion import vertices_of
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.builders.scene import build_scene
from fsm.case.loading.load_case import load_case
from fsm.case.pattern_files.fold_file import read_fold
from fsm.case.pattern_files.pattern import Pattern
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.results.store import read_solution
from fsm.run.run_case import run_case

CASES = Path(__file__).parents[2] / "folding_cases"
MIURA = ["sheet.columns=4", "sheet.rows=3", "drive.0.travel=1.0", "save.every=0.5"]
FLAT = ["save.interval=50"]


def exported(name: str, changes: list[str], folder: Path) -> tuple[Any, Pattern, str]:
    """Solution, pattern at the start, and text of the exported file."""
    loaded = load_case(CASES / name / "case.toml", changes)
    run_case(loaded, folder / "out", progress=False, figures=False)
    result = CliRunner().invoke(cli, ["export", str(folder / "out"), "--to", "fold"])
    assert result.exit_code == 0, result.output
    text = (folder / "out" / "result.fold").read_text(encoding="utf-8")
    return read_solution(folder / "out" / "result.h5"), pattern_of(loaded.case.sheet), text


def assert_equal(one: Pattern, other: Pattern, rows: np.ndarray | None = None) -> None:
    """Same vertices, edges, letters, angles and faces; `rows` are the vertices of `other` in the order of `one`."""
    rows = np.arange(len(one.vertices)) if rows is None else rows
    size = one.extent()
    np.testing.assert_allclose(one.vertices, other.vertices[rows], atol=1e-12 * size)

    def edges(pattern: Pattern, number: np.ndarray) -> dict[frozenset[int], tuple[str, float]]:
        pairs = (frozenset((int(number[u]), int(number[v]))) for u, v in pattern.edges)
        angles = np.round(np.nan_to_num(pattern.target), 9)
        return dict(zip(pairs, zip(pattern.assignment, angles.tolist(), strict=True), strict=True))

    back = np.argsort(rows)
    assert edges(one, np.arange(len(rows))) == edges(other, back)
    faces = [{frozenset(int(number[v]) for v in face) for face in p.faces}
             for p, number in ((one, np.arange(len(rows))), (other, back))]  # fmt: skip
    assert faces[0] == faces[1]


@pytest.mark.parametrize(
    ("name", "changes"),
    [("miura_push", MIURA), ("kresling", ["sheet.sides=5", "solve.end_time=0.05"]),
     ("miura_push", [*MIURA, 'sheet.facets="bend-lines"', "sheet.bend_stiffness_per_length=1"])],
)  # fmt: skip
def test_folded_pattern_and_motion_are_read_back(name: str, changes: list[str], tmp_path: Path) -> None:
    solution, pattern, text = exported(name, changes, tmp_path)
    assert_equal(pattern, read_fold(text, None, 1))
    places = vertices_of(solution)
    frames = json.loads(text)["file_frames"]
    assert len(frames) == len(solution)
    for number, at in enumerate(places):
        read = read_fold(text, None, number + 1)
        np.testing.assert_allclose(read.vertices, at, atol=1e-12)
        inner = [angle for angle in frames[number]["edges_foldAngle"] if angle is not None]
        np.testing.assert_allclose(np.degrees(pattern.fold_angles(at))[pattern.creases], inner, atol=1e-9)
    if pattern.flat is not None:
        flat = read_fold(text, None, 0)
        np.testing.assert_allclose(np.sort(flat.lengths), np.sort(pattern.lengths), rtol=1e-9)


def test_flexible_facets_are_written_by_their_triangles(tmp_path: Path) -> None:
    """Nodes and creases of the mesh at each record; the nodes of the driven edge move by the travel."""
    changes = ["sheet.columns=2", "sheet.rows=2", "drive.0.travel=0.2", "save.every=0.1"]
    solution, pattern, text = exported("miura_push", [*changes, "sheet.facets=flexible", "sheet.mesh_size=1.0"], tmp_path)
    start, last = (read_fold(text, None, number) for number in (1, len(solution)))
    assert len(start.faces) == 4 * 2 * 2 * 2
    assert sum(start.lengths[[letter in "MV" for letter in start.assignment]]) == pytest.approx(
        sum(pattern.lengths[pattern.creases]), rel=1e-6
    )
    x = start.vertices[:, 0]
    moved = vertices_of(solution)[-1] - vertices_of(solution)[0]
    np.testing.assert_allclose(moved[x < 1e-6, 0], 0.0, atol=1e-9)  # held
    assert moved[x > x.max() - 1e-6, 0].mean() == pytest.approx(-0.2, rel=1e-2)  # driven by springs
    np.testing.assert_allclose(last.vertices, vertices_of(solution)[-1], atol=1e-12)


def test_flat_pattern_is_read_back_with_its_fold_angles(tmp_path: Path) -> None:
    solution, pattern, text = exported("fold_file", FLAT, tmp_path)
    read = read_fold(text, None, 0)
    rows = np.array([int(np.argmin(np.linalg.norm(read.vertices - at, axis=1))) for at in pattern.vertices])
    assert_equal(pattern, read, rows)
    last = read_fold(text, None, len(solution))
    assert np.degrees(np.abs(last.start_angles()[last.creases])).min() > 150.0
    case = tmp_path / "case.toml"
    case.write_text((CASES / "fold_file" / "case.toml").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "pattern.fold").write_text(text, encoding="utf-8")
    loaded = load_case(case, ["sheet.frame=2", "sheet.fold_to=none"])
    np.testing.assert_allclose(pattern_of(loaded.case.sheet).vertices, vertices_of(solution)[1], atol=1e-12)


def test_results_without_a_pattern_and_unknown_frames_are_refused(tmp_path: Path) -> None:
    loaded = load_case(CASES / "dropped_plates" / "case.toml", ["solve.end_time=1e-3"])
    run_case(loaded, tmp_path, progress=False, figures=False)
    result = CliRunner().invoke(cli, ["export", str(tmp_path), "--to", "fold"])
    assert result.exit_code == 2 and "the result has no crease pattern" in result.output
    with pytest.raises(CaseError, match=r"has no frame 7 with vertices_coords; its frames are 0 to 0"):
        load_case(CASES / "fold_file" / "case.toml", ["sheet.frame=7"])


def stiffness_of(changes: list[str]) -> dict[str, tuple[float, float]]:
    """Stiffness over the length, and rest angle, of the joints of a Miura sheet by name."""
    case = load_case(CASES / "miura_push" / "case.toml", [*MIURA, *changes]).case
    scene, pattern = build_scene(case), pattern_of(case.sheet)
    names = [f"crease {k}" for k in range(1, len(pattern.creases) + 1)]
    lengths = dict(zip(names, pattern.lengths[pattern.creases], strict=True))
    found = {e.name: (e.rotation[1] / lengths[e.name], e.rest_angle) for e in scene.elements if e.name in lengths}
    assert list(found) == names
    return found


def test_creases_by_assignment_and_by_name() -> None:
    """Later items replace earlier ones; creases without an item have the common law."""
    plain = stiffness_of([])
    text = (
        'sheet.crease=[{of="mountain", stiffness_per_length=0.3}, {of="creases 1, 2", rest_angle="60 deg"}, '
        '{of="crease 2", stiffness_per_length=0.7}]'
    )
    own = stiffness_of([text])
    for name, (stiffness, rest) in own.items():
        before, start = plain[name]
        expected = 0.7 if name == "crease 2" else 0.3 if start < 0.0 else before
        assert stiffness == pytest.approx(expected)
        assert rest == pytest.approx(np.copysign(np.pi / 3.0, start) if name in ("crease 1", "crease 2") else start)
    assert {0.1, 0.3, 0.7} == {round(stiffness, 9) for stiffness, _ in own.values()}


@pytest.mark.parametrize(
    ("item", "message"),
    [
        ('{of="mountain"}', "sheet.crease.0: give `stiffness_per_length` or `rest_angle`; both are missing"),
        ('{of="hill", rest_angle=1}', 'sheet.crease.0.of: "hill" is not a kind or name of creases'),
        ('{of="crease 99", rest_angle=1}', "sheet.crease.0.of: there is no crease 99; the sheet has 17 creases"),
        ('{of="unassigned", rest_angle=1}', 'has no edge of the kind "unassigned"; it has boundary, mountain, valley'),
    ],
)
def test_faults_of_own_creases(item: str, message: str) -> None:
    with pytest.raises(CaseError) as error:
        build_scene(load_case(CASES / "miura_push" / "case.toml", [*MIURA, f"sheet.crease=[{item}]"]).case)
    assert message in str(error.value)
