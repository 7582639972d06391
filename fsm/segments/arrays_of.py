"""Arrays of a system for compiled steps, in time or in statics, if all its force elements have arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fsm.blocks import Elimination
from fsm.interactions.bushing_planar import (
    advance_efforts_planar,
    deformations_pose_planar,
    force_pose_planar,
    linearise_pose_planar,
    stored_pose_planar,
)
from fsm.interactions.bushing_spatial import (
    advance_efforts_spatial,
    deformations_pose_spatial,
    force_pose_spatial,
    linearise_pose_spatial,
    stored_pose_spatial,
)
from fsm.interactions.driven import Driven
from fsm.kernels.addresses import address_table
from fsm.kernels.block_equations import equation_kernels, pattern_arrays
from fsm.kernels.pointers import AbsentPointer, Pointer
from fsm.kernels.programs import table_of
from fsm.laws.crease import CreaseLaws
from fsm.segments.array_elements import LIGAMENTS, PLANAR_CREASES, SPATIAL_CREASES
from fsm.segments.array_kernels import KERNELS
from fsm.segments.arrays import Arrays, Creases, ElementKernels, Ligaments, Loads, Segments, SpringKernels, Springs
from fsm.segments.contact_arrays_of import ContactModel, has_contact_arrays
from fsm.segments.contacts import ContactGroup
from fsm.segments.elements import BushingGroup, CreaseGroup
from fsm.segments.ligaments import LigamentGroup
from fsm.segments.loads import GravityGroup, LoadGroup
from fsm.segments.pattern import BodyPattern
from fsm.stepping.model import ArrayModel
from fsm.system_records import Ready

if TYPE_CHECKING:
    from fsm.segments.system import SegmentSystem

__all__ = ["arrays_of", "has_arrays", "has_static_arrays", "segments_of"]

_KINDS = {BushingGroup, CreaseGroup, LigamentGroup, GravityGroup, LoadGroup}
_PLANAR_SPRINGS = SpringKernels(
    force_pose_planar, linearise_pose_planar, stored_pose_planar, deformations_pose_planar, advance_efforts_planar
)
_SPATIAL_SPRINGS = SpringKernels(
    force_pose_spatial, linearise_pose_spatial, stored_pose_spatial, deformations_pose_spatial, advance_efforts_spatial
)
_NONE, _NO_PAIRS, _NO_NUMBERS = np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int64), np.zeros(0)
_NO_AXES = np.zeros((0, 4))
_NO_CURVES = np.zeros((0, 4))
_ABSENT_CREASES = Creases(
    _NO_PAIRS, _NO_AXES, _NO_AXES, _NO_NUMBERS,
    CreaseLaws(_NO_NUMBERS, _NO_NUMBERS, _NO_NUMBERS, _NONE, _NONE, _NO_NUMBERS, _NO_CURVES, _NO_NUMBERS),
    _NO_NUMBERS, np.zeros((0, 4), dtype=np.int64), _NO_NUMBERS,
)  # fmt: skip


def has_arrays(system: SegmentSystem) -> bool:
    """Whether all interactions of a system have arrays, a body can move, and kernels are compiled."""
    return all(has_contact_arrays(group, system.spatial) for group in system.contacts) and _elements_known(system)


def has_static_arrays(system: SegmentSystem) -> bool:
    """Like `has_arrays`, for statics: contact is not possible.

    A test with contact: steps in one kernel save 0.01 to 0.07 s for the whole path of a strip with 4 to 40 segments per
    panel, but their compilation takes 25 s more.
    """
    return not system.contacts and _elements_known(system)


def _elements_known(system: SegmentSystem) -> bool:
    """Whether all elements have arrays, a body can move, and kernels are compiled."""
    kinds = [type(group) for group in system.groups if not isinstance(group, ContactGroup)]
    compiled = hasattr(KERNELS.force, "compile")  # the flag is false if NUMBA_DISABLE_JIT is set
    return compiled and _KINDS.issuperset(kinds) and len(set(kinds)) == len(kinds) and system.nu > 0


def arrays_of(
    system: SegmentSystem, pattern: BodyPattern, ready: Ready, contacts: ContactModel
) -> tuple[ArrayModel, tuple[Arrays, ...]]:
    """Compiled model of a system for which `has_arrays` is true, and its arrays; the caller must keep the arrays as long as
    the model.
    """
    model, arrays = segments_of(system, pattern, *ready(pattern), contacts)
    return ArrayModel.of(KERNELS, model, *system.initial()), arrays


def segments_of(
    system: SegmentSystem, pattern: BodyPattern, known: Elimination, factors: np.ndarray, contacts: ContactModel,
    statics: bool = False,
) -> tuple[Segments, tuple[Arrays, ...]]:
    """Model of all bodies for time steps or for statics; see `arrays_of`.

    `known` is the symbolic factorisation of the pattern, and `factors` contains the data of the factors.
    """
    bodies, spatial = system.bodies, system.spatial
    weight = np.zeros((len(bodies.pose), 3 if spatial else 2))
    springs, loads = _springs(None, pattern, system.size), _loads(None, pattern, spatial)
    creases, ligaments = _ABSENT_CREASES, Ligaments(_NO_PAIRS, np.zeros((0, 13)), np.zeros((0, 3)))
    for group in system.groups:
        if isinstance(group, GravityGroup):
            weight = group.mass[:, None] * group.acceleration
        elif isinstance(group, BushingGroup):
            springs = _springs(group, pattern, system.size)
        elif isinstance(group, CreaseGroup):
            creases = Creases._make((*group.arrays(pattern), np.zeros(len(group.bodies))))
        elif isinstance(group, LigamentGroup):
            ligaments = Ligaments(group.bodies, group.constants, np.zeros(group.rest.shape))
        elif isinstance(group, LoadGroup):
            loads = _loads(group, pattern, spatial)
    of_pattern, (q, _) = pattern_arrays(pattern, known), system.initial()
    poses, rates, force = bodies.pose.copy(), np.zeros(bodies.rate.shape), np.zeros(bodies.rate.shape)
    stiffness, damping, matrix = pattern.zeros(), pattern.zeros(), pattern.zeros()
    turned, kept = np.zeros((system.n_free if spatial else 0, 6, 6)), pattern.zeros()
    arrays = Arrays(
        bodies.free, bodies.inertia[bodies.free].ravel(), bodies.inertia, weight, poses, rates, force, stiffness, damping,
        matrix, factors, turned, system.scales().force_scale, contacts.pair_energy, poses.copy(), kept, kept.copy(),
        q.copy(), np.zeros(2), pattern.dof, of_pattern, springs, creases, ligaments, loads, _driven(system),
    )  # fmt: skip
    rest = arrays
    if not statics:
        rest = arrays._replace(
            rates=np.zeros(rates.shape), force=np.zeros(rates.shape), stiffness=pattern.zeros(), damping=pattern.zeros(),
            matrix=pattern.zeros(), factors=np.zeros(factors.shape),
        )  # fmt: skip
    table, in_time = address_table(arrays.flat), not statics
    of_springs, of_creases = (_SPATIAL_SPRINGS, SPATIAL_CREASES) if spatial else (_PLANAR_SPRINGS, PLANAR_CREASES)
    own = springs.bodies, springs.constants
    before, sums = (*own, springs.last, 0.0), (force, stiffness, damping)
    model = Segments(
        table, address_table(rest.flat), np.zeros(3, dtype=np.int64), contacts.groups,
        SpringKernels(
            Pointer(of_springs.force, poses, rates, *before, force),
            Pointer(of_springs.tangent, poses, rates, *before, springs.last[:0], springs.slots, *sums),
            _pointer(in_time, of_springs.stored, (_NO_NUMBERS, 0.0), poses, rates, *before, springs.category, 1),
            _pointer(in_time, of_springs.deformations, springs.last, poses, rates, *own),
            _pointer(statics, of_springs.advance, springs.last, poses, rates, *before),
        ),
        _element_kernels(of_creases, len(creases.bodies) > 0, in_time, table),
        _element_kernels(LIGAMENTS, len(ligaments.bodies) > 0, in_time, table),
        contacts.kernels, contacts.parts, equation_kernels(of_pattern, matrix, factors, np.zeros(system.nu)),
    )  # fmt: skip
    return model, (arrays, rest)


def _pointer(used: bool, kernel: Any, result: Any, *arguments: Any) -> Any:
    return Pointer(kernel, *arguments) if used else AbsentPointer(result, *arguments)


def _element_kernels(kernels: ElementKernels, used: bool, in_time: bool, table: np.ndarray) -> ElementKernels:
    return ElementKernels(
        _pointer(used, kernels.force, None, table, 0.0), _pointer(used, kernels.tangent, None, table, 0.0),
        _pointer(used and in_time, kernels.stored, (0.0, 0.0, 0.0), table, 0.0),
    )  # fmt: skip


def _springs(group: BushingGroup | None, pattern: BodyPattern, size: int) -> Springs:
    if group is None:
        slots = np.zeros((0, 4), dtype=np.int64)
        none = np.zeros((0, size))
        return Springs(_NO_PAIRS, np.zeros((0, 1)), slots, _NONE, _NO_NUMBERS, none, none)
    empty = np.zeros(group.rest.shape)
    return Springs(*group.arrays(pattern), group.category, group.in_panels, empty, empty.copy())


def _loads(group: LoadGroup | None, pattern: BodyPattern, spatial: bool) -> Loads:
    if group is None:
        vectors = np.zeros((0, 3 if spatial else 2))
        return Loads(_NONE, vectors, vectors, np.zeros((0, 3 if spatial else 1)), _NONE, _NONE, table_of([]))
    return Loads(*group.arrays, group.slots(pattern), table_of([load.time for load in group.loads]))


def _driven(system: SegmentSystem) -> Driven:
    motions = system.motions
    turning = () if system.turns is None else system.turns.bodies
    rows = [[turn.motion, turn.body] for turn in turning]
    turns = [[*turn.axis, *turn.centre, *turn.arm, *turn.own] for turn in turning]
    return Driven(
        table_of([motion.program for motion in motions]), *system.drives,
        np.array(rows, dtype=np.int64).reshape(-1, 2), np.array(turns, dtype=float).reshape(-1, 12),
        np.ascontiguousarray(system.bodies.pose[system.driven]), system.scales().of_drives,
    )  # fmt: skip
