"""Displacements of loads at the end of a run, and the energies of a path in load."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from fsm.run.summary_text import summary_lines
from tests.runs import run

SPRING = """
[[scene.bodies]]
name = "block"
mass = 0.1
inertia = [1e-4, 1e-4, 1e-4]
[[scene.elements]]
name = "spring"
inner = "ground"
outer = "block"
translation = [500, 500, 500]
rotation = [2, 2, 2]
[[load]]
body = "block"
force = [1.5, 0, 2.0]
time = { kind = "ramp", end = "1 s" }
[[load]]
name = "twist"
body = "block"
moment = [0, 0.5, 0]
time = { kind = "ramp", end = "1 s" }
[solve]
end_time = "1 s"
"""
TURNED = """
[[scene.bodies]]
name = "lid"
mass = 0.1
inertia = [1e-4, 1e-4, 1e-4]
[[scene.bodies]]
name = "arm"
mass = 0.1
inertia = [1e-4, 1e-4, 1e-4]
[[scene.elements]]
name = "hinge"
inner = "lid"
outer = "arm"
translation = [500, 500, 500]
rotation = [2, 2, 2]
translation_damping = [5, 5, 5]
rotation_damping = [0.05, 0.05, 0.05]
[[drive]]
body = "lid"
turn = "90 deg"
rate = "90 deg/s"
axis = [0, 1, 0]
[save]
channels = ["body.arm.position"]
"""


@pytest.mark.parametrize("method", ["static", "generalized-alpha"])
def test_the_summary_has_the_displacement_of_every_load_at_the_end(tmp_path: Path, method: str) -> None:
    """F/k along the force and M/k about the moment; with inertia they vibrate by less than 1/(t sqrt(k/m)), 1.4 %."""
    solution, summary = run(tmp_path, SPRING, f"solve.method={method}")
    force, moment = summary["loads"]
    off = 1e-6 if method == "static" else 0.015
    assert force["name"] == "load on block" and force["size"] == pytest.approx(2.5)
    assert force["displacement"] == pytest.approx(2.5 / 500.0, rel=off)
    assert moment["name"] == "twist, moment" and moment["displacement"] == pytest.approx(0.25, rel=off)
    assert summary["step"][-1]["loads"]["load on block"]["displacement"] == force["displacement"]
    kinetic = solution.energy["kinetic"]
    assert np.any(kinetic) == (method != "static")  # the time of a path in load is no time of a motion
    text = "\n".join(summary_lines(summary, tmp_path))
    if method == "static":
        assert "load        on block 2.5 N: displacement along the load 5 mm at the end" in text
        assert "twist, moment 0.5 N m: rotation about the moment 14.32 deg at the end" in text
    assert "peak" not in text


def test_tables_of_a_drive_that_turns_have_turns(tmp_path: Path) -> None:
    """The first column of channels.csv was "travel (m)" with angles."""
    _, summary = run(tmp_path, TURNED)
    with (tmp_path / "out" / "channels.csv").open(encoding="utf-8", newline="") as file:
        assert next(csv.reader(file))[:2] == ["turn (rad)", "time (s)"]
    assert summary["drive"] == "lid (turn)"
    lines = summary_lines(summary, tmp_path)
    assert any(line.startswith("peak moment ") and " deg of turn (" in line for line in lines)
    assert not any("slower" in line for line in lines)  # a machine has moments of inertia at any speed
    import h5py

    with h5py.File(tmp_path / "out" / "result.h5") as file:
        units = [file[name].attrs["units"] for name in ("drive/travel", "drive/force", "curve/travel", "curve/force")]
    assert units == ["rad", "N m", "rad", "N m"]
