"""Sides of two cylinders: parallel and crossed contact, energy, tangent, and motions over the ends."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import fsm
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem
from tests.tangents import check_force, check_tangents

_RADII, _LENGTHS = (0.03, 0.02), (0.2, 0.3)
_APART = 1e-4
"""Gap at the start, m: cases with overlaps are refused."""
_LINEAR = {"law": "linear", "stiffness": 1e5, "ramp": 1e-12}
_AXES = np.array([[0.3, 1.0, 0.2], [0.1, 0.2, 1.0]])
_MIDDLES = np.array([[0.01, 0.02, -0.01], [0.0, -0.02, 0.01]])


def case(places: list[Any], turns: list[Any], pair: dict[str, Any], **more: Any) -> dict[str, Any]:
    bodies = [
        {"name": f"rod {k}", "mass": 0.5, "inertia": [2e-3, 2e-4, 2e-3], "position": list(map(float, places[k])),
         "orientation": turns[k].as_quat(scalar_first=True).tolist(), "angular_velocity": [2.0, -3.0, 1.0 + k],
         "velocity": [0.3, -0.2, 0.1 * k]} | more.pop(f"body_{k}", {})
        for k in range(2)
    ]  # fmt: skip
    parameters = {"radii": list(_RADII), "lengths": list(_LENGTHS)} | pair
    pairs = [{"first": "rod 0", "second": "rod 1", "geometry": "cylinder-on-cylinder", "parameters": parameters}]
    given = {"units": "SI", "scene": {"bodies": bodies, "pairs": pairs}, "contact": _LINEAR}
    return given | {"solve": {"end_time": 1e-3, "spatial": True}} | more


def pressed(*given: Any, by: np.ndarray, **more: Any) -> tuple[SegmentSystem, np.ndarray, np.ndarray]:
    """System, and a configuration and velocity with the first cylinder moved by a vector from the start, m."""
    system = compile_case(fsm.load(case(*given, **more)).model)[1]
    q, u = system.initial()
    return system, system.retract(q, np.concatenate([by, np.zeros(9)])), u


def lying(angle: float, depth: float, shift: float = 0.0, **more: Any) -> tuple[SegmentSystem, np.ndarray, np.ndarray]:
    """Second cylinder along y, and the first one above it, turned by an angle (rad) and shifted along its axis."""
    turn = Rotation.from_rotvec([0.0, 0.0, angle])
    place = [*(shift * turn.apply([0.0, 1.0, 0.0]))[:2], sum(_RADII) + _APART]
    by = np.array([0.0, 0.0, -_APART - depth])
    return pressed([place, [0.0] * 3], [turn, Rotation.identity()], {}, by=by, **more)


def tilted(seed: int, depth: float, **more: Any) -> tuple[SegmentSystem, np.ndarray, np.ndarray]:
    """Cylinders at random, with axes beside the middles of the bodies, pressed together by a depth."""
    random = np.random.default_rng(seed)
    turns = [Rotation.random(random_state=2 * seed + k) for k in range(2)]
    axes = [turn.apply(axis / np.linalg.norm(axis)) for turn, axis in zip(turns, _AXES, strict=True)]
    normal = np.cross(*axes)
    normal /= np.linalg.norm(normal)
    slid = [random.uniform(-0.9, 0.9) * 0.5 * length * axis for length, axis in zip(_LENGTHS, axes, strict=True)]
    place = -slid[0] + slid[1] + (sum(_RADII) + _APART) * normal
    places = [place - turns[0].apply(_MIDDLES[0]), -turns[1].apply(_MIDDLES[1])]
    keys = {"first_axis": _AXES[0], "second_axis": _AXES[1], "first_at": _MIDDLES[0], "second_at": _MIDDLES[1]}
    pair = {key: value.tolist() for key, value in keys.items()}
    return pressed(places, turns, pair, by=-(_APART + depth) * normal, **more)


@pytest.mark.parametrize(("shift", "part"), [(0.0, 1.0), (0.15, 0.5), (-0.21, 0.2)])
def test_parallel_cylinders_have_the_part_of_the_line_in_contact(shift: float, part: float) -> None:
    depth = 1e-6
    system, q, _ = lying(0.0, depth, shift)
    force = system.force(0.0, q, None)
    # slices beyond the round end of the other cylinder: delta - x^2/(2 (R1 + R2)) at the distance x
    beyond = 0.0 if part == 1.0 else 2.0 / 3.0 * math.sqrt(2.0 * sum(_RADII) * depth) / min(_LENGTHS)
    assert force[2] == pytest.approx(1e5 * depth * (part + beyond), rel=1e-5)


@pytest.mark.parametrize("angle", [0.15, 0.7, 0.5 * math.pi])
def test_crossed_cylinders(angle: float) -> None:
    depth = 2e-6
    system, q, _ = lying(angle, depth, 0.02)
    known = 4.0 / 3.0 * 1e5 / _LENGTHS[0] * math.sqrt(2.0 * sum(_RADII)) * depth**1.5 / math.sin(angle)
    assert system.force(0.0, q, None)[2] == pytest.approx(known, rel=1e-4)
    rough, q, _ = lying(angle, depth, 0.02, friction={"law": "tanh", "mu_dynamic": 0.3, "v_static": 1e-6})
    assert rough.force(0.0, q, np.eye(12)[0])[0] == pytest.approx(-0.3 * known, rel=1e-4)


@pytest.mark.parametrize("seed", range(6))
def test_first_touch_is_that_of_the_nearest_points(seed: int) -> None:
    system, q, _ = tilted(seed, 0.0)
    ends = []
    for k in range(2):
        turn = Rotation.from_quat(q[7 * k + 3 : 7 * k + 7], scalar_first=True)
        arm = 0.5 * _LENGTHS[k] * _AXES[k] / np.linalg.norm(_AXES[k])
        ends.append((q[7 * k : 7 * k + 3] + turn.apply(_MIDDLES[k]), turn.apply(arm)))
    (one, along), (two, across) = ends

    def apart(x: np.ndarray) -> float:
        return float(np.linalg.norm(one + x[0] * along - two - x[1] * across))

    least = minimize(apart, [0.0, 0.0], bounds=[(-1, 1)] * 2, method="L-BFGS-B", options={"ftol": 1e-15, "gtol": 1e-12})
    assert least.fun == pytest.approx(sum(_RADII), rel=1e-6)
    assert not system.force(0.0, tilted(seed, -1e-6)[1], None).any()
    assert system.force(0.0, tilted(seed, 1e-6)[1], None).any()


@pytest.mark.parametrize("law", [_LINEAR, {"law": "hertz", "stiffness": 1e7}], ids=["linear", "hertz"])
@pytest.mark.parametrize("seed", range(3))
def test_forces_are_those_of_the_energy_and_tangents_those_of_the_forces(seed: int, law: dict[str, Any]) -> None:
    smooth, q, _ = tilted(seed, 1e-3, contact=law)
    force = check_force(smooth, q, 1e-6)
    turns = [Rotation.from_quat(q[7 * k + 3 : 7 * k + 7], scalar_first=True) for k in range(2)]
    wrenches = force.reshape(2, 2, 3)
    moment = sum(np.cross(q[7 * k : 7 * k + 3], wrenches[k, 0]) + turns[k].apply(wrenches[k, 1]) for k in range(2))
    assert force[:3] + force[6:9] == pytest.approx(0.0, abs=1e-12 * np.abs(force).max())
    assert moment == pytest.approx(0.0, abs=1e-12 * np.abs(force).max())
    rough = {"contact": law | {"damping": 20.0}, "friction": {"law": "tanh", "mu_dynamic": 0.3, "v_static": 0.1}}
    check_tangents(*tilted(seed, 1e-3, **rough), (1e-6, 1e-6))


def test_a_rod_falls_across_another_one_and_leaves_over_its_end(tmp_path: Path) -> None:
    """Bounces on a held rod without friction conserve energy and the momentum along the rod, also over its end."""
    turn = Rotation.from_rotvec([0.0, 0.0, 1.2])
    given = case(
        [[0.0, 0.05, sum(_RADII) + 5e-3], [0.0] * 3], [turn, Rotation.identity()], {}, gravity=[0.0, 0.0, -9.81],
        body_0={"velocity": [0.0, 0.3, 0.0], "angular_velocity": [0.0, 0.0, 0.0]},
        body_1={"held": True, "velocity": [0.0] * 3, "angular_velocity": [0.0] * 3},
        contact=_LINEAR | {"ramp": 1e-6}, save={"interval": 0.01, "channels": ["body.*", "energy.*"]},
        solve={"end_time": 0.6, "rtol": 1e-7, "spatial": True, "error_estimates": "off"},
    )  # fmt: skip
    result = fsm.load(given).run(tmp_path, figures=False)
    place = np.asarray(result["body.rod 0.position"].values)
    assert place[-1, 1] > 0.5 * _LENGTHS[1] and place[-1, 2] < 0.0
    assert result.summary["energy_error"] < 1e-4


@pytest.mark.parametrize(
    ("pair", "contact", "said"),
    [
        ({"radii": [0.1, 0.0]}, {}, r"radii\.1: input should be greater than 0"),
        ({"first_axis": [0, 0, 0]}, {}, "an axis has a direction"),
        ({}, {"law": "restitution", "stiffness": 1e6, "restitution": 0.5}, "`restitution` refers to this speed"),
    ],
    ids=["no size", "no axis", "restitution"],
)  # fmt: skip
def test_wrong_cylinders_are_refused(pair: dict[str, Any], contact: dict[str, Any], said: str) -> None:
    turns = [Rotation.identity()] * 2
    with pytest.raises(CaseError, match=said):
        pressed([[0.0, 0.0, 1.0], [0.0] * 3], turns, pair, by=np.zeros(3), contact=contact or _LINEAR)
