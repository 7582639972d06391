"""Arrays of a system of bodies for quasi-static steps in kernels, and for the states at their ends."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fsm.interactions.contact.pair_sums import AREA, CARRIED, DAMPING, FORCE, FRICTION, SLIDING
from fsm.kernels.addresses import address_table
from fsm.kernels.block_equations import SYMMETRIC, TRUSTED
from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.body_poses import gather_free
from fsm.kernels.newton_euler import largest_force, motion_energy, support_reactions
from fsm.model.bodies.array_path import PATH
from fsm.model.bodies.array_statics import STATICS
from fsm.model.bodies.arrays import FACTORS, Arrays
from fsm.model.bodies.pattern import BodyPattern, body_pattern
from fsm.model.elements.element_group import ElementArrays, ElementGroup
from fsm.model.elements.elements import BushingGroup
from fsm.model.system.arrays_of import change_pattern, segments_of
from fsm.model.system.contact_arrays_of import ContactModel
from fsm.solve.interface.records import Energy, Observation, PairState, PreviousState, Ready
from fsm.solve.stepping.accuracy import ACCURATE, trial_vector
from fsm.solve.stepping.path_end import (
    CONTACT,
    CONTACT_SUMS,
    CROSSED,
    DISSIPATED,
    GRAVITY,
    JOINTS,
    LOADS,
    NEGATIVE,
    NEGATIVE_AT_REST,
    SLIDING_JOINTS,
    PathModel,
    accept_state,
    contact_force,
    end_of_step,
)
from fsm.solve.stepping.quasi_static import StaticModel

if TYPE_CHECKING:
    from fsm.model.system.force_system import SegmentForces

_PATTERNS: dict[tuple[int, bytes, bytes, bytes], BodyPattern] = {}
"""Patterns of earlier steps, also of other cases, whose eliminations are known (`fsm.solve.equations.linear`)."""
_MOST_PATTERNS, _MOST_BLOCKS = 64, 20_000
"""Number of patterns that are kept, and number of blocks of the largest."""


class _End(NamedTuple):
    """State at the end of a step, from its record; the arrays hold its forces until the next step."""

    t: float
    q: np.ndarray
    last: np.ndarray
    record: np.ndarray


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

    def __init__(self, system: SegmentForces, pattern: BodyPattern, ready: Ready) -> None:
        self._system, self._ready = system, ready
        pairs = len(system.pair_names)
        self._contacts = ContactModel(system.contacts, pattern, system.spatial, pairs, statics=True)
        segments, arrays, elements = segments_of(system, pattern, *ready(pattern), self._contacts, True)
        self.model = StaticModel.of(STATICS, segments, system.initial()[0])
        self._path = PathModel.of(PATH, segments, system.initial()[0])
        self._first_pattern = pattern
        self._stored_by = [list(group.energy(0.0, system.bodies.pose, system.at_rest)[0]) for group in system.groups]
        self._set_arrays(pattern, arrays, elements)
        self.ahead, self._accepted = False, np.zeros(0)
        self._loaded: tuple[int, ...] | None = None
        self._end: _End | None = None

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
        found = change_pattern(self.model.arrays, self._system, pattern, *self._ready(pattern), self._contacts)
        self._set_arrays(pattern, *found)

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
        self._loaded, self._accepted, self._end = None, np.zeros(0), None
        if self._pattern is not self._first_pattern:
            self._change_pattern(self._first_pattern)

    # steps ------------------------------------------------------------------------------------------------------------

    @property
    def lacks(self) -> bool:
        """See `fsm.solve.interface.system.StaticArrays`."""
        return self._contacts.lacks

    def begin(self, t: float, q: np.ndarray, before: PreviousState, efforts: np.ndarray, most: float) -> None:
        """See `fsm.solve.interface.system.StaticArrays`."""
        system, self._end = self._system, None
        if self.lacks:
            joints = [group for group in system.groups if isinstance(group, BushingGroup | ElementGroup)]
            own = [group.pairs(system.bodies.pose)[0] for group in joints]
            self._change_pattern(_shared(body_pattern(self._pattern.dof, [*own, *self._contacts.pairs()], system.size)))
        since = before if system.rate_dependent and t > before[0] else None
        poses, rates = system.place(t, q, None if since is None else np.zeros(system.nu), since)
        _, factors = self._ready(self._pattern)
        if factors is not self._arrays.factors:
            self._arrays = self._arrays._replace(factors=factors)
            self.model.arrays.table[FACTORS] = address_table([factors])[0]
        arrays = self._arrays
        arrays.poses[:], arrays.rates[:] = poses, rates
        arrays.interval[:] = t, 0.0 if since is None else t - since[0], t - before[0]
        arrays.springs.efforts.ravel()[:] = efforts
        if not self.current:
            self._contacts.load(False)
            self._loaded, self._accepted = self._memory_of_groups(), np.zeros(0)
        self._contacts.press(most)
        if since is not None and since[1] is not self._accepted:
            arrays.last_q[:] = since[1]
            for group, place in self._damped:
                place[:] = group.deformations_before(rates, system.past(t, since))

    def end(
        self, t: float, q: np.ndarray, before: PreviousState, found: bool
    ) -> tuple[np.ndarray, BlockMatrix, bool, bool, int | None]:
        """See `fsm.solve.interface.system.StaticArrays`."""
        arrays, flags = self._arrays, self.model.arrays.flags
        self._contacts.count()
        negative = None
        if found:
            record = self._record_of(t, q, before)
            negative = int(record[NEGATIVE]) if record[NEGATIVE] >= 0.0 else None
        matrix = BlockMatrix(self._pattern, arrays.matrix.copy())
        return arrays.springs.efforts.ravel().copy(), matrix, bool(flags[SYMMETRIC]), bool(flags[TRUSTED]), negative

    def _record_of(self, t: float, q: np.ndarray, before: PreviousState) -> np.ndarray:
        """Record of the state at the end of a step."""
        system, calls = self._system, self._path.calls
        if not system.rate_dependent and t > before[0]:  # no force needs rates, but the record does
            u = system.difference(before[1], q) / (t - before[0])
            self._arrays.rates[:] = system.place(t, q, u, before)[1]
        record = np.empty(CONTACT_SUMS + 7 * len(system.pair_names))
        values = self._path, q, trial_vector(system.nu), ACCURATE, bool(system.rate_dependent), record
        calls.end_of_step.entry(end_of_step, *values)(*values)
        self._end = _End(t, q, before[1], record)
        return record

    # states at the ends of steps --------------------------------------------------------------------------------------

    def _at_end(self, t: float, q: np.ndarray) -> _End | None:
        """End of the last step, if it is this state."""
        end = self._end
        return end if end is not None and end.q is q and end.t == t else None

    def crossed(self, t: float, q: np.ndarray) -> bool | None:
        """Whether sides of contacts have passed through each other; None if the last step did not end in this state."""
        end = self._at_end(t, q)
        return None if end is None else bool(end.record[CROSSED])

    def negative_at_rest(self, t: float, q: np.ndarray) -> int | None:
        """Number of negative pivots of the stiffness at rest at the end of a step, if known."""
        end = self._at_end(t, q)
        known = end is not None and self._system.rate_dependent and end.record[NEGATIVE_AT_REST] >= 0.0
        return int(end.record[NEGATIVE_AT_REST]) if end is not None and known else None

    def forces_at_rest(self, t: float, q: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Force h (nu,) and the reactions of all drives at rest at the end of a step, if known."""
        if self._at_end(t, q) is None or not self._system.rate_dependent:
            return None
        system, force = self._system, self._resting.force
        reactions = np.asarray(support_reactions(force, system.bodies.free))
        return np.asarray(gather_free(system.bodies.free, force)), system.drive_state(t, reactions).force

    def observed(self, t: float, q: np.ndarray, before: PreviousState) -> Observation | None:
        """See `System.observe`; None if the last step from `before` did not end in this state."""
        end = self._at_end(t, q)
        if end is None or before[1] is not end.last:
            return None
        system, record = self._system, end.record
        reactions = np.asarray(support_reactions(self._arrays.force, system.bodies.free))
        sums = record[CONTACT_SUMS:].reshape(7, -1)
        pair_power = sums[SLIDING : DAMPING + 1].copy()
        energies = {"panels": record[JOINTS], "creases": record[JOINTS + 1], "gravity": record[GRAVITY]}
        energies["contact"] = record[CONTACT]
        potential = {name: float(energies[name]) for names in self._stored_by for name in names}
        kinetic, driving, driven = motion_energy(system.bodies.inertia, self._arrays.rates, reactions, system.driven)
        if system.turns is not None:
            driven += system.turns.kinetic(system.bodies.inertia, self._arrays.rates)
        loads = float(record[LOADS])
        sliding = float(record[SLIDING_JOINTS]) + (float(pair_power[0].sum()) if system.bristles else 0.0)
        energy = Energy(
            kinetic, potential, float(record[DISSIPATED]), loads + driving, pair_power, sliding, driven, loads
        )
        return Observation(system.drive_state(t, reactions), energy, largest_force(reactions), self._pairs(sums))

    def _pairs(self, sums: np.ndarray) -> PairState:
        if not self._contacts.arrays:
            return self._without_contact
        force = sums[FORCE].copy()
        slip = np.divide(sums[CARRIED], force, out=np.zeros(len(force)), where=force > 0.0)
        area, friction, lost, damping = (sums[row].copy() for row in (AREA, FRICTION, SLIDING, DAMPING))
        return PairState(force, sums[-1].copy(), area, friction, slip, lost, damping)

    @cached_property
    def _without_contact(self) -> PairState:
        system = self._system
        return system.contacts.observe(0.0, system.bodies.pose, system.at_rest, None, len(system.pair_names))

    def accept(self, t: float, q: np.ndarray, before: PreviousState) -> bool:
        """Accept the state at the end of a step; false if the last step from `before` did not end in this state."""
        end = self._at_end(t, q)
        if end is None or before[1] is not end.last:
            return False
        accept = self._path.calls.accept.entry(accept_state, self._path, q)
        accept(self._path, q)
        self._arrays.last_q[:] = q
        self._end, self._accepted, self.ahead = None, q, bool(self._contacts.arrays)
        return True

    def contact_force(self, t: float, q: np.ndarray) -> float:
        """Largest component of the forces of contacts at rest, N."""
        self._end = None
        find = self._path.calls.contact_force.entry(contact_force, self._path, t, q)
        return float(find(self._path, t, q))


def _shared(pattern: BodyPattern) -> BodyPattern:
    """Equal pattern of an earlier step, or this one."""
    if len(pattern.indices) > _MOST_BLOCKS:
        return pattern
    if len(_PATTERNS) >= _MOST_PATTERNS:
        _PATTERNS.clear()
    key = (pattern.size, pattern.dof.tobytes(), pattern.indptr.tobytes(), pattern.indices.tobytes())
    return _PATTERNS.setdefault(key, pattern)
