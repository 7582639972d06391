"""Mechanisms of ideal joints: trees, and loops in planes and in space."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from validation.strangers.drawn import Drawn
from validation.strangers.typed import digits, nice
from validation.stress.dice import Dice, Tables

__all__ = ["draw_mechanism"]

_G = 9.81
_KINDS = ("revolute", "revolute", "revolute", "spherical", "universal", "cylindrical", "prismatic")


def draw_mechanism(dice: Dice) -> Drawn:
    """Bodies on joints: a tree of one to six or of up to 25 bodies, a plane linkage in any plane (its joints repeat each
    other), or a spatial slider-crank or four-bar linkage, under gravity, for one or two times the period of its size.

    Masses and sizes are those of laboratory mechanisms to solar panels. Half of the hinges have springs or dampers. Loops
    are closed at the start; some plane linkages start near a branch point. All numbers are in SI, so that the equations of
    `joint_equations` read the same file.
    """
    draw = dice.one_of((_tree, _tree, _long, _plane, _plane, _spatial))
    size = nice(dice.decades(0.05, 3.0))
    bodies, joints = draw(dice, size)
    for joint in joints:
        if joint["kind"] == "revolute" and dice.chance(0.5):
            load = float(bodies[0]["mass"]) * _G * size
            if dice.chance(0.6):
                joint["spring"] = {"stiffness": nice(load * dice.decades(0.05, 2.0)), "rest": nice(dice.between(-1.0, 1.0))}
            if dice.chance(0.6):
                joint["damper"] = {"coefficient": nice(load * math.sqrt(size / _G) * dice.decades(0.01, 0.3))}
    period = 2.0 * math.pi * math.sqrt(size / _G)
    end = nice(period * dice.between(0.5, 1.5))
    return Drawn({
        "units": "SI", "gravity": [0.0, 0.0, -_G], "scene": {"bodies": bodies, "joints": joints},
        "solve": {"end_time": end}, "save": {"interval": digits(end / 20.0, 6), "channels": ["body.*"]},
    }, {})  # fmt: skip


def _vector(dice: Dice, size: float) -> np.ndarray:
    found = np.array([dice.between(-1.0, 1.0) for _ in range(3)])
    return size * found / max(float(np.linalg.norm(found)), 0.1)


def _body(dice: Dice, name: str, mass: float, place: np.ndarray, size: float) -> Tables:
    about = sorted(dice.decades(0.02, 0.1) for _ in range(3))
    about[2] = min(about[2], 0.95 * (about[0] + about[1]))
    turned = Rotation.from_rotvec(_vector(dice, dice.between(0.0, 3.0)))
    return {
        "name": name, "mass": mass, "inertia": [digits(mass * size**2 * a, 6) for a in about],
        "position": place.tolist(), "orientation": turned.as_quat(scalar_first=True).tolist(),
    }  # fmt: skip


def _joint(kind: str, number: int, first: str, second: str, at: np.ndarray, **axes: Any) -> Tables:
    given = {key: np.asarray(value, dtype=float).tolist() for key, value in axes.items()}
    return {"name": f"joint {number}", "kind": kind, "first": first, "second": second, "at": at.tolist(), **given}


def _long(dice: Dice, size: float) -> tuple[list[Tables], list[Tables]]:
    """A chain, or a tree with few branches, of many bodies."""
    return _tree(dice, size, dice.count(7, 25), dice.one_of((0.0, 0.0, 0.2)))


def _tree(
    dice: Dice, size: float, count: int | None = None, branching: float = 1.0
) -> tuple[list[Tables], list[Tables]]:  # fmt: skip
    bodies, joints, places = [], [], [np.zeros(3)]
    for i in range(count or dice.count(1, 6)):
        parent = int(dice.between(0.0, i + 1.0 - 1e-9)) if dice.chance(branching) else i
        at = places[parent] + _vector(dice, 0.5 * size if parent else 0.1 * size)
        places.append(at + _vector(dice, 0.5 * size))
        mass = nice(dice.decades(0.2, 5.0))
        bodies.append(_body(dice, f"body {i + 1}", mass, places[-1], size))
        kind, axis = dice.one_of(_KINDS), _vector(dice, 1.0)
        axes = {} if kind == "spherical" else {"axis": axis}
        if kind == "universal":
            across = np.cross(axis, _vector(dice, 1.0))
            axes["second_axis"] = across / np.linalg.norm(across)
        first = f"body {parent}" if parent else "ground"
        joints.append(_joint(kind, i + 1, first, f"body {i + 1}", at, **axes))
    return bodies, joints


def _circles(a: np.ndarray, b: np.ndarray, one: float, two: float) -> np.ndarray:
    """Point at the distance `one` from a and `two` from b, on the left of the line between them."""
    way = b - a
    span = float(np.linalg.norm(way))
    along = way / span
    foot = (one**2 - two**2 + span**2) / (2.0 * span)
    return np.asarray(a + foot * along + math.sqrt(max(one**2 - foot**2, 0.0)) * np.array([-along[1], along[0]]))


def _plane(dice: Dice, size: float) -> tuple[list[Tables], list[Tables]]:
    """A four-bar linkage, perhaps a parallelogram, perhaps with a second coupler, in any plane."""
    crank = size * dice.between(0.3, 1.0)
    turn = math.radians(dice.between(15.0, 165.0))
    if dice.chance(0.3):  # a parallelogram, perhaps near the configuration in which it can branch
        coupler, rocker, base = size, crank, size
        turn = math.radians(dice.one_of((3.0, 20.0, 60.0, 120.0, 176.0)))
    else:
        coupler, rocker, base = (size * dice.between(*ends) for ends in ((1.0, 1.3), (0.9, 1.2), (1.0, 1.2)))
    a, d = np.zeros(2), np.array([base, 0.0])
    b = crank * np.array([math.cos(turn), math.sin(turn)])
    c = b + [base, 0.0] if coupler == base and rocker == crank else _circles(b, d, coupler, rocker)
    points, bars = [a, b, c, d], [("crank", 0, 1), ("coupler", 1, 2), ("rocker", 3, 2)]
    hinges = [("ground", "crank", 0), ("crank", "coupler", 1), ("coupler", "rocker", 2), ("ground", "rocker", 3)]
    plane = Rotation.from_rotvec(_vector(dice, dice.between(0.0, 3.0)))
    in_space = [plane.apply([p[0], p[1], 0.0]) for p in points]
    normal, mass = plane.apply([0.0, 0.0, 1.0]), nice(dice.decades(0.2, 5.0))
    bodies = [_body(dice, name, mass, 0.5 * (in_space[i] + in_space[j]), size) for name, i, j in bars]
    joints = [
        _joint("revolute", k + 1, first, second, in_space[i], axis=normal) for k, (first, second, i) in enumerate(hinges)
    ]
    return bodies, joints


def _spatial(dice: Dice, size: float) -> tuple[list[Tables], list[Tables]]:
    """Crank, coupler on spherical or universal joints, and a slider or a rocker, with skew axes."""
    crank, axis = 0.3 * size, _vector(dice, 1.0)
    side = np.cross(axis, _vector(dice, 1.0))
    pin = crank * side / np.linalg.norm(side)
    far = pin + _vector(dice, 1.2 * size)
    mass = nice(dice.decades(0.2, 5.0))
    bodies = [
        _body(dice, "crank", mass, 0.5 * pin, size), _body(dice, "coupler", mass, 0.5 * (pin + far), size),
        _body(dice, "last", mass, far + _vector(dice, 0.2 * size), size),
    ]  # fmt: skip
    joints = [
        _joint("revolute", 1, "ground", "crank", np.zeros(3), axis=axis),
        _joint("spherical", 2, "crank", "coupler", pin),
    ]
    along = far - pin
    across = np.cross(along, _vector(dice, 1.0))
    second = np.cross(along, across)
    if dice.chance(0.5):
        joints.append(_joint("universal", 3, "coupler", "last", far, axis=across, second_axis=second))
    else:
        joints.append(_joint("spherical", 3, "coupler", "last", far))
    if dice.chance(0.5):
        joints.append(_joint("prismatic", 4, "ground", "last", far, axis=along + _vector(dice, 0.3 * size)))
    else:
        turning = np.cross(along, _vector(dice, 1.0))
        at = far + np.cross(turning, along) / np.linalg.norm(turning)
        joints.append(_joint("revolute", 4, "ground", "last", at, axis=turning))
    return bodies, joints
