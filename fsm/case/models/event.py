"""Section [[event]] of a case: what happens in a motion when a condition becomes true."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from fsm.case.schema.model import Key, Model, Name

Text = Annotated[str, Field(min_length=1, max_length=200)]


class Event(Model):
    """Actions of a motion at the moment in which a condition becomes true; an event happens once."""

    name: Name | None = Key(
        "name of the event in results", default=None, shown='"event 1", "event 2", ...', within="all different"
    )
    when: Text = Key(
        'condition: `"hinge 1.angle < 0.5 deg"` for any channel, `"contact a - b"`, `"time > 3 s"`, or several '
        "of them joined by `and`",
    )  # fmt: skip
    do: tuple[Text, ...] = Key(
        'what happens, in this order: `"release NAME"`, `"lock JOINT"`, `"unlock JOINT"`, `"change damper JOINT '
        'to VALUE"`, `"end step"`', min_length=1,
    )  # fmt: skip

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> Mapping[str, Any]:
        """Section with a list in place of one action."""
        return {**written, "do": [written["do"]]} if isinstance(written.get("do"), str) else written


def event_names(events: tuple[Event, ...]) -> list[str]:
    """Names of all events."""
    return [event.name or f"event {number}" for number, event in enumerate(events, 1)]
