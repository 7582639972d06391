"""Interactions of applied loads (`LoadGroup`) and of weight (`GravityGroup`), in the plane and in space."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.case.models.loads import PART, Load
from fsm.interactions.applied import add_applied, add_applied_stiffness, applied_power
from fsm.kernels.body_poses import pose_difference
from fsm.kernels.programs import Program
from fsm.kernels.rotation import rotation_matrix
from fsm.model.bodies.drive import time_function
from fsm.model.bodies.group import BlockSums, BodyPattern, BodyState, Group
from fsm.text.load_names import MOMENT, force_name


@dataclass(frozen=True)
class AppliedLoad:
    """Wrench on one body: body index, point (body axes, m), force (N), moment (N m), follower or dead, function of time.

    The dimension determines the components of vectors: (x, z) and one moment in the plane, three components each in
    space.
    """

    body: int
    point: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    follower: bool
    time: Program
    name: str = ""

    @property
    def full_size(self) -> float:
        """Force (N), or moment (N m) of a load without force, at a factor of 1."""
        return float(np.linalg.norm(self.force) or np.linalg.norm(self.moment))

    @property
    def called(self) -> str:
        """Name in results; it shows whether the load is a moment or a force. Parts of a load have the name of the load."""
        name = self.name.partition(PART)[0]
        return force_name(name) if self.force.any() else name + MOMENT

    def size(self, t: float) -> float:
        """Force (N), or moment (N m) of a load without force."""
        return self.time.at(t)[0] * self.full_size

    def place(self, pose: np.ndarray) -> np.ndarray:
        """Place of the point of the load, m; angles of the body for a moment alone: (phi), or a quaternion in space."""
        if not self.force.any():
            return pose[2:] if len(pose) == 3 else pose[3:]
        rotation = _planar_rotation(pose[2]) if len(pose) == 3 else rotation_matrix(pose[3:])
        return np.asarray(pose[: len(self.point)] + rotation @ self.point)

    def moved(self, start: np.ndarray, pose: np.ndarray) -> float:
        """Displacement of the point along the force (m), or rotation along a moment (rad), between two poses.

        A follower load counts with its direction at the start.
        """
        change = self.place(pose) - self.place(start)
        planar = len(pose) == 3
        turned = np.eye(2 if planar else 3)
        if self.follower:
            turned = _planar_rotation(start[2]) if planar else rotation_matrix(start[3:])
        if self.force.any():
            return float(change @ turned @ self.force) / float(np.linalg.norm(self.force))
        if planar:
            return float(change[0] * np.sign(self.moment[0]))
        turn = pose_difference(start, pose)[3:]  # the vector is in body axes; its length is the same in inertial axes
        return float(rotation_matrix(start[3:]) @ turn @ turned @ self.moment) / float(np.linalg.norm(self.moment))


def applied(load: Load, body: int, spatial: bool) -> AppliedLoad:
    """Arrays of a load on the body with a number."""
    keep = [0, 1, 2] if spatial else [0, 2]
    moment = np.array(load.moment if spatial else (load.moment[1],), dtype=float)
    point, force = np.array(load.point, dtype=float)[keep], np.array(load.force, dtype=float)[keep]
    return AppliedLoad(body, point, force, moment, load.follower, time_function(load.time), load.called)


@dataclass(frozen=True)
class LoadGroup(Group):
    """All applied wrenches. Dead loads keep their direction in space; follower loads rotate with their body."""

    loads: tuple[AppliedLoad, ...]

    def break_times(self) -> set[float]:
        """Times at which a time function is not smooth, s."""
        return {time for load in self.loads for time in load.time.breaks()}

    def peak_times(self) -> set[float]:
        """See `Group`."""
        return {time for load in self.loads for time in load.time.peaks()}

    @cached_property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Arguments of the kernels of `fsm.interactions.applied` between the poses and the factors."""
        loads = self.loads
        point, force, moment = (np.array([getattr(load, name) for load in loads]) for name in ("point", "force", "moment"))
        follower = np.array([load.follower for load in loads], dtype=np.int64)
        return np.array([load.body for load in loads], dtype=np.int64), point, force, moment, follower

    def _factors(self, t: float) -> np.ndarray:
        return np.array([load.time.at(t)[0] for load in self.loads])

    def slots(self, pattern: BodyPattern) -> np.ndarray:
        """Positions of the diagonal blocks of the bodies of all loads; -1 for bodies without degrees of freedom."""
        rows = pattern.dof[self.arrays[0]]
        return np.where(rows < 0, -1, pattern.diagonal[rows])

    def add_force(self, at: BodyState, force: np.ndarray) -> None:
        """See `Group`."""
        if self.loads:
            add_applied(at.poses, *self.arrays, self._factors(at.t), force)

    def add_linearised(self, at: BodyState, sums: BlockSums) -> None:
        """See `Group`."""
        self.add_force(at, sums.force)
        add_applied_stiffness(at.poses, *self.arrays, self._factors(at.t), self.slots(sums.pattern), sums.stiffness)

    def load_displacements(self, start: BodyState, end: BodyState) -> dict[str, tuple[float, float]]:
        """See `Group`; the parts of a load on several vertices or along an edge are one load, whose displacement is the mean
        over the parts, weighted by their sizes. A name that occurs again gets a number.
        """
        parts, occurred = dict[str, list[tuple[float, float, float]]](), Counter[str]()
        for load in self.loads:
            occurred[load.name] += 1
            number = f"#{occurred[load.name]}" if occurred[load.name] > 1 else ""
            part = load.size(end.t), load.moved(start.poses[load.body], end.poses[load.body]), load.full_size
            parts.setdefault(load.called + number, []).append(part)
        found = {}
        for name, of in parts.items():
            size, way, weight = np.array(of).T
            found[name] = float(size.sum()), float(way @ weight / weight.sum()) if weight.any() else float(way.mean())
        return found

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`."""
        add_applied(poses, *self.arrays, np.array([load.time.at(t)[1] for load in self.loads]), force_rate)

    def energy(self, at: BodyState) -> tuple[dict[str, float], float, float]:
        """See `Group`; loads count as input power, not as potential energy."""
        return {}, 0.0, applied_power(at.poses, at.rates, *self.arrays, self._factors(at.t)) if self.loads else 0.0


def _planar_rotation(angle: float) -> np.ndarray:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, sine], [-sine, cosine]])


@dataclass(frozen=True)
class GravityGroup(Group):
    """Weight of every body: `mass` (n_bodies,), `acceleration` (2 or 3,) m/s^2. The energy is zero at the origin."""

    mass: np.ndarray
    acceleration: np.ndarray

    def add_force(self, at: BodyState, force: np.ndarray) -> None:
        """See `Group`."""
        force[:, : len(self.acceleration)] += self.mass[:, None] * self.acceleration

    def add_linearised(self, at: BodyState, sums: BlockSums) -> None:
        """See `Group`; a uniform field has no stiffness."""
        self.add_force(at, sums.force)

    def energy(self, at: BodyState) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        height = at.poses[:, : len(self.acceleration)] @ self.acceleration
        return {"gravity": -float(self.mass @ height)}, 0.0, 0.0
