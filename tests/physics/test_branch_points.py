"""Warnings on mechanisms that pass a branch point."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from tests.physics.test_joints_at_rest import pin, rod

_SPEED = 12.0


def linkage(width: float, longer: float, start: float) -> dict[str, Any]:
    """Four-bar whose crank and rocker are parallel at the start, at an angle from the vertical; all links turn as one."""
    a, d = np.zeros(3), np.array([width, 0.0, 0.0])
    along = 0.3 * np.array([np.sin(start), 0.0, np.cos(start)])
    b, c = a + along, d + (1.0 + longer) * along
    bodies = [rod("crank", a, b), rod("coupler", b, c), rod("rocker", d, c)]
    for body, arm in zip(bodies, (0.5 * along, along, 0.5 * along), strict=True):
        body["velocity"] = np.cross([0.0, _SPEED, 0.0], arm).tolist()
        body["angular_velocity"] = [0.0, 0.0 if body["name"] == "coupler" else _SPEED, 0.0]
    joints = [pin("a", "ground", "crank", a), pin("b", "crank", "coupler", b)]
    joints += [pin("c", "coupler", "rocker", c), pin("d", "ground", "rocker", d)]
    return {
        "units": "SI", "gravity": [0.0, 0.0, 0.0], "scene": {"bodies": bodies, "joints": joints},
        "solve": {"end_time": 0.3, "error_estimates": "off"}, "save": {"interval": 0.01},
    }  # fmt: skip


def warnings(case: dict[str, Any], folder: Path) -> list[str]:
    return [text for text in fsm.load(case).run(folder, figures=False).summary["warnings"] if "branch point" in text]


@pytest.mark.parametrize("start", [0.4, 0.53])
def test_a_flat_parallelogram_is_a_branch_point(tmp_path: Path, start: float) -> None:
    """It is flat when its crank has turned to the horizontal, between two records."""
    (text,) = warnings(linkage(0.5, 0.0, start), tmp_path)
    at = 1e3 * (0.5 * np.pi - start) / _SPEED
    assert text.startswith("the loop of joint ")
    assert float(text.split(" near ")[1].split(" ms")[0]) == pytest.approx(at, abs=0.1)


def test_a_linkage_that_is_never_flat_has_no_branch_point(tmp_path: Path) -> None:
    assert not warnings(linkage(0.5, 0.02, 0.4), tmp_path)


def geared(longer: float, phase: float) -> dict[str, Any]:
    """Two cranks, which gears turn in opposite senses, and two couplers between them. Without `longer`, both couplers are in
    line after 0.4 rad, where the tips of the cranks are farthest apart; their joint may then move to either side."""
    width, crank, begin = 0.4, 0.15, -0.4 - 0.5 * phase
    left = crank * np.array([-np.cos(begin + phase), 0.0, np.sin(begin + phase)])
    right = crank * np.array([np.cos(begin), 0.0, np.sin(begin)])
    coupler = 0.5 * np.hypot(width + 2.0 * crank * np.cos(0.5 * phase), 2.0 * crank * np.sin(0.5 * phase)) * (1.0 + longer)
    a, d = np.zeros(3), np.array([width, 0.0, 0.0])
    b, e = a + left, d + right
    apart = 0.5 * (e - b)
    down = np.cross(apart, [0.0, 1.0, 0.0]) / np.linalg.norm(apart)
    top = 0.5 * (b + e) - np.sqrt(coupler**2 - apart @ apart) * down
    bodies = [rod("left", a, b), rod("left coupler", b, top), rod("right coupler", top, e), rod("right", d, e)]
    for body, arm, spin in ((bodies[0], 0.5 * (b - a), 20.0), (bodies[3], 0.5 * (e - d), -20.0)):
        body["angular_velocity"] = [0.0, spin, 0.0]
        body["velocity"] = np.cross(body["angular_velocity"], arm).tolist()
    joints = [pin("a", "ground", "left", a), pin("b", "left", "left coupler", b)]
    joints += [pin("c", "left coupler", "right coupler", top), pin("e", "right", "right coupler", e)]
    joints += [pin("d", "ground", "right", d)]
    gear = {"name": "gears", "kind": "gear", "joints": ["a", "d"], "parameters": {"ratio": -1.0}}
    return {
        "units": "SI", "gravity": [0.0, 0.0, 0.0], "scene": {"bodies": bodies, "joints": joints, "couplings": [gear]},
        "solve": {"end_time": 0.3, "error_estimates": "off"}, "save": {"interval": 4e-3, "channels": ["joint.*"]},
    }  # fmt: skip


@pytest.mark.parametrize("phase", [0.0, 0.8])
def test_a_geared_linkage_passes_a_branch_point(phase: float, tmp_path: Path) -> None:
    """With a phase, only the gear makes it singular; without one, a state between two records is so exactly."""
    result = fsm.load(geared(0.0, phase)).run(tmp_path, figures=False)
    (text,) = [text for text in result.summary["warnings"] if "branch point" in text]
    at = np.interp(0.4, np.asarray(result["joint.a.angle"].values).ravel(), result.time)
    assert float(text.split(" near ")[1].split(" ms")[0]) == pytest.approx(1e3 * at, abs=0.1)
    assert not warnings(geared(0.02, phase), tmp_path / "never")


def test_many_records_are_not_followed() -> None:
    """Twenty locked directions at 2001 records, and fewer."""
    case = linkage(0.5, 0.0, 0.4)
    case["solve"]["end_time"] = 1.0
    case["save"]["interval"] = 5e-4
    text = "branch points are not looked for: 20 locked directions at 2001 records, more than 40000 in all; save less often"
    assert text in str(fsm.load(case).check())
    case["save"]["interval"] = 5.1e-4
    assert "branch points" not in str(fsm.load(case).check())
