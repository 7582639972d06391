"""Lines of `fsm check` on ideal joints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from fsm.check.view import CheckContext
from fsm.model.faults.joint_state import JointsAtStart
from fsm.text.report_text import count


def joint_lines(view: CheckContext) -> Iterator[str]:
    """Joints by kind, the degrees of freedom that they leave, and all locked directions that repeat others."""
    joints = view.scene.joints
    if not joints:
        return
    kinds = ", ".join(f"{number} {kind}" for kind, number in Counter(joint.kind for joint in joints).items())
    yield f"{count(len(joints), 'ideal joint')}: {kinds}"
    found = JointsAtStart(view.scene)
    repeated = found.repeated
    left = count(found.degrees_of_freedom, "degree of freedom", "degrees of freedom")
    yield f"{left} at the start, after {count(len(found.labels), 'locked direction')}"
    if repeated:
        text = "follow from those before them; reactions among these directions are those of least size"
        yield f"{count(len(repeated), 'locked direction')} {text}: {', '.join(repeated)}"
