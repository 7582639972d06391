"""Chambers of gas over the nodes of a mesh: volumes, forces along their gradients, tangents, power and energy.

The force of the gas i is (p_i - p_outside) dV_i/dx. The tangent is the sum of a sparse part, (p_i - p_outside) d2V_i/dx2,
and of a part of low rank, sum_j dp_i/dV_j dV_i/dx (dV_j/dx)^T, which `fsm.kernels.blocks.LowRank` holds. The volume of a
chamber with closed facets is their flux (`fsm.builders.patterns.chamber`), and its gradient is the force of a unit pressure
(`fsm.model.nodes.facets.pressure`). A sheet of one facet has the cubic shape of its elements. At a crease both facets have
separate slopes, so their cubic edges differ; the chamber then has straight edges between the nodes.

A lid over a ring of nodes v_i consists of the triangles of its edges and of its tip c = sum w_i v_i
(`fsm.case.models.chambers.Lid`). With e_i = v_i - c, an edge has the force s_i = e_i x e_(i+1)/6 of a unit pressure on
both of its nodes and on the tip, which shares it among the nodes in the parts w_i. The changes of s_i with e_i and e_(i+1)
join nodes beside each other; those with c join all nodes of the ring, so this part of the tangent is also of low rank.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from fsm.case.models.chambers import Chamber, Lid
from fsm.case.models.gas import Gas, Orifice
from fsm.kernels.addresses import ROW, address_table, floats_1d, floats_2d, floats_3d, integers_1d, integers_2d, put_array
from fsm.kernels.blocks import LowRank
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import address_of, call_at
from fsm.model.joined.gas import (
    ABOVE,
    GAS_ROWS,
    GAS_STATE,
    HELD,
    KIND,
    GasArrays,
    Gases,
    GasState,
    accept_gas,
    empty_state,
    gas_energies,
    gas_power,
    gas_state_of,
    gases_of,
    set_state,
)
from fsm.model.nodes.arrays import FORCE, LAST, MEAN_OVER, NOW, NUMBERS, STIFFNESS, Q
from fsm.model.nodes.facets.fold_angle import fold_angle, fold_gradient
from fsm.model.nodes.facets.folds import FoldGroup
from fsm.model.nodes.facets.pressure import PressedFaces, add_triangle_force, add_triangle_stiffness, mean_rates
from fsm.model.nodes.group import ElementGroup


class SurfaceArrays(NamedTuple):
    """Surfaces of k chambers.

    Attributes
    ----------
    vectors : (m + e, v) int array
        First coordinates of the nodal vectors of m triangles, then of the edges of lids: both nodes, the second one
        repeated.
    owner : (m,) int array
        Chamber of each triangle.
    pairs, coefficients : (2, p) int and (m, v, p) arrays
        See `fsm.model.nodes.facets.pressure`.
    sums : (k, 7) array
        Axes of the sum for the volume (1 or 0) and origin (m) of each chamber; 1, or -1 if its triangles point inwards.
    used, first_used : (u, 2) and (k + 1,) int arrays
        First coordinates of the vectors of each chamber, and 1 for a position.
    rings, nodes, weights : (l + 1,) int, (n,) int and (n,) arrays
        First coordinates of the ring of each lid, and their parts in its tip.
    lids : (l, 3) int array
        Chamber, 1 for a whole ring, and row of its first edge in `vectors`.
    planes : (l, 6) array
        1 for the axes along which the tip is fixed, else 0, and its position along them, m.
    """

    vectors: np.ndarray
    owner: np.ndarray
    pairs: np.ndarray
    coefficients: np.ndarray
    sums: np.ndarray
    used: np.ndarray
    first_used: np.ndarray
    rings: np.ndarray
    nodes: np.ndarray
    weights: np.ndarray
    lids: np.ndarray
    planes: np.ndarray


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
_SUMS = _GASES + GAS_ROWS
_FOUND = _SUMS + 3
_RENEW = _FOUND + GAS_STATE
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
        gases_of(t, _GASES), floats_2d(t, s), floats_2d(t, s + 1), floats_2d(t, s + 2), gas_state_of(t, _FOUND),
    )  # fmt: skip


# volumes ----------------------------------------------------------------------------------------------------------------


@kernel
def _arms(s: SurfaceArrays, lid: int, q: np.ndarray) -> np.ndarray:
    """Positions (n, 3) of the nodes of a ring from the tip of its lid, m."""
    first, last = s.rings[lid], s.rings[lid + 1]
    out = np.empty((last - first, 3))
    for a in range(3):
        tip = s.planes[lid, 3 + a]
        if s.planes[lid, a] == 0.0:
            tip = 0.0
            for i in range(first, last):
                tip += s.weights[i] * q[s.nodes[i] + a]
        for i in range(first, last):
            out[i - first, a] = q[s.nodes[i] + a] - tip
    return out


@kernel(inline=True)
def _edges(s: SurfaceArrays, lid: int) -> int:
    """Number of edges of a ring; each goes from a node to the next one."""
    return int(s.rings[lid + 1] - s.rings[lid] - 1 + s.lids[lid, 1])


@kernel
def _add_lid_force(s: SurfaceArrays, lid: int, q: np.ndarray, pressure: float, force: np.ndarray) -> None:
    """Add the forces of a pressure on a lid; the tip shares its force among the nodes."""
    arms, first, total = _arms(s, lid, q), s.rings[lid], np.zeros(3)
    count = arms.shape[0]
    for i in range(_edges(s, lid)):
        j = (i + 1) % count
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            side = pressure / 6.0 * (arms[i, b] * arms[j, c] - arms[i, c] * arms[j, b])
            total[a] += side
            force[s.nodes[first + i] + a] += side
            force[s.nodes[first + j] + a] += side
    for a in range(3):
        if s.planes[lid, a] == 0.0:
            for i in range(first, s.rings[lid + 1]):
                force[s.nodes[i] + a] += s.weights[i] * total[a]


@kernel
def _set_gradients(s: SurfaceArrays, q: np.ndarray, gradients: np.ndarray) -> None:
    """Write the gradients (k, m) of all volumes: the forces of unit pressures."""
    for k in range(gradients.shape[0]):
        for n in range(s.first_used[k], s.first_used[k + 1]):
            gradients[k, s.used[n, 0] : s.used[n, 0] + 3] = 0.0
    for m in range(s.owner.shape[0]):
        k = s.owner[m]
        add_triangle_force(s.vectors[m], s.pairs[0], s.pairs[1], s.coefficients[m], q, s.sums[k, 6], gradients[k])
    for lid in range(s.lids.shape[0]):
        k = s.lids[lid, 0]
        _add_lid_force(s, lid, q, s.sums[k, 6], gradients[k])


@kernel
def _set_volumes(s: SurfaceArrays, q: np.ndarray, gradients: np.ndarray, out: np.ndarray) -> None:
    """Write the enclosed volumes (k,), m^3: the flux of the positions is their product with the gradients."""
    for k in range(out.shape[0]):
        out[k] = 0.0
        for n in range(s.first_used[k], s.first_used[k + 1]):
            at, position = s.used[n, 0], s.used[n, 1]
            for a in range(3):
                out[k] += s.sums[k, a] * gradients[k, at + a] * (q[at + a] - position * s.sums[k, 3 + a])
        out[k] /= s.sums[k, :3].sum()


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
    _set_gradients(c.surfaces, q, c.gradients)
    _set_volumes(c.surfaces, q, c.gradients, c.found.volume)
    for k in range(c.found.area.shape[0]):
        c.found.area[k] = _area(c.areas, k, q, q[:0])
    set_state(c.gases, t, c.found)
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
        out[k] = c.found.pressure[k] - c.gases.laws[k, ABOVE]
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
        row = _add_lid_tangent(c, lid, q, -pressure / 6.0, slots, size, flat, row)
    return c.vectors


@kernel(inline=True)
def _put_cross(v: np.ndarray, factor: float, rows: np.ndarray, out: np.ndarray, row: int, column: int) -> int:
    """Add the rows (m,) of factor v x to `out`, from a row and a column on; returns the row after them."""
    for a in rows:
        b, c = (a + 1) % 3, (a + 2) % 3
        out[row, column + b] -= factor * v[c]
        out[row, column + c] += factor * v[b]
        row += 1
    return row


@kernel
def _add_lid_tangent(
    c: ChamberArrays, lid: int, q: np.ndarray, factor: float, slots: np.ndarray, size: int, flat: np.ndarray, row: int
) -> int:
    """Add the tangent of a lid, times a factor: its sparse part, and the part of the tip, which joins all nodes.

    With c' = W q', the tip changes the forces of the edge i by c' x (v_i - v_(i+1)). Its own force is W^T of the sum of
    all edges, whose change with the nodes is U q'. For a whole ring both derivatives have the same vectors. The result is
    the next row of the part of low rank.
    """
    s, arms, first = c.surfaces, _arms(c.surfaces, lid, q), c.surfaces.rings[lid]
    count, whole = arms.shape[0], s.lids[lid, 1] == 1
    axes = np.flatnonzero(s.planes[lid, :3] == 0.0)
    size_of = axes.shape[0]
    by_tip, by_nodes, total = row + size_of, row + size_of if whole else row + 2 * size_of, np.zeros(3)
    for i in range(_edges(s, lid)):
        j, own = (i + 1) % count, slots[s.lids[lid, 2] + i]
        for a in range(3):
            b, d = (a + 1) % 3, (a + 2) % 3
            for end in range(2):
                for column, sense, arm in ((0, -factor, arms[j]), (1, factor, arms[i])):
                    at = own[end, column] + a * size
                    flat[at + b] -= sense * arm[d]
                    flat[at + d] += sense * arm[b]
        along, nodes = arms[i] - arms[j], (s.nodes[first + i], s.nodes[first + j])
        total += along
        for node in nodes:
            _put_cross(along, 1.0, axes, c.vectors, by_tip, node)
        if not whole:
            _put_cross(arms[j], -1.0, axes, c.vectors, by_nodes, nodes[0])
            _put_cross(arms[i], 1.0, axes, c.vectors, by_nodes, nodes[1])
    for m in range(size_of):
        for i in range(count):
            c.vectors[row + m, s.nodes[first + i] + axes[m]] = s.weights[first + i]
        c.weights[by_tip + m, row + m] += factor
        c.weights[row + m, by_nodes + m] += factor
        for n in range(size_of):  # -factor times the matrix of total x
            if axes[n] == (axes[m] + 1) % 3:
                c.weights[row + m, row + n] += factor * total[(axes[m] + 2) % 3]
            elif axes[n] == (axes[m] + 2) % 3:
                c.weights[row + m, row + n] -= factor * total[(axes[m] + 1) % 3]
    return by_nodes + size_of


@kernel
def gas_stored(own: np.ndarray, nodes: np.ndarray, t: float) -> float:
    """Energy of all gases, J."""
    c = renewed(own, nodes, t)
    return float(gas_energies(c.gases, c.found).sum())


@kernel
def gas_put_in(own: np.ndarray, nodes: np.ndarray, t: float, span: float, u: np.ndarray) -> float:
    """Power of supplies and orifices at velocities (m,) of the nodes, W; `span` as in `gas_power`."""
    c = renewed(own, nodes, t)
    s, total, above = c.surfaces, gas_power(c.gases, t, c.found, span), _above(c)
    for k in range(above.shape[0]):
        if c.gases.laws[k, KIND] == HELD:
            for n in range(s.first_used[k], s.first_used[k + 1]):
                for at in range(s.used[n, 0], s.used[n, 0] + 3):
                    total += above[k] * c.gradients[k, at] * u[at]
    return total


@kernel
def accept_chambers(own: np.ndarray, nodes: np.ndarray, t: float) -> None:
    """Accept a state."""
    c = renewed(own, nodes, t)
    accept_gas(c.gases, t, c.found)


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
    return gas_energies(c.gases, c.found)


class Surface(NamedTuple):
    """Triangles around a chamber, and its lids over rings of nodes, which are given by their first coordinates."""

    chamber: Chamber
    faces: PressedFaces
    lids: Sequence[Lid]


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
        self._surfaces, self._areas = _surface_arrays(surfaces), _area_arrays(areas)
        self.vectors = self._surfaces.vectors
        of_lids = sum(len(lid.axes) * (2 if lid.whole else 3) for surface in surfaces for lid in surface.lids)
        rank = len(gases) + sum(area.folds is not None for area in areas) + of_lids
        self._gradients = np.zeros((len(gases), len(start)))
        self._low_rank = LowRank(np.zeros((rank, len(start))), np.zeros((rank, rank)))
        self._nodes = np.zeros((1, ROW), dtype=np.int64)
        self._found = empty_state(len(gases), len(areas))
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
        above, grown = two.pressure - self.gases.arrays.laws[:, ABOVE], two.volume - one.volume
        return {name: (float(a), float(b)) for name, a, b in zip(self.names, above, grown, strict=True)}

    def compressions(self, nodes: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
        """Stiffness -dp/dV (Pa/m^3) of the last accepted state and gradient (m,) of every chamber."""
        state = self.state(float(self.gases.memory()[0]), nodes)
        for gradient, stiffness in zip(self._gradients.copy(), -np.diag(state.by_volume), strict=True):
            yield float(np.nan_to_num(stiffness)), gradient

    # memory -----------------------------------------------------------------------------------------------------------

    @property
    def remembered(self) -> int:
        """See `ElementGroup`."""
        return self.gases.remembered

    def memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.gases.memory()

    def restore(self, memory: np.ndarray) -> None:
        """See `ElementGroup`."""
        self.gases.restore(memory)


def _surface_arrays(surfaces: Sequence[Surface]) -> SurfaceArrays:
    """Arrays of all surfaces; their triangles have shapes of one kind."""
    faces = [surface.faces for surface in surfaces]
    width = faces[0].vectors.shape[1]
    vectors, counts = [one.vectors for one in faces], [len(one.vectors) for one in faces]
    used, sums, lids, planes, row = [], [], [], list[list[float]](), sum(counts)
    rings: list[Lid] = []
    for k, (chamber, own, covers) in enumerate(surfaces):
        corners = own.vectors if width == 3 else own.vectors[:, ::3]
        at = np.unique(np.concatenate([own.vectors.ravel(), *(lid.nodes for lid in covers)]))
        used.append(np.column_stack([at, np.isin(at, corners)]))
        sums.append([*np.isin(range(3), chamber.axes), *chamber.origin, chamber.sign])
        for lid in covers:
            edges = lid.nodes[lid.edges]
            vectors.append(np.column_stack([edges[:, 0], *[edges[:, 1]] * (width - 1)]))
            lids.append([k, lid.whole, row])
            fixed = dict(lid.planes)
            planes.append([*(float(axis in fixed) for axis in range(3)), *(fixed.get(axis, 0.0) for axis in range(3))])
            rings.append(lid)
            row += len(edges)
    first, second = np.triu_indices(width, 1)
    return SurfaceArrays(
        np.ascontiguousarray(np.concatenate(vectors), dtype=np.int64), np.repeat(np.arange(len(faces)), counts),
        np.array([first, second], dtype=np.int64), np.concatenate([one.coefficients for one in faces]),
        np.array(sums, dtype=float), np.concatenate(used).astype(np.int64), _starts([len(one) for one in used]),
        _starts([len(lid.nodes) for lid in rings]),
        np.concatenate([np.zeros(0, dtype=np.int64), *(lid.nodes for lid in rings)]),
        np.concatenate([np.zeros(0), *(lid.weights for lid in rings)]), np.array(lids, dtype=np.int64).reshape(-1, 3),
        np.array(planes, dtype=float).reshape(-1, 6),
    )  # fmt: skip


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
        _starts([len(curve) for curve in curves]), np.concatenate([np.zeros((0, 2)), *curves]),
    )  # fmt: skip


def _starts(counts: Sequence[int]) -> np.ndarray:
    """First row of each of several parts, and number of all rows."""
    return np.cumsum([0, *counts], dtype=np.int64)
