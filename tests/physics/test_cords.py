"""Cords against closed forms: an Atwood machine, a spool, a slack cord; forces against energies."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fsm
from fsm.kernels.body_poses import retract_poses
from fsm.model.bodies.group import BlockSums, BodyState, body_pattern
from fsm.model.compile.compile_case import compile_case
from fsm.model.elements.cords import CordGroup
from tests.physics.test_ideal_joints import body, mechanism, of, run
from tests.tangents import differences

_G = 9.80665


def cord(**keys: Any) -> dict[str, Any]:
    return {"name": "c", "first": "ground", "second": "ball", "at": [0, 0, 1], "to": [0, 0, 0], "stiffness": 400.0} | keys


def hanging(**keys: Any) -> dict[str, Any]:
    return mechanism([body("ball", [0, 0, 0], [0.1] * 3)], [], 1.0, 0.02, cords=[cord(**keys)])


def test_a_weight_falls_until_its_cord_is_taut(tmp_path: Path) -> None:
    """0.1 m of free fall, then a vibration about the static elongation; without damping it comes back up as far."""
    result = run(hanging(free_length=1.1), tmp_path)
    fall = math.sqrt(0.2 / _G)
    time, place = result.time, of(result, "body.ball.position")[:, 2]
    free = time < fall
    assert place[free] == pytest.approx(-0.5 * _G * time[free] ** 2, abs=1e-7)
    omega, rest, speed = 20.0, _G / 400.0, _G * fall
    t = time - fall
    taut = -0.1 - rest + rest * np.cos(omega * t) - speed / omega * np.sin(omega * t)
    within = (t > 0.0) & (taut < -0.1)
    within &= t < math.pi / omega
    assert place[within] == pytest.approx(taut[within], abs=1e-5)
    assert of(result, "cord.c.force")[within] == pytest.approx(-400.0 * (taut[within] + 0.1), abs=4e-3)
    assert result.summary["energy_error"] < 1e-5


def test_an_atwood_machine(tmp_path: Path) -> None:
    """Two weights on one cord over a pulley: (m1 + m2) a = (m1 - m2) g, with a vibration of the cord about it."""
    light = body("light", [0.2, 0, 0], [0.1] * 3)
    heavy = body("heavy", [-0.2, 0, 0], [0.1] * 3) | {"mass": 1.5}
    line = cord(first="light", second="heavy", at=[0.2, 0, 0], to=[-0.2, 0, 0], stiffness=4e4, damping=300.0)
    over = [{"body": "ground", "at": [0.2, 0, 5.0]}, {"body": "ground", "at": [-0.2, 0, 5.0]}]
    result = run(mechanism([light, heavy], [], 0.5, 0.05, cords=[line | {"over": over}]), tmp_path)
    rise = of(result, "body.light.position")[:, 2] - of(result, "body.heavy.position")[:, 2]
    pull = 2.0 * 1.5 / 2.5 * _G
    stretch = pull / 4e4  # the cord stretches first
    assert rise[-1] == pytest.approx(0.2 * _G * 0.25, abs=2.0 * stretch)
    assert of(result, "cord.c.force")[-1] == pytest.approx(pull, rel=1e-3)
    assert result.summary["energy_error"] < 1e-4


def test_a_spool_lifts_a_weight(tmp_path: Path) -> None:
    reel = {"reel": -0.3, "time": {"kind": "ramp", "end": 0.8}, "stiffness": 4e4, "damping": 200.0}
    result = run(hanging(**reel), tmp_path)
    assert of(result, "body.ball.position")[-1, 2] == pytest.approx(0.3 - _G / 4e4, abs=1e-5)
    assert of(result, "cord.c.force")[-1] == pytest.approx(_G, rel=1e-3)
    assert result.summary["energy_error"] < 1e-4


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_forces_and_tangents(friction: float) -> None:
    random = np.random.default_rng(5)
    balls = [body(name, random.normal(size=3), [0.1] * 3) for name in ("ball", "other")]
    over = [{"body": "other", "at": [0.3, 0.2, 0.1]}, {"body": "ground", "at": [0.4, -0.5, 0.1]}]
    over = [pulley | {"friction": friction} for pulley in over]
    line = cord(over=over, free_length=0.5, damping=3.0, at=[0, 0, 2], slip_speed=0.05)
    _, system = compile_case(fsm.load(mechanism(balls, [], 1.0, 0.1, cords=[line])).model)
    group = next(one for one in system.groups if isinstance(one, CordGroup))
    poses, rates = system.bodies.pose.copy(), np.zeros((3, 6))
    rates[1:] = 0.1 * random.normal(size=(2, 6))
    pattern = body_pattern(np.array([-1, 0, 1]), [group.pairs(poses)[0]], 6)

    def at(move: np.ndarray, faster: np.ndarray) -> tuple[np.ndarray, float, np.ndarray, np.ndarray]:
        placed, moving = poses.copy(), rates.copy()
        placed[1:] = retract_poses(poses[1:].ravel(), move).reshape(2, 7)
        moving[1:] += faster.reshape(2, 6)
        force, stiffness, damping = np.zeros((3, 6)), pattern.zeros(), pattern.zeros()
        group.add_linearised(BodyState(0.0, placed, moving), BlockSums(pattern, force, stiffness, damping))
        stored = group.energy(BodyState(0.0, placed, 0.0 * moving))[0]["panels"]
        dense = [np.block([[data[0], data[1]], [data[2], data[3]]]) for data in (stiffness, damping)]
        return force[1:].ravel(), stored, dense[0], dense[1]

    none, steps = np.zeros(12), np.full(12, 1e-6)
    _, _, stiffness, damping = at(none, none)
    slopes = differences(lambda x: at(x, none)[0], steps)
    assert stiffness == pytest.approx(-slopes, abs=1e-6 * np.abs(slopes).max())
    slopes = differences(lambda x: at(none, x)[0], steps)
    assert damping == pytest.approx(-slopes, abs=1e-6 * np.abs(slopes).max())
    rates[:] = 0.0
    slopes = differences(lambda x: at(x, none)[1], steps)
    assert at(none, none)[0] == pytest.approx(-slopes, abs=1e-6 * np.abs(slopes).max())


def test_a_spool_pulls_over_a_pulley_with_friction(tmp_path: Path) -> None:
    """A weight of 1 kg is lifted and then lowered by a spool; T_1 = T_2 exp(mu pi/2) or less while the cord slides."""
    mu, slip, stiffness, damping, over = 0.3, 2e-3, 4e3, 60.0, [{"body": "ground", "at": [0, 0, 1], "friction": 0.3}]
    reel = {"reel": -0.1, "time": {"kind": "table", "time": [0.0, 0.5, 1.0], "value": [0.0, 1.0, 0.5]}}
    line = cord(over=over, at=[0.5, 0, 1], stiffness=stiffness, damping=damping, slip_speed=slip, **reel)
    result = run(mechanism([body("ball", [0, 0, 0], [0.1] * 3)], [], 1.0, 0.02, cords=[line]), tmp_path)

    def tensions(t: float, y: np.ndarray) -> tuple[float, float]:
        pace = -0.2 if t < 0.5 else 0.1
        free, length, speed = 1.5 + (pace * t if t < 0.5 else -0.1 + 0.1 * (t - 0.5)), 1.5 - y[0], -y[1]
        mean = stiffness * (length - free) + damping * (speed - pace)
        first = 0.5 / length
        part = math.exp(-mu * 0.5 * math.pi * math.tanh((-first * speed - (1.0 - first) * pace) / slip))
        scale = (mean if length > free and mean > 0.0 else 0.0) * length / (0.5 + part * (length - 0.5))
        return scale, scale * part

    def integrated(start: list[float], times: np.ndarray) -> np.ndarray:
        def slope(t: float, y: np.ndarray) -> list[float]:
            return [y[1], tensions(t, y)[1] - _G]

        return np.asarray(solve_ivp(slope, times[[0, -1]], start, "Radau", times, rtol=1e-10, atol=1e-12).y)

    up = integrated([0.0, 0.0], np.linspace(0.0, 0.5 * (1.0 - 1e-15), 26))
    down = integrated(up[:, -1].tolist(), np.linspace(0.5, 1.0, 26))
    place = np.concatenate([up[0], down[0, 1:]])
    assert of(result, "body.ball.position")[:, 2] == pytest.approx(place, abs=1e-7)
    first, last = of(result, "cord.c.force"), of(result, "cord.c.force_at_end")
    lifted, lowered = 24, -1
    assert first[lifted] / last[lifted] == pytest.approx(math.exp(mu * 0.5 * math.pi), rel=1e-9)
    assert first[lowered] / last[lowered] == pytest.approx(math.exp(-mu * 0.5 * math.pi), rel=1e-9)
    assert last[lifted] == pytest.approx(_G, rel=1e-2)
    assert result.summary["energy_error"] < 2e-4
    exact = mechanism([body("ball", [0, 0, 0], [0.1] * 3)], [], 1.0, 0.02, cords=[line])
    exact["solve"]["rtol"] = 1e-8
    assert run(exact, tmp_path / "exact").summary["energy_error"] < 1e-6  # also where the cord becomes slack


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"reel": 0.1}, "a spool needs `reel` and `time`"),
        ({"over": [{"body": "bal", "at": [0, 0, 3]}]}, "no body is called 'bal'; did you mean 'ball'"),
        ({"to": [0, 0, 1]}, "two points of its way in one place"),
    ],
)
def test_mistakes(keys: dict[str, Any], text: str) -> None:
    with pytest.raises(fsm.CaseError) as failure:
        fsm.load(hanging(**keys)).check()
    assert text in str(failure.value)
