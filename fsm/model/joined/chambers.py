"""Chambers of gas over the nodes of a mesh: volumes, forces along their gradients, tangents, power and energy.

The force of the gas i is (p_i - p_outside) dV_i/dx. The tangent is the sum of a sparse part, (p_i - p_outside) d2V_i/dx2,
and of a part of low rank, sum_j dp_i/dV_j dV_i/dx (dV_j/dx)^T, which `fsm.kernels.blocks.LowRank` holds. The volume of a
chamber with closed facets is their flux (`fsm.builders.patterns.chamber`), and its gradient is the force of a unit pressure
(`fsm.model.nodes.facets.pressure`). A sheet of one facet has the cubic shape of its elements. At a crease both facets have
separate slopes, so their cubic edges differ; the chamber then has straight edges between the nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from fsm.case.models.gas import Gas, Orifice
from fsm.kernels.addresses import ROW, address_table, floats_1d, floats_2d, floats_3d, integers_1d, integers_2d, put_array
from fsm.kernels.blocks import LowRank
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import address_of, call_at
from fsm.model.joined import chamber_surfaces
from fsm.model.joined import gas as of_gas
from fsm.model.joined.chamber_surfaces import Surface, SurfaceArrays
from fsm.model.joined.gas import GasArrays, Gases, GasState
from fsm.model.nodes.arrays import FORCE, LAST, MEAN_OVER, NOW, NUMBERS, STIFFNESS, Q
from fsm.model.nodes.facets.fold_angle import fold_angle, fold_gradient
from fsm.model.nodes.facets.folds import FoldGroup
from fsm.model.nodes.facets.pressure import add_triangle_stiffness, mean_rates
from fsm.model.nodes.group import ElementGroup


class AreaArrays(NamedTuple):
    """Areas of n orifices: constant, or functions of the mean of fold angles.

    Attributes
    ----------
    constant : (n,) array, m^2
    vectors, factors, near : see `fsm.model.nodes.facets.folds.FoldGroup`
    shares : (n, f) array
        Part of each fold in the mean angle.
    first, curves : (n + 1,) int and (c, 2) arrays
        Magnitudes of the angle (rad) with areas (m^2); none for a constant area.
    """

    constant: np.ndarray
    vectors: np.ndarray
    factors: np.ndarray
    near: np.ndarray
    shares: np.ndarray
    first: np.ndarray
    curves: np.ndarray


class ChamberArrays(NamedTuple):
    """Arrays of chambers.

    Attributes
    ----------
    surfaces, areas, gases : arrays of each
    gradients : (k, m) array
        Gradients of the volumes by the coordinates of the nodes, at the last evaluated state.
    vectors, weights : (r, m) and (r, r) arrays
        V and W of the stiffness V^T W V of low rank at the last tangent.
    found : state of the gases at the last evaluated state
    """

    surfaces: SurfaceArrays
    areas: AreaArrays
    gases: GasArrays
    gradients: np.ndarray
    vectors: np.ndarray
    weights: np.ndarray
    found: GasState


_AREAS = len(SurfaceArrays._fields)
_GASES = _AREAS + len(AreaArrays._fields)
_SUMS = _GASES + of_gas.GAS_ROWS
_FOUND = _SUMS + 3
_RENEW = _FOUND + of_gas.GAS_STATE
"""Row of the address of `_renew`, which is long, so that each kernel does not contain it."""
CHAMBER_ROWS = _RENEW + 1
"""Number of rows of the table of chambers."""


@kernel
def chambers_of(t: np.ndarray) -> ChamberArrays:
    """Chambers in a table of `fsm.kernels.addresses`."""
    a, s = _AREAS, _SUMS
    return ChamberArrays(
        SurfaceArrays(
            integers_2d(t, 0), integers_1d(t, 1), integers_2d(t, 2), floats_3d(t, 3), floats_2d(t, 4),
            integers_2d(t, 5), integers_1d(t, 6), integers_1d(t, 7), integers_1d(t, 8), floats_1d(t, 9),
            integers_2d(t, 10), floats_2d(t, 11),
        ),
        AreaArrays(
            floats_1d(t, a), integers_2d(t, a + 1), floats_3d(t, a + 2), floats_1d(t, a + 3), floats_2d(t, a + 4),
            integers_1d(t, a + 5), floats_2d(t, a + 6),
        ),
        of_gas.gases_of(t, _GASES), floats_2d(t, s), floats_2d(t, s + 1), floats_2d(t, s + 2),
        of_gas.gas_state_of(t, _FOUND),
    )  # fmt: skip


# areas ------------------------------------------------------------------------------------------------------------------


@kernel
def _area(a: AreaArrays, k: int, q: np.ndarray, gradient: np.ndarray) -> float:
    """Area of an orifice, m^2; adds its gradient (m,), m, if this is not empty."""
    first, last = a.first[k], a.first[k + 1]
    if first == last:
        return float(a.constant[k])
    v, along, states, angle = np.empty((3, 3)), np.empty(9), np.empty((a.shares.shape[1], 9)), 0.0
    for f in range(a.shares.shape[1]):
        if a.shares[k, f] == 0.0:
            continue
        for p in range(3):
            for b in range(3):
                v[p, b] = 0.0
                for i in range(4):
                    v[p, b] += a.factors[f, p, i] * q[a.vectors[f, i] + b]
        angle += a.shares[k, f] * fold_angle(v, a.near[f])
        fold_gradient(v, states[f], along)
    size, piece = abs(angle), first - 1
    while piece + 1 < last and a.curves[piece + 1, 0] <= size:
        piece += 1
    if piece < first or piece == last - 1:
        return float(a.curves[min(max(piece, first), last - 1), 1])
    slope = (a.curves[piece + 1, 1] - a.curves[piece, 1]) / (a.curves[piece + 1, 0] - a.curves[piece, 0])
    if gradient.shape[0] > 0:
        along_angle = slope if angle >= 0.0 else -slope
        for f in range(a.shares.shape[1]):
            if a.shares[k, f] != 0.0:
                for i in range(4):
                    for b in range(3):
                        for p in range(3):
                            by = along_angle * a.shares[k, f] * a.factors[f, p, i]
                            gradient[a.vectors[f, i] + b] += by * states[f, 3 * p + b]
    return float(a.curves[piece, 1] + slope * (size - a.curves[piece, 0]))


# state and forces -------------------------------------------------------------------------------------------------------


@kernel
def _renew(own: np.ndarray, nodes: np.ndarray, t: float) -> float:
    """Write the gradients of the volumes and the state of all gases; the first row of `nodes` are the coordinates (m,)."""
    c, q = chambers_of(own), floats_1d(nodes, 0)
    chamber_surfaces.set_gradients(c.surfaces, q, c.gradients)
    chamber_surfaces.set_volumes(c.surfaces, q, c.gradients, c.found.volume)
    for k in range(c.found.area.shape[0]):
        c.found.area[k] = _area(c.areas, k, q, q[:0])
    of_gas.set_state(c.gases, t, c.found)
    return 0.0


@kernel
def renewed(own: np.ndarray, nodes: np.ndarray, t: float) -> ChamberArrays:
    """Chambers with their state; arguments as for `_renew`, here and below."""
    call_at(integers_1d(own, _RENEW)[0], own, nodes, t)
    return chambers_of(own)


@kernel
def _pull(c: ChamberArrays, pressure: np.ndarray, force: np.ndarray) -> None:
    """Add pressures (k,) times the gradients of the volumes."""
    s = c.surfaces
    for k in range(pressure.shape[0]):
        for n in range(s.first_used[k], s.first_used[k + 1]):
            for at in range(s.used[n, 0], s.used[n, 0] + 3):
                force[at] += pressure[k] * c.gradients[k, at]


@kernel
def _above(c: ChamberArrays) -> np.ndarray:
    """Pressures (k,) above those outside, Pa."""
    out = np.empty(c.found.pressure.shape[0])
    for k in range(out.shape[0]):
        out[k] = c.found.pressure[k] - c.gases.laws[k, of_gas.ABOVE]
    return out


@kernel
def add_gas_force(own: np.ndarray, nodes: np.ndarray, t: float, force: np.ndarray) -> None:
    """Add the forces on the coordinates (m,) of the nodes."""
    c = renewed(own, nodes, t)
    _pull(c, _above(c), force)


@kernel
def add_gas_force_rate(own: np.ndarray, nodes: np.ndarray, t: float, force: np.ndarray) -> None:
    """Add the change of the forces with time at fixed nodes."""
    c = renewed(own, nodes, t)
    _pull(c, c.found.by_time, force)


@kernel
def add_gas_tangent(
    own: np.ndarray, nodes: np.ndarray, t: float, slots: np.ndarray, size: int, force: np.ndarray, flat: np.ndarray
) -> np.ndarray:
    """Add the forces, and the sparse part of their negative derivatives to flat block data; writes the other part, and
    returns its vectors.

    `slots` (m + e, v, v) as in `ElementGroup.add_linearised`.
    """
    c, q = renewed(own, nodes, t), floats_1d(nodes, 0)
    s, found = c.surfaces, c.found
    above, axial = _above(c), np.empty((s.vectors.shape[1], s.vectors.shape[1], 3))
    _pull(c, above, force)
    for m in range(s.owner.shape[0]):
        pressure = s.sums[s.owner[m], 6] * above[s.owner[m]]
        add_triangle_stiffness(
            s.vectors[m], s.pairs[0], s.pairs[1], s.coefficients[m], q, pressure, slots[m], size, flat, axial
        )
    count = c.gradients.shape[0]
    c.vectors[:count], c.vectors[count:] = c.gradients, 0.0
    c.weights[:] = 0.0
    c.weights[:count, :count] = -found.by_volume
    row = count
    for k in range(c.areas.constant.shape[0]):
        if c.areas.first[k] < c.areas.first[k + 1]:
            _area(c.areas, k, q, c.vectors[row])
            c.weights[:count, row] = -found.by_area[:, k]
            row += 1
    for lid in range(s.lids.shape[0]):
        pressure = s.sums[s.lids[lid, 0], 6] * above[s.lids[lid, 0]]
        row = chamber_surfaces.add_lid_tangent(s, lid, q, -pressure / 6.0, slots, size, flat, c.vectors, c.weights, row)
    return c.vectors


@kernel
def gas_stored(own: np.ndarray, nodes: np.ndarray, t: float) -> float:
    """Energy of all gases, J."""
    c = renewed(own, nodes, t)
    return float(of_gas.gas_energies(c.gases, c.found).sum())


@kernel
def gas_put_in(own: np.ndarray, nodes: np.ndarray, t: float, span: float, u: np.ndarray) -> float:
    """Power of supplies and orifices at velocities (m,) of the nodes, W; `span` as in `gas_power`."""
    c = renewed(own, nodes, t)
    s, total, above = c.surfaces, of_gas.gas_power(c.gases, t, c.found, span), _above(c)
    for k in range(above.shape[0]):
        if c.gases.laws[k, of_gas.KIND] == of_gas.HELD:
            for n in range(s.first_used[k], s.first_used[k + 1]):
                for at in range(s.used[n, 0], s.used[n, 0] + 3):
                    total += above[k] * c.gradients[k, at] * u[at]
    return total


@kernel
def accept_chambers(own: np.ndarray, nodes: np.ndarray, t: float) -> None:
    """Accept a state."""
    c = renewed(own, nodes, t)
    of_gas.accept_gas(c.gases, t, c.found)


# group of nodes ---------------------------------------------------------------------------------------------------------


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    add_gas_force(own, table[Q:], floats_1d(table, NUMBERS)[NOW], floats_1d(table, FORCE))
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    stiffness, (count, width) = floats_3d(table, STIFFNESS), integers_2d(own, 0).shape
    slots = integers_2d(own, CHAMBER_ROWS).reshape(count, width, width)
    add_gas_tangent(
        own, table[Q:], floats_1d(table, NUMBERS)[NOW], slots, stiffness.shape[1], floats_1d(table, FORCE),
        stiffness.reshape(-1),
    )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return gas_stored(own, table[Q:], floats_1d(table, NUMBERS)[NOW])


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return 0.0


@kernel
def _put_in(table: np.ndarray, own: np.ndarray, step: float) -> float:
    numbers, u = floats_1d(table, NUMBERS), mean_rates(table)
    if step < 0.0:
        return gas_put_in(own, table[LAST:], numbers[NOW], -numbers[MEAN_OVER], u)
    return gas_put_in(own, table[Q:], numbers[NOW], step if step > 0.0 else numbers[MEAN_OVER], u)


@kernel
def _accept(table: np.ndarray, own: np.ndarray, t: float) -> float:
    accept_chambers(own, table[Q:], t)
    return 0.0


@kernel
def _renew_at(own: np.ndarray, nodes: np.ndarray, t: float, q: np.ndarray) -> None:
    """Renew the state at coordinates (m,), for calls from Python."""
    put_array(nodes, 0, q)
    renewed(own, nodes, t)


@kernel
def _energies_at(own: np.ndarray, nodes: np.ndarray, t: float, q: np.ndarray) -> np.ndarray:
    put_array(nodes, 0, q)
    c = renewed(own, nodes, t)
    return of_gas.gas_energies(c.gases, c.found)


class OrificeArea(NamedTuple):
    """Orifice, and the folds of its crease with the length of each; 0 for other folds."""

    orifice: Orifice
    folds: FoldGroup | None = None
    lengths: np.ndarray | None = None


class Chambers(ElementGroup):
    """Chambers of a sheet with their gases.

    Parameters
    ----------
    gases : tuple of Gas
    surfaces : tuple of Surface, one for each gas
    areas : tuple of OrificeArea
        All creases belong to one group of folds.
    start : (m,) array
        Coordinates of the nodes at the start.
    """

    name = "gas"
    kernels = (_force, _tangent, _stored, _lost, _put_in)
    accept = staticmethod(_accept)

    def __init__(
        self, gases: tuple[Gas, ...], surfaces: tuple[Surface, ...], areas: tuple[OrificeArea, ...], start: np.ndarray
    ) -> None:
        self.names = tuple(gas.name for gas in gases)
        self._surfaces, self._areas = chamber_surfaces.surface_arrays(surfaces), _area_arrays(areas)
        self.vectors = self._surfaces.vectors
        of_lids = sum(len(lid.axes) * (2 if lid.whole else 3) for surface in surfaces for lid in surface.lids)
        rank = len(gases) + sum(area.folds is not None for area in areas) + of_lids
        self._gradients = np.zeros((len(gases), len(start)))
        self._low_rank = LowRank(np.zeros((rank, len(start))), np.zeros((rank, rank)))
        self._nodes = np.zeros((1, ROW), dtype=np.int64)
        self._found = of_gas.empty_state(len(gases), len(areas))
        self._address = np.array([address_of(_renew, self._nodes, self._nodes, 0.0)])
        orifices = tuple(area.orifice for area in areas)
        self.gases = Gases(gases, orifices, np.zeros(len(gases)), np.zeros(len(areas)))
        self._own = address_table(self.table)
        found = self.state(0.0, start)
        self.gases = Gases(gases, orifices, found.volume, found.area)
        self._own[:] = address_table(self.table)

    @property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        sums = self._gradients, self._low_rank.vectors, self._low_rank.weights
        return [*self._surfaces, *self._areas, *self.gases.table, *sums, *self._found, self._address]

    def state(self, t: float, nodes: np.ndarray) -> GasState:
        """State of all gases at coordinates (m,) of the nodes."""
        _renew_at(self._own, self._nodes, float(t), nodes)
        return GasState(*(array.copy() for array in self._found))

    @property
    def low_rank(self) -> LowRank:
        """See `ElementGroup`."""
        return self._low_rank

    def energies(self, t: float, nodes: np.ndarray) -> np.ndarray:
        """Energies of all gases (k,), J; see `gas_energies`."""
        return np.asarray(_energies_at(self._own, self._nodes, float(t), nodes))

    def add_force_rate(self, t: float, q: np.ndarray, force: np.ndarray) -> None:
        """See `ElementGroup`."""
        force += self.state(t, q).by_time @ self._gradients

    def break_times(self) -> list[float]:
        """See `ElementGroup`."""
        return self.gases.break_times()

    def pairs(self) -> np.ndarray:
        """Pairs (p, 2) of nodes that the sparse part of the tangent joins, if all coordinates are positions of nodes."""
        nodes = self.vectors // 3
        first, second = np.triu_indices(nodes.shape[1], 1)
        return np.unique(np.concatenate([nodes[:, [a, b]] for a, b in zip(first, second, strict=True)]), axis=0)

    def pressures_and_changes(
        self, start: tuple[float, np.ndarray], end: tuple[float, np.ndarray]
    ) -> dict[str, tuple[float, float]]:
        """Pressure above that outside at the end (Pa) and change of the volume (m^3) of each gas, by name.

        `start` and `end` are times (s) and coordinates of the nodes.
        """
        one, two = (self.state(*state) for state in (start, end))
        above, grown = two.pressure - self.gases.arrays.laws[:, of_gas.ABOVE], two.volume - one.volume
        return {name: (float(a), float(b)) for name, a, b in zip(self.names, above, grown, strict=True)}

    def compressions(self, nodes: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
        """Stiffness -dp/dV (Pa/m^3) of the last accepted state and gradient (m,) of every chamber."""
        state = self.state(float(self.gases.arrays.last[0]), nodes)
        for gradient, stiffness in zip(self._gradients.copy(), -np.diag(state.by_volume), strict=True):
            yield float(np.nan_to_num(stiffness)), gradient

    @property
    def kept(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """See `ElementGroup`."""
        return [(self.gases.arrays.last, self.gases.start)]


def _area_arrays(areas: Sequence[OrificeArea]) -> AreaArrays:
    """Arrays of the areas of all orifices."""
    folds = next((area.folds for area in areas if area.folds is not None), None)
    vectors, factors, near = np.zeros((0, 4), dtype=np.int64), np.zeros((0, 3, 4)), np.zeros(0)
    if folds is not None:
        vectors, factors, near = folds.arrays[:3]
    shares = np.zeros((len(areas), len(vectors)))
    for row, area in zip(shares, areas, strict=True):
        if area.lengths is not None:
            row[:] = area.lengths / area.lengths.sum()
    curves = [np.reshape(area.orifice.area_by_angle, (-1, 2)) for area in areas]
    return AreaArrays(
        np.array([area.orifice.area or 0.0 for area in areas]), vectors, factors, near, shares,
        chamber_surfaces.starts([len(curve) for curve in curves]), np.concatenate([np.zeros((0, 2)), *curves]),
    )  # fmt: skip
