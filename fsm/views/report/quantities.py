"""Channels of a result for the page: recorded channels, and channels that follow from shapes and contact pairs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from fsm.results.all_channels import CONTACT_QUANTITIES
from fsm.results.channel import AXES, Channel, ChannelInfo
from fsm.results.film import Floats, Integers
from fsm.results.solution import Solution
from fsm.views.report.packing import pack_floats
from fsm.views.report.shapes import Crease

MOST_POINTS = 1500
"""Largest number of records of a channel in the page."""

DISPLAY: dict[str, tuple[str, float]] = {
    "1": ("–", 1.0),
    "m": ("mm", 1e3),
    "rad": ("deg", 180.0 / np.pi),
    "N m": ("N mm", 1e3),
    "Pa": ("MPa", 1e-6),
    "m^2": ("mm²", 1e6),
    "m/s": ("mm/s", 1e3),
}
"""Unit of the page and factor for an SI unit; other units are shown as they are."""

_LATE = ("orientation", "angular_velocity", "velocity", "rotation", "moment_vector", "translation")
"""Quantities that are omitted first if the page would be too large."""


def display(unit: str) -> tuple[str, float]:
    """Unit of the page and factor for an SI unit."""
    return DISPLAY.get(unit, (unit, 1.0))


def fold_angles(solution: Solution, creases: Sequence[Crease]) -> Floats:
    """Angles between the facets on both sides of creases, 0 for flat, (n_records, n_creases), rad."""
    first, second = (_normals(solution.shape[:, [getattr(c, side) for c in creases]]) for side in ("first", "second"))
    cosine = np.einsum("rci,rci->rc", first, second)
    sine = np.linalg.norm(np.cross(first, second), axis=-1)
    return np.asarray(np.arctan2(sine, cosine))


def _normals(quads: Floats) -> Floats:
    """Unit normals of facets (..., 4, 3)."""
    normal = np.cross(quads[..., 2, :] - quads[..., 0, :], quads[..., 3, :] - quads[..., 1, :])
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.asarray(normal / np.where(length > 0.0, length, 1.0))


def pair_sides(name: str, known: Sequence[str]) -> tuple[str, str]:
    """Both sides of a contact pair; names may contain the separator."""
    parts = name.split(" - ")
    splits = [(" - ".join(parts[:k]), " - ".join(parts[k:])) for k in range(1, len(parts))] or [(name, "")]
    return max(splits, key=lambda sides: sum(side in known for side in sides))


def all_channels(solution: Solution, creases: Sequence[Crease]) -> dict[str, Channel]:
    """Recorded channels, fold angles from the shape, and quantities of all pairs that touch or have a known gap."""
    found = dict(solution.channels)
    if creases:
        angles = fold_angles(solution, creases)
        for crease, values in zip(creases, angles.T, strict=True):
            name = f"{crease.name}.angle"
            text = "angle between both sides of the crease: 0 flat; from the saved shapes"
            found.setdefault(name, Channel(ChannelInfo(name, "rad", (), text), values))
    for k, pair in enumerate(solution.layout.pair_names):
        if not (solution.pair_force[:, k] > 0.0).any():
            continue
        for quantity, (attribute, unit, text) in CONTACT_QUANTITIES.items():
            values = getattr(solution, attribute)[:, k]
            name = f"contact.{pair}.{quantity}"
            if np.isfinite(values).any() and np.any(values != 0.0):
                found.setdefault(name, Channel(ChannelInfo(name, unit, (), text), values))
    return found


def channel_data(
    channels: dict[str, Channel], wanted: Sequence[str], budget: int, total: int
) -> tuple[list[dict[str, Any]], Integers, int]:
    """Channels for the page, the records of their values, and the number of channels that are left out.

    Channels that match a wanted pattern come first, then short names of quantities that explain the motion.
    """
    records = np.unique(np.round(np.linspace(0, total - 1, min(total, MOST_POINTS))).astype(np.int64))
    chosen, used = [], 0
    order = sorted(channels, key=lambda name: _rank(name, wanted))
    for name in order:
        data = pack_floats(_values(channels[name])[records])
        size = len(data["data"]) + 120
        if used + size > budget and not any(fnmatchcase(name, pattern) for pattern in wanted):
            continue
        used += size
        chosen.append((name, data))
    place = {name: k for k, name in enumerate(channels)}
    chosen.sort(key=lambda item: place[item[0]])
    return [_entry(channels[name], data) for name, data in chosen], records, len(channels) - len(chosen)


def _rank(name: str, wanted: Sequence[str]) -> tuple[bool, bool, bool]:
    quantity = name.rpartition(".")[2].partition("#")[0]
    return not any(fnmatchcase(name, pattern) for pattern in wanted), quantity in _LATE, name.startswith("body.")


def _values(channel: Channel) -> Floats:
    """Values (n_records, n_components); at most 40 components, equally spaced."""
    values = channel.values.reshape(len(channel.values), -1)
    return np.asarray(values[:, _components(values.shape[1])], dtype=float)


def _components(count: int) -> Integers:
    return np.unique(np.round(np.linspace(0, count - 1, min(count, 40))).astype(np.int64))


def _entry(channel: Channel, data: dict[str, Any]) -> dict[str, Any]:
    info = channel.info
    owner, _, quantity = info.name.rpartition(".")
    unit, factor = display(info.unit)
    count = int(np.prod([len(dim.labels) for dim in info.dims], dtype=int))
    labels = [info.labels[k].removeprefix(info.name).strip() for k in _components(count)]
    return {
        "name": info.name, "owner": owner, "quantity": quantity.replace("_", " "), "unit": unit, "factor": factor,
        "text": info.text, "labels": labels, "of": count, "axes": info.dims == (AXES,), "values": data,
    }  # fmt: skip


def owners_of_parts(parts: Iterable[tuple[str, str]], owners: Iterable[str]) -> Iterator[list[str]]:
    """Prefixes of the channels of each part (name, kind): of its panel, of its bodies, and of its supports."""
    of: dict[str, list[str]] = {}
    for owner in owners:
        first, _, rest = owner.partition(".")
        if first in ("body", "support", "bar"):
            for name in {rest, rest.partition(" segment ")[0]}:
                of.setdefault(name, []).append(owner)
    for name, kind in parts:
        panel = [f"panel.{name.removeprefix('panel ')}"] if kind == "panel" else []
        yield [*panel, *of.get(name, ()), *([kind] if kind in ("film", "cable") else [])]
