"""Ideal joints against quadrature and other formulations of the same mechanism."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import fsm
import fsm.run.recorder
from fsm.api.case import Result
from fsm.model.compile.compile_case import compile_case
from fsm.model.elements.joints import JointGroup
from fsm.model.plan.in_python import InPython
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

_G = 9.80665


def body(name: str, position: Any, inertia: Any, turned: Rotation | None = None, **keys: Any) -> dict[str, Any]:
    quaternion = (turned or Rotation.identity()).as_quat(scalar_first=True)
    place = np.array(position, dtype=float).tolist()
    return {"name": name, "mass": 1.0, "inertia": inertia, "position": place, "orientation": quaternion.tolist(), **keys}


def joint(name: str, kind: str, first: str, second: str, at: Any, **keys: Any) -> dict[str, Any]:
    vectors = {key: np.array(value, dtype=float).tolist() for key, value in keys.items()}
    place = np.array(at, dtype=float).tolist()
    return {"name": name, "kind": kind, "first": first, "second": second, "at": place, **vectors}


def mechanism(
    bodies: list[dict[str, Any]], joints: list[dict[str, Any]], end: float, every: float, **keys: Any
) -> dict[str, Any]:
    parts = {"joint": joints, "spring": keys.get("springs"), "cord": keys.get("cords")}
    own = [f"{kind}.*" for kind, given in parts.items() if given]
    return {
        "units": "SI", "gravity": [0.0, 0.0, -_G], "scene": {"bodies": bodies, "joints": joints, **keys},
        "solve": {"end_time": end, "error_estimates": "off"},
        "save": {"interval": every, "channels": [*own, "body.*", "energy.*"]},
    }  # fmt: skip


def of(result: Result, name: str) -> np.ndarray:
    return np.asarray(result[name].values)


def run(case: dict[str, Any], folder: Path) -> Result:
    return fsm.load(case).run(folder)


# references -------------------------------------------------------------------------------------------------------------


def pendulum(times: np.ndarray, length: float, inertia: float) -> tuple[np.ndarray, np.ndarray]:
    """Angle below the horizontal and its rate of a bar that starts horizontally at rest."""
    rate = _G * length / (inertia + length**2)
    found = solve_ivp(
        lambda t, y: [y[1], rate * math.cos(y[0])], (0.0, times[-1]), [0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-12
    )
    return found.y[0], found.y[1]


def test_a_pendulum_on_a_revolute_joint_has_its_angle_and_reactions(tmp_path: Path) -> None:
    length, inertia = 2.0, 0.1
    bar = body("bar", [length, 0, 0], [0.04, inertia, inertia])
    pin = joint("pin", "revolute", "ground", "bar", [0, 0, 0], axis=[0, 3, 0]) | {"angle": "90 deg"}
    result = run(mechanism([bar], [pin], 5.0, 0.1), tmp_path)
    times = result.time
    angle, rate = pendulum(times, length, inertia)
    spin = _G * length / (inertia + length**2) * np.cos(angle)
    along, across = np.stack([np.cos(angle), -np.sin(angle)]), np.stack([-np.sin(angle), -np.cos(angle)])
    force = -length * rate**2 * along + length * spin * across + np.array([[0.0], [_G]])
    assert of(result, "joint.pin.angle") == pytest.approx(0.5 * math.pi + angle, abs=1e-5)
    assert of(result, "joint.pin.rate") == pytest.approx(rate, abs=2e-5)
    found = of(result, "joint.pin.force")
    assert found[:, [0, 2]] == pytest.approx(force.T, abs=1e-4 * np.abs(force).max())
    assert np.abs(found[:, 1]).max() < 1e-9
    assert np.abs(of(result, "joint.pin.moment")).max() < 1e-9
    assert np.abs(of(result, "joint.pin.position")).max() < 1e-10
    axes = of(result, "joint.pin.force_in_joint")
    assert np.linalg.norm(axes, axis=1) == pytest.approx(np.linalg.norm(found, axis=1), rel=1e-12)
    assert np.abs(axes[:, 2]).max() < 1e-9


def test_a_spherical_pendulum(tmp_path: Path) -> None:
    """A ball on a rod that turns about the vertical and swings; the angular momentum about the vertical is kept."""
    length, spin, tilt = 1.0, 2.0, 0.4
    start = np.array([math.sin(tilt) * length, 0.0, -math.cos(tilt) * length])
    turn = np.array([0.0, 0.0, spin])
    ball = body("ball", start, [1e-6] * 3, velocity=np.cross(turn, start).tolist(), angular_velocity=turn.tolist())
    result = run(mechanism([ball], [joint("ball", "spherical", "ground", "ball", [0, 0, 0])], 3.0, 0.1), tmp_path)

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        place, speed = y[:3], y[3:]
        pull = -(speed @ speed - _G * place[2]) / length**2
        return np.concatenate([speed, pull * place - [0.0, 0.0, _G]])

    times, first = result.time, np.concatenate([start, np.cross(turn, start)])
    found = solve_ivp(slope, (0.0, times[-1]), first, "DOP853", times, rtol=1e-12, atol=1e-12).y
    assert of(result, "body.ball.position") == pytest.approx(found[:3].T, abs=2e-5)
    pull = np.array([-(v @ v - _G * r[2]) / length**2 * r for r, v in zip(found[:3].T, found[3:].T, strict=True)])
    assert of(result, "joint.ball.force") == pytest.approx(pull, abs=1e-4 * np.abs(pull).max())


def test_a_shaft_with_a_cross_whose_second_half_is_given_no_velocity(tmp_path: Path) -> None:
    """The velocity of the second half is corrected; it turns with w cos b/(1 - sin(b)^2 sin(w t)^2)."""
    bend, speed = 0.4, 5.0
    along = np.array([math.cos(bend), 0.0, math.sin(bend)])
    halves = body("in", [-0.2, 0, 0], [0.01] * 3, angular_velocity=[speed, 0.0, 0.0]), body("out", 0.2 * along, [0.01] * 3)
    driven = joint("p", "revolute", "ground", "in", [-0.2, 0, 0], axis=[1, 0, 0]) | {"motor": {"speed": speed}}
    cross = joint("u", "universal", "in", "out", [0, 0, 0], axis=[0, 1, 0], second_axis=np.cross(along, [0, 1, 0]))
    bearing = joint("q", "cylindrical", "ground", "out", 0.2 * along, axis=along)
    case = mechanism([*halves], [driven, cross, bearing], 1.0, 0.05)
    result = run(case | {"gravity": [0.0] * 3}, tmp_path)
    assert any("initial velocities open the joints" in text for text in result.summary["warnings"])
    found = np.linalg.norm(of(result, "body.out.angular_velocity"), axis=1)
    expected = speed * math.cos(bend) / (1.0 - (math.sin(bend) * np.sin(speed * result.time)) ** 2)
    assert found == pytest.approx(expected, abs=1e-7)
    assert result.summary["steps"] < 200


def test_angles_of_a_cross_give_the_orientation(tmp_path: Path) -> None:
    """The body is turned about the axis on the ground, after a turn about its own axis of the cross."""
    rod = body("rod", [0.1, 0.2, -1.0], [0.1, 0.2, 0.15], velocity=[1.0, 0.5, 0.0], angular_velocity=[0.5, -1.0, 2.0])
    cross = joint("cross", "universal", "ground", "rod", [0, 0, 0], axis=[1, 0, 0], second_axis=[0, 0.6, 0.8])
    result = run(mechanism([rod], [cross], 2.0, 0.1), tmp_path)
    one, two = of(result, "joint.cross.angle_1"), of(result, "joint.cross.angle_2")
    turned = Rotation.from_rotvec(np.outer(one, [1.0, 0.0, 0.0])) * Rotation.from_rotvec(np.outer(two, [0.0, 0.6, 0.8]))
    found = Rotation.from_quat(of(result, "body.rod.orientation"), scalar_first=True)
    assert np.abs((turned.inv() * found).as_rotvec()).max() < 1e-9
    assert min(np.ptp(one), np.ptp(two)) > 0.3
    slopes = np.array([(a[2:] - a[:-2]) / 0.2 for a in (one, two)])
    rates = np.array([of(result, f"joint.cross.rate_{k}")[1:-1] for k in (1, 2)])
    assert slopes == pytest.approx(rates, abs=0.03 * np.abs(rates).max())


# loops, chains, starts --------------------------------------------------------------------------------------------------


def bars(points: Sequence[tuple[float, float]]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Bars between points (x, z) of a plane on revolute joints along y; the first and the last joint are on the ground."""
    found, pins = [], []
    for k, (a, b) in enumerate(pairwise(points)):
        (xa, za), (xb, zb) = a, b
        length, angle = math.dist(a, b), math.degrees(math.atan2(zb - za, xb - xa))
        inertia = [1e-3, length**2 / 12.0, length**2 / 12.0]
        middle, turned = [0.5 * (xa + xb), 0.0, 0.5 * (za + zb)], Rotation.from_euler("y", -angle, degrees=True)
        found.append(body(f"bar {k + 1}", middle, inertia, turned))
    names = ["ground", *(one["name"] for one in found), "ground"]
    for k, (x, z) in enumerate(points):
        pins.append(joint(f"pin {k + 1}", "revolute", names[k], names[k + 1], [x, 0.0, z], axis=[0, 1, 0]))
    return found, pins


def four_bar() -> dict[str, Any]:
    bodies, pins = bars([(0.0, 0.0), (0.0, 1.0), (1.5, 1.6), (2.0, 0.0)])
    return mechanism(bodies, pins, 2.0, 0.25)


def test_a_four_bar_has_one_freedom_and_three_named_repeats() -> None:
    text = str(fsm.load(four_bar()).check())
    assert "1 degree of freedom at the start, after 20 locked directions" in text
    assert "3 locked directions follow from those before them" in text
    assert text.count("pin 4 (") == 3


def test_a_pin_given_twice_changes_nothing(tmp_path: Path) -> None:
    """Energy and rates of the loop too: its joints do no work."""
    case = four_bar()
    once = run(case, tmp_path / "once")
    case["scene"]["joints"].append(case["scene"]["joints"][1] | {"name": "again"})
    twice = run(case, tmp_path / "twice")
    place = of(once, "body.bar 2.position")
    assert np.ptp(place, axis=0).max() > 0.5
    assert of(twice, "body.bar 2.position") == pytest.approx(place, abs=1e-6)
    shared = of(twice, "joint.pin 2.force") + of(twice, "joint.again.force")
    assert shared == pytest.approx(of(once, "joint.pin 2.force"), abs=1e-4)
    assert of(twice, "joint.again.force") == pytest.approx(0.5 * shared, abs=1e-6)
    assert once.summary["energy_error"] < 1e-5


def test_a_closed_chain_does_not_drift(tmp_path: Path) -> None:
    case = four_bar()
    case["solve"] |= {"end_time": 4.0, "rtol": 1e-6}
    result = run(case, tmp_path)
    for name, point in (("pin 4", [2.0, 0.0, 0.0]), ("pin 1", [0.0, 0.0, 0.0])):
        where = of(result, f"joint.{name}.position")
        if name == "pin 1":
            assert np.abs(where - point).max() < 1e-10
        else:  # the last pin is a point of the ground
            assert np.abs(where - point).max() == 0.0
    half = 0.5 * math.dist((1.5, 1.6), (2.0, 0.0))
    ends = of(result, "body.bar 3.position") + half * rotated_x(of(result, "body.bar 3.orientation"))
    assert np.abs(ends - [2.0, 0.0, 0.0]).max() < 1e-10
    assert np.abs(of(result, "joint.pin 2.rate")).max() > 1.0


def rotated_x(quaternions: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(quaternions, scalar_first=True).apply([1.0, 0.0, 0.0])


def test_velocities_that_joints_do_not_allow_are_corrected(tmp_path: Path) -> None:
    """A bar on a pin pushed along and across at its middle: it turns with the angular momentum about the pin."""
    bar = body("bar", [1.0, 0.0, 0.0], [0.01, 0.3, 0.3], velocity=[2.0, 0.5, 1.0])
    case = mechanism([bar], [joint("pin", "revolute", "ground", "bar", [0, 0, 0], axis=[0, 1, 0])], 0.01, 0.01)
    assert "initial velocities open the joints" in str(fsm.load(case).check())
    result = run(case, tmp_path)
    spin = -1.0 / (0.3 + 1.0)
    assert of(result, "body.bar.angular_velocity")[0] == pytest.approx([0.0, spin, 0.0], abs=1e-12)
    assert of(result, "body.bar.velocity")[0] == pytest.approx([0.0, 0.0, -spin], abs=1e-12)
    assert any("initial velocities open the joints" in text for text in result.summary["warnings"])


def test_steps_in_python_are_the_compiled_ones() -> None:
    """A chain of three bars of different joints, by the System in Python and by its kernels."""
    bodies, pins = bars([(0.0, 0.0), (1.0, 0.0), (2.0, 0.3), (3.0, 0.2)])
    del pins[-1]
    pins[1] = joint("ball", "spherical", "bar 1", "bar 2", pins[1]["at"])
    pins[2] = joint("cross", "universal", "bar 2", "bar 3", pins[2]["at"], axis=[0, 1, 0], second_axis=[1, 0, 1])
    loaded = fsm.load(mechanism(bodies, pins, 0.2, 0.1))

    def end(compiled: bool) -> tuple[np.ndarray, np.ndarray]:
        _, system = compile_case(loaded.model)
        if not compiled:
            system.in_python = InPython(("a test",))
        saved: list[SavedState] = []
        simulate(system, Settings("generalized-alpha", 1e-6, 0.2), [0.2], saved.append)
        assert isinstance(system.locking[0], JointGroup)
        return saved[-1].q, system.locking[0].efforts.copy()

    for one, other in zip(end(True), end(False), strict=True):
        assert one == pytest.approx(other, rel=1e-7, abs=1e-7)


# mistakes ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"first": "grund"}, "no body is called 'grund'; did you mean 'ground'"),
        ({"axis": [0.0, 0.0, 0.0]}, "an axis has a direction"),
        ({"kind": "in-line"}, "of kind 'in-line' needs `to`"),
        ({"to": [1.0, 0.0, 0.0]}, "of kind 'revolute' has no `to`"),
        ({"second": "ground"}, "joins 'ground' to itself"),
        ({"kind": "universal"}, "needs `second_axis`"),
        ({"kind": "universal", "second_axis": [0.0, 1.0, 1.0]}, "not at a right angle"),
        ({"kind": "in-plane", "to": [1.0, 0.002, 0.0]}, "the point is 2 mm off the plane of joint 'pin'"),
        ({"kind": "spherical"}, "of kind 'spherical' has no `axis`"),
        ({"second": "post", "first": "ground"}, "both held or driven"),
    ],
)
def test_mistakes(change: dict[str, Any], text: str) -> None:
    post = body("post", [0.0, 0.0, 0.0], [0.1, 0.1, 0.1], held=True)
    pin = joint("pin", "revolute", "ground", "bar", [0, 0, 0], axis=[0, 1, 0]) | change
    with pytest.raises(fsm.CaseError) as failure:
        fsm.load(mechanism([post, body("bar", [1.0, 0.0, 0.0], [0.1, 0.1, 0.1])], [pin], 1.0, 0.1)).check()
    assert text in str(failure.value)
    assert len(failure.value.faults) == 1


def test_a_method_without_joints() -> None:
    case = four_bar()
    case["solve"]["method"] = "Radau-blocks"
    with pytest.raises(fsm.CaseError, match='"Radau-blocks" has no ideal joints'):
        fsm.load(case).check()


def test_names_differ_and_films_are_refused() -> None:
    case = four_bar()
    case["scene"]["joints"][1]["name"] = "pin 1"
    with pytest.raises(fsm.CaseError, match="the name 'pin 1' is used 2 times"):
        fsm.load(case).check()


def test_a_drive_against_a_joint_is_refused() -> None:
    """The handle would slide along x, but its pin to the ground holds it."""
    hand = {"name": "hand", "mass": 0.0, "inertia": [0.0, 0.0, 0.0], "position": [1.0, 0.0, 0.0]}
    bar = body("bar", [0.5, 0.0, 0.0], [0.1, 0.1, 0.1])
    joints = [joint("a", "spherical", "ground", "bar", [0, 0, 0]), joint("b", "spherical", "bar", "hand", [1, 0, 0])]
    case = mechanism([hand, bar], joints, 1.0, 0.1)
    case["drive"] = [{"body": "hand", "direction": [1.0, 0.0, 0.0], "speed": 0.1, "travel": 0.1}]
    with pytest.raises(fsm.CaseError, match=r"the prescribed motions open joint [ab] "):
        fsm.load(case).check()


@pytest.mark.parametrize("form", ["pulsating", "alternating"])
def test_a_pendulum_on_a_driven_body(form: str, tmp_path: Path) -> None:
    """A pivot that moves along x: the angle, and the force of the joint with the acceleration of the pivot."""
    length, inertia, size, pace = 0.5, 0.02, 0.1, 2.0 * math.pi
    hand = {"name": "hand", "mass": 1.0, "inertia": [1.0, 1.0, 1.0]}
    bar = body("bar", [0.0, 0.0, -length], [1e-3, inertia, inertia], Rotation.from_euler("y", 90, degrees=True))
    pin = joint("pin", "revolute", "hand", "bar", [0, 0, 0], axis=[0, 1, 0])
    case = mechanism([hand, bar], [pin], 1.5, 0.05)
    program = {"kind": "cycle", "period": 1.0, "cycles": 2, "form": form}
    case["drive"] = [{"body": "hand", "direction": [1.0, 0.0, 0.0], "travel": size, "time": program}]
    result = run(case, tmp_path)

    def pivot(t: np.ndarray) -> np.ndarray:
        return 0.5 * size * pace**2 * np.cos(pace * t) if form == "pulsating" else -size * pace**2 * np.sin(pace * t)

    def bend(t: np.ndarray, angle: np.ndarray) -> np.ndarray:  # angle about y, the bar hangs at zero
        return (pivot(t) * length * np.cos(angle) - _G * length * np.sin(angle)) / (inertia + length**2)

    # at a first speed of the pivot, the bar has the nearest velocity to rest that the joint allows
    first = 0.0 if form == "pulsating" else size * pace * length / (inertia + length**2)
    times = result.time
    found = solve_ivp(
        lambda t, y: [y[1], bend(t, y[0])], (0.0, times[-1]), [0.0, first], "DOP853", times, rtol=1e-12, atol=1e-12
    )
    angle, rate = found.y
    assert of(result, "joint.pin.angle") == pytest.approx(angle, abs=2e-5)
    turn = bend(times, angle)
    across = pivot(times) - length * (turn * np.cos(angle) - rate**2 * np.sin(angle))
    up = _G + length * (turn * np.sin(angle) + rate**2 * np.cos(angle))
    force = of(result, "joint.pin.force")[1:-1]
    assert force[:, [0, 2]] == pytest.approx(np.stack([across, up], axis=1)[1:-1], abs=1e-4 * np.abs(up).max())
    assert result.summary["energy_error"] < 1e-4


def test_a_resumed_run_has_the_same_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Multipliers, turns and latches are stored at restart points."""
    case = four_bar()
    case["scene"]["joints"][0] |= {"damper": {"coefficient": 0.1}, "latch": {"at": "-20 deg", "stiffness": 50.0}}
    whole = run(case, tmp_path / "whole")
    monkeypatch.setattr(fsm.run.recorder, "CHECKPOINT_EVERY", 0.0)

    def stop(fraction: float) -> None:
        if fraction > 0.6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fsm.load(case).run(tmp_path / "cut", progress=stop)
    resumed = fsm.load(case).run(tmp_path / "cut", resume=True)
    for name in ("body.bar 2.position", "joint.pin 2.force", "joint.pin 1.angle", "joint.pin 1.latched"):
        np.testing.assert_array_equal(of(resumed, name), of(whole, name))
    assert 0.0 < of(whole, "joint.pin 1.latched").mean() < 1.0


# springs, stops, motors -------------------------------------------------------------------------------------------------


def slider(**keys: Any) -> dict[str, Any]:
    block = body("block", [0.0, 0.0, 0.0], [0.1, 0.1, 0.1], velocity=[1.0, 0.0, 0.0])
    slide = joint("slide", "prismatic", "ground", "block", [0, 0, 0], axis=[1, 0, 0])
    return mechanism([block], [slide | keys], 1.0, 0.01)


def test_a_stop_returns_a_block(tmp_path: Path) -> None:
    """1 m/s to a stop at 0.2 m: half a period later it is there again, and moves back as fast."""
    stiffness = 400.0
    result = run(slider(stop={"upper": 0.2, "stiffness": stiffness}), tmp_path)
    contact = math.pi / math.sqrt(stiffness)
    place, times = of(result, "joint.slide.displacement"), result.time
    back, inside = times > 0.2 + contact, (times > 0.2) & (times < 0.2 + contact)
    assert place[back] == pytest.approx(0.2 - (times[back] - 0.2 - contact), abs=1e-5)
    depth = np.sin(math.sqrt(stiffness) * (times[inside] - 0.2)) / math.sqrt(stiffness)
    assert place[inside] == pytest.approx(0.2 + depth, abs=1e-5)
    assert of(result, "joint.slide.speed")[back] == pytest.approx(-1.0, abs=1e-5)
    assert result.summary["energy_error"] < 1e-5


def test_a_spring_with_a_force_at_the_start_and_a_damper(tmp_path: Path) -> None:
    result = run(slider(spring={"stiffness": 100.0, "force": -30.0}, damper={"coefficient": 4.0}), tmp_path)
    decay, speed = 2.0, math.sqrt(100.0 - 2.0**2)
    times = result.time
    from_rest = np.exp(-decay * times) * (
        -0.3 * np.cos(speed * times) + (1.0 - decay * 0.3) / speed * np.sin(speed * times)
    )
    assert of(result, "joint.slide.displacement") == pytest.approx(0.3 + from_rest, abs=1e-5)
    assert result.summary["energy_error"] < 1e-5


def test_a_motor_turns_by_its_program_and_counts_turns(tmp_path: Path) -> None:
    """1.3 turns about the vertical: the moment is inertia times acceleration, its work is the kinetic energy."""
    bar = body("bar", [1.0, 0.0, 0.0], [0.01, 0.3, 0.3])
    pin = joint("pin", "revolute", "ground", "bar", [0, 0, 0], axis=[0, 0, 1])
    pin |= {"angle": "90 deg", "motor": {"angle": {"value": "1.3 turn", "time": {"kind": "ramp", "end": 1.0}}}}
    result = run(mechanism([bar], [pin], 1.0, 0.05), tmp_path)
    turn, t = 2.6 * math.pi, result.time
    assert of(result, "joint.pin.angle") == pytest.approx(0.5 * math.pi + turn * (3.0 - 2.0 * t) * t**2, abs=1e-9)
    assert of(result, "joint.pin.rate") == pytest.approx(6.0 * turn * (1.0 - t) * t, abs=1e-9)
    inner = slice(1, -1)
    assert of(result, "joint.pin.motor")[inner] == pytest.approx(1.3 * 6.0 * turn * (1.0 - 2.0 * t)[inner], abs=1e-4 * 64.0)
    assert np.abs(of(result, "joint.pin.moment")[:, 2]).max() < 1e-9
    assert result.summary["energy_error"] < 1e-5


@pytest.mark.parametrize(
    ("key", "section", "text"),
    [
        ("spring", {"stiffness": "1 N m/rad"}, '"1 N m/rad" has the wrong unit; give a value in N/m'),
        ("spring", {"stiffness": 1.0, "force": 1.0, "rest": 0.1}, "give `rest` or `force` at the start, not both"),
        ("stop", {"stiffness": 1.0}, "a stop needs `lower`, `upper` or both"),
        ("motor", {"travel": 0.1}, "`travel` of a motor needs `time`"),
        ("damper", {"coefficient": 1.0, "coeff": 1.0}, "coeff: unknown key"),
    ],
)
def test_mistakes_of_actions(key: str, section: dict[str, Any], text: str) -> None:
    with pytest.raises(fsm.CaseError) as failure:
        fsm.load(slider(**{key: section})).check()
    assert text in str(failure.value)


def test_a_latch_holds_a_block_between_itself_and_the_stop(tmp_path: Path) -> None:
    """The block comes to the stop, latches, and stays between both with its energy; without the latch it leaves."""
    stop, latch = {"upper": 0.2, "stiffness": 400.0}, {"at": 0.2, "play": 0.01, "stiffness": 400.0}
    held = run(slider(stop=stop, latch=latch), tmp_path / "held")
    place, latched = of(held, "joint.slide.displacement"), of(held, "joint.slide.latched")
    assert np.array_equal(latched, (held.time > 0.2).astype(float)) or np.array_equal(latched, held.time >= 0.2)
    after = held.time > 0.2
    assert place[after].min() == pytest.approx(0.19 - 0.05, abs=1e-3)
    assert place[after].max() == pytest.approx(0.2 + 0.05, abs=1e-3)
    assert held.summary["energy_error"] < 1e-5
    fast = run(slider(stop=stop, latch=latch | {"rate_below": 0.5}), tmp_path / "fast")
    assert not of(fast, "joint.slide.latched")[fast.time < 0.25].any()


def test_a_light_coupler_takes_no_more_iterations(tmp_path: Path) -> None:
    case = four_bar()
    case["solve"] |= {"rtol": 1e-6, "method": "generalized-alpha"}
    equal = run(case, tmp_path / "equal")
    coupler = case["scene"]["bodies"][1]
    coupler |= {"mass": 1e-5, "inertia": [1e-5 * value for value in coupler["inertia"]]}
    light = run(case, tmp_path / "light")
    per_step = [result.summary["newton_iterations"] / result.summary["steps"] for result in (equal, light)]
    assert min(per_step) >= 1.0 and max(per_step) < 2.5
    assert np.abs(of(light, "joint.pin 1.position")).max() < 1e-10
