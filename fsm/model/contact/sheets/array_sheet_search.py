"""Broad phase of the contact of flexible facets with each other: nodes near facets, and edges near edges.

The boxes of all triangles are searched with the tree of `fsm.interactions.search.box_tree`. Each node and each edge belongs
to one triangle, so that the pairs of triangles give each pair of features once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.search.box_pairs import overlapping_sorted
from fsm.kernels.jit import kernel
from fsm.model.contact.sheets.array_sheet_tables import CLEARANCE, FACETS, LONGEST, OWN_DISTANCE, SheetArrays


class Near(NamedTuple):
    """Possible contacts, in the order of their keys.

    Attributes
    ----------
    node, facet : (s,) int arrays
    start, listed : int arrays
        Triangles ``listed[start[s]:start[s + 1]]`` of the facet, near the node.
    one, two : (p,) int arrays
        Pairs of edges; the number of the first one is the smaller.
    """

    node: np.ndarray
    facet: np.ndarray
    start: np.ndarray
    listed: np.ndarray
    one: np.ndarray
    two: np.ndarray


@kernel
def position_of(known: np.ndarray, count: int, key: int) -> int:
    """Position of a key among the first `count` values of an ascending array; -1 if it is absent."""
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if known[middle] < key:
            low = middle + 1
        else:
            high = middle
    return low if low < count and known[low] == key else -1


@kernel
def _is_closed(own: SheetArrays, key: int) -> bool:
    """Whether a slot has no contact."""
    return position_of(own.closed, own.closed.shape[0], key) >= 0


@kernel
def boxes(start: np.ndarray, end: np.ndarray, nodes: np.ndarray, grow: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners (m, 3) of the boxes around nodes (m, k) that move between two sets of places (n, 3)."""
    count = nodes.shape[0]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    for i in range(count):
        for k in range(nodes.shape[1]):
            for e in range(3):
                one, two = start[nodes[i, k], e], end[nodes[i, k], e]
                low[i, e], high[i, e] = min(low[i, e], one, two), max(high[i, e], one, two)
        for e in range(3):
            low[i, e] -= grow
            high[i, e] += grow
    return low, high


@kernel
def overlap(low: np.ndarray, high: np.ndarray, i: int, other_low: np.ndarray, other_high: np.ndarray, j: int) -> bool:
    """Whether two boxes overlap."""
    apart = False
    for e in range(3):
        apart |= low[i, e] > other_high[j, e] or other_low[j, e] > high[i, e]
    return not apart


@kernel
def _in_order(one: np.ndarray, two: np.ndarray, largest: int) -> np.ndarray:
    """Pairs (m, 2) in ascending order; `one` is below `largest`."""
    start = np.zeros(largest + 1, dtype=np.int64)
    for k in range(one.shape[0]):
        start[one[k] + 1] += 1
    for k in range(largest):
        start[k + 1] += start[k]
    out, end = np.empty((one.shape[0], 2), dtype=np.int64), start.copy()
    for k in range(one.shape[0]):  # there are few pairs with the same first number
        at, value = end[one[k]], two[k]
        end[one[k]] += 1
        while at > start[one[k]] and out[at - 1, 1] > value:
            out[at, 1] = out[at - 1, 1]
            at -= 1
        out[at, 1] = value
    for i in range(largest):
        for k in range(start[i], start[i + 1]):
            out[k, 0] = i
    return out


@kernel
def _may_touch(own: SheetArrays, node: int, triangle: int) -> bool:
    """Whether a node does not belong to the facet of a triangle, or is far from the triangle along this facet."""
    key = node * own.counts[FACETS] + own.facet[triangle]
    at = position_of(own.on, own.on.shape[0], key)
    if at >= 0:
        x, y = own.on_plane[at, 0] - own.middle[triangle, 0], own.on_plane[at, 1] - own.middle[triangle, 1]
        if np.sqrt(x * x + y * y) <= own.sizes[OWN_DISTANCE]:
            return False
    return not _is_closed(own, key)


@kernel
def _edges_may_touch(own: SheetArrays, one: int, two: int) -> bool:
    """Whether edges have no common node, and belong to different facets or are far from each other along one facet."""
    same = False
    for i in range(2):
        for j in range(2):
            if own.edges[one, i] == own.edges[two, j]:
                return False
            same = same or own.edge_facets[one, i] == own.edge_facets[two, j]
    a, b = own.edge_owner[one], own.edge_owner[two]
    if same:
        x, y = own.middle[a, 0] - own.middle[b, 0], own.middle[a, 1] - own.middle[b, 1]
        apart = own.sizes[OWN_DISTANCE] + own.sizes[LONGEST]
        if own.facet[a] != own.facet[b] or np.sqrt(x * x + y * y) <= apart:
            return False
    return not _is_closed(own, own.body.shape[0] * own.counts[FACETS] + one * own.edges.shape[0] + two)


@kernel
def _longer(values: np.ndarray) -> np.ndarray:
    return np.concatenate((values, np.empty_like(values)))


@kernel
def _near_points(
    own: SheetArrays, start: np.ndarray, end: np.ndarray, near: np.ndarray, low: np.ndarray, high: np.ndarray, grow: float
) -> np.ndarray:
    """Nodes near triangles: node, and facet times number of triangles plus triangle, (m, 2), in ascending order."""
    each = np.arange(own.body.shape[0]).reshape(-1, 1)
    point_low, point_high = boxes(start, end, each, grow)
    count, triangles = 0, own.triangles.shape[0]
    one = np.empty(max(64, 8 * own.body.shape[0]), dtype=np.int64)
    two = np.empty_like(one)
    for k in range(near.shape[0]):
        for way in range(2):
            of, other = near[k, way], near[k, 1 - way]
            for corner in range(3):
                node = own.triangles[of, corner]
                if own.owner[node] != of or not overlap(point_low, point_high, node, low, high, other):
                    continue
                if not _may_touch(own, node, other):
                    continue
                if count == one.shape[0]:
                    one, two = _longer(one), _longer(two)
                one[count], two[count] = node, own.facet[other] * triangles + other
                count += 1
    return _in_order(one[:count], two[:count], own.body.shape[0])


@kernel
def _near_edges(own: SheetArrays, start: np.ndarray, end: np.ndarray, near: np.ndarray, grow: float) -> np.ndarray:
    """Pairs (m, 2) of edges near each other, in ascending order."""
    low, high = boxes(start, end, own.edges, grow)
    count, one = 0, np.empty(max(64, 8 * own.edges.shape[0]), dtype=np.int64)
    two = np.empty_like(one)
    for k in range(near.shape[0]):
        for i in range(3):
            first = own.edge_of[near[k, 0], i]
            if own.edge_owner[first] != near[k, 0]:
                continue
            for j in range(3):
                second = own.edge_of[near[k, 1], j]
                if own.edge_owner[second] != near[k, 1] or not overlap(low, high, first, low, high, second):
                    continue
                a, b = min(first, second), max(first, second)
                if not _edges_may_touch(own, a, b):
                    continue
                if count == one.shape[0]:
                    one, two = _longer(one), _longer(two)
                one[count], two[count] = a, b
                count += 1
    return _in_order(one[:count], two[:count], own.edges.shape[0])


@kernel
def near_features(own: SheetArrays, start: np.ndarray, end: np.ndarray, reach: float) -> Near:
    """Possible contacts of nodes that move between two sets of places (n, 3), within a distance (m).

    Without clearance, edges have no contact.
    """
    grow = 0.5 * reach
    low, high = boxes(start, end, own.triangles, grow)
    sorted_low, sorted_high = np.empty_like(low), np.empty_like(high)
    for k in range(low.shape[0]):
        for e in range(3):
            sorted_low[k, e], sorted_high[k, e] = low[own.order[k], e], high[own.order[k], e]
    near = overlapping_sorted(sorted_low, sorted_high, own.order)
    points = _near_points(own, start, end, near, low, high, grow)
    if own.sizes[CLEARANCE] == 0.0:
        near = near[:0]
    pairs = _near_edges(own, start, end, near, grow)
    triangles, rows, count = own.triangles.shape[0], points.shape[0], 0
    node, facet = np.empty(rows, dtype=np.int64), np.empty(rows, dtype=np.int64)
    first, listed = np.empty(rows + 1, dtype=np.int64), np.empty(rows, dtype=np.int64)
    for k in range(rows):
        of = points[k, 1] // triangles
        listed[k] = points[k, 1] - of * triangles
        if count == 0 or node[count - 1] != points[k, 0] or facet[count - 1] != of:
            node[count], facet[count], first[count] = points[k, 0], of, k
            count += 1
    first[count] = rows
    one, two = np.empty(pairs.shape[0], dtype=np.int64), np.empty(pairs.shape[0], dtype=np.int64)
    for k in range(pairs.shape[0]):
        one[k], two[k] = pairs[k, 0], pairs[k, 1]
    return Near(node[:count], facet[:count], first[: count + 1], listed, one, two)
