"""Booms: sections, stress-free starts, and the moments of a tape spring against its theory."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.builders.patterns.plates import boom_mesh
from fsm.case.models.sheet import Sheet
from fsm.errors import CaseError
from validation.boom.tape import HUB, NU, RADIUS, STEEL, YOUNG, arm_turns, opening, tape_spring

CASES = Path(__file__).parents[2] / "folding_cases" / "tape_spring"
STEM = {"kind": "stem", "subtended_angle": "400 deg", "mesh": [4, 24]}
LENS = {"kind": "lenticular", "subtended_angle": "120 deg", "mesh": [4, 8]}


def boom(**changes: Any) -> dict[str, Any]:
    """Sheet of a short tape spring."""
    return {
        "kind": "tape-spring", "length": 0.06, "radius": RADIUS, "subtended_angle": STEEL.angle,
        "thickness": STEEL.thickness, "facets": "flexible", "mesh": [6, 8],
    } | changes  # fmt: skip


def case(sheet: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"sheet": sheet, "material": {"young": YOUNG, "poisson": NU, "density": 7850.0}} | more


@pytest.mark.parametrize("changes", [{}, STEM, LENS, {"mesh_grading": [0, 1]}], ids=["tape", "stem", "lens", "graded"])
def test_start_is_on_the_section_without_stress(changes: dict[str, Any], tmp_path: Path) -> None:
    """All nodes are on the arcs, normals point outwards, and a free boom has six motions without stiffness only."""
    data = boom(**changes)
    mesh = boom_mesh(Sheet.model_validate(data))
    angle = float(Sheet.model_validate(data).subtended_angle or 0.0)
    centre = np.array([0.0, 0.0, -RADIUS])
    normal = np.cross(*mesh.slopes.transpose(1, 0, 2))
    upper = np.isin(np.arange(len(mesh.owner)), mesh.triangles[mesh.facet == 0])
    away = (mesh.positions - centre)[upper] * [0, 1, 1]
    grown = STEEL.thickness * 400.0 / 720.0 if data["kind"] == "stem" else 0.0
    assert abs(np.linalg.norm(away, axis=1) - RADIUS).max() <= 1.01 * grown + 1e-12
    assert (np.einsum("nk,nk->n", normal[upper], away) > 0.99 * RADIUS).all()
    if data["kind"] == "lenticular":
        lower = mesh.positions[~upper]
        chord = -RADIUS * (1.0 - math.cos(0.5 * angle))
        assert lower[:, 2].max() == pytest.approx(chord)
        assert (normal[~upper][:, 2] < 0.0).all()
    run = fsm.load(case(data, step=[{"kind": "modes", "modes": 8}]), folder=tmp_path).run(tmp_path / "out", figures=False)
    found = np.array(run.summary["step"][0]["frequencies_hz"])
    assert abs(found[:6]).max() < 1e-3 * found[6]


def test_plies_of_an_isotropic_material_are_the_isotropic_boom(tmp_path: Path) -> None:
    """Frequencies of a clamped tape spring, whose plies have their angle from its axis."""
    isotropic = {
        "young": YOUNG,
        "young_across": YOUNG,
        "shear": 0.5 * YOUNG / (1 + NU),
        "poisson": NU,
        "thickness": 0.5 * STEEL.thickness,
    }
    found = []
    for plies in ([], [isotropic | {"angle": 0.3}, isotropic | {"angle": -1.0}]):
        data = case(boom(ply=plies, support=[{"at": "edge left", "clamped": True}]), step=[{"kind": "modes", "modes": 3}])
        run = fsm.load(data, folder=tmp_path).run(tmp_path / str(len(plies)), figures=False)
        found.append(run.summary["step"][0]["frequencies_hz"])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6)


def test_rigid_ends_turn(tmp_path: Path) -> None:
    """Small turns of both ends bend the tape spring as a beam: M = E I turn/L, whichever end turns and about any axis.

    I of the arc about the axis through its centroid is R^3 t (a/2 + sin(a)/2 - 4 sin^2(a/2)/a). Rigid ends keep the shape of
    the section.
    """
    whole = 1e-3
    a = STEEL.angle
    inertia = RADIUS**3 * STEEL.thickness * (0.5 * a + 0.5 * math.sin(a) - 4.0 * math.sin(0.5 * a) ** 2 / a)
    exact = YOUNG * inertia * whole / 0.06
    found = []
    for left, point in ((0.5, [0.0, 0.0, 0.0]), (0.9, [0.01, 0.0, -0.02])):
        turns = {"left": left * whole, "right": (1.0 - left) * whole}
        drives = [
            {"edge": edge, "turn": turn, "rate": turn, "axis": [0, way, 0], "guide": edge == "left", "point": point}
            for (edge, turn), way in zip(turns.items(), (1, -1), strict=True)
        ]
        data = case(boom(mesh=[8, 12]), drive=drives, solve={"method": "static", "rtol": 1e-4}, save={"interval": 0.5})
        result = fsm.load(data, folder=tmp_path).run(tmp_path / str(left), figures=False)
        found.append(result.summary["final_force"])
    assert found[0] == pytest.approx(exact, rel=0.02)
    assert found[1] == pytest.approx(found[0], rel=1e-3)


def test_moment_before_the_snap(tmp_path: Path) -> None:
    """Moments at 10, 20 and 30 mrad beside CalculiX (S8R, 30 x 12 cells, 24 November 2026); errors of second order."""
    turns, reference = np.array([0.01, 0.02, 0.03]), np.array([0.2769, 0.5329, 0.7535])
    errors = []
    for mesh in ((14, 8), (28, 16)):
        data = tape_spring(0.03, mesh) | {"save": {"interval": 0.05}}
        result = fsm.load(data, folder=tmp_path).run(tmp_path / str(mesh[0]), figures=False)
        rows = np.loadtxt(tmp_path / str(mesh[0]) / "force.csv", delimiter=",", skiprows=1)
        errors.append(abs(np.interp(turns, rows[:, 0], rows[:, 1]) / reference - 1.0).max())
        assert result.summary["energy_error"] < 1e-3
    assert errors[1] < 0.03
    assert errors[1] < 0.4 * errors[0]


@pytest.mark.nightly
def test_snap_and_steady_moment(tmp_path: Path) -> None:
    """The tape snaps near the turn of CalculiX, 56.3 mrad, and its fold grows at the moment with edge layers, within 5 %."""
    result = fsm.load(tape_spring(0.9, (48, 12), length=0.12), folder=tmp_path).run(tmp_path / "out", figures=False)
    rows = np.loadtxt(tmp_path / "out" / "force.csv", delimiter=",", skiprows=1)
    steady = STEEL.steady(1.0) * (1.0 - STEEL.edge_layer(1.0))
    at = np.linspace(0.6, 0.9, 100)
    assert np.interp(at, rows[:, 0], rows[:, 1]).mean() == pytest.approx(steady, rel=0.05)
    assert result.summary["peak_force"] > 10.0 * steady
    assert any("snap at" in text for text in result.summary["warnings"])


@pytest.mark.nightly
def test_steady_moment_in_equal_sense(tmp_path: Path) -> None:
    """The edges buckle, and the fold then grows at (1 - nu) D a within 3 %, about half of the moment in opposite sense."""
    data = tape_spring(1.2, (28, 10), -1.0, damping=1e-2) | {"solve": {"method": "static", "rtol": 1e-3}}
    result = fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False)
    rows = np.loadtxt(tmp_path / "out" / "force.csv", delimiter=",", skiprows=1)
    at = np.linspace(0.7, 1.2, 100)
    assert np.interp(at, rows[:, 0], rows[:, 1]).mean() == pytest.approx(STEEL.steady(-1.0), rel=0.03)
    assert result.summary["peak_force"] > 10.0 * STEEL.steady(-1.0)


@pytest.mark.nightly
@pytest.mark.parametrize("method", ["mean-force", "generalized-alpha"])
def test_a_folded_tape_opens_as_its_energy_determines(tmp_path: Path, method: str) -> None:
    """Time in which half of the fold disappears after its release, and speed of its edge, within 5 % of the theory."""
    turn, duration = 0.9, 8e-3
    case = fsm.load(CASES / "release.toml").set(
        {"step.3.duration": duration, "step.3.solve.method": method, "expect": None}
    )
    result = case.run(tmp_path / "out", figures=False)
    time, angle = arm_turns(tmp_path / "out" / "result.h5", 4)
    layers = STEEL.steady(1.0) * (1.0 - STEEL.edge_layer(1.0))
    fine = np.linspace(0.0, duration, 500)
    theory, rate = opening(0.08, turn, layers, fine)
    found = np.interp(0.5 * turn, angle[0] - angle, time)
    known = np.interp(0.5 * turn, turn - theory, fine)
    assert found == pytest.approx(known, rel=0.05)
    near = abs(time - found) < 0.8e-3
    assert np.polyfit(time[near], angle[near], 1)[0] == pytest.approx(np.interp(known, fine, rate), rel=0.05)
    assert result.summary["energy_error"] < 2e-3


@pytest.mark.nightly
def test_a_tape_coils_on_a_hub_at_the_moment_of_its_energy(tmp_path: Path) -> None:
    """Mean moment of coiling, from the energy per length of the coil, within 3 %; the tape does not enter the hub."""
    data = tomllib.loads((CASES / "coil.toml").read_text(encoding="utf-8"))
    data["sheet"] |= {"length": "90 mm", "mesh": [58, 8]}
    data["step"] = data["step"][:2]
    data["step"][1]["drive"][0]["turn"] = "1.1 rad"
    summary = fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False).summary
    rows = np.loadtxt(tmp_path / "out" / "force.csv", delimiter=",", skiprows=1)
    at, radius = np.linspace(0.3, 1.0, 100), HUB + 0.5 * STEEL.thickness
    assert np.interp(at, rows[:, 2], rows[:, 3]).mean() == pytest.approx(radius * STEEL.coiled(radius), rel=0.03)
    assert summary["contact"][0]["largest_penetration"] < 0.5 * STEEL.thickness
    assert summary["energy_error"] < 2e-3


def test_release_lets_the_end_go(tmp_path: Path) -> None:
    """A plate that a turned end bends is flat after the release, and has the frequency of a cantilever."""
    sheet = {
        "kind": "plate", "length": 0.1, "width": 0.02, "thickness": 5e-4, "facets": "flexible", "mesh": [8, 2],
        "support": [{"at": "edge left", "clamped": True}],
    }  # fmt: skip
    drive = {"edge": "right", "turn": 0.2, "rate": 0.1, "axis": [0, 1, 0], "guide": False}
    data = {
        "sheet": sheet, "material": {"young": 3e9, "poisson": 0.0, "density": 1000.0},
        "step": [
            {"kind": "static", "drive": [drive], "save": {"interval": 1.0}},
            {"kind": "relax", "release": ["right"]}, {"kind": "modes", "modes": 1},
        ],
    }  # fmt: skip
    result = fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False)
    rise = result.solution.shape[:, -1, :, 2].mean(axis=1)
    assert rise[-2] < -7e-3
    assert abs(rise[-1]) < 1e-9
    exact = 1.8751**2 / (2.0 * math.pi * 0.1**2) * 5e-4 * math.sqrt(3e9 / (12.0 * 1000.0))
    assert result.summary["step"][-1]["frequencies_hz"][0] == pytest.approx(exact, rel=2e-3)
    data["step"].append({"kind": "static", "drive": [drive]})
    with pytest.raises(CaseError, match="cannot be driven again"):
        fsm.load(data, folder=tmp_path).check()


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"subtended_angle": "200 deg"}, "must be above 0 deg and at most 180 deg"),
        ({"kind": "stem"}, "must be above 180 deg and at most 720 deg"),
        ({"facets": "rigid", "mesh": None, "mesh_size": 0.01}, 'give facets = "flexible"'),
        ({"radius": None}, "needs `radius`"),
        ({"width": 0.1}, "`width` is not used"),
        ({"thickness": 0.01}, "booms are thin shells"),
    ],
)
def test_faults_are_told(changes: dict[str, Any], text: str) -> None:
    data = {key: value for key, value in boom(**changes).items() if value is not None}
    with pytest.raises(CaseError, match=text):
        fsm.load(case(data), folder=Path.cwd()).check()
