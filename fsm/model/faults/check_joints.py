"""Faults of ideal joints, found before the scene is compiled."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from fsm.case.models.joint import WITH_TO, SceneJoint
from fsm.case.models.scene import GROUND, Scene
from fsm.case.schema.known_names import nearest_name
from fsm.errors import Fault
from fsm.text.shown_units import shown

_CLOSED = 1e-9
"""Opening at the start, relative to the distance from `at` to `to`, that counts as closed."""


def joint_faults(scene: Scene) -> Iterator[Fault]:
    """Faults of `[[scene.joints]]`."""
    if scene.joints and (scene.flexible or scene.chambers):
        text = "ideal joints act between rigid bodies in a scene without films, cables, beams, trusses and flexible facets; "
        yield Fault("scene.joints", text + "use [[scene.elements]] in this scene")
    for name, count in Counter(joint.name for joint in scene.joints).items():
        if count > 1:
            yield Fault("scene.joints", f"the name {name!r} is used {count} times; names must differ")
    names = [GROUND, *(body.name for body in scene.bodies)]
    driven = {name for drive in scene.drives for name in drive.moved}
    fixed = {GROUND, *driven, *(body.name for body in scene.bodies if body.held)}
    for i, joint in enumerate(scene.joints):
        path = f"scene.joints.{i}"
        for end in ("first", "second"):
            name = getattr(joint, end)
            if name not in names:
                yield Fault(f"{path}.{end}", f"no body is called {name!r}{nearest_name(name, names)}")
        if {joint.first, joint.second} <= fixed:
            text = f"joint {joint.name!r} is between {joint.first!r} and {joint.second!r}, which are both held or driven; "
            yield Fault(path, text + "remove it, or free a body")
        open_by = _opening(joint)
        if open_by > 0.0:
            what = "line" if joint.kind == "in-line" else "plane"
            text = f"the point is {shown(open_by, 'm')} off the {what} of joint {joint.name!r} at the start"
            yield Fault(f"{path}.to", f"{text}; move `to` or `at`")


def _opening(joint: SceneJoint) -> float:
    """Distance of the point from the line or plane at the start, m; 0 for round-off."""
    if joint.kind not in WITH_TO or joint.kind == "distance":
        return 0.0
    assert joint.to is not None and joint.axis is not None
    way, axis = np.subtract(joint.to, joint.at), np.array(joint.axis) / np.linalg.norm(joint.axis)
    along = float(way @ axis)
    off = float(np.linalg.norm(way - along * axis)) if joint.kind == "in-line" else abs(along)
    return off if off > _CLOSED * float(np.linalg.norm(way)) else 0.0
