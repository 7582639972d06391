"""Words of `[[event]]`, and scenes of cases with events."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from fsm.case.models.coupling import OWN_COUPLINGS
from fsm.case.models.event import Event, event_names
from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import GROUND, Body, Scene
from fsm.case.schema.known_names import nearest_name
from fsm.case.schema.units import to_si
from fsm.errors import CaseError, Fault

TIME = "time"
"""Subject of a condition on the time of the run."""
_COMPARED = re.compile(r"(?P<subject>[^<>=]+?)\s*(?P<sign><=|>=|<|>)\s*(?P<value>[^<>=]+)")
_AND = re.compile(r"\s+and\s+")
_CONTACT = "contact "
_HELD = "hold of "
"""Begin of the name of the joint that holds a body until an event releases it."""
_UNITS = (
    {"damper": "N m s/rad", "spring": "N m/rad", "friction": "N m"}, {"damper": "N s/m", "spring": "N/m", "friction": "N"},
)  # fmt: skip
"""Units of what an event changes in joints that turn, and in joints that slide."""
_ACTIONS = '"release NAME", "lock JOINT", "unlock JOINT", "change damper JOINT to VALUE" or "end step"'


class Condition(NamedTuple):
    """Part of a condition: a subject (channel, "time" or a contact pair), a sense, a value with its unit, strict or not.

    A contact pair has no value.
    """

    subject: str
    contact: bool
    sense: float = 1.0
    value: str = ""
    strict: bool = True


class Action(NamedTuple):
    """Action: "release", "lock", "unlock", "change" or "end"; what it acts on ("joint", "spring", "cord", "coupling",
    "latch", or the changed part of a joint), the name of that, and the new value, SI.
    """

    verb: str
    what: str = ""
    name: str = ""
    value: float = 0.0


def conditions_of(text: str) -> tuple[Condition, ...]:
    """Parts of a condition, all of which must be true.

    Raises
    ------
    ValueError
        The words are not those of a condition.
    """
    return tuple(_condition(part.strip()) for part in _AND.split(text.strip()))


def _condition(text: str) -> Condition:
    if text.startswith(_CONTACT):
        return Condition(text.removeprefix(_CONTACT).strip(), True)
    match = _COMPARED.fullmatch(text)
    if match is None:
        raise ValueError(f'{text!r} is no condition; write "CHANNEL < VALUE", "time > VALUE" or "contact A - B"')
    sense = 1.0 if match["sign"].startswith(">") else -1.0
    if match["subject"] == TIME and sense < 0.0:
        raise ValueError(f'{text!r} is true from the start; write "time > VALUE"')
    return Condition(match["subject"], False, sense, match["value"].strip(), match["sign"] in "<>")


def quantity(text: str, unit: str, system: str) -> float:
    """Value in SI of a text with a unit, or of a number in the unit system of the case.

    Raises
    ------
    ValueError
        The text is no number, or its unit does not fit.
    """
    try:
        plain: float | str = float(text)
    except ValueError:
        plain = text
    return to_si(plain, unit, system)


class _Known(NamedTuple):
    """What an event can act on, by name."""

    joints: Mapping[str, bool]
    """Joints; the value is whether the joint slides."""
    parts: Mapping[str, str]
    """Kinds of all that can be released, by name."""
    latches: frozenset[str]
    single: frozenset[str]
    """Joints with one coordinate."""


def _known(scene: Scene) -> _Known:
    joints = {joint.name: joint.kind == "prismatic" for joint in scene.joints}
    parts = {coupling.name: "coupling" for coupling in scene.couplings if coupling.kind in OWN_COUPLINGS}
    parts |= {cord.name: "cord" for cord in scene.cords} | {spring.name: "spring" for spring in scene.springs}
    parts |= {body.name: "body" for body in scene.bodies if body.held} | dict.fromkeys(joints, "joint")
    held = {joint.name.removeprefix(_HELD): "body" for joint in scene.joints if joint.name.startswith(_HELD)}
    return _Known(
        joints, held | parts, frozenset(joint.name for joint in scene.joints if joint.latch is not None),
        frozenset(joint.name for joint in scene.joints if joint.kind in ("revolute", "prismatic", "screw")),
    )  # fmt: skip


def action_of(text: str, scene: Scene, system: str) -> Action:
    """Action from its words.

    Raises
    ------
    ValueError
        The words are not those of an action, or a name does not exist.
    """
    known = _known(scene)
    verb, _, rest = " ".join(text.split()).partition(" ")
    if verb == "end" and rest in ("step", "run"):
        return Action("end")
    if verb == "release" and rest.startswith("latch ") and rest not in known.parts:
        name = rest.removeprefix("latch ").removeprefix("of ")
        return Action("release", "latch", _one_of(name, sorted(known.latches), "no joint with a latch is called"))
    if verb == "release" and rest:
        name = _one_of(rest, list(known.parts), "no joint, held body, spring, cord or coupling is called")
        if known.parts[name] == "body":
            return Action("release", "joint", f"{_HELD}{name}")
        return Action("release", known.parts[name], name)
    if verb in ("lock", "unlock") and rest:
        return Action(verb, "joint", _one_of(rest, list(known.joints), "no joint is called"))
    if verb == "change":
        return _change(rest, known, system)
    raise ValueError(f"{text!r} is no action; write {_ACTIONS}")


def _change(text: str, known: _Known, system: str) -> Action:
    part, _, rest = text.partition(" ")
    if part not in _UNITS[0]:
        raise ValueError(f'an event changes "damper", "spring" or "friction" of a joint, not {part!r}')
    rest = rest.removeprefix("of ")
    names = [name for name in known.single if rest == name or rest.startswith((f"{name} ", f"{name}="))]
    if not names:
        listed = sorted(known.single)
        raise ValueError(f"no joint with one coordinate has the name at the begin of {rest!r}{nearest_name(rest, listed)}")
    name = max(names, key=len)
    value = re.sub(r"^(to|=)\s*", "", rest[len(name) :].strip())
    unit = _UNITS[known.joints[name]][part]
    found = quantity(value, unit, system)
    if found < 0.0:
        raise ValueError(f"{value!r} is negative; a {part} is not")
    return Action("change", part, name, found)


def _one_of(name: str, known: list[str], text: str) -> str:
    if name not in known:
        raise ValueError(f"{text} {name!r}{nearest_name(name, known)}")
    return name


def event_faults(events: tuple[Event, ...], scene: Scene, system: str) -> Iterator[Fault]:
    """Faults of the words of all events and of the names in their actions and contacts."""
    names = event_names(events)
    pairs = [f"{pair.first} - {pair.second}" for pair in scene.pairs]
    for number, event in enumerate(events):
        if names.index(names[number]) < number:
            yield Fault(f"event.{number}.name", f"the name {names[number]!r} is used twice; names must differ")
        try:
            for condition in conditions_of(event.when):
                if condition.contact and not {condition.subject, turned(condition.subject)} & set(pairs):
                    text = f"no contact pair is called {condition.subject!r}{nearest_name(condition.subject, pairs)}"
                    raise ValueError(text)
        except ValueError as error:
            yield Fault(f"event.{number}.when", str(error))
        for k, text in enumerate(event.do):
            try:
                action = action_of(text, scene, system)
                body = next((body for body in scene.bodies if f"{_HELD}{body.name}" == action.name), None)
                if body is not None and not (body.mass > 0.0 and min(body.inertia) > 0.0):
                    raise ValueError(f"{body.name!r} can move after its release, so mass and inertia must be positive")
            except ValueError as error:
                yield Fault(f"event.{number}.do.{k}", str(error))


def turned(pair: str) -> str:
    """Name of a contact pair from its second side."""
    return " - ".join(reversed(pair.split(" - ")))


def released_bodies(events: tuple[Event, ...], scene: Scene, system: str) -> list[Body]:
    """Held bodies that events release."""
    actions = [action_of(text, scene, system) for event in events for text in event.do]
    names = {action.name for action in actions if action.verb == "release"}
    return [body for body in scene.bodies if body.held and f"{_HELD}{body.name}" in names]


def held_by(body: Body) -> str:
    """Name of the joint that holds a body until its release."""
    return f"{_HELD}{body.name}"


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
    return scene.with_parts(actions=tuple(tuple(action_of(text, scene, system) for text in event.do) for event in events))
