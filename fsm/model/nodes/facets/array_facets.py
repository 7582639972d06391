"""Kernels of flexible facets in a compiled model (`ArrayModel`), called by their addresses; see `fsm.model.nodes.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import AT_REST, DAMPERS, DAMPING, FORCE, LAST, MEAN_OVER, NUMBERS, STIFFNESS, Q, U, no_power
from fsm.model.nodes.facets import facet
from fsm.model.nodes.facets.facet import FacetArrays
from fsm.model.nodes.facets.facet_damping import add_facet_damping, facet_dissipation
from fsm.solve.stepping.vectors import scaled

EDGES, ROWS, POINTS, _TENSION, _BEND, _VISCOSITY, EFFORTS, GIVEN, _SLOTS = 1, 6, *range(9, 16)
"""Rows of a group's table. The arrays of `FacetArrays` come first; arrays of four dimensions are stored flat. Then: rows of
damping, the Kelvin-Voigt time, membrane efforts for the geometric stiffness with 1 if they are given, and slots."""


@kernel
def _facets_of(t: np.ndarray) -> FacetArrays:
    return FacetArrays(
        integers_2d(t, 0), floats_1d(t, EDGES).reshape(-1, 3, 3, 9), floats_3d(t, 2), floats_3d(t, 3), floats_3d(t, 4),
        floats_3d(t, 5), floats_1d(t, ROWS).reshape(-1, 3, 5, 9), floats_3d(t, 7), floats_3d(t, 8),
        floats_1d(t, POINTS).reshape(-1, 3, 3, 15), floats_2d(t, _TENSION),
    )  # fmt: skip


@kernel
def _set_means(now: np.ndarray, before: np.ndarray, over: float, out: np.ndarray) -> None:
    for i in range(out.shape[0]):
        out[i] = (now[i] - before[i]) / over


@kernel
def _set_mean_rates(table: np.ndarray, own: np.ndarray, over: float, stretching: np.ndarray, turning: np.ndarray) -> None:
    """Mean rates of strains (m, 5, 3) and curvatures (m, 3, 3) over a quasi-static step."""
    facets, bend, q = _facets_of(own), floats_1d(own, _BEND).reshape(-1, 3, 5, 9), floats_1d(table, Q)
    before, last = np.empty(stretching.shape), floats_1d(table, LAST)
    facet.facet_strains(facets, q, stretching)
    facet.facet_strains(facets, last, before)
    _set_means(stretching.reshape(-1), before.reshape(-1), over, stretching.reshape(-1))
    now, then = facet.facet_curvatures(facets, bend, q), facet.facet_curvatures(facets, bend, last)
    _set_means(now.reshape(-1), then.reshape(-1), over, turning.reshape(-1))


@kernel
def _dissipated(
    table: np.ndarray, own: np.ndarray, stretching: np.ndarray, turning: np.ndarray, force: np.ndarray
) -> float:
    """Write the rates of strains (m, 5, 3) and curvatures (m, 3, 3), and add the forces of damping; returns the dissipated
    power.
    """
    bend, u, over = floats_1d(own, _BEND).reshape(-1, 3, 5, 9), floats_1d(table, U), floats_1d(table, NUMBERS)[MEAN_OVER]
    if over > 0.0:
        _set_mean_rates(table, own, over, stretching, turning)
        u = u[:0]
    tau = floats_1d(own, _VISCOSITY)[0]
    return facet_dissipation(_facets_of(own), bend, tau, floats_1d(table, Q), u, stretching, turning, force)


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    force = floats_1d(table, FORCE)
    if moving != DAMPERS:
        facet.add_facet_force(_facets_of(own), floats_1d(table, Q), force)
    if moving * floats_1d(own, _VISCOSITY)[0] > 0.0:
        count = integers_2d(own, 0).shape[0]
        _dissipated(table, own, np.empty((count, 5, 3)), np.empty((count, 3, 3)), force)
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    facets, q, given, efforts = _facets_of(own), floats_1d(table, Q), floats_1d(own, GIVEN)[0], floats_3d(own, EFFORTS)
    stiffness, slots = floats_3d(table, STIFFNESS), integers_2d(own, _SLOTS)
    count, tau = slots.shape[0] // 9, floats_1d(own, _VISCOSITY)[0]
    own_efforts, flat = efforts if given > 0.0 else efforts[:0], stiffness.reshape(-1)
    if moving != DAMPERS:
        _force(table, own, AT_REST)
        facet.add_facet_tangent(facets, q, own_efforts, slots.reshape(count, 9, 9), stiffness.shape[1], flat)
    if moving * tau > 0.0:
        bend, u, damping = floats_1d(own, _BEND).reshape(-1, 3, 5, 9), floats_1d(table, U), floats_3d(table, DAMPING)
        stretching, turning = np.empty((count, 5, 3)), np.empty((count, 3, 3))
        _dissipated(table, own, stretching, turning, floats_1d(table, FORCE))
        rates = u if floats_1d(table, NUMBERS)[MEAN_OVER] == 0.0 else scaled(0.0, u)
        add_facet_damping(
            facets, bend, tau, q, rates, stretching, turning, slots.reshape(count, 9, 9), stiffness.shape[1], flat,
            damping.reshape(-1),
        )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    stretch, bend = facet.facet_energy(_facets_of(own), floats_1d(table, Q))
    return stretch + bend


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    if moving * floats_1d(own, _VISCOSITY)[0] == 0.0:
        return 0.0
    count = integers_2d(own, 0).shape[0]
    force = np.zeros(floats_1d(table, Q).shape[0])
    return _dissipated(table, own, np.empty((count, 5, 3)), np.empty((count, 3, 3)), force)


@kernel
def _advance(table: np.ndarray, own: np.ndarray, number: float) -> float:
    """Write the membrane efforts of the coordinates with the increment that stands in place of rates, to first order."""
    facet.facet_efforts(_facets_of(own), floats_1d(table, Q), floats_1d(table, U), floats_3d(own, EFFORTS))
    return 0.0


FACETS = (_force, _tangent, _stored, _lost, no_power, no_power, _advance)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""
