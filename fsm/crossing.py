"""Do panels pass through each other that no contact pair watches? Looked for in every saved state of a planar run."""

from __future__ import annotations

import numpy as np

from fsm.results.solution import Solution
from fsm.scene.scene import Scene

__all__ = ["first_crossings"]


def first_crossings(solution: Solution, scene: Scene) -> list[tuple[int, int, float]]:
    """Pairs of panels that cross without being watched.

    Returns
    -------
    list of (panel, panel, travel)
        The first saved travel (m; the time in s without a drive) at which their middle lines cross. Contact pairs are
        left out: they may lie in each other by their penetration. Spatial runs are not looked at.
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
        for i, j in zip(*np.nonzero(_crossing(start, end)), strict=True):
            pair = (int(min(panel[i], panel[j])), int(max(panel[i], panel[j])))
            if pair[0] != pair[1] and pair[0] > 0 and pair not in watched:
                found.setdefault(pair, float(at[number]))
    return [(a, b, travel) for (a, b), travel in sorted(found.items())]


def _watched(scene: Scene) -> set[tuple[int, int]]:
    if scene.contact is None:
        return set()
    panel = {body.name: body.panel for body in scene.bodies}
    surface = {s.name: panel[s.bodies[0]] for s in scene.surfaces}
    return {
        (min(surface[p.first], surface[p.second]), max(surface[p.first], surface[p.second])) for p in scene.pairs
    }


def _crossing(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(n, n) matrix: does line i cross line j in the inside of both."""
    along = end - start
    side_start = _side(along, start, start)
    side_end = _side(along, start, end)
    tiny = 1e-9 * float(np.max(np.sum(along**2, axis=1)))
    apart = (side_start * side_end < 0.0) & (np.abs(side_start) > tiny) & (np.abs(side_end) > tiny)
    return np.asarray(apart & apart.T)


def _side(along: np.ndarray, origin: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(n, n): twice the signed area of line i and point j."""
    offset = point[None] - origin[:, None]
    return along[:, None, 0] * offset[..., 1] - along[:, None, 1] * offset[..., 0]
