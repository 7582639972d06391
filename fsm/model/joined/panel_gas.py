"""Gas in chambers of rigid panels: the corners of panels are points of rigid bodies.

A corner x = r + R X moves by dx = dr - R [X] dtheta. Forces f of the gas on corners (`fsm.model.joined.chambers`) are a
force f and a moment X x R^T f on the body, in its axes. The tangent of the body has the tangent of the corners and
-[X] [R^T f], the change of the moment with the rotation.
"""

from __future__ import annotations

import numpy as np

from fsm.case.models.loads import Load
from fsm.kernels.blocks import BlockMatrix, LowRank
from fsm.kernels.rotation import rotate_by
from fsm.model.bodies.configuration import Bodies
from fsm.model.bodies.drive import PrescribedMotion
from fsm.model.bodies.group import Group, PreviousPoses
from fsm.model.bodies.pattern import BodyPattern, body_pattern
from fsm.model.contact.contacts import ContactGroup
from fsm.model.joined.chambers import Chambers, cross_matrices
from fsm.model.system.system import SegmentSystem
from fsm.solve.interface.records import Linearised, PreviousState
from fsm.text.load_names import PRESSURE


class PanelGas(Group):
    """Forces of the gas of all chambers on panels.

    Parameters
    ----------
    chambers : Chambers
        Their nodes are the corners.
    bodies : (n,) int array
        Body of each corner.
    points : (n, 3) array, m
        Corners in the axes of the bodies.
    """

    def __init__(self, chambers: Chambers, bodies: np.ndarray, points: np.ndarray) -> None:
        self.chambers, self.bodies, self.points = chambers, bodies, points
        self.low_rank: LowRank | None = None
        self._corners = body_pattern(np.arange(len(bodies)), [chambers.pairs()], 3)
        self._slots = chambers.slots(0, self._corners)
        self._crossed = cross_matrices(points)
        pairs = np.sort(bodies[np.stack([self._corners.rows, self._corners.indices], axis=1)], axis=1)
        self._pairs = np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0)
        self._places: tuple[BodyPattern | None, np.ndarray] = None, np.zeros(0, dtype=np.int64)

    def nodes(self, poses: np.ndarray) -> np.ndarray:
        """Positions of all corners, flat (3 n,), m."""
        at = poses[self.bodies]
        return np.asarray(at[:, :3] + rotate_by(at[:, 3:], self.points)).ravel()

    def node_rates(self, poses: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Velocities of all corners, flat (3 n,), m/s."""
        of_turn = rotate_by(poses[self.bodies, 3:], np.cross(rates[self.bodies, 3:], self.points))
        return np.asarray(rates[self.bodies, :3] + of_turn).ravel()

    def on_bodies(self, poses: np.ndarray, forces: np.ndarray, out: np.ndarray) -> None:
        """Add forces (3 n,) on corners to the wrenches `out` (n_bodies, 6)."""
        inertial = forces.reshape(-1, 3)
        local = np.einsum("nba,nb->na", self._axes(poses), inertial)
        np.add.at(out[:, :3], self.bodies, inertial)
        np.add.at(out[:, 3:], self.bodies, np.cross(self.points, local))

    def _axes(self, poses: np.ndarray) -> np.ndarray:
        """Rotation matrices (n, 3, 3) of the bodies of all corners."""
        axes = np.broadcast_to(np.eye(3), (len(poses), 3, 3)).reshape(-1, 3)
        turned = rotate_by(np.repeat(poses[:, 3:], 3, axis=0), np.ascontiguousarray(axes))
        return np.asarray(turned.reshape(-1, 3, 3).transpose(0, 2, 1)[self.bodies])

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        forces = np.zeros(3 * len(self.bodies))
        self.chambers.add_force(t, self.nodes(poses), forces)
        self.on_bodies(poses, forces, force)

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: PreviousPoses | None = None,
    ) -> None:
        """See `Group`; `low_rank` then has the stiffness that joins all bodies, with vectors (k, n_bodies, 6), flat."""
        forces, data = np.zeros(3 * len(self.bodies)), self._corners.zeros()
        found = self.chambers.add_linearised(t, self.nodes(poses), self._slots, forces, data)
        self.on_bodies(poses, forces, force)
        vectors = np.zeros((0 if found is None else len(found.vectors), *force.shape))
        for k, out in enumerate(vectors):
            assert found is not None
            self.on_bodies(poses, found.vectors[k], out)
        self.low_rank = None if found is None else LowRank(vectors.reshape(len(vectors), -1), found.weights)
        axes = self._axes(poses)
        maps = np.concatenate([np.broadcast_to(np.eye(3), axes.shape), -axes @ self._crossed], axis=2)
        rows, columns = self._corners.rows, self._corners.indices
        blocks = maps[rows].transpose(0, 2, 1) @ data @ maps[columns]
        local = np.einsum("nba,nb->na", axes, forces.reshape(-1, 3))
        blocks[self._corners.diagonal, 3:, 3:] -= self._crossed @ cross_matrices(local)
        places = self._places_in(pattern)
        known = places >= 0
        np.add.at(stiffness, places[known], blocks[known])

    def _places_in(self, pattern: BodyPattern) -> np.ndarray:
        """Block of the pattern of bodies for each block of the corners; -1 for bodies without degrees of freedom."""
        if self._places[0] is not pattern:
            row, column = (pattern.dof[self.bodies[of]] for of in (self._corners.rows, self._corners.indices))
            keys = pattern.rows * pattern.order + pattern.indices
            found = np.searchsorted(keys, row * pattern.order + column)
            self._places = pattern, np.where((row >= 0) & (column >= 0), found, -1)
        return self._places[1]

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`."""
        forces = np.zeros(3 * len(self.bodies))
        self.chambers.add_force_rate(t, self.nodes(poses), forces)
        self.on_bodies(poses, forces, force_rate)

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`: energy of the gas, and power of its supply and of flow."""
        nodes = self.nodes(poses)
        before = None if past is None else t - past.duration
        power = self.chambers.power(t, nodes, self.node_rates(poses, rates), before)
        return {"gas": self.chambers.energy(t, nodes)}, 0.0, power

    def break_times(self) -> set[float]:
        """See `Group`."""
        return set(self.chambers.gases.break_times())

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`: panels that are joined."""
        return self._pairs, 0


class PanelGasSystem(SegmentSystem):
    """Rigid panels around chambers of gas; one of the groups is a `PanelGas`."""

    def variant(
        self, bodies: Bodies, motions: tuple[PrescribedMotion, ...], groups: tuple[Group, ...],
        pressures: tuple[Load, ...] = (),
    ) -> PanelGasSystem:
        """See `SegmentSystem`."""
        contacts = tuple(group for group in groups if isinstance(group, ContactGroup))
        return PanelGasSystem(bodies, motions, groups, contacts, self.pair_names)

    @property
    def gas(self) -> PanelGas:
        """Group of the gas."""
        return next(group for group in self.groups if isinstance(group, PanelGas))

    @property
    def chambers(self) -> Chambers:
        """Chambers of gas."""
        return self.gas.chambers

    def chamber_nodes(self, t: float, q: np.ndarray) -> np.ndarray:
        """Positions of the corners, flat, m."""
        return self.gas.nodes(self.place(t, q, None)[0])

    # forces -----------------------------------------------------------------------------------------------------------

    def _assembled(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray | None,
        before: PreviousState | None,
        pattern: BodyPattern,
        sums: tuple[np.ndarray, np.ndarray, np.ndarray],
        by_rates: np.ndarray | None,
        efforts: np.ndarray | None = None,
    ) -> Linearised:
        linear = super()._assembled(t, q, u, before, pattern, sums, by_rates, efforts)
        low_rank = self.gas.low_rank
        if low_rank is None:
            return linear
        vectors = self._of_bodies(low_rank, self.bodies.free).reshape(-1, self.nu)
        matrix = BlockMatrix(pattern, linear.stiffness.data, LowRank(np.ascontiguousarray(vectors), low_rank.weights))
        return Linearised(linear.force, matrix, linear.damping)

    def _of_bodies(self, low_rank: LowRank, bodies: np.ndarray | slice) -> np.ndarray:
        """Vectors (k, n, 6) of some bodies."""
        return low_rank.vectors.reshape(len(low_rank.vectors), -1, self.size)[:, bodies]

    def force_rate(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`: driven panels also compress the gas."""
        found, low_rank = super().force_rate(t, q), self.gas.low_rank
        if low_rank is None or not len(self.driven):
            return found
        speeds = self._body_rates(np.zeros(self.nu), t)[self.driven]
        grown = np.einsum("kni,ni->k", self._of_bodies(low_rank, self.driven), speeds)
        free = self._of_bodies(low_rank, self.bodies.free).reshape(-1, self.nu)
        return found - (low_rank.weights @ grown) @ free

    def drive_tangent(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None
    ) -> np.ndarray:
        """See `SegmentSystem`: driven panels also feel the gas."""
        poses, rates = self.place(t, q, u, before)
        found = super().drive_tangent(t, q, u, before)
        if not np.isin(self.gas.bodies, self.driven).any():
            return found
        self._with_driven(t, poses, rates, (self.gas,))
        low_rank = self.gas.low_rank
        if low_rank is None:
            return found
        along = np.zeros((len(self.motions), *rates.shape))
        for row, motion in zip(along, self.motions, strict=True):
            row[motion.bodies, : len(motion.direction)] = motion.direction
        if self.turns is not None:
            for k, body, twist in self.turns.twists(self._travels(t)):
                along[k, body] = twist
        swept = np.einsum("kni,dni->dk", self._of_bodies(low_rank, slice(None)), along)
        free = self._of_bodies(low_rank, self.bodies.free).reshape(-1, self.nu)
        return np.asarray(found + swept @ low_rank.weights @ free)

    def load_displacements(
        self, start: tuple[float, np.ndarray], end: tuple[float, np.ndarray]
    ) -> dict[str, tuple[float, float]]:
        """See `SegmentSystem`; the gas of a chamber has its pressure above that outside (Pa) and its change of volume."""
        ends = ((t, self.chamber_nodes(t, q)) for t, q in (start, end))
        found = self.chambers.pressures_and_changes(*ends)
        return super().load_displacements(start, end) | {name + PRESSURE: pair for name, pair in found.items()}

    # memory -----------------------------------------------------------------------------------------------------------

    def commit(self, t: float, q: np.ndarray, u: np.ndarray, before: PreviousState | None = None) -> None:
        """See `System`."""
        super().commit(t, q, u, before)
        self.chambers.commit(t, self.chamber_nodes(t, q))

    def memory(self) -> np.ndarray:
        """See `System`: gas, then contacts and creases."""
        return np.concatenate([self.chambers.gases.memory(), super().memory()])

    def element_memory(self) -> np.ndarray:
        """See `System`."""
        return np.concatenate([self.chambers.gases.memory(), super().element_memory()])

    def restore(self, memory: np.ndarray) -> None:
        """See `System`."""
        size = self.chambers.gases.remembered
        self.chambers.gases.restore(memory[:size])
        super().restore(memory[size:])
