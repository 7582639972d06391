"""Kernels of films in a compiled model (`ArrayModel`), called by their addresses; see `fsm.model.nodes.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import AT_REST, DAMPERS, DAMPING, FORCE, IN_MOTION, STIFFNESS, Q, U
from fsm.model.nodes.films.membrane import MembraneArrays, add_force, add_tangent, dissipation, stored_energy

_VISCOSITY, _SLOTS = 12, 13
"""Rows of a group's table after those of `MembraneArrays`."""


@kernel
def _films_of(t: np.ndarray) -> MembraneArrays:
    return MembraneArrays(
        integers_2d(t, 0), floats_2d(t, 1), floats_2d(t, 2), floats_2d(t, 3), floats_1d(t, 4), floats_3d(t, 5),
        floats_3d(t, 6), floats_3d(t, 7), floats_2d(t, 8), floats_2d(t, 9), floats_1d(t, 10), floats_1d(t, 11),
    )  # fmt: skip


@kernel
def _viscosity(own: np.ndarray, moving: float, least: float) -> float:
    """Kelvin-Voigt time (s) if the number of a kernel is `least` or above, else zero."""
    return float(floats_1d(own, _VISCOSITY)[0]) if moving >= least else 0.0


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    add_force(
        _films_of(own), floats_1d(table, Q), floats_1d(table, U), moving != DAMPERS, _viscosity(own, moving, IN_MOTION),
        floats_1d(table, FORCE),
    )  # fmt: skip
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _force(table, own, moving)
    films, stiffness, damping = _films_of(own), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    viscosity = _viscosity(own, moving, AT_REST)
    count, width = films.vectors.shape
    slots = integers_2d(own, _SLOTS).reshape(count, width, width)
    add_tangent(
        films, floats_1d(table, Q), floats_1d(table, U), moving != DAMPERS, _viscosity(own, moving, IN_MOTION), viscosity,
        slots, stiffness.shape[1], stiffness.reshape(-1), damping.reshape(-1),
    )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    stretch, bend = stored_energy(_films_of(own), floats_1d(table, Q))
    return stretch + bend


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    viscosity = _viscosity(own, moving, IN_MOTION)
    if viscosity == 0.0:
        return 0.0
    return dissipation(_films_of(own), floats_1d(table, Q), floats_1d(table, U), viscosity)


FILMS = (_force, _tangent, _stored, _lost)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""
