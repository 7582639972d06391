"""Lines of `fsm check` on ideal joints."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from fsm.case.derived.frame_bodies import with_frames
from fsm.case.derived.joint_frames import joint_axes
from fsm.case.derived.joint_margin import margin_results
from fsm.case.derived.rebound import loss_of_rebound
from fsm.case.models.joint import TURNING, SceneJoint
from fsm.case.models.joint_action import LEAST_REBOUND
from fsm.case.models.scene import Scene
from fsm.check.view import CheckContext
from fsm.model.plan.joint_state import MOST_FOLLOWED, JointsAtStart
from fsm.model.plan.motion_method import MotionMethod
from fsm.text.shown_units import count, margin_texts, negative_margins, shown, shown_points

_LISTED = 12
"""Largest number of joints with a line each."""
_PLANES = ("y to z", "z to x", "x to y")
_ALONG = 1e-9
"""Part of a unit vector across an axis, below which it is along it."""
_NOTABLE = 0.01
"""Relative change of a restitution for which the rate of the impact is stated."""
_ACTIONS = ("spring", "damper", "friction", "stop", "latch", "harness", "motor")


def joint_lines(view: CheckContext) -> Iterator[str]:
    """Joints by kind, the degrees of freedom that they leave, and all locked directions that repeat others."""
    joints = view.scene.joints
    if not joints:
        return
    kinds = ", ".join(f"{number} {kind}" for kind, number in Counter(joint.kind for joint in joints).items())
    yield f"{count(len(joints), 'ideal joint')}: {kinds}"
    yield from (_joint_text(joint) for joint in joints[:_LISTED])
    if len(joints) > _LISTED:
        yield f"and {len(joints) - _LISTED} more"
    if view.scene.flexible:
        yield from _beside_nodes(view.scene)
        return
    found = JointsAtStart(view.scene)
    yield from _rebounds(joints, MotionMethod(found))
    repeated = found.repeated
    left = count(found.degrees_of_freedom, "degree of freedom", "degrees of freedom")
    yield f"{left} at the start, after {count(len(found.labels), 'locked direction')}"
    if repeated:
        text = "follow from those before them; reactions among these directions are those of least size"
        yield f"{count(len(repeated), 'locked direction')} {text}: {', '.join(repeated)}"
    if len(joints) > int(found.free.sum()) and len(found.labels) * view.records > MOST_FOLLOWED:
        many = f"{count(len(found.labels), 'locked direction')} at {view.records} records, more than {MOST_FOLLOWED} in all"
        yield f"branch points are not looked for: {many}; save less often"


def _beside_nodes(scene: Scene) -> Iterator[str]:
    """Locked directions that repeat others however films, cables, beams, trusses and facets deform."""
    scene = with_frames(scene)
    on_nodes = {frame.name for frame in scene.frames}
    loose = {"mass": 1.0, "inertia": (1.0, 1.0, 1.0), "held": False}
    bodies = tuple(body.model_copy(update=loose) if body.name in on_nodes else body for body in scene.bodies)
    found = JointsAtStart(scene.model_copy(update={"bodies": bodies}))
    directions = count(len(found.labels), "locked direction")
    text = f"{directions} at the start; {len(found.repeated)} of them follow from those before them"
    names = f": {', '.join(found.repeated)}" if found.repeated else ""
    yield f"{text} however the flexible parts deform{names}"
    yield "degrees of freedom, and directions that repeat others because of the meshes of flexible parts, are not counted"


def _rebounds(joints: Sequence[SceneJoint], motion: MotionMethod) -> Iterator[str]:
    """What a load changes in the restitution of stops."""
    for joint in [each for each in joints if each.stop is not None and each.stop.restitution is not None][:_LISTED]:
        assert joint.stop is not None and joint.stop.restitution is not None
        e = max(joint.stop.restitution, LEAST_REBOUND)
        inertia, effort = motion.at_joint(joint)
        if e == 1.0 or math.isinf(inertia):
            continue
        letters, units = ("F", "m"), ("N", "m/s", "N s/m")
        if joint.kind != "prismatic":
            letters, units = ("M", "J"), ("N m", "rad/s", "N m s/rad")
        loss, impedance = loss_of_rebound(e), math.sqrt(joint.stop.stiffness * inertia)
        text = f"stop of {joint.name}: restitution {joint.stop.restitution:g} without a load; a load {letters[0]} towards it"
        text += f" changes it by -{loss:.3g} {letters[0]}/(v sqrt(k {letters[1]})) in an impact at the rate v"
        text += f", with sqrt(k {letters[1]}) = {impedance:.3g} {units[2]}"
        if effort > 0.0:
            least = loss * effort / (_NOTABLE * e * impedance)
            text += f": {shown(effort, units[0])}, as at the start, by 1 % and more below {shown(least, units[1])}"
        yield text


def _joint_text(joint: SceneJoint) -> str:
    """Place, axis, positive sense and actions of a joint."""
    text = f"{joint.name}: {joint.kind}, from {joint.first} to {joint.second}, at {shown_points([joint.at])}"
    if joint.axis is not None:
        axis = joint_axes(joint)[2]
        text += f", axis ({', '.join(f'{x + 0.0:.4g}' for x in axis.round(12))})"
        if joint.kind in TURNING:
            main = int(np.argmax(np.abs(axis)))
            straight = abs(axis[main]) > 1.0 - _ALONG
            plane = _PLANES[main] if axis[main] > 0.0 else " to ".join(reversed(_PLANES[main].split(" to ")))
            text += f"; a positive angle turns {joint.second} {f'from {plane}' if straight else 'right-handed about it'}"
        elif joint.kind == "prismatic":
            text += f"; a positive displacement moves {joint.second} along it"
    if joint.angle:
        text += f"; {shown(joint.angle, 'rad')} at the start"
    actions = [action for action in _ACTIONS if getattr(joint, action) is not None]
    return f"{text}; {', '.join(actions)}" if actions else text


def margin_lines(view: CheckContext) -> Iterator[str]:
    """Smallest motorisation margins."""
    yield from margin_texts(margin_results(view.case.margin, view.scene.joints))


def margin_warnings(view: CheckContext) -> Iterator[str]:
    """Negative motorisation margins."""
    yield from negative_margins(margin_results(view.case.margin, view.scene.joints))
