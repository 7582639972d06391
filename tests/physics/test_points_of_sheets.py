"""Contact points inside the facets of a sheet: bodies and obstacles do not pass between its nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.builders.scene import build_scene
from fsm.case.derived.contact_points import points_inside, sheet_parts, sheet_spacing
from fsm.errors import CaseError
from fsm.results.store import read_solution

SIDE, WIDTH, THICKNESS, DOWN = 0.08, 0.06, 1e-3, 5e-4
"""Sides and thickness of a sheet, and travel of the ball, m."""


def pressed(facets: str, radius: float) -> dict[str, Any]:
    """A ball pressed on the middle of a facet of a flat sheet, away from all nodes."""
    shape: dict[str, Any] = {"kind": "plate", "length": SIDE, "width": WIDTH, "mesh": [2, 2]}
    x, y = 0.3 * SIDE, 0.4 * WIDTH
    if facets == "bars":
        shape = {"kind": "zigzag", "columns": 2, "a": SIDE / 2, "b": WIDTH, "fold_angle": "0.01 deg"}
        x, y = SIDE / 4, 0.1 * WIDTH
    return {
        "sheet": shape | {"facets": facets, "thickness": THICKNESS, "support": [{"at": "edge left"}, {"at": "edge right"}]},
        "material": {"young": 3e9, "poisson": 0.3, "density": 1000.0, "damping": "1 ms"},
        "contact": {"law": "hertz", "stiffness": "1e7 N/m^1.5"},
        "scene": {
            "bodies": [
                {"name": "ball", "mass": 0.1, "inertia": [1e-5] * 3, "position": [x, y, radius + THICKNESS / 2 + 1e-5]}
            ]
        },
        "obstacle": [{"name": "round", "shape": "sphere", "radius": radius, "body": "ball"}],
        "drive": [{"body": "ball", "direction": [0, 0, -1], "travel": DOWN, "speed": "1 mm/s"}],
        "solve": {"method": "static"}, "save": {"every": "0.25 mm"},
    } | ({"crease": {"stiffness_per_length": 10.0}} if facets == "bars" else {})  # fmt: skip


@pytest.mark.parametrize("facets", ["bars", "flexible"])
def test_a_ball_does_not_pass_through_a_facet(facets: str, tmp_path: Path) -> None:
    """The ball sinks in by less than its travel, and the drive carries the contact force along its direction."""
    data = pressed(facets, 0.02)
    result = fsm.load(data, folder=tmp_path).run(tmp_path, figures=False)
    solution, force = read_solution(tmp_path / "result.h5"), result.summary["final_force"]
    assert -solution.pair_gap[-1].min() < 0.5 * DOWN
    assert force > 0.5
    # normals of the points beside the lowest one are inclined
    assert 0.97 * solution.pair_force[-1].max() < force <= solution.pair_force[-1].max() * (1.0 + 1e-6)


@pytest.mark.parametrize("facets", ["bars", "flexible"])
def test_points_represent_the_area_of_the_sheet(facets: str) -> None:
    scene = build_scene(fsm.load(pressed(facets, 0.02))._loaded.case)
    assert scene.built.touching is not None
    wanted, _ = sheet_spacing(scene)
    parts = sheet_parts(scene)
    points = scene.built.touching.points(parts)
    assert parts > 1 and scene.built.touching.longest_edge / parts <= wanted
    assert sum(point.area for point in points.values()) == pytest.approx(SIDE * WIDTH)
    assert sum(point.area for point in scene.built.touching.points(1).values()) == pytest.approx(SIDE * WIDTH)
    middle = sum(
        point.area * np.array(point.weights) @ scene.built.touching.positions[list(point.nodes)] for point in points.values()
    )
    triangles = scene.built.touching.positions[scene.built.touching.triangles]
    sizes = 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    np.testing.assert_allclose(middle, sizes @ triangles.mean(axis=1), atol=1e-9)
    assert len(points_inside(scene)) == len(points) - len(scene.built.touching.frames)


def test_a_ball_that_could_pass_between_the_points_is_a_fault() -> None:
    with pytest.raises(CaseError, match=r"at most 20,000; they are .* mm apart, .* enlarge it, or use a smaller sheet"):
        fsm.load(pressed("bars", 1e-4)).check()
