"""Bodies, cables and seams of a [scene] beside a [sheet], for rigid facets, bars and flexible facets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case
from fsm.results.solution import Solution
from fsm.results.store import read_solution

FACETS: dict[str, dict[str, Any]] = {
    "rigid": {"facets": "rigid"}, "bars": {"facets": "bars"}, "flexible": {"facets": "flexible", "mesh_size": 0.05},
}  # fmt: skip
TIP = {"vertex 7": (0.0, -0.02, 0.0), "vertex 8": (0.0, 0.02, 0.0)}
"""Vertices at the free edge of the zigzag, and their places on a bar along this edge, m."""
EDGE = 3 * 0.05 * np.cos(np.radians(30.0)), 0.02, 0.05 * np.sin(np.radians(30.0))
"""Middle of the free edge at the start, m."""


def zigzag(facets: str, **more: Any) -> dict[str, Any]:
    """Zigzag of three panels; the first one is held."""
    sheet = {
        "kind": "zigzag", "columns": 3, "a": 0.05, "b": 0.04, "fold_angle": "30 deg", "thickness": 3e-4,
        "support": [{"at": "facet 1"}],
    }  # fmt: skip
    return {
        "sheet": sheet | FACETS[facets], "material": {"young": 3e9, "poisson": 0.3, "density": 800.0, "damping": "1 ms"},
        "crease": {"stiffness_per_length": 1.0}, "solve": {"method": "static", "end_time": 1.0},
    } | more  # fmt: skip


def bar(mass: float = 0.02) -> dict[str, Any]:
    """Bar along the free edge, joined to both vertices; one of them can slide along it."""
    return {
        "bodies": [{"name": "bar", "mass": mass, "inertia": [1e-5, 1e-6, 1e-5], "position": list(EDGE)}],
        "frames": [{"name": f"frame at {place}", "on": "sheet", "place": place} for place in TIP],
        "elements": [
            {"name": f"joint at {place}", "inner": f"frame at {place}", "outer": "bar", "point_outer": list(point),
             "translation": [1e5, 1e5 if place == "vertex 7" else 0.0, 1e5]}
            for place, point in TIP.items()
        ],
    }  # fmt: skip


def run(data: dict[str, Any], folder: Path) -> tuple[dict[str, Any], Solution]:
    result = fsm.load(data, folder=folder).run(folder, figures=False)
    return result.summary, read_solution(folder / "result.h5")


def load(end: float = 1.0, **target: Any) -> list[dict[str, Any]]:
    return [{"force": [0.0, 0.0, -0.1], "time": {"kind": "ramp", "end": end}} | target]


@pytest.mark.parametrize("facets", FACETS)
def test_a_load_on_a_joined_body_acts_on_the_sheet(facets: str, tmp_path: Path) -> None:
    """A force on a bar that is joined to two vertices does the work of the same force on these vertices."""
    slow = {"save": {"interval": 20.0}, "solve": {"method": "static", "end_time": 100.0}}  # the bar has inertia
    direct = zigzag(facets, load=load(100.0, at="vertices 7, 8"), **slow)
    joined = zigzag(facets, load=load(100.0, body="bar"), scene=bar(), **slow)
    turning = {"name": "turning", "inner": "ground", "outer": "bar", "rotation": [0.0, 1e-3, 0.0]}
    joined["scene"]["elements"].append(turning)  # joints at vertices let the bar turn about its axis
    (_, first), (summary, second) = run(direct, tmp_path / "direct"), run(joined, tmp_path / "joined")
    assert second.energy["work"][-1] == pytest.approx(first.energy["work"][-1], rel=2e-4)
    assert summary["energy_error"] < 1e-4


@pytest.mark.parametrize("facets", FACETS)
def test_a_joined_mass_swings_with_the_sheet(facets: str, tmp_path: Path) -> None:
    """In motion, the energy of the bar and the sheet is constant but for damping, and both move together."""
    data = zigzag(facets, scene=bar(), gravity=[0.0, 0.0, -9.81], solve={"end_time": 0.01})
    summary, solution = run(data, tmp_path)
    assert summary["energy_error"] < 1e-5
    assert solution.energy["kinetic"].max() > 1e-5


def test_a_seam_holds_an_edge_as_a_guided_drive_does(tmp_path: Path) -> None:
    """A plate that a stiff seam joins to the end ring of a tube pulls like a drive of this ring."""
    sheet = {
        "kind": "miura-tube", "columns": 2, "a": 0.04, "b": 0.06, "sector_angle": "70 deg", "fold_angle": "80 deg",
        "facets": "bars", "thickness": 2e-4,
        "support": [{"at": "vertices 1, 3", "fixed": ["x", "z"]}, {"at": "vertex 1", "fixed": ["y"]},
                    {"at": "edge left", "fixed": ["x"]}],
    }  # fmt: skip
    data = {
        "sheet": sheet, "material": {"young": 3e9, "poisson": 0.3, "density": 1400.0},
        "crease": {"stiffness_per_length": 0.05}, "solve": {"method": "static"},
    }  # fmt: skip
    pulled = {"direction": [1.0, 0.0, 0.0], "travel": 0.01, "speed": 1e-3}
    plate = {"name": "plate", "mass": 0.01, "inertia": [1e-6, 1e-6, 1e-6], "position": [0.02, 0.0, 0.0]}
    seam = {"name": "end", "film": "sheet", "edge": "right", "bodies": ["plate"], "stiffness": 1e11}
    ring, _ = run(data | {"drive": [{"edge": "right"} | pulled]}, tmp_path / "ring")
    joined = {"drive": [{"body": "plate"} | pulled], "scene": {"bodies": [plate], "seams": [seam]}}
    sewn, _ = run(data | joined, tmp_path / "sewn")
    assert sewn["peak_force"] == pytest.approx(ring["peak_force"], rel=1e-3)  # springs of the drive: 1e3 times the bars


@pytest.mark.parametrize("facets", FACETS)
def test_faults_of_frames_and_seams_name_the_key(facets: str) -> None:
    faulty = {
        "scene.frames.0.place": ({"place": "vertices 6, 7, 8"}, "vertices; a frame needs one"),
        "scene.frames.0.at": ({"at": [0.0, 0.0]}, "`at` is used on a facet"),
    }
    for path, (update, text) in faulty.items():
        scene = bar()
        scene["frames"][0] |= update
        with pytest.raises(CaseError, match=text) as caught:
            compile_case(fsm.load(zigzag(facets, scene=scene))._loaded.case)
        assert caught.value.faults[0].path == path
    scene = bar() | {"seams": [{"name": "s", "film": "sheet", "edge": "rigth", "bodies": ["bar"], "stiffness": 1e5}]}
    with pytest.raises(CaseError, match="is not an edge of the sheet"):
        compile_case(fsm.load(zigzag(facets, scene=scene))._loaded.case)


def test_moments_of_a_motor_contain_its_moving_rest_angle(tmp_path: Path) -> None:
    """A motor that lifts a weight has the moment of the weight, and a free hinge that a motor turns has none."""
    inertia, gravity, arm = [1e-4, 1e-4, 1e-4], 9.81, 0.1
    arms = [
        {"name": name, "mass": 0.1, "inertia": inertia, "position": [x, 0.0, 0.0]}
        for name, x in (("first", arm), ("second", 3.0 * arm))
    ]
    elements = [
        {"name": "base", "inner": "first", "outer": "ground", "point_inner": [-arm, 0.0, 0.0], "translation": [1e6] * 3,
         "rotation": [1e3, 1e3, 1e3]},
        {"name": "motor", "inner": "first", "outer": "second", "point_inner": [arm, 0.0, 0.0],
         "point_outer": [-arm, 0.0, 0.0], "translation": [1e6] * 3, "rotation": [1e3, 5.0, 1e3], "rest_turn": -0.5,
         "rest_time": {"kind": "ramp", "end": 1.0}},
    ]  # fmt: skip
    for name, weight in (("free", 0.0), ("loaded", gravity)):
        data = {
            "scene": {"bodies": arms, "elements": elements}, "gravity": [0.0, 0.0, -weight],
            "solve": {"method": "static", "end_time": 1.0, "spatial": True}, "save": {"channels": ["joint.motor.*"]},
        }  # fmt: skip
        result = fsm.load(data, folder=tmp_path).run(tmp_path / name, figures=False)
        turned = result["joint.motor.rotation"].values[-1, 1]
        lifted = 0.1 * weight * arm * np.cos(turned)
        assert abs(turned + 0.5) == pytest.approx(lifted / 5.0, abs=2e-3)
        assert abs(result["joint.motor.moment_vector"].values[-1, 1]) == pytest.approx(lifted, abs=2e-4 * gravity * arm)
