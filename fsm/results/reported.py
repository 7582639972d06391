"""Results that a case asks for in `report`, and the reactions of its joints.

Events of joints in a summary, and in a file: latches that close and open, stops that are hit.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fsm.io.csv_file import write_csv
from fsm.results.channel import AXES, Channel
from fsm.text.shown_units import shown

ROUND_OFF = 1e-12
"""Size of a channel that is shown as 0, in SI units."""
_FORCE = re.compile(r"joint\.(.+)\.force")


def report_of(channels: Mapping[str, Channel], names: Sequence[str], time: np.ndarray) -> list[dict[str, Any]]:
    """Values of channels at the start and at the end, and their extremes with their times (s), in SI units.

    A channel with several components has an entry for each.
    """
    found = []
    for name in names:
        for label, values in channels[name].columns.items():
            entry: dict[str, Any] = {"name": label, "unit": channels[name].info.unit}
            if np.isfinite(values).any():
                low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
                numbers = {
                    "start": values[0], "end": values[-1], "min": values[low], "min_time": time[low], "max": values[high],
                    "max_time": time[high],
                }  # fmt: skip
                entry |= {key: float(value) for key, value in numbers.items() if np.isfinite(value)}
            found.append(entry)
    return found


def columns_of(channels: Mapping[str, Channel], labels: Iterable[str]) -> dict[str, tuple[str, np.ndarray]]:
    """Unit and values (n_records,) of the components with these labels, without those that are not recorded."""
    every = {
        label: (channel.info.unit, values) for channel in channels.values() for label, values in channel.columns.items()
    }
    return {label: every[label] for label in labels if label in every}


def reactions(channels: Mapping[str, Channel]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Sizes of force (N) and moment (N m) of every ideal joint over the records, (n_records,) each, by its name."""
    found = {}
    for name, force in channels.items():
        match = _FORCE.fullmatch(name)
        moment = channels.get(f"joint.{match[1]}.moment") if match else None
        if match and moment is not None and force.info.dims == moment.info.dims == (AXES,):
            found[match[1]] = (np.linalg.norm(force.values, axis=1), np.linalg.norm(moment.values, axis=1))
    return found


def largest_reactions(channels: Mapping[str, Channel], time: np.ndarray) -> list[dict[str, Any]]:
    """Largest force (N) and moment (N m) of every ideal joint at the records, with their times (s)."""
    found = []
    for name, sizes in reactions(channels).items():
        entry: dict[str, Any] = {"joint": name}
        for key, values in zip(("force", "moment"), sizes, strict=True):
            if np.isfinite(values).any():
                at = int(np.nanargmax(values))
                entry |= {key: float(values[at]), f"{key}_time": float(time[at])}
        found.append(entry)
    return found


def shown_name(label: str) -> str:
    """Name of a channel of a joint in texts and figures: without its kind."""
    return label.removeprefix("joint.")


_COLUMNS = ("time", "what", "joint", "coordinate", "rate_before", "impulse", "largest", "unit")
LISTED = 20
"""Largest number of events that the printed table lists."""


def write_events_csv(events: Sequence[Mapping[str, Any]], target: Path) -> None:
    """Write events: time (s), what happens, joint, coordinate and rate before it, impulse and largest effort in SI, and the
    unit of the coordinate; with "rad" the impulse is in N m s and the effort in N m, with "m" in N s and N. `[[event]]` has
    its name in place of a joint, and no numbers.
    """
    write_csv(target, ["time (s)", *_COLUMNS[1:]], ([event[key] for key in _COLUMNS] for event in events))


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
