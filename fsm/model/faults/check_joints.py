"""Faults of ideal joints, found before the scene is compiled.

Faults of couplings, found before the scene is compiled.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np

from fsm.case.derived.frame_bodies import part_places
from fsm.case.models.coupling import SceneCoupling
from fsm.case.models.joint import WITH_TO, SceneJoint
from fsm.case.models.scene import GROUND, Scene
from fsm.case.models.spring import SceneCord, SceneSpring
from fsm.case.schema.known_names import nearest_name
from fsm.errors import Fault
from fsm.text.shown_units import shown

_CLOSED = 1e-9
"""Opening at the start that counts as closed, relative to the distances of `to` from `at` and from the body."""


_OF_POINTS = "spherical", "distance", "in-line", "in-plane"
"""Kinds that carry no moment on their second body; the first two carry none on their first body either."""


def joint_faults(scene: Scene) -> Iterator[Fault]:
    """Faults of `[[scene.joints]]`, `[[scene.springs]]` and `[[scene.cords]]`."""
    for key in ("joints", "springs", "cords"):
        if getattr(scene, key) and scene.built.panels_of_gas is not None:
            text = f'{key} are not available beside gas in rigid panels; give sheet.facets = "bars" or "flexible"'
            yield Fault(f"scene.{key}", text)
    yield from _springs(scene)
    yield from _cords(scene)
    yield from _names("joints", scene.joints)
    names = _places(scene)
    driven = {name for drive in scene.drives for name in drive.moved}
    places = {body.name: body.position for body in scene.bodies}
    frames = {frame.name for frame in scene.frames}
    fixed = {GROUND, *driven, *(body.name for body in scene.bodies if body.held)} - frames
    for i, joint in enumerate(scene.joints):
        path = f"scene.joints.{i}"
        yield from _bodies(path, joint, names)
        yield from _on_points(path, joint, scene)
        yield from _off_points(path, joint, scene)
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
    yield from _names("springs", scene.springs)
    names = _places(scene)
    for i, spring in enumerate(scene.springs):
        path = f"scene.springs.{i}"
        yield from _bodies(path, spring, names)
        yield from _off_points(path, spring, scene)
        if spring.first == spring.second:
            yield Fault(path, f"spring {spring.name!r} joins {spring.first!r} to itself; `first` and `second` must differ")


def _cords(scene: Scene) -> Iterator[Fault]:
    """Faults of `[[scene.cords]]`."""
    yield from _names("cords", scene.cords)
    names = _places(scene)
    for i, cord in enumerate(scene.cords):
        yield from _bodies(f"scene.cords.{i}", cord, names)
        yield from _off_points(f"scene.cords.{i}", cord, scene)
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


def _places(scene: Scene) -> list[str]:
    """Names of the ground, of all bodies and frames, and of all ends and edges of flexible parts."""
    return [GROUND, *(body.name for body in scene.bodies), *part_places(scene)]


def _on_points(path: str, joint: SceneJoint, scene: Scene) -> Iterator[Fault]:
    """Faults of joints at points of trusses and of sheets of bars, which have no axes and carry no moment."""
    points = {frame.name for frame in scene.frames if frame.point is not None}
    for end, kinds in (("first", _OF_POINTS[:2]), ("second", _OF_POINTS)):
        if getattr(joint, end) in points and joint.kind not in kinds:
            text = f"{getattr(joint, end)!r} is a point without axes, which carries no moment"
            yield Fault(f"{path}.kind", f"{text}; use kind {' or '.join(kinds)}")


def _off_points(path: str, item: SceneJoint | SceneSpring | SceneCord, scene: Scene) -> Iterator[Fault]:
    """Faults of places that are off the point of a truss or of a sheet of bars on which they are."""
    places = {body.name: body.position for body in scene.bodies}
    points = {frame.name for frame in scene.frames if frame.point is not None}
    for end, key in (("first", "at"), ("second", "at" if item.to is None else "to")):
        name, at = getattr(item, end), getattr(item, key)
        if name in points and (off := math.dist(at, places[name])) > _CLOSED * math.hypot(*places[name], 1e-3):
            text = f"{name!r} is a point without axes, and `{key}` is {shown(off, 'm')} off it; give the point itself"
            yield Fault(f"{path}.{key}", text)


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


def coupling_faults(scene: Scene) -> Iterator[Fault]:
    """Faults of `[[scene.couplings]]`."""
    elements, joints = {element.name: element for element in scene.elements}, {joint.name: joint for joint in scene.joints}
    for name, times in Counter(coupling.name for coupling in scene.couplings).items():
        if times > 1:
            yield Fault("scene.couplings", f"the name {name!r} is used {times} times; names must differ")
    for i, coupling in enumerate(scene.couplings):
        path = f"scene.couplings.{i}"
        found: list[SceneJoint] = []
        for k, name in enumerate(coupling.joints):
            if name in joints:
                found.append(joints[name])
                if joints[name].kind not in ("revolute", "prismatic"):
                    text = f"joint {name!r} of kind {joints[name].kind!r} has no single coordinate"
                    yield Fault(f"{path}.joints.{k}", f"{text}; couple revolute or prismatic joints")
            elif name not in elements:
                known = [*joints, *elements]
                what = "joint or element" if joints else "element"
                yield Fault(f"{path}.joints.{k}", f"no {what} is called {name!r}{nearest_name(name, known)}")
            elif elements[name].frame == "chord":
                text = f'{name!r} is a hinge of finite length (`frame` "chord"), whose twist no coupling has'
                yield Fault(f"{path}.joints.{k}", text)
        yield from _sorts(path, coupling, found, all(name in joints or name in elements for name in coupling.joints))


def _sorts(path: str, coupling: SceneCoupling, joints: list[SceneJoint], known: bool) -> Iterator[Fault]:
    """Faults of the sorts of joints of a coupling."""
    if known and 0 < len(joints) < len(coupling.joints):
        yield Fault(f"{path}.joints", "couples an ideal joint with a force element; use joints of one sort")
    if known and coupling.ideal and not joints:
        text = "an ideal coupling acts on [[scene.joints]]; give a stiffness for force elements, for example"
        yield Fault(f"{path}.parameters.stiffness", f'{text} "5 N m/rad"')
    if len(set(coupling.joints)) < len(coupling.joints):
        yield Fault(f"{path}.joints", f"{coupling.joints[0]!r} is coupled with itself")
    slides = bool(joints) and joints[0].kind == "prismatic"
    if known and coupling.kind in ("gear", "rack") and slides != (coupling.kind == "rack"):
        moves, other = ("slides", "rack") if slides else ("turns", "gear")
        yield Fault(f"{path}.kind", f'the first joint {coupling.joints[0]!r} {moves}, which is kind "{other}"')
