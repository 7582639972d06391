"""Axes of ideal joints at the start, and the directions that each kind locks.

Lines by which figures show bodies without a shape, and the axes of ideal joints.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import GROUND, Scene

_Axes = tuple[int, ...]
LOCKED_PLACES: dict[str, _Axes] = {
    "fixed": (0, 1, 2), "revolute": (0, 1, 2), "spherical": (0, 1, 2), "universal": (0, 1, 2), "prismatic": (0, 1),
    "cylindrical": (0, 1), "screw": (0, 1), "in-line": (0, 1), "planar": (2,), "in-plane": (2,), "distance": (),
}  # fmt: skip
"""Axes of the first body along which the point of the second does not move."""
LOCKED_TURNS: dict[str, tuple[tuple[int, int], ...]] = {
    "fixed": ((0, 1), (1, 2), (2, 0)), "prismatic": ((0, 1), (1, 2), (2, 0)), "revolute": ((0, 2), (1, 2)),
    "cylindrical": ((0, 2), (1, 2)), "screw": ((0, 2), (1, 2)), "planar": ((0, 2), (1, 2)), "universal": ((2, 0),),
}  # fmt: skip
"""Axes of the first and of the second body that stay at right angles."""


def joint_axes(joint: SceneJoint) -> np.ndarray:
    """Axes of a joint at the start as rows (3, 3), inertial: the third is its axis, the first that of a cross.

    Without `axis`, the inertial axes.
    """
    if joint.axis is None:
        return np.eye(3)
    third = np.array(joint.axis) / np.linalg.norm(joint.axis)
    # the first is at a right angle to the inertial axis that is farthest from the third
    across = np.cross(np.eye(3)[np.argmin(np.abs(third))], third)
    first = across if joint.second_axis is None else np.array(joint.second_axis)
    first = first - (first @ third) * third
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(third, first), third])


LINK, JOINT_AXIS = -4, -5
"""Kinds of lines; numbers in place of a panel, as in `fsm.results.solution`."""
_AXIS = 0.05
"""Half the length of the line of an axis, relative to the size of the mechanism."""
_CROSS = 0.03
"""Half the length of the lines of a cross, relative to this size."""
_SAME = 1e-9
"""Distance of points that are one, relative to this size."""


class MechanismLine(NamedTuple):
    """Line that moves with a body: name of the body, own name, ends at the start in inertial axes (3,), m, and kind."""

    body: str
    name: str
    start: np.ndarray
    end: np.ndarray
    kind: int


def mechanism_size(scene: Scene) -> float:
    """Largest extent of the points of all joints and of the centres of all bodies, m."""
    points = [joint.at for joint in scene.joints] + [joint.to for joint in scene.joints if joint.to is not None]
    points += [body.position for body in scene.bodies]
    return float(np.ptp(np.array(points), axis=0).max()) or 1.0


def mechanism_lines(scene: Scene) -> Iterator[MechanismLine]:
    """Lines of bodies without plate and solid from their centre of mass to each of their joints, and lines along axes.

    Frames have no lines. A body with its joints at its centre of mass only is a cross.
    The line of a joint that slides belongs to its second body, others to its first.
    """
    if not scene.joints:
        return
    size = mechanism_size(scene)
    shown = {body.name for body in scene.bodies if body.plate} | {obstacle.body for obstacle in scene.obstacles}
    shown |= {frame.name for frame in scene.frames}  # their parts are drawn
    for body in scene.bodies:
        own = [joint.at for joint in scene.joints if joint.first == body.name]
        own += [joint.at if joint.to is None else joint.to for joint in scene.joints if joint.second == body.name]
        if body.name in shown or not own:
            continue
        centre = np.array(body.position)
        arms = [(centre, at) for at in map(np.array, dict.fromkeys(own)) if np.linalg.norm(at - centre) > _SAME * size]
        arms = arms or [(centre - cross, centre + cross) for cross in _CROSS * size * np.eye(3)]
        for start, end in arms:
            yield MechanismLine(body.name, body.name, start, end, LINK)
    for joint in scene.joints:
        if joint.axis is not None:
            half = _AXIS * size * np.array(joint.axis) / np.linalg.norm(joint.axis)
            of = joint.second if joint.kind in ("prismatic", "cylindrical") and joint.second != GROUND else joint.first
            yield MechanismLine(of, joint.name, np.array(joint.at) - half, np.array(joint.at) + half, JOINT_AXIS)
