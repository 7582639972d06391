"""Events of joints in a summary, and in a file: latches that close and open, stops that are hit."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fsm.io.atomic_write import atomic_write
from fsm.text.shown_units import shown

_COLUMNS = ("time", "what", "joint", "coordinate", "rate_before", "impulse", "largest", "unit")
LISTED = 20
"""Largest number of events that the printed table lists."""


def write_events_csv(events: Sequence[Mapping[str, Any]], target: Path) -> None:
    """Write events: time (s), what happens, joint, coordinate and rate before it, impulse and largest effort in SI, and the
    unit of the coordinate; with "rad" the impulse is in N m s and the effort in N m, with "m" in N s and N. `[[event]]` has
    its name in place of a joint, and no numbers.
    """
    with atomic_write(target) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["time (s)", *_COLUMNS[1:]])
        for event in events:
            writer.writerow([f"{event[key]:.12g}" if isinstance(event[key], float) else event[key] for key in _COLUMNS])


def event_lines(events: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Table of events, one line each."""
    for event in events[:LISTED]:
        if not event["unit"]:  # of [[event]]
            yield f"{event['time']:.6g} s  {event['joint']}: {event['what']}"
            continue
        rate, impulse, largest = event["rate_before"], event["impulse"], event["largest"]
        if event["unit"] == "rad":
            units = shown(rate, "rad/s"), shown(impulse, "N m s"), shown(largest, "N m"), "moment"
        else:
            units = shown(rate, "m/s"), shown(impulse, "N s"), shown(largest, "N"), "force"
        text = f"{event['time']:.6g} s  {event['joint']}: {event['what']}, rate {units[0]}"
        yield text + ("" if event["what"] == "latch opens" else f", impulse {units[1]}, largest {units[3]} {units[2]}")
    if len(events) > LISTED:
        yield f"and {len(events) - LISTED} more; see events.csv"
