"""Available and required moments of joints by ECSS-E-ST-33-01C Rev. 2 (1 March 2019, ecss.nl), 4.7.5.3.

    required = m (f_I I + f_S S + f_M Hm + f_F Fr + f_Y Hy + f_A Ha + f_D Hd) + f_T Td + Tl

with inertia I, springs S that resist, magnetic losses Hm, friction Fr, hysteresis Hy, harness Ha, adhesion Hd, specified
inertial moment Td and moment to deliver Tl, and the factors of the case. Dampers are left out: they slow a motion and do
not prevent it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np

from fsm.case.models.joint import SceneJoint
from fsm.case.models.joint_action import TurnFriction, TurnHarness, TurnSpring
from fsm.case.models.margin import Margin
from fsm.case.models.materials import LinearCrease, SplineCrease
from fsm.errors import Fault

_POINTS = 91
"""Angles of a curve from the start to the end of travel."""


class JointMargin(NamedTuple):
    """A joint with what is asked of it."""

    joint: SceneJoint
    asked: Margin

    @property
    def end(self) -> float:
        """Angle at the end of travel, rad."""
        joint, motor = self.joint, self.joint.motor
        if self.asked.end is not None:
            return self.asked.end
        if joint.latch is not None:
            return joint.latch.at
        turn = getattr(motor, "angle", None)
        return joint.angle + turn if turn else 0.0

    @property
    def angles(self) -> np.ndarray:
        """Angles from the start to the end of travel, rad."""
        return np.linspace(self.joint.angle, self.end, _POINTS)

    def moments(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Available and required moment at angles, N m."""
        asked, f, sense = self.asked, self.asked.factors, float(np.sign(self.end - self.joint.angle))
        driving = sense * spring_moment(self.joint, angle, sense)
        harness = asked.harness + (_interpolated(asked.harness_table, angle) if asked.harness_table else 0.0)
        harness = harness + np.maximum(sense * harness_moment(self.joint, angle, sense), 0.0)
        own = self.joint.friction
        friction = asked.friction + (own.moment or 0.0 if isinstance(own, TurnFriction) else 0.0)
        parts = (
            f.inertia * asked.inertia + f.spring * np.maximum(-driving, 0.0) + f.motor * asked.motor_losses
            + f.friction * friction + f.hysteresis * asked.hysteresis + f.harness * harness
            + f.adhesion * asked.adhesion
        )  # fmt: skip
        required = f.motorisation * parts + f.dynamic * asked.dynamic + asked.deliverable
        return np.maximum(driving, 0.0) + asked.actuator, np.asarray(required)

    def available(self, angle: np.ndarray) -> np.ndarray:
        """Available moment at angles, N m."""
        return self.moments(angle)[0]

    def required(self, angle: np.ndarray) -> np.ndarray:
        """Required moment at angles, N m."""
        return self.moments(angle)[1]

    def margin(self, angle: np.ndarray) -> np.ndarray:
        """Available over required moment, less 1; infinite where nothing is required."""
        available, required = self.moments(angle)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(required > 0.0, available / required, np.inf) - 1.0)


def spring_moment(joint: SceneJoint, angle: np.ndarray, sense: float) -> np.ndarray:
    """Moment of the spring of a joint on its second body, positive in the sense of the angle, N m, while the angle moves in
    a sense; the curve of a crease is straight between its points.
    """
    spring = joint.spring
    if isinstance(spring, LinearCrease | SplineCrease):
        return _crease_moment(spring, joint.angle, angle, sense)
    if not isinstance(spring, TurnSpring):
        return np.zeros_like(angle)
    rest = joint.angle if spring.rest is None else spring.rest
    moment = -(spring.moment or 0.0) - spring.stiffness * (angle - rest)
    return np.asarray(moment - (_interpolated(spring.table, angle) if spring.table else 0.0))


def _crease_moment(crease: LinearCrease | SplineCrease, start: float, angle: np.ndarray, sense: float) -> np.ndarray:
    """Moment of the law of a crease, positive in the sense of the angle, N m."""
    side = math.copysign(1.0, start or crease.rest_angle or 0.0)
    rest = side * start if crease.rest_angle is None else crease.rest_angle
    opening = rest - side * angle
    if isinstance(crease, LinearCrease):
        return np.asarray(side * crease.stiffness * opening)
    closing = crease.unloading is not None and sense * side > 0.0
    moments = crease.unloading if closing else crease.moment
    assert crease.angle is not None and moments is not None
    return side * crease.scale * _interpolated(list(zip(crease.angle, moments, strict=True)), opening)


def harness_moment(joint: SceneJoint, angle: np.ndarray, sense: float) -> np.ndarray:
    """Moment of the harness of a joint against its angle, N m, while the angle moves in a sense."""
    rows = joint.harness.rows if isinstance(joint.harness, TurnHarness) else ()
    if not rows:
        return np.zeros_like(angle)
    return _interpolated([(c, opening if sense > 0.0 else closing) for c, opening, closing in rows], angle)


def _interpolated(table: Sequence[tuple[float, float]], angle: np.ndarray) -> np.ndarray:
    """Values of a table, straight between and beyond its rows."""
    x, y = np.array(table).T
    k = np.clip(np.searchsorted(x, angle) - 1, 0, len(x) - 2)
    return np.asarray(y[k] + (y[k + 1] - y[k]) / (x[k + 1] - x[k]) * (angle - x[k]))


def margins_of(asked: Sequence[Margin], joints: Sequence[SceneJoint]) -> list[JointMargin]:
    """Joints with a margin, in the order of the joints; the last section that names a joint counts."""
    found = []
    for joint in joints:
        named = [one for one in asked if fnmatchcase(joint.name, one.joint)]
        if named and joint.kind == "revolute":
            found.append(JointMargin(joint, named[-1]))
    return found


def margin_faults(asked: Sequence[Margin], joints: Sequence[SceneJoint]) -> Iterator[Fault]:
    """Sections that name no joint that turns, and joints without travel."""
    turning = [joint for joint in joints if joint.kind == "revolute"]
    for number, one in enumerate(asked):
        if not any(fnmatchcase(joint.name, one.joint) for joint in turning):
            names = ", ".join(joint.name for joint in turning[:5]) or "none in this case"
            text = f"no joint of kind revolute has the name {one.joint!r}; their names: {names}"
            yield Fault(f"margin.{number}.joint", text)
    for found in margins_of(asked, joints):
        if found.end == found.joint.angle:
            number = asked.index(found.asked)
            yield Fault(f"margin.{number}.end", f"missing: joint {found.joint.name!r} has no end of travel; give the angle")


def margin_results(asked: Sequence[Margin], joints: Sequence[SceneJoint]) -> list[dict[str, Any]]:
    """Smallest margin of every joint with its angle (rad) and moments (N m), and both moments over the angle.

    Without a required moment the margin is None, at the angle of the least available moment.
    """
    results = []
    for found in margins_of(asked, joints):
        angles = found.angles
        (available, required), margins = found.moments(angles), found.margin(angles)
        bounded = bool(np.isfinite(margins).any())
        least = int(np.lexsort((available - required, margins))[0])  # of equal ones, that with the largest deficit
        results.append({
            "joint": found.joint.name, "margin": float(margins[least]) if bounded else None, "angle": float(angles[least]),
            "available": float(available[least]), "required": float(required[least]),
            "curve": {"angle": angles.tolist(), "available": available.tolist(), "required": required.tolist()},
        })  # fmt: skip
    return results
