"""Straight lines of crease patterns, as files give them."""

from __future__ import annotations

import math
from typing import NamedTuple

TOLERANCE = 1e-3
"""Distance relative to the size of the pattern below which points are one vertex."""
RANK = "BCMVUFJ"
"""Letters in the order in which they replace each other where lines coincide."""


class Line(NamedTuple):
    """Straight line of a pattern: ends (2,), letter, and fold angle in the folded state, rad (NaN: none)."""

    first: tuple[float, float]
    last: tuple[float, float]
    letter: str
    target: float


def unit_targets(letter: str, part: float = 1.0) -> float:
    """Fold angle of an assignment: a part of 180 degrees for mountains and valleys; NaN for unassigned creases."""
    return {"M": -math.pi * part, "V": math.pi * part, "U": math.nan}.get(letter, 0.0)


def counted(number: int, one: str, many: str) -> str:
    """Number with its noun."""
    return f"{number:,} {one if number == 1 else many}"


def others(count: int, what: str = "place") -> str:
    """Text on further places of a fault."""
    return f" ({counted(count - 1, f'other {what}', f'other {what}s')} too)" if count > 1 else ""
