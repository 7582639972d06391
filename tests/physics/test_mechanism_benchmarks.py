"""Benchmarks of multibody dynamics at default settings: Andrews' squeezing mechanism, IFToMM A01, A02,
A04, A05, heavy top, a wing of six panels."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fsm
from fsm.case.plan.method_selection import RTOL_OF_JOINTS
from fsm.solve.settings import Settings
from validation.peers import rigid


@pytest.mark.parametrize(
    ("model", "path", "times"),
    [
        (rigid.pendulum_model, rigid.pendulum_path, rigid.TIMES),
        (rigid.four_bars_model, rigid.four_bars_path, rigid.TIMES),
        (rigid.top_model, rigid.top_path, rigid.TOP_TIMES),
        (rigid.bricard_model, lambda: rigid.bricard_path(0.005), rigid.TIMES),
        (rigid.wing_model, rigid.wing_path, rigid.TIMES),
        (lambda: rigid.wing_model(rigid.Wing(40)), lambda: rigid.wing_path(rigid.Wing(40)), rigid.TIMES[:2]),
    ],
    ids=["A01", "A02", "heavy top", "A04", "wing", "wing of 40 panels"],
)  # fmt: skip
def test_iftomm(model: Callable[[], Any], path: Callable[[], np.ndarray], times: np.ndarray) -> None:
    """A02 passes its branch points four times; A04 has a redundant constraint at each configuration."""
    system, shown = model()
    found = rigid.run_model(system, Settings("explicit", RTOL_OF_JOINTS, float(times[-1])), times, shown)
    assert found == pytest.approx(path()[: len(times)], abs=1e-6)


# Andrews' squeezing mechanism -------------------------------------------------------------------------------------------

START = (
    -0.0617138900142764496358948458001, 0.0, 0.455279819163070380255912382449, 0.222668390165885884674473185609,
    0.487364979543842550225598953530, -0.222668390165885884674473185609, 1.23054744454982119249735015568,
)  # fmt: skip
"""Angles beta, theta, gamma, phi, delta, omega, epsilon (rad)."""
END = (
    15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
    0.5347301163226948, 1.048080741042263,
)  # fmt: skip
"""The same angles at .03 s (Test set for initial value problems, Bari)."""
_MASS = (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498)
_INERTIA = (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
_RR, _D, _E, _SS = 7e-3, 28e-3, 2e-2, 35e-3
_A, _B, _C = np.array([-0.06934, -0.00227]), np.array([-0.03635, 0.03273]), np.array([0.014, 0.072])


def _along(angle: float, length: float, across: float = 0.0) -> np.ndarray:
    """Vector in the plane: `length` at an angle, and `across` to its left."""
    return np.array([
        length * math.cos(angle) - across * math.sin(angle), length * math.sin(angle) + across * math.cos(angle),
    ])  # fmt: skip


def _squeezer() -> dict[str, Any]:
    """Seven bodies in the x-y plane, without weight, driven by .033 N m; see Hairer and Wanner 1996, section VII.7."""
    beta, theta, gamma, phi, delta, omega, epsilon = START
    crank = _along(beta, _RR)
    centre = crank - _along(beta + theta, _D)  # where bodies 2, 3, 4 and 6 meet
    upper, lower = _A + _along(delta, 0.04), _A + _along(epsilon, 0.0, -0.04)
    places = (
        _along(beta, 0.00092), crank - _along(beta + theta, 0.0115), _B + _along(gamma, 0.01043, -0.01874),
        upper + _along(phi + delta, 0.0, -(_E - 0.01421)), _A + _along(delta, 0.02308, 0.00916),
        lower + _along(omega + epsilon, 0.02 - 0.01421), _A + _along(epsilon, -0.00449, -0.01228),
    )  # fmt: skip
    bodies = [
        {"name": f"K{k + 1}", "mass": mass, "inertia": [inertia] * 3, "position": [*place.tolist(), 0.0]}
        for k, (mass, inertia, place) in enumerate(zip(_MASS, _INERTIA, places, strict=True))
    ]
    hinges = [
        ("ground", "K1", np.zeros(2)), ("K1", "K2", crank), ("K2", "K3", centre), ("K2", "K4", centre), ("K2", "K6", centre),
        ("ground", "K3", _B), ("K4", "K5", upper), ("ground", "K5", _A), ("K6", "K7", lower), ("ground", "K7", _A),
    ]  # fmt: skip
    joints = [
        {"name": f"{first} {second}", "kind": "revolute", "first": first, "second": second, "at": [*at.tolist(), 0.0],
         "axis": [0, 0, 1]}
        for first, second, at in hinges
    ]  # fmt: skip
    joints[0] |= {"motor": {"torque": 0.033}}
    spring = {
        "name": "spring", "first": "ground", "second": "K3", "at": [*_C.tolist(), 0.0],
        "to": [*(_B + _along(gamma, 0.02, -0.018)).tolist(), 0.0], "free_length": 0.07785, "stiffness": 4530.0,
    }  # fmt: skip
    assert np.linalg.norm(centre - _B) == pytest.approx(_SS, abs=1e-12)
    return {
        "units": "SI", "scene": {"bodies": bodies, "joints": joints, "springs": [spring]},
        "solve": {"end_time": 0.03, "error_estimates": "off"}, "save": {"interval": 0.03, "channels": ["joint.*"]},
    }  # fmt: skip


def test_andrews_squeezing_mechanism(tmp_path: Path) -> None:
    result = fsm.load(_squeezer()).run(tmp_path)

    def turned(name: str) -> float:
        return float(np.asarray(result[f"joint.{name}.angle"].values)[-1])

    assert turned("ground K1") == pytest.approx(END[0] - START[0], abs=1e-5)
    for name, number in (("ground K3", 2), ("ground K5", 4), ("ground K7", 6)):
        assert turned(name) == pytest.approx(END[number] - START[number], abs=1e-6)


# flyball governor, IFToMM A05 -------------------------------------------------------------------------------------------

_HUB, _TILT, _SPIN = 0.05, math.radians(30.0), 0.32 * math.pi
_ROD, _BALL, _SLIDER = 0.3, 5.0, 3.0
_SHAFT_SPIN, _SLIDER_SPIN = 0.3 / 6.0 * 0.01**2, 3.0 / 6.0 * 0.1**2
_ROD_ACROSS, _ROD_ALONG = 0.3 / 12.0 * (1.0 + 0.01**2), 0.3 / 6.0 * 0.01**2
_GRAVITY, _STRUT, _STIFFNESS, _DAMPING = 9.81, 0.5, 8e5, 4e4


def _governor_rate(_: float, y: np.ndarray) -> list[float]:
    """Rates: of the speed of the shaft, of the tilt of the rods and its rate, of the height of the slider and its rate."""
    speed, tilt, turning, height, sliding = y.tolist()
    c, s = math.cos(tilt), math.sin(tilt)
    inertia = _SLIDER_SPIN + _SHAFT_SPIN + 2.0 * (
        _ROD_ALONG * s * s + _ROD_ACROSS * c * c + _ROD * (_HUB + 0.5 * c) ** 2 + _BALL * (_HUB + c) ** 2
    )  # fmt: skip
    slope = 2.0 * (
        2.0 * (_ROD_ALONG - _ROD_ACROSS) * s * c - _ROD * (_HUB + 0.5 * c) * s - 2.0 * _BALL * (_HUB + c) * s
    )  # fmt: skip
    across, along = 0.5 * c, 1.0 - 0.5 * s - height
    length = math.hypot(across, along)
    by_tilt, by_height = -0.5 * (across * s + along * c) / length, -along / length
    force = 2.0 * (_STIFFNESS * (length - _STRUT) + _DAMPING * (by_tilt * turning + by_height * sliding))
    weight = 2.0 * _GRAVITY * c * (0.5 * _ROD + _BALL)
    return [
        -slope * turning * speed / inertia,
        turning, (0.5 * slope * speed * speed + weight - force * by_tilt) / (2.0 * (_ROD_ACROSS + 0.25 * _ROD + _BALL)),
        sliding, -force * by_height / _SLIDER - _GRAVITY,
    ]  # fmt: skip


def _governor(end: float) -> dict[str, Any]:
    """Shaft of 1 m, a slider on it, and two rods with balls, which struts of 8e5 N/m and 4e4 N s/m join to the slider."""
    mass = _ROD + _BALL
    centre = (0.5 * _ROD + _BALL) / mass
    across = _ROD_ACROSS + _ROD * (0.5 - centre) ** 2 + _BALL * (1.0 - centre) ** 2
    bodies: list[dict[str, Any]] = [
        {"name": "shaft", "mass": 0.3, "inertia": [0.025, 0.025, _SHAFT_SPIN], "position": [0, 0, 0.5],
         "angular_velocity": [0, 0, _SPIN]},
        {"name": "slider", "mass": _SLIDER, "inertia": [_SLIDER_SPIN] * 3, "position": [0, 0, 0.5],
         "angular_velocity": [0, 0, _SPIN]},
    ]  # fmt: skip
    joints: list[dict[str, Any]] = [
        {"name": "bearing", "kind": "revolute", "first": "ground", "second": "shaft", "at": [0, 0, 0], "axis": [0, 0, 1]},
        {"name": "slide", "kind": "prismatic", "first": "shaft", "second": "slider", "at": [0, 0, 0.5], "axis": [0, 0, 1]},
    ]
    springs: list[dict[str, Any]] = []
    c, s = math.cos(_TILT), math.sin(_TILT)
    for name, side in (("right", 1.0), ("left", -1.0)):
        reach = side * (_HUB + centre * c)
        bodies.append({
            "name": name, "mass": mass, "inertia": [_ROD_ALONG, across, across], "position": [reach, 0, 1.0 - centre * s],
            "orientation": [math.cos(0.5 * _TILT), 0, side * math.sin(0.5 * _TILT), 0], "velocity": [0, _SPIN * reach, 0],
            "angular_velocity": [-_SPIN * side * s, 0, _SPIN * c],
        })  # fmt: skip
        joints.append({"name": name, "kind": "revolute", "first": "shaft", "second": name, "at": [side * _HUB, 0, 1],
                       "axis": [0, side, 0]})  # fmt: skip
        springs.append({
            "name": name, "first": "slider", "second": name, "at": [side * _HUB, 0, 0.5],
            "to": [side * (_HUB + 0.5 * c), 0, 1.0 - 0.5 * s], "free_length": _STRUT, "stiffness": _STIFFNESS,
            "damper": {"coefficient": _DAMPING},
        })  # fmt: skip
    return {
        "units": "SI", "gravity": [0, 0, -_GRAVITY], "scene": {"bodies": bodies, "joints": joints, "springs": springs},
        "solve": {"end_time": end, "error_estimates": "off"}, "save": {"interval": end / 10.0, "channels": ["joint.*"]},
    }  # fmt: skip


def test_flyball_governor(tmp_path: Path) -> None:
    """IFToMM A05, whose dampers are 1e4 times faster than its motion, against its three coordinates by Radau at 1e-10."""
    end = 1.0
    exact = solve_ivp(
        _governor_rate, (0.0, end), [_SPIN, _TILT, 0.0, 0.5, 0.0], method="Radau", rtol=1e-10, atol=1e-12,
        t_eval=np.linspace(0.0, end, 11),
    ).y  # fmt: skip
    result = fsm.load(_governor(end)).run(tmp_path)
    assert np.ptp(exact[1]) > 0.5
    assert result.summary["method"] == "explicit"
    tilt = np.asarray(result["joint.right.angle"].values)
    assert tilt == pytest.approx(exact[1] - _TILT, abs=1e-10)
    assert np.asarray(result["joint.left.angle"].values) == pytest.approx(tilt, abs=1e-9)
