"""Arrays of contact groups for compiled steps, and the exchange of their memory with the groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fsm.interactions.shapes import ContactForces
from fsm.kernels.addresses import address_table, tables_of
from fsm.kernels.pointers import AbsentPointer, Pointer
from fsm.laws.friction import FrictionLaw
from fsm.segments.array_contacts import CONTACTS, NO_CONTACTS
from fsm.segments.array_shapes import PLANAR_SHAPES, SPATIAL_SHAPES, ShapeArrays
from fsm.segments.arrays import flat_arrays
from fsm.segments.contact_arrays import (
    BRISTLE,
    CHANGES,
    COMMITTED_AT,
    EVALUATIONS,
    FRICTION,
    INDEX,
    LACKS,
    REFERRED,
    STARTED,
    STATES,
    ContactArrays,
    ContactKernels,
    ContactParts,
    GeometryKernels,
    LawKernels,
)
from fsm.segments.contact_memory import ContactMemory
from fsm.segments.contacts import ContactGroup
from fsm.segments.overlaps import Overlaps
from fsm.segments.pattern import BodyPattern
from fsm.segments.shape_contacts import ShapeContacts
from fsm.segments.shape_tables import Units

__all__ = ["ContactModel", "has_contact_arrays"]

_MOST_SLOTS = 50000
"""Largest number of slots of all pairs of shapes; more are selected step by step."""


def has_contact_arrays(group: ContactGroup, spatial: bool) -> bool:
    """Whether a contact group has arrays: contacts of shapes, friction that does not depend on the direction."""
    geometry, friction = group.geometry, group.friction
    if not isinstance(geometry, ShapeContacts):
        return False
    if friction is not None and spatial and friction.across != 1.0:
        return False
    return geometry.all_slots <= _MOST_SLOTS


@dataclass
class _GroupArrays:
    """Arrays of one group, and the table of their addresses."""

    group: ContactGroup
    units: Units
    keys: np.ndarray
    common: ContactArrays
    own: ShapeArrays
    table: np.ndarray

    @classmethod
    def of(cls, group: ContactGroup, pattern: BodyPattern, bodies: tuple[int, int], width: int) -> _GroupArrays:
        """Create the arrays; `bodies` is the shape of the rates of all bodies, and `width` the length of a pose."""
        geometry = group.geometry
        assert isinstance(geometry, ShapeContacts)
        units, tables, slots_open, near = geometry.whole()
        count, slips, rules = len(tables.key), geometry.slips, group.impacts.rules
        friction, kit = group.friction, geometry.kit
        state = np.zeros(STATES, dtype=np.int64)
        state[FRICTION] = int(friction is not None)
        state[BRISTLE] = int(friction is not None and friction.law.bristle)
        poses = np.zeros((bodies[0], width))
        common = ContactArrays(
            state, np.array([geometry.margin, 0.0]), group.normal.params,
            np.zeros(0) if friction is None else friction.params, np.zeros(6), rules.mobility,
            rules.loose, tables.share.copy(), tables.area, tables.pair, np.zeros(count), np.zeros(count), np.zeros(count),
            np.zeros((count, slips)), np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64), poses,
            np.zeros(bodies), poses.copy(), geometry.moving, geometry.radii, *pattern.index,
        )  # fmt: skip
        number = len(units.key)
        weights = Overlaps.nothing().of(units)
        own = ShapeArrays(
            tables.points, tables.shapes, tables.edges, tables.edge_pairs, geometry.reach,
            geometry.depth_limits(tables), units.shapes, tables.point_start, tables.pair_start, tables.unit, tables.column,
            tables.weight, slots_open, near, np.zeros(number, dtype=np.int64),
            np.zeros(len(tables.points.body), dtype=np.int64), np.zeros(len(tables.edge_pairs.edges), dtype=np.int64),
            weights.known.astype(np.int64), weights.latest, weights.in_force, units.whole, units.share, kit.solids.size,
            kit.solids.offset, kit.solids.axes, kit.point_start, kit.local, kit.weight, kit.on_axis.astype(np.int64),
        )  # fmt: skip
        common, own = (_contiguous(arrays) for arrays in (common, own))
        return cls(group, units, tables.key, common, own, address_table([*common, *flat_arrays(own)]))

    def index(self, pattern: BodyPattern) -> None:
        """Use another pattern."""
        dof, indptr, indices = pattern.index
        self.common = self.common._replace(dof=dof, indptr=indptr, indices=indices)
        self.table[INDEX : INDEX + 3] = address_table(pattern.index)
        self.common.state[LACKS] = 0

    def pairs(self) -> np.ndarray:
        """Pairs (m, 2) of bodies that have been near each other."""
        return self.own.shapes.body[self.units.shapes[self.own.met == 1]]

    def load(self) -> None:
        """Copy the memory of the group to the arrays."""
        memory, arrays, state = self.group.memory(), self.common, self.common.state
        rules, floor = self.group.impacts.rules, self.group.normal.speed_floor
        arrays.resolving[:] = *rules[2:], floor, self.group.resolves
        state[REFERRED] = state[CHANGES] = state[STARTED] = 0
        for values in (arrays.onset, arrays.began, arrays.depth, arrays.deflection):
            values[:] = 0.0
        overlaps = Overlaps.nothing()
        if len(memory):
            kept, rest = ContactMemory.from_flat(memory[1:], self.group.geometry.slips)
            order = np.argsort(self.keys)
            rows = order[np.searchsorted(self.keys, kept.key, sorter=order)]
            arrays.onset[rows], arrays.began[rows], arrays.depth[rows] = kept.onset, kept.began, kept.depth
            arrays.deflection[rows] = kept.deflection
            poses, size = arrays.committed.size, arrays.rates_before.size
            arrays.committed[:] = rest[:poses].reshape(arrays.committed.shape)
            arrays.rates_before[:] = rest[poses : poses + size].reshape(arrays.rates_before.shape)
            arrays.numbers[COMMITTED_AT], state[STARTED] = memory[0], 1
            of_geometry = rest[poses + size :]
            overlaps = Overlaps.from_flat(of_geometry[1 + int(of_geometry[0]) :])
        weights, own, tables = overlaps.of(self.units), self.own, self.own
        own.known[:], own.latest[:], own.in_force[:] = weights.known, weights.latest, weights.in_force
        arrays.share[:] = tables.weight * weights.shares[tables.unit, tables.column]
        state[CHANGES] = int((weights.in_force != weights.latest).any())

    def store(self) -> None:
        """Copy the memory of the arrays to the group."""
        arrays, own, state, group = self.common, self.own, self.common.state, self.group
        group.evaluations += int(state[EVALUATIONS])
        state[EVALUATIONS] = 0
        if not state[STARTED]:
            return
        rows = np.flatnonzero(arrays.onset > 0.0)
        kept = ContactMemory(
            self.keys[rows], arrays.onset[rows], arrays.began[rows], arrays.depth[rows], arrays.deflection[rows]
        )
        weights = Overlaps(self.units.key, own.known == 1, own.latest, own.in_force)
        poses = arrays.committed.ravel()
        group.restore(
            np.concatenate([
                arrays.numbers[COMMITTED_AT:], kept.ordered().flat(), poses, arrays.rates_before.ravel(),
                [float(len(poses))], poses, weights.flat(),
            ])
        )  # fmt: skip


class ContactModel:
    """Contact groups of a system as arrays, with their kernels.

    Attributes
    ----------
    groups : (k, 2) int array, see `Segments`
    kernels, parts : `Pointer`s
    pair_energy : (2, n_pairs) array, J
        Energy that friction and damping of contact pairs have dissipated since the last `store`.
    """

    def __init__(
        self, groups: Sequence[ContactGroup], pattern: BodyPattern, bodies: tuple[int, int], spatial: bool, pairs: int
    ) -> None:
        self.arrays = [_GroupArrays.of(group, pattern, bodies, 7 if spatial else 3) for group in groups]
        self.groups = tables_of([arrays.table for arrays in self.arrays])
        self.pair_energy = np.zeros((2, pairs))
        self.parts, self.kernels = _pointers(groups, self.groups, spatial)

    def index(self, pattern: BodyPattern) -> None:
        """Use another pattern."""
        for arrays in self.arrays:
            arrays.index(pattern)

    @property
    def lacks(self) -> bool:
        """Whether the pattern lacks a pair of bodies."""
        return any(arrays.common.state[LACKS] for arrays in self.arrays)

    def pairs(self) -> list[np.ndarray]:
        """Pairs of bodies that have been near each other."""
        return [arrays.pairs() for arrays in self.arrays]

    def load(self) -> None:
        """Copy the memory of all groups to the arrays."""
        for arrays in self.arrays:
            arrays.load()

    def store(self) -> np.ndarray:
        """Copy the memory of the arrays to the groups, and return and reset `pair_energy`."""
        for arrays in self.arrays:
            arrays.store()
        energy = self.pair_energy.copy()
        self.pair_energy[:] = 0.0
        return energy


def _contiguous(arrays: Any) -> Any:
    """The same with contiguous arrays of integers and floats."""
    parts = []
    for part in arrays:
        if isinstance(part, tuple):
            parts.append(_contiguous(part))
        else:
            kind = np.int64 if part.dtype.kind in "bi" else np.float64
            parts.append(np.ascontiguousarray(part, dtype=kind))
    return type(arrays)._make(parts)


def _pointers(
    groups: Sequence[ContactGroup], addresses: np.ndarray, spatial: bool
) -> tuple[ContactParts, ContactKernels]:
    g = np.zeros((0, 4), dtype=np.int64)
    one, two, three = np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0, 0))
    whole, pairs = np.zeros(0, dtype=np.int64), np.zeros((0, 0), dtype=np.int64)
    forces = ContactForces(one, one, one, two, three, two, True)
    arguments = GeometryKernels(
        (g, two), (g, two, 0.0), (g, two, two, whole), (g, two, whole, pairs),
        (g, two, two, whole, pairs, three, forces, three, three), (g, two), (g, two, whole, True),
    )  # fmt: skip
    results = GeometryKernels(
        0, (whole, one), (pairs, two, three), (whole, one, two, three), None, True, None
    )
    absent = GeometryKernels(*(AbsentPointer(result, *rest) for result, rest in zip(results, arguments, strict=True)))
    shapes = absent
    if groups:
        found = SPATIAL_SHAPES if spatial else PLANAR_SHAPES
        shapes = GeometryKernels(*(Pointer(kernel, *rest) for kernel, rest in zip(found, arguments, strict=True)))
    of_laws = LawKernels((one, one, one, one, one), (one, one, one), (two, one, one), (two, two, one, two, 0.0, one))
    laws = LawKernels(*(
        AbsentPointer(result, *rest)
        for result, rest in zip(((one, two), one, (two, three, two), (two, three, three, two, two)), of_laws, strict=True)
    ))  # fmt: skip
    if groups:
        normal, friction = groups[0].normal.law, groups[0].friction
        law: FrictionLaw | None = None if friction is None else friction.law
        laws = laws._replace(normal=Pointer(normal.force, *of_laws.normal), energy=Pointer(normal.energy, *of_laws.energy))
        if law is not None and law.bristle:
            laws = laws._replace(bristle=Pointer(law.effort, *of_laws.bristle))
        elif law is not None:
            laws = laws._replace(friction=Pointer(law.effort, *of_laws.friction))
    parts = ContactParts(shapes, absent, laws)
    state = g, addresses, parts, 0.0
    rest = ContactKernels(state, state, (*state, 0.0), state, state, (*state, 0.0, one))
    kernels = CONTACTS if groups else NO_CONTACTS
    return parts, ContactKernels(*(Pointer(kernel, *own) for kernel, own in zip(kernels, rest, strict=True)))
