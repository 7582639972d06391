"""Events of joints against closed forms: times, rates, impulses, and the energy balance."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from tests.physics.test_ideal_joints import body, joint, mechanism, of, run
from tests.physics.test_joint_laws import flywheel

_STOP = {"upper": 0.2, "stiffness": 4000.0, "restitution": 0.6}


def test_a_stop_is_hit(tmp_path: Path) -> None:
    """The wheel comes back with its restitution; the impulse is the change of its angular momentum."""
    result = run(flywheel(rate=1.5, end=0.4, stop=_STOP), tmp_path)
    (event,) = result.summary["joint_events"]
    assert (event["what"], event["joint"], event["unit"]) == ("stop is hit", "pin", "rad")
    assert event["time"] == pytest.approx(0.2 / 1.5, abs=2e-9)
    assert event["rate_before"] == pytest.approx(1.5, rel=1e-9)
    assert event["impulse"] == pytest.approx(2.0 * 1.5 * 1.6, rel=1e-3)
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


def test_a_plastic_stop(tmp_path: Path) -> None:
    """The wheel stays where it hits the stop; its kinetic energy is lost."""
    stop = _STOP | {"restitution": 0}
    result = run(flywheel(rate=1.5, end=1.0, stop=stop), tmp_path / "free")
    (event,) = result.summary["joint_events"]
    rate, angle, after = of(result, "joint.pin.rate"), of(result, "joint.pin.angle"), result.time > 0.15
    assert event["impulse"] == pytest.approx(2.0 * (1.5 - rate[-1]), rel=1e-5)
    assert np.abs(rate[after]).max() < 2e-4
    assert angle[after] == pytest.approx(np.full(after.sum(), 0.2), abs=6e-4)
    assert result.summary["energy_error"] < 1e-6
    pressed = run(flywheel(end=1.0, stop=stop, motor={"torque": 3.0}), tmp_path / "pressed")
    (event,) = pressed.summary["joint_events"]
    assert of(pressed, "joint.pin.angle")[-1] == pytest.approx(0.2, abs=1e-3)
    assert pressed.summary["energy_error"] < 1e-6


def test_a_joint_that_starts_on_its_stop_does_not_hit_it(tmp_path: Path) -> None:
    for load in (3.0, 0.0):
        result = run(flywheel(end=0.2, stop={"upper": 0.0, "stiffness": 4e3}, motor={"torque": load}), tmp_path / str(load))
        assert "joint_events" not in result.summary


def test_the_same_case_has_the_same_bits(tmp_path: Path) -> None:
    friction = {"moment": 0.3, "law": "lugre"}
    case = flywheel(rate=1.5, end=0.6, stop=_STOP | {"lower": 0.0}, friction=friction)
    one, two = run(case, tmp_path / "one"), run(case, tmp_path / "two")
    np.testing.assert_array_equal(of(one, "joint.pin.angle"), of(two, "joint.pin.angle"))
    assert one.summary["joint_events"] == two.summary["joint_events"]
    assert len(one.summary["joint_events"]) >= 2
    assert one.summary["energy_error"] < 1e-5


def test_events_that_are_not_listed_are_counted(tmp_path: Path) -> None:
    """A slider between two elastic stops, 20 mm apart, hits one after 20 mm at 2 m/s and half a vibration: of all hits 256
    are listed."""
    block = body("block", [0, 0, 0], [0.1] * 3, velocity=[2.0, 0.0, 0.0])
    stop = {"lower": -0.01, "upper": 0.01, "stiffness": 1e5}
    slide = joint("slide", "prismatic", "ground", "block", [0, 0, 0], axis=[1, 0, 0]) | {"stop": stop}
    case = mechanism([block], [slide], 6.0, 0.5) | {"gravity": [0.0, 0.0, 0.0]}
    summary = run(case, tmp_path).summary
    assert len(summary["joint_events"]) == 256
    hits = 1 + math.floor((6.0 - 0.005) / (0.01 + math.pi * math.sqrt(1.0 / 1e5)))
    assert any(f"{hits} events of stops and latches, of which the first 256 are" in text for text in summary["warnings"])
