"""Contact of rigid facets, bars and flexible facets with bodies of a [scene] and with obstacles on bodies."""

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

SIDE, WIDTH, THICKNESS, YOUNG = 0.08, 0.06, 1e-3, 3e9
"""Sides and thickness of a sheet, m, and its Young's modulus, Pa."""
FACETS = ("rigid", "bars", "flexible")
START = 1e-6
"""Gap at the start, m."""
GUIDE = 5.0
"""Stiffness of the springs that guide a plate, N/m."""


def sheet(facets: str, *support: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Roof of two facets with a crease in the middle, or a flat flexible facet."""
    shape: dict[str, Any] = {"kind": "plate", "length": SIDE, "width": WIDTH, "mesh": [4, 3]}
    if facets != "flexible":
        shape = {"kind": "zigzag", "columns": 2, "a": SIDE / 2, "b": WIDTH, "fold_angle": "30 deg"}
    held = support or ({"at": "edge left"}, {"at": "edge right"})
    found = {
        "sheet": shape | {"facets": facets, "thickness": THICKNESS, "support": list(held)},
        "material": {"young": YOUNG, "poisson": 0.0, "density": 1000.0, "damping": "1 ms"},
        "contact": {"law": "linear", "stiffness": "1e5 N/m", "ramp": "10 nm"},
        "solve": {"method": "static", "end_time": 1.0, "rtol": 1e-7}, "save": {"interval": 0.5},
    }  # fmt: skip
    if facets != "flexible":
        found["crease"] = {"stiffness_per_length": 10.0}
    return found | more


def run(data: dict[str, Any], folder: Path) -> tuple[dict[str, Any], Solution]:
    result = fsm.load(data, folder=folder).run(folder, figures=False)
    return result.summary, read_solution(folder / "result.h5")


def middle(facets: str) -> tuple[float, float, float]:
    """Middle of the flat facet, or of the ridge of the roof, m."""
    angle = np.radians(30.0)
    return (SIDE / 2, WIDTH / 2, 0.0) if facets == "flexible" else (SIDE / 2 * np.cos(angle), 0.0, SIDE / 2 * np.sin(angle))


def guided(facets: str, along: float = GUIDE) -> dict[str, Any]:
    """Scene with a plate just above the sheet; soft springs guide the plate."""
    thick = 4e-3
    x, y, z = middle(facets)
    z += 0.5 * (thick + THICKNESS) + START
    plate = {
        "name": "plate", "mass": 0.1, "inertia": [1e-5] * 3, "position": [x, y, z],
        "plate": {"length": 1.1 * SIDE, "width": 1.1 * WIDTH, "thickness": thick},
    }  # fmt: skip
    guide = {
        "name": "guide", "inner": "plate", "outer": "ground", "point_outer": [x, y, z], "translation": [along, along, GUIDE],
        "rotation": [1e3] * 3,
    }  # fmt: skip
    return {"bodies": [plate], "elements": [guide], "pairs": [{"first": "sheet", "second": "plate"}]}


def pressed(size: float, end: float = 1.0) -> list[dict[str, Any]]:
    return [{"body": "plate", "force": [0.0, 0.0, -size], "time": {"kind": "ramp", "end": end}}]


def carries(solution: Solution, scene: dict[str, Any], pressing: float) -> float:
    """Normal force between sheet and plate at the end, which is the load less the force of the guide."""
    sunk = scene["bodies"][0]["position"][2] - solution.channels["body.plate.position"].values[-1, 2]
    assert sunk > START
    force = float(solution.pair_force[-1, -1])
    # normals at the round edges of rigid facets are tilted by up to 4 degrees, so that their sum is larger: 2.5e-3
    assert force == pytest.approx(pressing - GUIDE * sunk, rel=4e-3)
    return force


@pytest.mark.parametrize("facets", FACETS)
def test_a_sheet_carries_the_weight_of_a_plate(facets: str, tmp_path: Path) -> None:
    """The contact force on a plate is its weight less the force of the soft springs that guide the plate."""
    weight, scene = 0.981, guided(facets, along=1e4)
    data = sheet(facets, load=pressed(weight), scene=scene)
    data["save"] |= {"channels": ["body.plate.position"]}
    summary, solution = run(data, tmp_path)
    carries(solution, scene, weight)
    assert summary["energy_error"] < 1e-3


def test_a_cylinder_bends_a_clamped_plate(tmp_path: Path) -> None:
    """A driven cylinder presses the middle of a plate that is clamped at two ends: F = 192 E I w/L^3."""
    radius, travel = 6e-3, 0.1e-3
    x, y, z = middle("flexible")
    z += radius + 0.5 * THICKNESS + START
    roller = {"name": "roller", "mass": 0.1, "inertia": [1e-5] * 3, "position": [x, y, z]}
    ends = [{"at": f"edge {end}", "clamped": True} for end in ("left", "right")]
    data = sheet(
        "flexible", *ends, scene={"bodies": [roller]},
        obstacle=[{"name": "cylinder", "shape": "cylinder", "radius": radius, "length": 0.1, "body": "roller"}],
        drive=[{"body": "roller", "direction": [0, 0, -1], "travel": travel, "speed": "0.1 mm/s"}],
    )  # fmt: skip
    data["solve"] = {"method": "static", "rtol": 1e-6}
    data["sheet"] |= {"mesh": [8, 6]}
    data["contact"] = {"law": "hertz", "stiffness": "1e9 N/m^1.5"}
    summary, solution = run(data, tmp_path)
    bent = -solution.shape[-1][..., 2].min()
    bending = YOUNG * WIDTH * THICKNESS**3 / 12.0
    assert bent > 0.8 * travel
    # stretch adds (w/t)^2 times about 0.4
    assert summary["final_force"] == pytest.approx(192.0 * bending * bent / SIDE**3, rel=0.01)
    pair = solution.pair_force[-1, 1]
    assert pair == pytest.approx(summary["final_force"], rel=1e-6)
    assert summary["energy_error"] < 1e-4


@pytest.mark.parametrize("facets", FACETS)
def test_a_plate_that_slides_on_a_sheet_has_the_force_of_friction(facets: str, tmp_path: Path) -> None:
    """A pressed plate is pulled along a sheet: the drive has mu N and the force of the soft springs."""
    mu, pressing, travel = 0.3, 2.0, 0.5e-3
    scene = guided(facets)
    hand = {"name": "hand", "mass": 0.01, "inertia": [1e-6] * 3, "position": scene["bodies"][0]["position"]}
    scene["bodies"].append(hand)
    scene["elements"].append({"name": "pull", "inner": "plate", "outer": "hand", "translation": [1e5, 0.0, 0.0]})
    data = sheet(
        facets, scene=scene, friction={"law": "tanh", "mu_dynamic": mu, "v_static": "0.1 mm/s"},
        load=pressed(pressing, end=0.25),
        drive=[{"body": "hand", "direction": [1, 0, 0], "travel": travel, "speed": "1 mm/s"}],
        solve={"method": "static", "rtol": 1e-6}, save={"every": "0.25 mm", "channels": ["body.plate.position"]},
    )  # fmt: skip
    summary, solution = run(data, tmp_path)
    pulling = summary["final_force"] - GUIDE * travel
    normal = carries(solution, scene, pressing)
    assert solution.pair_friction[-1, -1] == pytest.approx(mu * normal, rel=1e-6)
    assert pulling == pytest.approx(mu * normal, rel=1e-3)
    assert summary["energy_error"] < 1e-4


@pytest.mark.parametrize("facets", FACETS)
def test_faults_of_pairs_name_the_key(facets: str) -> None:
    bare = {"name": "ball", "mass": 0.1, "inertia": [1e-5] * 3, "position": [0.0, 0.0, 0.1]}
    for pair, text in (
        ({"first": "sheet", "second": "ball"}, "has no plate, so it has no face to touch"),
        ({"first": "shet", "second": "ball"}, "did you mean 'sheet'"),
    ):
        data = sheet(facets, scene={"bodies": [bare], "pairs": [pair]})
        with pytest.raises(CaseError, match=text) as caught:
            compile_case(fsm.load(data)._loaded.case)
        assert caught.value.faults[0].path.startswith("scene.pairs.")


@pytest.mark.parametrize("facets", FACETS)
def test_a_pair_that_a_sheet_has_already_is_refused(facets: str) -> None:
    data = sheet(facets, scene={"pairs": [{"first": "sheet", "second": "sheet"}]})
    with pytest.raises(CaseError, match="'sheet' and 'sheet' are a pair already, because a sheet has contact with itself"):
        compile_case(fsm.load(data)._loaded.case)
