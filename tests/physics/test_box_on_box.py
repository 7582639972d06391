"""Two boxes: integrals over their common volume, energy, tangent, and motions of faces, edges and corners."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

import fsm
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem

_STIFFNESS = 1e6
_LINEAR = {"law": "linear", "stiffness": _STIFFNESS, "ramp": 1e-12}
_SIZES = ((0.1, 0.08, 0.06), (0.09, 0.2, 0.07))
_FAR = 1.0
"""Distance at the start, m: cases with overlaps are refused."""
_UNIT = [1.0, 0.0, 0.0, 0.0]


def quaternion(turn: Rotation) -> list[float]:
    return [float(x) for x in turn.as_quat(scalar_first=True)]


def case(bodies: list[dict[str, Any]], pairs: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    named = [
        {"name": f"box {k}", "mass": 0.5, "inertia": [2e-3, 1e-3, 2e-3], "velocity": [0.3, -0.2, 0.1 * k],
         "angular_velocity": [2.0, -3.0, 1.0 + k]} | body
        for k, body in enumerate(bodies)
    ]  # fmt: skip
    touching = [{"first": "box 0", "second": "box 1", "geometry": "box-on-box"} | pair for pair in pairs]
    given = {"units": "SI", "scene": {"bodies": named, "pairs": touching}, "contact": _LINEAR}
    return given | {"solve": {"end_time": 1e-3, "spatial": True}} | more


def placed(
    sizes: Any, places: list[Any], turns: list[Rotation], parameters: dict[str, Any] | None = None, **more: Any
) -> tuple[SegmentSystem, np.ndarray, np.ndarray]:
    """System, and a configuration with both boxes at given places, with a velocity."""
    sides = np.array([[-_FAR, 0.0, 0.0], [_FAR, 0.0, 0.0]])
    bodies = [{"position": side.tolist(), "orientation": quaternion(turn)} for side, turn in zip(sides, turns, strict=True)]
    pair = {"parameters": {"sizes": [list(size) for size in sizes]} | (parameters or {})}
    system = compile_case(fsm.load(case(bodies, [pair], **more)).model)[1]
    q, u = system.initial()
    q[:3], q[7:10] = places
    return system, q, u


def halfspaces(size: Any, place: np.ndarray, turn: Rotation) -> np.ndarray:
    """Planes (6, 4) of a box: n.x + c <= 0."""
    normals = turn.apply(np.concatenate([np.eye(3), -np.eye(3)]))
    return np.column_stack([normals, -normals @ place - 0.5 * np.tile(size, 2)])


def inner_point(planes: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre and radius of the largest ball inside the half spaces; the radius is below zero if there is none."""
    found = linprog([0, 0, 0, -1], np.column_stack([planes[:, :3], np.ones(len(planes))]), -planes[:, 3],
                    bounds=[(None, None)] * 4)  # fmt: skip
    return found.x[:3], float(found.x[3])


def integral(sizes: Any, places: list[np.ndarray], turns: list[Rotation]) -> float:
    """Depth below the nearest face of the first box, integrated over the common volume of both boxes, m^4."""
    own, other = (halfspaces(*given) for given in zip(sizes, places, turns, strict=True))
    total = 0.0
    for face in range(6):
        nearest = own[face] - np.delete(own, face, axis=0)  # its distance is the smallest one
        planes = np.concatenate([own, other, -nearest])
        centre, radius = inner_point(planes)
        if radius <= 1e-9:
            continue
        points = HalfspaceIntersection(planes, centre).intersections
        hull = ConvexHull(points)
        for corners in points[hull.simplices]:
            tetrahedron = np.vstack([centre, corners])
            volume = abs(np.linalg.det(tetrahedron[1:] - centre)) / 6.0
            total -= volume * (tetrahedron @ own[face, :3] + own[face, 3]).mean()
    return total


def random_pair(seed: int, deep: float) -> tuple[list[np.ndarray], list[Rotation]]:
    """Boxes at random, with the deepest corners of both up to a part of the smallest size inside the other."""
    random = np.random.default_rng(seed)
    turns = [Rotation.random(random_state=2 * seed + k) for k in range(2)]
    way = random.normal(size=3)
    way /= np.linalg.norm(way)
    beside = np.cross(way, random.normal(size=3))
    far, near, places = 0.4, 0.0, [0.02 * beside, np.zeros(3)]
    for _ in range(60):  # distance at which they touch
        middle = 0.5 * (far + near)
        both = [halfspaces(size, place + k * middle * way, turn)
                for k, (size, place, turn) in enumerate(zip(_SIZES, places, turns, strict=True))]  # fmt: skip
        near, far = (middle, far) if inner_point(np.concatenate(both))[1] > 0.0 else (near, middle)
    return [places[0], (near - deep * min(_SIZES[0])) * way], turns


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("deep", [-0.003, 0.003, 0.1, 0.3])
def test_energy_is_the_integral_over_the_common_volume(seed: int, deep: float) -> None:
    places, turns = random_pair(seed, deep)
    system, q, u = placed(_SIZES, places, turns)
    energy = system.energy(0.0, q, u).potential["contact"]
    known = _STIFFNESS / (_SIZES[0][0] * _SIZES[0][1]) * integral(_SIZES, places, turns)
    assert (energy > 0.0) == (deep > 0.0)
    assert energy == pytest.approx(known, rel=1e-5 if deep > 0.01 else 2e-2, abs=0.0)
