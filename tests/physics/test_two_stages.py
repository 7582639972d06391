"""From a folded strip to the spectrum of the taut one: one case, one run."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from typer.testing import CliRunner

from fsm.cli import app
from fsm.results.store import read_solution

PANEL, WIDTH, THICKNESS, DENSITY = 0.08, 0.04, 3e-4, 800.0
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
stiffness = "2 N mm/rad"
[[drive]]                # crease 3, two panels away from the held one: 2 x 80 mm x (1 - cos 60 deg), and 0.025 mm more
crease = 3
direction = [1, 0, 0]
speed = "2 mm/s"
travel = "80.025 mm"
[solve]
rtol = 1e-3
[deployed]
elements_per_panel = 4
elements_across = 2
[impact]
pulse = "half-sine"
force = "0.1 N"
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
    done = CliRunner().invoke(app, ["run", str(folder / "case.toml"), "--out", str(folder / "out")])
    assert done.exit_code == 0, done.output
    return folder / "out"


def test_one_run_leaves_both_stages(results: Path) -> None:
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    print(summary)
    assert (results / "deploy" / "force.csv").is_file() and (results / "vibrate" / "spectrum.png").is_file()


def test_the_taut_strip_is_a_string(results: Path) -> None:
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    pull = float(read_solution(results / "deploy" / "result.h5").force[-1, 0])
    string = math.sqrt(pull / (DENSITY * WIDTH * THICKNESS)) / (4.0 * PANEL)
    print(pull, string, summary["modes_hz"], np.nan)
