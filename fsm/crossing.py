"""Do panels pass through each other that no contact pair watches? Looked for in every saved state of a planar run."""

from __future__ import annotations

import numpy as np

from fsm.overlap import near_boxes
from fsm.results.solution import Solution
from fsm.scene.scene import Scene

__all__ = ["TIP", "first_crossings"]

TIP = 0.05
"""Fraction of its length next to the end of a panel where a crossing does not count."""


def first_crossings(solution: Solution, scene: Scene) -> list[tuple[int, int, float]]:
    """Pairs of panels that cross without being watched.

    Returns
    -------
    list of (panel, panel, travel)
        The first saved travel (m; the time in s without a drive) at which their middle lines cross. Contact pairs are
        left out: they may lie in each other by their penetration, and so may the tips of the panels next to them, so
        crossings within `TIP` of the end of a panel do not count. Spatial runs are not looked at.
    """
    if solution.layout.dimension != "planar" or not len(solution.layout.panel):
        return []
    watched = _watched(scene)
    panel = solution.layout.panel
    found: dict[tuple[int, int], float] = {}
    at = solution.travel[:, 0] if solution.travel.shape[1] else solution.time
    for number in range(len(solution)):
        start = solution.shape[number, :, 0][:, [0, 2]]
        end = solution.shape[number, :, 1][:, [0, 2]]
        for i, j in _crossing(start, end):
            pair = (int(min(panel[i], panel[j])), int(max(panel[i], panel[j])))
            if pair[0] == pair[1] or pair[0] <= 0 or pair in watched or pair in found:
                continue
            if not _at_a_tip(start, end, panel, i, j):
                found[pair] = float(at[number])
    return [(a, b, travel) for (a, b), travel in sorted(found.items())]


def _watched(scene: Scene) -> set[tuple[int, int]]:
    if scene.contact is None:
        return set()
    panel = {body.name: body.panel for body in scene.bodies}
    surface = {s.name: panel[s.bodies[0]] for s in scene.surfaces}
    return {
        (min(surface[p.first], surface[p.second]), max(surface[p.first], surface[p.second]))
        for p in scene.pairs
        if p.first in surface and p.second in surface
    }


def _crossing(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Pairs (m, 2) of lines that cross in the inside of both."""
    along = end - start
    tiny = 1e-9 * float(np.max(np.sum(along**2, axis=1)))
    i, j = near_boxes(np.minimum(start, end), np.maximum(start, end))
    across = np.full(len(i), True)
    for line, other in ((i, j), (j, i)):
        side_start = _side(along[line], start[other] - start[line])
        side_end = _side(along[line], end[other] - start[line])
        across &= (side_start * side_end < 0.0) & (np.abs(side_start) > tiny) & (np.abs(side_end) > tiny)
    return np.column_stack([i[across], j[across]])


def _at_a_tip(start: np.ndarray, end: np.ndarray, panel: np.ndarray, i: int, j: int) -> bool:
    """Whether lines i and j cross next to an end of the panel of either."""
    along, other = end[i] - start[i], end[j] - start[j]
    offset = start[j] - start[i]
    point = start[i] + along * (offset[0] * other[1] - offset[1] * other[0]) / (along[0] * other[1] - along[1] * other[0])
    for number in (panel[i], panel[j]):
        of_panel = np.flatnonzero(panel == number)
        ends = np.array([start[of_panel[0]], end[of_panel[-1]]])
        length = np.linalg.norm(end[of_panel] - start[of_panel], axis=1).sum()
        if np.linalg.norm(ends - point, axis=1).min() < TIP * length:
            return True
    return False


def _side(along: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Twice the signed area between lines and points, one each."""
    return np.asarray(along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0])
