"""Springs, dampers and stops on the coordinates of joints. The group, its table, and its kernels.

    e = load + k (c - rest) + table(c) + d c' + stop(c, c') + latch(c, c')

is against the coordinate c, an angle with all its turns or a displacement (`fsm.interactions.openings`). A stop beyond a
limit by p has k p + d p', or zero if this would pull. A latch is a stop
against the way back, which acts from the first accepted state on in which the coordinate has reached it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.interactions.openings import TURN, opening
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_block
from fsm.laws.one_sided import one_sided
from fsm.model.bodies.arrays import DAMPING, DOF, FORCE, POSES, RATES, STIFFNESS, STORED, pattern_of
from fsm.model.elements.element_group import LAST, OWN, ElementGroup, ElementKernels, bodies_of

_KINDS, _CONSTANTS, _LAWS, _FIRST, _ROWS, _KEPT = range(OWN, OWN + 6)
LOAD, SPRING, REST, DAMPER, LOWER, UPPER, STOP, STOP_DAMPER = range(8)
LATCH_AT, LATCH_SENSE, PLAY, LATCH, LATCH_DAMPER, SLOWER = range(8, 14)
"""Columns of the laws."""


@kernel
def _coordinate(table: np.ndarray, own: np.ndarray, i: int, gradient: np.ndarray, hessian: np.ndarray) -> float:
    """Coordinate of a row, with all its turns, and its derivatives."""
    poses, bodies, kind = floats_2d(table, POSES), bodies_of(own), integers_1d(own, _KINDS)[i]
    c = opening(kind, poses[bodies[i, 0]], poses[bodies[i, 1]], floats_2d(own, _CONSTANTS)[i], 0.0, gradient, hessian)
    if kind == TURN:
        c += 2.0 * np.pi * np.round((floats_1d(own, _KEPT)[i] - c) / (2.0 * np.pi))
    return float(c)


@kernel
def _rate(table: np.ndarray, own: np.ndarray, i: int, gradient: np.ndarray) -> float:
    rates, bodies, total = floats_2d(table, RATES), bodies_of(own), 0.0
    for side in range(2):
        for k in range(6):
            total += gradient[6 * side + k] * rates[bodies[i, side], k]
    return total


@kernel
def _of_table(own: np.ndarray, i: int, c: float) -> tuple[float, float, float]:
    """Effort of the table of a row, its slope, and its energy from the first row of the table on."""
    first, rows = integers_1d(own, _FIRST), floats_2d(own, _ROWS)
    begin, end = first[i], first[i + 1]
    if end - begin < 2:
        return 0.0, 0.0, 0.0
    energy, k = 0.0, begin
    while k < end - 2 and c > rows[k + 1, 0]:
        energy += 0.5 * (rows[k + 1, 0] - rows[k, 0]) * (rows[k, 1] + rows[k + 1, 1])
        k += 1
    slope = (rows[k + 1, 1] - rows[k, 1]) / (rows[k + 1, 0] - rows[k, 0])
    past = c - rows[k, 0]
    return rows[k, 1] + slope * past, slope, energy + past * (rows[k, 1] + 0.5 * slope * past)


@kernel
def _law(own: np.ndarray, i: int, c: float, rate: float) -> tuple[float, float, float, float, float]:
    """Effort against the coordinate, its derivatives by the coordinate and by the rate, energy, and dissipated power."""
    law = floats_2d(own, _LAWS)[i]
    effort, by_c, energy = _of_table(own, i, c)
    past = c - law[REST]
    effort += law[LOAD] + law[SPRING] * past + law[DAMPER] * rate
    by_c += law[SPRING]
    by_rate, lost = law[DAMPER], law[DAMPER] * rate * rate
    energy += law[LOAD] * past + 0.5 * law[SPRING] * past * past
    latched = floats_1d(own, _KEPT)[floats_2d(own, _LAWS).shape[0] + i] > 0.0
    for side in range(3 if latched else 2):
        sense, limit, stiffness, damper = -1.0 if side == 0 else 1.0, law[LOWER + side % 2], law[STOP], law[STOP_DAMPER]
        if side == 2:
            sense, limit = -law[LATCH_SENSE], law[LATCH_AT] - law[LATCH_SENSE] * law[PLAY]
            stiffness, damper = law[LATCH], law[LATCH_DAMPER]
        push, slope, damping, kept, heat = one_sided(sense * (c - limit), sense * rate, stiffness, damper)
        effort += sense * push
        by_c += slope
        by_rate += damping
        energy += kept
        lost += heat
    return effort, by_c, by_rate, energy, lost


@kernel
def _rate_or_mean(table: np.ndarray, own: np.ndarray, i: int, c: float, gradient: np.ndarray, per_second: float) -> float:
    """Present rate, or the mean rate since the last state."""
    if per_second > 0.0:
        return float((c - floats_1d(own, LAST)[i]) * per_second)
    return float(_rate(table, own, i, gradient))


@kernel
def _force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    force, bodies, gradient, hessian = floats_2d(table, FORCE), bodies_of(own), np.empty(12), np.empty((12, 12))
    for i in range(bodies.shape[0]):
        c = _coordinate(table, own, i, gradient, hessian)
        effort = _law(own, i, c, _rate_or_mean(table, own, i, c, gradient, per_second))[0]
        for side in range(2):
            for k in range(6):
                force[bodies[i, side], k] -= effort * gradient[6 * side + k]
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    force, rates, bodies, dof = floats_2d(table, FORCE), floats_2d(table, RATES), bodies_of(own), integers_1d(table, DOF)
    stiffness, damping, p = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING), pattern_of(table)
    gradient, hessian, block, turned = np.empty(12), np.empty((12, 12)), np.empty((12, 12)), np.empty(12)
    for i in range(bodies.shape[0]):
        c = _coordinate(table, own, i, gradient, hessian)
        effort, by_c, by_rate, _, _ = _law(own, i, c, _rate_or_mean(table, own, i, c, gradient, per_second))
        for side in range(2):
            for k in range(6):
                force[bodies[i, side], k] -= effort * gradient[6 * side + k]
        for n in range(12):
            turned[n] = 0.0
            for m in range(12):
                if per_second == 0.0:
                    turned[n] += hessian[m, n] * rates[bodies[i, m // 6], m % 6]
        for m in range(12):
            for n in range(12):
                block[m, n] = gradient[m] * (by_c * gradient[n] + by_rate * turned[n]) + effort * hessian[m, n]
        add_block(block, dof, bodies[i], p.rows, p.columns, stiffness)
        if by_rate == 0.0:
            continue
        for m in range(12):
            for n in range(12):
                block[m, n] = by_rate * gradient[m] * gradient[n]
        add_block(block, dof, bodies[i], p.rows, p.columns, damping)
    return 0.0


@kernel
def _keep(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    last, gradient, hessian = floats_1d(own, LAST), np.empty(12), np.empty((12, 12))
    for i in range(last.shape[0]):
        last[i] = _coordinate(table, own, i, gradient, hessian)
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Add the energy, which counts as energy of panels and joints."""
    gradient, hessian, total = np.empty(12), np.empty((12, 12)), 0.0
    for i in range(bodies_of(own).shape[0]):
        total += _law(own, i, _coordinate(table, own, i, gradient, hessian), 0.0)[3]
    floats_1d(table, STORED)[0] += total
    return 0.0


@kernel
def _lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    gradient, hessian, total = np.empty(12), np.empty((12, 12)), 0.0
    for i in range(bodies_of(own).shape[0]):
        c = _coordinate(table, own, i, gradient, hessian)
        total += _law(own, i, c, _rate_or_mean(table, own, i, c, gradient, per_second))[4]
    return total


@kernel
def _accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Count the turns, and close latches."""
    kept, laws, gradient, hessian = floats_1d(own, _KEPT), floats_2d(own, _LAWS), np.empty(12), np.empty((12, 12))
    for i in range(laws.shape[0]):
        law, kept[i] = laws[i], _coordinate(table, own, i, gradient, hessian)
        reached = law[LATCH] > 0.0 and law[LATCH_SENSE] * (kept[i] - law[LATCH_AT]) >= 0.0
        if reached and abs(_rate(table, own, i, gradient)) <= law[SLOWER]:
            kept[laws.shape[0] + i] = 1.0
    return 0.0


_KERNELS = ElementKernels(_force, _tangent, _keep, _stored, _lost, _accept)


@dataclass(frozen=True)
class JointForceGroup(ElementGroup):
    """Springs, dampers and stops on the coordinates of joints.

    Attributes
    ----------
    bodies : (m, 2) int array
    kinds, constants : (m,) int and (m, 10) arrays, see `fsm.interactions.openings`
    laws : (m, 14) array, see the columns above
    first, rows : (m + 1,) int and (n, 2) arrays
        Rows (coordinate, effort) of all tables; those of element i begin at `first[i]`.
    start : (m,) array
        Coordinates at the start.
    names : names of the joints
    """

    bodies: np.ndarray
    kinds: np.ndarray
    constants: np.ndarray
    laws: np.ndarray
    first: np.ndarray
    rows: np.ndarray
    start: np.ndarray
    names: tuple[str, ...]
    categories = ("panels",)

    @property
    def kernels(self) -> ElementKernels:
        """See `ElementGroup`."""
        return _KERNELS

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [self.kinds, self.constants, self.laws, self.first, self.rows, self.first_memory]

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.laws[:, [DAMPER, STOP_DAMPER, LATCH_DAMPER]]))

    @property
    def memory_of(self) -> np.ndarray:
        """Coordinates (m,) at the last accepted state, which count the turns, and whether each latch has closed, (m,)."""
        return self.arrays[_KEPT - OWN]

    @property
    def first_memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        return np.concatenate([self.start, np.zeros(len(self.start))])
