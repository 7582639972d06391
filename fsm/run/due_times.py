"""Times of records and samples of a run."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

SAME = 1e-10
"""Relative difference below which two times are the same."""


def merged(one: Iterable[float], two: Iterable[float], same: float) -> list[float]:
    """All times in ascending order, without duplicates."""
    times: list[float] = []
    for t in sorted([*one, *two]):
        if not times or t > times[-1] + same:
            times.append(t)
    return times


def due(times: deque[float], now: float) -> bool:
    """Whether at least one of the times has passed; passed times are removed."""
    passed = False
    while times and times[0] <= now * (1.0 + SAME):
        times.popleft()
        passed = True
    return passed
