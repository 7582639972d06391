"""Cords from point to point over small pulleys without friction. The group, its table, and its kernels.

The length L of a cord is the sum of the distances of its points, which bodies carry. Its tension is

    T = k (L - f) + d (L' - f')

with the free length f(t), or zero if it is slack or would push. The tension is the same on both sides of a pulley.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.interactions.openings import LENGTH, opening
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at, program_at
from fsm.kernels.programs import Program, table_of
from fsm.kernels.scatter import add_block
from fsm.laws.one_sided import one_sided
from fsm.model.bodies.arrays import DAMPING, DOF, FORCE, POSES, RATES, STIFFNESS, STORED, pattern_of
from fsm.model.elements.element_group import LAST, OWN, ElementGroup, ElementKernels, bodies_of

_LINES, _LAWS, _PIECES = range(OWN, OWN + 3)
_STIFFNESS, _DAMPING = range(2)


@kernel
def _length(poses: np.ndarray, own: np.ndarray, i: int, slopes: np.ndarray, bends: np.ndarray) -> float:
    """Length of a cord, and its derivatives by all its bodies."""
    bodies, lines, total = bodies_of(own), floats_2d(own, _LINES), 0.0
    parts = bodies.shape[1] - 1
    gradient, hessian = np.empty(12), np.empty((12, 12))
    slopes[:] = 0.0
    bends[:] = 0.0
    for j in range(parts):
        ends = bodies[i, j], bodies[i, j + 1]
        total += opening(LENGTH, poses[ends[0]], poses[ends[1]], lines[parts * i + j], 0.0, gradient, hessian)
        for m in range(12):
            slopes[6 * j + m] += gradient[m]
            for n in range(12):
                bends[6 * j + m, 6 * j + n] += hessian[m, n]
    return total


@kernel
def _rate(rates: np.ndarray, own: np.ndarray, i: int, slopes: np.ndarray) -> float:
    bodies, total = bodies_of(own), 0.0
    for j in range(bodies.shape[1]):
        for k in range(6):
            total += slopes[6 * j + k] * rates[bodies[i, j], k]
    return total


@kernel
def _tension(
    own: np.ndarray, i: int, t: float, length: float, rate: float
) -> tuple[float, float, float, float, float, float]:
    """Tension, its slopes by length and by rate, energy, dissipated power, and input power of the spool."""
    law = floats_2d(own, _LAWS)[i]
    free, pace, _ = program_at(pieces_at(own, _PIECES), i, t)
    tension, by_length, by_rate, energy, lost = one_sided(length - free, rate - pace, law[_STIFFNESS], law[_DAMPING])
    return tension, by_length, by_rate, energy, lost, -tension * pace


@kernel
def _pull(force: np.ndarray, own: np.ndarray, i: int, slopes: np.ndarray, tension: float) -> None:
    bodies = bodies_of(own)
    for j in range(bodies.shape[1]):
        for k in range(6):
            force[bodies[i, j], k] -= tension * slopes[6 * j + k]


@kernel
def _rate_or_mean(table: np.ndarray, own: np.ndarray, i: int, length: float, slopes: np.ndarray, per_second: float) -> float:
    """Present rate, or the mean rate since the last state."""
    if per_second > 0.0:
        return float((length - floats_1d(own, LAST)[i]) * per_second)
    return float(_rate(floats_2d(table, RATES), own, i, slopes))


@kernel
def _force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    size = 6 * bodies_of(own).shape[1]
    slopes, bends, poses = np.empty(size), np.empty((size, size)), floats_2d(table, POSES)
    for i in range(bodies_of(own).shape[0]):
        length = _length(poses, own, i, slopes, bends)
        rate = _rate_or_mean(table, own, i, length, slopes, per_second)
        _pull(floats_2d(table, FORCE), own, i, slopes, _tension(own, i, t, length, rate)[0])
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    bodies, rates, poses = bodies_of(own), floats_2d(table, RATES), floats_2d(table, POSES)
    stiffness, damping = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    dof, p = integers_1d(table, DOF), pattern_of(table)
    size = 6 * bodies.shape[1]
    slopes, bends, turned, block = np.empty(size), np.empty((size, size)), np.empty(size), np.empty((size, size))
    for i in range(bodies.shape[0]):
        length = _length(poses, own, i, slopes, bends)
        rate = _rate_or_mean(table, own, i, length, slopes, per_second)
        tension, by_length, by_rate, _, _, _ = _tension(own, i, t, length, rate)
        _pull(floats_2d(table, FORCE), own, i, slopes, tension)
        for n in range(size):
            turned[n] = 0.0
            for m in range(size):
                if per_second == 0.0:
                    turned[n] += bends[m, n] * rates[bodies[i, m // 6], m % 6]
        for m in range(size):
            for n in range(size):
                block[m, n] = slopes[m] * (by_length * slopes[n] + by_rate * turned[n]) + tension * bends[m, n]
        add_block(block, dof, bodies[i], p.rows, p.columns, stiffness)
        for m in range(size):
            for n in range(size):
                block[m, n] = by_rate * slopes[m] * slopes[n]
        add_block(block, dof, bodies[i], p.rows, p.columns, damping)
    return 0.0


@kernel
def _keep(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    size = 6 * bodies_of(own).shape[1]
    slopes, bends, last = np.empty(size), np.empty((size, size)), floats_1d(own, LAST)
    for i in range(last.shape[0]):
        last[i] = _length(floats_2d(table, POSES), own, i, slopes, bends)
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Add the energy, which counts as energy of panels and joints."""
    size = 6 * bodies_of(own).shape[1]
    slopes, bends = np.empty(size), np.empty((size, size))
    for i in range(bodies_of(own).shape[0]):
        length = _length(floats_2d(table, POSES), own, i, slopes, bends)
        floats_1d(table, STORED)[0] += _tension(own, i, t, length, 0.0)[3]
    return 0.0


@kernel
def _lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Dissipated power; adds the input power of the spools at the present rates."""
    size, total = 6 * bodies_of(own).shape[1], 0.0
    slopes, bends = np.empty(size), np.empty((size, size))
    for i in range(bodies_of(own).shape[0]):
        length = _length(floats_2d(table, POSES), own, i, slopes, bends)
        total += _tension(own, i, t, length, _rate_or_mean(table, own, i, length, slopes, per_second))[4]
        rate = _rate(floats_2d(table, RATES), own, i, slopes)
        floats_1d(table, STORED)[2] += _tension(own, i, t, length, rate)[5]
    return total


@kernel
def cord_states(own: np.ndarray, poses: np.ndarray, rates: np.ndarray, t: float, found: np.ndarray) -> None:
    """Write length, its rate and tension of each cord, (m, 3)."""
    size = 6 * bodies_of(own).shape[1]
    slopes, bends = np.empty(size), np.empty((size, size))
    for i in range(found.shape[0]):
        length = _length(poses, own, i, slopes, bends)
        rate = _rate(rates, own, i, slopes)
        found[i, 0], found[i, 1], found[i, 2] = length, rate, _tension(own, i, t, length, rate)[0]


_KERNELS = ElementKernels(_force, _tangent, _keep, _stored, _lost)


@dataclass(frozen=True)
class CordGroup(ElementGroup):
    """Cords with the same number of points.

    Attributes
    ----------
    bodies : (m, n) int array
        Bodies of the points along each cord.
    lines : (m (n - 1), 14) array
        Constants of the kind `LENGTH` of each part (`fsm.interactions.openings`).
    laws : (m, 2) array
        Stiffness and damping, N/m and N s/m.
    free : (m,) functions of time
        Free lengths, m.
    names : names of the cords
    """

    bodies: np.ndarray
    lines: np.ndarray
    laws: np.ndarray
    free: tuple[Program, ...]
    names: tuple[str, ...]
    categories = ("panels",)
    kernels = _KERNELS

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [self.lines, self.laws, *table_of(self.free)]

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.laws[:, _DAMPING]))

    def break_times(self) -> set[float]:
        """See `Group`."""
        return {time for function in self.free for time in function.breaks()}

    def states(self, t: float, poses: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Lengths, their rates, and tensions, (m, 3)."""
        found = np.zeros((len(self.names), 3))
        cord_states(self._alone.own, poses, rates, t, found)
        return found
