"""Latches and stops of ideal joints on slow paths: a step ends where a latch closes or opens."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.api.case import Result

_SPRING, _LATCH = 3.0, 100.0


def panel(table: dict[str, Any], **keys: Any) -> dict[str, Any]:
    """Panel on a hinge with a spring, from 0 to 2 s; `table` drives its angle, or loads it."""
    spring = {"stiffness": keys.pop("stiffness", _SPRING), "rest": 0.0}
    joint = {"name": "hinge", "kind": "revolute", "first": "ground", "second": "panel", "at": [0.0] * 3}
    body = {"name": "panel", "mass": 1.0, "inertia": [1e-3, 0.1, 0.1], "position": [0.5, 0.0, 0.0]}
    joint |= {"axis": [0.0, 1.0, 0.0], "spring": spring}
    scene: dict[str, Any] = {"bodies": [body], "joints": [joint | keys]}
    if "angle" in table:
        scene["joints"][0]["motor"] = {"angle": {"value": 1.0, "time": _time(table["angle"])}}
    else:
        scene["loads"] = [{"name": "M", "body": "panel", "moment": [0.0, 1.0, 0.0], "time": _time(table["moment"])}]
    return {
        "units": "SI", "gravity": [0.0, 0.0, 0.0], "scene": scene,
        "solve": {"end_time": 2.0, "error_estimates": "off", "method": "static"},
        "save": {"interval": 0.13, "channels": ["joint.*"]},
    }  # fmt: skip


def _time(values: list[float]) -> dict[str, Any]:
    return {"kind": "table", "time": [0.0, 1.0, 2.0], "value": values}


def run(case: dict[str, Any], folder: Path) -> tuple[Result, dict[str, dict[str, float]]]:
    """Result, and the numbers of its events."""
    result = fsm.load(case).run(folder, figures=False)
    with (folder / "events.csv").open() as file:
        rows = list(csv.DictReader(file))
    numbers = {row["what"]: {key: float(row[key]) for key in ("time (s)", "coordinate", "largest")} for row in rows}
    return result, numbers


def test_a_driven_latch_opens_on_a_slow_path_and_loses_its_energy(tmp_path: Path) -> None:
    """The way back begins at 0.8 rad; the latch at 0.5 rad holds 10 N m, up to 0.1 rad of its stiffness."""
    latch = {"at": 0.5, "stiffness": _LATCH, "opens_at": 10.0}
    result, events = run(panel({"angle": [0.0, 0.8, -0.1]}, latch=latch), tmp_path)
    assert events["latch closes"]["time (s)"] == pytest.approx(0.5 / 0.8, abs=1e-8)
    assert events["latch opens"]["time (s)"] == pytest.approx(1.0 + 0.4 / 0.9, abs=1e-6)
    assert events["latch closes"]["largest"] == pytest.approx(10.0, rel=2e-6)
    angle, latched = result["joint.hinge.angle"].values, result.time < 1.0 + 0.4 / 0.9
    pulled = np.where(latched & (result.time > 1.0), np.minimum(_LATCH * (angle - 0.5), 0.0), 0.0)
    assert result["joint.hinge.motor"].values == pytest.approx(_SPRING * angle + pulled, abs=1e-7)
    assert result.summary["energy_error"] < 1e-5


def test_a_loaded_latch_opens_and_the_panel_finds_its_next_equilibrium(tmp_path: Path) -> None:
    """At 2 N m of the latch the panel is at 0.48 rad; without the latch its spring has it at the moment over 30 N m/rad."""
    latch = {"at": 0.5, "stiffness": _LATCH, "opens_at": 2.0}
    result, events = run(panel({"moment": [0.0, 18.0, 0.0]}, latch=latch, stiffness=30.0), tmp_path)
    at = 2.0 - (30.0 * 0.48 - 2.0) / 18.0
    assert events["latch opens"]["time (s)"] == pytest.approx(at, abs=2e-6)
    angle, moment = result["joint.hinge.angle"].values, 18.0 * (1.0 - np.abs(result.time - 1.0))
    held = (result.time > 1.0) & (result.time < at) & (moment < 15.0)
    assert angle == pytest.approx(np.where(held, (moment + 50.0) / 130.0, moment / 30.0), abs=1e-7)
    assert result.summary["energy_error"] < 1e-5


def test_moments_alone_set_the_scale_of_forces_on_a_slow_path(tmp_path: Path) -> None:
    """A stop is reached between two steps. No force acts on the panel, so only moments show the error of a long step."""
    stop = {"upper": 0.47, "stiffness": _LATCH}
    result, events = run(panel({"angle": [0.0, 1.0, 0.0]}, stop=stop), tmp_path)
    assert events["stop is hit"]["time (s)"] == pytest.approx(0.47, abs=1e-8)
    assert events["stop is hit"]["largest"] == pytest.approx(53.0, abs=1e-6)
    assert result.summary["energy_error"] < 1e-5


def test_a_stop_is_hit_in_the_motion_after_a_slow_step(tmp_path: Path) -> None:
    """A load turns a wheel of 2 kg m^2 on 8 N m/rad to -0.3 rad; released, it hits its stop at 0.2 rad, and the step ends
    when it comes back to zero.
    """
    case = panel({"moment": [0.0, 0.0, 0.0]}, stiffness=8.0, stop={"upper": 0.2, "stiffness": 4000.0, "restitution": 0.6})
    case["scene"]["bodies"][0] |= {"position": [0.0, 0.0, 0.0], "inertia": [2.0, 2.0, 2.0]}
    case["scene"].pop("loads")
    case |= {"solve": {"error_estimates": "off"}, "save": {"interval": 0.05, "channels": ["joint.*"]}}
    load = {"name": "M", "body": "panel", "moment": [0.0, -2.4, 0.0]}
    case["step"] = [
        {"kind": "static", "duration": 100.0, "load": [load]}, {"kind": "dynamic", "duration": 5.0, "release": ["M"]},
    ]  # fmt: skip
    case["event"] = [{"name": "back", "when": "hinge.angle < 0 and hinge.rate < -0.1", "do": "end step"}]
    result = fsm.load(case).run(tmp_path, figures=False)
    stop, back = result.summary["joint_events"]
    at, rate = 0.5 * np.arccos(-0.2 / 0.3), 0.6 * np.sin(np.arccos(-0.2 / 0.3))
    assert (stop["what"], back["what"]) == ("stop is hit", "end step")
    assert stop["time"] == pytest.approx(100.0 + at, abs=1e-6)
    assert stop["rate_before"] == pytest.approx(rate, rel=1e-5)  # rtol^(2/3) of the motion, with a margin
    assert result.summary["step"][1]["end_time"] == back["time"]
