"""Kernels of cables in a compiled model (`ArrayModel`), called by their addresses; see `fsm.model.nodes.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import DAMPING, FORCE, STIFFNESS, Q, U
from fsm.model.nodes.cable import CableArrays, CableGroup, add_force, add_tangent, dissipation, stored_energy

_VISCOSITY, _ENGINEERING, _SLOTS = 11, 12, 13
"""Rows of a group's table after those of `CableArrays`."""


def arrays_of_cables(group: CableGroup, slots: np.ndarray) -> list[np.ndarray]:
    """Arrays of a group in the order of the rows of its table; `slots` as in `ElementGroup.add_linearised`."""
    count, width = slots.shape[:2]
    return [
        *group.arrays, np.array([group.viscosity]), np.array([int(group.engineering)], dtype=np.int64),
        np.ascontiguousarray(slots).reshape(count * width, width),
    ]  # fmt: skip


@kernel
def _cables_of(t: np.ndarray) -> CableArrays:
    return CableArrays(
        integers_2d(t, 0), floats_2d(t, 1), floats_1d(t, 2), floats_2d(t, 3), floats_1d(t, 4), floats_2d(t, 5),
        floats_3d(t, 6), floats_3d(t, 7), floats_1d(t, 8), floats_1d(t, 9), floats_2d(t, 10),
    )  # fmt: skip


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    engineering, viscosity = integers_1d(own, _ENGINEERING)[0] == 1, moving * floats_1d(own, _VISCOSITY)[0]
    add_force(_cables_of(own), engineering, floats_1d(table, Q), floats_1d(table, U), viscosity, floats_1d(table, FORCE))
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _force(table, own, moving)
    cables, stiffness, damping = _cables_of(own), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    engineering, viscosity = integers_1d(own, _ENGINEERING)[0] == 1, floats_1d(own, _VISCOSITY)[0]
    count, width = cables.vectors.shape
    slots = integers_2d(own, _SLOTS).reshape(count, width, width)
    add_tangent(
        cables, engineering, floats_1d(table, Q), floats_1d(table, U), moving * viscosity, viscosity, slots,
        stiffness.shape[1], stiffness.reshape(-1), damping.reshape(-1),
    )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return stored_energy(_cables_of(own), integers_1d(own, _ENGINEERING)[0] == 1, floats_1d(table, Q))


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    viscosity = moving * floats_1d(own, _VISCOSITY)[0]
    if viscosity == 0.0:
        return 0.0
    return dissipation(_cables_of(own), floats_1d(table, Q), floats_1d(table, U), viscosity)


CABLES = (_force, _tangent, _stored, _lost)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""
