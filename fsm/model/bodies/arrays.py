"""Segments as a compiled model (`ArrayModel`), for compiled time steps and quasi-static steps (see `fsm.solve.stepping`).

The model covers free, held and driven bodies with springs, elements of all kinds, loads, gravity and contacts. Laws of users
in Python and friction that depends on the direction have no arrays; such systems take the same steps in Python.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.driven import Driven
from fsm.interactions.joint_tree import JointTree
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.block_equations import EquationKernels, Pattern, pattern_at
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at
from fsm.kernels.programs import Pieces
from fsm.kernels.records import record
from fsm.model.bodies.contact_arrays import ContactKernels, LawKernels


class SpringKernels(NamedTuple):
    """Kernels of `fsm.interactions.bushing_planar` or `bushing_spatial`; only statics uses `advance` and `widest`."""

    force: Any
    tangent: Any
    stored: Any
    deformations: Any
    advance: Any
    widest: Any


class Springs(NamedTuple):
    """Arrays of a `BushingGroup`.

    `category`, `in_panels` and `structural` (0 or 1; 0 too if a step of the case may remove the element) have the same
    meaning as in the group. `last` (m, 3 or 6) contains the deformations at the end
    of the last step. `efforts` (m, 3 or 6) contains the efforts that Newton's method of statics advances.
    """

    bodies: np.ndarray
    constants: np.ndarray
    slots: np.ndarray
    category: np.ndarray
    in_panels: np.ndarray
    structural: np.ndarray
    last: np.ndarray
    efforts: np.ndarray


class Loads(NamedTuple):
    """Arrays of a `LoadGroup`, which are empty without loads; `programs` contains the factors of all loads."""

    bodies: np.ndarray
    points: np.ndarray
    forces: np.ndarray
    moments: np.ndarray
    follower: np.ndarray
    slots: np.ndarray
    programs: Pieces


class Arrays(NamedTuple):
    """Arrays of a system; matrices and sums are changed in place. Arrays of absent kinds of elements are empty.

    Attributes
    ----------
    free : int array
    mass : (nu,) array
    inertia : (n_bodies, 3 or 6) array
        Inertia of every degree of freedom.
    weight : (n_bodies, 2 or 3) array, N
    poses, rates, force : arrays of all bodies
    stiffness, damping, matrix, factors : block data
    turned : (n_free, 6, 6) array; empty in the plane
        Derivatives of the increment of the last factors.
    force_scale : (nu,) array
        Divisors of forces, see `fsm.solve.interface.scales.Scales`.
    pair_force : (n_pairs,) array, N
        Normal forces of contact pairs.
    kept_stiffness, kept_damping : block data, see `fsm.solve.stepping.model.keep_tangent`
    last_q : (nq,) array
        Configuration of the last state in statics.
    interval : (9,) array
        Time in statics, and time since the last state, first as zero if no force depends on rates; time of the last state
        (s). Part of the time in `System.progress`, per second; zero if the progress is the time.
        Inverse of the length of bodies with locked directions (1/m), whose moments count as reactions; zero without.
        One if locked directions form loops, else zero; the same if friction follows their reactions. Factor of the
        inertia in the matrix of the last step (1/s^2).
    dof : (n_bodies,) int array, see `BodyPattern`
    stored : (5,) array, J and W
        Energies of elements in panels and in creases, power that elements put into the system, power that their
        memory dissipates, and energy of gas.
    pattern, springs, loads, driven, tree : arrays of each
    """

    free: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    weight: np.ndarray
    poses: np.ndarray
    rates: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    matrix: np.ndarray
    factors: np.ndarray
    turned: np.ndarray
    force_scale: np.ndarray
    pair_force: np.ndarray
    kept_stiffness: np.ndarray
    kept_damping: np.ndarray
    last_q: np.ndarray
    interval: np.ndarray
    dof: np.ndarray
    stored: np.ndarray
    pattern: Pattern
    springs: Springs
    loads: Loads
    driven: Driven
    tree: JointTree

    @property
    def flat(self) -> list[np.ndarray]:
        """All arrays in the order of their rows in `Segments.table`."""
        return list(flat_arrays(self))


def flat_arrays(arrays: Any) -> Iterator[np.ndarray]:
    """All arrays of a tuple of arrays and of such tuples."""
    for part in arrays:
        if isinstance(part, tuple):
            yield from flat_arrays(part)
        else:
            yield part


@record
class Segments(NamedTuple):
    """Model of `Arrays` by their addresses. All models have the same types, so that their kernels are compiled once.

    Attributes
    ----------
    table : table of `fsm.kernels.addresses`
    at_rest : table with separate rates, forces and matrices, for tangents at zero rates
    flags : (3,) int array, see `fsm.kernels.block_equations`
    groups : (k, 2) int array
        Tables of the contacts of each geometry; see `fsm.model.bodies.contact_arrays`.
    elements : (m, 13) int array
        Addresses of the kernels of each group of elements (`fsm.model.elements.element_group.ElementKernels`).
    element_tables : (m, n, 4) int array
        Tables of the groups of elements.
    by_springs, by_contacts, contact_laws, equations : kernels, by address (`Pointer`)
        These kernels depend on the dimension. A kernel that no element of the model needs is absent (`AbsentPointer`).
    """

    table: np.ndarray
    at_rest: np.ndarray
    flags: np.ndarray
    groups: np.ndarray
    elements: np.ndarray
    element_tables: np.ndarray
    by_springs: SpringKernels
    by_contacts: ContactKernels
    contact_laws: LawKernels
    equations: EquationKernels


FREE, MASS, INERTIA, WEIGHT, POSES, RATES, FORCE, STIFFNESS, DAMPING, MATRIX, FACTORS, TURNED = range(12)
FORCE_SCALE, PAIR_FORCE, KEPT_STIFFNESS, KEPT_DAMPING, LAST_Q, INTERVAL, DOF, STORED, PATTERN = range(12, 21)
"""Rows of `Segments.table`."""
FORCE_BY, TANGENT_BY, KEEP_BY, STORED_BY, LOST_BY, ACCEPT_BY, LOCK_BY, ADVANCE_BY, PROJECT_BY, PART_BY = range(10)
TAKE_UP_BY, BOTH_BY = 10, 12
"""Columns of `Segments.elements`."""
LOOPS, FEELS, LOCKED_BY, GAS = 6, 7, 8, 4
"""Indices of `Arrays.interval`, and of `Arrays.stored`."""
MEASURE, BEND, CLOSE, AT_RATES, AT_ACCELERATIONS, KEEP, SWAP, AT_GIVEN, AT_END, ALONG_STEP = range(10)
STEP, AGAIN, WORK, LARGEST = 0.0, 1.0, 2.0, 3.0
"""Tasks of the kernels `project` and `advance` of elements with locked directions (`fsm.model.elements.joints`)."""
_SPRINGS = PATTERN + len(Pattern._fields)
_LOADS = _SPRINGS + len(Springs._fields)
_PROGRAMS = len(Pieces._fields)
_OF_LOADS = _LOADS + len(Loads._fields) - 1
_OF_DRIVES = _OF_LOADS + _PROGRAMS
_DRIVEN = _OF_DRIVES + _PROGRAMS
_TREE = _DRIVEN + len(Driven._fields) - 1


@kernel
def pattern_of(t: np.ndarray) -> Pattern:
    """Pattern of the table."""
    return pattern_at(t, PATTERN)


@kernel
def index_of(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arrays of the pattern, see `fsm.interactions.contact.shapes.BlockIndex`."""
    return integers_1d(t, DOF), integers_1d(t, PATTERN), integers_1d(t, PATTERN + 1)


@kernel
def springs_of(t: np.ndarray) -> Springs:
    """Springs of the table."""
    k = _SPRINGS
    return Springs(
        integers_2d(t, k), floats_2d(t, k + 1), integers_2d(t, k + 2), integers_1d(t, k + 3), floats_1d(t, k + 4),
        integers_1d(t, k + 5), floats_2d(t, k + 6), floats_2d(t, k + 7),
    )


@kernel
def loads_of(t: np.ndarray) -> Loads:
    """Loads of the table."""
    k = _LOADS
    return Loads(
        integers_1d(t, k), floats_2d(t, k + 1), floats_2d(t, k + 2), floats_2d(t, k + 3), integers_1d(t, k + 4),
        integers_1d(t, k + 5), pieces_at(t, _OF_LOADS),
    )  # fmt: skip


@kernel
def driven_of(t: np.ndarray) -> Driven:
    """Driven bodies of the table."""
    k = _DRIVEN
    return Driven(
        pieces_at(t, _OF_DRIVES), integers_1d(t, k), integers_1d(t, k + 1), floats_2d(t, k + 2), integers_2d(t, k + 3),
        floats_2d(t, k + 4), floats_2d(t, k + 5), floats_1d(t, k + 6),
    )  # fmt: skip


@kernel
def tree_of(t: np.ndarray) -> JointTree:
    """Tree of joints of the table."""
    k = _TREE
    return JointTree(
        integers_2d(t, k), integers_1d(t, k + 1), floats_1d(t, k + 2), floats_2d(t, k + 3), floats_2d(t, k + 4),
        floats_3d(t, k + 5), floats_3d(t, k + 6), floats_3d(t, k + 7), floats_2d(t, k + 8), floats_2d(t, k + 9),
        floats_2d(t, k + 10), floats_2d(t, k + 11), floats_3d(t, k + 12), floats_2d(t, k + 13), floats_2d(t, k + 14),
        floats_2d(t, k + 15),
    )  # fmt: skip
