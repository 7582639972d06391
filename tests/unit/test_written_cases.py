"""A case that is written and loaded again is equal; points of frames on rigid facets are saved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.builders.scene import build_scene
from fsm.case.loading.table import load_table
from fsm.results.store import read_solution

CASES = Path(__file__).parents[2] / "folding_cases"


WRITTEN = sorted(path for path in CASES.glob("*/*.toml") if path.name != "calibration.toml")
FILES = Path(__file__).parents[2] / "fsm" / "cli" / "templates"


def same(one: Any, other: Any) -> bool:
    """Whether two values are equal, with all that objects of scenes contain; arrays are equal to the last bit."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    parts = [getattr(value, "__dict__", {}) | (getattr(value, "__pydantic_private__", None) or {}) for value in (one, other)]
    return same(*parts) if parts[0] else bool(one == other)


def check_written(case: fsm.Case, path: Path) -> None:
    """Check that a case is equal after writing: its model, its text, a second file, and its scene."""
    again = fsm.load(case.write(path))
    assert again.model == case.model
    assert again.text == case.text
    assert again.write(path.with_name("again.toml")).read_text(encoding="utf-8") == path.read_text(encoding="utf-8")
    if case.model.membrane is None and case.model.scissor is None:
        assert same(build_scene(again.model), build_scene(case.model))


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_a_shipped_case_is_equal_after_writing(path: Path, tmp_path: Path) -> None:
    check_written(fsm.load(path), tmp_path / "case.toml")


@pytest.mark.parametrize("path", sorted(FILES.glob("*.toml")), ids=lambda path: path.stem)
def test_a_template_is_equal_after_writing(path: Path, tmp_path: Path) -> None:
    check_written(fsm.load(path), tmp_path / "case.toml")


@pytest.mark.parametrize("base", ["tape_spring", "strip_pull", "kresling"])
def test_rows_of_a_table_are_equal_after_writing(base: str, tmp_path: Path) -> None:
    """Rows with random numbers in other units: of a sheet with `mirror`, of a strip, and of bars."""
    columns = {
        "tape_spring": {"sheet.thickness": (0.02, 0.4, "mm"), "material.density": (2, 9, "g/cm^3")},
        "strip_pull": {"strip.fold_angle": (0.3, 1.5, "rad"), "drive.0.travel": (1, 9, "mm")},
        "kresling": {"sheet.thickness": (50, 500, "um"), "sheet.radius": (1, 9, "cm"), "material.young": (1, 9, "GPa")},
    }[base]  # fmt: skip
    random = np.random.default_rng(7)
    rows = [
        ", ".join(f"{random.uniform(low, high)!r} {unit}" for low, high, unit in columns.values()) for _ in range(3)
    ]  # fmt: skip
    table = tmp_path / "table.csv"
    table.write_text("\n".join([f"# base = {CASES / base / 'case.toml'}", ", ".join(columns), *rows]), encoding="utf-8")
    for row in load_table(table):
        check_written(fsm.Case(row.loaded, {}), tmp_path / "case.toml")


SHEET: dict[str, Any] = {
    "vertices": [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0.2, 0.05, 0], [0.1, 0.05, 0], [0, 0.05, 0]],
    "edges": [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0], [1, 4]],
    "assignment": ["B", "B", "B", "B", "B", "B", "M"],
    "angles": [0, 0, 0, 0, 0, 0, -0.5], "faces": [[0, 1, 4, 5], [1, 2, 3, 4]], "thickness": 1e-3,
}  # fmt: skip


def sheet(facets: str, support: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "sheet": SHEET | {"facets": facets, "support": [support]} | ({"mesh_size": 0.02} if facets == "flexible" else {}),
        "material": {"young": 3e9, "density": 2000.0},
        "crease": {"stiffness_per_length": 0.1},
        "solve": {"method": "static", "end_time": 1.0},
    } | more


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_mirrored_edge_is_equal_after_writing(axis: str, tmp_path: Path) -> None:
    case = fsm.load(sheet("flexible", {"at": "edge left", "mirror": axis}, gravity=[0.0, 0.0, -9.81]), folder=tmp_path)
    again = fsm.load(case.write(tmp_path / "case.toml"))
    assert again.model == case.model


@pytest.mark.parametrize("facets", ["rigid", "bend-lines"])
def test_points_of_frames_on_rigid_facets_are_saved(facets: str, tmp_path: Path) -> None:
    """The frame is at a corner of the second facet; a point has the distance of its `at` from the corner."""
    frame = {"name": "corner", "on": "sheet", "place": "vertex 3"}
    points = {"tip": {"body": "corner"}, "beside": {"body": "corner", "at": [0.0, 0.0, 0.01]}}
    case = sheet(
        facets, {"at": "facet 1"}, scene={"frames": [frame]}, save={"channels": ["point.*"], "points": points},
    )  # fmt: skip
    fsm.load(case, folder=tmp_path).run(tmp_path, figures=False)
    found = read_solution(tmp_path / "result.h5").channels
    tip, beside = (np.asarray(found[f"point.{name}.position"].values) for name in points)
    np.testing.assert_allclose(tip[0], [0.2, 0.0, 0.0], atol=1e-9)
    # the second facet turns about the crease at x = 0.1
    np.testing.assert_allclose(np.hypot(tip[:, 0] - 0.1, tip[:, 2]), 0.1, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(beside - tip, axis=1), 0.01, atol=1e-12)


@pytest.mark.parametrize("outline", ["sheet", "plate"])
def test_a_box_and_vertices_are_mirrored_as_the_edge(outline: str, tmp_path: Path) -> None:
    """Edge bottom, its vertices, and a box around its nodes hold the same vectors; a box beside it holds only its part."""

    def held(at: Any) -> dict[int, set[int]]:
        case = sheet("flexible", {"at": at, "mirror": "y"})
        if outline == "plate":
            plate = {"kind": "plate", "facets": "flexible", "length": 0.2, "width": 0.05, "thickness": 1e-3, "mesh": [8, 3]}
            plate["support"] = case["sheet"]["support"]
            case = {key: case[key] for key in ("material", "solve")} | {"sheet": plate}
        facets = build_scene(fsm.load(case, folder=tmp_path).model).built.facets
        assert facets is not None
        return dict(facets.held)

    ends = {"sheet": "vertices 2, 1, 3", "plate": "vertices 1, 2"}[outline]
    edge = held("edge bottom")
    assert len(edge) > 10
    assert held([[-1.0, 0.0, -1.0], [1.0, 0.0, 1.0]]) == edge
    assert held(ends) == edge
    left = held([[-1.0, 0.0, -1.0], [0.1, 0.0, 1.0]])
    assert set(left) < set(edge)
    for at, message in (
        ({"sheet": "vertices 1, 4", "plate": "vertices 1, 3"}[outline], "is not a part of the outline"),
        ([[0.01, 0.01, -1.0], [0.06, 0.04, 1.0]], "is not a part of the outline"),
        ("facet 1", "is not a part of the outline"),
        ([[-1.0, -1.0, -1.0], [0.06, 1.0, 1.0]], "is not a part of the outline"),
        ("edge left", "extends from 0 to 0.05 m along y, so it is in no plane normal to y"),
    ):
        with pytest.raises(fsm.CaseError, match=message):
            held(at)
