"""An ellipsoid on a plane: gap, energy, tangent, and the rocking on a smooth plane."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fsm
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem
from tests.tangents import check_force, check_tangents

_AXES = np.array([0.08, 0.05, 0.03])
_NORMAL = np.array([0.2, -0.3, 0.9])
_POINT = np.array([0.1, 0.2, -0.3])


def case(body: dict[str, Any], pair: dict[str, Any], **more: Any) -> dict[str, Any]:
    own = {"name": "egg", "mass": 0.4, "inertia": (0.08 * (np.sum(_AXES**2) - _AXES**2)).tolist()}
    pairs = [{"first": "egg", "second": "ground", "geometry": "ellipsoid-on-plane"} | pair]
    return {"units": "SI", "scene": {"bodies": [own | body], "pairs": pairs}} | more


def tilted(depth: float, seed: int, **more: Any) -> tuple[SegmentSystem, np.ndarray, np.ndarray]:
    """Ellipsoid pressed by a depth, by the points of its surface, into a tilted plane; configuration and velocity."""
    turn = Rotation.random(random_state=seed)
    normal = _NORMAL / np.linalg.norm(_NORMAL)
    angles = np.meshgrid(np.linspace(0.0, math.pi, 801), np.linspace(0.0, 2.0 * math.pi, 1601))
    ball = np.array([np.sin(angles[0]) * np.cos(angles[1]), np.sin(angles[0]) * np.sin(angles[1]), np.cos(angles[0])])
    reach = -float((normal @ turn.as_matrix() @ (_AXES[:, None] * ball.reshape(3, -1))).min())
    place = _POINT + (reach + 1e-4) * normal + np.cross(normal, [0.3, 0.1, 0.2])
    body = {
        "position": place.tolist(), "orientation": turn.as_quat(scalar_first=True).tolist(),
        "velocity": [0.3, -0.2, 0.1], "angular_velocity": [2.0, -3.0, 1.0],
    }  # fmt: skip
    pair = {"parameters": {"semi_axes": _AXES.tolist(), "normal": _NORMAL.tolist(), "point": _POINT.tolist()}}
    contact = {"law": "linear", "stiffness": 1e4, "exponent": 1.0} | more.pop("contact", {})
    given = case(body, pair, contact=contact, solve={"end_time": 1e-3, "spatial": True}, **more)
    system = compile_case(fsm.load(given).model)[1]
    q, u = system.initial()
    return system, system.retract(q, np.concatenate([-(depth + 1e-4) * normal, np.zeros(3)])), u


@pytest.mark.parametrize("seed", range(4))
def test_the_gap_is_that_of_the_points_of_the_surface(seed: int) -> None:
    normal = _NORMAL / np.linalg.norm(_NORMAL)

    def force(depth: float) -> np.ndarray:
        system, q, _ = tilted(depth, seed)
        return system.force(0.0, q, None)[:3]

    assert not force(-2e-6).any() and normal @ force(2e-6) > 0.0
    assert force(2e-3) - force(1e-3) == pytest.approx(10.0 * normal, rel=1e-3)  # the law is smooth near zero


@pytest.mark.parametrize("seed", range(4))
def test_forces_are_those_of_the_energy_and_tangents_those_of_the_forces(seed: int) -> None:
    smooth, q, _ = tilted(1e-3, seed)
    check_force(smooth, q, 1e-6)
    damped = {"contact": {"damping": 20.0}, "friction": {"law": "tanh", "mu_dynamic": 0.3, "v_static": 0.1}}
    check_tangents(*tilted(1e-3, seed, **damped), (1e-6, 1e-6))


def test_rocking_on_a_smooth_plane(tmp_path: Path) -> None:
    """Small motions about the shortest axis: omega^2 = m g (a^2 - c^2)/(c I); the centre moves vertically only."""
    a, c, start = float(_AXES[0]), float(_AXES[2]), 5e-3
    inertia = 0.08 * (a * a + c * c)
    omega = math.sqrt(0.4 * 9.81 * (a * a - c * c) / (c * inertia))
    height = math.sqrt((a * math.sin(start)) ** 2 + (c * math.cos(start)) ** 2)
    body = {"position": [0.0, 0.0, height], "orientation": [math.cos(0.5 * start), 0.0, math.sin(0.5 * start), 0.0]}
    period = 2.0 * math.pi / omega
    given = case(
        body, {"parameters": {"semi_axes": _AXES.tolist()}}, gravity=[0.0, 0.0, -9.81],
        contact={"law": "linear", "stiffness": 1e8, "exponent": 1.0}, save={"interval": period / 8.0},
        solve={"end_time": period, "rtol": 1e-8, "spatial": True, "error_estimates": "off"},
    )  # fmt: skip
    result = fsm.load(given).run(tmp_path, figures=False)
    q = result.solution.q
    angle = 2.0 * np.arctan2(q[:, 5], q[:, 3])
    assert angle == pytest.approx(start * np.cos(omega * result.solution.time), abs=1e-2 * start)
    assert np.abs(q[:, 0]).max() < 1e-6 and result.summary["energy_error"] < 1e-3


@pytest.mark.parametrize(
    ("pair", "said"),
    [
        ({"parameters": {"semi_axes": [0.1, 0.0, 0.1]}}, r"semi_axes\.1: input should be greater than 0"),
        ({"parameters": {"semi_axes": [0.1, 0.1, 0.1], "normal": [0, 0, 0]}}, "a normal has a direction"),
        ({"first": "ground", "second": "egg", "parameters": {"semi_axes": [0.1, 0.1, 0.1]}}, "the plane is fixed"),
    ],
    ids=["no size", "no normal", "sides"],
)  # fmt: skip
def test_wrong_ellipsoids_are_refused(pair: dict[str, Any], said: str) -> None:
    given = case({}, pair, contact={"law": "linear", "stiffness": 1e6, "exponent": 1.0}, solve={"end_time": 1.0})
    with pytest.raises(CaseError, match=said):
        compile_case(fsm.load(given).model)
