"""Kernels of bars between points in a compiled model (`ArrayModel`), called by their addresses; see
`fsm.model.nodes.arrays`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import DAMPING, FORCE, LAST, MEAN_OVER, NUMBERS, STIFFNESS, Q, U
from fsm.model.nodes.truss import (
    BarArrays,
    BarGroup,
    add_force,
    add_tangent,
    dissipation,
    mean_rates,
    stored_energy,
    stretch_rates,
)

_SLOTS = 3
"""Row of a group's table after those of `BarArrays`."""


def arrays_of_bars(group: BarGroup, slots: np.ndarray) -> list[np.ndarray]:
    """Arrays of a group in the order of the rows of its table; `slots` as in `ElementGroup.add_linearised`."""
    return [*group.arrays, np.ascontiguousarray(slots).reshape(-1, 2)]


@kernel
def _bars_of(t: np.ndarray) -> BarArrays:
    return BarArrays(integers_2d(t, 0), floats_2d(t, 1), floats_1d(t, 2))


@kernel
def _rates(table: np.ndarray, bars: BarArrays, moving: float) -> np.ndarray:
    """Rates of the stretches; they are zero at rest, and means over a quasi-static step."""
    if moving == 0.0:
        return np.zeros(bars.vectors.shape[0])
    mean_over = floats_1d(table, NUMBERS)[MEAN_OVER]
    if mean_over > 0.0:
        return mean_rates(bars, floats_1d(table, Q), floats_1d(table, LAST), mean_over)
    return stretch_rates(bars, floats_1d(table, Q), floats_1d(table, U))


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    bars = _bars_of(own)
    add_force(bars, floats_1d(table, Q), _rates(table, bars, moving), floats_1d(table, FORCE))
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    bars, stiffness, damping = _bars_of(own), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    q, rates = floats_1d(table, Q), _rates(table, bars, moving)
    turning = moving if floats_1d(table, NUMBERS)[MEAN_OVER] == 0.0 else 0.0
    add_force(bars, q, rates, floats_1d(table, FORCE))
    slots = integers_2d(own, _SLOTS).reshape(bars.vectors.shape[0], 2, 2)
    add_tangent(
        bars, q, floats_1d(table, U), rates, turning, moving, slots, stiffness.shape[1], stiffness.reshape(-1),
        damping.reshape(-1),
    )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return stored_energy(_bars_of(own), floats_1d(table, Q))


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    bars = _bars_of(own)
    return dissipation(bars, _rates(table, bars, moving))


BARS = (_force, _tangent, _stored, _lost)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""
