"""Lines of cables and beams for figures and for the shape of a system."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class DrawnLines(NamedTuple):
    """Lines that are drawn for cables and beams.

    Attributes
    ----------
    vectors : (n, 4) int array
        First coordinates of the vectors of the element to which each line belongs.
    weights : (n, 2, 4) array
        Factors of these vectors that give the ends.
    half : (n,) array, m
        Half the width along y, of beams; 0 for cables.
    names : (n,) names of the cables and beams
    faces : names of the parts of the faces of the mesh
    panels : (m,) int array
        Number of the panel of each face (`fsm.results.solution`): -1 for a film, 0 for a face of a truss.
    """

    vectors: np.ndarray
    weights: np.ndarray
    half: np.ndarray
    names: tuple[str, ...]
    faces: tuple[str, ...]
    panels: np.ndarray
