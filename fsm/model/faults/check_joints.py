"""Faults of ideal joints, found before the scene is compiled."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np

from fsm.case.models.cord import SceneCord
from fsm.case.models.joint import WITH_TO, SceneJoint
from fsm.case.models.scene import GROUND, Scene
from fsm.case.models.spring import SceneSpring
from fsm.case.schema.known_names import nearest_name
from fsm.errors import Fault
from fsm.text.shown_units import shown

_CLOSED = 1e-9
"""Opening at the start that counts as closed, relative to the distances of `to` from `at` and from the body."""


def joint_faults(scene: Scene) -> Iterator[Fault]:
    """Faults of `[[scene.joints]]`."""
    if scene.joints and (scene.flexible or scene.chambers):
        text = "ideal joints act between rigid bodies in a scene without films, cables, beams, trusses and flexible facets; "
        yield Fault("scene.joints", text + "use [[scene.elements]] in this scene")
    yield from _springs(scene)
    yield from _cords(scene)
    yield from _names("joints", scene.joints)
    names = [GROUND, *(body.name for body in scene.bodies)]
    driven = {name for drive in scene.drives for name in drive.moved}
    places = {body.name: body.position for body in scene.bodies}
    fixed = {GROUND, *driven, *(body.name for body in scene.bodies if body.held)}
    for i, joint in enumerate(scene.joints):
        path = f"scene.joints.{i}"
        yield from _bodies(path, joint, names)
        if {joint.first, joint.second} <= fixed:
            text = f"joint {joint.name!r} is between {joint.first!r} and {joint.second!r}, which are both held or driven; "
            yield Fault(path, text + "remove it, or free a body")
        open_by = _opening(joint, places.get(joint.second, joint.at))
        if open_by > 0.0:
            what = "line" if joint.kind == "in-line" else "plane"
            text = f"the point is {shown(open_by, 'm')} off the {what} of joint {joint.name!r} at the start"
            yield Fault(f"{path}.to", f"{text}; move `to` or `at`")


def _springs(scene: Scene) -> Iterator[Fault]:
    """Faults of `[[scene.springs]]`."""
    if scene.springs and (scene.flexible or scene.chambers):
        text = "springs act between rigid bodies in a scene without films, cables, beams, trusses and flexible facets; "
        yield Fault("scene.springs", text + "use [[scene.elements]] in this scene")
    yield from _names("springs", scene.springs)
    names = [GROUND, *(body.name for body in scene.bodies)]
    for i, spring in enumerate(scene.springs):
        path = f"scene.springs.{i}"
        yield from _bodies(path, spring, names)
        if spring.first == spring.second:
            yield Fault(path, f"spring {spring.name!r} joins {spring.first!r} to itself; `first` and `second` must differ")


def _cords(scene: Scene) -> Iterator[Fault]:
    """Faults of `[[scene.cords]]`."""
    if scene.cords and (scene.flexible or scene.chambers):
        text = "cords act between rigid bodies in a scene without films, cables, beams, trusses and flexible facets; "
        yield Fault("scene.cords", text + "use [[scene.cables]] in this scene")
    yield from _names("cords", scene.cords)
    names = [GROUND, *(body.name for body in scene.bodies)]
    for i, cord in enumerate(scene.cords):
        yield from _bodies(f"scene.cords.{i}", cord, names)
        for k, pulley in enumerate(cord.over):
            if pulley.body not in names:
                text = f"no body is called {pulley.body!r}{nearest_name(pulley.body, names)}"
                yield Fault(f"scene.cords.{i}.over.{k}.body", text)


def _names(key: str, items: Iterable[SceneJoint | SceneSpring | SceneCord]) -> Iterator[Fault]:
    for name, count in Counter(item.name for item in items).items():
        if count > 1:
            yield Fault(f"scene.{key}", f"the name {name!r} is used {count} times; names must differ")


def _bodies(path: str, item: SceneJoint | SceneSpring | SceneCord, names: list[str]) -> Iterator[Fault]:
    for end in ("first", "second"):
        name = getattr(item, end)
        if name not in names:
            yield Fault(f"{path}.{end}", f"no body is called {name!r}{nearest_name(name, names)}")


def _opening(joint: SceneJoint, place: tuple[float, ...]) -> float:
    """Distance of the point from the line or plane at the start, m; 0 for round-off."""
    if joint.kind not in WITH_TO or joint.kind == "distance":
        return 0.0
    assert joint.to is not None and joint.axis is not None
    way, axis = np.subtract(joint.to, joint.at), np.array(joint.axis) / np.linalg.norm(joint.axis)
    along = float(way @ axis)
    off = float(np.linalg.norm(way - along * axis)) if joint.kind == "in-line" else abs(along)
    size = max(float(np.linalg.norm(way)), math.dist(joint.to, place))
    return off if off > _CLOSED * size else 0.0
