"""The plane that a run is drawn in: what its upright axis is called, and which plates are more than lines in it."""

from __future__ import annotations

import numpy as np

from fsm.results.solution import Floats, Solution

__all__ = ["lattice_squares", "upright"]


def upright(solution: Solution) -> str:
    """Name of the upright axis, as the case has it: y of a scissor array, z of all else."""
    return "y" if "scissor" in solution.layout.case else "z"


def lattice_squares(solution: Solution, shape: Floats) -> Floats | None:
    """The squares of a lattice, whose middle planes are all that a result keeps of them; None of anything else.

    Parameters
    ----------
    solution : what was solved
    shape : (..., squares, 4, 3) array, m
        Of some of its records.

    Returns
    -------
    (..., squares, 4, 3) array, m
        Their corners in turn, seen along y.
    """
    if "lattice" not in solution.layout.case:
        return None
    start, end = shape[..., [0, 3], :].mean(axis=-2), shape[..., [1, 2], :].mean(axis=-2)
    half = 0.5 * (end - start)
    across = np.stack([-half[..., 2], half[..., 1], half[..., 0]], axis=-1)
    return np.stack([start - across, end - across, end + across, start + across], axis=-2)
