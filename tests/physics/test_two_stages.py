"""From a folded strip to the spectrum of the taut strip, in one case and one run."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fsm.cli.command_line import cli
from fsm.results.store import read_solution

PANEL, WIDTH, THICKNESS, DENSITY, CREASE = 0.08, 0.04, 3e-4, 800.0, 8e-3
CASE = f"""
title = "folded, drawn taut, struck"
stages = ["deploy", "vibrate"]
[strip]
length = {4 * PANEL}
width = {WIDTH}
thickness = {THICKNESS}
panels = 4
fold_angle = "60 deg"
segments_per_panel = 4
held = [1]
[material]
young = 3e9
poisson = 0.3
density = {DENSITY}
damping = "10 ms"
[crease]
law = "linear"
stiffness = "0.05 N mm/rad"   # soft: a stiffer one keeps the strip kinked, which stiffens it as sag does a cable
[[drive]]                # crease 3, two panels away from the held one: 2 x 80 mm x (1 - cos 60 deg), and 0.025 mm more
crease = 3
direction = [1, 0, 0]
speed = "2 mm/s"
travel = "80.025 mm"
[solve]
rtol = 1e-3
[deployed]
crease_width = {CREASE}
elements_per_panel = 4
elements_across = 2
[impact]
pulse = "half-sine"
force = "0.02 N"
duration = "2 ms"
point = [{-0.5 * PANEL}, 0]
[vibration]
duration = "0.2 s"
modes = 12
model = "reduced"
probes = {{ struck = [{-0.5 * PANEL}, 0] }}
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stages")
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    done = CliRunner().invoke(cli, ["run", str(folder / "case.toml"), "--out", str(folder / "out")])
    assert done.exit_code == 0, done.output
    return folder / "out"


def test_one_run_leaves_both_stages(results: Path) -> None:
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    assert summary["deploy"]["method"] == "static" and summary["method"] == "modal"
    assert summary["deploy"]["final_travel"] == pytest.approx(0.080025)
    assert summary["peak_force"] == summary["deploy"]["peak_force"]
    for stage, names in (("deploy", ("force.csv", "result.h5")), ("vibrate", ("history.csv", "result.h5"))):
        assert all((results / stage / name).is_file() for name in names)


def test_the_film_begins_where_the_strip_ended(results: Path) -> None:
    """Creases are sharp in both models; only parts that bend panels slightly differ."""
    strip, film = (read_solution(results / stage / "result.h5") for stage in ("deploy", "vibrate"))
    there, here = strip.shape[-1].reshape(-1, 3), film.shape[0].reshape(-1, 3)
    assert here.min(axis=0) == pytest.approx(there.min(axis=0), abs=2e-4)
    assert here.max(axis=0) == pytest.approx(there.max(axis=0), abs=2e-4)


def test_the_taut_strip_is_a_string(results: Path) -> None:
    """Two deployed panels under the final force F vibrate like a string: f = sqrt(F/m)/(2 l), m is the mass per length."""
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    pull = summary["deploy"]["final_force"]
    string = math.sqrt(pull / (DENSITY * WIDTH * THICKNESS)) / (4.0 * PANEL)
    nearest = min(summary["modes_hz"], key=lambda f: abs(f - string))
    assert nearest == pytest.approx(string, rel=0.015)
    assert summary["frequency_hz"] == pytest.approx(nearest, rel=2e-3)
    assert abs(summary["frequency_fft_hz"] - nearest) <= summary["frequency_resolution_hz"]


@pytest.mark.nightly
def test_the_stated_error_of_the_mesh_is_that_against_a_fine_one(results: Path, tmp_path: Path) -> None:
    """Two elements across compared with eight, for the frequencies and the largest displacement; the error is an estimate of
    leading order."""
    finer = ["--set", "deployed.elements_per_panel=8", "--set", "deployed.elements_across=8"]
    case = results.parent / "case.toml"
    done = CliRunner().invoke(cli, ["run", str(case), "--out", str(tmp_path), *finer])
    assert done.exit_code == 0, done.output
    coarse, fine = (json.loads((folder / "summary.json").read_text(encoding="utf-8")) for folder in (results, tmp_path))
    stated = np.array(coarse["mesh_error_modes"])
    off = np.abs(np.array(fine["modes_hz"]) / coarse["modes_hz"] - 1.0)
    assert np.all(off <= 1.5 * stated + 1e-3)
    assert off.max() > 0.01
    for name, error in (("frequency_hz", "mesh_error_frequency"), ("amplitude_center", "mesh_error_amplitude")):
        assert abs(fine[name] / coarse[name] - 1.0) <= 1.5 * coarse[error] + 1e-3
    assert max(fine["mesh_error_modes"]) < 0.3 * max(stated)
