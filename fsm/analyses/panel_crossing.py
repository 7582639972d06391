"""Detection of panels that pass through each other without a contact pair, in saved states whose creases are along y."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from fsm.case.models.scene import Scene
from fsm.model.faults.overlap import near_boxes
from fsm.results.solution import Solution

TIP = 0.05
"""Part of a panel's length, next to each end, where a crossing does not count."""

_LINES = 20_000
"""Number of lines that are examined at a time."""
_TURNED = 1e-6
"""Angle, rad, up to which the sides of a panel are along y."""
_DEEP = 0.01
"""Ratio of the penetration to the side of a square, above which two squares of a lattice overlap."""
_SQUEEZED = 0.05
"""Ratio of the length of a hinge to its length without force, below which its two corners touch."""


def lattice_overlap(solution: Solution, scene: Scene) -> str:
    """Warning about the first squares of a lattice that touch, because lattices have no contact; empty if none touch."""
    names = [body.name for body in scene.bodies if body.plate]
    number = {name: k for k, name in enumerate(names)}
    hinges = [e for e in scene.elements if e.frame == "chord" and e.inner in number and e.outer in number]
    if not hinges:
        return ""
    ends = np.array([[number[e.inner], number[e.outer]] for e in hinges])
    points = np.array([[e.point_inner, e.point_outer] for e in hinges])[..., ::2]
    # a beam begins inside its square, whose corner is meant here
    sides = np.array([[body.plate.length, body.plate.thickness] for body in scene.bodies if body.plate])
    beams = np.array([e.bends for e in hinges])
    points[beams] = 0.5 * np.sign(points[beams]) * sides[ends[beams]]
    free = None
    for record, shape in enumerate(solution.shape[:, :, :2, ::2]):
        middle, half = shape.mean(axis=1), 0.5 * (shape[:, 1] - shape[:, 0])
        reach = np.linalg.norm(half, axis=1)
        axis = (half / reach[:, None])[ends]
        corner = middle[ends] + points[..., :1] * axis + points[..., 1:] * (axis @ _QUARTER)
        length = np.linalg.norm(corner[:, 0] - corner[:, 1], axis=1)
        free = length if free is None else free
        i, j = near_boxes(middle - 1.5 * reach[:, None], middle + 1.5 * reach[:, None])
        deep = _depth(half[i], half[j], middle[j] - middle[i]) > 2.0 * _DEEP * reach[i]
        pairs = [*ends[length < _SQUEEZED * free], *np.column_stack([i[deep], j[deep]])]
        if pairs:
            one, other = (names[k] for k in sorted(pairs[0]))
            driven, layout = bool(solution.travel.shape[1]), solution.layout
            at = layout.travel_text(solution.travel[record, 0]) if driven else f"{solution.time[record]:.4g} s"
            return (
                f"squares {one} and {other} meet at {at}: a lattice has no contact between squares, so later results are "
                "not physical; reduce the travel"
            )
    return ""


def _depth(one: np.ndarray, other: np.ndarray, apart: np.ndarray) -> np.ndarray:
    """Penetration (m,) of pairs of squares along the axes of their sides; negative if an axis separates them.

    Parameters
    ----------
    one, other : (m, 2) arrays, m
        First and second square: vector from the centre of the square to the middle of a side.
    apart : (m, 2) array, m
        Vector from the centre of the first square to the centre of the second.
    """
    depth = np.full(len(apart), np.inf)
    for half in (one, other, one @ _QUARTER, other @ _QUARTER):
        size = np.linalg.norm(half, axis=1)
        axis = half / size[:, None]
        extent = sum(np.abs(np.sum(side * axis, axis=1)) for side in (one, one @ _QUARTER, other, other @ _QUARTER))
        depth = np.minimum(depth, extent - np.abs(np.sum(apart * axis, axis=1)))
    return depth


_QUARTER = np.array([[0.0, 1.0], [-1.0, 0.0]])


def unwatched_crossings(solution: Solution, scene: Scene) -> list[tuple[int, int, float]]:
    """Pairs of panels that cross without a contact pair between them.

    Spatial runs are examined until a panel rotates out of the x-z plane; panels side by side along y do not cross.
    Panels of a contact pair overlap by their penetration. The ends of neighbouring panels can then overlap too.
    Crossings within `TIP` of the end of a panel therefore do not count.

    Returns
    -------
    list of (panel, panel, travel)
        First saved travel (m) at which the middle lines cross; without a drive, the time (s).
    """
    watched, panel = _contact_pairs(scene), solution.layout.panel
    numbers = sorted({number for number in panel.tolist() if number > 0})
    alone = {k for a, b in combinations(numbers, 2) if (a, b) not in watched for k in (a, b)}
    if not alone:
        return []
    examined = np.isin(panel, list(alone))
    panel = panel[examined]
    found: dict[tuple[int, int], float] = {}
    at = solution.travel[:, 0] if solution.travel.shape[1] else solution.time
    records, block = _in_plane(solution.shape), max(1, _LINES // len(panel))
    for begin in range(0, records, block):
        shape = solution.shape[begin : min(begin + block, records), examined]
        starts, ends = shape[:, :, 0][..., [0, 2]], shape[:, :, 1][..., [0, 2]]
        for number, i, j in _crossing(starts, ends, panel).tolist():
            pair = (int(min(panel[i], panel[j])), int(max(panel[i], panel[j])))
            if pair[0] == pair[1] or pair in watched or pair in found:
                continue
            across = shape[number, [i, j]][:, [0, 3], 1]
            if across.min(axis=1).max() >= across.max(axis=1).min():
                continue
            if not _at_a_tip(starts[number], ends[number], panel, i, j):
                found[pair] = float(at[begin + number])
    return [(a, b, travel) for (a, b), travel in sorted(found.items())]


def _in_plane(shape: np.ndarray) -> int:
    """Number of leading records in which all quads, shape (n, quads, 4, 3), have their transverse edges along y."""
    across = np.abs(shape[:, :, [3, 2]] - shape[:, :, [0, 1]])
    turned = (across[..., [0, 2]] > _TURNED * across[..., 1:2]).any(axis=(1, 2, 3))
    return int(np.argmax(turned)) if turned.any() else len(shape)


def _contact_pairs(scene: Scene) -> set[tuple[int, int]]:
    if scene.contact is None:
        return set()
    panel = {body.name: body.panel for body in scene.bodies}
    surface = {s.name: panel[s.bodies[0]] for s in scene.surfaces}
    return {
        (min(surface[p.first], surface[p.second]), max(surface[p.first], surface[p.second]))
        for p in scene.pairs
        if p.first in surface and p.second in surface
    }


def _crossing(start: np.ndarray, end: np.ndarray, panel: np.ndarray) -> np.ndarray:
    """Record and both lines of pairs (m, 3) of lines of different panels that cross between the ends of both.

    Parameters
    ----------
    start, end : (records, lines, 2) arrays, m
    panel : (lines,) array
    """
    lines = start.shape[1]
    tiny = 1e-9 * np.max(np.sum((end - start) ** 2, axis=2), axis=1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    width = float(np.max(high) - np.min(low))
    aside = np.zeros((len(start), 1, 2))
    aside[:, 0, 0] = 2.0 * width * np.arange(len(start))  # records lie side by side, so one search covers all of them
    margin = 1e-9 * width
    i, j = near_boxes((low + aside - margin).reshape(-1, 2), (high + aside + margin).reshape(-1, 2))
    apart = panel[i % lines] != panel[j % lines]
    i, j = i[apart], j[apart]
    record = i // lines
    start, end = start.reshape(-1, 2), end.reshape(-1, 2)
    along = end - start
    across = np.full(len(i), True)
    for line, other in ((i, j), (j, i)):
        side_start = _side(along[line], start[other] - start[line])
        side_end = _side(along[line], end[other] - start[line])
        across &= (side_start * side_end < 0.0) & (np.minimum(np.abs(side_start), np.abs(side_end)) > tiny[record])
    return np.column_stack([record, i - record * lines, j - record * lines])[across]


def _at_a_tip(start: np.ndarray, end: np.ndarray, panel: np.ndarray, i: int, j: int) -> bool:
    """Whether lines i and j cross close to an end of one of their panels."""
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
    """Twice the signed area of the triangles between lines and points, one point for each line."""
    return np.asarray(along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0])
