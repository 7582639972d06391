"""Ideal joints in SciPy's methods, against quadrature and explicit steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fsm
from tests.physics.test_explicit import panel
from tests.physics.test_ideal_joints import body, joint, mechanism, of, pendulum
from tests.physics.test_mean_force_of_joints import four_bar, run

METHODS = "Radau", "BDF", "LSODA"


@pytest.mark.parametrize("method", METHODS)
def test_a_pendulum(method: str, tmp_path: Path) -> None:
    bar = body("bar", [2.0, 0, 0], [0.04, 0.1, 0.1])
    case = mechanism([bar], [joint("pin", "revolute", "ground", "bar", [0, 0, 0], axis=[0, 1, 0])], 1.5, 0.3)
    found = run(case, tmp_path, method, rtol=1e-8)
    angle, rate = pendulum(found.time, 2.0, 0.1)
    assert of(found, "joint.pin.angle") == pytest.approx(angle, abs=1e-5)
    assert of(found, "joint.pin.rate") == pytest.approx(rate, abs=1e-5)
    assert np.abs(of(found, "joint.pin.position")).max() < 1e-10
    assert found.summary["energy_error"] < 1e-5


def test_a_loop_has_the_reactions_of_explicit_steps(tmp_path: Path) -> None:
    exact, found = run(four_bar(), tmp_path, "explicit"), run(four_bar(), tmp_path, "Radau", rtol=1e-7)
    for name in (name for name in exact.channels if name.endswith((".force", ".moment", ".position"))):
        assert of(found, name) == pytest.approx(of(exact, name), abs=1e-4 * max(1.0, np.abs(of(exact, name)).max()))


def test_a_motor_puts_in_its_work(tmp_path: Path) -> None:
    case = panel(motor={"angle": 1.0, "time": {"kind": "ramp", "end": 1.0}})
    case["solve"]["end_time"], case["save"]["channels"] = 1.0, ["joint.*", "energy.*"]
    exact, found = run(case, tmp_path, "explicit"), run(case, tmp_path, "BDF", rtol=1e-7)
    for name in ("energy.work", "joint.hinge.motor", "joint.hinge.angle"):
        assert of(found, name) == pytest.approx(of(exact, name), abs=1e-4 * np.abs(of(exact, name)).max())


def test_latches_are_refused() -> None:
    case = panel(latch={"at": 0.5, "stiffness": 1e4})
    case["solve"]["method"] = "LSODA"
    with pytest.raises(fsm.CaseError, match='the scene has stops or latches of joints'):
        fsm.load(case).check()
