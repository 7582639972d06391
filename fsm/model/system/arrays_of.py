"""Arrays of a system for compiled steps, in time or in statics, if all its force elements have arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fsm.kernels.addresses import address_table
from fsm.kernels.block_equations import equation_kernels, pattern_arrays
from fsm.kernels.block_lu import fill_in
from fsm.kernels.blocks import Elimination
from fsm.kernels.minimum_degree import few_by_minimum_degree
from fsm.kernels.pointers import AbsentPointer, pointers_to
from fsm.kernels.programs import table_of
from fsm.model.bodies.array_kernels import KERNELS, WITHOUT_TREE
from fsm.model.bodies.arrays import GAS, Arrays, Loads, Segments, SpringKernels, Springs
from fsm.model.bodies.loads import GravityGroup, LoadGroup
from fsm.model.bodies.pattern import BodyPattern
from fsm.model.contact.contacts import ContactGroup
from fsm.model.elements.element_group import ElementArrays, ElementGroup, ElementKernels
from fsm.model.elements.elements import BUSHINGS, BushingGroup
from fsm.model.elements.locked_inertia import have_loops
from fsm.model.system.contact_arrays_of import ContactModel
from fsm.solve.interface.records import Ready
from fsm.solve.stepping.model import ArrayModel

if TYPE_CHECKING:
    from fsm.model.system.force_system import SegmentForces

_NONE, _NO_PAIRS, _NO_NUMBERS = np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int64), np.zeros(0)


def arrays_of(
    system: SegmentForces, pattern: BodyPattern, ready: Ready, contacts: ContactModel
) -> tuple[ArrayModel, tuple[object, ...]]:
    """Compiled model of a system that has no part in Python, and its arrays; the caller must keep the arrays as long as the
    model.
    """
    model, *arrays = segments_of(system, pattern, *ready(pattern), contacts)
    kernels = KERNELS if len(system.tree.links) else WITHOUT_TREE
    return ArrayModel.of(kernels, model, *system.initial()), tuple(arrays)


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
    arrays, rest, elements = _arrays(system, pattern, known, factors, contacts.pair_energy)
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


def locked_of(system: SegmentForces, pattern: BodyPattern) -> tuple[Segments, tuple[Arrays, Arrays], list[ElementArrays]]:
    """Model of a system whose groups all have locked directions, for the kernels of `fsm.model.bodies.array_locked`, and its
    arrays; see `segments_of`.
    """
    order = few_by_minimum_degree(pattern.indptr, pattern.indices)
    known = Elimination(order, *fill_in(pattern.indptr, pattern.indices, order))
    factors = np.zeros(known.factors(pattern.size))
    arrays, rest, elements = _arrays(system, pattern, known, factors, np.zeros((2, 0)))
    absent: Any = None  # no springs and no contacts
    model = Segments(
        address_table(arrays.flat), address_table(rest.flat), np.zeros(3, dtype=np.int64), _NO_PAIRS, *_addresses(elements),
        SpringKernels(*[None] * 6), absent, absent,
        equation_kernels(arrays.pattern, arrays.matrix, factors, np.zeros(system.nu)),
    )  # fmt: skip
    return model, (arrays, rest), elements


def change_pattern(
    model: Segments, system: SegmentForces, pattern: BodyPattern, known: Elimination, factors: np.ndarray,
    contacts: ContactModel,
) -> tuple[tuple[Arrays, Arrays], list[ElementArrays]]:  # fmt: skip
    """Give a model of statics the arrays of another pattern; arguments and results as in `segments_of`."""
    arrays, rest, elements = _arrays(system, pattern, known, factors, contacts.pair_energy)
    model.table[:], model.at_rest[:] = address_table(arrays.flat), address_table(rest.flat)
    for own, one in zip(model.element_tables, elements, strict=True):
        own[: len(one.arrays)] = address_table(one.arrays)
    return (arrays, rest), elements


def _arrays(
    system: SegmentForces, pattern: BodyPattern, known: Elimination, factors: np.ndarray, pair_energy: np.ndarray
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
        matrix, factors, turned, system.scales().force_scale, pair_energy, poses.copy(), kept, kept.copy(),
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
    return np.array([0.0, 0.0, 0.0, 0.0, _pace(system), per_moment, float(have_loops(system.locking, pattern.dof)), 0.0])


def _pace(system: SegmentForces) -> float:
    """See `Arrays.interval`."""
    program = system.motions[0].program if system.motions else None
    return 1e-6 * program.speed if program is not None and program.forward else 0.0


def _addresses(elements: list[ElementArrays]) -> tuple[np.ndarray, np.ndarray]:
    """Addresses (m, 12) of the kernels of all groups of elements, and their tables (m, n, 4)."""
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
