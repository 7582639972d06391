"""Depths of contacts as additional unknowns of Newton's method in statics, for a model of arrays; see `ContactDepths`.

The depth of each slot is in the table `g` of its geometry; 0 means that the slot has no depth.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact_depths import advance_depths
from fsm.kernels.addresses import floats_1d, floats_3d, integers_1d, integers_2d, table_at
from fsm.kernels.jit import kernel
from fsm.segments.contact_arrays import (
    ACTING,
    AT,
    BODIES,
    BY_CLOSING,
    BY_DEPTH,
    GAP,
    GRADIENT,
    LINEAR,
    MOST,
    NORMAL_FORCE,
    NUMBERS,
    PRESSED,
    PRESSED_BEFORE,
    SLOT,
    STATE,
    exponent_of,
)
from fsm.stepping.vectors import copy_into

__all__ = ["advance", "linearisation_depths", "write_acting", "write_limited"]


@kernel
def linearisation_depths(g: np.ndarray, rows: np.ndarray, count: int) -> bool:
    """Write the depths of linearisation; return whether depths of new contacts are limited.

    The contacts in `rows` are tapered; they are linearised at their geometric depths. If depths are limited, this
    function writes geometric depths. The caller then computes their forces for `write_limited`.
    """
    at, pressed, slot = floats_1d(g, AT), floats_1d(g, PRESSED), integers_1d(g, SLOT)
    new = False
    for i in range(count):
        new = new or not pressed[slot[i]] > 0.0
    if new and floats_1d(g, NUMBERS)[MOST] > 0.0:
        return True
    for i in range(count):
        if pressed[slot[i]] > 0.0:
            at[i] = pressed[slot[i]]
    _geometric(g, rows)
    return False


@kernel
def write_limited(g: np.ndarray, force: np.ndarray, rows: np.ndarray, count: int) -> None:
    """Write the depths of linearisation; `force` (count,) is the normal force at geometric depths, N."""
    at, pressed, slot = floats_1d(g, AT), floats_1d(g, PRESSED), integers_1d(g, SLOT)
    most, power = floats_1d(g, NUMBERS)[MOST], 1.0 / exponent_of(g)
    for i in range(count):
        if pressed[slot[i]] > 0.0:
            at[i] = pressed[slot[i]]
        elif force[i] > most:
            at[i] *= (most / force[i]) ** power
    _geometric(g, rows)


@kernel
def _geometric(g: np.ndarray, rows: np.ndarray) -> None:
    at, gap = floats_1d(g, AT), floats_1d(g, GAP)
    for k in range(rows.shape[0]):
        at[rows[k]] = -gap[rows[k]]


@kernel
def write_acting(g: np.ndarray, pressed: bool, count: int) -> None:
    """Write the normal forces of the linearised law."""
    at, gap, acting = floats_1d(g, AT), floats_1d(g, GAP), floats_1d(g, ACTING)
    normal, by_depth = floats_1d(g, NORMAL_FORCE), floats_1d(g, BY_DEPTH)
    for i in range(count):
        acting[i] = normal[i]
        if pressed:
            acting[i] += by_depth[i] * (-gap[i] - at[i])


@kernel
def advance(groups: np.ndarray, change: np.ndarray, per_second: float, cut: bool) -> None:
    """Advance the depths by a change (n_bodies, 3 or 6) of the poses; with `cut`, start from the depths before the last
    change.
    """
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        pressed, before = floats_1d(g, PRESSED), floats_1d(g, PRESSED_BEFORE)
        if cut:
            copy_into(before, pressed)
            continue
        copy_into(pressed, before)
        pressed[:] = 0.0
        count, slot = integers_1d(g, STATE)[LINEAR], integers_1d(g, SLOT)
        depth = advance_depths(
            integers_2d(g, BODIES)[:count], floats_3d(g, GRADIENT)[:count], change, per_second, exponent_of(g),
            floats_1d(g, AT)[:count], floats_1d(g, NORMAL_FORCE)[:count], floats_1d(g, ACTING)[:count],
            floats_1d(g, BY_DEPTH)[:count], floats_1d(g, BY_CLOSING)[:count],
        )  # fmt: skip
        for i in range(count):
            pressed[slot[i]] = depth[i]
