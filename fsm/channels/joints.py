"""Coordinates, rates and reactions of ideal joints, `[[scene.joints]]`, and forces of springs, `[[scene.springs]]`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from fsm.case.derived.joint_frames import joint_axes
from fsm.case.models.joint import TURNING, SceneJoint
from fsm.channels.offer import Model, Offer, State, motion_of_bodies, offers, placed, rotated
from fsm.kernels.rotation import rotation_matrix
from fsm.model.elements.cords import CordGroup
from fsm.model.elements.joint_forces import JointForceGroup
from fsm.model.elements.joints import JointGroup
from fsm.results.channel import AXES, Dim

_SLIDES = {"prismatic": (2,), "cylindrical": (2,), "screw": (2,), "in-line": (2,), "planar": (0, 1), "in-plane": (0, 1)}
"""Axes of the first body along which the point of the second slides."""
_OWN = Dim("joint_axis", ("e1", "e2", "e3"), "1", "axis of the joint on its first body; e3 is `axis`")


@offers
def ideal_joints(model: Model) -> Iterator[Offer]:
    """joint.<name>.force, .moment, .force_in_joint, .moment_in_joint, .position, .angle, .rate, .displacement, .speed,
    .motor, .latched, .stop, .harness.
    """
    joints = () if model.scene is None else model.scene.joints
    names = model.system.bodies.names if joints else ()
    poses, turn = (model.system.bodies.pose if joints else None), 0
    ends = [(names.index(joint.first), names.index(joint.second)) for joint in joints]
    sides = [_Side(joint, k, *ends[k], poses) for k, joint in enumerate(joints) if poses is not None]
    reactions = _Reactions(sides)
    for joint, side in zip(joints, sides, strict=True):
        name, on = f"joint.{joint.name}", f"on {joint.second} at the point of the joint on it"
        text = f"of the joint {on}, inertial axes"
        yield Offer(f"{name}.force", "N", f"force {text}", side.reaction(reactions, 0, False), (AXES,))
        yield Offer(f"{name}.moment", "N m", f"moment {text}", side.reaction(reactions, 1, False), (AXES,))
        text = f"of the joint {on}, joint axes"
        yield Offer(f"{name}.force_in_joint", "N", f"force {text}", side.reaction(reactions, 0, True), (_OWN,))
        yield Offer(f"{name}.moment_in_joint", "N m", f"moment {text}", side.reaction(reactions, 1, True), (_OWN,))
        yield Offer(f"{name}.position", "m", f"point of the joint on {joint.second}", side.point, (AXES,))
        of_turns = 1 if joint.kind in TURNING else 2 if joint.kind == "universal" else 0
        for k in range(of_turns):
            ending = f"_{k + 1}" if of_turns > 1 else ""
            axis = "`second_axis`" if k else "`axis`"
            text = f"angle of {joint.second} relative to {joint.first} about {axis}, with all turns"
            yield Offer(f"{name}.angle{ending}", "rad", text, side.angle(turn + k, k))
            yield Offer(f"{name}.rate{ending}", "rad/s", "rate of this angle", side.rate(k))
        turn += of_turns
        if joint.motor is not None:
            text = f"of the motor on {joint.second}, positive in the sense of the coordinate"
            quantity, unit = ("force", "N") if joint.kind == "prismatic" else ("moment", "N m")
            at = side.motor if joint.motor.prescribes else _state_of(name, 5)
            yield Offer(f"{name}.motor", unit, f"{quantity} {text}", at)
        if joint.latch is not None:
            yield Offer(f"{name}.latched", "1", "1 while the latch is closed, else 0", _latched(name))
        if joint.stop is not None or joint.latch is not None:
            quantity, unit = ("force", "N") if joint.kind == "prismatic" else ("moment", "N m")
            yield Offer(f"{name}.stop", unit, f"{quantity} of stop and latch against the coordinate", _state_of(name, 3))
        if joint.harness is not None:
            quantity, unit = ("force", "N") if joint.kind == "prismatic" else ("moment", "N m")
            yield Offer(f"{name}.harness", unit, f"{quantity} of the harness against the coordinate", _state_of(name, 4))
        slides = _SLIDES.get(joint.kind, ())
        for k in slides:
            ending = f"_{k + 1}" if len(slides) > 1 else ""
            text = f"displacement of the point of {joint.second} along e{k + 1} of the joint since the start"
            yield Offer(f"{name}.displacement{ending}", "m", text, side.displacement(k))
            yield Offer(f"{name}.speed{ending}", "m/s", "rate of this displacement", side.speed(k))


class _Reactions:
    """Reactions of all joints at once."""

    def __init__(self, sides: Sequence[_Side]) -> None:
        self.bodies = np.array([side.second for side in sides], dtype=np.int64)
        self.arms = np.array([side.arm for side in sides]).reshape(-1, 3)

    def at(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Force (n, 3), N, and moment (n, 3), N m, of the joints on their second bodies at their points, inertial axes."""
        group, (poses, _) = _group(state), placed(state)
        turned = state.once(motion_of_bodies)[1][self.bodies]
        efforts = np.where(group.program < 0, -group.efforts, 0.0)
        wrenches = np.zeros((len(self.bodies), 6))
        np.add.at(wrenches, group.of, group.openings(poses)[1][:, 6:] * efforts[:, None])
        force, moment = wrenches[:, :3], rotated(turned, wrenches[:, 3:])
        return force, moment - np.cross(rotated(turned, self.arms), force)


class _Side:
    """A joint: its number, its bodies, and its axes and points in them."""

    def __init__(self, joint: SceneJoint, number: int, first: int, second: int, poses: np.ndarray) -> None:
        self.joint, self.number, self.first, self.second = joint, number, first, second
        axes, to = joint_axes(joint), np.array(joint.at if joint.to is None else joint.to)
        self.axes = axes @ rotation_matrix(poses[first, 3:])
        self.cross = axes[0] @ rotation_matrix(poses[second, 3:])
        self.arm = (to - poses[second, :3]) @ rotation_matrix(poses[second, 3:])
        self.base = (np.array(joint.at) - poses[first, :3]) @ rotation_matrix(poses[first, 3:])
        self.start = axes @ (to - np.array(joint.at))

    def _now(self, state: State, which: int) -> np.ndarray:
        """Inertial axes of the joint, (3, 3), or a vector in them, (3,)."""
        _, turned, _, _ = state.once(motion_of_bodies)
        return rotated(turned[self.first : self.first + 1], self.axes[which : which + 1])[0]

    def point(self, state: State) -> np.ndarray:
        """Point of the joint on the second body."""
        places, turned, _, _ = state.once(motion_of_bodies)
        return np.asarray(places[self.second] + rotated(turned[self.second : self.second + 1], self.arm[None])[0])

    def reaction(self, reactions: _Reactions, part: int, own: bool) -> Callable[[State], np.ndarray]:
        """Force or moment of the joint on its second body."""

        def at(state: State) -> np.ndarray:
            found = state.once(reactions.at)[part][self.number]
            return np.array([self._now(state, k) @ found for k in range(3)]) if own else found

        return at

    def angle(self, turn: int, k: int) -> Callable[[State], float]:
        """Angle since the start, plus that at the start."""

        def at(state: State) -> float:
            group = _group(state)
            return (-1.0 if k else 1.0) * float(group.angles[turn]) + self.joint.angle

        return at

    def motor(self, state: State) -> float:
        """Moment or force of the motor."""
        group = _group(state)
        return -float(group.efforts[(group.of == self.number) & (group.program >= 0)][0])

    def rate(self, k: int) -> Callable[[State], float]:
        """Rate of an angle."""

        def at(state: State) -> float:
            _, turned, _, spin = state.once(motion_of_bodies)
            second = rotated(turned[self.second : self.second + 1], self.cross[None])[0]
            axis = second if k else self._now(state, 2)
            return float(axis @ (spin[self.second] - spin[self.first]))

        return at

    def _way(self, state: State) -> np.ndarray:
        """Vector from the point of the first body to that of the second."""
        places, turned, _, _ = state.once(motion_of_bodies)
        base = rotated(turned[self.first : self.first + 1], self.base[None])[0]
        return np.asarray(self.point(state) - places[self.first] - base)

    def displacement(self, k: int) -> Callable[[State], float]:
        """Displacement along an axis since the start."""
        return lambda state: float(self._now(state, k) @ self._way(state) - self.start[k])

    def speed(self, k: int) -> Callable[[State], float]:
        """Rate of the displacement along an axis."""

        def at(state: State) -> float:
            places, _, velocity, spin = state.once(motion_of_bodies)
            axis, way, point = self._now(state, k), self._way(state), self.point(state)
            outer = velocity[self.second] + np.cross(spin[self.second], point - places[self.second])
            inner = velocity[self.first] + np.cross(spin[self.first], point - way - places[self.first])
            return float(np.cross(spin[self.first], axis) @ way + axis @ (outer - inner))

        return at


@offers
def springs(model: Model) -> Iterator[Offer]:
    """spring.<name>.length, .rate, .force."""
    for spring in () if model.scene is None else model.scene.springs:
        name = f"spring.{spring.name}"
        yield Offer(f"{name}.length", "m", "distance of both points", _state_of(name, 0))
        yield Offer(f"{name}.rate", "m/s", "rate of this length", _state_of(name, 1))
        yield Offer(f"{name}.force", "N", "tension, negative if the spring pushes", _state_of(name, 2))


@offers
def cords(model: Model) -> Iterator[Offer]:
    """cord.<name>.length, .rate, .force, .force_at_end."""
    for cord in () if model.scene is None else model.scene.cords:
        name = f"cord.{cord.name}"
        yield Offer(f"{name}.length", "m", "length of the way over all pulleys", _of_cord(cord.name, 0))
        yield Offer(f"{name}.rate", "m/s", "rate of this length", _of_cord(cord.name, 1))
        yield Offer(f"{name}.force", "N", "tension at the first end", _of_cord(cord.name, 2))
        yield Offer(f"{name}.force_at_end", "N", "tension at the second end", _of_cord(cord.name, 3))


def _cord_states(state: State) -> dict[str, np.ndarray]:
    groups = [group for group in state.system.groups if isinstance(group, CordGroup)]
    return {name: row for g in groups for name, row in zip(g.names, g.states(state.time, *placed(state)), strict=True)}


def _of_cord(name: str, column: int) -> Callable[[State], float]:
    """Number of a cord; see `CordGroup.states`."""
    return lambda state: float(state.once(_cord_states)[name][column])


def _latched(name: str) -> Callable[[State], float]:
    return lambda state: float(_laws(state).latched(name))


def _laws(state: State) -> JointForceGroup:
    return next(group for group in state.system.groups if isinstance(group, JointForceGroup))


def _states(state: State) -> np.ndarray:
    poses, rates = placed(state)
    return _laws(state).states(state.time, poses, rates)


def _state_of(name: str, column: int) -> Callable[[State], float]:
    """Number of a coordinate; see `JointForceGroup.states`."""
    return lambda state: float(state.once(_states)[_laws(state).row_of(name), column])


def _group(state: State) -> JointGroup:
    return next(group for group in state.system.groups if isinstance(group, JointGroup))
