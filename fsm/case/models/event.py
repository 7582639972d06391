"""Section [[event]] of a case: what happens in a motion when a condition becomes true."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from fsm.case.schema.model import Model, Name

Text = Annotated[str, Field(min_length=1, max_length=200)]


class Event(Model):
    """Actions of a motion at the moment in which a condition becomes true; an event happens once."""

    name: Name | None = Field(
        default=None, description="name of the event in results",
        json_schema_extra={"default": '"event 1", "event 2", ...', "range": "all different"},
    )  # fmt: skip
    when: Text = Field(
        description='condition: `"hinge 1.angle < 0.5 deg"` for any channel, `"contact a - b"`, `"time > 3 s"`, or several '
        "of them joined by `and`"
    )
    do: tuple[Text, ...] = Field(
        min_length=1,
        description='what happens, in this order: `"release NAME"`, `"lock JOINT"`, `"unlock JOINT"`, `"change damper JOINT '
        'to VALUE"`, `"end step"`',
    )

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> Mapping[str, Any]:
        """Section with a list in place of one action."""
        return {**written, "do": [written["do"]]} if isinstance(written.get("do"), str) else written


def event_names(events: tuple[Event, ...]) -> list[str]:
    """Names of all events."""
    return [event.name or f"event {number}" for number, event in enumerate(events, 1)]
