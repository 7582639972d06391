"""Method of motions with ideal joints by its cost: explicit steps of order 8, or generalized-alpha.

Explicit steps are at most 6 over the largest rate of springs and dampers. Steps of generalized-alpha follow the motion: they
are 2 rtol^(1/3) over its pace. Both are estimates from the start. A wrong one costs time, and never accuracy.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from fsm.case.models.coupling import OWN_COUPLINGS
from fsm.case.models.joint import SceneJoint
from fsm.case.models.joint_action import LEAST_REBOUND, SlideSpring, TurnSpring
from fsm.case.models.joint_motor import Motor
from fsm.case.models.scene import GROUND, Body
from fsm.case.plan.method_selection import beyond_explicit, hinge_stiffness, slope_of
from fsm.model.plan.joint_state import REPEATS, JointsAtStart
from fsm.text.shown_units import shown

_STABLE = 6.0
"""Largest explicit step times the rate of a spring or damper."""
_STEPS = 2.0
"""Step of generalized-alpha times the pace of the motion, over rtol^(1/3); measured on a pendulum."""
_WORTH = 5.0
"""Explicit steps that are worth one of generalized-alpha. Each takes three times as long, but their error is smaller by a
thousand and more, for which generalized-alpha would need thirty times its steps."""
_TURNED = 0.1
"""Part of the compliance of free bodies that a mechanism has in some of its positions; at the start it may have none."""
_HELD = 1e-6
"""Part of the compliance of free bodies below which a coordinate cannot move."""
_FEW = 20_000
"""Number of explicit steps that are taken in any case, since they need some seconds at most."""


class _Resistance(NamedTuple):
    """Spring and damper along one row of rates of bodies (`JointsAtStart`).

    Attributes
    ----------
    row : (6 n_bodies,) array
    holds : stiffness at the start, without stops, latches and cords
    stiffness, damping : largest ones
    effort : size of the effort at the start, of a spring or a motor
    slides : whether efforts are forces, not moments
    """

    row: np.ndarray
    holds: float
    stiffness: float
    damping: float
    effort: float
    slides: bool


class MotionMethod:
    """Rates of springs and dampers and pace of the motion, with all locked directions held, at the start."""

    def __init__(self, start: JointsAtStart) -> None:
        self.start, self.scene = start, start.scene

    @cached_property
    def _resistances(self) -> list[_Resistance]:
        return [*self._of_joints(), *self._of_springs(), *self._of_cords(), *self._of_elements()]

    @cached_property
    def unheld(self) -> int:
        """Number of motions of the free bodies that neither joints nor springs hold, without weights."""
        rows = [*self.start.rows, *(each.row for each in self._resistances if each.holds > 0.0)]
        scaled = np.array(rows).reshape(len(rows), -1) @ self.start.roots
        sizes = np.linalg.norm(scaled, axis=1, keepdims=True)
        rank = np.linalg.matrix_rank(scaled / np.where(sizes > 0.0, sizes, 1.0), tol=REPEATS) if scaled.size else 0
        return 6 * int(self.start.free.sum()) - int(rank)

    @cached_property
    def _rows(self) -> np.ndarray:
        """Rows of all resistances in the coordinates of the kinetic energy."""
        rows = np.array([each.row for each in self._resistances])
        return np.asarray(rows.reshape(-1, len(self.start.roots)) @ self.start.roots)

    @cached_property
    def _allowed(self) -> np.ndarray:
        """These rows without their parts along locked directions."""
        return self._without_locked(self._rows)

    def _without_locked(self, rows: np.ndarray) -> np.ndarray:
        """Rows (m, n) without their parts along locked directions; the latter may repeat each other."""
        locked = self.start.scaled
        products = locked @ locked.T + REPEATS * np.eye(len(locked))
        return np.asarray(rows - np.linalg.solve(products, locked @ rows.T).T @ locked)

    def at_joint(self, joint: SceneJoint) -> tuple[float, float]:
        """Inertia (kg or kg m^2) that moves with the coordinate of a joint, infinite if it cannot move, and the largest
        effort of its spring or motor at the start.
        """
        found = self._of_joint(joint)
        row = found.row @ self.start.roots
        allowed = self._without_locked(row[None])[0]
        compliance, free = float(allowed @ allowed), float(row @ row)
        return 1.0 / compliance if compliance > _HELD * free else math.inf, found.effort

    @cached_property
    def fastest(self) -> float:
        """Largest rate of all springs and dampers with all stops and latches in contact, 1/s: sqrt(k/m), or c/m."""
        springs, dampers = ([getattr(each, key) for each in self._resistances] for key in ("stiffness", "damping"))
        return max(math.sqrt(self._over_inertia(springs)), self._over_inertia(dampers))

    def _over_inertia(self, coefficients: list[float]) -> float:
        """Largest eigenvalue of stiffness over mass, or of damping over mass."""
        if not self._rows.size:
            return 0.0
        factors = np.sqrt(np.array(coefficients))[:, None]
        found = []
        for rows in (factors * self._allowed, factors * self._rows):
            products = rows @ rows.T if len(rows) < rows.shape[1] else rows.T @ rows
            found.append(float(np.linalg.eigvalsh(products)[-1]))
        return max(found[0], _TURNED * found[1], 0.0)

    def pace(self, duration: float) -> float:
        """Rate of the motion, 1/s: of velocities and motors at the start, and of weights, loads and efforts over size and
        inertia; at least one turn in the duration (s).
        """
        scene, size = self.scene, self._size
        paces = [2.0 * math.pi / duration, math.sqrt(math.hypot(*scene.gravity) / size)]
        for body in self._free:
            paces += [math.hypot(*body.velocity) / size, math.hypot(*body.angular_velocity)]
        inertias = {body.name: (body.mass, max(body.inertia)) for body in self._free}
        for load in scene.loads:
            if load.body in inertias:
                mass, inertia = inertias[load.body]
                paces += [math.sqrt(math.hypot(*load.force) / (mass * size)), math.sqrt(math.hypot(*load.moment) / inertia)]
        for each, row in zip(self._resistances, self._allowed, strict=True):
            paces.append(math.sqrt(each.effort * float(row @ row) / (size if each.slides else 1.0)))
        for joint in scene.joints:
            if joint.motor is not None and joint.motor.prescribes and joint.motor.speed is not None:
                paces.append(abs(joint.motor.speed) / (size if joint.kind == "prismatic" else 1.0))
        return max(paces)

    @property
    def _free(self) -> list[Body]:
        return [body for body, is_free in zip(self.scene.bodies, self.start.free, strict=True) if is_free]

    @cached_property
    def _size(self) -> float:
        """Extent of bodies and joints; of one body without an extent, its radius of gyration, m."""
        places = [body.position for body in self.scene.bodies] + [joint.at for joint in self.scene.joints]
        extent = float(np.ptp(np.array(places), axis=0).max())
        gyration = min(math.sqrt(max(body.inertia) / body.mass) for body in self._free)
        return max(extent, gyration)

    def choice(self, duration: float, rtol: float, known: str) -> tuple[str, str]:
        """Method for a motion of this duration (s) at this tolerance, and the reason after the one that is `known`."""
        method, reason = self._by_cost(duration, rtol)
        return method, f"{known}; {reason}"

    def _by_cost(self, duration: float, rtol: float) -> tuple[str, str]:
        missing = beyond_explicit(self.scene)
        if missing:
            return "generalized-alpha", f"explicit steps do not have {missing}"
        if any(joint.friction and joint.friction.coefficient for joint in self.scene.joints):
            return "generalized-alpha", "the rate of friction that follows a reaction is not known at the start"
        explicit = duration * self.fastest / _STABLE
        if self.fastest == 0.0:
            return "explicit", "without springs and dampers explicit steps are long"
        stiff = f"springs and dampers of up to {self.fastest:.2g}/s"
        if explicit <= _FEW:
            return "explicit", f"{stiff} allow explicit steps of {shown(_STABLE / self.fastest, 's')}"
        implicit = duration * self.pace(duration) / (_STEPS * rtol ** (1.0 / 3.0))
        need = f"{stiff} need about {_rounded(explicit)} explicit steps"
        others = f"{_rounded(implicit)} of generalized-alpha"
        if explicit <= _WORTH * implicit:
            return "explicit", f"{need}, which cost no more than {others} with the same error"
        return "generalized-alpha", f"{need}, which cost more than {others}"

    # springs and dampers ------------------------------------------------------------------------------------------------

    def _of_joints(self) -> Iterator[_Resistance]:
        joints = {joint.name: joint for joint in self.scene.joints}
        for joint in joints.values():
            if any((joint.spring, joint.damper, joint.friction, joint.stop, joint.latch, joint.motor)):
                yield self._of_joint(joint)
        for coupling in self.scene.couplings:
            if not coupling.ideal and coupling.kind in OWN_COUPLINGS and all(name in joints for name in coupling.joints):
                parts = zip(coupling.ratios, coupling.joints, strict=True)
                row = np.sum([ratio * self.start.coordinate(joints[name]) for ratio, name in parts], axis=0)
                given = coupling.parameters or {}
                yield _Resistance(row, given["stiffness"], given["stiffness"], given["damping"], 0.0, False)

    def _of_joint(self, joint: SceneJoint) -> _Resistance:
        holds, damping = slope_of(joint.spring, "stiffness"), slope_of(joint.damper, "coefficient") + _governed(joint.motor)
        stiffness = holds
        for one in (joint.stop, joint.latch):
            if one is not None:
                rebound = getattr(one, "restitution", None)  # see `fsm.case.derived.rebound`
                stiffness += one.stiffness * (1.0 if rebound is None else 2.0 / max(rebound, LEAST_REBOUND))
                damping += getattr(one, "damping", 0.0)
        if joint.friction is not None:
            damping += joint.friction.steepest
        effort = _largest(joint.motor, "curve") * (1.0 if joint.motor is None else joint.motor.ratio)
        effort = max(effort, _effort(joint), 0.0 if joint.motor is None else abs(joint.motor.effort or 0.0))
        return _Resistance(self.start.coordinate(joint), holds, stiffness, damping, effort, joint.kind == "prismatic")

    def _of_springs(self) -> Iterator[_Resistance]:
        for spring in self.scene.springs:
            if spring.at != spring.to:
                stiffness, effort = slope_of(spring, "stiffness"), _largest(spring, "table")
                effort = max(effort, abs(spring.force + stiffness * (spring.length - spring.free)))
                if spring.gas is not None:
                    stiffness += spring.gas.exponent * spring.gas.force / spring.gas.column
                    effort += spring.gas.force
                damping = slope_of(spring.damper, "coefficient")
                row = self._stretch((spring.first, spring.at), (spring.second, spring.to))
                yield _Resistance(row, stiffness, stiffness, damping, effort, True)

    def _of_cords(self) -> Iterator[_Resistance]:
        for cord in self.scene.cords:
            row = np.sum([self._stretch(*both) for both in pairwise(cord.way)], axis=0)
            yield _Resistance(row, 0.0, cord.stiffness, cord.damping, 0.0, True)

    def _of_elements(self) -> Iterator[_Resistance]:
        for element in self.scene.elements:
            ends, none = (element.inner, element.outer), np.zeros(3)
            at = none if ends[1] == GROUND else np.array(self.scene.bodies[self.start.index[ends[1]]].position)
            arms = [self.start.arm(name, at) for name in ends]
            slide, turn = max(element.translation), max(*element.rotation, hinge_stiffness(element))
            for along in np.eye(3):
                row = self.start.between(*ends, -along, np.cross(along, arms[0]), along, np.cross(arms[1], along))
                yield _Resistance(row, slide, slide, max(element.translation_damping), 0.0, True)
                row = self.start.between(*ends, none, -along, none, along)
                yield _Resistance(row, turn, turn, max(element.rotation_damping), 0.0, False)

    def _stretch(self, first: tuple[str, Any], second: tuple[str, Any]) -> np.ndarray:
        """Row of the rate of the distance of two points (body, place)."""
        (one, at), (other, to) = first, second
        along = np.subtract(to, at) / math.dist(to, at)
        turns = np.cross(along, self.start.arm(one, np.array(at))), np.cross(self.start.arm(other, np.array(to)), along)
        return self.start.between(one, other, -along, turns[0], along, turns[1])


def _rounded(steps: float) -> str:
    """Number with two digits."""
    return f"{float(f'{max(steps, 1.0):.2g}'):,.0f}"


def _largest(law: Any, key: str) -> float:
    """Largest effort of a table."""
    return max((abs(effort) for _, effort in getattr(law, key, None) or ()), default=0.0)


def _effort(joint: SceneJoint) -> float:
    """Size of the effort of the spring of a joint at the start."""
    spring = joint.spring
    if not isinstance(spring, TurnSpring | SlideSpring):
        return slope_of(spring, "stiffness") * abs(joint.angle - (getattr(spring, "rest_angle", None) or 0.0))
    load = spring.moment if isinstance(spring, TurnSpring) else spring.force
    bent = 0.0 if spring.rest is None else spring.stiffness * (joint.angle - spring.rest)
    return max(abs(load or 0.0), abs(bent), _largest(spring, "table"))


def _governed(motor: Motor | None) -> float:
    """Slope of the torque of a motor at the joint, by the rate: of its curve, and of its governor (1 % of the speed)."""
    if motor is None or motor.curve is None:
        return 0.0
    steepest = max(abs((b[1] - a[1]) / (b[0] - a[0])) for a, b in pairwise(motor.curve)) * motor.ratio**2
    return max(steepest, _largest(motor, "curve") * motor.ratio / (0.01 * abs(motor.speed)) if motor.speed else 0.0)
