"""Motorisation margins against hand calculations."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.case.derived.joint_margin import margin_results
from fsm.errors import CaseError


def case(margin: dict[str, Any], **hinge: Any) -> fsm.Case:
    size = {"panels": 2, "length": 0.5, "width": 1.0, "thickness": 0.02, "mass": 2.0}
    tables = {"wing": size | {"hinge": hinge}, "margin": [margin], "solve": {"end_time": 0.5, "error_estimates": "off"}}
    return fsm.load({"units": "SI", **tables})


def results(margin: dict[str, Any], **hinge: Any) -> list[dict[str, Any]]:
    model = case(margin, **hinge).model
    assert model.scene is not None
    return margin_results(model.margin, model.scene.joints)


def test_the_required_moment_has_the_factors_of_the_standard() -> None:
    parts = {"inertia": 1.0, "motor_losses": 2.0, "friction": 3.0, "hysteresis": 4.0, "harness": 5.0, "adhesion": 6.0}
    asked = {"joint": "hinge 2", "dynamic": 7.0, "deliverable": 8.0, "actuator": 200.0, **parts}
    (row,) = results(asked, spring={"stiffness": 2.0, "rest": math.pi})
    # the spring of 2 N m/rad resists, most in the deployed wing: 2 pi N m
    required = 2.0 * (1.1 * 1.0 + 1.2 * 2.0 * math.pi + 1.5 * 2.0 + 3.0 * (3.0 + 4.0 + 5.0 + 6.0)) + 1.25 * 7.0 + 8.0
    assert row["joint"] == "hinge 2" and row["angle"] == 0.0
    assert row["required"] == pytest.approx(required, rel=1e-12) and row["available"] == 200.0
    assert row["margin"] == pytest.approx(200.0 / required - 1.0, rel=1e-12)


def test_the_smallest_margin_is_found_over_the_angle() -> None:
    """Spring k (c + 1) and harness with a maximum at 90 degrees: the margin is smallest there."""
    table = [[0.0, 0.0], [0.5 * math.pi, 0.2], [math.pi, 0.0]]
    asked = {"joint": "*", "harness_table": table, "friction": 0.01, "factors": {"friction": 1.5}}
    first, second = results(asked, spring={"stiffness": 0.5, "rest": -1.0}, latch={"at": 0.0, "stiffness": 10.0})
    assert second["angle"] == pytest.approx(0.5 * math.pi)
    available, required = 0.5 * (0.5 * math.pi + 1.0), 2.0 * (3.0 * 0.2 + 1.5 * 0.01)
    assert second["margin"] == pytest.approx(available / required - 1.0, rel=1e-12)
    assert first["margin"] == pytest.approx(second["margin"])  # the root begins at 90 degrees
    assert second["curve"]["angle"][0] == math.pi and second["curve"]["angle"][-1] == 0.0


def test_friction_and_harness_of_the_joint_are_required() -> None:
    """The angle falls, so the harness has its moments of closing, against the angle: it resists where they are negative."""
    rows = [[0.0, 0.1, -0.06], [math.pi, 0.1, 0.02]]
    hinge = {"spring": {"stiffness": 0.4, "rest": -1.0}, "friction": {"moment": 0.01}, "harness": {"table": rows}}
    row = results({"joint": "hinge 2", "friction": 0.005}, **hinge)[0]
    assert row["angle"] == 0.0 and row["required"] == pytest.approx(2.0 * (3.0 * 0.015 + 3.0 * 0.06), rel=1e-12)
    assert row["curve"]["required"][0] == pytest.approx(2.0 * 3.0 * 0.015, rel=1e-12)


def test_channels_have_the_moments_of_the_present_angle(tmp_path: Path) -> None:
    asked = case({"joint": "hinge 2", "friction": 0.02}, spring={"table": [[-1.0, -0.3], [4.0, 0.7]]})
    result = asked.set("save.channels", ["joint.*.margin", "joint.*.required"]).run(tmp_path)
    angle, margin = (np.asarray(result[f"joint.hinge 2.{name}"].values) for name in ("angle", "margin"))
    assert margin == pytest.approx((0.2 * angle - 0.1) / 0.12 - 1.0, rel=1e-9) and np.ptp(angle) > 0.1
    assert np.asarray(result["joint.hinge 2.required"].values) == pytest.approx(0.12)
    assert "the motorisation margin is negative: hinge 2 -1 at 0 deg" in result.summary["warnings"][0]
    assert result.summary["smallest_margin"] == -1.0  # the spring resists in the deployed wing


@pytest.mark.parametrize(
    ("margin", "hinge", "text"),
    [
        ({"joint": "hinge 7"}, {}, "margin.0.joint: no joint of kind revolute has the name 'hinge 7'"),
        ({"joint": "hinge 1", "end": math.pi / 2}, {}, "margin.0.end: missing: joint 'hinge 1' has no end of travel"),
        ({"joint": "*", "friction": -1.0}, {}, "margin.0.friction"),
        ({"joint": "*", "harness_table": [[1.0, 0.1]]}, {}, "two rows or more"),
    ],
)
def test_faults_of_margins_are_named(margin: dict[str, Any], hinge: dict[str, Any], text: str) -> None:
    with pytest.raises(CaseError) as refused:
        case(margin, **hinge)
    assert text in str(refused.value)
