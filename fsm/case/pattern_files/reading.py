"""Lines of crease patterns as files give them, choices of a section [sheet] for their reading, and faults with places."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

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


@dataclass(frozen=True)
class Reading:
    """Choices for the reading of a pattern.

    Attributes
    ----------
    merge : m
        Distance below which points are one vertex, and height below which a facet is planar. None: from the file.
    part : number of the part of the pattern that is the sheet, from 1; None: the pattern must be one part
    divided : whether facets are divided into triangles, so that they need not be planar
    """

    merge: float | None = None
    part: int | None = None
    divided: bool = False


class PatternFault(ValueError):
    """Fault of a pattern at some places.

    Parameters
    ----------
    message : str
    places : (n, 2) or (n, 3) positions of the fault, m
    labels : texts beside the places

    Attributes
    ----------
    lines : ends (m, 2, 2) or (m, 2, 3) of the lines of the pattern, m
    letters : letters of the lines
    """

    def __init__(self, message: str, places: Any = (), labels: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.places, self.labels = np.asarray(places, dtype=float), tuple(labels)
        self.lines: np.ndarray = np.zeros((0, 2, 2))
        self.letters: Sequence[str] = ()

    def among(self, lines: np.ndarray, letters: Sequence[str]) -> PatternFault:
        """Same fault, with the lines of its pattern."""
        self.lines, self.letters = lines, letters
        return self
