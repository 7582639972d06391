"""Choices of a section [sheet] for the reading of its pattern file, and faults of a pattern with their places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


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
