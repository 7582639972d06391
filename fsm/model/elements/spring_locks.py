"""Springs without deformation in statics: multipliers of the stiff springs that hold facets and supports together.

The effort of a locked direction of a spring is lambda + k x, with its deformation x and its stiffness k as the penalty. A
quasi-static step first finds the equilibrium without multipliers, then takes the efforts as multipliers and closes the
springs (`fsm.solve.stepping.quasi_static.closed_locks`), so that x is zero up to round-off: the error of the flexibility of
the springs vanishes, and k can be smaller, with less round-off. Directions that follow from others are harmless: their
multipliers are those of least work. Springs that hardly resist a motion, as those of a flat sheet, stay plain springs.

The spring has lambda as the shift -lambda/k of its rest position, in place. All other methods (motions, natural modes,
equilibria without a path) keep the multipliers of the last accepted state, zero at the start, and have plain springs about
them. The group has no forces of its own; it takes the energy lambda^2/(2 k) out of the balance, which is no work.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.bodies.arrays import STORED, SWAP, springs_of
from fsm.model.elements.element_group import OWN, ElementGroup, ElementKernels, nothing
from fsm.solve.stepping.quasi_static import BEFORE, BEGIN, FIRST, NEXT

_PLACES, _CONSTANTS, _RESTS, _FIXED, _KEPT, _LAST = range(OWN, OWN + 6)
_ELEMENT, _DIRECTION, _REST, _STIFFNESS = range(4)
"""Columns of `places`: spring, direction, and columns of its constants."""
_TARGET, _IN_PANELS = range(2)
"""Columns of `fixed`: rest position without a multiplier, and part of the energy that counts as energy of panels."""


@kernel(inline=True)
def _shift(own: np.ndarray, i: int) -> float:
    """Present shift of the rest position of a lock."""
    places = integers_2d(own, _PLACES)
    return floats_2d(own, _CONSTANTS)[places[i, _ELEMENT], places[i, _REST]] - floats_2d(own, _FIXED)[i, _TARGET]


@kernel(inline=True)
def _set_shift(own: np.ndarray, i: int, shift: float) -> None:
    places, rest = integers_2d(own, _PLACES), floats_2d(own, _FIXED)[i, _TARGET] + shift
    floats_2d(own, _CONSTANTS)[places[i, _ELEMENT], places[i, _REST]] = rest
    floats_2d(own, _RESTS)[places[i, _ELEMENT], places[i, _DIRECTION]] = rest


@kernel
def _stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Subtract k s^2/2 = lambda^2/(2 k), which the spring of the shift s has more than the work on it.

    Springs that first deform and close later store k x^2/2 less than the work of the motion that closes them: this work is
    that of the closed springs. Without this energy the balance would jump there.
    """
    places, constants, stored = integers_2d(own, _PLACES), floats_2d(own, _CONSTANTS), floats_1d(table, STORED)
    for i in range(places.shape[0]):
        energy = 0.5 * constants[places[i, _ELEMENT], places[i, _STIFFNESS]] * _shift(own, i) ** 2
        in_panels = floats_2d(own, _FIXED)[i, _IN_PANELS]
        stored[0] -= in_panels * energy
        stored[1] -= (1.0 - in_panels) * energy
    stored[1] -= floats_1d(own, _LAST)[1]
    return 0.0


@kernel
def _accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Keep the multipliers."""
    kept, count = floats_1d(own, _KEPT), integers_2d(own, _PLACES).shape[0]
    for i in range(count):
        kept[i] = _shift(own, i)
    kept[count], kept[count + 1] = floats_1d(own, _LAST)[0], floats_1d(own, _LAST)[1]
    return 0.0


@kernel
def _project(table: np.ndarray, own: np.ndarray, t: float, task: float) -> float:
    """Exchange the present multipliers and the kept ones for the task `SWAP`; nothing is projected."""
    if task == SWAP:
        kept = floats_1d(own, _KEPT)
        for i in range(integers_2d(own, _PLACES).shape[0]):
            shift = _shift(own, i)
            _set_shift(own, i, kept[i])
            kept[i] = shift
    return 0.0


@kernel
def _take_up(table: np.ndarray, own: np.ndarray, t: float, task: float) -> float:
    return take_up(
        integers_2d(own, _PLACES), floats_2d(own, _CONSTANTS), floats_2d(own, _RESTS), floats_2d(own, _FIXED),
        floats_1d(own, _KEPT), floats_1d(own, _LAST), springs_of(table).efforts, task,
    )  # fmt: skip


@kernel
def take_up(
    places: np.ndarray, constants: np.ndarray, rests: np.ndarray, fixed: np.ndarray, kept: np.ndarray, last: np.ndarray,
    efforts: np.ndarray, task: float,
) -> float:  # fmt: skip
    """Do a task of `fsm.solve.stepping.quasi_static.StaticCalls.take_up` with the efforts (m, 3 or 6) of all springs."""
    count, energy = places.shape[0], 0.0
    takes = int(task) in (FIRST, NEXT) or (task == BEGIN and kept[places.shape[0]] > 0.0)
    if task == BEFORE:
        return 1.0 + float(kept[count])
    for i in range(count):
        element, column = places[i, _ELEMENT], places[i, _REST]
        stiffness, before = constants[element, places[i, _STIFFNESS]], constants[element, column] - fixed[i, _TARGET]
        shift = -efforts[element, places[i, _DIRECTION]] / stiffness if takes else 0.0
        constants[element, column] = rests[element, places[i, _DIRECTION]] = fixed[i, _TARGET] + shift
        energy += 0.5 * stiffness * (shift - before) ** 2
    if task == FIRST:
        last[0], last[2] = 1.0, energy
    elif task != NEXT:
        last[0], last[2] = 0.0, 0.0 if task == BEGIN else last[2]
    last[1] = kept[count + 1] + (last[0] - kept[count]) * last[2]
    return energy


_KERNELS = ElementKernels(nothing, nothing, nothing, _stored, accept=_accept, project=_project, take_up=_take_up)


@dataclass(frozen=True)
class SpringLocks(ElementGroup):
    """Locked directions of the springs of a `BushingGroup`.

    Attributes
    ----------
    places : (n, 4) int array
        Number of the spring, its direction, and the columns of its rest position and stiffness in `constants`.
    constants : constants of the springs, whose rest positions change in place
    rests : (m, 3 or 6) array
        Rest positions of the springs, the same numbers.
    fixed : (n, 2) array
        Rest position without a multiplier, m or rad, and part of the energy that counts as energy of panels.
    """

    places: np.ndarray
    constants: np.ndarray
    rests: np.ndarray
    fixed: np.ndarray
    rate_dependent = False
    kernels = _KERNELS

    @property
    def bodies(self) -> np.ndarray:  # type: ignore[override]
        """No bodies: the springs join them."""
        return np.zeros((0, 2), dtype=np.int64)

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        n = len(self.places)
        return [self.places, self.constants, self.rests, self.fixed, np.zeros(n + 2), np.zeros(3)]

    @property
    def memory_of(self) -> np.ndarray:
        """Shifts (n,) of the rest positions at the last accepted state, m or rad; 1 if they are closed there; and the
        energy of the deformations with which they closed and have not opened again, J.
        """
        return self.arrays[_KEPT - OWN]

    @property
    def first_memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        return np.zeros(len(self.places) + 2)

    def restore(self, memory: np.ndarray) -> None:
        """See `ElementGroup`."""
        super().restore(memory)
        self.go_back()

    def go_back(self) -> None:
        """Use the multipliers of the last accepted state."""
        element, direction, rest, _ = self.places.T
        self.constants[element, rest] = self.rests[element, direction] = self.fixed[:, _TARGET] + self.memory_of[:-2]
        self.arrays[_LAST - OWN][:] = *self.memory_of[-2:], 0.0

    def take_up(self, efforts: np.ndarray, task: int) -> float:
        """Do a task with the efforts (m, 3 or 6) of the springs; see `System`."""
        places, constants, rests, fixed, kept, last = self.arrays
        return float(take_up(places, constants, rests, fixed, kept, last, efforts, float(task)))
