"""Scene of a case with `[[event]]`: what its events do, and joints in place of held bodies that an event releases."""

from __future__ import annotations

from fsm.case.derived.event_words import action_of, event_faults, held_by, released_bodies
from fsm.case.models.event import Event
from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import GROUND, Scene
from fsm.errors import CaseError


def with_events(scene: Scene, events: tuple[Event, ...], system: str) -> Scene:
    """Scene whose events act on its parts.

    A held body that an event releases becomes free, with a fixed joint to the ground.

    Raises
    ------
    CaseError
        Faults of the words of the events, and unknown names.
    """
    faults = list(event_faults(events, scene, system))
    if faults:
        raise CaseError(faults)
    released = released_bodies(events, scene, system)
    joints = tuple(
        SceneJoint(name=held_by(body), kind="fixed", first=GROUND, second=body.name, at=body.position) for body in released
    )
    bodies = tuple(body.model_copy(update={"held": False}) if body in released else body for body in scene.bodies)
    scene = scene.model_copy(update={"bodies": bodies, "joints": (*scene.joints, *joints)})
    return scene.with_actions(tuple(tuple(action_of(text, scene, system) for text in event.do) for event in events))
