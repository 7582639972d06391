"""Arrays of a system for compiled steps, if all its force elements have arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fsm.interactions.bushing_planar import (
    deformations_pose_planar,
    force_pose_planar,
    linearise_pose_planar,
    stored_pose_planar,
)
from fsm.interactions.bushing_spatial import (
    deformations_pose_spatial,
    force_pose_spatial,
    linearise_pose_spatial,
    stored_pose_spatial,
)
from fsm.interactions.driven import Driven
from fsm.kernels.addresses import address_table
from fsm.kernels.block_lu import factorise, solve_refined
from fsm.kernels.pointers import Pointer
from fsm.segments.array_elements import LIGAMENTS, NO_ELEMENTS, PLANAR_CREASES, SPATIAL_CREASES
from fsm.segments.array_kernels import KERNELS
from fsm.segments.arrays import (
    Arrays,
    Creases,
    ElementKernels,
    EquationKernels,
    Ligaments,
    Loads,
    Pattern,
    Segments,
    SpringKernels,
    Springs,
)
from fsm.segments.contact_arrays_of import ContactModel, has_contact_arrays
from fsm.segments.contacts import ContactGroup
from fsm.segments.elements import BushingGroup, CreaseGroup
from fsm.segments.ligaments import LigamentGroup
from fsm.segments.loads import GravityGroup, LoadGroup
from fsm.segments.pattern import BodyPattern
from fsm.segments.pieces_of import of_function, of_program, pieces_of
from fsm.stepping.model import ArrayModel
from fsm.system_records import Ready

if TYPE_CHECKING:
    from fsm.segments.system import SegmentSystem

__all__ = ["arrays_of", "has_arrays"]

_KINDS = {BushingGroup, CreaseGroup, LigamentGroup, GravityGroup, LoadGroup}
_PLANAR_SPRINGS = SpringKernels(force_pose_planar, linearise_pose_planar, stored_pose_planar, deformations_pose_planar)
_SPATIAL_SPRINGS = SpringKernels(
    force_pose_spatial, linearise_pose_spatial, stored_pose_spatial, deformations_pose_spatial
)
_NONE, _NO_PAIRS, _NO_NUMBERS = np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int64), np.zeros(0)
_NO_AXES = np.zeros((0, 4))
_ABSENT_CREASES = Creases(
    _NO_PAIRS, _NO_AXES, _NO_AXES, _NO_NUMBERS, _NO_NUMBERS, _NO_NUMBERS, _NO_NUMBERS, _NONE, _NONE, _NO_NUMBERS,
    np.zeros((0, 4)), np.zeros(0), _NO_NUMBERS, np.zeros((0, 4), dtype=np.int64), _NO_NUMBERS,
)  # fmt: skip


def has_arrays(system: SegmentSystem) -> bool:
    """Whether all that acts in a system has arrays, something can move, and kernels are compiled."""
    if not hasattr(KERNELS.force, "compile"):  # NUMBA_DISABLE_JIT
        return False
    if not all(has_contact_arrays(group, system.spatial) for group in system.contacts):
        return False
    kinds = [type(group) for group in system.groups if not isinstance(group, ContactGroup)]
    known = all(of_program(motion.program) is not None for motion in system.motions)
    return _KINDS.issuperset(kinds) and len(set(kinds)) == len(kinds) and known and system.nu > 0


def arrays_of(
    system: SegmentSystem, pattern: BodyPattern, ready: Ready, contacts: ContactModel
) -> tuple[ArrayModel, tuple[Arrays, ...]]:
    """Model of arrays of a system for which `has_arrays` is true, and the arrays, which the caller keeps with the model."""
    known, factors = ready(pattern)
    bodies, spatial = system.bodies, system.spatial
    weight = np.zeros((len(bodies.pose), 3 if spatial else 2))
    springs, loads = _springs(None, pattern, system.size), _loads(None, pattern, spatial)
    creases, of_creases = _ABSENT_CREASES, NO_ELEMENTS
    ligaments, of_ligaments = Ligaments(_NO_PAIRS, np.zeros((0, 13)), np.zeros((0, 3))), NO_ELEMENTS
    for group in system.groups:
        if isinstance(group, GravityGroup):
            weight = group.mass[:, None] * group.acceleration
        elif isinstance(group, BushingGroup):
            springs = _springs(group, pattern, system.size)
        elif isinstance(group, CreaseGroup):
            creases = Creases._make((*group.arrays(pattern), np.zeros(len(group.bodies))))
            of_creases = SPATIAL_CREASES if spatial else PLANAR_CREASES
        elif isinstance(group, LigamentGroup):
            ligaments, of_ligaments = Ligaments(group.bodies, group.constants, np.zeros(group.rest.shape)), LIGAMENTS
        elif isinstance(group, LoadGroup):
            loads = _loads(group, pattern, spatial)
    of_pattern = Pattern(
        pattern.dof, pattern.indptr, pattern.indices, pattern.transposed, pattern.diagonal, known.order, known.indptr,
        known.indices, known.diagonal, known.place,
    )  # fmt: skip
    poses, rates, force = bodies.pose.copy(), np.zeros(bodies.rate.shape), np.zeros(bodies.rate.shape)
    stiffness, damping, matrix, right = pattern.zeros(), pattern.zeros(), pattern.zeros(), np.zeros(system.nu)
    state, blocks = (poses, rates), (force, stiffness, damping)
    turned = np.zeros((system.n_free if spatial else 0, 6, 6))
    arrays = Arrays(
        bodies.free, bodies.inertia[bodies.free].ravel(), bodies.inertia, weight, poses, rates, force, stiffness, damping,
        matrix, factors, turned, system.scales().force_scale, contacts.pair_energy, poses.copy(),
        of_pattern, springs, creases, ligaments, loads,
        _driven(system),
    )  # fmt: skip
    rest = arrays._replace(
        rates=np.zeros(rates.shape), force=np.zeros(rates.shape), stiffness=pattern.zeros(), damping=pattern.zeros(),
        matrix=pattern.zeros(), factors=np.zeros(factors.shape),
    )  # fmt: skip
    table = address_table(arrays.flat)
    of_springs = _SPATIAL_SPRINGS if spatial else _PLANAR_SPRINGS
    own = springs.bodies, springs.constants
    before = *own, springs.last, 0.0
    p = of_pattern
    model = Segments(
        table, address_table(rest.flat), np.zeros(3, dtype=np.int64), contacts.groups,
        SpringKernels(
            Pointer(of_springs.force, *state, *before, force),
            Pointer(of_springs.tangent, *state, *before, springs.last[:0], springs.slots, *blocks),
            Pointer(of_springs.stored, *state, *before, springs.category, 1),
            Pointer(of_springs.deformations, *state, *own),
        ),
        _pointers(of_creases, table), _pointers(of_ligaments, table), contacts.kernels, contacts.parts,
        EquationKernels(
            Pointer(
                factorise, matrix, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, True, factors
            ),
            Pointer(
                solve_refined, p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, factors, p.rows, p.columns,
                matrix, right, 0.0, True, True,
            ),
        ),
    )  # fmt: skip
    return ArrayModel.of(KERNELS, model, *system.initial()), (arrays, rest)


def _pointers(kernels: ElementKernels, table: np.ndarray) -> ElementKernels:
    return ElementKernels(
        Pointer(kernels.force, table), Pointer(kernels.tangent, table), Pointer(kernels.stored, table, 0.0)
    )


def _springs(group: BushingGroup | None, pattern: BodyPattern, size: int) -> Springs:
    if group is None:
        slots = np.zeros((0, 4), dtype=np.int64)
        return Springs(_NO_PAIRS, np.zeros((0, 1)), slots, _NONE, _NO_NUMBERS, np.zeros((0, size)))
    return Springs(*group.arrays(pattern), group.category, group.in_panels, np.zeros(group.rest.shape))


def _loads(group: LoadGroup | None, pattern: BodyPattern, spatial: bool) -> Loads:
    if group is None:
        vectors = np.zeros((0, 3 if spatial else 2))
        return Loads(_NONE, vectors, vectors, np.zeros((0, 3 if spatial else 1)), _NONE, _NONE, pieces_of([]))
    programs = pieces_of([of_function(load.time) for load in group.loads])
    return Loads(*group.arrays, group.slots(pattern), programs)


def _driven(system: SegmentSystem) -> Driven:
    motions = system.motions
    turning = () if system.turns is None else system.turns.bodies
    rows = [[turn.motion, turn.body] for turn in turning]
    turns = [[*turn.axis, *turn.centre, *turn.arm, *turn.own] for turn in turning]
    return Driven(
        pieces_of([of_program(motion.program) or [] for motion in motions]), *system.drives,
        np.array(rows, dtype=np.int64).reshape(-1, 2), np.array(turns, dtype=float).reshape(-1, 12),
        np.ascontiguousarray(system.bodies.pose[system.driven]),
    )  # fmt: skip
