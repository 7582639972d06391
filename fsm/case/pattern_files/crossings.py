"""Lines in the plane that cross each other, and points on lines.

Lines and points are sorted along that one of some directions in which the fewest pairs must be compared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fsm.case.models.sheet import MOST_FACETS

_DIRECTIONS = 32
"""Number of directions; parallel lines are compared in a direction within 3 degrees of their normal."""
_MOST_CROSSINGS = 5 * MOST_FACETS
"""Largest number of crossings of lines; a crossing of several lines counts for each pair."""
_MOST_COMPARED = 150_000_000
"""Largest number of pairs whose boxes are compared."""
_MOST_NEAR = 10_000_000
"""Largest number of pairs with boxes that touch each other."""
_AT_ONCE = 500_000
"""Number of pairs in one array operation."""


def crossings(ends: np.ndarray, vertices: np.ndarray, near: float) -> np.ndarray:
    """Points (m, 2) at which two lines cross, ordered by the lowest x of the lines.

    Parameters
    ----------
    ends : (n, 2, 2) ends of the lines
    vertices : (n, 2) int array, numbers of the ends; lines with a common end do not cross
    near : distance up to which a line crosses another one beyond its end

    Raises
    ------
    ValueError
        The lines cross at too many places, or too many lines are near to each other.
    """
    axes = _axes()
    sides = [np.sort(ends @ axis, axis=1) + np.array([-2.0, 2.0]) * near for axis in axes]
    best = int(np.argmin([_overlaps(side).sum() for side in sides]))
    order = np.argsort(sides[best][:, 0], kind="stable")
    low, high = sides[(best + _DIRECTIONS // 2) % _DIRECTIONS][order].T
    rank = np.empty(len(ends), dtype=np.int64)
    rank[np.argsort(ends[:, :, 0].min(axis=1), kind="stable")] = np.arange(len(ends))
    rank, named = rank[order], vertices[order]
    start, along = ends[order, 0], ends[order, 1] - ends[order, 0]
    length = np.hypot(*along.T)
    found: list[np.ndarray] = []
    tested = count = 0
    first = np.arange(1, len(ends) + 1)
    for one, other in _pairs(first, first + _overlaps(sides[best])):
        touch = (low[one] <= high[other]) & (high[one] >= low[other])
        one, other = one[touch], other[touch]
        joined = (named[one][:, :, None] == named[other][:, None, :]).any(axis=(1, 2))
        one, other = one[~joined], other[~joined]
        tested += len(one)
        _check_compared(tested, _MOST_NEAR)
        later = rank[one] > rank[other]
        one, other = np.where(later, other, one), np.where(later, one, other)
        (x, y), (u, v), (dx, dy) = along[one].T, along[other].T, (start[other] - start[one]).T
        cross = x * v - y * u
        parallel = np.abs(cross) <= 1e-9 * length[one] * length[other]
        safe = np.where(parallel, 1.0, cross)
        s, t = (dx * v - dy * u) / safe, (dx * y - dy * x) / safe
        a, b = near / length[one], near / length[other]
        hit = ~parallel & (s >= -a) & (s <= 1 + a) & (t >= -b) & (t <= 1 + b)
        hit &= ~(((s <= a) | (s >= 1 - a)) & ((t <= b) | (t >= 1 - b)))  # both lines end there
        one, other, s = one[hit], other[hit], s[hit]
        count += len(one)
        if count > _MOST_CROSSINGS:
            text = f"the lines of the pattern cross at more than {_MOST_CROSSINGS:,} places"
            raise ValueError(f"{text}; at most {MOST_FACETS:,} facets are allowed: give fewer lines")
        found.append(np.column_stack([rank[one], rank[other], start[one] + s[:, None] * along[one]]))
    rows = np.concatenate([np.zeros((0, 4)), *found])
    return np.asarray(rows[np.lexsort((rows[:, 1], rows[:, 0])), 2:])


def points_on_lines(points: np.ndarray, ends: np.ndarray, near: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lines, points on them, and the distances of these from the lines: three arrays, in the order along each line.

    Parameters
    ----------
    points : (p, 2) different points
    ends : (n, 2, 2) ends of the lines
    near : largest distance of a point from a line, and beyond an end

    Raises
    ------
    ValueError
        Too many points are near to lines.
    """
    axes = _axes()
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    length = np.hypot(*along.T)
    nearest = np.argmin(np.abs(along @ axes.T), axis=1)
    first, last = np.empty((2, len(ends)), dtype=np.int64)
    orders = []
    for axis in np.unique(nearest).tolist():
        projected = points @ axes[axis]
        orders.append(np.argsort(projected, kind="stable"))
        own = np.flatnonzero(nearest == axis)
        low, high = np.sort(ends[own] @ axes[axis], axis=1).T
        before = (len(orders) - 1) * len(points)
        first[own] = before + np.searchsorted(projected[orders[-1]], low - 2.0 * near)
        last[own] = before + np.searchsorted(projected[orders[-1]], high + 2.0 * near, "right")
    order = np.concatenate(orders)
    found: list[tuple[np.ndarray, ...]] = []
    for line, place in _pairs(first, last):
        point = order[place]
        (dx, dy), (x, y) = (points[point] - start[line]).T, along[line].T
        distance, off = (dx * x + dy * y) / length[line], np.abs(dy * x - dx * y) / length[line]
        on = (off <= near) & (distance >= -near) & (distance <= length[line] + near)
        found.append((line[on], point[on], distance[on], off[on]))
    lines, on_them, distances, offs = (np.concatenate(column) for column in zip(*found, strict=True))
    rows = np.lexsort((on_them, distances, lines))
    return lines[rows], on_them[rows], offs[rows]


def _axes() -> np.ndarray:
    """Unit vectors of the directions, (k, 2); the first one is x, and that in the middle is y."""
    angles = np.arange(_DIRECTIONS) * (math.pi / _DIRECTIONS)
    axes = np.column_stack([np.cos(angles), np.sin(angles)])
    axes[_DIRECTIONS // 2, 0] = 0.0
    return axes


def _overlaps(sides: np.ndarray) -> np.ndarray:
    """For each interval (n, 2), in the order of their starts: number of later ones that start before its end."""
    low, high = sides[np.argsort(sides[:, 0], kind="stable")].T
    return np.asarray(np.searchsorted(low, high, "right") - np.arange(1, len(sides) + 1))


def _pairs(first: np.ndarray, last: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs of a row and of each number from `first` to before `last` of this row, in parts."""
    counts = last - first
    ends = np.cumsum(counts)
    _check_compared(int(ends[-1]), _MOST_COMPARED)
    row = 0
    while row < len(counts):
        done = int(ends[row] - counts[row])
        stop = max(row + 1, int(np.searchsorted(ends, done + _AT_ONCE, "right")))
        rows = np.repeat(np.arange(row, stop), counts[row:stop])
        yield rows, np.arange(len(rows)) - (ends[rows] - counts[rows] - done) + first[rows]
        row = stop


def _check_compared(count: int, most: int) -> None:
    if count > most:
        text = f"the lines of the pattern are too near to each other: {count:,} pairs must be compared for crossings"
        raise ValueError(f"{text}, the limit is {most:,}; give fewer lines")
