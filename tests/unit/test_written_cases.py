"""A case that is written and loaded again is equal; points of frames on rigid facets are saved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.results.store import read_solution

CASES = Path(__file__).parents[2] / "folding_cases"


@pytest.mark.parametrize("name", ["tape_spring/case.toml", "kresling/case.toml", "pleated_cone/case.toml"])
def test_a_shipped_case_is_equal_after_writing(name: str, tmp_path: Path) -> None:
    case = fsm.load(CASES / name)
    again = fsm.load(case.write(tmp_path / "case.toml"))
    assert again.model == case.model
    assert again.text == case.text


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
