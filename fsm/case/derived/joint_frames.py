"""Axes of ideal joints at the start, and the directions that each kind locks."""

from __future__ import annotations

import numpy as np

from fsm.case.models.joint import SceneJoint

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
