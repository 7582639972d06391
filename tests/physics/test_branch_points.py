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
