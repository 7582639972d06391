"""Plane of a plane figure: name of its vertical axis, and shapes of lattice squares in it."""

from __future__ import annotations

import numpy as np

from fsm.results.film import Floats
from fsm.results.solution import Solution


def vertical_axis(solution: Solution) -> str:
    """Name of the vertical axis in the case: y for a scissor array, else z."""
    return "y" if "scissor" in solution.layout.case else "z"


def lattice_squares(solution: Solution, shape: Floats) -> Floats | None:
    """Corners of the squares of a lattice, from their middle planes in the result; None for other structures.

    Parameters
    ----------
    solution : Solution
    shape : (..., squares, 4, 3) array, m
        Middle planes in some of the records.

    Returns
    -------
    (..., squares, 4, 3) array, m
        Corners in order around each square, seen along y.
    """
    if "lattice" not in solution.layout.case:
        return None
    start, end = shape[..., [0, 3], :].mean(axis=-2), shape[..., [1, 2], :].mean(axis=-2)
    half = 0.5 * (end - start)
    across = np.stack([-half[..., 2], half[..., 1], half[..., 0]], axis=-1)
    return np.stack([start - across, end - across, end + across, start + across], axis=-2)
