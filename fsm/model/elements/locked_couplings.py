"""Ideal couplings: the opening e = sum r_j x_j of the coordinates of several ideal joints is locked.

The multipliers are those of ideal joints (`fsm.model.elements.joints`), with the same penalties. In steps of the mean-force
method they act along the gradients at the Gauss points.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_block
from fsm.model.bodies import arrays as rows
from fsm.model.bodies.group import BodyState
from fsm.model.elements import couplings
from fsm.model.elements.couplings import Coupling, CouplingGroup
from fsm.model.elements.element_group import OWN, bodies_of
from fsm.model.elements.joints import PROJECTION, advance_efforts, along_step, penalty_of, swap

_RATIOS, _MASSES, _PENALTY, _EFFORT, _BEND, _VALUE, _STILL, _SIZES, _CHANGE = range(
    couplings.FIRST_PARAMETER, couplings.FIRST_PARAMETER + 9
)
_ROUND_OFF = 16.0 * float(np.finfo(float).eps)
"""Opening relative to the coordinates, below which it is round-off and counts as zero."""


@kernel
def _put(own: np.ndarray, i: int, effort: float, slope: float) -> None:
    """Write efforts and their derivatives of a coupling of this effort on its opening."""
    ratios, efforts = floats_2d(own, _RATIOS), floats_2d(own, couplings.EFFORTS)
    by_angle = floats_3d(own, couplings.STIFFNESSES)
    for j in range(ratios.shape[1]):
        efforts[i, j] = ratios[i, j] * effort
        for k in range(ratios.shape[1]):
            by_angle[i, j, k] = slope * ratios[i, j] * ratios[i, k]


@kernel
def _opening(own: np.ndarray, i: int) -> float:
    """Opening of a coupling from the measured coordinates."""
    ratios, angles, total, size = floats_2d(own, _RATIOS), floats_2d(own, couplings.ANGLES), 0.0, 1.0
    for j in range(ratios.shape[1]):
        total += ratios[i, j] * angles[i, j]
        size += abs(ratios[i, j] * angles[i, j])
    return total if abs(total) > _ROUND_OFF * size else 0.0


@kernel
def _along(table: np.ndarray, own: np.ndarray, i: int) -> float:
    """Rate of an opening from the rates of all bodies and the measured gradients."""
    ratios, gradient, rates = floats_2d(own, _RATIOS), floats_2d(own, couplings.GRADIENTS), floats_2d(table, rows.RATES)
    ends = couplings.ends_of(own)
    total = 0.0
    for j in range(ratios.shape[1]):
        k = i * ratios.shape[1] + j
        for c in range(12):
            total += ratios[i, j] * gradient[k, c] * rates[ends[k, c // 6], c % 6]
    return total


@kernel
def _law(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    effort, penalty, value = floats_1d(own, _EFFORT), floats_1d(own, _PENALTY), floats_1d(own, _VALUE)
    mean = along_step(floats_1d(own, _STILL))
    for i in range(effort.shape[0]):
        if not mean:
            value[i] = _opening(own, i)
        _put(own, i, effort[i] + penalty[i] * value[i], 2.0 * penalty[i] if mean else penalty[i])
    return 0.0


@kernel
def _lock(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """See `fsm.model.elements.joints`."""
    effort, penalty, kept, masses = floats_1d(own, _EFFORT), floats_1d(own, _PENALTY), _kept(own), floats_1d(own, _MASSES)
    energy, sizes = floats_1d(own, _STILL)[0], floats_1d(own, _SIZES)
    floats_1d(own, _STILL)[3] = 0.0
    for i in range(effort.shape[0]):
        effort[i], penalty[i] = kept[i], penalty_of(masses[i], sizes[i], per_second, energy)
    return 1.0


@kernel
def _kept(own: np.ndarray) -> np.ndarray:
    """Kept multipliers (m,), which follow the kept coordinates."""
    return floats_1d(own, couplings.KEPT)[floats_2d(own, couplings.GRADIENTS).shape[0] :]


@kernel
def _advance(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """See `fsm.model.elements.joints`."""
    effort = floats_1d(own, _EFFORT)
    along = np.empty(effort.shape[0])
    if t == rows.WORK or t == rows.STEP:
        for i in range(effort.shape[0]):
            along[i] = _along(table, own, i)
    return advance_efforts(
        t, per_second, effort, floats_1d(own, _PENALTY), floats_1d(own, _VALUE), along, floats_1d(own, _CHANGE),
        floats_1d(own, _SIZES), floats_1d(own, _STILL),
    )  # fmt: skip


@kernel
def _accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Count turns; at rest, keep the multipliers."""
    couplings.accept(table, own, t, per_second)
    if floats_1d(own, _STILL)[0] > 0.0:
        _kept(own)[:] = floats_1d(own, _EFFORT)
    return 0.0


@kernel
def _project(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Task of a projection, see `fsm.model.elements.joints`."""
    task, error = int(per_second), 0.0
    effort, masses, bend = floats_1d(own, _EFFORT), floats_1d(own, _MASSES), floats_1d(own, _BEND)
    if task == rows.SWAP:
        swap(effort, _kept(own))
        return 0.0
    if task == rows.KEEP:
        _kept(own)[:] = effort
        floats_1d(own, _PENALTY)[:] = 0.0
        return 0.0
    if task == rows.MEASURE:
        _measure_all(table, own, t)
        return 0.0
    if task == rows.BEND:
        _bend_all(table, own)
        return 0.0
    if task == rows.AT_END:
        _measure_end(table, own, t)
        return 0.0
    if task == rows.ALONG_STEP:
        return 0.0
    for i in range(effort.shape[0]):
        rate = floats_1d(own, _VALUE)[i] if task == rows.CLOSE else _along(table, own, i)
        if task in (rows.AT_ACCELERATIONS, rows.AT_GIVEN):
            rate += bend[i]
        total = PROJECTION * masses[i] * rate
        if task == rows.AT_ACCELERATIONS:
            effort[i] += total
            total += effort[i]
        _put(own, i, total, 0.0)
        error += masses[i] * rate * rate
    couplings.add_efforts(table, own)
    return error


@kernel
def _measure_all(table: np.ndarray, own: np.ndarray, t: float) -> None:
    """Openings, and the penalties in the stiffness."""
    couplings.measure_coordinates(table, own, t, False)
    effort, masses, value = floats_1d(own, _EFFORT), floats_1d(own, _MASSES), floats_1d(own, _VALUE)
    ratios, gradient, dof = floats_2d(own, _RATIOS), floats_2d(own, couplings.GRADIENTS), integers_1d(table, rows.DOF)
    p = rows.pattern_of(table)
    n, width = ratios.shape[1], gradient.shape[1]
    row, block = np.empty(n * width), np.empty((n * width, n * width))
    for i in range(effort.shape[0]):
        value[i], effort[i] = _opening(own, i), 0.0
        for j in range(n):
            for c in range(width):
                row[j * width + c] = ratios[i, j] * gradient[i * n + j, c]
        for a in range(n * width):
            for b in range(n * width):
                block[a, b] = PROJECTION * masses[i] * row[a] * row[b]
        add_block(block, dof, bodies_of(own)[i], p.rows, p.columns, floats_3d(table, rows.STIFFNESS))


@kernel
def _measure_end(table: np.ndarray, own: np.ndarray, t: float) -> None:
    """Openings at the end of a step."""
    couplings.measure_coordinates(table, own, t, False)
    value = floats_1d(own, _VALUE)
    for i in range(value.shape[0]):
        value[i] = _opening(own, i)
    floats_1d(own, _STILL)[3] = 1.0


@kernel
def _bend_all(table: np.ndarray, own: np.ndarray) -> None:
    """Second derivatives in time of the openings at constant rates."""
    bends, ratios, curved = floats_1d(own, _BEND), floats_2d(own, _RATIOS), couplings.bends_of(table, own)
    for i in range(bends.shape[0]):
        bends[i] = 0.0
        for j in range(ratios.shape[1]):
            bends[i] += ratios[i, j] * curved[i * ratios.shape[1] + j]


_KERNELS = couplings.KERNELS._replace(accept=_accept, lock=_lock, advance=_advance, project=_project)


def _parameters(given: list[Any]) -> list[np.ndarray]:
    ratios = np.array([[1.0, -own["ratio"]] for own in given], dtype=float)
    n = len(given)
    return [ratios, np.ones(n), *(np.zeros(n) for _ in range(4)), np.zeros(4), np.zeros(n), np.zeros(n)]


LOCKED_GEAR = Coupling(2, _law, _parameters)
"""Kinds "gear" and "rack" of `[[scene.couplings]]` without a stiffness."""


class LockedCouplings(CouplingGroup):
    """Ideal couplings, on coordinates of ideal joints."""

    categories = ()
    rate_dependent = False
    locks = True
    kernels = _KERNELS

    @property
    def memories(self) -> int:
        """Length of the memory, with the multipliers (m,)."""
        return self.coordinates + len(self.bodies)

    @property
    def masses(self) -> np.ndarray:
        """Inertia (m,) of each opening at the start, in place."""
        return self.arrays[_MASSES - OWN]

    @property
    def coupled(self) -> np.ndarray:
        """Bodies (m, 2, 2) of the two joints of each coupling."""
        return self.joints.ends.reshape(-1, 2, 2)

    @cached_property
    def active(self) -> np.ndarray:
        """1 for the couplings (m,) that act, 0 for those that an event has released, in place."""
        return np.ones(len(self.bodies))

    def let_go(self) -> None:
        """Set the multipliers of released couplings to zero."""
        for efforts in (self.memory_of[self.coordinates :], self.arrays[_EFFORT - OWN]):
            efforts[self.active == 0.0] = 0.0

    def gradients(self, poses: np.ndarray) -> np.ndarray:
        """See `ElementGroup`; all bodies."""
        found, still = np.zeros((len(self.bodies), len(poses), 6)), np.zeros((len(poses), 6))
        self.energy(BodyState(0.0, poses, still))
        parts = self.arrays[couplings.GRADIENTS - OWN].reshape(*self.arrays[_RATIOS - OWN].shape, 2, 6)
        ends = self.joints.ends.reshape(*parts.shape[:3])
        for row, ratios, of, bodies in zip(found, self.arrays[_RATIOS - OWN], parts, ends, strict=True):
            np.add.at(row, bodies, ratios[:, None, None] * of)
        return found

    def restore(self, memory: np.ndarray) -> None:
        """See `ElementGroup`."""
        super().restore(memory)
        self.lock(0.0)

    @property
    def still(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.arrays[_STILL - OWN]

    @property
    def sizes(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.arrays[_SIZES - OWN]
