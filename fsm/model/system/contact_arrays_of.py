"""Arrays of contact groups for compiled steps, and copies of the memory between arrays and groups."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from fsm.interactions.search.contact_body_pairs import coupled_bodies
from fsm.kernels.addresses import tables_of
from fsm.kernels.pointers import AbsentPointer, Pointer
from fsm.kernels.tables import Table, TableExample, named_table
from fsm.laws.friction import FrictionLaw
from fsm.model.bodies.contact_arrays import (
    BELOW,
    BRISTLE,
    CHANGES,
    COMMITTED_AT,
    EVALUATIONS,
    FOUND,
    FRICTION,
    KIND,
    LACKS,
    LOSSY,
    REFERRED,
    SHEETS,
    STARTED,
    STATES,
    SURFACES,
    ContactArrays,
    ContactKernels,
    ContactParts,
    GeometryKernels,
    LawKernels,
)
from fsm.model.bodies.pattern import BodyPattern
from fsm.model.contact.array_contacts import CONTACTS
from fsm.model.contact.contact_memory import ContactMemory
from fsm.model.contact.contacts import ContactGroup
from fsm.model.contact.shapes.array_shape_tables import ShapeArrays
from fsm.model.contact.shapes.array_shapes import PLANAR_SHAPES, SPATIAL_SHAPES
from fsm.model.contact.shapes.overlaps import Overlaps
from fsm.model.contact.shapes.shape_contacts import ShapeContacts
from fsm.model.contact.sheets.array_sheet_tables import KEPT, SheetArrays
from fsm.model.contact.sheets.array_sheets import SHEETS as SHEET_KERNELS
from fsm.model.contact.sheets.sheet_contacts import SheetContacts
from fsm.model.contact.sheets.sheet_tables import bodies_of_slots, is_full, own_memory, roomier, set_sides
from fsm.model.contact.surfaces.array_surfaces import PLANAR_SURFACES, SPATIAL_SURFACES, TAPERS, SurfaceArrays
from fsm.model.contact.surfaces.surface_contacts import SurfaceContacts

_AHEAD = 2
"""Number of further pieces, beyond the near ones, that the pattern couples with a probe. The pattern then remains valid
while the probe slides."""


_IN_STATICS = frozenset({"force", "tangent", "accept", "advance", "passed", "sums", "press"})
_IN_MOTION = frozenset({"force", "tangent", "part_of_step", "accept", "longest_step", "stored", "losses"})
"""Kernels of `ContactKernels` that quasi-static steps call, and those that steps in time call."""


class _GroupArrays(ABC):
    """Arrays of one group, and the table of their addresses.

    Parameters
    ----------
    group : ContactGroup
    keys : keys of all slots
    slots : share, area and pair of all slots
    moving : bodies whose motion requires an update of the broad phase, and their radii
    pattern : BodyPattern
    bodies, width : shape of the array of rates of all bodies, and length of a pose
    """

    def __init__(
        self, group: ContactGroup, keys: np.ndarray, slots: tuple[np.ndarray, np.ndarray, np.ndarray],
        moving: tuple[np.ndarray, np.ndarray], pattern: BodyPattern, bodies: tuple[int, int], width: int,
    ) -> None:  # fmt: skip
        geometry, count, rules, friction = group.geometry, len(keys), group.impacts.rules, group.friction
        state = np.zeros(STATES, dtype=np.int64)
        state[FRICTION] = int(friction is not None)
        state[BRISTLE] = int(friction is not None and friction.law.bristle)
        state[LOSSY] = int(group.rate_dependent)
        poses, none = np.zeros((bodies[0], width)), np.zeros(count, dtype=np.int64)
        self.group, self.keys = group, keys
        self.common: ContactArrays = _contiguous(
            ContactArrays(
                state, np.array([geometry.margin, 0.0, 0.0, 0.0]), group.normal.params,
                np.zeros(0) if friction is None else friction.params, np.zeros(6), rules.mobility, rules.loose, *slots,
                np.zeros(count), np.zeros(count), np.zeros(count), np.zeros((count, geometry.slips)), none, none.copy(),
                poses, np.zeros(bodies), poses.copy(), *moving, *pattern.index,
                *_found(count, geometry.slips, self.coupled_bodies, bodies[1], poses.copy(), np.zeros(bodies)),
            )
        )  # fmt: skip

    coupled_bodies: ClassVar[int]
    """Number of bodies of a contact."""
    own: Any
    """Arrays of the geometry."""

    def _set_table(self, own: Any) -> Any:
        """Contiguous arrays of the geometry; sets the table."""
        own = _contiguous(own)
        self.table = named_table(self.common, own)
        return own

    def index(self, pattern: BodyPattern) -> None:
        """Replace the pattern."""
        dof, indptr, indices = pattern.index
        self.common = self.common._replace(dof=dof, indptr=indptr, indices=indices)
        self.table[:] = named_table(self.common, self.own)
        self.common.state[LACKS] = 0

    @abstractmethod
    def pairs(self) -> np.ndarray:
        """Pairs (m, 2) of bodies for which the pattern needs blocks."""

    @abstractmethod
    def load_own(self, memory: np.ndarray) -> None:
        """Copy the memory of the geometry to the arrays; an empty memory gives the initial one."""

    @abstractmethod
    def own_memory(self) -> np.ndarray:
        """Memory of the geometry, from the arrays."""

    def load(self, resolve: bool) -> None:
        """Copy the history variables of the group to the arrays. If `resolve` is true, steps must resolve impacts."""
        memory, arrays, state = self.group.memory(), self.common, self.common.state
        rules, floor = self.group.impacts.rules, self.group.normal.speed_floor
        arrays.resolving[:] = *rules[2:], floor, resolve and self.group.resolves
        state[REFERRED] = state[CHANGES] = state[STARTED] = 0
        state[FOUND] = -1
        for values in (arrays.onset, arrays.began, arrays.depth, arrays.deflection):
            values[:] = 0.0
        if not len(memory):
            self.load_contacts(ContactMemory.nothing(self.group.geometry.slips))
            self.load_own(self.group.geometry.memory())
            return
        kept, rest = ContactMemory.from_flat(memory[1:], self.group.geometry.slips)
        self.load_contacts(kept)
        poses, size = arrays.committed.size, arrays.rates_before.size
        arrays.committed[:] = rest[:poses].reshape(arrays.committed.shape)
        arrays.rates_before[:] = rest[poses : poses + size].reshape(arrays.rates_before.shape)
        arrays.numbers[COMMITTED_AT], state[STARTED] = memory[0], 1
        self.load_own(rest[poses + size :])

    def load_contacts(self, kept: ContactMemory) -> None:
        """Copy the memory of contacts to the arrays, whose memory is zero."""
        order, arrays = np.argsort(self.keys), self.common
        rows = order[np.searchsorted(self.keys, kept.key, sorter=order)]
        arrays.onset[rows], arrays.began[rows], arrays.depth[rows] = kept.onset, kept.began, kept.depth
        arrays.deflection[rows] = kept.deflection

    def contacts(self) -> ContactMemory:
        """Memory of contacts, from the arrays."""
        arrays = self.common
        rows = np.flatnonzero(arrays.onset > 0.0)
        return ContactMemory(
            self.keys[rows], arrays.onset[rows], arrays.began[rows], arrays.depth[rows], arrays.deflection[rows]
        ).ordered()

    def count(self) -> None:
        """Add the number of evaluated states to that of the group."""
        self.group.evaluations += int(self.common.state[EVALUATIONS])
        self.common.state[EVALUATIONS] = 0

    def store(self) -> None:
        """Copy the memory of the arrays to the group."""
        arrays, state, group = self.common, self.common.state, self.group
        self.count()
        if not state[STARTED]:
            return
        group.restore(
            np.concatenate([
                arrays.numbers[COMMITTED_AT:BELOW], self.contacts().flat(), arrays.committed.ravel(),
                arrays.rates_before.ravel(), self.own_memory(),
            ])
        )  # fmt: skip


class _ShapeGroup(_GroupArrays):
    """Arrays of contacts of shapes."""

    coupled_bodies = 2

    def __init__(
        self, group: ContactGroup, geometry: ShapeContacts, pattern: BodyPattern, bodies: tuple[int, int], width: int
    ) -> None:
        units, tables, slots_open, near = geometry.whole()
        slots, kit, number = (tables.share.copy(), tables.area, tables.pair), geometry.kit, len(units.key)
        super().__init__(group, tables.key, slots, (geometry.moving, geometry.radii), pattern, bodies, width)
        self.units, weights = units, Overlaps.nothing().of(units)
        own = ShapeArrays(
            *tables.points, *tables.shapes, *tables.edges, *tables.edge_pairs, geometry.reach,
            geometry.depth_limits(tables), units.shapes, tables.point_start, tables.pair_start, tables.unit, tables.column,
            tables.weight, slots_open, near, np.zeros(number, dtype=np.int64),
            np.zeros(len(tables.points.body), dtype=np.int64), np.zeros(len(tables.edge_pairs.edges), dtype=np.int64),
            weights.known.astype(np.int64), weights.latest, weights.in_force, units.whole, units.share, kit.solids.size,
            kit.solids.offset, kit.solids.axes, kit.point_start, kit.local, kit.weight, kit.on_axis.astype(np.int64),
        )  # fmt: skip
        self.own: ShapeArrays = self._set_table(own)

    def index(self, pattern: BodyPattern) -> None:
        """Replace the pattern; the next update of the broad phase finds the blocks of the pairs of bodies again."""
        super().index(pattern)
        self.own.met[:] = 0
        self.common.state[REFERRED] = 0

    def pairs(self) -> np.ndarray:
        """Pairs (m, 2) of bodies that have been near each other."""
        return self.own.shape_body[self.units.shapes[self.own.met == 1]]

    def load_own(self, memory: np.ndarray) -> None:
        """See `_GroupArrays`: the memory consists of weights of faces; the committed poses come from the group."""
        overlaps = Overlaps.from_flat(memory[1 + int(memory[0]) :]) if len(memory) else Overlaps.nothing()
        weights, own, arrays = overlaps.of(self.units), self.own, self.common
        own.known[:], own.latest[:], own.in_force[:] = weights.known, weights.latest, weights.in_force
        arrays.share[:] = own.weight * weights.shares[own.unit, own.column]
        arrays.state[CHANGES] = int((weights.in_force != weights.latest).any())

    def own_memory(self) -> np.ndarray:
        """See `_GroupArrays`."""
        own, poses = self.own, self.common.committed.ravel()
        weights = Overlaps(self.units.key, own.known == 1, own.latest, own.in_force)
        return np.concatenate([[float(len(poses))], poses, weights.flat()])


class _SurfaceGroup(_GroupArrays):
    """Arrays of contacts of panels in segments."""

    coupled_bodies = 3

    def __init__(
        self, group: ContactGroup, geometry: SurfaceContacts, pattern: BodyPattern, bodies: tuple[int, int], width: int
    ) -> None:
        probes, surfaces, corners = geometry.probes, geometry.surfaces, geometry.corners
        count, slots = len(probes.body), (geometry.share, geometry.area, geometry.pair)
        moving = surfaces.bodies, surfaces.radii
        super().__init__(group, np.arange(count), slots, moving, pattern, bodies, width)
        self.common.state[KIND], self.common.state[TAPERS] = SURFACES, int(geometry.tapers)
        half_width = surfaces.extra[0] if surfaces.extra else np.zeros(0)
        whole, none = np.full(count, -1, dtype=np.int64), np.zeros(count)
        self.coupled = np.zeros((0, 2), dtype=np.int64)
        self.own: SurfaceArrays = self._set_table(
            SurfaceArrays(
                probes.body, probes.place, probes.straight, probes.inset, probes.clearance, probes.depth_limit, probes.cell,
                probes.first_piece, probes.last_piece, geometry.side.copy(), surfaces.owners, surfaces.stations, half_width,
                geometry.no_share, geometry.tips, geometry.reach, corners.twin, corners.across, corners.inside,
                corners.inside_across, whole, whole.copy(), np.zeros((count, 2), dtype=np.int64), whole.copy(), none,
                np.zeros(probes.place.shape),
            )
        )  # fmt: skip

    def pairs(self) -> np.ndarray:
        """See `_GroupArrays`: the pairs are those of the present windows with some more pieces, and those of the last
        pattern.
        """
        own = self.own
        first, last = own.window.T
        near = last > first
        wider = own.window.copy()
        wider[near, 0] = np.maximum(first - _AHEAD, own.first_piece)[near]
        wider[near, 1] = np.minimum(last + _AHEAD, own.last_piece)[near]
        now = coupled_bodies(own.body, wider, own.owners, len(self.common.committed))
        found, self.coupled = np.concatenate([now, self.coupled]), now
        return found

    def load_own(self, memory: np.ndarray) -> None:
        """See `_GroupArrays`: the memory consists of the sides of all probes; the committed poses come from the group."""
        self.own.side[:] = memory[: len(self.keys)]
        self.own.nearest[:] = self.own.nearest_of_all[:] = -1

    def own_memory(self) -> np.ndarray:
        """See `_GroupArrays`."""
        return np.concatenate([self.own.side, self.common.committed.ravel()])


class _SheetGroup(_GroupArrays):
    """Arrays of contacts of flexible facets with each other; the slots are those of the last broad phase."""

    coupled_bodies = 4

    def __init__(
        self, group: ContactGroup, geometry: SheetContacts, pattern: BodyPattern, bodies: tuple[int, int], width: int
    ) -> None:
        none, moving = np.zeros(0), (geometry.mesh.body, np.zeros(len(geometry.mesh.body)))
        super().__init__(group, none, (none, none, np.zeros(0, dtype=np.int64)), moving, pattern, bodies, width)
        self.common.state[KIND] = SHEETS
        self.coupled = np.zeros((0, 2), dtype=np.int64)
        self.own: SheetArrays = geometry.mesh._replace(counts=geometry.mesh.counts.copy())
        self.own_table = Table(self.common, self.own)
        self.table = self.own_table.rows

    def _set(self, common: ContactArrays, own: SheetArrays) -> None:
        self.common, self.own = common, own
        self.own_table.replace(common, own)

    def index(self, pattern: BodyPattern) -> None:
        """Replace the pattern, and make room for all slots; the next update of the broad phase finds the pairs again."""
        super().index(pattern)
        if is_full(self.own):
            self._set(*roomier(self.common, self.own))
        self.common.state[REFERRED], self.common.state[FOUND] = 0, -1

    def pairs(self) -> np.ndarray:
        """See `_GroupArrays`: the pairs of the present slots, and those of the last pattern."""
        now = bodies_of_slots(self.own)
        found, self.coupled = np.concatenate([now, self.coupled]), now
        return found

    def load_contacts(self, kept: ContactMemory) -> None:
        """See `_GroupArrays`; an update of the broad phase copies the memory to the slots."""
        if len(kept.key) > len(self.own.key):
            self._set(*roomier(self.common, self.own, len(kept.key)))
        own, count = self.own, len(kept.key)
        own.counts[KEPT], own.kept_key[:count] = count, kept.key
        own.kept[:count] = np.column_stack([kept.onset, kept.began, kept.depth, kept.deflection])

    def contacts(self) -> ContactMemory:
        """See `_GroupArrays`."""
        count = self.own.counts[KEPT]
        onset, began, depth = self.own.kept[:count, :3].T
        return ContactMemory(self.own.kept_key[:count], onset, began, depth, self.own.kept[:count, 3:])

    def load_own(self, memory: np.ndarray) -> None:
        """See `_GroupArrays`: the memory consists of positions and of sides; the committed poses come from the group."""
        self._set(*set_sides(self.common, self.own, memory[3 * len(self.own.body) :]))

    def own_memory(self) -> np.ndarray:
        """See `_GroupArrays`."""
        return own_memory(self.common, self.own)


def _arrays_of(group: ContactGroup, pattern: BodyPattern, bodies: tuple[int, int], width: int) -> _GroupArrays:
    geometry = group.geometry
    if isinstance(geometry, ShapeContacts):
        return _ShapeGroup(group, geometry, pattern, bodies, width)
    if isinstance(geometry, SheetContacts):
        return _SheetGroup(group, geometry, pattern, bodies, width)
    assert isinstance(geometry, SurfaceContacts)
    return _SurfaceGroup(group, geometry, pattern, bodies, width)


class ContactModel:
    """Contact groups of a system as arrays, with their kernels.

    Attributes
    ----------
    groups : (k, 2) int array, see `Segments`
    kernels, parts : `Pointer`s
    pair_energy : (2, n_pairs) array, J
        Energy that friction and damping of contact pairs have dissipated since the last `store`.
    grown : bool
        Whether the pattern has changed since the start.
    """

    def __init__(
        self, groups: Sequence[ContactGroup], pattern: BodyPattern, bodies: tuple[int, int], spatial: bool, pairs: int,
        statics: bool = False,
    ) -> None:  # fmt: skip
        self.arrays = [_arrays_of(group, pattern, bodies, 7 if spatial else 3) for group in groups]
        self.groups = tables_of([arrays.table for arrays in self.arrays])
        self.pair_energy, self.grown = np.zeros((2, pairs)), False
        self.parts, self.kernels = _pointers(groups, self.groups, spatial, _IN_STATICS if statics else _IN_MOTION)

    def index(self, pattern: BodyPattern) -> None:
        """Replace the pattern."""
        self.grown = True
        for arrays in self.arrays:
            arrays.index(pattern)

    @property
    def lacks(self) -> bool:
        """Whether the pattern lacks a pair of bodies."""
        return any(arrays.common.state[LACKS] for arrays in self.arrays)

    def pairs(self) -> list[np.ndarray]:
        """Pairs of bodies that have been near each other."""
        return [arrays.pairs() for arrays in self.arrays]

    def load(self, resolve: bool) -> None:
        """Copy the history variables of all groups to the arrays. If `resolve` is true, steps must resolve impacts."""
        for arrays in self.arrays:
            arrays.load(resolve)

    def count(self) -> None:
        """Add the numbers of evaluated states to those of the groups."""
        for arrays in self.arrays:
            arrays.count()

    def store(self) -> np.ndarray:
        """Copy the memory of the arrays to the groups, and return and reset `pair_energy`."""
        for arrays in self.arrays:
            arrays.store()
        energy = self.pair_energy.copy()
        self.pair_energy[:] = 0.0
        return energy


def _found(count: int, slips: int, bodies: int, size: int, poses: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, ...]:
    """Arrays of `ContactArrays`, starting with `slot`, with a row for each slot; most rows are never used."""
    ways, square = (count, slips), (count, slips, slips)
    return (
        np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros((count, bodies), dtype=np.int64),
        np.zeros((count, 1 + slips)), np.zeros((count, 1 + slips, bodies * size)), np.zeros(count), np.zeros(ways),
        *(np.zeros(count) for _ in range(6)), np.zeros(ways), np.zeros(square), np.zeros(ways), np.zeros(ways),
        np.zeros(square), np.zeros(count), np.zeros(count), np.zeros(count), poses, rates,
    )  # fmt: skip


def _contiguous(arrays: Any) -> Any:
    """Copy of a tuple of arrays with contiguous arrays of integers and floats."""
    kinds = (np.int64 if part.dtype.kind in "bi" else np.float64 for part in arrays)
    return type(arrays)._make(np.ascontiguousarray(part, dtype=kind) for part, kind in zip(arrays, kinds, strict=True))


def _pointers(
    groups: Sequence[ContactGroup], addresses: np.ndarray, spatial: bool, used: frozenset[str]
) -> tuple[ContactParts, ContactKernels]:
    """Pointers to the kernels of geometries, laws and contacts; kernels whose names are not among the used ones, or which no
    group needs, are absent.
    """
    g = TableExample(ContactArrays)
    one, two, three = np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0, 0))
    whole = np.zeros(0, dtype=np.int64)
    arguments = GeometryKernels(
        (g, two), (g, two, 0.0), (g, two, two, 0), (g, whole), (g, two, 0), (g, two, two, 0, three, three), (g, two),
        (g, two, whole, True),
    )  # fmt: skip
    results = GeometryKernels(0, 0, None, None, (whole, one, two, three), None, True, None)
    absent = GeometryKernels(*(AbsentPointer(result, *rest) for result, rest in zip(results, arguments, strict=True)))
    kinds = []
    for kind, found in (
        (ShapeContacts, SPATIAL_SHAPES if spatial else PLANAR_SHAPES),
        (SurfaceContacts, SPATIAL_SURFACES if spatial else PLANAR_SURFACES),
        (SheetContacts, SHEET_KERNELS),
    ):
        has_any = any(isinstance(group.geometry, kind) for group in groups)
        rows = zip(found, arguments, absent, strict=True)
        kinds.append(GeometryKernels(*(Pointer(kernel, *rest) if has_any else nothing for kernel, rest, nothing in rows)))
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
    shapes, surfaces, sheets = kinds
    parts = ContactParts(shapes, surfaces, sheets, laws)
    state = np.zeros((0, 4), dtype=np.int64), addresses, parts, 0.0
    rest = ContactKernels(
        (*state, True),
        (*state, True, True),
        (*state, 0.0),
        (*state, True),
        state,
        (*state, 0.0, one),
        (*state, two),
        (addresses, two, 0.0),
        state[:3],
        (*state, True, two),
        (addresses, parts, 0.0),
    )
    without = ContactKernels(None, None, 0.0, None, 0.0, (0.0, 0.0), 0.0, None, False, (0.0, 0.0), None)
    return parts, ContactKernels(*(
        Pointer(kernel, *own) if groups and name in used else AbsentPointer(result, *own)
        for name, kernel, own, result in zip(CONTACTS._fields, CONTACTS, rest, without, strict=True)
    ))  # fmt: skip
