"""Motion of every rigid body and frame, and reactions of held and driven bodies."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fsm.builders.sheet.beside_sheet import points_on_facets
from fsm.case.schema.known_names import nearest_name
from fsm.channels import offer
from fsm.channels.offer import Model, Offer, State
from fsm.errors import CaseError, Fault
from fsm.model.system.system import SegmentSystem
from fsm.results.channel import AXES, Dim

_QUATERNION = Dim("quaternion", ("w", "x", "y", "z"), "1", "component of the unit quaternion, scalar part first")


@offer.offers
def bodies(model: Model) -> Iterator[Offer]:
    """body.<name>.position, .rotation, .orientation, .velocity, .angular_velocity."""
    if not isinstance(model.system, SegmentSystem):
        return
    table = model.system.bodies
    start = offer.quaternions(table.pose)
    for i, body in enumerate(table.names[1:], start=1):
        name = f"body.{body}"
        yield Offer(f"{name}.position", "m", "centre of mass", _position(i), (AXES,))
        text = "rotation vector since the start, inertial axes"
        yield Offer(f"{name}.rotation", "rad", text, _rotation(i, table.pose[i], start[i]), (AXES,))
        yield Offer(f"{name}.orientation", "1", "unit quaternion of the body axes", _orientation(i), (_QUATERNION,))
        yield Offer(f"{name}.velocity", "m/s", "velocity of the centre of mass", _rate(i, 0), (AXES,))
        yield Offer(f"{name}.angular_velocity", "rad/s", "angular velocity, inertial axes", _rate(i, 1), (AXES,))


@offer.offers
def supports(model: Model) -> Iterator[Offer]:
    """support.<body>.force and .moment of every body that is held or driven in any step; of the ground about the origin."""
    if not isinstance(model.system, SegmentSystem):
        return
    table = model.system.bodies
    frames = getattr(getattr(model.system, "frames", None), "bodies", ())
    free = set(table.free.tolist())
    if model.plan is not None and model.scene is not None:
        fixed = model.plan.fixed(model.scene)
        free = {i for i in free if table.names[i] not in fixed}
    for i in sorted(set(range(len(table.names))) - free - set(map(int, frames))):
        name = f"support.{table.names[i]}"
        yield Offer(f"{name}.force", "N", "force of the support or drive on the body", _reaction(i, 0), (AXES,))
        text = "moment of the support or drive about the centre of the body, inertial axes"
        yield Offer(f"{name}.moment", "N m", text, _reaction(i, 1), (AXES,))


@offer.offers
def points(model: Model) -> Iterator[Offer]:
    """point.<name>.position, .displacement, .velocity of the points in `[save.points]`."""
    wanted = model.case.save.points
    if not wanted or not isinstance(model.system, SegmentSystem):
        return
    table = model.system.bodies
    faults, on_facets = [], points_on_facets(model.case)
    for name, point in wanted.items():
        body, origin = on_facets.get(point.body, (point.body, (0.0, 0.0, 0.0)))
        if body not in table.names:
            near = nearest_name(body, [*table.names, *on_facets])
            faults.append(Fault(f"save.points.{name}.body", f"no body is called {body!r}{near}"))
            continue
        i, arm = table.names.index(body), np.array(origin) + np.array(point.at)
        start = offer.positions(table.pose)[i] + offer.rotated(offer.quaternions(table.pose)[i : i + 1], arm[None])[0]
        yield Offer(f"point.{name}.position", "m", f"point of {point.body}", _point(i, arm, np.zeros(3)), (AXES,))
        yield Offer(f"point.{name}.displacement", "m", "displacement since the start", _point(i, arm, start), (AXES,))
        yield Offer(f"point.{name}.velocity", "m/s", f"velocity of the point of {point.body}", _velocity(i, arm), (AXES,))
    if faults:
        raise CaseError(faults)


def _point(i: int, arm: np.ndarray, start: np.ndarray) -> Callable[[State], np.ndarray]:
    def at(state: State) -> np.ndarray:
        places, turned, _, _ = state.once(offer.motion_of_bodies)
        return np.asarray(places[i] - start + offer.rotated(turned[i : i + 1], arm[None])[0])

    return at


def _velocity(i: int, arm: np.ndarray) -> Callable[[State], np.ndarray]:
    def at(state: State) -> np.ndarray:
        _, turned, velocity, spin = state.once(offer.motion_of_bodies)
        return np.asarray(velocity[i] + np.cross(spin[i], offer.rotated(turned[i : i + 1], arm[None])[0]))

    return at


def _wrenches(state: State) -> tuple[np.ndarray, np.ndarray]:
    """Reactions of all bodies in inertial axes."""
    wrenches = state.system.reactions(state.time, state.q, state.u, state.before)
    return offer.in_space(wrenches, state.once(offer.motion_of_bodies)[1])


def _position(i: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(offer.motion_of_bodies)[0][i]


def _orientation(i: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(offer.motion_of_bodies)[1][i]


def _rate(i: int, part: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(offer.motion_of_bodies)[2 + part][i]


def _rotation(i: int, pose: np.ndarray, start: np.ndarray) -> Callable[[State], np.ndarray]:
    def at(state: State) -> np.ndarray:
        if len(pose) == 3:  # in the plane, the angle is known beyond pi
            return np.array([0.0, offer.placed(state)[0][i, 2] - pose[2], 0.0])
        return offer.rotation_since(start, state.once(offer.motion_of_bodies)[1][i])

    return at


def _reaction(i: int, part: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(_wrenches)[part][i]
