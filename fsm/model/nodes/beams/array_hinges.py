"""Kernels of hinges in a compiled model (`ArrayModel`), called by their addresses; see `fsm.model.nodes.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import DAMPING, FORCE, NOW, NUMBERS, STIFFNESS, Q, U
from fsm.model.nodes.beams.hinge import (
    HingeArrays,
    HingeGroup,
    add_force,
    add_tangent,
    dissipation,
    latch,
    set_law,
    stored_energy,
)

_SLOTS = len(HingeArrays._fields)
"""Row of a group's table after those of `HingeArrays`."""


def arrays_of_hinges(group: HingeGroup, slots: np.ndarray) -> list[np.ndarray]:
    """Arrays of a group in the order of the rows of its table; `slots` as in `ElementGroup.add_linearised`."""
    return [*group.arrays, np.ascontiguousarray(slots).reshape(-1, 2)]


@kernel
def _hinges_of(table: np.ndarray, t: np.ndarray) -> HingeArrays:
    """Hinges with the law of the present time."""
    hinges = HingeArrays(
        integers_2d(t, 0), floats_1d(t, 1), floats_1d(t, 2), floats_2d(t, 3), floats_1d(t, 4), integers_1d(t, 5)
    )
    set_law(hinges, floats_1d(table, NUMBERS)[NOW])
    return hinges


@kernel
def _rates(table: np.ndarray, moving: float) -> np.ndarray:
    return floats_1d(table, U) if moving == 1.0 else np.zeros(floats_1d(table, U).shape[0])


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    add_force(_hinges_of(table, own), floats_1d(table, Q), _rates(table, moving), floats_1d(table, FORCE))
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    hinges, q, rates = _hinges_of(table, own), floats_1d(table, Q), _rates(table, moving)
    stiffness, damping = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    add_force(hinges, q, rates, floats_1d(table, FORCE))
    slots = integers_2d(own, _SLOTS).reshape(hinges.vectors.shape[0], 2, 2)
    add_tangent(hinges, q, rates, slots, stiffness.shape[1], stiffness.reshape(-1), damping.reshape(-1))
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return stored_energy(_hinges_of(table, own), floats_1d(table, Q))


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return dissipation(_hinges_of(table, own), floats_1d(table, Q), _rates(table, moving))


HINGES = (_force, _tangent, _stored, _lost)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""


@kernel
def latch_hinges(table: np.ndarray, own: np.ndarray, t: float) -> float:
    """Latch hinges at an accepted state."""
    latch(_hinges_of(table, own), t, floats_1d(table, Q), floats_1d(table, U))
    return 0.0
