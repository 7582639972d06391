"""Arrays of a system for compiled steps, in time or in statics, if all its force elements have arrays.

Contact groups of a system for compiled steps: tables of their own, and the kernels of their geometries and laws.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fsm.interactions.contact.anisotropic_friction import add_turn_stiffness, stretch, stretch_efforts
from fsm.kernels.addresses import address_table, tables_of
from fsm.kernels.block_equations import equation_kernels, pattern_arrays
from fsm.kernels.block_lu import fill_in
from fsm.kernels.blocks import Elimination
from fsm.kernels.minimum_degree import few_by_minimum_degree
from fsm.kernels.pointers import AbsentPointer, Example, Pointer, pointers_to
from fsm.kernels.programs import table_of
from fsm.laws.friction import FrictionLaw
from fsm.model.bodies.arrays import GAS, Arrays, Loads, Segments, SpringKernels, Springs
from fsm.model.bodies.contact_arrays import (
    LACKS,
    ContactKernels,
    LawKernels,
)
from fsm.model.bodies.group import BodyPattern
from fsm.model.bodies.loads import GravityGroup, LoadGroup
from fsm.model.contact.array_contacts import CONTACTS
from fsm.model.contact.contacts import ContactGroup
from fsm.model.elements.element_group import ElementArrays, ElementGroup, ElementKernels
from fsm.model.elements.elements import BUSHINGS, BushingGroup
from fsm.model.elements.locked_inertia import have_loops
from fsm.model.system.array_kernels import KERNELS, WITH_TREE
from fsm.model.system.arrays import Joined, of_bodies_alone
from fsm.solve.interface.records import Ready
from fsm.solve.stepping.model import ArrayModel

if TYPE_CHECKING:
    from fsm.model.system.force_system import SegmentForces

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
    of_pairs : int
        Number of contact pairs.
    grown : bool
        Whether the pattern has changed since the start.
    """

    def __init__(
        self, groups: Sequence[ContactGroup], pattern: BodyPattern, spatial: bool, pairs: int, statics: bool = False
    ) -> None:
        self.arrays = [_Twin(group, group.twin()) for group in groups]
        self.index(pattern)
        self.groups = tables_of([twin.own.geometry.table.rows for twin in self.arrays])
        self.of_pairs, self.grown = pairs, False
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

    def store(self) -> None:
        """Copy the memory of the tables to the groups."""
        self.count()
        for group, own in self.arrays:
            memory = own.memory()
            if len(memory):
                group.restore(memory)


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
        (*state, True), (*state, True, True), (*state, 0.0), (*state, True), state, state, (*state, two),
        (addresses, two, 0.0), state[:2], (*state, True, two), (addresses, 0.0),
    )  # fmt: skip
    without = ContactKernels(None, None, 0.0, None, 0.0, 0.0, 0.0, None, False, (0.0, 0.0), None)
    named = [*zip(CONTACTS._fields, CONTACTS, rest, without, strict=True)]
    made = iter(pointers_to([(kernel, *own) for name, kernel, own, _ in named if groups and name in used]))
    return laws, ContactKernels(*(
        next(made) if groups and name in used else AbsentPointer(result, *own) for name, _, own, result in named
    ))  # fmt: skip


_NONE, _NO_PAIRS, _NO_NUMBERS = np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int64), np.zeros(0)


def arrays_of(
    system: SegmentForces, pattern: BodyPattern, ready: Ready, contacts: ContactModel
) -> tuple[ArrayModel, tuple[object, ...]]:
    """Compiled model of a system that has no part in Python, and its arrays; the caller must keep the arrays as long as the
    model.
    """
    model, *arrays = segments_of(system, pattern, *ready(pattern), contacts)
    kernels = WITH_TREE if len(system.tree.links) else KERNELS
    return ArrayModel.of(kernels, of_bodies_alone(model), *system.initial()), tuple(arrays)


def segments_of(
    system: SegmentForces,
    pattern: BodyPattern,
    known: Elimination,
    factors: np.ndarray,
    contacts: ContactModel,
    statics: bool = False,
) -> tuple[Segments, tuple[Arrays, Arrays], list[ElementArrays]]:
    """Model of all bodies for time steps or for statics, its arrays, and those of groups of elements; see `arrays_of`.

    `known` is the symbolic factorisation of the pattern, and `factors` contains the data of the factors.
    """
    arrays, rest, elements = _arrays(system, pattern, known, factors, contacts.of_pairs)
    table, springs = address_table(arrays.flat), arrays.springs
    of_springs = BUSHINGS[system.size].in_one_pass
    own, (poses, rates) = (springs.bodies, springs.constants), (arrays.poses, arrays.rates)
    before, sums = (*own, springs.last, 0.0), (arrays.force, arrays.stiffness, arrays.damping)
    of_statics = (
        (of_springs.advance, springs.last, (poses, rates, *before)),
        (of_springs.widest, (0, 0.0), (poses, *own, springs.structural)),
    )
    wanted: list[tuple[Any, ...]] = [
        (of_springs.force, poses, rates, *before, arrays.force),
        (of_springs.tangent, poses, rates, *before, springs.last[:0], springs.slots, *sums),
        (of_springs.stored, poses, rates, *before, springs.category, 1),
        (of_springs.deformations, poses, rates, *own),
        *((one, *values) for one, _, values in of_statics if statics),
    ]
    absent = [] if statics else [AbsentPointer(result, *values) for _, result, values in of_statics]
    model = Segments(
        table, address_table(rest.flat), np.zeros(3, dtype=np.int64), contacts.groups,
        *_addresses(elements), SpringKernels(*pointers_to(wanted), *absent),
        contacts.kernels, contacts.laws,
        equation_kernels(arrays.pattern, arrays.matrix, factors, np.zeros(system.nu), system.low_rank_table()),
    )  # fmt: skip
    return model, (arrays, rest), elements


def locked_of(system: SegmentForces, pattern: BodyPattern) -> tuple[Joined, tuple[Arrays, Arrays], list[ElementArrays]]:
    """Model of a system whose groups all have locked directions, for the kernels of `fsm.model.system.array_locked`, and its
    arrays; see `segments_of`.
    """
    order = few_by_minimum_degree(pattern.indptr, pattern.indices)
    known = Elimination(order, *fill_in(pattern.indptr, pattern.indices, order))
    factors = np.zeros(known.factors(pattern.size))
    arrays, rest, elements = _arrays(system, pattern, known, factors, 0)
    absent: Any = None  # no springs and no contacts
    model = Segments(
        address_table(arrays.flat), address_table(rest.flat), np.zeros(3, dtype=np.int64), _NO_PAIRS, *_addresses(elements),
        SpringKernels(*[None] * 6), absent, absent,
        equation_kernels(arrays.pattern, arrays.matrix, factors, np.zeros(system.nu)),
    )  # fmt: skip
    return of_bodies_alone(model), (arrays, rest), elements


def change_pattern(
    model: Segments, system: SegmentForces, pattern: BodyPattern, known: Elimination, factors: np.ndarray,
    contacts: ContactModel,
) -> tuple[tuple[Arrays, Arrays], list[ElementArrays]]:  # fmt: skip
    """Give a model of statics the arrays of another pattern; arguments and results as in `segments_of`."""
    arrays, rest, elements = _arrays(system, pattern, known, factors, contacts.of_pairs)
    model.table[:], model.at_rest[:] = address_table(arrays.flat), address_table(rest.flat)
    for own, one in zip(model.element_tables, elements, strict=True):
        own[: len(one.arrays)] = address_table(one.arrays)
    return (arrays, rest), elements


def _arrays(
    system: SegmentForces, pattern: BodyPattern, known: Elimination, factors: np.ndarray, pairs: int
) -> tuple[Arrays, Arrays, list[ElementArrays]]:  # fmt: skip
    """Arrays of all bodies, those for tangents at zero rates, and those of groups of elements."""
    bodies, spatial = system.bodies, system.spatial
    weight = np.zeros((len(bodies.pose), 3 if spatial else 2))
    springs, loads = _springs(None, _NONE, pattern, system.size), _loads(None, pattern, spatial)
    if sum(isinstance(group, BushingGroup) for group in system.groups) > 1:
        raise ValueError("groups of springs must be merged (`fsm.model.system.merge.merged`)")
    for group in system.groups:
        if isinstance(group, GravityGroup):
            weight = group.mass[:, None] * group.acceleration
        elif isinstance(group, BushingGroup):
            sometimes = any(group is other for other, _ in system.steps_of)
            springs = _springs(group, (0 if sometimes else 1) * group.in_structure, pattern, system.size)
        elif isinstance(group, LoadGroup):
            loads = _loads(group, pattern, spatial)
        elif not isinstance(group, ElementGroup | ContactGroup):
            raise TypeError(f"{type(group).__name__} has no arrays")
    elements = [group.compiled(pattern) for group in system.groups if isinstance(group, ElementGroup)]
    of_pattern, (q, _) = pattern_arrays(pattern, known), system.initial()
    poses, rates, force = bodies.pose.copy(), np.zeros(bodies.rate.shape), np.zeros(bodies.rate.shape)
    stiffness, damping, matrix = pattern.zeros(), pattern.zeros(), pattern.zeros()
    turned, kept = np.zeros((system.n_free if spatial else 0, 6, 6)), pattern.zeros()
    arrays = Arrays(
        bodies.free, bodies.inertia[bodies.free].ravel(), bodies.inertia, weight, poses, rates, force, stiffness, damping,
        matrix, factors, turned, system.scales().force_scale, np.zeros(pairs), kept, kept.copy(),
        q[: system.n_free * bodies.pose.shape[1]].copy(), _interval(system, pattern),
        pattern.dof, np.zeros(GAS + 1), of_pattern, springs, loads,
        system.driven_arrays(), system.tree,
    )  # fmt: skip
    rest = arrays._replace(
        rates=np.zeros(rates.shape), force=np.zeros(rates.shape), stiffness=pattern.zeros(), damping=pattern.zeros(),
        matrix=pattern.zeros(), factors=np.zeros(factors.shape),
    )  # fmt: skip
    return arrays, rest, elements


def _interval(system: SegmentForces, pattern: BodyPattern) -> np.ndarray:
    """See `Arrays`."""
    per_moment = 1.0 / system.arm if system.locking else 0.0
    loops, feels = have_loops(system.locking, pattern.dof), system.feels_reactions
    return np.array([0.0, 0.0, 0.0, 0.0, _pace(system), per_moment, float(loops), float(feels), 0.0])


def _pace(system: SegmentForces) -> float:
    """See `Arrays.interval`."""
    program = system.motions[0].program if system.motions else None
    return 1e-6 * program.speed if program is not None and program.forward else 0.0


def _addresses(elements: list[ElementArrays]) -> tuple[np.ndarray, np.ndarray]:
    """Addresses (m, 13) of the kernels of all groups of elements, and their tables (m, n, 4)."""
    kernels = np.zeros((len(elements), len(ElementKernels._fields)), dtype=np.int64)
    tables = np.zeros((len(elements), max((len(one.arrays) for one in elements), default=0), 4), dtype=np.int64)
    for row, own, one in zip(kernels, tables, elements, strict=True):
        own[: len(one.arrays)] = address_table(one.arrays)
        row[:] = one.kernels.addresses()
    return kernels, tables


def _springs(group: BushingGroup | None, structural: np.ndarray, pattern: BodyPattern, size: int) -> Springs:
    if group is None:
        slots = np.zeros((0, 4), dtype=np.int64)
        none = np.zeros((0, size))
        return Springs(_NO_PAIRS, np.zeros((0, 1)), slots, _NONE, _NO_NUMBERS, _NONE, none, none)
    empty = np.zeros(group.rest.shape)
    return Springs(*group.arrays(pattern), group.category, group.in_panels, structural, empty, empty.copy())


def _loads(group: LoadGroup | None, pattern: BodyPattern, spatial: bool) -> Loads:
    if group is None:
        vectors = np.zeros((0, 3 if spatial else 2))
        return Loads(_NONE, vectors, vectors, np.zeros((0, 3 if spatial else 1)), _NONE, _NONE, table_of([]))
    return Loads(*group.arrays, group.slots(pattern), table_of([load.time for load in group.loads]))
