"""Weights of faces in contacts of shapes for a compiled model (`ArrayModel`); see `fsm.model.contact.shapes.overlaps`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import Shapes
from fsm.interactions.shapes.face_overlap import COLUMNS
from fsm.interactions.shapes.face_weights import ROW, ShapePoints, UnitTable, changed_weights, weigh_units
from fsm.interactions.shapes.face_weights import SHARE as SHARES
from fsm.kernels.jit import kernel
from fsm.model.bodies.contact_arrays import (
    CHANGES,
    STARTED,
    ContactArrays,
)
from fsm.model.contact.shapes.array_shape_tables import (
    UNITS_NEAR,
    shape_arrays_of,
)
from fsm.solve.stepping.vectors import copy_into


@kernel
def _sloped(in_force: np.ndarray, unit: int) -> bool:
    """Whether the weights of a unit change within a step."""
    sloped = False
    for c in range(SHARES + COLUMNS, ROW):
        sloped = sloped or in_force[unit, c] != 0.0
    return sloped


@kernel
def tapered(
    g: ContactArrays, poses: np.ndarray, found: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Contacts with weights that change within a step; see `ShapeContacts`."""
    own = shape_arrays_of(g)
    in_force, unit, slot, bodies = own.in_force, own.unit, g.slot, g.bodies
    order, count = g.gradient.shape[2], 0
    for i in range(found):
        count += 1 if _sloped(in_force, unit[slot[i]]) else 0
    if count == 0:  # these are views of other arrays, because the allocation of new arrays takes time
        return slot[:0], g.share[:0], g.rate[:0], g.gradient[:0]
    rows, count = np.empty(count, dtype=np.int64), 0
    for i in range(found):
        if _sloped(in_force, unit[slot[i]]):
            rows[count] = i
            count += 1
    of_rows = np.empty(count, dtype=np.int64)
    for k in range(count):
        of_rows[k] = unit[slot[rows[k]]]
    units, body, column = own.units, own.shape_body, own.column
    parts, gradients = changed_weights(poses, of_rows, units, body, own.solid_offset, own.solid_axes, in_force)
    part, gradient = np.empty(count), np.empty((count, order))
    half = order // 2
    for k in range(count):
        i, c = rows[k], column[slot[rows[k]]]
        part[k] = parts[k, c]
        swapped = body[units[of_rows[k], 0]] != bodies[i, 0]
        for b in range(2):
            for m in range(half):
                gradient[k, b * half + m] = gradients[k, c, 1 - b if swapped else b, m]
    return rows, part, gradient, np.zeros((count, order, order))


@kernel
def _look(g: ContactArrays, poses: np.ndarray, units: np.ndarray, held: np.ndarray) -> bool:
    """Update the weights of units that have moved; see `Overlaps.look`."""
    own = shape_arrays_of(g)
    known, on_axis = own.known, own.kit_on_axis
    flags, axis = np.empty(known.shape[0], dtype=np.bool_), np.empty(on_axis.shape[0], dtype=np.bool_)
    for i in range(known.shape[0]):
        flags[i] = known[i] == 1
    for i in range(on_axis.shape[0]):
        axis[i] = on_axis[i] == 1
    solids = Shapes(
        own.shape_body, own.shape_kind, own.solid_size, own.solid_offset, own.solid_axes, own.shape_radius
    )
    points = ShapePoints(own.kit_start, own.kit_local, own.kit_weight, axis)
    table = UnitTable(own.units, own.whole, own.base)
    changed = weigh_units(poses, units, held, table, solids, points, flags, own.latest)
    for i in range(known.shape[0]):
        known[i] = 1 if flags[i] else 0
    return bool(changed > 0)


@kernel
def _apply_weights(g: ContactArrays) -> None:
    own = shape_arrays_of(g)
    share, unit, column = g.share, own.unit, own.column
    weight, in_force = own.weight, own.in_force
    for i in range(share.shape[0]):
        share[i] = weight[i] * in_force[unit[i], SHARES + column[i]]


@kernel
def settle(g: ContactArrays, poses: np.ndarray, young: np.ndarray, new: bool) -> None:
    """See `GeometryKernels`: weights of faces."""
    own = shape_arrays_of(g)
    state, near, known = g.state, own.near, own.known
    near = near[: state[UNITS_NEAR]]
    latest, in_force = own.latest, own.in_force
    if not new:
        held, unit = np.zeros(near.shape[0], dtype=np.bool_), own.unit
        for i in range(young.shape[0]):
            for k in range(near.shape[0]):
                held[k] = held[k] or near[k] == unit[young[i]]
        if _look(g, poses, near, held):
            state[CHANGES] = 1
        return
    changed = False
    if state[CHANGES] == 1 and state[STARTED] == 1:  # the weights of the last accepted state are different
        committed, same = g.committed, True
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
        at = g.committed if state[STARTED] == 1 else poses
        if _look(g, at, unknown[:count], np.zeros(count, dtype=np.bool_)):
            for k in range(count):
                for c in range(ROW):
                    in_force[unknown[k], c] = latest[unknown[k], c]
            changed = True
    if changed:
        _apply_weights(g)
