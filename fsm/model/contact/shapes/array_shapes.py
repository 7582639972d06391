"""Kernels of contacts of shapes for a compiled model; see `fsm.model.bodies.contact_arrays` and
`fsm.model.contact.shapes.shape_contacts`.

All pairs of shapes have their slots in the tables. The broad phase only selects the pairs that are near.

Check for a compiled model whether shapes have passed through each other in a step; see
`fsm.interactions.shapes.swept`.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import EdgePairs, Points, Shapes
from fsm.interactions.search.displacement_bound import furthest_motion, moved_beyond
from fsm.interactions.shapes.edge_edge import find_edges, tangent_edges, write_edges
from fsm.interactions.shapes.point_shape_planar import (
    local_points_planar,
    tangent_points_planar,
    write_points_planar,
)
from fsm.interactions.shapes.point_shape_spatial import (
    local_points_spatial,
    tangent_points_spatial,
    write_points_spatial,
)
from fsm.interactions.shapes.shape_distance import (
    HALF_SPACE,
    points_within,
    shape_boxes_planar,
    shape_boxes_spatial,
    shape_distance,
)
from fsm.interactions.shapes.swept import passing_points, passing_slots
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot
from fsm.model.bodies import contact_arrays as entry
from fsm.model.bodies.contact_arrays import (
    MARGIN,
    RENEWAL,
    STARTED,
    ContactArrays,
    GeometryKernels,
)
from fsm.model.contact.shapes import array_shape_tables as shape_tables
from fsm.model.contact.shapes.array_shape_weights import settle, tapered
from fsm.solve.stepping.vectors import copy_into

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


# broad phase ------------------------------------------------------------------------------------------------------------


@kernel
def _grounded(g: ContactArrays, shapes: Shapes) -> np.ndarray:
    """Units with a half-space of the ground."""
    own = shape_tables.shape_arrays_of(g)
    units = own.units
    out, count = np.empty(units.shape[0], dtype=np.int64), 0
    for k in range(units.shape[0]):
        if shapes.kind[units[k, 1]] == HALF_SPACE and shapes.body[units[k, 1]] == shape_tables.GROUND:
            out[count] = k
            count += 1
    return out[:count]


@kernel
def _centres(g: ContactArrays, shapes: Shapes, rows: np.ndarray) -> Points:
    """Centres of the first shapes of units, as points on the second."""
    own = shape_tables.shape_arrays_of(g)
    units, count = own.units, rows.shape[0]
    body, other = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    place, radius, around = np.empty((count, shapes.offset.shape[1])), np.zeros(count), np.zeros((count, 3, 3))
    for k in range(count):
        shape = units[rows[k], 0]
        body[k], other[k] = shapes.body[shape], units[rows[k], 1]
        for c in range(place.shape[1]):
            place[k, c] = shapes.offset[shape, c]
    return Points(body, place, radius, other, around)


@kernel
def _select(
    g: ContactArrays, poses: np.ndarray, low: np.ndarray, high: np.ndarray, body: np.ndarray, rounding: np.ndarray,
    grounded: np.ndarray, heights: np.ndarray,
) -> None:  # fmt: skip
    """Write the near units and their slots: units whose boxes overlap, without shapes far above the ground."""
    own = shape_tables.shape_arrays_of(g)
    state, margin, units = g.state, g.numbers[entry.MARGIN], own.units
    near, met, reach = own.near, own.met, own.reach
    dof, indptr, indices = entry.index_of(g)
    count = at = 0
    for k in range(units.shape[0]):
        one, two = units[k, 0], units[k, 1]
        apart = False
        for c in range(low.shape[1]):
            if low[one, c] - margin > high[two, c] or low[two, c] - margin > high[one, c]:
                apart = True
        if at < grounded.shape[0] and grounded[at] == k:
            apart = apart or heights[at] > reach[one] + rounding[two] + margin
            at += 1
        if apart:
            continue
        near[count] = k
        count += 1
        if met[k] == 0:
            met[k] = 1
            row, column = dof[body[one]], dof[body[two]]
            if row >= 0 and column >= 0 and find_slot(indptr, indices, row, column) < 0:
                state[entry.LACKS] = 1
    state[shape_tables.UNITS_NEAR] = count
    state[shape_tables.POINTS_NEAR] = _open_slots(g, near[:count], own.point_start, 0, own.near_points)
    first = own.point_body.shape[0]
    state[shape_tables.EDGES_NEAR] = _open_slots(g, near[:count], own.pair_start, first, own.near_edges)
    copy_into(poses, g.reference)
    state[entry.REFERRED] = 1


@kernel
def _open_slots(g: ContactArrays, units: np.ndarray, start: np.ndarray, first: int, out: np.ndarray) -> int:
    """Write the open slots of units as numbers, starting at `first`, and return the number of slots."""
    own = shape_tables.shape_arrays_of(g)
    slots_open, count = own.slots_open, 0
    for k in range(units.shape[0]):
        for slot in range(start[units[k]], start[units[k] + 1]):
            if slots_open[first + slot] == 1:
                out[count] = slot
                count += 1
    return count


@kernel
def _renew_planar(g: ContactArrays, poses: np.ndarray) -> int:
    if not entry.must_renew(g, poses):
        return 0
    shapes = shape_tables.shapes_planar(g)
    grounded = _grounded(g, shapes)
    local = local_points_planar(poses, np.arange(grounded.shape[0]), _centres(g, shapes, grounded), shapes)
    low, high = shape_boxes_planar(poses, shapes)
    _select(g, poses, low, high, shapes.body, shapes.radius, grounded, local[:, 2].copy())
    return 1


@kernel
def _renew_spatial(g: ContactArrays, poses: np.ndarray) -> int:
    if not entry.must_renew(g, poses):
        return 0
    shapes = shape_tables.shapes_spatial(g)
    grounded = _grounded(g, shapes)
    local = local_points_spatial(poses, np.arange(grounded.shape[0]), _centres(g, shapes, grounded), shapes)
    low, high = shape_boxes_spatial(poses, shapes)
    _select(g, poses, low, high, shapes.body, shapes.radius, grounded, local[:, 2].copy())
    return 1


# contacts ---------------------------------------------------------------------------------------------------------------


@kernel
def _find_planar(g: ContactArrays, poses: np.ndarray, below: float) -> int:
    near, points, shapes = shape_tables.near_points(g), shape_tables.points_of(g), shape_tables.shapes_planar(g)
    local = local_points_planar(poses, near, points, shapes)
    return int(points_within(local, near, points, shapes, below, g.slot, g.gap))


@kernel
def _find_spatial(g: ContactArrays, poses: np.ndarray, below: float) -> int:
    own = shape_tables.shape_arrays_of(g)
    slot, gap, edges = g.slot, g.gap, shape_tables.near_edges(g)
    near, points, shapes = shape_tables.near_points(g), shape_tables.points_of(g), shape_tables.shapes_spatial(g)
    count = points_within(local_points_spatial(poses, near, points, shapes), near, points, shapes, below, slot, gap)
    if edges.shape[0] == 0:
        return int(count)
    other, more = find_edges(poses, edges, shape_tables.edge_pairs_of(g), shape_tables.edges_of(g), below)
    first = own.point_body.shape[0]
    for i in range(other.shape[0]):
        slot[count + i], gap[count + i] = first + other[i], more[i]
    return int(count + other.shape[0])


@kernel
def _measure_planar(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    write_points_planar(
        poses, rates, g.slot[:count], shape_tables.points_of(g), shape_tables.shapes_planar(g), g.bodies,
        g.rate, g.gradient,
    )  # fmt: skip


@kernel
def _number_of_points(g: ContactArrays, count: int) -> int:
    """Number of points among the contacts; points come before pairs of edges."""
    own = shape_tables.shape_arrays_of(g)
    first, slot = own.point_body.shape[0], g.slot
    while count > 0 and slot[count - 1] >= first:
        count -= 1
    return count


@kernel
def _edges_among(g: ContactArrays, points: int, count: int) -> np.ndarray:
    own = shape_tables.shape_arrays_of(g)
    first, slot, out = own.point_body.shape[0], g.slot, np.empty(count - points, dtype=np.int64)
    for i in range(out.shape[0]):
        out[i] = slot[points + i] - first
    return out


@kernel
def _measure_spatial(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    points, bodies = _number_of_points(g, count), g.bodies
    slot, rate, gradient = g.slot[:points], g.rate, g.gradient
    write_points_spatial(
        poses, rates, slot, shape_tables.points_of(g), shape_tables.shapes_spatial(g), bodies, rate, gradient
    )
    if points < count:
        write_edges(
            poses, rates, _edges_among(g, points, count), shape_tables.edge_pairs_of(g), shape_tables.edges_of(g),
            bodies[points:], rate[points:],
            gradient[points:],
        )  # fmt: skip


@kernel
def _keep_rows(g: ContactArrays, rows: np.ndarray) -> None:
    """Nothing: shapes have only the slots and gaps that all geometries have."""


@kernel
def _tangent_planar(
    g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    tangent_points_planar(
        poses, rates, g.slot[:count], g.bodies[:count], g.gradient[:count],
        shape_tables.points_of(g), shape_tables.shapes_planar(g), entry.forces_of(g, 0, count), entry.index_of(g), stiffness,
        damping,
    )  # fmt: skip


@kernel
def _tangent_spatial(
    g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    points, index = _number_of_points(g, count), entry.index_of(g)
    bodies, gradient = g.bodies, g.gradient
    if points > 0:
        tangent_points_spatial(
            poses, rates, g.slot[:points], bodies[:points], gradient[:points], shape_tables.points_of(g),
            shape_tables.shapes_spatial(g), entry.forces_of(g, 0, points), index, stiffness, damping,
        )  # fmt: skip
    if points < count:
        tangent_edges(
            poses, rates, _edges_among(g, points, count), bodies[points:count], gradient[points:count],
            shape_tables.edge_pairs_of(g),
            shape_tables.edges_of(g), entry.forces_of(g, points, count), index, stiffness, damping,
        )  # fmt: skip


PLANAR_SHAPES = GeometryKernels(
    _renew_planar, _find_planar, _measure_planar, _keep_rows, tapered, _tangent_planar, passed_planar, settle
)
SPATIAL_SHAPES = GeometryKernels(
    _renew_spatial, _find_spatial, _measure_spatial, _keep_rows, tapered, _tangent_spatial, passed_spatial, settle
)
