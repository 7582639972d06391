"""Motion of every rigid body and frame, and the reactions of those that are held or driven."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fsm.channels.offer import Model, Offer, State, offers
from fsm.channels.rigid import in_space, motion_of_bodies, placed, quaternions, rotation_since
from fsm.results.channel import AXES, Dim
from fsm.segments.system import SegmentSystem

_QUATERNION = Dim("quaternion", ("w", "x", "y", "z"), "1", "component of the unit quaternion, scalar part first")


@offers
def bodies(model: Model) -> Iterator[Offer]:
    """body.<name>.position, .rotation, .orientation, .velocity, .angular_velocity."""
    if not isinstance(model.system, SegmentSystem):
        return
    table = model.system.bodies
    start = quaternions(table.pose)
    for i, body in enumerate(table.names[1:], start=1):
        name = f"body.{body}"
        yield Offer(f"{name}.position", "m", "centre of mass", _position(i), (AXES,))
        text = "rotation vector since the start, inertial axes"
        yield Offer(f"{name}.rotation", "rad", text, _rotation(i, table.pose[i], start[i]), (AXES,))
        yield Offer(f"{name}.orientation", "1", "unit quaternion of the body axes", _orientation(i), (_QUATERNION,))
        yield Offer(f"{name}.velocity", "m/s", "velocity of the centre of mass", _rate(i, 0), (AXES,))
        yield Offer(f"{name}.angular_velocity", "rad/s", "angular velocity, inertial axes", _rate(i, 1), (AXES,))


@offers
def supports(model: Model) -> Iterator[Offer]:
    """support.<body>.force and .moment of every held or driven body; of the ground about the origin."""
    if not isinstance(model.system, SegmentSystem):
        return
    table = model.system.bodies
    frames = getattr(getattr(model.system, "frames", None), "bodies", ())
    free = set() if model.case.step else set(table.free.tolist())  # steps may hold or release any body
    for i in sorted(set(range(len(table.names))) - free - set(map(int, frames))):
        name = f"support.{table.names[i]}"
        yield Offer(f"{name}.force", "N", "force of the support or drive on the body", _reaction(i, 0), (AXES,))
        text = "moment of the support or drive about the centre of the body, inertial axes"
        yield Offer(f"{name}.moment", "N m", text, _reaction(i, 1), (AXES,))


def _wrenches(state: State) -> tuple[np.ndarray, np.ndarray]:
    """Reactions of all bodies in inertial axes."""
    wrenches = state.system.reactions(state.time, state.q, state.u, state.before)
    return in_space(wrenches, state.once(motion_of_bodies)[1])


def _position(i: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(motion_of_bodies)[0][i]


def _orientation(i: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(motion_of_bodies)[1][i]


def _rate(i: int, part: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(motion_of_bodies)[2 + part][i]


def _rotation(i: int, pose: np.ndarray, start: np.ndarray) -> Callable[[State], np.ndarray]:
    def at(state: State) -> np.ndarray:
        if len(pose) == 3:  # an angle beyond pi is known in the plane
            return np.array([0.0, placed(state)[0][i, 2] - pose[2], 0.0])
        return rotation_since(start, state.once(motion_of_bodies)[1][i])

    return at


def _reaction(i: int, part: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(_wrenches)[part][i]
