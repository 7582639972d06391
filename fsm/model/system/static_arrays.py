"""Arrays of a system of bodies for quasi-static steps in kernels, and for the states at their ends."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from fsm.kernels.addresses import address_table
from fsm.kernels.block_equations import SYMMETRIC, TRUSTED
from fsm.kernels.blocks import BlockMatrix, BlockPattern
from fsm.kernels.pointers import enter
from fsm.model.bodies.arrays import FACTORS, Arrays
from fsm.model.bodies.group import BodyPattern, BodyState, PreviousPoses
from fsm.model.elements.element_group import ElementArrays, ElementGroup
from fsm.model.elements.elements import BushingGroup
from fsm.model.system.array_path import PATH
from fsm.model.system.arrays import of_bodies_alone
from fsm.model.system.arrays_of import ContactModel, change_pattern, segments_of
from fsm.solve.interface.records import DriveState, Energy, Observation, PairState, PreviousState, Ready, mapped
from fsm.solve.stepping import path_state as row
from fsm.solve.stepping.path_arrays import begin_step
from fsm.solve.stepping.quasi_static import StaticModel

if TYPE_CHECKING:
    from fsm.model.system.force_system import SegmentForces

_PATTERNS: dict[tuple[int, bytes, bytes, bytes], BodyPattern] = {}
"""Patterns of earlier steps, also of other cases, whose eliminations are known (`fsm.solve.equations.linear`)."""
_MOST_PATTERNS, _MOST_BLOCKS = 64, 20_000
"""Number of patterns that are kept, and number of blocks of the largest."""


class StaticSegments:
    """Arrays of a system without parts in Python; see `fsm.solve.interface.system.StaticArrays`.

    The arrays hold the memory of contacts while a path takes compiled steps. `to_groups` gives this memory to the groups
    in Python, which `SegmentForces.groups` calls before anyone uses them.

    Attributes
    ----------
    model : StaticModel
    ahead : bool
        Whether the memory of the arrays is newer than that of the groups.
    """

    energies: ClassVar[dict[str, int]] = {
        "panels": row.PANELS, "creases": row.CREASES, "gravity": row.GRAVITY, "contact": row.CONTACT, "gas": row.GAS,
    }  # fmt: skip
    """Indices of energies in a record, by name."""

    def __init__(self, system: SegmentForces, pattern: BodyPattern, ready: Ready) -> None:
        self._system, self._ready = system, ready
        pairs = len(system.pair_names)
        self._contacts = ContactModel(system.contacts, pattern, system.spatial, pairs, statics=True)
        self._first_pattern = pattern
        counted = [contact.evaluations for contact in system.contacts]
        self._stored_by = [list(group.energy(self._at_start)[0]) for group in system.groups]
        for contact, count in zip(system.contacts, counted, strict=True):  # these names cost no evaluation of the run
            contact.evaluations = count
        self._set_arrays(pattern, *self._create(pattern))
        self.ahead, self._accepted = False, np.zeros(0)
        self._loaded: tuple[int, ...] | None = None

    @property
    def _at_start(self) -> BodyState:
        """Initial poses at rest."""
        return BodyState(0.0, self._system.bodies.pose, self._system.at_rest)

    def _create(self, pattern: BodyPattern) -> tuple[tuple[Arrays, Arrays], list[ElementArrays]]:
        """Create the model, and return its arrays."""
        ready, system = self._ready(pattern), self._system
        segments, arrays, elements = segments_of(system, pattern, *ready, self._contacts, True)
        self.model = StaticModel.of(PATH, of_bodies_alone(segments), system.initial()[0])
        return arrays, elements

    def _renew(self, pattern: BodyPattern) -> tuple[tuple[Arrays, Arrays], list[ElementArrays]]:
        """Give the model another pattern, and return its new arrays."""
        return change_pattern(self.model.arrays.bodies, self._system, pattern, *self._ready(pattern), self._contacts)

    def _set_arrays(self, pattern: BodyPattern, arrays: tuple[Arrays, Arrays], elements: list[ElementArrays]) -> None:
        """Use these arrays, whose addresses the model has."""
        self._pattern, (self._arrays, self._resting), self._elements = pattern, arrays, elements
        own = iter(elements)
        joints = [group for group in self._system.groups if isinstance(group, BushingGroup | ElementGroup)]
        places = [arrays[0].springs.last if isinstance(group, BushingGroup) else next(own).last for group in joints]
        self._damped = [(group, last) for group, last in zip(joints, places, strict=True) if group.rate_dependent]
        self._accepted = np.zeros(0)

    def _change_pattern(self, pattern: BodyPattern) -> None:
        self._contacts.index(pattern)
        self._set_arrays(pattern, *self._renew(pattern))

    def use(self, ready: Ready) -> None:
        """Write factors to the block data of a linear solver."""
        self._ready = ready

    # memory -----------------------------------------------------------------------------------------------------------

    def _memory_of_groups(self) -> tuple[int, ...]:
        """Numbers of changes of the memory of all contact groups."""
        return tuple(arrays.group.changes for arrays in self._contacts.arrays)

    @property
    def current(self) -> bool:
        """Whether the arrays hold the present memory of contacts."""
        return self.ahead or self._loaded == self._memory_of_groups()

    def to_groups(self) -> None:
        """Give the groups the memory of the arrays, if it is newer."""
        if self.ahead:
            self.ahead = False
            self._contacts.store()
            self._loaded = self._memory_of_groups()

    def clear(self) -> None:
        """Forget the past of the broad phase and of the pattern, so that further steps depend on the memory alone."""
        self.to_groups()
        self._loaded, self._accepted = None, np.zeros(0)
        self._contacts.forget()
        if self._pattern is not self._first_pattern:
            self._change_pattern(self._first_pattern)

    # steps ------------------------------------------------------------------------------------------------------------

    @property
    def lacks(self) -> bool:
        """See `fsm.solve.interface.system.StaticArrays`."""
        return self._contacts.lacks

    def prepare(self, before: PreviousState) -> None:
        """See `fsm.solve.interface.system.StaticArrays`."""
        system = self._system
        if self.lacks:
            self._change_pattern(_shared(system.compiled_pattern(self._contacts.pairs())))
        self._use_factors()
        if not self.current:
            self._contacts.load(False)
            self._loaded, self._accepted = self._memory_of_groups(), np.zeros(0)
        if before[1] is not self._accepted:
            poses, rates = system.place(*before, None)
            for group, place in self._damped:
                place[:] = group.deformations_before(rates, PreviousPoses(poses, 1.0))
            self._accepted = before[1]

    def _use_factors(self) -> None:
        """Give the model the present factors of the linear solver."""
        _, factors = self._ready(self._pattern)
        if factors is not self._arrays.factors:
            self._arrays = self._arrays._replace(factors=factors)
            self.model.arrays.bodies.table[FACTORS] = address_table([factors])[0]

    def _matrix(self) -> tuple[BlockPattern, np.ndarray]:
        """Pattern and block data of the last matrix."""
        return self._pattern, self._arrays.matrix

    def begin(self, t: float, before: PreviousState, efforts: np.ndarray, most: float) -> None:
        """See `fsm.solve.interface.system.StaticArrays`."""
        self.prepare(before)
        last = np.ascontiguousarray(before[1], dtype=float)
        values = self.model, float(t), float(before[0]), last, efforts, bool(self._system.rate_dependent), float(most)
        enter(self.model.calls.begin, begin_step, *values)

    def end(self) -> tuple[np.ndarray, BlockMatrix, bool, bool]:
        """See `fsm.solve.interface.system.StaticArrays`."""
        flags, (pattern, data) = self.model.arrays.flags, self._matrix()
        self._contacts.count()
        matrix = BlockMatrix(pattern, data.copy(), self._system.low_rank)
        return self._efforts(), matrix, bool(flags[SYMMETRIC]), bool(flags[TRUSTED])

    def _efforts(self) -> np.ndarray:
        """Efforts at the end of the last step."""
        return self._arrays.springs.efforts.ravel().copy()

    def followed(self, q: np.ndarray) -> None:
        """See `fsm.solve.interface.system.StaticArrays`."""
        self._contacts.count()
        self._accepted, self.ahead = q, bool(self._contacts.arrays)

    def observation(self, records: np.ndarray) -> Observation:
        """See `fsm.solve.interface.system.StaticArrays`."""
        drives, own, values, count = len(self._system.motions), records[:, row.DRIVES:], records.T, len(records)
        travel, force = own[:, :drives], own[:, drives : 2 * drives]
        pairs = own[:, 2 * drives :].reshape(count, 7, -1).swapaxes(0, 1)
        potential = {name: values[self.energies[name]] for names in self._stored_by for name in names}
        energy = Energy(
            values[row.KINETIC], potential, values[row.LOST], values[row.INPUT],
            pairs[row.PAIR_SLIDING : row.PAIR_DAMPING + 1].swapaxes(0, 1),
            values[row.KEPT_LOSS], values[row.DRIVEN], values[row.LOADS],
        )  # fmt: skip
        return Observation(DriveState(travel, force), energy, values[row.LARGEST], self._pairs(pairs))

    def _pairs(self, sums: np.ndarray) -> PairState:
        if not self._contacts.arrays:
            return mapped(self._without_contact, lambda value: np.repeat(value[None], sums.shape[1], axis=0))
        force = sums[row.PAIR_FORCE]
        slip = np.divide(sums[row.PAIR_CARRIED], force, out=np.zeros(force.shape), where=force > 0.0)
        own = sums[row.PAIR_AREA], sums[row.PAIR_FRICTION], slip, sums[row.PAIR_SLIDING], sums[row.PAIR_DAMPING]
        return PairState(force, sums[row.PAIR_GAP], *own)

    @cached_property
    def _without_contact(self) -> PairState:
        system = self._system
        return system.contacts.observe(self._at_start, len(system.pair_names))


def _shared(pattern: BodyPattern) -> BodyPattern:
    """Equal pattern of an earlier step, or this one."""
    if len(pattern.indices) > _MOST_BLOCKS:
        return pattern
    if len(_PATTERNS) >= _MOST_PATTERNS:
        _PATTERNS.clear()
    key = (pattern.size, pattern.dof.tobytes(), pattern.indptr.tobytes(), pattern.indices.tobytes())
    return _PATTERNS.setdefault(key, pattern)
