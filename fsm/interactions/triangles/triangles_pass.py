"""Points that pass through triangles, and edges that pass through each other, in a step with straight paths of all nodes.

Four points lie in one plane when a cubic of the time is zero. Between the extrema of the cubic each sign change is one root,
found by bisection; there the point must lie in the triangle, or both edges must cross (Provot, 1997).

Most pairs are excluded before: at a meeting, motions have overcome the distance of the parts along any vector at the start.
For the normal of the triangle, or that of both edges, this distance is the same for all points of the parts, and the motions
are largest at nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.vector import cross, dot

_SAFETY = 1.0 + 1e-9
"""Factor on the motion of nodes, so that round-off excludes no meeting."""


class WorkSpace(NamedTuple):
    """Arrays for intermediate results of one pair."""

    start: np.ndarray
    end: np.ndarray
    at: np.ndarray
    times: np.ndarray
    normal: np.ndarray
    part: np.ndarray
    other: np.ndarray


@kernel
def work_space() -> WorkSpace:
    """Arrays that the functions below need."""
    return WorkSpace(
        np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3)), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    )  # fmt: skip


@kernel
def _volume(x: np.ndarray) -> float:
    """Triple product of the sides from node 0 of four nodes (4, 3)."""
    a = (x[1, 1] - x[0, 1]) * (x[2, 2] - x[0, 2]) - (x[1, 2] - x[0, 2]) * (x[2, 1] - x[0, 1])
    b = (x[1, 2] - x[0, 2]) * (x[2, 0] - x[0, 0]) - (x[1, 0] - x[0, 0]) * (x[2, 2] - x[0, 2])
    c = (x[1, 0] - x[0, 0]) * (x[2, 1] - x[0, 1]) - (x[1, 1] - x[0, 1]) * (x[2, 0] - x[0, 0])
    return a * (x[3, 0] - x[0, 0]) + b * (x[3, 1] - x[0, 1]) + c * (x[3, 2] - x[0, 2])


@kernel
def _coplanar_times(start: np.ndarray, end: np.ndarray, at: np.ndarray, times: np.ndarray) -> int:
    """Times (3,) from 0 to 1 at which four nodes are in one plane; returns their number. `at` (4, 3) is scratch."""
    values = np.empty(4)
    for k in range(4):
        tau = k / 3.0
        for m in range(4):
            for e in range(3):
                at[m, e] = start[m, e] + tau * (end[m, e] - start[m, e])
        values[k] = _volume(at)
    f0, f1, f2, f3 = values[0], values[1], values[2], values[3]
    # cubic through the four values
    c1 = -5.5 * f0 + 9.0 * f1 - 4.5 * f2 + f3
    c2 = 9.0 * f0 - 22.5 * f1 + 18.0 * f2 - 4.5 * f3
    c3 = -4.5 * f0 + 13.5 * f1 - 13.5 * f2 + 4.5 * f3
    limits = np.empty(4)
    limits[0], pieces = 0.0, 1
    a, b, c = 3.0 * c3, 2.0 * c2, c1
    root = b * b - 4.0 * a * c
    if root > 0.0:
        q = -0.5 * (b + (np.sqrt(root) if b >= 0.0 else -np.sqrt(root)))
        one = q / a if a != 0.0 else -1.0
        two = c / q if q != 0.0 else -1.0
        for extremum in (min(one, two), max(one, two)):
            if 0.0 < extremum < 1.0:
                limits[pieces] = extremum
                pieces += 1
    limits[pieces] = 1.0
    number = 0
    for piece in range(pieces):
        low, high = limits[piece], limits[piece + 1]
        at_low = f0 + low * (c1 + low * (c2 + low * c3)) if piece > 0 else f0
        at_high = f0 + high * (c1 + high * (c2 + high * c3)) if piece < pieces - 1 else f3
        if at_low == 0.0 or (at_low > 0.0) == (at_high > 0.0):
            continue
        for _ in range(60):
            middle = 0.5 * (low + high)
            value = f0 + middle * (c1 + middle * (c2 + middle * c3))
            if (value > 0.0) == (at_low > 0.0):
                low = middle
            else:
                high = middle
        times[number] = 0.5 * (low + high)
        number += 1
    return number


@kernel
def may_meet(start: np.ndarray, end: np.ndarray, nodes: np.ndarray, split: int) -> bool:
    """Whether the motion of four nodes is long enough for a meeting of those before the split with the others."""
    i, j, k, m = nodes[0], nodes[1], nodes[2], nodes[3]
    one, two, of_two = (i, j, k) if split == 2 else (j, k, j)
    p, q, r = start[two, 0] - start[one, 0], start[two, 1] - start[one, 1], start[two, 2] - start[one, 2]
    u, v, w = start[m, 0] - start[of_two, 0], start[m, 1] - start[of_two, 1], start[m, 2] - start[of_two, 2]
    x, y, z = q * w - r * v, r * u - p * w, p * v - q * u
    apart = abs(
        x * (start[i, 0] - start[of_two, 0]) + y * (start[i, 1] - start[of_two, 1]) + z * (start[i, 2] - start[of_two, 2])
    )
    low, high, other_low, other_high = np.inf, -np.inf, np.inf, -np.inf
    for number in range(4):
        at = nodes[number]
        along = x * (end[at, 0] - start[at, 0]) + y * (end[at, 1] - start[at, 1]) + z * (end[at, 2] - start[at, 2])
        if number < split:
            low, high = min(low, along), max(high, along)
        else:
            other_low, other_high = min(other_low, along), max(other_high, along)
    return apart <= _SAFETY * max(high - other_low, other_high - low)


@kernel
def largest_approach(start: np.ndarray, end: np.ndarray) -> float:
    """Largest motion of two points towards each other along an axis in a step, m."""
    moved = 0.0
    for i in range(start.shape[0]):
        for e in range(3):
            moved = max(moved, abs(end[i, e] - start[i, e]))
    return 2.0 * _SAFETY * moved


@kernel
def _far_apart(start: np.ndarray, end: np.ndarray, split: int) -> bool:
    """Whether the swept boxes of the nodes before and after the split are apart."""
    for e in range(3):
        low, high = np.inf, -np.inf
        other_low, other_high = np.inf, -np.inf
        for m in range(4):
            least, most = min(start[m, e], end[m, e]), max(start[m, e], end[m, e])
            if m < split:
                low, high = min(low, least), max(high, most)
            else:
                other_low, other_high = min(other_low, least), max(other_high, most)
        if low > other_high or other_low > high:
            return True
    return False


@kernel
def _meet(start: np.ndarray, end: np.ndarray, nodes: np.ndarray, split: int, w: WorkSpace) -> int:
    """Number of times at which four nodes are in one plane, written to the work space with the places of the nodes; 0 if
    the nodes before and after the split stay apart.
    """
    for m in range(4):
        for e in range(3):
            w.start[m, e], w.end[m, e] = start[nodes[m], e], end[nodes[m], e]
    return 0 if _far_apart(w.start, w.end, split) else int(_coplanar_times(w.start, w.end, w.at, w.times))


@kernel
def _place_at(w: WorkSpace, time: float) -> None:
    for m in range(4):
        for e in range(3):
            w.at[m, e] = w.start[m, e] + time * (w.end[m, e] - w.start[m, e])


@kernel
def point_passes_triangle(start: np.ndarray, end: np.ndarray, nodes: np.ndarray, w: WorkSpace) -> bool:
    """Whether a point passes through a triangle; `nodes` (4,): point, corners."""
    at, normal, part = w.at, w.normal, w.part
    for k in range(_meet(start, end, nodes, 1, w)):
        _place_at(w, w.times[k])
        cross(at[2] - at[1], at[3] - at[1], normal)
        inside = True
        for corner in range(3):
            p, q = at[1 + corner], at[1 + (corner + 1) % 3]
            cross(q - p, at[0] - p, part)
            inside &= dot(part, normal) >= 0.0
        if inside:
            return True
    return False


@kernel
def edge_passes_edge(start: np.ndarray, end: np.ndarray, nodes: np.ndarray, w: WorkSpace) -> bool:
    """Whether an edge passes through another one; `nodes` (4,): ends of one, ends of the other."""
    at, normal, part, other = w.at, w.normal, w.part, w.other
    for k in range(_meet(start, end, nodes, 2, w)):
        _place_at(w, w.times[k])
        cross(at[1] - at[0], at[3] - at[2], normal)
        cross(at[2] - at[0], at[3] - at[2], part)
        cross(at[2] - at[0], at[1] - at[0], other)
        whole = dot(normal, normal)
        if whole == 0.0:
            continue
        s, t = dot(part, normal) / whole, dot(other, normal) / whole
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            return True
    return False
