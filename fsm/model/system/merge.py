"""Groups of linear springs joined into one group, whose efforts are unknowns in statics."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields, replace
from itertools import accumulate
from typing import Any, cast

import numpy as np

from fsm.model.bodies.group import Group
from fsm.model.elements.elements import BushingGroup
from fsm.model.elements.spring_locks import SpringLocks


def merged(groups: Iterable[Group]) -> tuple[Group, ...]:
    """Groups with one group for all linear springs, at the place of the first; compiled steps have one group of springs.

    The multipliers of locked springs follow at the end.
    """
    left = [group for group in groups if not isinstance(group, SpringLocks)]
    found = [group for group in left if isinstance(group, BushingGroup)]
    if len(found) > 1:
        place = left.index(found[0])
        left = [group for group in left if not isinstance(group, BushingGroup)]
        left.insert(place, _stacked(found, category=_shifted([(group.category, len(group.in_panels)) for group in found])))
    locks = (group.locks for group in left if isinstance(group, BushingGroup))
    return (*left, *(group for group in locks if group is not None))


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
