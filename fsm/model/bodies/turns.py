"""Driven bodies that rotate about fixed axes: poses, rates, and reactions.

A body with the start pose (p0, R0) rotates by the angle w about the axis a through the point c. The body's pose is then

    p = c + R(a, w) (p0 - c),     R = R(a, w) R0

The twist of the body is its motion per unit angular speed: the velocity a x (p - c) and the angular velocity a,
constant in body axes. The moment of the drive is the sum over its bodies of twist times reaction wrench.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from fsm.kernels.rotation import multiply, rotation_matrix
from fsm.model.bodies.drive import Axis, PrescribedMotion


@dataclass(frozen=True)
class _Turning:
    """One turning body: number of its motion, number of the body, axis and centre, arm from the centre to the initial
    position, axis in the body.
    """

    motion: int
    body: int
    axis: np.ndarray
    centre: np.ndarray
    arm: np.ndarray
    own: np.ndarray

    def arm_at(self, angle: float) -> np.ndarray:
        """Arm from the centre after a rotation (formula of Rodrigues)."""
        a, r = self.axis, self.arm
        cosine = math.cos(angle)
        turned = cosine * r + math.sin(angle) * np.cross(a, r) + (1.0 - cosine) * (a @ r) * a
        return np.asarray(turned)


class Turns:
    """All bodies that turn; arrays of poses and rates have 3 columns (plane) or 7 and 6 (space).

    Parameters
    ----------
    bodies : bodies that turn
    start : poses of all bodies before any rotation
    """

    def __init__(self, bodies: Sequence[_Turning], start: np.ndarray) -> None:
        self.bodies, self.start = tuple(bodies), start
        self.spatial = start.shape[1] == 7

    @classmethod
    def of(cls, motions: Sequence[PrescribedMotion], start: np.ndarray) -> Self | None:
        """Turning bodies of the motions; None if there are none."""
        found = []
        for k, motion in enumerate(motions):
            if motion.axis is None:
                continue
            found += [_turning(k, body, motion.axis, start[body]) for body in motion.bodies.tolist()]
        return cls(found, start) if found else None

    def set_poses(self, poses: np.ndarray, angles: np.ndarray) -> None:
        """Write the poses of the turning bodies at rotation angles `angles` (n_motions,), rad, into `poses`."""
        for turning in self.bodies:
            angle = float(angles[turning.motion])
            place = turning.centre + turning.arm_at(angle)
            if self.spatial:
                half = 0.5 * angle
                turn = np.array([math.cos(half), *(math.sin(half) * turning.axis)])
                poses[turning.body, :3] = place
                poses[turning.body, 3:] = multiply(turn, self.start[turning.body, 3:])
            else:
                turned = self.start[turning.body, 2] + turning.axis[1] * angle
                poses[turning.body] = place[0], place[2], turned

    def set_rates(
        self, rates: np.ndarray, angles: np.ndarray, speeds: np.ndarray, earlier: tuple[np.ndarray, float] | None
    ) -> None:
        """Set the rates at angles and angular speeds, or the mean rates since `earlier` (angles, and elapsed time in s)."""
        for turning in self.bodies:
            k = turning.motion
            arm = turning.arm_at(float(angles[k]))
            if earlier is None:
                velocity = speeds[k] * np.cross(turning.axis, arm)
            else:
                velocity = (arm - turning.arm_at(float(earlier[0][k]))) / earlier[1]
            rates[turning.body] = self._row(velocity, speeds[k] * turning.own)

    def twists(self, angles: np.ndarray) -> Iterator[tuple[int, int, np.ndarray]]:
        """Motion, body, and rates per unit angular speed, of every body."""
        for turning in self.bodies:
            velocity = np.cross(turning.axis, turning.arm_at(float(angles[turning.motion])))
            yield turning.motion, turning.body, self._row(velocity, turning.own)

    def add_inertial(self, reactions: np.ndarray, inertia: np.ndarray, states: np.ndarray) -> None:
        """Add the forces that accelerate the bodies; `states` are angle, speed and acceleration of every motion, (n_motions,
        3).
        """
        for turning in self.bodies:
            angle, speed, acceleration = states[turning.motion].tolist()
            arm = turning.arm_at(angle)
            across = np.cross(turning.axis, arm)
            change = acceleration * across + speed**2 * np.cross(turning.axis, across)
            reactions[turning.body] += inertia[turning.body] * self._row(change, acceleration * turning.own)

    def kinetic(self, inertia: np.ndarray, rates: np.ndarray) -> float:
        """Kinetic energy of the rotation of all bodies, J."""
        first = 3 if self.spatial else 2
        rows = [turning.body for turning in self.bodies]
        return 0.5 * float((inertia[rows, first:] * rates[rows, first:] ** 2).sum())

    def _row(self, velocity: np.ndarray, spin: np.ndarray) -> np.ndarray:
        if self.spatial:
            return np.concatenate([velocity, spin])
        return np.array([velocity[0], velocity[2], spin[1]])


def _turning(motion: int, body: int, axis: Axis, pose: np.ndarray) -> _Turning:
    spatial = len(pose) == 7
    place = pose[:3] if spatial else np.array([pose[0], 0.0, pose[1]])
    own = rotation_matrix(pose[3:]).T @ axis.direction if spatial else axis.direction
    arm = place - axis.point
    if not spatial:
        arm = arm * np.array([1.0, 0.0, 1.0])
    return _Turning(motion, body, axis.direction, place - arm, arm, np.asarray(own))


def turned_pose(pose: np.ndarray, axis: Axis, angle: float) -> np.ndarray:
    """Pose (3 or 7,) of a body after a rotation (rad) about an axis."""
    poses = pose[None].copy()
    Turns([_turning(0, 0, axis, pose)], pose[None]).set_poses(poses, np.array([angle]))
    return np.asarray(poses[0])
