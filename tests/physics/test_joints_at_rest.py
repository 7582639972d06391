"""Ideal joints in equilibria, against closed forms: quasi-static paths, arc length, relaxation, and natural modes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import fsm
from fsm.api.case import Result
from fsm.model.compile.compile_case import compile_case
from fsm.solve.equations.newton import held_still
from fsm.solve.statics.arc_length import trace

_G = 9.80665
_LINEAR = {"kind": "ramp", "end": 1.0, "shape": "linear"}
A, B, C, D = (np.array(p) for p in ([0.0, 0.0, 0.0], [0.0, 0.0, 0.3], [0.9, 0.0, 0.6], [1.0, 0.0, 0.0]))
"""Pins of a four-bar: crank AB, coupler BC, rocker DC."""
_COUPLER = float(np.linalg.norm(C - B))


def rod(name: str, start: Any, end: Any, **keys: Any) -> dict[str, Any]:
    """Rod of 1 kg in the plane of x and z; its body axis x points from its start to its end."""
    start, end = np.array(start, dtype=float), np.array(end, dtype=float)
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    turned = Rotation.from_matrix(np.column_stack([along, [0.0, 1.0, 0.0], np.cross(along, [0.0, 1.0, 0.0])]))
    return {
        "name": name, "mass": 1.0, "inertia": [1e-3, length**2 / 12.0, length**2 / 12.0],
        "position": (0.5 * (start + end)).tolist(), "orientation": turned.as_quat(scalar_first=True).tolist(), **keys,
    }  # fmt: skip


def pin(name: str, first: str, second: str, at: Any, **keys: Any) -> dict[str, Any]:
    place = np.array(at, dtype=float).tolist()
    return {"name": name, "kind": "revolute", "first": first, "second": second, "at": place, "axis": [0.0, 1.0, 0.0], **keys}


def statics(bodies: list[Any], joints: list[Any], method: str = "static", **scene: Any) -> dict[str, Any]:
    return {
        "units": "SI", "gravity": scene.pop("gravity", [0.0, 0.0, 0.0]),
        "scene": {"bodies": bodies, "joints": joints, **scene},
        "solve": {"end_time": 1.0, "error_estimates": "off", "method": method},
        "save": {"interval": 0.1, "channels": ["joint.*"]},
    }  # fmt: skip


def of(result: Result, name: str) -> np.ndarray:
    return np.asarray(result[name].values)


def four_bar(**keys: Any) -> tuple[list[Any], list[Any]]:
    bodies = [rod("crank", A, B), rod("coupler", B, C), rod("rocker", D, C)]
    joints = [pin("a", "ground", "crank", A, **keys.get("a", {})), pin("b", "crank", "coupler", B)]
    joints += [pin("c", "coupler", "rocker", C), pin("d", "ground", "rocker", D, **keys.get("d", {}))]
    return bodies, joints


def turned(point: np.ndarray, about: np.ndarray, angle: float) -> np.ndarray:
    return about + Rotation.from_rotvec([0.0, angle, 0.0]).apply(point - about)


def rocker(crank: float) -> float:
    """Angle of the rocker at an angle of the crank, both from the start."""
    end = turned(B, A, crank)
    return float(brentq(lambda psi: np.linalg.norm(turned(C, D, psi) - end) - _COUPLER, -1.0, 1.5, xtol=1e-15))


def slope(of_angle: Any, at: float, h: float = 1e-3) -> float:
    """Derivative by differences of the sixth order."""
    return sum(w * (of_angle(at + k * h) - of_angle(at - k * h)) for k, w in ((1, 0.75), (2, -0.15), (3, 1 / 60))) / h


def test_hinge_with_a_spring_follows_a_growing_dead_load(tmp_path: Path) -> None:
    joint = pin("hinge", "ground", "rod", A, spring={"stiffness": 3.0, "rest": 0.0})
    load = {"name": "tip", "body": "rod", "point": [0.5, 0.0, 0.0], "force": [0.0, 0.0, -4.0], "time": _LINEAR}
    result = fsm.load(statics([rod("rod", A, [1.0, 0.0, 0.0])], [joint], loads=[load])).run(tmp_path, figures=False)
    forces = np.linspace(0.0, 4.0, 11)
    expected = [brentq(lambda x, force=force: 3.0 * x - force * math.cos(x), 0.0, 1.5, xtol=1e-15) for force in forces]
    assert of(result, "joint.hinge.angle") == pytest.approx(np.array(expected), abs=1e-9)
    assert of(result, "joint.hinge.force")[:, 2] == pytest.approx(forces, abs=4e-8)  # force of the ground on the rod
    assert result.summary["energy_error"] < 1e-4


@pytest.mark.parametrize("copies", [1, 2])
def test_driven_four_bar_with_a_spring_at_its_rocker(tmp_path: Path, copies: int) -> None:
    """With every pin given twice (`copies`), the repeated directions change nothing."""
    motor = {"angle": {"value": 1.0, "time": _LINEAR}}
    bodies, joints = four_bar(a={"motor": motor}, d={"spring": {"stiffness": 2.0, "rest": 0.0}})
    joints += [{key: joint[key] for key in joint if key not in ("motor", "spring")} | {"name": f"{joint['name']}2"}
               for joint in joints if copies == 2]  # fmt: skip
    result = fsm.load(statics(bodies, joints)).run(tmp_path, figures=False)
    cranks = of(result, "joint.a.angle")
    rockers = np.array([rocker(x) for x in cranks])
    assert cranks == pytest.approx(np.linspace(0.0, 1.0, 11), abs=1e-9)
    assert of(result, "joint.d.angle") == pytest.approx(rockers, abs=1e-9)
    moments = [2.0 * psi * slope(rocker, x) for x, psi in zip(cranks, rockers, strict=True)]
    assert of(result, "joint.a.motor") == pytest.approx(np.array(moments), abs=1e-8)
    assert result.summary["energy_error"] < 3e-4


def test_an_ideal_gear_turns_a_spring_through_a_full_turn(tmp_path: Path) -> None:
    """x1 = 2 x2 and moment M on the first: 2 M = k x2."""
    bodies = [rod("one", A, [1.0, 0.0, 0.0]), rod("two", [0.0, 1.0, 0.0], [1.0, 1.0, 0.0])]
    joints = [pin("j1", "ground", "one", A)]
    joints += [pin("j2", "ground", "two", [0.0, 1.0, 0.0], spring={"stiffness": 2.0, "rest": 0.0})]
    gear = {"name": "gear", "kind": "gear", "joints": ["j1", "j2"], "parameters": {"ratio": 2.0}}
    load = {"name": "M", "body": "one", "moment": [0.0, 4.0, 0.0], "time": _LINEAR}
    result = fsm.load(statics(bodies, joints, couplings=[gear], loads=[load])).run(tmp_path, figures=False)
    moments = np.linspace(0.0, 4.0, 11)
    assert of(result, "joint.j1.angle") == pytest.approx(2.0 * moments, abs=1e-9)
    assert of(result, "joint.j2.angle") == pytest.approx(moments, abs=1e-9)


def test_bristle_friction_of_a_hinge_on_a_slow_path(tmp_path: Path) -> None:
    """Sliding bristles hold their whole moment at any speed; the energy that they lose is that of the path."""
    end = 1e3
    bodies, joints = four_bar(
        a={"motor": {"angle": {"value": 1.0, "time": _LINEAR | {"end": end}}}},
        d={"spring": {"stiffness": 2.0, "rest": 0.0}, "friction": {"moment": 0.1, "law": "lugre"}},
    )
    case = statics(bodies, joints)
    case["solve"]["end_time"], case["save"]["interval"] = end, 0.2 * end
    result = fsm.load(case).run(tmp_path, figures=False)
    moments = [(2.0 * rocker(x) + 0.1) * slope(rocker, x) for x in of(result, "joint.a.angle")[1:]]
    assert of(result, "joint.a.motor")[1:] == pytest.approx(np.array(moments), abs=1e-8)
    assert result.summary["energy_error"] < 1e-3


def truss() -> tuple[dict[str, Any], float, float, float]:
    """Two rigid rods between a pin and a foot that slides against a spring, with a load at the apex; also length of a rod,
    half the width and stiffness.
    """
    width, height, stiffness = 1.0, 0.3, 50.0
    foot = {"name": "foot", "mass": 1.0, "inertia": [0.01] * 3, "position": [width, 0.0, 0.0]}
    bodies = [rod("left", [-width, 0.0, 0.0], [0.0, 0.0, height]), rod("right", [0.0, 0.0, height], [width, 0.0, 0.0]), foot]
    joints = [pin("a", "ground", "left", [-width, 0.0, 0.0]), pin("b", "left", "right", [0.0, 0.0, height])]
    joints += [pin("c", "right", "foot", [width, 0.0, 0.0])]
    slide = {"name": "s", "kind": "prismatic", "first": "ground", "second": "foot", "at": [width, 0.0, 0.0]}
    joints.append(slide | {"axis": [1.0, 0.0, 0.0], "spring": {"stiffness": stiffness, "rest": 0.0}})
    length = math.hypot(width, height)
    load = {"name": "P", "body": "left", "point": [0.5 * length, 0.0, 0.0], "force": [0.0, 0.0, -4.0]}
    case = statics(bodies, joints, "arc-length", loads=[load | {"time": _LINEAR | {"shape": "unbounded"}}])
    return case, length, width, stiffness


def test_truss_of_ideal_pins_snaps_along_the_closed_form() -> None:
    case, length, width, stiffness = truss()
    _, system = compile_case(fsm.load(case)._loaded.case)
    q, angles = held_still(system, 0.0, system.initial()[0]), []
    for point in trace(system, q, 0.0, 1.0, 2e-3, 0.02, 1000, lowest=-1.0):
        system.commit(point.time, point.q, np.zeros(system.nu))
        poses, _ = system.place(point.time, point.q, None)
        assert np.abs(system.locking[0].openings(poses)[0]).max() < 1e-9
        angle = math.asin(2.0 * poses[system.bodies.names.index("left"), 2] / length)
        slip = 2.0 * (length * math.cos(angle) - width)
        assert 4.0 * point.time == pytest.approx(2.0 * stiffness * slip * math.tan(angle), abs=1e-7)
        curvature = 2.0 * stiffness * (slip / math.cos(angle) ** 2 - 2.0 * length * math.sin(angle) * math.tan(angle))
        assert point.negative_pivots == (1 if curvature > 0.0 else 0)  # the load falls with the deflection
        angles.append(angle)
    assert min(angles) < -0.3  # beyond both limit points


def test_channels_along_an_arc_length_are_those_of_each_point(tmp_path: Path) -> None:
    case, length, width, _ = truss()
    result = fsm.load(case).run(tmp_path, figures=False)
    angle = math.asin(0.3 / length) - of(result, "joint.a.angle")
    slip = of(result, "joint.s.displacement")
    assert np.ptp(angle) > 0.6
    assert slip == pytest.approx(2.0 * (length * np.cos(angle) - width), abs=1e-9)
    assert of(result, "joint.c.force_in_joint")[:, :2] != pytest.approx(0.0)


def frequencies(folder: Path, bodies: list[Any], joints: list[Any]) -> list[float]:
    case = statics(bodies, joints, gravity=[0.0, 0.0, -_G])
    case["solve"] = {"error_estimates": "off"}
    case["step"] = [{"kind": "relax"}, {"kind": "modes", "modes": 9}]
    return list(fsm.load(case).run(folder, figures=False).summary["step"][1]["frequencies_hz"])


def test_a_pendulum_has_one_mode(tmp_path: Path) -> None:
    found = frequencies(tmp_path, [rod("rod", A, [0.6, 0.0, -0.8])], [pin("pin", "ground", "rod", A)])
    assert found == pytest.approx([math.sqrt(1.5 * _G) / (2.0 * math.pi)], rel=1e-9)  # it comes to rest below the pin


def test_the_mode_of_a_four_bar_about_its_equilibrium(tmp_path: Path) -> None:
    stiffness = 20.0
    bodies, joints = four_bar(d={"spring": {"stiffness": stiffness, "rest": 0.0}})
    found = frequencies(tmp_path, bodies, joints)

    def places(crank: float) -> tuple[np.ndarray, np.ndarray, float]:
        psi = rocker(crank)
        return turned(B, A, crank), turned(C, D, psi), psi

    def energy(crank: float) -> float:
        b, c, psi = places(crank)
        return _G * (0.5 * b[2] + 0.5 * (b[2] + c[2]) + 0.5 * c[2]) + 0.5 * stiffness * psi**2

    def tilt(crank: float) -> float:
        b, c, _ = places(crank)
        return math.atan2(b[2] - c[2], c[0] - b[0])

    at = brentq(lambda x: slope(energy, x), -3.85, -3.75, xtol=1e-12)  # where it comes to rest
    middle = [slope(lambda x, k=k: 0.5 * (places(x)[0] + places(x)[1])[k], at) for k in (0, 2)]
    turn = slope(lambda x: places(x)[2], at)
    inertia = 0.3**2 / 3.0 + float(np.sum((C - D) ** 2)) / 3.0 * turn**2
    inertia += middle[0] ** 2 + middle[1] ** 2 + _COUPLER**2 / 12.0 * slope(tilt, at) ** 2
    expected = math.sqrt(slope(lambda x: slope(energy, x), at) / inertia) / (2.0 * math.pi)
    assert found == pytest.approx([expected], rel=1e-6)


def test_a_motion_follows_an_equilibrium(tmp_path: Path) -> None:
    """A hinged rod is pulled aside in equilibrium; then the load is gone, and it swings from rest."""
    time = {"kind": "table", "time": [0.0, 1.0, 1.01, 2.0], "value": [0.0, 1.0, 0.0, 0.0]}
    load = {"name": "side", "body": "rod", "force": [_G, 0.0, 0.0], "time": time}
    bodies, joints = [rod("rod", A, [0.0, 0.0, -1.0])], [pin("pin", "ground", "rod", A)]
    case = statics(bodies, joints, gravity=[0.0, 0.0, -_G], loads=[load])
    case["solve"] = {"error_estimates": "off"}
    case["step"] = [
        {"name": "pull", "kind": "static", "duration": 1.0},
        {"name": "swing", "kind": "dynamic", "duration": 0.2},
    ]
    case["save"]["interval"] = 0.1
    result = fsm.load(case).run(tmp_path, figures=False)
    angle, force = of(result, "joint.pin.angle"), of(result, "joint.pin.force")
    assert angle[10] == pytest.approx(-0.25 * math.pi, abs=1e-8)
    assert force[10] == pytest.approx([-_G, 0.0, _G], abs=1e-6)
    assert abs(angle[-1]) < abs(angle[10]) - 0.1


def test_penalties_at_rest_are_those_of_the_bodies_at_a_joint() -> None:
    """In a sheet of 100 rigid facets on ideal hinges, penalties for its whole size needed 6 iterations in each of 40,000
    steps, which could not grow; those for the size of a facet need 4 in 130 steps.
    """
    found = []
    for count in (2, 40):
        places = [np.array([0.1 * k, 0.0, 0.02 * (k % 2)]) for k in range(count + 1)]
        bodies = [rod(f"rod {k}", places[k], places[k + 1]) for k in range(count)]
        names = ["ground", *(body["name"] for body in bodies)]
        joints = [pin(f"pin {k}", names[k], names[k + 1], places[k]) for k in range(count)]
        _, system = compile_case(fsm.load(statics(bodies, joints))._loaded.case)
        system.hold_still(True)
        found.append(system.locking[0].sizes[5:10].copy())
    assert found[1] == pytest.approx(found[0], rel=1e-9)
