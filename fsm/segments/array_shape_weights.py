"""Weights of faces in contacts of shapes for a compiled model (`ArrayModel`); see `fsm.segments.overlaps`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.face_overlap import COLUMNS
from fsm.interactions.face_weights import ROW, ShapePoints, UnitTable, changed_weights, weigh_units
from fsm.interactions.face_weights import SHARE as SHARES
from fsm.interactions.shapes import Shapes
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.segments.array_shape_tables import (
    BASE,
    COLUMN,
    IN_FORCE,
    KIT_LOCAL,
    KIT_ON_AXIS,
    KIT_START,
    KIT_WEIGHT,
    KNOWN,
    LATEST,
    NEAR,
    SHAPES,
    SOLID_AXES,
    SOLID_OFFSET,
    SOLID_SIZE,
    UNIT,
    UNITS,
    UNITS_NEAR,
    WEIGHT,
    WHOLE,
)
from fsm.segments.contact_arrays import BODIES, CHANGES, COMMITTED, GRADIENT, RATE, SHARE, SLOT, STARTED, STATE
from fsm.stepping.vectors import copy_into

__all__ = ["settle", "tapered"]


@kernel
def _sloped(in_force: np.ndarray, unit: int) -> bool:
    """Whether the weights of a unit change within a step."""
    sloped = False
    for c in range(SHARES + COLUMNS, ROW):
        sloped = sloped or in_force[unit, c] != 0.0
    return sloped


@kernel
def tapered(
    g: np.ndarray, poses: np.ndarray, found: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Contacts with weights that change within a step; see `ShapeContacts`."""
    in_force, unit, slot, bodies = floats_2d(g, IN_FORCE), integers_1d(g, UNIT), integers_1d(g, SLOT), integers_2d(g, BODIES)
    order, count = floats_3d(g, GRADIENT).shape[2], 0
    for i in range(found):
        count += 1 if _sloped(in_force, unit[slot[i]]) else 0
    if count == 0:  # these are views of other arrays, because the allocation of new arrays takes time
        return slot[:0], floats_1d(g, SHARE)[:0], floats_2d(g, RATE)[:0], floats_3d(g, GRADIENT)[:0]
    rows, count = np.empty(count, dtype=np.int64), 0
    for i in range(found):
        if _sloped(in_force, unit[slot[i]]):
            rows[count] = i
            count += 1
    own = np.empty(count, dtype=np.int64)
    for k in range(count):
        own[k] = unit[slot[rows[k]]]
    units, body, column = integers_2d(g, UNITS), integers_1d(g, SHAPES), integers_1d(g, COLUMN)
    parts, gradients = changed_weights(
        poses, own, units, body, floats_2d(g, SOLID_OFFSET), floats_3d(g, SOLID_AXES), in_force
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
    return rows, part, gradient, np.zeros((count, order, order))


@kernel
def _look(g: np.ndarray, poses: np.ndarray, units: np.ndarray, held: np.ndarray) -> bool:
    """Update the weights of units that have moved; see `Overlaps.look`."""
    known, on_axis = integers_1d(g, KNOWN), integers_1d(g, KIT_ON_AXIS)
    flags, axis = np.empty(known.shape[0], dtype=np.bool_), np.empty(on_axis.shape[0], dtype=np.bool_)
    for i in range(known.shape[0]):
        flags[i] = known[i] == 1
    for i in range(on_axis.shape[0]):
        axis[i] = on_axis[i] == 1
    k = SHAPES
    solids = Shapes(
        integers_1d(g, k), integers_1d(g, k + 1), floats_2d(g, SOLID_SIZE), floats_2d(g, SOLID_OFFSET),
        floats_3d(g, SOLID_AXES), floats_1d(g, k + 5),
    )  # fmt: skip
    points = ShapePoints(integers_1d(g, KIT_START), floats_2d(g, KIT_LOCAL), floats_1d(g, KIT_WEIGHT), axis)
    table = UnitTable(integers_2d(g, UNITS), floats_2d(g, WHOLE), floats_2d(g, BASE))
    changed = weigh_units(poses, units, held, table, solids, points, flags, floats_2d(g, LATEST))
    for i in range(known.shape[0]):
        known[i] = 1 if flags[i] else 0
    return bool(changed > 0)


@kernel
def _apply_weights(g: np.ndarray) -> None:
    share, unit, column = floats_1d(g, SHARE), integers_1d(g, UNIT), integers_1d(g, COLUMN)
    weight, in_force = floats_1d(g, WEIGHT), floats_2d(g, IN_FORCE)
    for i in range(share.shape[0]):
        share[i] = weight[i] * in_force[unit[i], SHARES + column[i]]


@kernel
def settle(g: np.ndarray, poses: np.ndarray, young: np.ndarray, new: bool) -> None:
    """See `GeometryKernels`: weights of faces."""
    state, near, known = integers_1d(g, STATE), integers_1d(g, NEAR), integers_1d(g, KNOWN)
    near = near[: state[UNITS_NEAR]]
    latest, in_force = floats_2d(g, LATEST), floats_2d(g, IN_FORCE)
    if not new:
        held, unit = np.zeros(near.shape[0], dtype=np.bool_), integers_1d(g, UNIT)
        for i in range(young.shape[0]):
            for k in range(near.shape[0]):
                held[k] = held[k] or near[k] == unit[young[i]]
        if _look(g, poses, near, held):
            state[CHANGES] = 1
        return
    changed = False
    if state[CHANGES] == 1 and state[STARTED] == 1:  # the weights of the last accepted state are different
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
