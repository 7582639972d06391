"""Lines of cables and beams for figures and for the shape of a system."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

__all__ = ["DrawnLines"]


class DrawnLines(NamedTuple):
    """Lines that are drawn for cables and beams.

    Attributes
    ----------
    vectors : (n, 4) int array
        First coordinates of the vectors of the element that each line is on.
    weights : (n, 2, 4) array
        Factors of these vectors that give the ends.
    half : (n,) array, m
        Half the width along y, of beams; 0 for cables.
    names : (n,) names of the cables and beams
    films : names of the films, one for each face of the mesh
    """

    vectors: np.ndarray
    weights: np.ndarray
    half: np.ndarray
    names: tuple[str, ...]
    films: tuple[str, ...]
