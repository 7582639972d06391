"""Kernels of flexible facets in a compiled model (`ArrayModel`), called by their addresses; see `fsm.model.nodes.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import DAMPING, FORCE, STIFFNESS, Q, U
from fsm.model.nodes.facets.facet import FacetArrays, add_facet_force, add_facet_tangent, facet_energy
from fsm.model.nodes.facets.facet_damping import add_facet_damping, facet_dissipation, facet_rates

EDGES, ROWS, POINTS, _TENSION, _BEND, _VISCOSITY, _SLOTS = 1, 6, 9, 10, 11, 12, 13
"""Rows of a group's table. The arrays of `FacetArrays` come first; arrays of four dimensions are stored flat. Rows of
damping, the Kelvin-Voigt time and slots follow."""


@kernel
def _facets_of(t: np.ndarray) -> FacetArrays:
    return FacetArrays(
        integers_2d(t, 0), floats_1d(t, EDGES).reshape(-1, 3, 3, 9), floats_3d(t, 2), floats_3d(t, 3), floats_3d(t, 4),
        floats_3d(t, 5), floats_1d(t, ROWS).reshape(-1, 3, 5, 9), floats_3d(t, 7), floats_3d(t, 8),
        floats_1d(t, POINTS).reshape(-1, 3, 3, 15), floats_2d(t, _TENSION),
    )  # fmt: skip


@kernel
def _dissipated(table: np.ndarray, own: np.ndarray, force: np.ndarray) -> float:
    """Add the forces of damping; returns the dissipated power."""
    facets, bend, q = _facets_of(own), floats_1d(own, _BEND).reshape(-1, 3, 5, 9), floats_1d(table, Q)
    count = facets.vectors.shape[0]
    stretching, turning = np.empty((count, 5, 3)), np.empty((count, 3, 3))
    facet_rates(facets, bend, q, floats_1d(table, U), stretching, turning)
    return facet_dissipation(facets, bend, floats_1d(own, _VISCOSITY)[0], q, stretching, turning, force)


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    force = floats_1d(table, FORCE)
    add_facet_force(_facets_of(own), floats_1d(table, Q), force)
    if moving * floats_1d(own, _VISCOSITY)[0] > 0.0:
        _dissipated(table, own, force)
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _force(table, own, moving)
    facets, q = _facets_of(own), floats_1d(table, Q)
    stiffness, slots = floats_3d(table, STIFFNESS), integers_2d(own, _SLOTS)
    count, tau = slots.shape[0] // 9, floats_1d(own, _VISCOSITY)[0]
    add_facet_tangent(
        facets, q, np.empty((0, 5, 3)), slots.reshape(count, 9, 9), stiffness.shape[1], stiffness.reshape(-1)
    )
    if moving * tau > 0.0:
        bend, u, damping = floats_1d(own, _BEND).reshape(-1, 3, 5, 9), floats_1d(table, U), floats_3d(table, DAMPING)
        stretching, turning = np.empty((count, 5, 3)), np.empty((count, 3, 3))
        facet_rates(facets, bend, q, u, stretching, turning)
        add_facet_damping(
            facets, bend, tau, q, u, stretching, turning, slots.reshape(count, 9, 9), stiffness.shape[1],
            stiffness.reshape(-1), damping.reshape(-1),
        )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    stretch, bend = facet_energy(_facets_of(own), floats_1d(table, Q))
    return stretch + bend


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    if moving * floats_1d(own, _VISCOSITY)[0] == 0.0:
        return 0.0
    return _dissipated(table, own, np.zeros(floats_1d(table, Q).shape[0]))


FACETS = (_force, _tangent, _stored, _lost)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""
