"""Lines of `fsm check` on ideal joints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from fsm.case.derived.joint_frames import joint_axes
from fsm.case.derived.joint_margin import margin_results
from fsm.case.models.joint import TURNING, SceneJoint
from fsm.check.view import CheckContext
from fsm.model.plan.joint_state import JointsAtStart
from fsm.text.margin_text import margin_texts, negative_margins
from fsm.text.report_text import count
from fsm.text.shown_units import shown, shown_points

_LISTED = 12
"""Largest number of joints with a line each."""
_PLANES = ("y to z", "z to x", "x to y")
_ALONG = 1e-9
"""Part of a unit vector across an axis, below which it is along it."""
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
    found = JointsAtStart(view.scene)
    repeated = found.repeated
    left = count(found.degrees_of_freedom, "degree of freedom", "degrees of freedom")
    yield f"{left} at the start, after {count(len(found.labels), 'locked direction')}"
    if repeated:
        text = "follow from those before them; reactions among these directions are those of least size"
        yield f"{count(len(repeated), 'locked direction')} {text}: {', '.join(repeated)}"


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
