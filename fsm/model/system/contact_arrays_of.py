"""Contact groups of a system for compiled steps: tables of their own, and the kernels of their geometries and laws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.contact.anisotropic_friction import add_turn_stiffness, stretch, stretch_efforts
from fsm.kernels.addresses import tables_of
from fsm.kernels.pointers import AbsentPointer, Example, Pointer, pointers_to
from fsm.laws.friction import FrictionLaw
from fsm.model.bodies.contact_arrays import (
    LACKS,
    ContactKernels,
    LawKernels,
)
from fsm.model.bodies.pattern import BodyPattern
from fsm.model.contact.array_contacts import CONTACTS
from fsm.model.contact.contacts import ContactGroup

_IN_STATICS = frozenset({"force", "tangent", "accept", "advance", "passed", "sums", "press"})
_IN_MOTION = frozenset({"force", "tangent", "part_of_step", "accept", "longest_step", "stored", "losses"})
"""Kernels of `ContactKernels` that quasi-static steps call, and those that steps in time call."""


class _Twin(NamedTuple):
    """A group, and its copy for compiled steps."""

    group: ContactGroup
    own: ContactGroup


class ContactModel:
    """Contact groups of a system as tables, with their kernels.

    Attributes
    ----------
    arrays : groups and their copies
    groups : (k, 2) int array, see `Segments`
    kernels, laws : `Pointer`s
    pair_energy : (2, n_pairs) array, J
        Energy that friction and damping of contact pairs have dissipated since the last `store`.
    grown : bool
        Whether the pattern has changed since the start.
    """

    def __init__(
        self, groups: Sequence[ContactGroup], pattern: BodyPattern, spatial: bool, pairs: int, statics: bool = False
    ) -> None:
        self.arrays = [_Twin(group, group.twin()) for group in groups]
        self.index(pattern)
        self.groups = tables_of([twin.own.geometry.table.rows for twin in self.arrays])
        self.pair_energy, self.grown = np.zeros((2, pairs)), False
        self.laws, self.kernels = _pointers(groups, self.groups, spatial, _IN_STATICS if statics else _IN_MOTION)

    def index(self, pattern: BodyPattern) -> None:
        """Replace the pattern, and make room for all slots; the next renewal finds the pairs of bodies again."""
        self.grown = True
        for _, own in self.arrays:
            own.geometry.index(pattern)

    @property
    def lacks(self) -> bool:
        """Whether the pattern lacks a pair of bodies."""
        return any(own.geometry.common.state[LACKS] for _, own in self.arrays)

    def pairs(self) -> list[np.ndarray]:
        """Pairs of bodies that have been near each other."""
        return [own.geometry.coupled_ahead() for _, own in self.arrays]

    def load(self, resolve: bool) -> None:
        """Copy the memory of all groups to the tables. If `resolve` is true, steps must resolve impacts."""
        for group, own in self.arrays:
            own.follow(group, resolve)

    def forget(self) -> None:
        """Forget earlier searches and patterns."""
        for _, own in self.arrays:
            own.geometry.clear_caches()

    def count(self) -> None:
        """Add the numbers of evaluated states to those of the groups."""
        for group, own in self.arrays:
            group.count(own)

    def store(self) -> np.ndarray:
        """Copy the memory of the tables to the groups, and return and reset `pair_energy`."""
        self.count()
        for group, own in self.arrays:
            memory = own.memory()
            if len(memory):
                group.restore(memory)
        energy = self.pair_energy.copy()
        self.pair_energy[:] = 0.0
        return energy


def _pointers(
    groups: Sequence[ContactGroup], addresses: np.ndarray, spatial: bool, used: frozenset[str]
) -> tuple[LawKernels, ContactKernels]:
    """Pointers to the kernels of laws and contacts; kernels whose names are not among the used ones, or which no
    group needs, are absent.
    """
    one, two, three, whole = np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0, 0)), np.zeros(0, dtype=np.int64)
    pairs = np.zeros((0, 2), dtype=np.int64)
    of_laws = LawKernels(
        (one, one, one, one, one), (one, one, one), (two, one, one), (two, two, one, two, 0.0, one), (two, two, pairs, 0.0),
        (two, pairs, 0.0, two, two, two, three, three, two, three), (pairs, three, three, whole, whole, whole, three),
    )  # fmt: skip
    of_results = (one, two), one, (two, three, two), (two, three, three, two, two), None, None, None
    found: dict[str, Any] = {}
    if groups:
        normal, friction = groups[0].normal.law, groups[0].friction
        law: FrictionLaw | None = None if friction is None else friction.law
        found = {"normal": normal.force, "energy": normal.energy}
        if law is not None:
            found["bristle" if law.bristle else "friction"] = law.effort
        if friction is not None and spatial and friction.across != 1.0:
            found |= {"stretch": stretch, "stretch_efforts": stretch_efforts, "add_turn_stiffness": add_turn_stiffness}
    laws = LawKernels(*(
        Pointer(found[name], *rest) if name in found else AbsentPointer(result, *rest)
        for name, rest, result in zip(LawKernels._fields, of_laws, of_results, strict=True)
    ))  # fmt: skip
    state = np.zeros((0, 4), dtype=np.int64), addresses, Example(laws), 0.0
    rest = ContactKernels(
        (*state, True), (*state, True, True), (*state, 0.0), (*state, True), state, (*state, 0.0, one), (*state, two),
        (addresses, two, 0.0), state[:2], (*state, True, two), (addresses, 0.0),
    )  # fmt: skip
    without = ContactKernels(None, None, 0.0, None, 0.0, (0.0, 0.0), 0.0, None, False, (0.0, 0.0), None)
    named = [*zip(CONTACTS._fields, CONTACTS, rest, without, strict=True)]
    made = iter(pointers_to([(kernel, *own) for name, kernel, own, _ in named if groups and name in used]))
    return laws, ContactKernels(*(
        next(made) if groups and name in used else AbsentPointer(result, *own) for name, _, own, result in named
    ))  # fmt: skip
