"""Creases of flexible facets and of bars: measured laws, folding from flat, angles beyond half a turn, channels."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.case.loading.load_case import load_case
from fsm.results.store import read_solution
from fsm.run.run_case import run_case

CASES = Path(__file__).parents[2] / "folding_cases"
KINDS = {"flexible": {"mesh_size": 1.0}, "bars": {"bend_stiffness_per_length": 1e5, "bars": {"young": 1e9}}}


def pushed(facets: str, crease: dict[str, Any]) -> dict[str, Any]:
    """Miura sheet of 2 x 2 panels of facets much stiffer than its creases."""
    loaded = load_case(CASES / "miura_push" / "case.toml", ["sheet.columns=2", "sheet.rows=2"])
    data = loaded.case.model_dump(exclude_unset=True)
    data["sheet"] |= {"facets": facets, "thickness": 0.02, **KINDS.get(facets, {})}
    data["drive"][0]["travel"] = 0.2
    return data | {"crease": crease, "save": {"every": 0.1}}


@pytest.mark.parametrize("law", ["spline", "bilinear", "hysteresis"])
def test_measured_creases_are_those_of_rigid_facets(law: str, tmp_path: Path) -> None:
    angle = np.linspace(-0.5, 2.5, 10)
    moment = 0.1 * np.sin(angle)
    crease = {"law": "spline", "angle": angle.tolist(), "moment": moment.tolist(), "width": 1.3}
    if law == "bilinear":
        crease |= {"angle": [-0.5, 0.1, 2.5], "moment": [-0.1, 0.02, 0.1], "interpolation": "pchip"}
    elif law == "hysteresis":
        crease |= {"unloading": (moment - 0.02).tolist(), "reversal": 0.2}
    rigid, flexible, bars = (
        fsm.load(pushed(facets, crease), folder=tmp_path).run(tmp_path / facets, figures=False).summary
        for facets in ("rigid", *KINDS)
    )
    assert flexible["final_force"] == pytest.approx(rigid["final_force"], rel=1e-3)
    assert bars["final_force"] == pytest.approx(rigid["final_force"], rel=1e-3)
    assert max(summary["energy_error"] for summary in (flexible, bars)) < 1e-3


def test_folding_from_flat(tmp_path: Path) -> None:
    """Bars fold like rigid facets with bend lines of the same stiffness; flexible facets nearly reach their rest angles."""
    folded = {}
    for facets in ("bend-lines", "bars", "flexible"):
        mesh = ["sheet.mesh_size=20 mm"] if facets == "flexible" else []
        loaded = load_case(CASES / "fold_file" / "case.toml", ["sheet.fold_to=0.5", f"sheet.facets={facets}", *mesh])
        summary = run_case(loaded, tmp_path / facets, progress=False, figures=False)
        folded[facets] = summary["folded"]
        assert summary["energy_error"] < 1e-3 and not summary["folded"]["creases"]
    for part in ("least", "median"):
        assert folded["bars"][part] == pytest.approx(folded["bend-lines"][part], rel=1e-2)
    assert folded["flexible"]["least"] > 0.6


def test_channels_of_creases(tmp_path: Path) -> None:
    """Angles in the result agree with the summary; the moment is the stiffness times the distance from the rest angle."""
    changes = ["sheet.fold_to=0.3", "sheet.facets=flexible", "sheet.mesh_size=20 mm", 'save.channels=["crease.*"]']
    summary = run_case(load_case(CASES / "fold_file" / "case.toml", changes), tmp_path, progress=False, figures=False)
    channels = read_solution(tmp_path / "result.h5").channels
    angles = {name: channel for name, channel in channels.items() if name.endswith(".angle")}
    assert len(angles) == len(channels) / 2
    parts = sorted(abs(float(channel.values[-1])) / (0.3 * math.pi) for channel in angles.values())
    assert parts[0] == pytest.approx(summary["folded"]["least"], rel=1e-9)
    assert np.median(parts) == pytest.approx(summary["folded"]["median"], rel=1e-9)


def turned(moment: float) -> dict[str, Any]:
    """Two stiff plates with a crease of 1 N m/rad; one is held, and a moment rotates the other and back."""
    sheet = {
        "kind": "zigzag", "columns": 2, "a": 1.0, "b": 1.0, "fold_angle": 0.0, "thickness": 0.02, "facets": "flexible",
        "mesh_size": 1.0, "support": [{"at": "facet 1"}], "crease": [{"of": "flat", "stiffness_per_length": 1.0}],
    }  # fmt: skip
    time = {"kind": "table", "time": [0.0, 1.0, 2.0], "value": [0.0, 1.0, 0.0]}
    return {
        "sheet": sheet, "material": {"young": 3e9, "density": 1000.0}, "crease": {"stiffness_per_length": 1.0},
        "load": [{"at": "edge right", "moment": [0.0, moment, 0.0], "time": time}],
        "solve": {"method": "static", "end_time": 2.0}, "save": {"interval": 0.25, "channels": ["crease.1.*"]},
    }  # fmt: skip


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_crease_folds_to_300_degrees_and_back(sign: float, tmp_path: Path) -> None:
    largest = math.radians(300.0)
    fsm.load(turned(sign * largest), folder=tmp_path).run(tmp_path / "out", figures=False)
    solution = read_solution(tmp_path / "out" / "result.h5")
    angle, moment = (solution.channels[f"crease.1.{name}"].values for name in ("angle", "moment"))
    expected = largest * (1.0 - np.abs(solution.time - 1.0))
    np.testing.assert_allclose(np.abs(angle), expected, atol=1e-5)
    np.testing.assert_allclose(moment, angle, atol=1e-5)
    assert solution.energy["creases"].max() == pytest.approx(0.5 * largest**2, rel=1e-5)


def turned_bars(largest: float, tables: int, changes: dict[str, Any]) -> dict[str, Any]:
    """Two plates of bars with a crease; one is held, and a force that rotates by an angle (rad) and back folds the other."""
    times = np.linspace(0.0, 2.0, tables)
    angle = largest * (1.0 - np.abs(times - 1.0))
    parts = ([20.0, 0.0, 0.0], np.cos(angle)), ([0.0, 0.0, 20.0], np.sin(angle))
    case = turned(0.0) | {
        "load": [
            {"at": "edge right", "force": force, "time": {"kind": "table", "time": times.tolist(), "value": factor.tolist()}}
            for force, factor in parts
        ],
        "save": {"interval": 0.125, "channels": ["crease.1.*"]},
    }  # fmt: skip
    del case["sheet"]["mesh_size"]
    case["sheet"] |= {"facets": "bars", "bars": {"young": 1e9}, "bend_stiffness_per_length": 1e4}
    return case | changes


def test_saved_creases_of_bars_have_their_own_turns(tmp_path: Path) -> None:
    """A kernel that passes several saved states turns the crease by more than half a turn; the energy is that of the angle
    in each."""
    solve = {"method": "static", "end_time": 2.0, "max_step": 0.25, "rtol": 1e-2}
    case = turned_bars(math.radians(300.0), 21, {"solve": solve})
    result = fsm.load(case, folder=tmp_path).run(tmp_path / "out", figures=False)
    solution = read_solution(tmp_path / "out" / "result.h5")
    angle, stored = solution.channels["crease.1.angle"].values, solution.energy["creases"]
    assert np.abs(angle).max() > math.radians(280.0)
    np.testing.assert_allclose(0.5 * angle**2, stored, atol=1e-9 * stored.max())
    for record, energy in enumerate(stored):
        found = result.system(record)
        potential = found.system.energy(found.time, found.q, None).potential
        assert potential["creases"] == pytest.approx(energy, rel=1e-9, abs=1e-12)


def test_saved_creases_of_bars_have_their_own_hysteresis(tmp_path: Path) -> None:
    """The moment of every saved state is on the branch of its time: 0.3 N m apart as the crease opens and closes."""
    curve = np.linspace(-6.0, 6.0, 13)
    crease = {
        "law": "spline", "angle": curve.tolist(), "moment": curve.tolist(), "unloading": (curve - 0.3).tolist(),
        "reversal": 0.2, "width": 1.0,
    }  # fmt: skip
    case = turned_bars(math.radians(250.0), 201, {"crease": crease})
    del case["sheet"]["crease"]
    case["sheet"]["fold_angle"] = 0.1
    fsm.load(case, folder=tmp_path).run(tmp_path / "out", figures=False)
    solution = read_solution(tmp_path / "out" / "result.h5")
    angle, moment = (solution.channels[f"crease.1.{name}"].values for name in ("angle", "moment"))
    friction = moment - angle
    np.testing.assert_allclose(friction[(solution.time > 0.1) & (solution.time < 1.01)], friction[1], atol=1e-6)
    np.testing.assert_allclose(friction[(solution.time > 1.1) & (solution.time < 1.9)], friction[1] + 0.3, atol=1e-6)


def test_springs_of_bars_turn_beyond_half_a_turn(tmp_path: Path) -> None:
    """A spring with the rest angle 300 degrees rotates a triangle from flat to this angle, with dampers; its energy is
    dissipated."""
    rest = math.radians(300.0)
    truss = {
        "name": "flap", "points": [[1, 0, 0], [0, 0, 0], [0, 1, 0], [-1, 0.5, 0]], "mass": [0.1] * 4,
        "bars": [[0, 1], [1, 2], [2, 0], [1, 3], [2, 3]], "stiffness": [1e3] * 5, "folds": [[0, 1, 2, 3]],
        "fold_stiffness": [0.1], "fold_rest": [rest], "viscosity": 1.0, "held": [[0, "xyz"], [1, "xyz"], [2, "xyz"]],
        "faces": [[0, 1, 2], [1, 2, 3]],
    }  # fmt: skip
    data = {"scene": {"trusses": [truss]}, "solve": {"end_time": 20.0}, "save": {"interval": 1.0, "channels": ["energy.*"]}}
    summary = fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False).summary
    solution = read_solution(tmp_path / "out" / "result.h5")
    begin, end = (solution.energy["creases"][k] for k in (0, -1))
    assert begin == pytest.approx(0.05 * rest**2, rel=1e-9) and end < 1e-3 * begin
    assert solution.energy["dissipated"][-1] == pytest.approx(begin, rel=1e-2)
    assert summary["energy_error"] < 1e-3


def released(case: dict[str, Any], force: float, method: str, folder: Path) -> tuple[fsm.Result, float, float]:
    """Free motion of 0.2 s from a loaded state: its result, and elastic plus kinetic energy at the start and at the end."""
    steps = [
        {"kind": "static", "duration": 1.0},
        {"kind": "dynamic", "release": ["f"], "duration": 0.2, "solve": {"method": method, "step": 1e-3}},
    ]
    load = {"name": "f", "at": "edge right", "force": [0.0, 0.0, force]}
    result = fsm.load(case | {"load": [load], "step": steps, "save": {"interval": 0.1}}, folder=folder).run(
        folder / "out", figures=False
    )
    solution = read_solution(folder / "out" / "result.h5")
    total = sum(solution.energy[name] for name in ("kinetic", "panels", "creases", "bars"))
    return result, float(total[np.argmin(np.abs(solution.time - 1.0))]), float(total[-1])


@pytest.mark.parametrize(("method", "bound"), [("mean-force", 1e-5), ("generalized-alpha", 3e-3)])
def test_damped_plate(method: str, bound: float, tmp_path: Path) -> None:
    """The energy of the first mode of a cantilever decays as exp(-tau w^2 t), w = 3.516 sqrt(E t^2/(12 rho L^4))."""
    tau = 1e-3
    sheet = {
        "kind": "plate", "length": 1.0, "width": 0.2, "mesh": [3, 1], "thickness": 0.01, "facets": "flexible",
        "support": [{"at": "edge left", "clamped": True}],
    }  # fmt: skip
    material = {"young": 70e9, "poisson": 0.0, "density": 2700.0, "damping": tau}
    result, begin, end = released({"sheet": sheet, "material": material}, -2.0, method, tmp_path)
    squared = 3.516**2 * 70e9 * 0.01**2 / (12.0 * 2700.0)
    assert end / begin == pytest.approx(math.exp(-tau * squared * 0.2), rel=2e-2)
    assert result.summary["energy_error"] < bound


def test_damped_bars_and_creases(tmp_path: Path) -> None:
    sheet = {
        "kind": "zigzag", "columns": 2, "a": 0.1, "b": 0.05, "fold_angle": 0.5, "thickness": 1e-3, "facets": "bars",
        "support": [{"at": "facet 1"}],
    }  # fmt: skip
    case = {
        "sheet": sheet, "material": {"young": 3e9, "density": 1000.0, "damping": 2e-3},
        "crease": {"stiffness_per_length": 2.0},
    }  # fmt: skip
    result, begin, end = released(case, -0.02, "mean-force", tmp_path)
    assert end < 0.5 * begin
    assert result.summary["energy_error"] < 1e-5
