"""One body on one joint or spring against ADAMS, and against equations of motion with multipliers."""

from __future__ import annotations

import csv
import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from fsm.api.case import Result
from tests.physics.test_ideal_joints import body, joint, mechanism, of, run

_G = 9.80665
_ROWS = Path(__file__).parent / "adams_joints" / "rows.csv"


def swinging(kind: str, place: tuple[float, float, float], turn: float) -> dict[str, Any]:
    turned = Rotation.from_euler("x", turn, degrees=True)
    bar = body("bar", np.array(place) + turned.apply([2.0, 0.0, 0.0]), [0.04, 0.1, 0.1], turned)
    axis = {} if kind == "spherical" else {"axis": turned.apply([0.0, 0.0, 1.0])}
    return mechanism([bar], [joint("j", kind, "ground", "bar", place, **axis)], 5.0, 0.1)


def adams(case: str) -> dict[str, Any]:
    turned, identity = Rotation.from_euler("x", 90, degrees=True), Rotation.identity()
    if case == "Universal_Case01":
        bar = body("bar", turned.apply([0.0, 0.0, -2.0]), [0.1, 0.1, 0.04], turned)
        cross = {"axis": turned.apply([1.0, 0.0, 0.0]), "second_axis": turned.apply([0.0, 1.0, 0.0])}
        return mechanism([bar], [joint("j", "universal", "ground", "bar", [0, 0, 0], **cross)], 5.0, 0.1)
    if case == "Distance_Case02":
        bar = body("bar", [-1.0, 4.0, 3.0], [0.04, 0.1, 0.1], identity)
        return mechanism([bar], [joint("j", "distance", "ground", "bar", [1, 2, 3], to=[1, 4, 3])], 5.0, 0.1)
    if case == "RevSpherical_Case01":
        bar = body("bar", [2.0, 2.0, 0.0], [0.1, 0.04, 0.1], identity)
        rod = joint("j", "distance", "ground", "bar", [0, 0, 0], to=[2, 0, 0])
        plane = joint("k", "in-plane", "ground", "bar", [0, 0, 0], to=[2, 0, 0], axis=[0, 0, 1])
        return mechanism([bar], [rod, plane], 5.0, 0.1)
    if case == "LinActuator_Case02":
        slope = Rotation.from_euler("y", 45, degrees=True)
        along = slope.apply([0.0, 0.0, 1.0])
        bar = body("bar", [0, 0, 0], [1.0, 1.0, 1.0], slope, velocity=(0.5 * along).tolist())
        slide = joint("j", "prismatic", "ground", "bar", [0, 0, 0], axis=along) | {"motor": {"speed": 0.5}}
        return mechanism([bar], [slide], 5.0, 0.1)
    if case.startswith("TranSpring"):
        bar = body("bar", [0, 2, 0], [0.04, 0.1, 0.1], identity)
        spring = {"name": "j", "first": "ground", "second": "bar", "at": [0, 0, 0], "to": [0, 2, 0], "stiffness": 100.0}
        return mechanism([bar], [], 5.0, 0.1, springs=[spring | {"damper": {"coefficient": 5.0}}])
    if case == "RotSpring_Case02":
        found = swinging("revolute", (0.0, 0.0, 0.0), -90.0)
        rows = [[a, (50.0 + 10.0 * abs(a)) * a] for a in np.linspace(-1.0, 1.0, 2001).tolist()]
        found["scene"]["joints"][0] |= {"spring": {"table": rows}, "damper": {"coefficient": 10.0}}
        return found
    kind = case.split("_")[0].lower()
    if kind in ("prismatic", "cylindrical"):
        return swinging(kind, (1.0, 2.0, 3.0), -45.0)
    return swinging(kind, (0.0, 0.0, 0.0), -90.0 if kind == "revolute" else 0.0)


@cache
def rows() -> dict[str, np.ndarray]:
    with _ROWS.open() as file:
        table = list(csv.reader(file))[1:]
    return {name: np.array([row[1:] for row in table if row[0] == name], dtype=float) for name in {row[0] for row in table}}


_ADAMS_IS_OFF = {
    "Distance_Case02": (0.0, 2.0e-4), "Prismatic_Case02": (0.0, 1.2e-4), "Spherical_Case01": (8.4e-4, 4.6e-4),
    "Universal_Case01": (8.4e-4, 4.6e-4),
}  # fmt: skip
"""Errors of ADAMS above 2e-5 m and 1e-4 of the largest reaction: against solve_ivp at 1e-12, the constant force of a slide,
and the same pendulum on a revolute joint."""


@pytest.mark.parametrize("name", sorted(rows()))
def test_adams(name: str, tmp_path: Path) -> None:
    """Every tenth row of ADAMS; its reactions act on the ground, moments about the joint there."""
    wanted, case = rows()[name], adams(name)
    result = run(case, tmp_path)
    assert result.time == pytest.approx(wanted[:, 0])
    digits, (off, off_force) = 1e-6 * np.abs(wanted[:, 1:4]).max(), _ADAMS_IS_OFF.get(name, (0.0, 0.0))
    assert of(result, "body.bar.position") == pytest.approx(wanted[:, 1:4], abs=2e-5 + digits + off)
    turned = of(result, "body.bar.orientation")
    same = np.sign(np.sum(turned * wanted[:, 4:8], axis=1))[:, None]
    assert same * turned == pytest.approx(wanted[:, 4:8], abs=4e-5 + off)
    assert of(result, "body.bar.velocity") == pytest.approx(wanted[:, 8:11], abs=1e-4 + digits + 4.0 * off)
    spin = np.abs(wanted[:, 11:14]).max()
    assert of(result, "body.bar.angular_velocity") == pytest.approx(wanted[:, 11:14], abs=1e-4 * max(spin, 1.0) + 4.0 * off)
    force, moment = reaction(case, result)
    if name == "RevSpherical_Case01":  # its last columns are the force on the body
        moment = -force
    assert force == pytest.approx(wanted[:, 14:17], abs=(1e-4 + off_force) * np.abs(wanted[:, 14:17]).max())
    assert moment == pytest.approx(wanted[:, 17:20], abs=max(1e-4 * np.abs(wanted[:, 17:20]).max(), 1e-9))
    if name == "LinActuator_Case02":  # the actuator holds the weight along the slope
        assert of(result, "joint.j.motor") == pytest.approx(_G * math.sqrt(0.5), rel=1e-6)


def reaction(case: dict[str, Any], result: Result) -> tuple[np.ndarray, np.ndarray]:
    """Force of all joints and springs on the ground, and their moment about the joint there, inertial axes."""
    if case["scene"].get("springs"):
        place = of(result, "body.bar.position")  # the spring ends at the centre of mass
        pull = of(result, "spring.j.force") / np.linalg.norm(place, axis=1)
        return pull[:, None] * place, np.zeros_like(place)
    total = np.zeros((2, len(result.time), 3))
    for one in case["scene"]["joints"]:
        force, moment = (-of(result, f"joint.{one['name']}.{part}") for part in ("force", "moment"))
        total += force, moment + np.cross(of(result, f"joint.{one['name']}.position") - np.array(one["at"]), force)
        if "spring" in one:
            angle, rate = (of(result, f"joint.{one['name']}.{part}") for part in ("angle", "rate"))
            total[1] += np.outer((50.0 + 10.0 * np.abs(angle)) * angle + 10.0 * rate, one["axis"])
    return total[0], total[1]


# equations of motion ----------------------------------------------------------------------------------------------------


def motion(case: dict[str, Any], times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions of one body on joints of the kinds `distance` and `in-plane`, and the sum of their forces on it."""
    bar = case["scene"]["bodies"][0]
    inertia, weight = np.array(bar["inertia"]), np.array([0.0, 0.0, -_G])
    inverse = 1.0 / np.concatenate([np.ones(3), inertia])

    def at(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q, spin = y[3:7] / np.linalg.norm(y[3:7]), y[10:]
        turned = Rotation.from_quat(q, scalar_first=True).as_matrix()
        rows, bends = [], []
        for one in case["scene"]["joints"]:
            arm = np.subtract(one["to"], bar["position"])
            way = y[:3] + turned @ arm - np.array(one["at"])
            speed = y[7:10] + turned @ np.cross(spin, arm)
            inwards = turned @ np.cross(spin, np.cross(spin, arm))
            along = way if one["kind"] == "distance" else np.array(one["axis"])
            rows.append(np.concatenate([along, np.cross(arm, turned.T @ along)]))
            bends.append(along @ inwards + (speed @ speed if one["kind"] == "distance" else 0.0))
        free = np.concatenate([weight, -np.cross(spin, inertia * spin)])
        jacobian = np.array(rows)
        pull = -np.linalg.solve(jacobian * inverse @ jacobian.T, jacobian * inverse @ free + bends)
        faster = inverse * (free + jacobian.T @ pull)
        turning = 0.5 * np.concatenate([[-spin @ q[1:]], q[0] * spin + np.cross(q[1:], spin)])
        return np.concatenate([y[7:10], turning, faster]), jacobian[:, :3].T @ pull

    start = np.concatenate([bar["position"], [1.0], np.zeros(9)])
    found = solve_ivp(lambda t, y: at(y)[0], (0.0, times[-1]), start, "DOP853", times, rtol=1e-10, atol=1e-10).y
    return found[:3].T, np.array([at(y)[1] for y in found.T])


@pytest.mark.parametrize("name", ["Distance_Case02", "RevSpherical_Case01"])
def test_reactions_of_a_fast_body(name: str, tmp_path: Path) -> None:
    case = adams(name)
    result = run(case, tmp_path)
    place, pull = motion(case, result.time)
    assert of(result, "body.bar.position") == pytest.approx(place, abs=2e-5)
    found = sum(of(result, f"joint.{one['name']}.force") for one in case["scene"]["joints"])
    assert found == pytest.approx(pull, abs=1e-4 * np.abs(pull).max())
