"""Ideal joints of a scene as openings between bodies."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from fsm.case.derived.joint_frames import LOCKED_PLACES, LOCKED_TURNS, joint_axes
from fsm.case.models.joint import TURNING, SceneJoint
from fsm.interactions.openings import ACROSS, ALONG, CONSTANTS, DISTANCE, SCREW, TURN
from fsm.kernels.programs import Program
from fsm.kernels.rotation import rotation_matrix
from fsm.model.bodies.drive import motor_program
from fsm.model.elements.couplings import Joints
from fsm.model.elements.joints import JointGroup


def joint_group(
    joints: Sequence[SceneJoint], ends: np.ndarray, poses: np.ndarray, locked_later: Collection[str] = ()
) -> JointGroup:
    """Openings of all joints.

    Parameters
    ----------
    joints : joints without faults
    ends : (m, 2) int array
        First and second body of each joint.
    poses : (n_bodies, 7) array
        Poses at the start.
    locked_later : names of joints that events lock
    """
    rows: list[tuple[int, int, np.ndarray]] = []
    turns: list[tuple[int, int]] = []
    lines: list[np.ndarray] = []
    motors: list[Program] = []
    moved: list[int] = []
    for number, joint in enumerate(joints):
        a, b = ends[number].tolist()
        own, other, base, arm = in_bodies(joint, poses[a], poses[b])
        if joint.kind == "distance":
            assert joint.to is not None
            rows.append((number, DISTANCE, padded(*base, *arm, math.dist(joint.to, joint.at))))
        rows += [(number, ALONG, padded(*own[k], *arm, own[k] @ base)) for k in LOCKED_PLACES[joint.kind]]
        locked = LOCKED_TURNS.get(joint.kind, ())
        rows += [(number, ACROSS, padded(*own[j], *other[k])) for j, k in locked]
        if joint.pitch is not None:
            turn = _turn(own[2], own[0], other[0], -(own[2] @ base))
            turn[10:13], turn[13] = arm, joint.pitch / (2.0 * math.pi)
            rows.append((number, SCREW, turn))
        moved += [-1] * (len(rows) - len(moved))
        if joint.motor is not None and joint.motor.prescribes:
            rows.append((number, *coordinate_of(joint, 0.0, (own, other, base, arm))))
            moved.append(len(motors))
            motors.append(motor_program(joint.motor))
        if joint.kind in TURNING:
            turns.append((a, b))
            lines.append(_turn(own[2], own[0], other[0]))
        elif joint.kind == "universal":
            turns += [(a, b), (b, a)]
            lines += [_turn(own[2], own[0], other[0]), _turn(other[0], other[2], own[2])]
    places = zip(joints, ends, strict=True)
    spare = [
        (number, kind, constants) for number, (joint, of) in enumerate(places) if joint.name in locked_later
        for kind, constants in _when_locked(joint, in_bodies(joint, *poses[of]))
    ]  # fmt: skip
    rows, moved = [*rows, *spare], [*moved, *[-1] * len(spare)]
    of = np.array([number for number, _, _ in rows], dtype=np.int64)
    return JointGroup(
        np.ascontiguousarray(ends[of]), np.array([kind for _, kind, _ in rows], dtype=np.int64),
        np.array([constants for _, _, constants in rows]), np.ones(len(rows)),
        np.array(turns, dtype=np.int64).reshape(-1, 2), np.array(lines, dtype=float).reshape(-1, CONSTANTS),
        tuple(joint.name for joint in joints), of, np.array(moved, dtype=np.int64), tuple(motors), len(spare),
    )  # fmt: skip


def coordinates_of(joints: Sequence[SceneJoint], ends: np.ndarray, poses: np.ndarray) -> Joints:
    """Coordinates of revolute and prismatic joints from the start, for couplings; other arguments as in `joint_group`."""
    found = [coordinate_of(joint, 0.0, in_bodies(joint, *poses[of])) for joint, of in zip(joints, ends, strict=True)]
    kinds, constants = np.array([kind for kind, _ in found], dtype=np.int64), np.array([row for _, row in found])
    return Joints(ends, kinds, constants, np.zeros((0, 10)), np.zeros(len(joints)))


def _when_locked(joint: SceneJoint, parts: tuple[np.ndarray, ...]) -> list[tuple[int, np.ndarray]]:
    """Openings that a lock adds: that of the only coordinate, or those of a fixed joint; see `JointGroup.lock_at`."""
    if joint.kind in ("revolute", "screw", "prismatic"):
        return [coordinate_of(joint, 0.0, parts)]
    own, other, base, arm = parts
    found = [(ALONG, padded(*own[k], *arm, own[k] @ base)) for k in range(3)]
    return found + [(ACROSS, padded(*own[j], *other[k])) for j, k in LOCKED_TURNS["fixed"]]


def padded(*numbers: float) -> np.ndarray:
    """Constants of an opening."""
    return np.array([*numbers, *[0.0] * (CONSTANTS - len(numbers))])


def in_bodies(joint: SceneJoint, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, ...]:
    """Axes of a joint in its first and in its second body (3, 3), and its points in both (3,), from their poses (7,)."""
    axes, at = joint_axes(joint), np.array(joint.at)
    to = at if joint.to is None else np.array(joint.to)
    a, b = rotation_matrix(first[3:]), rotation_matrix(second[3:])
    return axes @ a, axes @ b, (at - first[:3]) @ a, (to - second[:3]) @ b


def coordinate_of(joint: SceneJoint, start: float, parts: tuple[np.ndarray, ...]) -> tuple[int, np.ndarray]:
    """Coordinate of a revolute, screw or prismatic joint, `start` at the start, as an opening; `parts` of `in_bodies`."""
    own, other, base, arm = parts
    if joint.kind == "prismatic":
        return ALONG, padded(*own[2], *arm, own[2] @ base - start)
    return TURN, _turn(own[2], own[0], other[0], start)


def _turn(axis: np.ndarray, zero: np.ndarray, line: np.ndarray, start: float = 0.0) -> np.ndarray:
    """Constants of the angle about an axis of one body, from a line of it to a line of the other, `start` at zero."""
    return padded(*zero, *line, -start, *np.cross(axis, zero))
