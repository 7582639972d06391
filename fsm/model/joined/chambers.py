"""Chambers of gas in a system: volumes, forces along their gradients, tangents, power and energy.

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

import numpy as np

from fsm.case.models.chambers import Chamber, Lid
from fsm.case.models.gas import Gas, Orifice
from fsm.kernels.blocks import BlockPattern, LowRank
from fsm.model.joined.gas import Gases, GasState
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.facets.folds import FoldGroup
from fsm.model.nodes.facets.pressure import PressedFaces

_MOST_KNOWN = 4
"""Number of states of the nodes whose volumes are kept; the work of loads needs those at both ends of a step."""


def cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """Matrices (m, 3, 3) of v x."""
    out = np.zeros((len(vectors), 3, 3))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[:, a, b], out[:, b, a] = -vectors[:, c], vectors[:, c]
    return out


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products (m, 3); NumPy's function takes several times as long for few vectors."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


class _Lid:
    """Forces and tangents of a lid over a ring; its `nodes` are the first coordinates (k,) of the nodes."""

    def __init__(self, lid: Lid) -> None:
        self._lid = lid
        self._first, self._second = lid.edges.T
        self.pairs = np.ascontiguousarray(lid.nodes[lid.edges])
        self._entries = lid.nodes[:, None] + np.arange(3)

    def _arms(self, q: np.ndarray) -> np.ndarray:
        """Positions (k, 3) of the nodes from the tip, m."""
        at = q[self._entries]
        return np.asarray(at - self._lid.tip(at))

    def _on_nodes(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Sums (k, ...) at the nodes of values at both ends of each edge."""
        out = np.zeros((len(self._entries), *first.shape[1:]))
        np.add.at(out, self._first, first)
        np.add.at(out, self._second, second)
        return out

    def add_force(self, q: np.ndarray, pressure: float, force: np.ndarray) -> None:
        """Add the forces of a pressure; the tip shares its force among the nodes."""
        arms, axes = self._arms(q), list(self._lid.axes)
        sides = _cross(arms[self._first], arms[self._second])
        own = self._on_nodes(sides, sides)
        own[:, axes] += self._lid.weights[:, None] * sides.sum(axis=0)[axes]
        np.add.at(force, self._entries, pressure / 6.0 * own)

    def add_stiffness(self, q: np.ndarray, pressure: float, slots: np.ndarray, stiffness: np.ndarray) -> None:
        """Add -df/dq to block data, without the part of `low_rank`; `slots` of `pairs` as in `PressedFaces`."""
        own = -pressure / 6.0 * cross_matrices(self._arms(q))
        size, flat = stiffness.shape[1], stiffness.reshape(-1)
        places = slots[:, :, :, None, None] + size * np.arange(3)[:, None] + np.arange(3)
        for row in (0, 1):
            np.add.at(flat, places[:, row, 0], -own[self._second])
            np.add.at(flat, places[:, row, 1], own[self._first])

    def low_rank(self, q: np.ndarray, pressure: float) -> LowRank:
        """Part of -df/dq of the tip, which joins all nodes.

        With c' = W q', the tip changes the forces of the edge i by c' x (v_i - v_(i+1)). Its own force is W^T of the sum of
        all edges, whose change with the nodes is U q'.
        """
        arms, axes = self._arms(q), list(self._lid.axes)
        along = arms[self._first] - arms[self._second]
        own = cross_matrices(arms)
        by_tip, by_nodes, tip = (np.zeros((3, len(q))) for _ in range(3))
        by_tip[:, self._entries] = cross_matrices(self._on_nodes(along, along)).transpose(1, 0, 2)
        by_nodes[:, self._entries] = self._on_nodes(-own[self._second], own[self._first]).transpose(1, 0, 2)
        for axis in axes:
            tip[axis, self._entries[:, axis]] = self._lid.weights
        count, factor = len(axes), -pressure / 6.0
        # for a whole ring both derivatives have the same vectors
        blocks = [tip[axes], by_tip[axes]] if self._lid.whole else [tip[axes], by_tip[axes], by_nodes[axes]]
        weights = np.zeros((len(blocks), count, len(blocks), count))
        weights[1, :, 0] = weights[0, :, -1] = factor * np.eye(count)
        weights[0, :, 0] -= factor * cross_matrices(along.sum(axis=0)[None])[0][np.ix_(axes, axes)]
        return LowRank(np.concatenate(blocks), weights.reshape(len(blocks) * count, -1))


class Surface:
    """Facets and lids of one chamber.

    Parameters
    ----------
    chamber : Chamber
    faces : PressedFaces
        Triangles around the chamber.
    lids : lids over rings of nodes, given by their first coordinates
    """

    def __init__(self, chamber: Chamber, faces: PressedFaces, lids: Sequence[Lid]) -> None:
        self.faces = faces
        corners = faces.vectors if not len(faces.plane) else faces.vectors[:, ::3]
        self.lids = tuple(map(_Lid, lids))
        self._parts: tuple[PressedFaces | _Lid, ...] = (self.faces, *self.lids)
        self.sign = chamber.sign
        self._chamber = chamber
        self._positions = np.unique(corners)

    def gradient(self, q: np.ndarray) -> np.ndarray:
        """Gradient (n,) of the volume."""
        out = np.zeros_like(q)
        self.add_force(q, 1.0, out)
        return out

    def volume(self, q: np.ndarray, gradient: np.ndarray) -> float:
        """Enclosed volume, m^3: the flux of the positions is their product with the forces of a unit pressure, the
        gradient (n,) of the volume.
        """
        moved = q.copy()
        moved[self._positions[:, None] + np.arange(3)] -= self._chamber.origin
        axes = self._chamber.axes
        return sum(float(gradient[axis::3] @ moved[axis::3]) for axis in axes) / len(axes)

    def add_force(self, q: np.ndarray, pressure: float, force: np.ndarray) -> None:
        """Add the forces of a pressure."""
        for part in self._parts:
            part.add_force(q, self.sign * pressure, force)

    def add_stiffness(self, q: np.ndarray, pressure: float, slots: Sequence[np.ndarray], stiffness: np.ndarray) -> None:
        """Add the negative derivative of the forces of a given pressure, without the low rank of lids."""
        for part, own in zip(self._parts, slots, strict=True):
            part.add_stiffness(q, self.sign * pressure, own, stiffness)

    @property
    def vectors(self) -> list[np.ndarray]:
        """First coordinates (m, v) of the nodal vectors that each part joins."""
        return [self.faces.vectors, *(lid.pairs for lid in self.lids)]

    def slots(self, shift: int, pattern: BlockPattern) -> list[np.ndarray]:
        """Slots of the elements in a matrix whose coordinates of nodes begin at `shift`."""
        return [slots_of(np.ascontiguousarray(one + shift), 3, pattern.indptr, pattern.indices) for one in self.vectors]


class OrificeArea:
    """Area of an orifice: constant, or a function of the mean fold angle of a crease.

    Parameters
    ----------
    orifice : Orifice
    folds : FoldGroup or None
    lengths : (m,) array
        Length of each fold of the crease, 0 for other folds.
    """

    def __init__(self, orifice: Orifice, folds: FoldGroup | None = None, lengths: np.ndarray | None = None) -> None:
        self._orifice, self.folds = orifice, folds
        self._weights = np.zeros(0) if lengths is None else lengths / lengths.sum()
        self._angles, self._areas = (np.array([pair[k] for pair in orifice.area_by_angle]) for k in (0, 1))

    def size(self, nodes: np.ndarray) -> float:
        """Area at coordinates (n,) of the nodes, m^2."""
        if self.folds is None:
            assert self._orifice.area is not None
            return self._orifice.area
        return float(np.interp(abs(self._weights @ self.folds.angles(nodes)), self._angles, self._areas))

    def gradient(self, nodes: np.ndarray) -> np.ndarray:
        """Gradient (n,) of the area, m."""
        out = np.zeros_like(nodes)
        if self.folds is None:
            return out
        angle = float(self._weights @ self.folds.angles(nodes))
        piece = int(np.searchsorted(self._angles, abs(angle), side="right")) - 1
        if 0 <= piece < len(self._angles) - 1:
            slope = (self._areas[piece + 1] - self._areas[piece]) / (self._angles[piece + 1] - self._angles[piece])
            self.folds.add_turns(nodes, float(np.copysign(slope, slope * angle)) * self._weights, out)
        return out


class _Volumes:
    """Volumes (k,), m^3, and their gradients (k, n) at coordinates (n,) of the nodes; `states` are those of the gases that
    are known there, by time and memory.
    """

    def __init__(self, surfaces: Sequence[Surface], nodes: np.ndarray) -> None:
        self.nodes = nodes.copy()
        self.gradients = np.array([surface.gradient(nodes) for surface in surfaces]).reshape(len(surfaces), len(nodes))
        found = zip(surfaces, self.gradients, strict=True)
        self.volumes = np.array([surface.volume(nodes, gradient) for surface, gradient in found])
        self.states: list[tuple[float, np.ndarray, GasState]] = []


class Chambers:
    """Chambers of a sheet with their gases.

    Parameters
    ----------
    gases : tuple of Gas
    surfaces : tuple of Surface, one for each gas
    orifices, areas : tuples of Orifice and OrificeArea
    start : (n,) array
        Coordinates of the nodes at the start.
    """

    def __init__(
        self, gases: tuple[Gas, ...], surfaces: tuple[Surface, ...], orifices: tuple[Orifice, ...],
        areas: tuple[OrificeArea, ...], start: np.ndarray,
    ) -> None:  # fmt: skip
        self.names = tuple(gas.name for gas in gases)
        self._surfaces = surfaces
        self._known: list[_Volumes] = []
        self._areas = areas
        self.gases = Gases(gases, orifices, self.volumes(start), self.areas(start))

    def volumes(self, nodes: np.ndarray) -> np.ndarray:
        """Volumes (k,), m^3."""
        return self._at(nodes).volumes

    def _at(self, nodes: np.ndarray) -> _Volumes:
        """Volumes at coordinates of the nodes, of which the last ones are kept."""
        for known in self._known:
            if np.array_equal(nodes, known.nodes):
                return known
        self._known = [_Volumes(self._surfaces, nodes), *self._known[: _MOST_KNOWN - 1]]
        return self._known[0]

    def areas(self, nodes: np.ndarray) -> np.ndarray:
        """Areas of the orifices (n,), m^2."""
        return np.array([area.size(nodes) for area in self._areas])

    def state(self, t: float, nodes: np.ndarray) -> GasState:
        """State of all gases at coordinates (n,) of the nodes."""
        at, memory = self._at(nodes), self.gases.last
        for time, last, known in at.states:
            if time == t and last is memory:
                return known
        found = self.gases.state(t, at.volumes, self.areas(nodes))
        at.states = [(t, memory, found), *at.states[:1]]
        return found

    def commit(self, t: float, nodes: np.ndarray) -> None:
        """Accept a state."""
        self.gases.commit(t, self.volumes(nodes), self.areas(nodes))

    @property
    def vectors(self) -> list[np.ndarray]:
        """First coordinates (m, v) of the nodal vectors that each part of a chamber joins."""
        return [one for surface in self._surfaces for one in surface.vectors]

    def slots(self, shift: int, pattern: BlockPattern) -> list[list[np.ndarray]]:
        """Slots of all chambers; see `Surface.slots`."""
        return [surface.slots(shift, pattern) for surface in self._surfaces]

    def pairs(self) -> np.ndarray:
        """Pairs (m, 2) of nodes that the sparse part of the tangent joins, if all coordinates are positions of nodes."""
        found = [np.zeros((0, 2), dtype=np.int64)]
        for vectors in (one // 3 for one in self.vectors):
            first, second = np.triu_indices(vectors.shape[1], 1)
            found += [vectors[:, [a, b]] for a, b in zip(first, second, strict=True)]
        return np.unique(np.concatenate(found), axis=0)

    def pressures_and_changes(
        self, start: tuple[float, np.ndarray], end: tuple[float, np.ndarray]
    ) -> dict[str, tuple[float, float]]:
        """Pressure above that outside at the end (Pa) and change of the volume (m^3) of each gas, by name.

        `start` and `end` are times (s) and coordinates of the nodes.
        """
        one, two = (self.state(*state) for state in (start, end))
        above, grown = two.pressure - self.gases.outside, two.volume - one.volume
        return {name: (float(a), float(b)) for name, a, b in zip(self.names, above, grown, strict=True)}

    def add_force(self, t: float, nodes: np.ndarray, force: np.ndarray) -> None:
        """Add the forces on the coordinates (n,) of the nodes."""
        force += (self.state(t, nodes).pressure - self.gases.outside) @ self._at(nodes).gradients

    def add_force_rate(self, t: float, nodes: np.ndarray, force: np.ndarray) -> None:
        """Add the change of the forces with time at fixed nodes."""
        force += self.state(t, nodes).by_time @ self._at(nodes).gradients

    def add_linearised(
        self, t: float, nodes: np.ndarray, slots: list[list[np.ndarray]], force: np.ndarray, stiffness: np.ndarray
    ) -> LowRank | None:
        """Add the forces, and the sparse part of their negative derivatives to block data; returns the other part.

        None if the pressures do not depend on the volumes and there are no lids.
        """
        state = self.state(t, nodes)
        above = (state.pressure - self.gases.outside).tolist()
        gradients = self._at(nodes).gradients
        for surface, pressure, gradient, own in zip(self._surfaces, above, gradients, slots, strict=True):
            force += pressure * gradient
            surface.add_stiffness(nodes, pressure, own, stiffness)
        found = LowRank(gradients, -state.by_volume) if np.any(state.by_volume) else None
        for k, area in enumerate(self._areas):
            if area.folds is not None:
                weights = np.zeros((len(gradients) + 1, len(gradients) + 1))
                weights[:-1, -1] = -state.by_area[:, k]
                found = LowRank(np.array([*gradients, area.gradient(nodes)]), weights).plus(found)
        for surface, pressure in zip(self._surfaces, above, strict=True):
            for lid in surface.lids:
                found = lid.low_rank(nodes, surface.sign * pressure).plus(found)
        return found

    def compressions(self, nodes: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
        """Stiffness -dp/dV (Pa/m^3) of the last accepted state and gradient (n,) of every chamber."""
        state = self.state(float(self.gases.memory()[0]), nodes)
        for gradient, stiffness in zip(self._at(nodes).gradients, -np.diag(state.by_volume), strict=True):
            yield float(np.nan_to_num(stiffness)), gradient

    def energy(self, t: float, nodes: np.ndarray) -> float:
        """Energy of all gases, J."""
        return float(self.gases.energies(self.state(t, nodes)).sum())

    def power(self, t: float, nodes: np.ndarray, rates: np.ndarray, before: float | None) -> float:
        """Power of supplies and orifices at velocities (n,) of the nodes, W; `before` as in `Gases.power`."""
        state = self.state(t, nodes)
        total = self.gases.power(t, state, before)
        above = np.where(self.gases.holds_pressure, state.pressure - self.gases.outside, 0.0)
        return total + float(above @ (self._at(nodes).gradients @ rates))
