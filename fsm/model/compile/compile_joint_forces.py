"""Laws on the coordinates of joints, and springs between two points, as rows of a `JointForceGroup`."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise

import numpy as np

from fsm.case.derived.rebound import rebound
from fsm.case.models.joint import SceneJoint
from fsm.case.models.joint_action import (
    LEAST_RATE,
    Friction,
    Latch,
    SlideSpring,
    Spring,
    Stop,
    TurnFriction,
    TurnSpring,
)
from fsm.case.models.joint_motor import Motor
from fsm.case.models.materials import Crease, LinearCrease
from fsm.case.models.scene import Scene
from fsm.case.models.spring import ONLY, SceneCord, SceneSpring
from fsm.interactions.openings import ALONG, CONSTANTS, LENGTH
from fsm.kernels.programs import Program
from fsm.kernels.rotation import rotation_matrix
from fsm.laws.crease import MomentCurve
from fsm.model.bodies.drive import time_function
from fsm.model.compile.compile_contacts import Compiled
from fsm.model.compile.compile_joints import coordinate_of, in_bodies, padded
from fsm.model.elements import joint_laws as column
from fsm.model.elements.cords import CordGroup
from fsm.model.elements.crease_curves import curve_of, hysteresis_of, reversal_of
from fsm.model.elements.element_angles import side_of
from fsm.model.elements.joint_forces import JointForceGroup
from fsm.model.elements.joints import JointGroup

_PRESLIDING = {True: 1e-3, False: 1e-5}
"""Deflection of sliding bristles, rad or m."""
_BRISTLE_TIME = 0.01
"""Time of this deflection at the rate below which bristles damp, s."""
_LAWS = ("spring", "damper", "friction", "stop", "latch", "harness", "motor")
"""Fields of a joint that give its laws."""
_BESIDE_LAWS = ("kinds", "lines", "first", "rows", "start", "programs")
"""Arrays of a group besides its laws."""
_GOVERNS = 0.01
"""Part of the largest commanded rate of a limited motor over which its governor lets through less than the whole torque."""


class _Row:
    """One coordinate: its parameters, tables and programs."""

    def __init__(self, name: str, ends: np.ndarray, kind: int, line: np.ndarray, start: float, turning: bool) -> None:
        self.name, self.ends, self.kind, self.line, self.start, self.turning = name, ends, kind, line, start, turning
        self.law, self.tables = np.zeros(column.COLUMNS), [np.zeros((0, 3)) for _ in range(column.TABLES)]
        self.programs: dict[int, Program] = {}
        self.felt = (0, 0)
        self.law[[column.UPPER, column.SLOWER, column.OPENS_AT]] = math.inf
        self.law[column.LOWER], self.law[column.RATIO] = -math.inf, 1.0
        self.law[column.REST], self.law[column.SLOWEST] = start, LEAST_RATE[turning]

    def table(self, which: int, rows: Sequence[Sequence[float]] | np.ndarray | None) -> None:
        """Set a table, straight between rows (coordinate, effort), or cubic between rows (coordinate, effort, slope)."""
        given = [(*row, math.nan)[:3] for row in (() if rows is None else rows)]
        self.tables[which] = np.array(given, dtype=float).reshape(-1, 3)

    def spring(self, spring: Spring) -> None:
        """Set the spring of a joint."""
        if not isinstance(spring, TurnSpring | SlideSpring):
            self.crease(spring)
            return
        load = spring.moment if isinstance(spring, TurnSpring) else spring.force
        self.law[column.SPRING], self.law[column.LOAD] = spring.stiffness, load or 0.0
        self.law[column.REST] = self.start if spring.rest is None else spring.rest
        self.table(column.OF_SPRING, spring.table)

    def crease(self, crease: Crease) -> None:
        """Set the law of a crease: its opening is that from its rest angle towards zero."""
        side = side_of(self.start, crease.rest_angle or 0.0)
        rest = side * self.start if crease.rest_angle is None else crease.rest_angle
        if isinstance(crease, LinearCrease):
            self.law[column.SPRING], self.law[column.REST] = crease.stiffness, side * rest
            return
        curve, hysteresis = curve_of(crease), hysteresis_of(crease)
        self.table(column.OF_SPRING, _over_angle(curve, rest, side, -side))
        if hysteresis is not None:
            self.law[column.SPRING_SLIDER] = 0.5 * reversal_of(crease)
            self.law[column.SPRING_BEGINS] = -side  # on the loading curve
            self.table(column.OF_SPRING_WIDTH, _over_angle(hysteresis.strength, rest, side, 1.0))

    def stop(self, stop: Stop) -> None:
        """Set both stops."""
        self.law[column.STOP], self.law[column.STOP_DAMPER] = stop.stiffness, stop.damping
        self.law[column.LOWER] = -math.inf if stop.lower is None else stop.lower
        self.law[column.UPPER] = math.inf if stop.upper is None else stop.upper
        self.law[column.REBOUND] = 0.0 if stop.restitution is None else rebound(stop.restitution)

    def latch(self, latch: Latch) -> None:
        """Set the latch."""
        law = self.law
        law[column.LATCH_AT], law[column.PLAY] = latch.at, latch.play
        law[column.LATCH_SENSE] = math.copysign(1.0, latch.at - self.start)
        law[column.LATCH], law[column.LATCH_DAMPER] = latch.stiffness, latch.damping
        law[column.SLOWER] = math.inf if latch.rate_below is None else latch.rate_below
        law[column.OPENS_AT] = math.inf if latch.opens_at is None else latch.opens_at

    def friction(self, friction: Friction, felt: tuple[int, int]) -> None:
        """Set friction; `felt` is the first and the last multiplier of the reaction."""
        if isinstance(friction, TurnFriction):
            size, arm = friction.moment, friction.radius or 0.0
        else:
            size, arm = friction.force, 1.0
        self.law[column.FRICTION], self.law[column.SLIP_RATE] = size or 0.0, friction.slip_rate or LEAST_RATE[self.turning]
        if friction.coefficient is not None:
            self.law[column.FOLLOWS], self.felt = friction.coefficient * arm, felt
        if friction.law == "lugre":
            self.law[column.PRESLIDING] = friction.presliding or _PRESLIDING[self.turning]
            self.law[column.SLIP_RATE] = friction.slip_rate or self.law[column.PRESLIDING] / _BRISTLE_TIME

    def harness(self, rows: Sequence[tuple[float, float, float]], reversal: float) -> None:
        """Set the harness."""
        self.law[column.SLIDER] = reversal
        self.table(column.OF_HARNESS, [(c, 0.5 * (a + b)) for c, a, b in rows])
        self.table(column.OF_WIDTH, [(c, 0.5 * (a - b)) for c, a, b in rows])

    def motor(self, motor: Motor) -> None:
        """Set a motor that gives a moment or a force."""
        self.law[column.RATIO], self.law[column.WHEEL] = motor.ratio, float(motor.free_wheel)
        if motor.effort is not None:
            self.law[column.MOTOR] = column.TORQUE
            self.programs[column.PUSH] = time_function(motor.time).scaled(motor.effort)
            return
        self.table(column.OF_MOTOR, motor.curve)
        self.law[column.MOTOR] = column.CURVE
        if motor.speed is not None:
            program = time_function(motor.time).scaled(motor.speed)
            self.law[column.MOTOR], self.programs[column.PUSH] = column.GOVERNED, program
            largest = max((abs(program.at(t)[0]) for t in (0.0, *program.peaks())), default=0.0)
            self.law[column.BAND] = _GOVERNS * (largest or abs(motor.speed))


def joint_forces(
    joints: Sequence[SceneJoint], ends: np.ndarray, springs: Sequence[SceneSpring], spring_ends: np.ndarray,
    poses: np.ndarray, locked: JointGroup | None, changed: Collection[str] = (),
) -> JointForceGroup | None:  # fmt: skip
    """Laws of all joints and springs; None without any.

    Parameters
    ----------
    joints, springs : joints and springs without faults
    ends, spring_ends : (m, 2) int arrays
        First and second body of each.
    poses : (n_bodies, 7) array
        Poses at the start.
    locked : openings of all joints, of which friction depends
    changed : names of joints whose laws an event changes
    """
    acting = [(number, joint) for number, joint in enumerate(joints) if _acts(joint) or joint.name in changed]
    rows = [_of_joint(joint, number, ends[number], poses, locked) for number, joint in acting]
    rows += [_of_spring(spring, both, poses) for spring, both in zip(springs, spring_ends, strict=True)]
    if not rows:
        return None
    tables = [table for row in rows for table in row.tables]
    first = np.concatenate([[0], np.cumsum([len(table) for table in tables])]).astype(np.int64)
    functions: list[Program] = []
    programs = np.full((len(rows), 2), -1, dtype=np.int64)
    for i, row in enumerate(rows):
        for which, program in row.programs.items():
            programs[i, which] = len(functions)
            functions.append(program)
    return JointForceGroup(
        np.array([row.ends for row in rows], dtype=np.int64), np.array([row.kind for row in rows], dtype=np.int64),
        np.array([row.line for row in rows]), np.array([row.law for row in rows]), first, np.concatenate(tables),
        np.array([row.start for row in rows]), tuple(row.name for row in rows), programs, tuple(functions),
        np.zeros(1) if locked is None else locked.felt, np.array([row.felt for row in rows], dtype=np.int64),
        bool(changed),
    )  # fmt: skip


def laws_of_joints(scene: Scene, like: Compiled) -> np.ndarray | None:
    """Laws of joints (m, `COLUMNS`) of a scene that differs from another one in nothing else; else None."""
    system, own = like.system, like.scene
    group = next((group for group in system.groups if isinstance(group, JointForceGroup)), None)
    others = [name for name in Scene.model_fields if name != "joints"]
    if group is None or any(getattr(scene, name) != getattr(own, name) for name in others):
        return None
    if len(scene.joints) != len(own.joints) or any(
        joint.model_copy(update={name: getattr(of_own, name) for name in _LAWS}) != of_own
        for joint, of_own in zip(scene.joints, own.joints, strict=True)
    ):
        return None
    index = {name: number for number, name in enumerate(system.bodies.names)}
    ends, of_springs = (
        np.array([[index[one.first], index[one.second]] for one in each], dtype=np.int64).reshape(-1, 2)
        for each in (scene.joints, scene.springs)
    )
    locked = next((group for group in system.groups if isinstance(group, JointGroup)), None)
    found = joint_forces(scene.joints, ends, scene.springs, of_springs, system.bodies.pose, locked)
    if found is None or (found.names, found.functions) != (group.names, group.functions):
        return None
    pairs = [(getattr(found, name), getattr(group, name)) for name in _BESIDE_LAWS]
    return found.laws if all(np.array_equal(*pair) for pair in pairs) else None


def cord_groups(cords: Sequence[SceneCord], index: Mapping[str, int], poses: np.ndarray) -> list[CordGroup]:
    """Cords with the same number of points each; bodies by name, and their poses (n_bodies, 7) at the start."""
    found = []
    for count in sorted({len(cord.way) for cord in cords}):
        own = [cord for cord in cords if len(cord.way) == count]
        bodies = np.array([[index[name] for name, _ in cord.way] for cord in own], dtype=np.int64)
        lines, across = [], []
        for cord, row in zip(own, bodies, strict=True):
            points = [_on(poses[body], place) for body, (_, place) in zip(row, cord.way, strict=True)]
            lines += [padded(*a, *b) for a, b in pairwise(points)]
            across += [padded(*a, *b) for a, b in zip(points, points[2:], strict=False)]
        laws = np.array([(cord.stiffness, cord.damping, cord.slip_speed) for cord in own])
        pulleys = np.array([[pulley.friction for pulley in cord.over] for cord in own]).reshape(len(own), -1)
        found.append(CordGroup(
            bodies, np.array(lines), np.array(across).reshape(-1, CONSTANTS), pulleys, laws, tuple(map(_free_length, own)),
            tuple(cord.name for cord in own),
        ))  # fmt: skip
    return found


def _over_angle(curve: MomentCurve, rest: float, side: float, sign: float) -> list[tuple[float, float, float]]:
    """Rows (angle, effort, slope) of a curve over openings, rest - side angle; `sign` is a factor on the moment."""
    found = []
    for opening in curve.knots.tolist():
        _, moment, slope = curve(opening)
        found.append((side * (rest - opening), sign * moment, -side * sign * slope))
    return sorted(found)


def _free_length(cord: SceneCord) -> Program:
    program = time_function(cord.time).scaled(cord.reel)
    return Program(tuple(p._replace(powers=(p.powers[0] + cord.free, *p.powers[1:])) for p in program.pieces))


def _on(pose: np.ndarray, place: Sequence[float]) -> np.ndarray:
    """Place in the axes of a body of a pose (7,)."""
    return np.asarray((np.array(place) - pose[:3]) @ rotation_matrix(pose[3:]))


def _acts(joint: SceneJoint) -> bool:
    laws = joint.spring, joint.damper, joint.friction, joint.stop, joint.latch, joint.harness
    return any(laws) or (joint.motor is not None and not joint.motor.prescribes)


def _of_joint(joint: SceneJoint, number: int, ends: np.ndarray, poses: np.ndarray, locked: JointGroup | None) -> _Row:
    kind, line = coordinate_of(joint, joint.angle, in_bodies(joint, *poses[ends]))
    row = _Row(f"joint.{joint.name}", ends, kind, line, joint.angle, joint.kind != "prismatic")
    if joint.spring is not None:
        row.spring(joint.spring)
    if joint.damper is not None:
        row.law[column.DAMPER] = joint.damper.coefficient or 0.0
        row.table(column.OF_DAMPER, joint.damper.table)
    if joint.stop is not None:
        row.stop(joint.stop)
    if joint.latch is not None:
        row.latch(joint.latch)
    if joint.friction is not None:
        assert locked is not None
        own = np.flatnonzero((locked.of == number) & (locked.kinds == ALONG) & (locked.program < 0) & (locked.active > 0.0))
        row.friction(joint.friction, (int(own[0]), int(own[-1]) + 1))
    if joint.harness is not None:
        row.harness(joint.harness.rows, joint.harness.reversal)
    if joint.motor is not None and not joint.motor.prescribes:
        row.motor(joint.motor)
    return row


def _of_spring(spring: SceneSpring, ends: np.ndarray, poses: np.ndarray) -> _Row:
    points = [_on(pose, point) for point, pose in zip((spring.at, spring.to), poses[ends], strict=True)]
    row = _Row(f"spring.{spring.name}", ends, LENGTH, padded(*points[0], *points[1]), spring.length, False)
    law = row.law
    law[column.REST] = law[column.TABLE_AT] = spring.free
    row.table(column.OF_SPRING, spring.rows)
    if spring.only is None:
        law[column.SPRING], law[column.LOAD] = spring.stiffness, spring.force
    else:
        law[column.SIDE] = ONLY[spring.only]
    if spring.damper is not None:
        law[column.DAMPER] = spring.damper.coefficient or 0.0
        row.table(column.OF_DAMPER, spring.damper.table)
    if spring.gas is not None:
        gas = spring.gas
        law[column.GAS_AT] = spring.length if gas.length is None else gas.length
        law[column.GAS], law[column.COLUMN], law[column.EXPONENT] = gas.force, gas.column, gas.exponent
    return row
