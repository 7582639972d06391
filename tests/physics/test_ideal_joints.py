"""Ideal joints against quadrature, ADAMS, and other formulations of the same mechanism."""

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

import fsm
from fsm.api.result import Result

_G = 9.80665
_ROWS = Path(__file__).parent / "adams_joints" / "rows.csv"


def body(name: str, position: Any, inertia: Any, turned: Rotation | None = None, **keys: Any) -> dict[str, Any]:
    quaternion = (turned or Rotation.identity()).as_quat(scalar_first=True)
    place = np.array(position, dtype=float).tolist()
    return {"name": name, "mass": 1.0, "inertia": inertia, "position": place, "orientation": quaternion.tolist(), **keys}


def joint(name: str, kind: str, first: str, second: str, at: Any, **keys: Any) -> dict[str, Any]:
    vectors = {key: np.array(value, dtype=float).tolist() for key, value in keys.items()}
    return {"name": name, "kind": kind, "first": first, "second": second, "at": np.array(at, dtype=float).tolist(), **vectors}


def mechanism(
    bodies: list[dict[str, Any]], joints: list[dict[str, Any]], end: float, every: float, **keys: Any
) -> dict[str, Any]:
    return {
        "units": "SI", "gravity": [0.0, 0.0, -_G], "scene": {"bodies": bodies, "joints": joints, **keys},
        "solve": {"end_time": end, "error_estimates": "off"},
        "save": {"interval": every, "channels": ["joint.*", "body.*", "energy.*"]},
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


# ADAMS ------------------------------------------------------------------------------------------------------------------


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
        return mechanism([bar], [rod, joint("k", "in-plane", "ground", "bar", [0, 0, 0], to=[2, 0, 0], axis=[0, 0, 1])], 5.0, 0.1)
    kind = case.split("_")[0].lower()
    if kind in ("prismatic", "cylindrical"):
        return swinging(kind, (1.0, 2.0, 3.0), -45.0)
    return swinging(kind, (0.0, 0.0, 0.0), -90.0 if kind == "revolute" else 0.0)


@cache
def rows() -> dict[str, np.ndarray]:
    with _ROWS.open() as file:
        table = list(csv.reader(file))[1:]
    return {name: np.array([row[1:] for row in table if row[0] == name], dtype=float) for name in {row[0] for row in table}}


@pytest.mark.parametrize("name", sorted(rows()))
def test_adams(name: str, tmp_path: Path) -> None:
    wanted, case = rows()[name], adams(name)
    case["solve"]["end_time"] = float(wanted[-1, 0])
    result = run(case, tmp_path)
    at = [int(np.argmin(np.abs(result.time - t))) for t in wanted[:, 0]]
    assert result.time[at] == pytest.approx(wanted[:, 0])
    digits = 1e-6 * np.abs(wanted[:, 1:4]).max()
    assert of(result, "body.bar.position")[at] == pytest.approx(wanted[:, 1:4], abs=2e-5 + digits)
    turned = of(result, "body.bar.orientation")[at]
    same = np.sign(np.sum(turned * wanted[:, 4:8], axis=1))[:, None]
    assert same * turned == pytest.approx(wanted[:, 4:8], abs=4e-5)
    assert of(result, "body.bar.velocity")[at] == pytest.approx(wanted[:, 8:11], abs=3e-4)
    force = sum(of(result, f"joint.{one['name']}.force")[at] for one in case["scene"]["joints"])
    assert -force == pytest.approx(wanted[:, 14:17], abs=1e-4 * np.abs(wanted[:, 14:17]).max())
