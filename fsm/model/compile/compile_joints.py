"""Ideal joints of a scene as openings between bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.case.models.joint import TURNING, SceneJoint
from fsm.interactions.openings import ACROSS, ALONG, DISTANCE
from fsm.kernels.rotation import rotation_matrix
from fsm.model.elements.joints import JointGroup

_Axes = tuple[int, ...]
LOCKED_PLACES: dict[str, _Axes] = {
    "fixed": (0, 1, 2), "revolute": (0, 1, 2), "spherical": (0, 1, 2), "universal": (0, 1, 2), "prismatic": (0, 1),
    "cylindrical": (0, 1), "in-line": (0, 1), "planar": (2,), "in-plane": (2,), "distance": (),
}  # fmt: skip
"""Axes of the first body along which the point of the second does not move."""
LOCKED_TURNS: dict[str, tuple[tuple[int, int], ...]] = {
    "fixed": ((0, 1), (1, 2), (2, 0)), "prismatic": ((0, 1), (1, 2), (2, 0)), "revolute": ((0, 2), (1, 2)),
    "cylindrical": ((0, 2), (1, 2)), "planar": ((0, 2), (1, 2)), "universal": ((2, 0),),
}  # fmt: skip
"""Axes of the first and of the second body that stay at right angles."""
_SOFTEST = 1e-8
"""Smallest ratio of the compliances of a joint that its penalties take into account."""


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


def joint_group(
    joints: Sequence[SceneJoint], ends: np.ndarray, poses: np.ndarray, inverse: np.ndarray
) -> JointGroup:
    """Openings of all joints.

    Parameters
    ----------
    joints : joints without faults
    ends : (m, 2) int array
        First and second body of each joint.
    poses : (n_bodies, 7) array
        Poses at the start.
    inverse : (n_bodies, 6) array
        Inverse of the inertia; zero for bodies that cannot move.
    """
    rows: list[tuple[int, int, np.ndarray]] = []
    turns: list[tuple[int, int]] = []
    lines: list[np.ndarray] = []
    for number, joint in enumerate(joints):
        (a, b), axes = ends[number].tolist(), joint_axes(joint)
        at = np.array(joint.at)
        to = at if joint.to is None else np.array(joint.to)
        turned = [rotation_matrix(poses[body, 3:]) for body in (a, b)]
        own, arm = axes @ turned[0], (to - poses[b, :3]) @ turned[1]
        other, base = axes @ turned[1], (at - poses[a, :3]) @ turned[0]
        if joint.kind == "distance":
            rows.append((number, DISTANCE, np.array([*base, *arm, np.linalg.norm(to - at)])))
        rows += [(number, ALONG, np.array([*own[k], *arm, own[k] @ base])) for k in LOCKED_PLACES[joint.kind]]
        rows += [(number, ACROSS, np.array([*own[j], *other[k], 0.0])) for j, k in LOCKED_TURNS.get(joint.kind, ())]
        if joint.kind in TURNING:
            turns.append((a, b))
            lines.append(np.array([*own[2], *own[0], *other[0]]))
        elif joint.kind == "universal":
            turns += [(a, b), (b, a)]
            lines += [np.array([*own[2], *own[0], *other[0]]), np.array([*other[0], *other[2], *own[2]])]
    of = np.array([number for number, _, _ in rows], dtype=np.int64)
    group = JointGroup(
        np.ascontiguousarray(ends[of]), np.array([kind for _, kind, _ in rows], dtype=np.int64),
        np.array([constants for _, _, constants in rows]), np.ones(len(rows)),
        np.array(turns, dtype=np.int64).reshape(-1, 2), np.array(lines, dtype=float).reshape(-1, 9),
        tuple(joint.name for joint in joints), of,
    )  # fmt: skip
    _, gradients = group.openings(poses)
    for number in range(len(joints)):
        own = of == number
        group.masses[own] = _inertia(gradients[own], inverse[ends[number]].ravel())
    return group


def _inertia(gradients: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Inertia (n,) of the openings of a joint, kg or kg m^2, that is no smaller in any direction than J M^-1 J^T gives.

    In the direction of a rod with a small ball at its end, the inertia is the mass of the ball; the opening along an oblique
    axis, whose own inertia is small, has this inertia too.
    """
    compliance = gradients * inverse @ gradients.T
    own = np.diag(compliance)
    scale = np.sqrt(np.where(own > 0.0, own, 1.0))
    softest = float(np.linalg.eigvalsh(compliance / np.outer(scale, scale))[0])
    return np.where(own > 0.0, 1.0 / (scale**2 * max(softest, _SOFTEST)), 0.0)
