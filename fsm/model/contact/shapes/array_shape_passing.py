"""Check for a compiled model whether shapes have passed through each other in a step; see
`fsm.interactions.shapes.swept`.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import EdgePairs
from fsm.interactions.search.displacement_bound import furthest_motion, moved_beyond
from fsm.interactions.shapes.edge_edge import find_edges
from fsm.interactions.shapes.point_shape_planar import local_points_planar
from fsm.interactions.shapes.point_shape_spatial import local_points_spatial
from fsm.interactions.shapes.shape_distance import HALF_SPACE, shape_distance
from fsm.interactions.shapes.swept_slots import passing_points, passing_slots
from fsm.kernels.jit import kernel
from fsm.model.bodies.contact_arrays import (
    MARGIN,
    RENEWAL,
    STARTED,
    ContactArrays,
)
from fsm.model.contact.shapes import array_shape_tables as shape_tables

_TINY = 1e-12
"""Round-off of distances, m."""


@kernel
def _candidates(g: ContactArrays) -> tuple[np.ndarray, np.ndarray]:
    """Slots that may have passed through a face: the near slots if the broad phase is still valid at the last accepted
    state, else all slots.
    """
    own = shape_tables.shape_arrays_of(g)
    bound = RENEWAL * g.numbers[MARGIN]
    start, reference = g.committed, g.reference
    if not moved_beyond(start, reference, g.moving, g.radii, bound):
        return shape_tables.near_points(g), shape_tables.near_edges(g)
    points, edges = own.point_body.shape[0], own.pair_edges.shape[0]
    out, others = np.empty(points, dtype=np.int64), np.empty(edges, dtype=np.int64)
    slots_open, count, number = own.slots_open, 0, 0
    for i in range(points):
        if slots_open[i] == 1:
            out[count] = i
            count += 1
    for i in range(edges):
        if slots_open[points + i] == 1:
            others[number] = i
            number += 1
    return out[:count], others[:number]


@kernel
def _reachable(
    points: np.ndarray, local: np.ndarray, shape: np.ndarray, body: np.ndarray, kind: np.ndarray, size: np.ndarray,
    motion: float,
) -> np.ndarray:  # fmt: skip
    """Points that may reach their shapes when both move by at most `motion`, m; rotating half-spaces have no such bound."""
    out, count = np.empty(points.shape[0], dtype=np.int64), 0
    for i in range(points.shape[0]):
        of = shape[points[i]]
        unbounded = kind[of] == HALF_SPACE and body[of] != shape_tables.GROUND
        if unbounded or shape_distance(kind[of], size[of], local[i]) <= 2.0 * motion + _TINY:
            out[count] = points[i]
            count += 1
    return out[:count]


@kernel
def _first_pair(g: ContactArrays, slots: np.ndarray, start: int, through: np.ndarray, known: int) -> int:
    """Smallest number of the pairs of the slots that passed through, counted from `start`, and a known one; -1 for none."""
    found, pair = known, g.pair
    for i in range(slots.shape[0]):
        if through[i]:
            of = pair[start + slots[i]]
            found = of if found < 0 else min(found, of)
    return int(found)


@kernel
def passed_planar(g: ContactArrays, poses: np.ndarray) -> int:
    """See `GeometryKernels`; in the plane."""
    start = g.committed
    if g.state[STARTED] == 0:
        return -1
    points, _ = _candidates(g)
    probes, shapes = shape_tables.points_of(g), shape_tables.shapes_planar(g)
    motion = furthest_motion(start, poses, g.moving, g.radii)
    local = local_points_planar(start, points, probes, shapes)
    points = _reachable(points, local, probes.shape, shapes.body, shapes.kind, shapes.size, motion)
    if points.shape[0] == 0:
        return -1
    through = passing_points(start, poses, points, probes, shapes, shape_tables.shape_arrays_of(g).limit)
    return _first_pair(g, points, 0, through, -1)


@kernel
def passed_spatial(g: ContactArrays, poses: np.ndarray) -> int:
    """See `GeometryKernels`; in space."""
    own = shape_tables.shape_arrays_of(g)
    start = g.committed
    if g.state[STARTED] == 0:
        return -1
    points, edges = _candidates(g)
    probes, shapes, table = shape_tables.points_of(g), shape_tables.shapes_spatial(g), shape_tables.edges_of(g)
    pairs = own.pair_edges
    motion = furthest_motion(start, poses, g.moving, g.radii)
    local = local_points_spatial(start, points, probes, shapes)
    points = _reachable(points, local, probes.shape, shapes.body, shapes.kind, shapes.size, motion)
    edges = _reachable_edges(g, start, edges, motion)
    if points.shape[0] == 0 and edges.shape[0] == 0:
        return -1
    of_points, of_edges = passing_slots(start, poses, points, probes, shapes, own.limit, edges, pairs, table)
    first = _first_pair(g, points, 0, of_points, -1)
    return _first_pair(g, edges, own.point_body.shape[0], of_edges, first)


@kernel
def _reachable_edges(g: ContactArrays, poses: np.ndarray, edges: np.ndarray, motion: float) -> np.ndarray:
    """Pairs of edges with a distance of their middle lines of at most twice `motion`, m."""
    own = shape_tables.shape_arrays_of(g)
    table, pairs = shape_tables.edges_of(g), own.pair_edges
    none = np.zeros(pairs.shape[0])
    unscaled = EdgePairs(pairs, none, none)
    slot, gap = find_edges(poses, edges, unscaled, table, 2.0 * motion + _TINY)
    out, count = np.empty(slot.shape[0], dtype=np.int64), 0
    for i in range(slot.shape[0]):
        apart = gap[i] + table.radius[pairs[slot[i], 0]] + table.radius[pairs[slot[i], 1]]
        if apart <= 2.0 * motion + _TINY:
            out[count] = slot[i]
            count += 1
    return out[:count]
