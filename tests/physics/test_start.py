"""Initial state of a strip: as folded, when it is released, or in equilibrium; and a hold before the motion."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from fsm.analyses.at_start import equilibrium_at_start
from fsm.analyses.deploy import Deployment
from fsm.case.loading.load_case import LoadedCase, load_case, read_case
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.run.run_case import run_case
from fsm.solve.equations.newton import negative_pivots

LENGTH, WIDTH, THICKNESS, DENSITY, YOUNG, CREASE = 0.08, 0.04, 3e-4, 800.0, 3e9, 9e-3
CASE = f"""
[strip]
length = {2 * LENGTH}
width = {WIDTH}
thickness = {THICKNESS}
panels = 2
fold_angle = "80 deg"
segments_per_panel = 1
held = [1]
[material]
young = {YOUNG}
density = {DENSITY}
damping = 0
[crease]
law = "linear"
stiffness = {CREASE}
rest_angle = "130 deg"
[solve]
end_time = 0.11
rtol = 1e-5
"""
MORE = (
    "strip.panels=4", "strip.length=0.32", "strip.segments_per_panel=3", "material.damping=2 ms", "solve.rtol=1e-4",
)  # fmt: skip
DRIVE = 'drive=[{crease=2, speed="2 mm/s", travel="5 mm"}]'


def loaded(folder: Path, *overrides: str) -> LoadedCase:
    (folder / "case.toml").write_text(CASE)
    return load_case(folder / "case.toml", overrides)


def solved(folder: Path, *overrides: str) -> tuple[dict[str, Any], Solution]:
    summary = run_case(loaded(folder, *overrides), folder / "out", progress=False)
    return summary, read_solution(folder / "out" / "result.h5")


def checked(folder: Path, *overrides: str) -> str:
    (folder / "case.toml").write_text(CASE)
    sets = [word for text in overrides for word in ("--set", text)]
    result = CliRunner().invoke(cli, ["check", str(folder / "case.toml"), *sets])
    assert result.exit_code == 0, result.output
    return next(line for line in result.output.splitlines() if line.startswith("start"))


@pytest.mark.parametrize("hold", [0.0, 0.04])
def test_a_released_rigid_panel_swings_about_the_rest_angle(hold: float, tmp_path: Path) -> None:
    """psi = rest + (folded - rest) cos(omega t), omega^2 = k/(m L^2/3), after the hold; k in series with the half cell."""
    summary, solution = solved(tmp_path, *([f"release.hold_time={hold}"] if hold else []))
    assert summary["start"] == "as-folded"
    assert summary["warnings"] == []
    bending = YOUNG * WIDTH * THICKNESS**3 / 12
    stiffness = CREASE / (1 + CREASE * LENGTH / 2 / bending)
    omega = math.sqrt(stiffness / (DENSITY * WIDTH * THICKNESS * LENGTH * (LENGTH**2 / 3 + THICKNESS**2 / 12)))
    tip = solution.shape[:, -1, 1] - solution.shape[:, -1, 0]
    angle = np.pi - (np.radians(80) - np.arctan2(tip[:, 2], tip[:, 0])) % (2 * np.pi)  # angle of the fold, 0 flat
    angle = np.degrees(np.pi - np.abs(angle))
    swung = np.where(solution.time < hold, 1.0, np.cos(omega * (solution.time - hold)))
    assert np.ptp(swung) > 1.9  # at least half a period
    np.testing.assert_allclose(angle, 130 + 30 * swung, atol=0.5)
    if hold:
        still = solution.time < hold
        assert still.sum() > 50
        assert np.all(solution.q[still] == solution.q[0])


def test_an_equilibrium_that_is_asked_for_is_one(tmp_path: Path) -> None:
    """The strip is free of stress in this state and stays there; its energies are round-off, so no loss of energy is
    reported."""
    summary, solution = solved(tmp_path, *MORE, 'start="equilibrium"', "crease.rest_angle=140 deg")
    assert summary["start"] == "equilibrium"
    assert summary["energy_error"] == 0.0
    assert np.abs(solution.shape - solution.shape[0]).max() < 1e-9
    stored = solution.energy["creases"] + solution.energy["panels"]
    assert stored.max() < 1e-9 * CREASE  # in the folded state the energy would be 3/2 k (20 deg)^2


@pytest.mark.parametrize("rest", ["0 deg", "60 deg", "110 deg", "159.9 deg"])
def test_stowed_creases_start_as_folded_and_deploy(rest: str, tmp_path: Path) -> None:
    summary, solution = solved(tmp_path, *MORE, f"crease.rest_angle={rest}", "solve.end_time=0.02")
    assert summary["start"] == "as-folded"
    assert summary["energy_error"] < 1e-3
    opened = math.radians(160 - float(rest.split()[0]))
    bending = YOUNG * WIDTH * THICKNESS**3 / 12
    flexible = np.array([1, 2, 2]) / 2 * LENGTH / 3 / bending  # half cells beside each crease; none in the held panel
    moment = opened / (1 / CREASE + flexible)
    assert solution.energy["creases"][0] == pytest.approx(float(np.sum(0.5 * moment**2 / CREASE)), rel=1e-9)
    assert solution.energy["panels"][0] == pytest.approx(float(np.sum(0.5 * moment**2 * flexible)), rel=1e-9)
    reach = np.ptp(solution.shape.reshape(len(solution), -1, 3)[..., 0], axis=1)
    assert reach.max() > reach[0] * (1 + 1e-6)


def test_check_says_what_the_start_is(tmp_path: Path) -> None:
    assert checked(tmp_path).endswith(
        "as folded, at rest (the strip has no drive, and its creases carry moment as folded)"
    )
    assert "in equilibrium, at rest (the creases carry no moment as folded)" in checked(tmp_path, "crease.rest_angle=none")
    assert "in equilibrium, at rest (the creases carry no moment" in checked(tmp_path, "crease.stiffness=0")
    moment = "crease={law='spline', angle=[-1.0, 0.0, 1.0, 2.0], moment=[0.0, 1e-3, 2e-3, 3e-3]}"
    assert "as folded" in checked(tmp_path, moment)
    assert "(the strip has a drive)" in checked(tmp_path, *MORE, DRIVE, "solve.end_time=none")
    asked = checked(tmp_path, 'start="equilibrium"', "gravity=[0,0,-9.81]")
    assert "in equilibrium, at rest, with gravity and the loads at time zero (set by `start`)" in asked


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["release.hold_time=0.2 s"], "release.hold_time: must be shorter than solve.end_time, 0.11 s, or nothing moves"),
        ([*MORE, DRIVE, "release.hold_time=0.01 s"], "release: cannot be used with a [[drive]]"),
        (["start=folded"], 'start: must be "as-folded" or "equilibrium"'),
    ],
)
def test_faults(changes: list[str], said: str, tmp_path: Path) -> None:
    with pytest.raises(CaseError) as caught:
        loaded(tmp_path, *changes)
    assert said in str(caught.value)


@pytest.mark.parametrize("method", ["static", "generalized-alpha", "Radau-blocks", "auto"])
def test_beyond_the_taut_length_all_methods_end_alike(method: str, tmp_path: Path) -> None:
    """The last segment is pulled 30 mm farther than the strip reaches: exit code 3 with the reason; with 4 mm less, the run
    succeeds."""
    (tmp_path / "case.toml").write_text(CASE)
    slope = math.radians(80)
    rise = 2 / 3 * LENGTH * math.sin(slope)  # from the joint before the last segment to crease 1
    taut = math.sqrt((8 / 3 * LENGTH) ** 2 - rise**2) - 8 / 3 * LENGTH * math.cos(slope)

    def run(travel: float) -> Result:
        pull = f'drive=[{{body="panel 4 segment 3", direction=[1,0,0], speed="0.5 m/s", travel={travel}}}]'
        changes = (*MORE, pull, "solve.end_time=none", f"solve.method={method}", "crease.rest_angle=none")
        sets = [word for text in changes for word in ("--set", text)]
        places = [str(tmp_path / "case.toml"), "--out", str(tmp_path / "out")]
        return CliRunner().invoke(cli, ["run", *places, "--quiet", *sets])

    far = run(taut + 0.03)
    assert far.exit_code == 3, far.output
    assert "the drive pulls beyond the full length of the structure; shorten the travel of the drive" in far.stderr
    torn_at = float(far.stderr.split("(travel ")[1].split(" mm)")[0])
    assert 1e3 * taut < torn_at < 1e3 * taut + 20  # eight joints, each with an opening of less than a tenth of a segment
    assert not (tmp_path / "out" / "summary.json").exists()
    near = run(taut - 0.004)
    assert near.exit_code == 0, near.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["final_travel"] == pytest.approx(taut - 0.004, rel=1e-9)
    assert 0.0 < summary["peak_force"] < 1e-3 * YOUNG * WIDTH * THICKNESS  # a stretch of a thousandth would give as much


def test_summary_is_that_of_the_file(tmp_path: Path) -> None:
    summary, solution = solved(tmp_path, "solve.end_time=0.01")
    written = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert written["start"] == solution.summary["start"] == summary["start"]


def test_a_limp_strip_sags_through_no_face_on_the_way_to_its_equilibrium() -> None:
    """Ten panels of 34 um that lie on each other under their weight; in an earlier version they passed through each other
    during the search, and the run stopped."""
    described: dict[str, Any] = {
        "gravity": [-1.62, 0, 0],
        "strip": {
            "length": 0.37, "width": 0.031, "thickness": 3.4e-5, "panels": 10, "fold_angle": math.radians(80),
            "segments_per_panel": 12,
        },
        "material": {"young": 3.74e9, "poisson": 0.34, "density": 1400},
        "crease": {"law": "linear", "stiffness": 1e-6},
        "contact": {"stiffness": 1e9, "thickness_in_gap": False},
        "drive": [{"crease": 5, "direction": [0, 0, 1], "speed": 0.002, "travel": 0.005}],
    }  # fmt: skip
    case, faults = read_case(described, Path())
    assert case is not None, faults
    deployment = Deployment(case, "", None)
    system = deployment.system
    q = equilibrium_at_start(system, system.initial()[0])
    assert negative_pivots(system, 0.0, q) == 0
    weight = 1400 * 0.37 * 0.031 * 3.4e-5 * 1.62
    assert np.abs(system.force(0.0, q, None) / system.scales().force_scale).max() < 1e-6 * weight
    assert system.observe(0.0, q, None).pairs.gap.min() > -1e-6


def test_heavy_panels_swing_far_to_their_equilibrium() -> None:
    """Steel panels of 250 mm that hang from a held panel: energy descent alone took more than 1000 iterations."""
    described: dict[str, Any] = {
        "gravity": [0, 0, -9.81],
        "strip": {
            "length": 1.25, "width": 0.424, "thickness": 3.2e-4, "panels": 5, "fold_angle": math.radians(84),
            "segments_per_panel": 6, "held": [1],
        },
        "material": {"young": 196e9, "poisson": 0.3, "density": 7850, "damping": 5e-3},
        "crease": {"law": "linear", "stiffness": 0.1},
        "contact": {"stiffness": 1e10, "thickness_in_gap": False},
        "load": [{"body": "panel 4 segment 3", "force": [0, 0, 0.856], "time": {"kind": "ramp", "end": 2.0}}],
        "solve": {"end_time": 3.5},
    }  # fmt: skip
    case, faults = read_case(described, Path())
    assert case is not None, faults
    deployment = Deployment(case, "", None)
    system = deployment.system
    q = equilibrium_at_start(system, system.initial()[0])
    assert negative_pivots(system, 0.0, q) == 0
    weight = 7850 * 1.25 * 0.424 * 3.2e-4 * 9.81
    assert np.abs(system.force(0.0, q, None) / system.scales().force_scale).max() < 1e-6 * weight
