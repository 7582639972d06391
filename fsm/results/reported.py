"""Results that a case asks for in `report`, and the reactions of its joints."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from fsm.results.channel import AXES, Channel

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
