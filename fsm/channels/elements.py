"""Force elements between two bodies: creases, joints, and panels of joined segments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from fsm.case.models.scene import ForceElement
from fsm.channels.offer import Model, Offer, State, in_space, offers, past_of, placed, positions, quaternions, rotated
from fsm.laws.crease import crease_moment
from fsm.model.bodies.group import BodyState, PreviousPoses
from fsm.model.elements.actuators import ActuatorGroup
from fsm.model.elements.creases import CreaseGroup
from fsm.model.elements.element_angles import initial_twists, rest_twists, side_of
from fsm.model.elements.elements import BushingGroup
from fsm.model.elements.hysteresis import HysteresisGroup
from fsm.model.elements.law_elements import LawGroup
from fsm.model.elements.ligaments import LigamentGroup
from fsm.results.channel import AXES, Dim

Values = dict[str, np.ndarray]


@offers
def creases(model: Model) -> Iterator[Offer]:
    """crease.<name>.angle, .moment, .position, .force of every crease; creases of a strip are named by their numbers."""
    elements = [element for element in _elements(model) if element.kind == "crease"]
    for element, side in zip(elements, _sides(model, elements), strict=True):
        name = f"crease.{element.name.removeprefix('crease ')}"
        if element.frame == "outer":
            angle = "crease angle: 0 flat, positive on the side to which the crease is folded at the start"
        else:
            angle = "rotation of the inner body relative to the outer one since the start"
        yield Offer(f"{name}.angle", "rad", angle, _angle(element.name, side, element.crease_flexibility))
        text = "moment of the crease, positive if its angle exceeds the rest angle"
        yield Offer(f"{name}.moment", "N m", text, _moment(element.name, side))
        yield from _joint_offers(name, element)


@offers
def joints(model: Model) -> Iterator[Offer]:
    """joint.<name>.force, .moment, .position, and of springs .translation and .rotation, of every other element."""
    for element in _elements(model):
        if element.kind in ("joint", "drive"):
            yield from _joint_offers(f"joint.{element.name}", element)


@offers
def panels(model: Model) -> Iterator[Offer]:
    """panel.<number>.curvature and .moment along the panel of a strip."""
    if model.case.strip is None or model.scene is None:
        return
    panel_of = {body.name: body.panel for body in model.scene.bodies}
    rows: dict[int, list[ForceElement]] = {}
    for element in _elements(model):
        if element.kind == "panel":
            rows.setdefault(panel_of[element.inner], []).append(element)
    for panel, found in sorted(rows.items()):
        names = tuple(element.name for element in found)
        lengths = np.array([element.point_inner[0] - element.point_outer[0] for element in found])
        first = found[0].point_inner[0] * 2.0
        where = np.concatenate([[first], first + np.cumsum([2.0 * element.point_inner[0] for element in found[1:]])])
        dim = Dim(f"panel.{panel}.position", tuple(where.tolist()), "m", "distance from the start of the panel")
        bending = np.array([element.rotation[1] for element in found]) * lengths
        yield Offer(
            f"panel.{panel}.curvature", "1/m", "curvature of the panel, positive if it bends to the +z side of its segments",
            _curvature(names, 1.0 / lengths), (dim,),
        )  # fmt: skip
        yield Offer(
            f"panel.{panel}.moment", "N m", "bending moment of the panel, EI times the curvature",
            _curvature(names, bending / lengths), (dim,),
        )  # fmt: skip


def _elements(model: Model) -> Iterator[ForceElement]:
    if model.scene is not None:
        yield from model.scene.elements


def _joint_offers(name: str, element: ForceElement) -> Iterator[Offer]:
    place = "at the joint point of its inner body, in inertial axes"
    inner, key = element.inner, element.name
    yield Offer(f"{name}.force", "N", f"force on {inner} {place}", _row(_forces, key, 0), (AXES,))
    yield Offer(f"{name}.moment_vector", "N m", f"moment on {inner} {place}", _row(_forces, key, 1), (AXES,))
    yield Offer(f"{name}.position", "m", f"joint point of {inner}", _row(_forces, key, 2), (AXES,))
    if element.frame == "outer":
        axes = Dim("joint_axis", ("e1", "e2", "e3"), "1", "joint axis of the outer body")
        yield Offer(f"{name}.translation", "m", "translation of the joint", _part(key, "translation"), (axes,))
        yield Offer(f"{name}.rotation", "rad", "rotation of the joint: swing, twist, swing", _part(key, "rotation"), (axes,))


# values of all elements at a state --------------------------------------------------------------------------------------


def _groups(state: State, kind: Any) -> list[Any]:
    return [group for group in state.system.groups if isinstance(group, kind)]


def _deformations(state: State) -> tuple[Values, Values]:
    """Deformations of all springs, (3 or 6,), and their rates, by the name of the element."""
    poses, rates = placed(state)
    past = past_of(state)
    values: Values = {}
    speeds: Values = {}
    for group in _groups(state, BushingGroup | LawGroup | CreaseGroup | LigamentGroup):
        value, rate = group.measure(poses, rates, group.bodies, *group.geometry)[:2]
        if past is not None:
            rate = (value - group.measure(past.poses, rates, group.bodies, *group.geometry)[0]) / past.duration
        for name, one, other in zip(group.names, np.array(value), np.array(rate), strict=True):
            # the springs of this element are known, and its twist is the twist of the crease
            if name in values and isinstance(group, CreaseGroup):
                one, other = _with_twist(values[name], one), _with_twist(speeds[name], other)
            values[name], speeds[name] = np.atleast_1d(one), np.atleast_1d(other)
    return values, speeds


def _with_twist(values: np.ndarray, twist: float) -> np.ndarray:
    changed = values.copy()
    changed[_twist(values)] = twist
    return changed


def _twist(values: np.ndarray) -> int:
    """Index of the twist in the deformations of an element."""
    return {1: 0, 3: 2, 6: 4}[len(values)]


def _crease_moments(state: State) -> tuple[Values, Values]:
    """Moments against the twist of every crease with a tabulated or a linear law, without and with dampers, N m."""
    poses, rates = placed(state)
    elastic: Values = {}
    damped: Values = {}
    values, speeds = state.once(_deformations)
    for name, (rest, stiffness, damping) in _linear(state).items():
        elastic[name] = stiffness * (values[name][_twist(values[name])] - rest)
        damped[name] = elastic[name] + damping * speeds[name][_twist(speeds[name])]
    for group in _groups(state, CreaseGroup):
        angle = group.measure(poses, rates, group.bodies, *group.geometry)[0]
        moment, _ = crease_moment(angle, np.zeros(len(angle)), group.law)
        for name, value, damping in zip(group.names, np.ravel(moment).tolist(), group.damping, strict=True):
            elastic[name] = value
            damped[name] = value + damping * speeds[name][_twist(speeds[name])]
    for group in _groups(state, LawGroup):
        value, rate = (np.array([of[name] for name in group.names]) for of in (values, speeds))
        for moving, sums in ((np.zeros_like(rate), elastic), (rate, damped)):
            for name, row in zip(group.names, group.efforts(value, moving)[0], strict=True):
                sums[name] = sums.get(name, 0.0) + row[_twist(row)]
    for group in _groups(state, HysteresisGroup):
        angle = group.measure(poses, rates, group.bodies, *group.geometry)[0]
        for name, value in zip(group.names, group.moments(angle), strict=True):
            elastic[name] = elastic[name] + value
            damped[name] = damped[name] + value
    for group in _groups(state, ActuatorGroup):  # a rest angle that moves
        for name, value in zip(group.names, group.moments(state.time).tolist(), strict=True):
            elastic[name] -= value
            damped[name] -= value
    return elastic, damped


def _linear(state: State) -> dict[str, tuple[float, float, float]]:
    """Rest angle (rad), stiffness (N m/rad) and damping (N m s/rad) of the twist of every linear element."""
    found: dict[str, tuple[float, float, float]] = {}
    for group in _groups(state, BushingGroup):
        column = 2 if group.rest.shape[1] == 3 else 4
        rows = np.stack([group.rest[:, column], group.stiffness[:, column], group.damping[:, column]], axis=1)
        found |= {name: (row[0], row[1], row[2]) for name, row in zip(group.names, rows.tolist(), strict=True)}
    for group in _groups(state, LigamentGroup):
        for name, row in zip(group.names, group.constants.tolist(), strict=True):
            found[name] = 0.0, row[9], row[12]
    return found


def _forces(state: State) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Force and moment on the inner body of every element at its joint point, and this point, inertial axes, (3,) each."""
    poses, rates = placed(state)
    past = past_of(state)
    turned, places = quaternions(poses), positions(poses)
    sums: dict[str, np.ndarray] = {}
    inner: dict[str, int] = {}
    for group in _groups(state, BushingGroup | LawGroup | CreaseGroup | HysteresisGroup | LigamentGroup | ActuatorGroup):
        rows = group.bodies[:, :2].ravel()
        alone = _alone(group)
        wrenches = np.zeros((len(rows), rates.shape[1]))
        since = None if past is None else PreviousPoses(past.poses[rows], past.duration)
        alone.add_force(BodyState(state.time, poses[rows], rates[rows], since), wrenches)
        for name, body, wrench in zip(group.names, rows[::2], wrenches[::2], strict=True):
            sums[name] = sums[name] + wrench if name in sums else wrench
            inner[name] = int(body)
    found = {}
    arms = _arms(state)
    for name, wrench in sums.items():
        body = inner[name]
        force, moment = (part[0] for part in in_space(wrench[None], turned[body : body + 1]))
        arm = rotated(turned[body : body + 1], arms[name][None])[0] if name in arms else np.zeros(3)
        found[name] = force, moment - np.cross(arm, force), places[body] + arm
    return found


def _alone(group: Any) -> Any:
    """Copies of the elements, each between two separate bodies, so that their wrenches are not summed."""
    count = len(group.bodies)
    return replace(group, bodies=np.arange(2 * count, dtype=np.int64).reshape(count, 2))


def _arms(state: State) -> Values:
    """Joint points of the inner bodies in body axes, by the name of the element."""
    found = {}
    for group in _groups(state, BushingGroup | LawGroup):
        points = group.geometry[0]
        for name, point in zip(group.names, points, strict=True):
            found[name] = point if len(point) == 3 else np.array([point[0], 0.0, point[1]])
    for group in _groups(state, LigamentGroup):
        for name, point in zip(group.names, group.constants[:, :2], strict=True):
            found[name] = np.array([point[0], 0.0, point[1]])
    return found


# values of one channel --------------------------------------------------------------------------------------------------


def _row(function: Callable[[State], dict[str, Any]], name: str, part: int) -> Callable[[State], np.ndarray]:
    def at(state: State) -> np.ndarray:
        found = state.once(function)
        if name in found:
            return np.asarray(found[name][part])
        return np.full(3, np.nan if part == 2 else 0.0)  # the element does not act in this step

    return at


def _part(name: str, which: str) -> Callable[[State], np.ndarray]:
    def at(state: State) -> np.ndarray:
        values = state.once(_deformations)[0].get(name, np.zeros(6))
        out = np.zeros(3)
        if len(values) == 6:
            return np.asarray(values[:3] if which == "translation" else values[3:])
        if which == "rotation":
            out[1] = values[_twist(values)]
        elif len(values) == 3:
            out[[0, 2]] = values[:2]
        return out

    return at


def _moment(name: str, side: float) -> Callable[[State], float]:
    return lambda state: side * float(state.once(_crease_moments)[1].get(name, 0.0))


def _angle(name: str, side: float, soft: float) -> Callable[[State], float]:
    def at(state: State) -> float:
        values = state.once(_deformations)[0].get(name)
        if values is None:
            return np.nan
        return side * (float(values[_twist(values)]) - soft * float(state.once(_crease_moments)[0][name]))

    return at


def _curvature(names: tuple[str, ...], factors: np.ndarray) -> Callable[[State], np.ndarray]:
    def at(state: State) -> np.ndarray:
        values = state.once(_deformations)[0]
        return factors * np.array([values[name][_twist(values[name])] for name in names])

    return at


def _sides(model: Model, elements: list[ForceElement]) -> list[float]:
    """Side to which every crease is folded, +1 or -1; +1 for ligaments."""
    if model.scene is None:
        return []
    starts = initial_twists(elements, model.scene.bodies)
    sides = [side_of(start, rest) for start, rest in zip(starts, rest_twists(elements, starts), strict=True)]
    return [1.0 if element.frame == "chord" else side for element, side in zip(elements, sides, strict=True)]
