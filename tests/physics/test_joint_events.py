"""Events of joints against closed forms: times, rates, impulses, and the energy balance."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from tests.physics.test_ideal_joints import of, run
from tests.physics.test_joint_laws import flywheel

_STOP = {"upper": 0.2, "stiffness": 4000.0, "restitution": 0.6}


def test_a_stop_is_hit(tmp_path: Path) -> None:
    """The wheel comes back with its restitution; the impulse is the change of its angular momentum."""
    result = run(flywheel(rate=1.5, end=0.4, stop=_STOP), tmp_path)
    (event,) = result.summary["joint_events"]
    assert (event["what"], event["joint"], event["unit"]) == ("stop is hit", "pin", "rad")
    assert event["time"] == pytest.approx(0.2 / 1.5, abs=2e-9)
    assert event["rate_before"] == pytest.approx(1.5, rel=1e-9)
    assert event["impulse"] == pytest.approx(2.0 * 1.5 * 1.6, rel=1e-2)
    assert event["largest"] == pytest.approx(np.abs(of(result, "joint.pin.stop")).max(), rel=0.2)
    assert result.summary["energy_error"] < 1e-6
    with (tmp_path / "events.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["time (s)"]) == pytest.approx(event["time"])
    assert (row["what"], row["joint"], row["unit"]) == ("stop is hit", "pin", "rad")


def test_a_latch_closes_after_its_closed_form(tmp_path: Path) -> None:
    """A constant torque of 3 N m turns 2 kg m^2 by 0.4 rad; the stop and the latch hold it there."""
    latch = {"at": 0.4, "stiffness": 2e3, "damping": 20.0}
    stop = {"upper": 0.4, "stiffness": 2e3, "damping": 20.0}
    result = run(flywheel(end=2.0, motor={"torque": 3.0}, latch=latch, stop=stop), tmp_path)
    latched = result.summary["joint_events"][0]
    assert latched["what"] == "latch closes"
    assert latched["time"] == pytest.approx(math.sqrt(2.0 * 0.4 * 2.0 / 3.0), abs=1e-6)
    assert latched["rate_before"] == pytest.approx(math.sqrt(2.0 * 0.4 * 3.0 / 2.0), rel=1e-5)
    assert latched["largest"] == pytest.approx(np.abs(of(result, "joint.pin.stop")).max(), rel=0.05)
    assert of(result, "joint.pin.angle")[-1] == pytest.approx(0.4 + 3.0 / 2e3, abs=1e-4)
    assert result.summary["energy_error"] < 1e-6


def test_the_same_case_has_the_same_bits(tmp_path: Path) -> None:
    friction = {"moment": 0.3, "law": "lugre"}
    case = flywheel(rate=1.5, end=0.6, stop=_STOP | {"lower": 0.0}, friction=friction)
    one, two = run(case, tmp_path / "one"), run(case, tmp_path / "two")
    np.testing.assert_array_equal(of(one, "joint.pin.angle"), of(two, "joint.pin.angle"))
    assert one.summary["joint_events"] == two.summary["joint_events"]
    assert len(one.summary["joint_events"]) >= 2
    assert one.summary["energy_error"] < 1e-5
