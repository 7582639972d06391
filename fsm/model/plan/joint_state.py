"""Ideal joints at the start: degrees of freedom, repeated directions, and the velocities that the joints allow.

No kernel is needed, so that `fsm check` has these numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise

import numpy as np

from fsm.case.derived.frame_bodies import quaternion_matrix
from fsm.case.derived.joint_frames import LOCKED_PLACES, LOCKED_TURNS, joint_axes
from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import GROUND, Scene
from fsm.errors import Fault
from fsm.kernels.programs import Program
from fsm.model.bodies.drive import motor_program, program_of, unit
from fsm.text.shown_units import shown

REPEATS = 1e-9
"""Part of a direction, relative to its size, that does not follow from those before it, below which it repeats them."""
_OPENS = 1e-9
"""Rate of an opening, relative to the speeds of its bodies, above which it opens."""
MOST_FOLLOWED = 40_000
"""Largest product of locked directions and records up to which branch points are looked for, in some seconds."""
_SOON = 1e-12
"""Time relative to the end of a motion at which its first speed is taken."""


def _first_speed(program: Program) -> float:
    """Speed of a motor right after the start; zero if it begins at rest."""
    ends = [0.0, *program.breaks()]
    speed = program.at(_SOON * max(ends))[1]
    usual = max((abs(program.at(0.5 * (a + b))[1]) for a, b in pairwise(ends)), default=0.0)
    return 0.0 if abs(speed) <= _OPENS * usual else speed


class JointsAtStart:
    """Locked directions of all joints of a scene without faults, at the start.

    Rates of a body are its velocity and its angular velocity, both in inertial axes.

    Attributes
    ----------
    labels : names of the locked directions
    rows : (n, 6 n_bodies) array
        Rates of openings from the rates of all bodies, the ground without columns.
    rates : (n,) array
        Rates of openings that motors prescribe, else zero.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.index = {body.name: i for i, body in enumerate(scene.bodies)}
        driven = {name for drive in scene.drives for name in drive.moved}
        self.free = np.array([not (body.held or body.name in driven) for body in scene.bodies], dtype=bool)
        self.turned = [quaternion_matrix(body.orientation) for body in scene.bodies]
        self.labels: list[str] = []
        self.wanted: list[tuple[int, float]] = []
        rows = [row for joint in scene.joints for row in self._rows(joint)]
        joints = {joint.name: joint for joint in scene.joints}
        for coupling in scene.couplings:
            if coupling.ideal:
                self.labels.append(f"coupling {coupling.name}")
                parts = zip(coupling.ratios, coupling.joints, strict=True)
                rows.append(np.sum([ratio * self.coordinate(joints[name]) for ratio, name in parts], axis=0))
        self.rows, self.rates = np.array(rows).reshape(len(rows), 6 * len(scene.bodies)), np.zeros(len(rows))
        for row, rate in self.wanted:
            self.rates[row] = rate

    def _rows(self, joint: SceneJoint) -> Iterator[np.ndarray]:
        at, axes = np.array(joint.at), joint_axes(joint)
        to = at if joint.to is None else np.array(joint.to)
        first, second = self.arm(joint.first, to), self.arm(joint.second, to)
        if joint.kind == "distance":
            line = (to - at) / np.linalg.norm(to - at)
            base = np.cross(line, self.arm(joint.first, at))
            yield self._row(joint, "distance", -line, base, line, np.cross(second, line))
        yield from self._locked(joint, axes, first, second)
        if joint.pitch is not None:
            lead, along = joint.pitch / (2.0 * math.pi), axes[2]
            turned = np.cross(along, first) + lead * along, np.cross(second, along) - lead * along
            yield self._row(joint, "screw", -along, turned[0], along, turned[1])
        if joint.motor is not None and joint.motor.prescribes:
            program = motor_program(joint.motor)
            self.wanted.append((len(self.labels), _first_speed(program)))
            self.labels.append(f"{joint.name} (motor)")
            yield self.coordinate(joint)

    def coordinate(self, joint: SceneJoint) -> np.ndarray:
        """Rate of the coordinate of a joint that turns or slides."""
        at, along, none = np.array(joint.at), joint_axes(joint)[2], np.zeros(3)
        if joint.kind == "prismatic":
            first, second = self.arm(joint.first, at), self.arm(joint.second, at)
            return self.between(joint.first, joint.second, -along, np.cross(along, first), along, np.cross(second, along))
        return self.between(joint.first, joint.second, none, -along, none, along)

    def _locked(
        self, joint: SceneJoint, axes: np.ndarray, first: np.ndarray, second: np.ndarray
    ) -> Iterator[np.ndarray]:
        none = np.zeros(3)
        for k in LOCKED_PLACES[joint.kind]:
            along = axes[k]
            yield self._row(joint, f"along e{k + 1}", -along, np.cross(along, first), along, np.cross(second, along))
        for j, k in LOCKED_TURNS.get(joint.kind, ()):
            about = np.cross(axes[j], axes[k])
            yield self._row(joint, f"about e{4 - j - k}", none, about, none, -about)

    def arm(self, name: str, point: np.ndarray) -> np.ndarray:
        """Vector from the centre of mass of a body to a point."""
        return point if name == GROUND else point - np.array(self.scene.bodies[self.index[name]].position)

    def _row(self, joint: SceneJoint, label: str, *parts: np.ndarray) -> np.ndarray:
        self.labels.append(f"{joint.name} ({label})")
        return self.between(joint.first, joint.second, *parts)

    def between(self, first: str, second: str, *parts: np.ndarray) -> np.ndarray:
        """Row of rates from velocity and angular velocity of the first body, then of the second."""
        row = np.zeros((len(self.index), 6))
        for name, part in ((first, np.concatenate(parts[:2])), (second, np.concatenate(parts[2:]))):
            if name != GROUND:
                row[self.index[name]] += part
        return row.ravel()

    @cached_property
    def roots(self) -> np.ndarray:
        """Matrix (6 n_bodies, 6 n_free) from coordinates whose squares are twice the kinetic energy to rates."""
        found = np.zeros((6 * len(self.free), 6 * int(self.free.sum())))
        for column, i in enumerate(np.flatnonzero(self.free).tolist()):
            body, k = self.scene.bodies[i], 6 * column
            found[6 * i : 6 * i + 3, k : k + 3] = np.eye(3) / np.sqrt(body.mass)
            found[6 * i + 3 : 6 * i + 6, k + 3 : k + 6] = self.turned[i] / np.sqrt(np.array(body.inertia))
        return found

    @cached_property
    def scaled(self) -> np.ndarray:
        """Rows in the coordinates of the kinetic energy, each of length 1."""
        rows = self.rows @ self.roots
        sizes = np.linalg.norm(rows, axis=1, keepdims=True)
        return np.asarray(rows / np.where(sizes > 0.0, sizes, 1.0))

    @cached_property
    def repeated(self) -> list[str]:
        """Names of the locked directions that follow from those before them."""
        basis, found = np.zeros((0, self.scaled.shape[1])), []
        for label, row in zip(self.labels, self.scaled, strict=True):
            left = row - basis.T @ (basis @ row)
            left -= basis.T @ (basis @ left)
            size = float(np.linalg.norm(left))
            if size <= REPEATS:
                found.append(label)
            else:
                basis = np.vstack([basis, left / size])
        return found

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom of all free bodies, less the locked directions that do not repeat others."""
        return 6 * int(self.free.sum()) - (len(self.labels) - len(self.repeated))

    # velocities -------------------------------------------------------------------------------------------------------

    @cached_property
    def _rates(self) -> np.ndarray:
        """Rates (6 n_bodies,) of all bodies at the start as given, those of driven bodies right after it."""
        rates = np.zeros((len(self.free), 6))
        for i, body in enumerate(self.scene.bodies):
            if self.free[i]:
                rates[i, :3], rates[i, 3:] = body.velocity, self.turned[i] @ np.array(body.angular_velocity)
        for number, drive in enumerate(self.scene.drives):
            program = program_of(drive, f"drive.{number}")
            speed = program.at(_SOON * program.end_time)[1]
            for name in drive.moved:
                row, body = rates[self.index[name]], self.scene.bodies[self.index[name]]
                if drive.turn is None:
                    row[:3] = speed * np.array(drive.direction) / np.linalg.norm(drive.direction)
                else:
                    point = self.scene.bodies[self.index[drive.moved[0]]].position if drive.point is None else drive.point
                    row[3:] = speed * unit(drive.axis)
                    row[:3] = np.cross(row[3:], np.subtract(body.position, point))
        return rates.ravel()

    @cached_property
    def _change(self) -> np.ndarray:
        """Change (6 n_bodies,) of the rates to the nearest ones, in the norm of the kinetic energy, that open no joint."""
        found = np.linalg.lstsq(self.rows @ self.roots, self.rates - self.rows @ self._rates, rcond=REPEATS)[0]
        return np.asarray(self.roots @ found)

    def velocity_faults(self) -> Iterator[Fault]:
        """Joints that prescribed motions open at the start."""
        rates = self._rates + self._change
        left, sizes = np.abs(self.rows @ rates - self.rates), np.abs(self.rows) @ np.abs(rates)
        if left.size and np.any(left > _OPENS * sizes.max()):
            worst = self.labels[int(np.argmax(left))]
            text = f"the prescribed motions open joint {worst} at the start, and no free body can follow; change a drive"
            yield Fault("scene.joints", f"{text}, or remove this joint")

    def velocity_warnings(self) -> Iterator[str]:
        """Initial velocities that the joints do not allow, and their largest change."""
        change = np.abs(self._change.reshape(-1, 6))
        if change.max(initial=0.0) <= _OPENS * np.abs(self._rates + self._change).max(initial=0.0):
            return
        names = [body.name for body in self.scene.bodies]
        changes = np.linalg.norm(self._change.reshape(-1, 2, 3), axis=2)
        sizes = (changes[:, 0], "m/s"), (changes[:, 1], "rad/s")
        largest = [f"{names[int(np.argmax(size))]} by {shown(float(size.max()), what)}" for size, what in sizes]
        yield (
            "the initial velocities open the joints, and became the nearest ones that do not; the largest changes are "
            f"those of {' and of '.join(largest)}"
        )

    def closed(self) -> Scene:
        """Scene whose free bodies have the nearest velocities that open no joint."""
        bodies = []
        for i, body in enumerate(self.scene.bodies):
            velocity, spin = np.split((self._rates + self._change)[6 * i : 6 * i + 6], 2)
            moving = {"velocity": tuple(velocity.tolist()), "angular_velocity": tuple((spin @ self.turned[i]).tolist())}
            bodies.append(body.model_copy(update=moving) if self.free[i] else body)
        return self.scene.model_copy(update={"bodies": tuple(bodies)})
