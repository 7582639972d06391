"""Kernels of contacts of shapes for a model of arrays; see `fsm.segments.contact_arrays` and `fsm.segments.shape_contacts`.

All pairs of shapes have their slots in the tables. The broad phase only selects those that are near.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.displacement_bound import furthest_motion, moved_beyond
from fsm.interactions.edge_edge import find_edges, measure_edges, tangent_edges
from fsm.interactions.face_overlap import COLUMNS
from fsm.interactions.face_weights import ROW, changed_weights, weigh_units
from fsm.interactions.face_weights import SHARE as SHARES
from fsm.interactions.point_shape_planar import (
    find_points_planar,
    local_points_planar,
    measure_points_planar,
    tangent_points_planar,
)
from fsm.interactions.point_shape_spatial import (
    find_points_spatial,
    local_points_spatial,
    measure_points_spatial,
    tangent_points_spatial,
)
from fsm.interactions.shape_boxes import shape_boxes_planar, shape_boxes_spatial
from fsm.interactions.shape_distance import HALF_SPACE, shape_distance
from fsm.interactions.shapes import ContactForces, EdgePairs, Edges, Points, Shapes
from fsm.interactions.swept import edges_pass, local_edges, path_pose, path_steps, points_pass
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot
from fsm.segments.contact_arrays import (
    CHANGES,
    COMMITTED,
    LACKS,
    MARGIN,
    MOVING,
    NUMBERS,
    OWN,
    OWN_STATE,
    RADII,
    REFERENCE,
    REFERRED,
    SHARE,
    STARTED,
    STATE,
    GeometryKernels,
    index_of,
)
from fsm.stepping.vectors import copy_into

__all__ = ["PLANAR_SHAPES", "SPATIAL_SHAPES", "ShapeArrays"]

_RENEWAL = 0.4
"""Displacement, relative to the margin, after which the broad phase is renewed."""
GROUND = 0
"""Index of the ground."""
_TINY = 1e-12
"""Round-off of distances, m."""


class ShapeArrays(NamedTuple):
    """Arrays of shapes, after `ContactArrays`; see `fsm.segments.shape_tables`.

    Attributes
    ----------
    points, shapes, edges, edge_pairs : tables
    reach : (s,) array, m
        Distance of the farthest point of a shape from its centre.
    limit : (n_points,) array, m
        Depth above which a point has passed into a solid shape.
    units, point_start, pair_start, unit, column, weight : see `Tables`
    slots_open : (n_slots,) int array
        1 for slots that may have contact.
    met : (u,) int array
        1 for units that have been near; their bodies have blocks in the pattern.
    near, near_points, near_edges : int arrays
        Units, points and pairs of edges that are near; `state` holds their numbers.
    known, latest, in_force : see `Overlaps`
    whole, base : areas and weights for tilted faces, see `Units`
    solid_size, solid_offset, solid_axes, kit_start, kit_local, kit_weight, kit_on_axis : see `Kit`
    """

    points: Points
    shapes: Shapes
    edges: Edges
    edge_pairs: EdgePairs
    reach: np.ndarray
    limit: np.ndarray
    units: np.ndarray
    point_start: np.ndarray
    pair_start: np.ndarray
    unit: np.ndarray
    column: np.ndarray
    weight: np.ndarray
    slots_open: np.ndarray
    met: np.ndarray
    near: np.ndarray
    near_points: np.ndarray
    near_edges: np.ndarray
    known: np.ndarray
    latest: np.ndarray
    in_force: np.ndarray
    whole: np.ndarray
    base: np.ndarray
    solid_size: np.ndarray
    solid_offset: np.ndarray
    solid_axes: np.ndarray
    kit_start: np.ndarray
    kit_local: np.ndarray
    kit_weight: np.ndarray
    kit_on_axis: np.ndarray


_POINTS, _SHAPES, _EDGES, _EDGE_PAIRS, _REACH = OWN, OWN + 4, OWN + 10, OWN + 15, OWN + 17
(
    _LIMIT, _UNITS, _POINT_START, _PAIR_START, _UNIT, _COLUMN, _WEIGHT, _OPEN, _MET, _NEAR, _NEAR_POINTS, _NEAR_EDGES,
    _KNOWN, _LATEST, _IN_FORCE, _WHOLE, _BASE, _SOLID_SIZE, _SOLID_OFFSET, _SOLID_AXES, _KIT_START, _KIT_LOCAL,
    _KIT_WEIGHT, _KIT_ON_AXIS,
) = range(_REACH + 1, _REACH + 25)  # fmt: skip
_UNITS_NEAR, _POINTS_NEAR, _EDGES_NEAR = OWN_STATE, OWN_STATE + 1, OWN_STATE + 2
"""Indices of `ContactArrays.state`: numbers of near units, points and pairs of edges."""


@kernel
def _points_of(g: np.ndarray) -> Points:
    k = _POINTS
    return Points(integers_1d(g, k), floats_2d(g, k + 1), floats_1d(g, k + 2), integers_1d(g, k + 3))


@kernel
def _shapes_planar(g: np.ndarray) -> Shapes:
    k = _SHAPES
    return Shapes(
        integers_1d(g, k), integers_1d(g, k + 1), floats_2d(g, k + 2), floats_2d(g, k + 3), floats_1d(g, k + 4),
        floats_1d(g, k + 5),
    )  # fmt: skip


@kernel
def _shapes_spatial(g: np.ndarray) -> Shapes:
    k = _SHAPES
    return Shapes(
        integers_1d(g, k), integers_1d(g, k + 1), floats_2d(g, k + 2), floats_2d(g, k + 3), floats_3d(g, k + 4),
        floats_1d(g, k + 5),
    )  # fmt: skip


@kernel
def _edges_of(g: np.ndarray) -> Edges:
    k = _EDGES
    return Edges(integers_1d(g, k), floats_2d(g, k + 1), floats_2d(g, k + 2), floats_1d(g, k + 3), floats_1d(g, k + 4))


@kernel
def _edge_pairs_of(g: np.ndarray) -> EdgePairs:
    return EdgePairs(integers_2d(g, _EDGE_PAIRS), floats_1d(g, _EDGE_PAIRS + 1))


# broad phase ------------------------------------------------------------------------------------------------------------


@kernel
def _must_renew(g: np.ndarray, poses: np.ndarray) -> bool:
    bound = _RENEWAL * floats_1d(g, NUMBERS)[MARGIN]
    if integers_1d(g, STATE)[REFERRED] == 0:
        return True
    return bool(moved_beyond(poses, floats_2d(g, REFERENCE), integers_1d(g, MOVING), floats_1d(g, RADII), bound))


@kernel
def _grounded(g: np.ndarray, shapes: Shapes) -> np.ndarray:
    """Units with a half-space of the ground."""
    units = integers_2d(g, _UNITS)
    out, count = np.empty(units.shape[0], dtype=np.int64), 0
    for k in range(units.shape[0]):
        if shapes.kind[units[k, 1]] == HALF_SPACE and shapes.body[units[k, 1]] == GROUND:
            out[count] = k
            count += 1
    return out[:count]


@kernel
def _centres(g: np.ndarray, shapes: Shapes, rows: np.ndarray) -> Points:
    """Centres of the first shapes of units, as points on the second."""
    units, count = integers_2d(g, _UNITS), rows.shape[0]
    body, other = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    place, radius = np.empty((count, shapes.offset.shape[1])), np.zeros(count)
    for k in range(count):
        shape = units[rows[k], 0]
        body[k], other[k] = shapes.body[shape], units[rows[k], 1]
        for c in range(place.shape[1]):
            place[k, c] = shapes.offset[shape, c]
    return Points(body, place, radius, other)


@kernel
def _select(
    g: np.ndarray, poses: np.ndarray, low: np.ndarray, high: np.ndarray, body: np.ndarray, rounding: np.ndarray,
    grounded: np.ndarray, heights: np.ndarray,
) -> None:  # fmt: skip
    """Write the near units and their slots: boxes that overlap, without shapes that are far above the ground."""
    state, margin, units = integers_1d(g, STATE), floats_1d(g, NUMBERS)[MARGIN], integers_2d(g, _UNITS)
    near, met, reach = integers_1d(g, _NEAR), integers_1d(g, _MET), floats_1d(g, _REACH)
    dof, indptr, indices = index_of(g)
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
                state[LACKS] = 1
    state[_UNITS_NEAR] = count
    state[_POINTS_NEAR] = _open_slots(g, near[:count], integers_1d(g, _POINT_START), 0, integers_1d(g, _NEAR_POINTS))
    first = integers_1d(g, _POINTS).shape[0]
    state[_EDGES_NEAR] = _open_slots(g, near[:count], integers_1d(g, _PAIR_START), first, integers_1d(g, _NEAR_EDGES))
    copy_into(poses, floats_2d(g, REFERENCE))
    state[REFERRED] = 1


@kernel
def _open_slots(g: np.ndarray, units: np.ndarray, start: np.ndarray, first: int, out: np.ndarray) -> int:
    """Write the open slots of units, less the first, and return their number."""
    slots_open, count = integers_1d(g, _OPEN), 0
    for k in range(units.shape[0]):
        for slot in range(start[units[k]], start[units[k] + 1]):
            if slots_open[first + slot] == 1:
                out[count] = slot
                count += 1
    return count


@kernel
def _renew_planar(g: np.ndarray, poses: np.ndarray) -> int:
    if not _must_renew(g, poses):
        return 0
    shapes = _shapes_planar(g)
    grounded = _grounded(g, shapes)
    local = local_points_planar(poses, np.arange(grounded.shape[0]), _centres(g, shapes, grounded), shapes)
    low, high = shape_boxes_planar(poses, shapes)
    _select(g, poses, low, high, shapes.body, shapes.radius, grounded, local[:, 2].copy())
    return 1


@kernel
def _renew_spatial(g: np.ndarray, poses: np.ndarray) -> int:
    if not _must_renew(g, poses):
        return 0
    shapes = _shapes_spatial(g)
    grounded = _grounded(g, shapes)
    local = local_points_spatial(poses, np.arange(grounded.shape[0]), _centres(g, shapes, grounded), shapes)
    low, high = shape_boxes_spatial(poses, shapes)
    _select(g, poses, low, high, shapes.body, shapes.radius, grounded, local[:, 2].copy())
    return 1


# contacts ---------------------------------------------------------------------------------------------------------------


@kernel
def _near_points(g: np.ndarray) -> np.ndarray:
    return integers_1d(g, _NEAR_POINTS)[: integers_1d(g, STATE)[_POINTS_NEAR]]


@kernel
def _near_edges(g: np.ndarray) -> np.ndarray:
    return integers_1d(g, _NEAR_EDGES)[: integers_1d(g, STATE)[_EDGES_NEAR]]


@kernel
def _joined(first: np.ndarray, second: np.ndarray, shift: int) -> np.ndarray:
    out = np.empty(first.shape[0] + second.shape[0], dtype=np.int64)
    for i in range(first.shape[0]):
        out[i] = first[i]
    for i in range(second.shape[0]):
        out[first.shape[0] + i] = second[i] + shift
    return out


@kernel
def _find_planar(g: np.ndarray, poses: np.ndarray, below: float) -> tuple[np.ndarray, np.ndarray]:
    found: tuple[np.ndarray, np.ndarray] = find_points_planar(
        poses, _near_points(g), _points_of(g), _shapes_planar(g), below
    )
    return found


@kernel
def _find_spatial(g: np.ndarray, poses: np.ndarray, below: float) -> tuple[np.ndarray, np.ndarray]:
    points, edges = _points_of(g), _near_edges(g)
    slot, gap = find_points_spatial(poses, _near_points(g), points, _shapes_spatial(g), below)
    if edges.shape[0] == 0:
        return slot, gap
    other, more = find_edges(poses, edges, _edge_pairs_of(g), _edges_of(g), below)
    if other.shape[0] == 0:
        return slot, gap
    gaps = np.empty(gap.shape[0] + more.shape[0])
    for i in range(gaps.shape[0]):
        gaps[i] = gap[i] if i < gap.shape[0] else more[i - gap.shape[0]]
    return _joined(slot, other, points.body.shape[0]), gaps


@kernel
def _measure_planar(
    g: np.ndarray, poses: np.ndarray, rates: np.ndarray, slot: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    measured: tuple[np.ndarray, np.ndarray, np.ndarray] = measure_points_planar(
        poses, rates, slot, _points_of(g), _shapes_planar(g)
    )
    return measured


@kernel
def _number_of_points(g: np.ndarray, slot: np.ndarray) -> int:
    """Number of points among slots, which come first."""
    first, count = integers_1d(g, _POINTS).shape[0], slot.shape[0]
    while count > 0 and slot[count - 1] >= first:
        count -= 1
    return count


@kernel
def _edges_among(g: np.ndarray, slot: np.ndarray, count: int) -> np.ndarray:
    first, out = integers_1d(g, _POINTS).shape[0], np.empty(slot.shape[0] - count, dtype=np.int64)
    for i in range(out.shape[0]):
        out[i] = slot[count + i] - first
    return out


@kernel
def _measure_spatial(
    g: np.ndarray, poses: np.ndarray, rates: np.ndarray, slot: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    count = _number_of_points(g, slot)
    bodies, rate, gradient = measure_points_spatial(poses, rates, slot[:count], _points_of(g), _shapes_spatial(g))
    if count == slot.shape[0]:
        return bodies, rate, gradient
    edges = _edges_among(g, slot, count)
    others, more, gradients = measure_edges(poses, rates, edges, _edge_pairs_of(g), _edges_of(g))
    return (
        np.concatenate((bodies, others)), np.concatenate((rate, more)), np.concatenate((gradient, gradients))
    )  # fmt: skip


@kernel
def _tangent_planar(
    g: np.ndarray, poses: np.ndarray, rates: np.ndarray, slot: np.ndarray, bodies: np.ndarray, gradient: np.ndarray,
    forces: ContactForces, stiffness: np.ndarray, damping: np.ndarray,
) -> None:  # fmt: skip
    tangent_points_planar(
        poses, rates, slot, bodies, gradient, _points_of(g), _shapes_planar(g), forces, index_of(g), stiffness, damping,
    )  # fmt: skip


@kernel
def _tangent_spatial(
    g: np.ndarray, poses: np.ndarray, rates: np.ndarray, slot: np.ndarray, bodies: np.ndarray, gradient: np.ndarray,
    forces: ContactForces, stiffness: np.ndarray, damping: np.ndarray,
) -> None:  # fmt: skip
    count, index = _number_of_points(g, slot), index_of(g)
    if count > 0:
        tangent_points_spatial(
            poses, rates, slot[:count], bodies[:count], gradient[:count], _points_of(g), _shapes_spatial(g), forces, index,
            stiffness, damping,
        )  # fmt: skip
    if count < slot.shape[0]:
        own = ContactForces(
            forces.normal[count:], forces.by_depth[count:], forces.by_closing[count:], forces.effort[count:],
            forces.by_slip[count:], forces.by_normal[count:], forces.friction,
        )  # fmt: skip
        tangent_edges(
            poses, rates, _edges_among(g, slot, count), bodies[count:], gradient[count:], _edge_pairs_of(g), _edges_of(g),
            own, index, stiffness, damping,
        )  # fmt: skip


# weights of faces -------------------------------------------------------------------------------------------------------


@kernel
def _tapered(
    g: np.ndarray, poses: np.ndarray, slot: np.ndarray, bodies: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Contacts whose weights change within a step; see `ShapeContacts`."""
    in_force, unit = floats_2d(g, _IN_FORCE), integers_1d(g, _UNIT)
    order = bodies.shape[1] * (3 if poses.shape[1] == 3 else 6)
    rows, count = np.empty(slot.shape[0], dtype=np.int64), 0
    for i in range(slot.shape[0]):
        sloped = False
        for c in range(SHARES + COLUMNS, ROW):
            sloped = sloped or in_force[unit[slot[i]], c] != 0.0
        if sloped:
            rows[count] = i
            count += 1
    if count == 0:
        return rows[:0], np.zeros(0), np.zeros((0, order)), np.zeros((0, order, order))
    own = np.empty(count, dtype=np.int64)
    for k in range(count):
        own[k] = unit[slot[rows[k]]]
    units, body, column = integers_2d(g, _UNITS), integers_1d(g, _SHAPES), integers_1d(g, _COLUMN)
    parts, gradients = changed_weights(
        poses, own, units, body, floats_2d(g, _SOLID_OFFSET), floats_3d(g, _SOLID_AXES), in_force
    )
    part, gradient = np.empty(count), np.empty((count, order))
    half = order // 2
    for k in range(count):
        i, c = rows[k], column[slot[rows[k]]]
        part[k] = parts[k, c]
        swapped = body[units[own[k], 0]] != bodies[i, 0]
        for b in range(2):
            for m in range(half):
                gradient[k, b * half + m] = gradients[k, c, 1 - b if swapped else b, m]
    return rows[:count], part, gradient, np.zeros((count, order, order))


@kernel
def _look(g: np.ndarray, poses: np.ndarray, units: np.ndarray, held: np.ndarray) -> bool:
    """Update the weights of units that have moved; see `Overlaps.look`."""
    known, on_axis = integers_1d(g, _KNOWN), integers_1d(g, _KIT_ON_AXIS)
    flags, axis = np.empty(known.shape[0], dtype=np.bool_), np.empty(on_axis.shape[0], dtype=np.bool_)
    for i in range(known.shape[0]):
        flags[i] = known[i] == 1
    for i in range(on_axis.shape[0]):
        axis[i] = on_axis[i] == 1
    k = _SHAPES
    changed = weigh_units(
        poses, units, held, integers_2d(g, _UNITS), integers_1d(g, k), integers_1d(g, k + 1), floats_2d(g, _SOLID_SIZE),
        floats_1d(g, k + 5), floats_2d(g, _SOLID_OFFSET), floats_3d(g, _SOLID_AXES), integers_1d(g, _KIT_START),
        floats_2d(g, _KIT_LOCAL), floats_1d(g, _KIT_WEIGHT), axis, floats_2d(g, _WHOLE), floats_2d(g, _BASE), flags,
        floats_2d(g, _LATEST),
    )  # fmt: skip
    for i in range(known.shape[0]):
        known[i] = 1 if flags[i] else 0
    return bool(changed > 0)


@kernel
def _apply_weights(g: np.ndarray) -> None:
    share, unit, column = floats_1d(g, SHARE), integers_1d(g, _UNIT), integers_1d(g, _COLUMN)
    weight, in_force = floats_1d(g, _WEIGHT), floats_2d(g, _IN_FORCE)
    for i in range(share.shape[0]):
        share[i] = weight[i] * in_force[unit[i], SHARES + column[i]]


@kernel
def _settle(g: np.ndarray, poses: np.ndarray, young: np.ndarray, new: bool) -> None:
    """See `GeometryKernels`: weights of faces."""
    state, near, known = integers_1d(g, STATE), integers_1d(g, _NEAR), integers_1d(g, _KNOWN)
    near = near[: state[_UNITS_NEAR]]
    latest, in_force = floats_2d(g, _LATEST), floats_2d(g, _IN_FORCE)
    if not new:
        held, unit = np.zeros(near.shape[0], dtype=np.bool_), integers_1d(g, _UNIT)
        for i in range(young.shape[0]):
            for k in range(near.shape[0]):
                held[k] = held[k] or near[k] == unit[young[i]]
        if _look(g, poses, near, held):
            state[CHANGES] = 1
        return
    changed = False
    if state[CHANGES] == 1 and state[STARTED] == 1:  # the last accepted state has other weights
        committed, same = floats_2d(g, COMMITTED), True
        for i in range(poses.shape[0]):
            for c in range(poses.shape[1]):
                same = same and poses[i, c] == committed[i, c]
        if not same:
            copy_into(latest, in_force)
            state[CHANGES], changed = 0, True
    unknown, count = np.empty(near.shape[0], dtype=np.int64), 0
    for k in range(near.shape[0]):
        if known[near[k]] == 0:
            unknown[count] = near[k]
            count += 1
    if count > 0:
        at = floats_2d(g, COMMITTED) if state[STARTED] == 1 else poses
        if _look(g, at, unknown[:count], np.zeros(count, dtype=np.bool_)):
            for k in range(count):
                for c in range(ROW):
                    in_force[unknown[k], c] = latest[unknown[k], c]
            changed = True
    if changed:
        _apply_weights(g)


# passing through --------------------------------------------------------------------------------------------------------


@kernel
def _candidates(g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slots that may have passed through a face: near ones if the last accepted state is near the last renewal, else all."""
    bound = _RENEWAL * floats_1d(g, NUMBERS)[MARGIN]
    start, reference = floats_2d(g, COMMITTED), floats_2d(g, REFERENCE)
    if not moved_beyond(start, reference, integers_1d(g, MOVING), floats_1d(g, RADII), bound):
        return _near_points(g), _near_edges(g)
    points, edges = integers_1d(g, _POINTS).shape[0], integers_2d(g, _EDGE_PAIRS).shape[0]
    out, others = np.empty(points, dtype=np.int64), np.empty(edges, dtype=np.int64)
    slots_open, count, number = integers_1d(g, _OPEN), 0, 0
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
    """Points that may reach their shapes when both move by at most `motion`, m; half-spaces that turn have no such bound."""
    out, count = np.empty(points.shape[0], dtype=np.int64), 0
    for i in range(points.shape[0]):
        of = shape[points[i]]
        unbounded = kind[of] == HALF_SPACE and body[of] != GROUND
        if unbounded or shape_distance(kind[of], size[of], local[i]) <= 2.0 * motion + _TINY:
            out[count] = points[i]
            count += 1
    return out[:count]


@kernel
def _point_data(g: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Kinds and sizes of the shapes of points, and their limits of depth."""
    shape, kind, size = integers_1d(g, _POINTS + 3), integers_1d(g, _SHAPES + 1), floats_2d(g, _SHAPES + 2)
    limit, count = floats_1d(g, _LIMIT), points.shape[0]
    kinds, sizes, limits = np.empty(count, dtype=np.int64), np.empty((count, 3)), np.empty(count)
    for i in range(count):
        of = shape[points[i]]
        kinds[i], limits[i] = kind[of], limit[points[i]]
        for c in range(3):
            sizes[i, c] = size[of, c]
    return kinds, sizes, limits


@kernel
def _passed_planar(g: np.ndarray, poses: np.ndarray) -> bool:
    start = floats_2d(g, COMMITTED)
    if integers_1d(g, STATE)[STARTED] == 0:
        return False
    points, _ = _candidates(g)
    probes, shapes = _points_of(g), _shapes_planar(g)
    motion = furthest_motion(start, poses, integers_1d(g, MOVING), floats_1d(g, RADII))
    local = local_points_planar(start, points, probes, shapes)
    points = _reachable(points, local, probes.shape, shapes.body, shapes.kind, shapes.size, motion)
    if points.shape[0] == 0:
        return False
    kinds, sizes, limits = _point_data(g, points)
    steps = path_steps(start, poses)
    before = local_points_planar(start, points, probes, shapes)
    for k in range(steps):
        after = local_points_planar(path_pose(start, poses, (k + 1) / steps), points, probes, shapes)
        if points_pass(kinds, sizes, limits, before, after).any():
            return True
        before = after
    return False


@kernel
def _passed_spatial(g: np.ndarray, poses: np.ndarray) -> bool:
    start = floats_2d(g, COMMITTED)
    if integers_1d(g, STATE)[STARTED] == 0:
        return False
    points, edges = _candidates(g)
    probes, shapes, table, pairs = _points_of(g), _shapes_spatial(g), _edges_of(g), integers_2d(g, _EDGE_PAIRS)
    motion = furthest_motion(start, poses, integers_1d(g, MOVING), floats_1d(g, RADII))
    local = local_points_spatial(start, points, probes, shapes)
    points = _reachable(points, local, probes.shape, shapes.body, shapes.kind, shapes.size, motion)
    edges = _reachable_edges(g, start, edges, motion)
    if points.shape[0] == 0 and edges.shape[0] == 0:
        return False
    kinds, sizes, limits = _point_data(g, points)
    half, steps = np.empty(edges.shape[0]), path_steps(start, poses)
    for i in range(edges.shape[0]):
        half[i] = table.half[pairs[edges[i], 1]]
    before = local_points_spatial(start, points, probes, shapes)
    ends = local_edges(start, edges, pairs, table)
    for k in range(steps):
        at = path_pose(start, poses, (k + 1) / steps)
        after, others = local_points_spatial(at, points, probes, shapes), local_edges(at, edges, pairs, table)
        if points_pass(kinds, sizes, limits, before, after).any() or edges_pass(half, ends, others).any():
            return True
        before, ends = after, others
    return False


@kernel
def _reachable_edges(g: np.ndarray, poses: np.ndarray, edges: np.ndarray, motion: float) -> np.ndarray:
    """Pairs of edges with a distance of their middle lines of at most twice `motion`, m."""
    table, pairs = _edges_of(g), integers_2d(g, _EDGE_PAIRS)
    unscaled = EdgePairs(pairs, np.zeros(pairs.shape[0]))
    slot, gap = find_edges(poses, edges, unscaled, table, 2.0 * motion + _TINY)
    out, count = np.empty(slot.shape[0], dtype=np.int64), 0
    for i in range(slot.shape[0]):
        apart = gap[i] + table.radius[pairs[slot[i], 0]] + table.radius[pairs[slot[i], 1]]
        if apart <= 2.0 * motion + _TINY:
            out[count] = slot[i]
            count += 1
    return out[:count]


PLANAR_SHAPES = GeometryKernels(
    _renew_planar, _find_planar, _measure_planar, _tapered, _tangent_planar, _passed_planar, _settle
)
SPATIAL_SHAPES = GeometryKernels(
    _renew_spatial, _find_spatial, _measure_spatial, _tapered, _tangent_spatial, _passed_spatial, _settle
)
