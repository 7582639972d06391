"""Rigid obstacles of a run as polygons for figures, from the case in the results."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fsm.errors import CaseError
from fsm.results.film import Floats
from fsm.results.solution import Solution

_CIRCLE_POINTS = 32
"""Number of corners that represent a circle."""


@dataclass(frozen=True)
class ObstacleOutline:
    """Outline of an obstacle in a record.

    Attributes
    ----------
    faces : list of (k, 3) arrays, m
        Polygons of its surface; a square for a plane.
    section : (k, 3) array, m
        Its section at y = 0; for a plane, a rectangle on the solid side.
    bounded : bool
        Whether the obstacle is bounded; a plane is not.
    moves : bool
        Whether it is fixed to a body that moves.
    """

    faces: list[Floats]
    section: Floats
    bounded: bool
    moves: bool = False


def obstacle_outlines(solution: Solution, record: int, centre: Floats, reach: float) -> list[ObstacleOutline]:
    """Outlines of the obstacles in a record.

    Parameters
    ----------
    solution : Solution
    record : int
    centre, reach : (3,) array and float, m
        Centre and half width of the square that represents a plane.

    Raises
    ------
    CaseError
        The case in the result has obstacles that cannot be drawn.
    """
    try:
        return _outlines(solution, record, centre, reach)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise CaseError(f"the case in this result is damaged: its obstacles cannot be drawn ({error!r})") from error


def obstacles_of(case: dict[str, Any]) -> list[dict[str, Any]]:
    """Obstacles of a case, or of its scene."""
    scene = case.get("scene")
    return list(case.get("obstacle", []) or (scene.get("obstacles", []) if isinstance(scene, dict) else []))


def _outlines(solution: Solution, record: int, centre: Floats, reach: float) -> list[ObstacleOutline]:
    outlines = []
    for obstacle in obstacles_of(solution.layout.case):
        turn = _rotation(obstacle.get("orientation", (1.0, 0.0, 0.0, 0.0)))
        at = np.array(obstacle.get("position", (0.0, 0.0, 0.0)))
        body = _pose(solution, record, obstacle.get("body"))
        if body is not None:
            turn, at = body[0] @ turn, body[1] + body[0] @ at
        outlines.append(replace(_outline(obstacle, turn, at, centre, reach), moves=body is not None))
    return outlines


def _outline(obstacle: dict[str, Any], turn: Floats, at: Floats, centre: Floats, reach: float) -> ObstacleOutline:
    shape = obstacle["shape"]
    if shape == "plane":
        normal = turn[:, 2]
        foot = centre - normal * float(normal @ (centre - at))
        x, y = reach * turn[:, 0], reach * turn[:, 1]
        depth = reach * normal
        return ObstacleOutline([np.array([foot - x - y, foot + x - y, foot + x + y, foot - x + y])],
                       np.array([foot - x, foot + x, foot + x - depth, foot - x - depth]), False)  # fmt: skip
    angles = 2.0 * np.pi * np.arange(_CIRCLE_POINTS) / _CIRCLE_POINTS
    if shape == "box":
        half = 0.5 * np.array(obstacle["size"])
        local = _box(half)
        section = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]) * half
    else:
        radius = float(obstacle["radius"])
        section = radius * np.column_stack([np.cos(angles), np.zeros(_CIRCLE_POINTS), np.sin(angles)])
        local = _cylinder(section, 0.5 * float(obstacle["length"])) if shape == "cylinder" else _sphere(radius)
        if shape == "sphere":
            turn = np.eye(3)
    return ObstacleOutline([face @ turn.T + at for face in local], section @ turn.T + at, True)


def _box(half: Floats) -> list[Floats]:
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return [np.insert(square, axis, side, axis=1) * half for axis in range(3) for side in (-1.0, 1.0)]


def _cylinder(rim: Floats, half: float) -> list[Floats]:
    along = np.array([0.0, half, 0.0])
    following = np.roll(rim, -1, axis=0)
    sides = [np.array([a - along, b - along, b + along, a + along]) for a, b in zip(rim, following, strict=True)]
    return [*sides, rim - along, rim + along]


def _sphere(radius: float) -> list[Floats]:
    polar, around = np.meshgrid(np.linspace(0.0, np.pi, 9), np.linspace(0.0, 2.0 * np.pi, 17), indexing="ij")
    points = radius * np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)
    return [np.array([points[i, j], points[i, j + 1], points[i + 1, j + 1], points[i + 1, j]])
            for i in range(8) for j in range(16)]  # fmt: skip


def _pose(solution: Solution, record: int, body: str | None) -> tuple[Floats, Floats] | None:
    """Rotation matrix and position of a moving body; None for a fixed one."""
    names = solution.layout.body_names
    if body not in names:
        return None
    size = 3 if solution.q.shape[1] == 3 * len(names) else 7
    start = size * names.index(body)  # coordinates of nodes follow those of all bodies
    own = solution.q[record, start : start + size]
    if size == 3:
        x, z, angle = own
        return _rotation((np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0)), np.array([x, 0.0, z])
    return _rotation(own[3:]), own[:3]


def _rotation(quaternion: Any) -> Floats:
    """Rotation matrix of a unit quaternion, scalar first."""
    w, *vector = (float(c) for c in quaternion)
    v = np.array(vector)
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
