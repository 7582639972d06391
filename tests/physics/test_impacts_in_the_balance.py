"""Energy balance of impacts: contacts dissipate energy along each step, also where they begin and end."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import fsm
from tests.physics.test_ideal_joints import body, joint, mechanism

STIFFNESS, RESTITUTION, RADIUS, G = 1e6, 0.7, 0.1, 9.81
FRICTION = {"law": "step", "mu_static": 0.3, "mu_dynamic": 0.25, "v_static": 0.01, "v_dynamic": 0.05}
FLOOR = {"name": "floor", "shape": "plane"}


def touches(case: dict[str, Any], touching: str, restitution: float = RESTITUTION) -> dict[str, Any]:
    """Case with a floor and friction, with the default tolerance."""
    case["scene"]["pairs"] = [{"first": touching, "second": "floor"}]
    case["gravity"] = [0.0, 0.0, -G]
    return case | {"contact": {"stiffness": STIFFNESS, "restitution": restitution}, "friction": FRICTION}


def thrown_ball() -> dict[str, Any]:
    start = {"velocity": [1.0, 0.0, 0.0], "angular_velocity": [0.0, 3.0, 1.0]}
    case = touches(mechanism([body("ball", [0, 0, 0.3], [4e-3] * 3, **start)], [], 1.0, 0.02), "skin")
    return case | {"obstacle": [FLOOR, {"name": "skin", "shape": "sphere", "radius": RADIUS, "body": "ball"}]}


def dropped_plate() -> dict[str, Any]:
    plate = {"length": 0.04, "width": 0.03, "thickness": 1.5e-3}
    falling = {
        "name": "plate", "mass": 2e-3, "inertia": [1.7e-7, 2.7e-7, 4.3e-7], "position": [0, 0, 0.03],
        "orientation": [0.996194698092, 0.0, 0.0871557427477, 0.0], "plate": plate,
    }  # fmt: skip
    return touches(mechanism([falling], [], 0.2, 0.01), "plate", 0.5) | {"obstacle": [FLOOR]}


def double_pendulum() -> dict[str, Any]:
    """Its tip, a ball, hits the floor; the lower hinge is damped."""
    inertia = [1e-3, 2e-2, 2e-2]
    upper, lower = body("upper", [0.25, 0, 0.4], inertia), body("lower", [0.75, 0, 0.4], inertia)
    pin = joint("pin", "revolute", "ground", "upper", [0, 0, 0.4], axis=[0, 1, 0])
    knee = joint("knee", "revolute", "upper", "lower", [0.5, 0, 0.4], axis=[0, 1, 0]) | {"damper": {"coefficient": 0.05}}
    case = touches(mechanism([upper, lower], [pin, knee], 1.0, 0.02), "tip")
    tip = {"name": "tip", "shape": "sphere", "radius": 0.05, "body": "lower", "position": [0.25, 0, 0]}
    return case | {"obstacle": [FLOOR, tip]}


@pytest.mark.parametrize("case", [thrown_ball, dropped_plate, double_pendulum])
def test_the_balance_closes_at_the_default_tolerance(case: Any, tmp_path: Path) -> None:
    summary = fsm.load(case()).run(tmp_path, figures=False).summary
    assert summary["energy_error"] < 1e-6
    assert summary["energy_drift"] < 5e-4


def test_an_impact_dissipates_what_its_equation_of_motion_does(tmp_path: Path) -> None:
    """A ball falls from 0.2 m and bounces once; the law with an exact coefficient of restitution, by another method."""
    case = thrown_ball()
    case["scene"]["bodies"][0] |= {"velocity": [0.0] * 3, "angular_velocity": [0.0] * 3}
    case["solve"] |= {"end_time": 0.3, "rtol": 1e-8}
    result = fsm.load(case).run(tmp_path, figures=False)
    c, onset = RESTITUTION, math.sqrt(2.0 * G * 0.2)
    factor = brentq(lambda h: h * (1.0 + c) - math.log((1.0 + h) / (1.0 - h * c)), 0.01, 0.99 / c, xtol=1e-14)

    def slope(t: float, y: np.ndarray, fastest: float) -> list[float]:
        """Height of the lowest point over the floor, and its rate. The weight closes the contact faster at first."""
        damping = factor * y[1] / max(fastest, -y[1])
        return [y[1], STIFFNESS * max(0.0, -y[0]) ** 1.5 * max(0.0, 1.0 - damping) - G]

    def at_fastest(t: float, y: np.ndarray, fastest: float) -> float:
        return slope(t, y, fastest)[1]

    at_fastest.terminal = True  # type: ignore[attr-defined]
    tolerances = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "max_step": 1e-5}
    closing = solve_ivp(slope, (0.0, 0.05), [0.0, -onset], args=(0.0,), events=at_fastest, **tolerances).y[:, -1]
    height, speed = solve_ivp(slope, (0.0, 0.05), closing, args=(-closing[1],), **tolerances).y[:, -1]
    assert height > 0.0
    lost = 0.5 * (onset**2 - speed**2) - G * height
    assert result["energy.dissipated"].values[-1] == pytest.approx(lost, rel=2e-5)
