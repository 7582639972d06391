"""Kernels of flexible facets in a compiled model (`ArrayModel`), called by their addresses; see `fsm.model.nodes.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import DAMPERS, DAMPING, FORCE, LAST, MEAN_OVER, NUMBERS, STIFFNESS, Q, U, no_power
from fsm.model.nodes.facets import facet
from fsm.model.nodes.facets.facet import Damping, FacetArrays
from fsm.model.nodes.facets.facet_tangent import add_facet_tangent

POINTS, _TENSION, _VISCOSITY, EFFORTS, GIVEN, _SLOTS = range(4, 10)
"""Rows of a group's table. The arrays of `FacetArrays` come first; arrays of four dimensions are stored flat. Then: the
Kelvin-Voigt time, membrane efforts for the geometric stiffness with 1 if they are given, and slots."""


@kernel
def _facets_of(t: np.ndarray) -> FacetArrays:
    return FacetArrays(
        integers_2d(t, 0), integers_2d(t, 1), floats_2d(t, 2), floats_2d(t, 3),
        floats_1d(t, POINTS).reshape(-1, 3, 3, 15), floats_2d(t, _TENSION),
    )  # fmt: skip


@kernel
def _damping_of(table: np.ndarray, own: np.ndarray, moving: float) -> Damping:
    over, elastic = floats_1d(table, NUMBERS)[MEAN_OVER], 0.0 if moving == DAMPERS else 1.0
    tau = floats_1d(own, _VISCOSITY)[0] if moving > 0.0 else 0.0
    return Damping(tau, over, floats_1d(table, LAST) if over > 0.0 else floats_1d(table, U), elastic)


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    damping = _damping_of(table, own, moving)
    facet.add_facet_force(_facets_of(own), floats_1d(table, Q), damping, floats_1d(table, FORCE))
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _force(table, own, moving)
    facets, q, given, efforts = _facets_of(own), floats_1d(table, Q), floats_1d(own, GIVEN)[0], floats_3d(own, EFFORTS)
    stiffness, damping, slots = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING), integers_2d(own, _SLOTS)
    add_facet_tangent(
        facets, q, efforts if given > 0.0 else efforts[:0], _damping_of(table, own, moving), slots.reshape(-1, 9, 9),
        stiffness.shape[1], stiffness.reshape(-1), damping.reshape(-1),
    )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    stretch, bend = facet.facet_energy(_facets_of(own), floats_1d(table, Q))
    return stretch + bend


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    damping = _damping_of(table, own, moving)
    return facet.facet_power(_facets_of(own), floats_1d(table, Q), damping) if damping.tau > 0.0 else 0.0


@kernel
def _advance(table: np.ndarray, own: np.ndarray, number: float) -> float:
    """Write the membrane efforts of the coordinates with the increment that stands in place of rates, to first order."""
    facet.facet_efforts(_facets_of(own), floats_1d(table, Q), floats_1d(table, U), floats_3d(own, EFFORTS))
    return 0.0


FACETS = (_force, _tangent, _stored, _lost, no_power, no_power, _advance)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""
