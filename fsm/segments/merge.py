"""Groups of one kind joined into one group: compiled steps have one group of each kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, replace
from itertools import accumulate
from typing import Any, cast

import numpy as np

from fsm.laws.crease import CurveTable
from fsm.segments.elements import BushingGroup, CreaseGroup
from fsm.segments.group import Group
from fsm.segments.hysteresis import HysteresisGroup
from fsm.segments.ligaments import LigamentGroup

__all__ = ["merged"]


def merged(groups: Iterable[Group]) -> tuple[Group, ...]:
    """Groups with one group for all linear springs, one for all tabulated creases and one for all ligaments.

    Each is at the place of the first of its kind. Creases stay apart if some have hysteresis, because their sliders refer to
    the group of the creases.
    """
    left = list(groups)
    for kind, join in _JOINS.items():
        found = [group for group in left if isinstance(group, kind)]
        if len(found) < 2 or (kind is CreaseGroup and any(isinstance(group, HysteresisGroup) for group in left)):
            continue
        place = left.index(found[0])
        left = [group for group in left if not isinstance(group, kind)]
        left.insert(place, join(found))
    return tuple(left)


def _springs(groups: Sequence[BushingGroup]) -> Group:
    return _stacked(groups, category=_shifted([(group.category, len(group.in_panels)) for group in groups]))


def _creases(groups: Sequence[CreaseGroup]) -> Group:
    tables = [group.table for group in groups]
    bounds = _shifted([(table.bounds[1:], len(table.knots)) for table in tables])
    table = CurveTable(
        np.concatenate([tables[0].bounds[:1], bounds]),
        *(np.concatenate([getattr(table, name) for table in tables]) for name in ("knots", "coefficients", "energies")),
    )
    curve = _shifted([(group.curve, len(group.table.bounds) - 1) for group in groups])
    return _stacked(groups, curve=curve, table=table)


_JOINS: dict[type, Callable[[Any], Group]] = {
    BushingGroup: _springs, CreaseGroup: _creases, LigamentGroup: lambda groups: _stacked(groups),
}  # fmt: skip


def _shifted(parts: Sequence[tuple[np.ndarray, int]]) -> np.ndarray:
    """Indices (n,) of all groups, where each group's own (array, number of indexed rows) follow those before it."""
    starts = accumulate((count for _, count in parts[:-1]), initial=0)
    return np.concatenate([indices + start for (indices, _), start in zip(parts, starts, strict=True)])


def _stacked(groups: Sequence[Any], **own: Any) -> Group:
    """Group with the arrays and tuples of all groups, one after another, except those given."""
    joined: dict[str, Any] = {}
    for field in fields(groups[0]):
        values = [getattr(group, field.name) for group in groups]
        if field.name in own:
            continue
        if isinstance(values[0], np.ndarray):
            joined[field.name] = np.concatenate(values)
        elif values[0] and isinstance(values[0][0], np.ndarray):
            joined[field.name] = tuple(np.concatenate(parts) for parts in zip(*values, strict=True))
        else:
            joined[field.name] = sum(values, ())
    return cast(Group, replace(groups[0], **joined, **own))
