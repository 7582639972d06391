"""Gas in chambers of rigid panels: the corners of panels are points of rigid bodies.

A corner x = r + R X moves by dx = dr - R [X] dtheta. Forces f of the gas on corners (`fsm.model.joined.chambers`) are a
force f and a moment X x R^T f on the body, in its axes. The tangent of the body has the tangent of the corners and
-[X] [R^T f], the change of the moment with the rotation.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.blocks import LowRank
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.scatter import find_slot
from fsm.model.bodies.arrays import DOF, FORCE, GAS, INTERVAL, POSES, RATES, STIFFNESS, STORED, pattern_of
from fsm.model.bodies.group import BodyState, body_pattern
from fsm.model.elements.element_group import OWN, ElementGroup, ElementKernels, bodies_of, nothing
from fsm.model.joined import chambers as gas_in
from fsm.model.joined.chambers import Chambers
from fsm.model.nodes.assembly import slots_of
from fsm.text.load_names import PRESSURE

_POINTS, _NODES, _VELOCITIES, _FORCES, _ROWS, _COLUMNS, _BLOCKS, _ON_BODIES, _CHAMBERS = range(OWN, OWN + 9)
_SLOTS = _CHAMBERS + gas_in.CHAMBER_ROWS
"""Rows of the table: corners X, their positions, velocities and forces, pattern and blocks between corners, vectors of low
rank on bodies, chambers, and positions of their elements in the blocks between corners."""


@kernel
def _set_nodes(poses: np.ndarray, own: np.ndarray) -> None:
    """Write the positions of all corners."""
    bodies, points, q, axes = bodies_of(own), floats_2d(own, _POINTS), floats_1d(own, _NODES), np.empty((3, 3))
    for i in range(points.shape[0]):
        pose = poses[bodies[i, 0]]
        fill_rotation(pose[3:], axes)
        for a in range(3):
            q[3 * i + a] = pose[a] + axes[a, 0] * points[i, 0] + axes[a, 1] * points[i, 1] + axes[a, 2] * points[i, 2]


@kernel
def _place(table: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Write the positions of all corners; returns the tables of the chambers and of these nodes."""
    _set_nodes(floats_2d(table, POSES), own)
    return own[_CHAMBERS:], own[_NODES:]


@kernel
def _move(table: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Velocities of all corners, flat, m/s."""
    poses, rates, bodies = floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own)
    points, u, axes = floats_2d(own, _POINTS), floats_1d(own, _VELOCITIES), np.empty((3, 3))
    for i in range(points.shape[0]):
        rate, x = rates[bodies[i, 0]], points[i]
        fill_rotation(poses[bodies[i, 0], 3:], axes)
        y = rate[4] * x[2] - rate[5] * x[1], rate[5] * x[0] - rate[3] * x[2], rate[3] * x[1] - rate[4] * x[0]
        for a in range(3):
            u[3 * i + a] = rate[a] + axes[a, 0] * y[0] + axes[a, 1] * y[1] + axes[a, 2] * y[2]
    return u


@kernel
def _on_bodies(table: np.ndarray, own: np.ndarray, forces: np.ndarray, out: np.ndarray) -> None:
    """Add forces (3 n,) on corners to the wrenches (n_bodies, 6)."""
    poses, bodies, points, axes = floats_2d(table, POSES), bodies_of(own), floats_2d(own, _POINTS), np.empty((3, 3))
    f = np.empty(3)
    for i in range(points.shape[0]):
        wrench, x = out[bodies[i, 0]], points[i]
        fill_rotation(poses[bodies[i, 0], 3:], axes)
        for a in range(3):
            wrench[a] += forces[3 * i + a]
            f[a] = axes[0, a] * forces[3 * i] + axes[1, a] * forces[3 * i + 1] + axes[2, a] * forces[3 * i + 2]
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            wrench[3 + a] += x[b] * f[c] - x[c] * f[b]


@kernel
def _force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    (chambers, nodes), forces = _place(table, own), floats_1d(own, _FORCES)
    forces[:] = 0.0
    gas_in.add_gas_force(chambers, nodes, t, forces)
    _on_bodies(table, own, forces, floats_2d(table, FORCE))
    return 0.0


@kernel
def _force_rate(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Add the explicit time derivative of the forces to the forces of the model."""
    (chambers, nodes), forces = _place(table, own), floats_1d(own, _FORCES)
    forces[:] = 0.0
    gas_in.add_gas_force_rate(chambers, nodes, t, forces)
    _on_bodies(table, own, forces, floats_2d(table, FORCE))
    return 0.0


@kernel
def _set_map(point: np.ndarray, axes: np.ndarray, out: np.ndarray) -> None:
    """Write the derivative (3, 6) of the position of a corner with respect to the increment of its body."""
    for a in range(3):
        for b in range(3):
            out[a, b] = 1.0 if a == b else 0.0
        for b in range(3):  # -R [X]
            c, d = (b + 1) % 3, (b + 2) % 3
            out[a, 3 + b] = axes[a, d] * point[c] - axes[a, c] * point[d]


@kernel
def _add_mapped(left: np.ndarray, block: np.ndarray, right: np.ndarray, out: np.ndarray) -> None:
    """Add L^T B R to a block (6, 6), with L and R (3, 6)."""
    for a in range(6):
        for c in range(3):
            work = left[0, a] * block[0, c] + left[1, a] * block[1, c] + left[2, a] * block[2, c]
            for b in range(6):
                out[a, b] += work * right[c, b]


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    (chambers, nodes), forces, blocks = _place(table, own), floats_1d(own, _FORCES), floats_3d(own, _BLOCKS)
    points, poses, bodies, p = floats_2d(own, _POINTS), floats_2d(table, POSES), bodies_of(own), pattern_of(table)
    dof, stiffness, total = integers_1d(table, DOF), floats_3d(table, STIFFNESS), floats_2d(table, FORCE)
    count, width = integers_2d(chambers, 0).shape
    forces[:], blocks[:] = 0.0, 0.0
    slots = integers_2d(own, _SLOTS).reshape(count, width, width)
    of_nodes = gas_in.add_gas_tangent(chambers, nodes, t, slots, 3, forces, blocks.reshape(-1))
    _on_bodies(table, own, forces, total)
    vectors = floats_2d(own, _ON_BODIES)
    vectors[:] = 0.0
    for k in range(vectors.shape[0]):
        _on_bodies(table, own, of_nodes[k], vectors[k].reshape(total.shape))
    maps, axes = np.empty((points.shape[0], 3, 6)), np.empty((points.shape[0], 3, 3))
    for i in range(points.shape[0]):
        fill_rotation(poses[bodies[i, 0], 3:], axes[i])
        _set_map(points[i], axes[i], maps[i])
    rows, columns = integers_1d(own, _ROWS), integers_1d(own, _COLUMNS)
    for k in range(rows.shape[0]):
        i, j = rows[k], columns[k]
        place = find_slot(p.rows, p.columns, dof[bodies[i, 0]], dof[bodies[j, 0]])
        if place < 0:
            continue
        _add_mapped(maps[i], blocks[k], maps[j], stiffness[place])
        if i == j:  # -[X] [R^T f] = (X . R^T f) - R^T f X^T
            f, x, along = np.empty(3), points[i], 0.0
            for a in range(3):
                f[a] = axes[i, 0, a] * forces[3 * i] + axes[i, 1, a] * forces[3 * i + 1] + axes[i, 2, a] * forces[3 * i + 2]
                along += x[a] * f[a]
            for a in range(3):
                stiffness[place, 3 + a, 3 + a] += along
                for b in range(3):
                    stiffness[place, 3 + a, 3 + b] -= f[a] * x[b]
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    chambers, nodes = _place(table, own)
    floats_1d(table, STORED)[GAS] += gas_in.gas_stored(chambers, nodes, t)
    return 0.0


@kernel
def _lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Add the power of the supply and of flow; nothing is dissipated. In motions the supply is that of the present time."""
    interval = floats_1d(table, INTERVAL)
    moving = per_second == 0.0 or (interval.shape[0] > 0 and interval[2] == 0.0)
    span = 0.0 if moving else 1.0 / per_second
    chambers, nodes = _place(table, own)
    floats_1d(table, STORED)[2] += gas_in.gas_put_in(chambers, nodes, t, span, _move(table, own))
    return 0.0


@kernel
def _accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    chambers, nodes = _place(table, own)
    gas_in.accept_chambers(chambers, nodes, t)
    return 0.0


_KERNELS = ElementKernels(_force, _tangent, nothing, _stored, _lost, _accept, force_rate=_force_rate)


class PanelGas(ElementGroup):
    """Forces of the gas of all chambers on panels.

    Parameters
    ----------
    chambers : Chambers
        Their nodes are the corners.
    bodies : (n,) int array
        Body of each corner.
    points : (n, 3) array, m
        Corners in the axes of the bodies.
    count : number of all bodies
    """

    categories = ("gas",)
    kernels = _KERNELS
    looks_back = True

    def __init__(self, chambers: Chambers, bodies: np.ndarray, points: np.ndarray, count: int) -> None:
        self.chambers, self.bodies = chambers, bodies[:, None].copy()
        size = points.size
        between = body_pattern(np.arange(len(bodies)), [chambers.pairs()], 3)
        rank = len(chambers.low_rank.weights)
        self._nodes, self._vectors = np.zeros(size), np.zeros((rank, 6 * count))
        slots = slots_of(chambers.vectors, 3, between.indptr, between.indices)
        self._tables = [
            points, self._nodes, np.zeros(size), np.zeros(size), between.rows, between.indices, between.zeros(),
            self._vectors, *chambers.table, slots.reshape(-1, slots.shape[-1]),
        ]  # fmt: skip
        joined = np.sort(bodies[np.stack([between.rows, between.indices], axis=1)], axis=1)
        self._joined = np.unique(joined[joined[:, 0] < joined[:, 1]], axis=0)

    @property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return self._tables

    @property
    def low_rank(self) -> LowRank:
        """Stiffness that joins all bodies at the last tangent, with vectors (k, n_bodies, 6), flat."""
        return LowRank(self._vectors, self.chambers.low_rank.weights)

    def nodes(self, poses: np.ndarray) -> np.ndarray:
        """Positions of all corners, flat (3 n,), m."""
        _set_nodes(poses, self._alone.own)
        return self._nodes.copy()

    def load_displacements(self, start: BodyState, end: BodyState) -> dict[str, tuple[float, float]]:
        """See `Group`; the gas of a chamber has its pressure above that outside (Pa) and its change of volume."""
        ends = ((state.t, self.nodes(state.poses)) for state in (start, end))
        return {name + PRESSURE: pair for name, pair in self.chambers.pressures_and_changes(*ends).items()}

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`."""
        self._alone.call("force_rate", t, 0.0, poses, force_rate, force_rate)

    def break_times(self) -> set[float]:
        """See `Group`."""
        return set(self.chambers.break_times())

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`: panels that are joined."""
        return self._joined, 0

    @property
    def memory_of(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.chambers.gases.arrays.last

    @property
    def first_memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.chambers.gases.start
