"""`[[event]]` against closed forms: times, what is released, locked and changed, the energy, steps, and resumed runs."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
import fsm.run.recorder
from fsm.errors import CaseError
from tests.physics.test_ideal_joints import body, joint, mechanism, of, run
from tests.physics.test_joint_laws import flywheel

_CLAMP = joint("clamp", "fixed", "ground", "wheel", [1, 0, 0])


def with_events(case: dict[str, Any], *events: tuple[str, list[str]]) -> dict[str, Any]:
    return case | {"event": [{"when": when, "do": do} for when, do in events]}


def spun(**keys: Any) -> dict[str, Any]:
    """A wheel of 2 kg m^2 under 3 N m, clamped."""
    case = flywheel(end=2.0, motor={"torque": 3.0}, **keys)
    case["scene"]["joints"].append(_CLAMP)
    return case


@pytest.mark.parametrize("method", ["explicit", "generalized-alpha"])
def test_release_change_and_lock(tmp_path: Path, method: str) -> None:
    """Released at .5 s, damped by d = 4 N m s/rad from .3 rad on, and locked at .5 rad, which takes its kinetic energy."""
    case = with_events(
        spun(), ("time > 0.5 s", ["release clamp"]), ("pin.angle > 0.3 rad", ["change damper of pin to 4 N m s/rad"]),
        ("pin.angle > 0.5 rad", ["lock pin"]),
    )  # fmt: skip
    case["solve"] |= {"method": method, "rtol": 1e-9 if method == "explicit" else 1e-7}
    result = run(case, tmp_path)
    first, second, third = (event["time"] for event in result.summary["joint_events"])
    sharp = 1e-9 if method == "explicit" else 2e-5
    assert first == 0.5
    assert second == pytest.approx(0.5 + math.sqrt(2.0 * 0.3 * 2.0 / 3.0), abs=sharp)
    start, last = math.sqrt(2.0 * 0.3 * 3.0 / 2.0), 3.0 / 4.0  # rates: at the change of the damper, and at last

    def angle(t: float) -> float:
        return 0.3 + last * t + (start - last) * 0.5 * -math.expm1(-2.0 * t)

    assert angle(third - second) == pytest.approx(0.5, abs=sharp)
    assert of(result, "joint.pin.angle")[-1] == pytest.approx(0.5, abs=sharp)
    assert result.summary["energy_error"] < (1e-9 if method == "explicit" else 1e-5)
    assert of(result, "joint.pin.moment")[-1, 2] == pytest.approx(-3.0, rel=1e-6)  # the lock carries the motor
    assert of(result, "energy.kinetic")[-1] == pytest.approx(0.0, abs=1e-12)
    with (tmp_path / "events.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["what"] for row in rows] == ["release clamp", "change damper of pin to 4 N m s/rad", "lock pin"]


def test_parts_that_are_released(tmp_path: Path) -> None:
    """Spring, cord, gear and latch act up to their release; then the wheel keeps its rate."""
    case = flywheel(rate=1.0, end=1.5, latch={"at": 0.1, "stiffness": 50.0})
    scene = case["scene"]
    scene["bodies"].append(body("other", [0, 0, 1], [1.0, 1.0, 2.0]))
    scene["joints"].append(joint("hub", "revolute", "ground", "other", [0, 0, 1], axis=[0, 0, 1]))
    gear = {"name": "gear", "kind": "gear", "joints": ["pin", "hub"], "parameters": {"ratio": -1.0}}
    scene["couplings"] = [gear, gear | {"name": "soft", "parameters": {"ratio": -1.0, "stiffness": 30.0}}]
    line = {"first": "ground", "second": "wheel", "at": [1, 1, 0], "to": [1, 0, 0], "stiffness": 3.0}
    scene["springs"], scene["cords"] = [line | {"name": "rubber"}], [line | {"name": "rope", "free_length": 0.7}]
    scene["bodies"][0]["angular_velocity"], scene["bodies"][1]["angular_velocity"] = [0, 0, 1.0], [0, 0, -1.0]
    case["save"]["channels"] += ["spring.*", "cord.*"]
    do = ["release rubber", "release rope", "release gear", "release soft", "release latch pin"]
    result = run(with_events(case, ("pin.angle > 0.2 rad", do)), tmp_path)
    when = next(event["time"] for event in result.summary["joint_events"] if event["joint"] == "event 1")
    after = result.time > when
    for name in ("joint.pin.rate", "joint.hub.rate"):
        assert np.ptp(of(result, name)[after]) < 1e-9
    assert abs(of(result, "joint.pin.rate")[0] - of(result, "joint.pin.rate")[-1]) > 0.01
    assert not of(result, "joint.pin.latched")[after].any()
    assert not of(result, "spring.rubber.force")[after].any()
    assert not of(result, "cord.rope.force")[after].any()
    assert result.summary["energy_error"] < 1e-8


def test_a_joint_of_several_directions_is_locked_and_unlocked(tmp_path: Path) -> None:
    """A free spherical pendulum stops at .4 s and falls again at .7 s."""
    bar = body("bar", [1.0, 0, 0], [0.04, 0.1, 0.1], angular_velocity=[0.0, 0.3, 0.5])
    ball = joint("ball", "spherical", "ground", "bar", [0, 0, 0])
    case = with_events(mechanism([bar], [ball], 1.0, 0.01), ("time > 0.4", ["lock ball"]), ("time > 0.7", ["unlock ball"]))
    result = run(case, tmp_path)
    place, t = of(result, "body.bar.position"), result.time
    still = (t >= 0.4) & (t <= 0.7)
    assert np.ptp(place[still], axis=0).max() < 1e-12
    assert np.linalg.norm(place[-1] - place[still][-1]) > 0.1
    assert result.summary["energy_error"] < 1e-8


def test_a_held_body_falls_after_a_contact(tmp_path: Path) -> None:
    """A ball of radius .1 m falls by 1 m onto a plane; at that moment a held ball begins to fall."""
    balls = [body(name, [x, 0, z], [0.01] * 3) for name, x, z in (("low", 0.0, 1.1), ("high", 5.0, 9.0))]
    balls[1]["held"] = True
    case = {
        "gravity": [0, 0, -9.80665],
        "scene": {
            "bodies": balls, "pairs": [{"first": "round", "second": "floor"}],
            "contact": {"law": "linear", "stiffness": 1e6},
            "obstacles": [
                {"name": "floor", "shape": "plane"}, {"name": "round", "shape": "sphere", "radius": 0.1, "body": "low"},
            ],
        },
        "solve": {"end_time": 0.6, "error_estimates": "off"}, "save": {"interval": 0.1, "channels": ["body.*"]},
    }  # fmt: skip
    result = run(with_events(case, ("contact floor - round", ["release high"])), tmp_path)
    (event,) = result.summary["joint_events"]
    assert event["time"] == pytest.approx(math.sqrt(2.0 / 9.80665), abs=1e-6)
    fallen = 0.5 * 9.80665 * (0.6 - event["time"]) ** 2
    assert of(result, "body.high.position")[-1, 2] == pytest.approx(9.0 - fallen, abs=1e-6)


def test_a_step_ends_and_the_next_begins(tmp_path: Path) -> None:
    """The first step ends where the wheel has turned by .3 rad; the load of the second step begins there."""
    case = flywheel(motor={"torque": 3.0})
    load = {"body": "wheel", "moment": [0.0, 0.0, -6.0]}
    case["step"] = [{"kind": "dynamic", "duration": 5.0}, {"kind": "dynamic", "duration": 0.5, "load": [load]}]
    del case["solve"]["end_time"]
    result = run(with_events(case, ("pin.angle >= 0.3", ["end step"])), tmp_path)
    when = math.sqrt(2.0 * 0.3 * 2.0 / 3.0)
    assert [step["end_time"] for step in result.summary["step"]] == pytest.approx([when, when + 0.5], abs=1e-9)
    assert result.time[-1] == pytest.approx(when + 0.5, abs=1e-9)
    turned = 0.3 + 1.5 * when * 0.5 - 0.5 * 1.5 * 0.5**2
    assert of(result, "joint.pin.angle")[-1] == pytest.approx(turned, abs=1e-9)


def test_a_run_ends(tmp_path: Path) -> None:
    case = with_events(flywheel(motor={"torque": 3.0}), ("pin.angle > 0.3", ["end step"]), ("pin.rate > 9", ["lock pin"]))
    result = run(case, tmp_path)
    assert result.time[-1] == pytest.approx(math.sqrt(0.4), abs=1e-9)
    assert any("event 2 did not happen" in text for text in result.summary["warnings"])


def test_a_resumed_run_has_the_same_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Resumed in the second step, after a step that an event has ended and a joint that another has locked."""
    case = flywheel(motor={"torque": 3.0})
    scene = case["scene"]
    scene["bodies"].append(body("other", [0, 0, 1], [1.0, 1.0, 2.0], angular_velocity=[0.0, 0.0, 1.0]))
    scene["joints"].append(joint("hub", "revolute", "ground", "other", [0, 0, 1], axis=[0, 0, 1]))
    del case["solve"]["end_time"]
    case["solve"]["max_step"] = 4e-3
    case["step"] = [{"kind": "dynamic", "duration": 5.0}, {"kind": "dynamic", "duration": 1.0}]
    events = ("pin.angle > 0.3", ["end step"]), ("hub.angle > 0.4", ["lock hub"]), ("time > 1.5", ["unlock hub", "lock pin"])
    case = with_events(case, *events)
    whole = run(case, tmp_path / "whole")
    monkeypatch.setattr(fsm.run.recorder, "CHECKPOINT_EVERY", 0.0)

    def stop(fraction: float) -> None:
        if fraction > 0.22:  # of the planned time
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fsm.load(case).run(tmp_path / "cut", progress=stop)
    resumed = fsm.load(case).run(tmp_path / "cut", resume=True)
    np.testing.assert_array_equal(resumed.time, whole.time)
    for name in ("joint.pin.angle", "joint.hub.angle", "joint.hub.moment"):
        np.testing.assert_array_equal(of(resumed, name), of(whole, name))
    assert resumed.summary["joint_events"] == whole.summary["joint_events"]
    assert len(whole.summary["joint_events"]) == 3


@pytest.mark.parametrize(
    ("when", "do", "text"),
    [
        ("pin.angel > 1", "lock pin", "event.0.when: no channel is called 'pin.angel'; did you mean 'pin.angle'?"),
        ("pin.angle > 1 kg", "lock pin", "event.0.when"),
        ("pin.angle", "lock pin", "is no condition"),
        ("time < 3", "lock pin", "is true from the start"),
        ("contact a - b", "lock pin", "no contact pair is called 'a - b'"),
        ("time > 1", "lock pim", "event.0.do.0: no joint is called 'pim'; did you mean 'pin'?"),
        ("time > 1", "release nothing", "held body, spring, cord or coupling is called 'nothing'; there are 'pin'"),
        ("time > 1", "release latch pin", "no joint with a latch is called 'pin'; there are none"),
        ("time > 1", "change damper pin to 3 N", "has the wrong unit"),
        ("time > 1", "explode", "'explode' is no action"),
    ],
)
def test_refusals(tmp_path: Path, when: str, do: str, text: str) -> None:
    with pytest.raises(CaseError) as error:
        run(with_events(flywheel(), (when, [do])), tmp_path / "out")
    assert text in str(error.value)
    assert not (tmp_path / "out" / "result.h5").exists()
