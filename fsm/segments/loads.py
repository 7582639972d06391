"""Groups of applied wrenches and of gravity, in the plane and in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.kernels.body_poses import pose_difference
from fsm.kernels.rotation import rotation_matrix
from fsm.scene.loads import Constant, Load, TimeFunction
from fsm.segments.group import Group, PreviousPoses
from fsm.segments.pattern import BodyPattern
from fsm.segments.time_function import breaks, factor, slope

__all__ = ["AppliedLoad", "GravityGroup", "LoadGroup", "applied"]

_TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])


@dataclass(frozen=True)
class AppliedLoad:
    """Wrench on one body: body index, point (body axes, m), force (N), moment (N m), follower or dead, function of time.

    Vectors have the components of the dimension: (x, z) and one moment in the plane, three each in space.
    """

    body: int
    point: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    follower: bool
    time: TimeFunction
    name: str = ""

    def size(self, t: float) -> float:
        """Force (N), or moment (N m) of a load without force."""
        return factor(self.time, t) * float(np.linalg.norm(self.force) or np.linalg.norm(self.moment))

    def place(self, pose: np.ndarray) -> np.ndarray:
        """Place of the point of the load, m; angles of the body for a moment alone: (phi), or a quaternion in space."""
        if not self.force.any():
            return pose[2:] if len(pose) == 3 else pose[3:]
        rotation = _planar_rotation(pose[2]) if len(pose) == 3 else rotation_matrix(pose[3:])
        return np.asarray(pose[: len(self.point)] + rotation @ self.point)

    def moved(self, start: np.ndarray, pose: np.ndarray) -> float:
        """Displacement of the point along the force (m), or rotation along a moment (rad), between two poses."""
        change = self.place(pose) - self.place(start)
        if self.force.any():
            return float(change @ self.force) / float(np.linalg.norm(self.force))
        if len(pose) == 3:
            return float(change[0] * np.sign(self.moment[0]))
        turn = pose_difference(start, pose)[3:]  # in body axes, as long as in inertial ones
        return float(rotation_matrix(start[3:]) @ turn @ self.moment) / float(np.linalg.norm(self.moment))


def applied(load: Load, body: int, spatial: bool) -> AppliedLoad:
    """Arrays of a load on the body with a number."""
    keep = [0, 1, 2] if spatial else [0, 2]
    moment = np.array(load.moment if spatial else (load.moment[1],), dtype=float)
    point, force = np.array(load.point, dtype=float)[keep], np.array(load.force, dtype=float)[keep]
    return AppliedLoad(body, point, force, moment, load.follower, load.time or Constant(), load.called)


@dataclass(frozen=True)
class LoadGroup(Group):
    """All applied wrenches. Dead loads keep their direction in space; follower loads rotate with their body."""

    loads: tuple[AppliedLoad, ...]

    def break_times(self) -> set[float]:
        """Times at which a time function is not smooth, s."""
        return {time for load in self.loads for time in breaks(load.time)}

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        for load in self.loads:
            force[load.body] += factor(load.time, t) * _wrench(load, poses[load.body])

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: PreviousPoses | None = None,
    ) -> None:
        """See `Group`."""
        self.add_force(t, poses, rates, force)
        for load in self.loads:
            row = pattern.dof[load.body]
            if row < 0:
                continue
            start, end = pattern.indptr[row], pattern.indptr[row + 1]
            slot = start + int(np.searchsorted(pattern.indices[start:end], row))
            stiffness[slot] += factor(load.time, t) * _wrench_stiffness(load, poses[load.body])

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`."""
        for load in self.loads:
            force_rate[load.body] += slope(load.time, t) * _wrench(load, poses[load.body])

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`; loads count as input power, not as potential energy."""
        power = sum(
            factor(load.time, t) * float(_wrench(load, poses[load.body]) @ rates[load.body]) for load in self.loads
        )
        return {}, 0.0, power


def _wrench(load: AppliedLoad, pose: np.ndarray) -> np.ndarray:
    """Generalised force on one body: force in inertial axes, moment about y (plane) or in body axes (space)."""
    if len(pose) == 3:
        rotation = _planar_rotation(pose[2])
        push = rotation @ load.force if load.follower else load.force
        arm = rotation @ load.point
        return np.array([push[0], push[1], push @ _TURN @ arm + load.moment[0]])
    rotation = rotation_matrix(pose[3:])
    if load.follower:
        return np.concatenate([rotation @ load.force, np.cross(load.point, load.force) + load.moment])
    turned = rotation.T @ load.force
    return np.concatenate([load.force, np.cross(load.point, turned) + rotation.T @ load.moment])


def _wrench_stiffness(load: AppliedLoad, pose: np.ndarray) -> np.ndarray:
    """-d(wrench)/dx of one body."""
    if len(pose) == 3:
        block = np.zeros((3, 3))
        rotation = _planar_rotation(pose[2])
        if load.follower:
            block[:2, 2] = -_TURN @ rotation @ load.force
        else:
            block[2, 2] = load.force @ rotation @ load.point
        return block
    block = np.zeros((6, 6))
    rotation = rotation_matrix(pose[3:])
    for j, axis in enumerate(np.eye(3)):
        if load.follower:
            block[:3, 3 + j] = -rotation @ np.cross(axis, load.force)
        else:
            block[3:, 3 + j] = np.cross(load.point, np.cross(axis, rotation.T @ load.force)) + np.cross(
                axis, rotation.T @ load.moment
            )
    return block


def _planar_rotation(angle: float) -> np.ndarray:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, sine], [-sine, cosine]])


@dataclass(frozen=True)
class GravityGroup(Group):
    """Weight of every body: `mass` (n_bodies,), `acceleration` (2 or 3,) m/s^2. Its energy is zero at the origin."""

    mass: np.ndarray
    acceleration: np.ndarray

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        force[:, : len(self.acceleration)] += self.mass[:, None] * self.acceleration

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: PreviousPoses | None = None,
    ) -> None:
        """See `Group`; a uniform field has no stiffness."""
        self.add_force(t, poses, rates, force)

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        height = poses[:, : len(self.acceleration)] @ self.acceleration
        return {"gravity": -float(self.mass @ height)}, 0.0, 0.0
