"""Output channels: named quantities over time with unit and dimensions, and their columns, extremes and selection."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fsm.errors import Fault
from fsm.io.csv_file import write_csv
from fsm.text.short_repr import ShortRepr

MOST_CHANNELS = 10_000
"""Largest number of channels of a run; each one is a dataset of the results file."""
_MOST_NAMED = 5
"""Number of similar names in a message."""


class Dim(NamedTuple):
    """Dimension of a channel besides time.

    Attributes
    ----------
    name : str
        Name in the results file; equal names have equal labels.
    labels : texts, or coordinates as numbers
    unit : unit of the coordinates; "1" for texts
    text : description
    """

    name: str
    labels: tuple[str, ...] | tuple[float, ...]
    unit: str = "1"
    text: str = ""


AXES = Dim("axis", ("x", "y", "z"), "1", "inertial axis")


@dataclass(frozen=True)
class ChannelInfo:
    """Description of a channel.

    Attributes
    ----------
    name : str
        Kind, object and quantity with points between them, for example ``crease.3.moment``.
    unit : SI unit
    dims : dimensions besides time, outer first
    text : description
    """

    name: str
    unit: str
    dims: tuple[Dim, ...] = ()
    text: str = ""

    @property
    def labels(self) -> list[str]:
        """Names of the components, one for each number of a record; the name alone for a scalar."""
        names = [self.name]
        for dim in self.dims:
            names = [f"{name} {_label(label)}" for name in names for label in dim.labels]
        return names


@dataclass(frozen=True, repr=False)
class Channel(ShortRepr):
    """Channel with its values, (n_records, ...) array."""

    info: ChannelInfo
    values: np.ndarray = field(repr=False)

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Components by label, (n_records,) each."""
        return dict(zip(self.info.labels, self.values.reshape(len(self.values), -1).T, strict=True))


def select_channels(
    names: Iterable[str], patterns: Sequence[str], path: str = "save.channels"
) -> tuple[list[str], list[Fault]]:
    """Names that match any pattern (`fnmatch`), in the order of the names, and a fault for every pattern without a match."""
    names = list(names)
    chosen = [name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)]
    faults = []
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            faults.append(Fault(path, f'no channel matches "{pattern}"; {_hint(pattern, names)}'))
    if len(chosen) > MOST_CHANNELS:
        text = f"{len(chosen):,} channels match; at most {MOST_CHANNELS:,} are recorded; give narrower patterns"
        faults.append(Fault(path, text))
    return chosen, faults


def extremes_of(channels: Mapping[str, Channel], time: np.ndarray, travel: np.ndarray) -> dict[str, Any]:
    """Smallest and largest value of every channel with the time (s), the travel (m) or turn (rad) of the first drive,
    and the component.

    A channel with three components at most has an entry for each; a longer channel has the extremes over all
    components.
    """
    found: dict[str, Any] = {}
    for channel in channels.values():
        columns = channel.columns
        if len(columns) <= 3:
            for label, values in columns.items():
                found[label] = _extremes(channel.info.unit, {label: values}, time, travel)
        else:
            found[channel.info.name] = _extremes(channel.info.unit, columns, time, travel)
    return found


def write_channels_csv(channels: Mapping[str, Channel], first: Mapping[str, np.ndarray], path: Path) -> None:
    """Write all channels with one record per row and 12 significant digits; the unit is in brackets in the heading.

    `first` are the first columns by heading: travel or turn of the first drive, and time.
    """
    columns = dict(first)
    for channel in channels.values():
        columns |= {f"{label} ({channel.info.unit})": values for label, values in channel.columns.items()}
    write_csv(path, columns, np.column_stack(list(columns.values())))


def _label(label: str | float) -> str:
    return label if isinstance(label, str) else f"{label:.6g}"


def _hint(pattern: str, names: Sequence[str]) -> str:
    if not names:
        return "the case offers no channels"
    near = difflib.get_close_matches(pattern, names, _MOST_NAMED, 0.4) or list(dict.fromkeys(names))[:_MOST_NAMED]
    return f"nearest of {len(names)} names: {', '.join(near)}"


def _extremes(unit: str, columns: Mapping[str, np.ndarray], time: np.ndarray, travel: np.ndarray) -> dict[str, Any]:
    labels, values = list(columns), np.column_stack(list(columns.values()))
    entry: dict[str, Any] = {"unit": unit}
    if not np.isfinite(values).any():
        return entry
    for key, place in (("min", np.nanargmin(values)), ("max", np.nanargmax(values))):
        record, component = divmod(int(place), len(labels))
        entry |= {key: float(values[record, component]), f"{key}_time": float(time[record])}
        if travel.shape[1]:
            entry[f"{key}_travel"] = float(travel[record, 0])
        if len(labels) > 1:
            entry[f"{key}_at"] = labels[component]
    return entry
