"""Contacts as arrays of a model, for compiled time steps; see `fsm.segments.arrays` and `fsm.segments.array_contacts`.

Each geometry has one table of arrays (`fsm.kernels.addresses`). All slots that can ever touch stay in the tables, so that
slots keep their numbers. The memory of contacts is stored for all slots.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.impacts import ImpactRules
from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d, table_at
from fsm.kernels.jit import kernel

__all__ = [
    "AREA", "BEGAN", "BRISTLE", "CHANGES", "COMMITTED", "COMMITTED_AT", "DEFLECTION", "DEPTH", "EVALUATIONS",
    "FRICTION", "INDEX", "LACKS", "LINEARISED", "LOADED", "LOSSY", "MARGIN", "MOVING", "NORMAL", "NUMBERS",
    "OF_FRICTION", "ONSET", "OWN", "OWN_STATE", "PAIR", "RADII", "RATES_BEFORE", "REFERENCE", "REFERRED",
    "RESTITUTION", "SHARE", "STARTED", "STATE", "STATES", "SURFACES", "ContactArrays", "ContactKernels",
    "ContactParts", "GeometryKernels", "LawKernels", "floor_of", "have_opened", "index_of", "keep_loaded",
    "lack_pairs", "resolves", "rules_of",
]  # fmt: skip


class GeometryKernels(NamedTuple):
    """Kernels of a geometry. The first argument of each is its table `g`.

    Attributes
    ----------
    renew : ``renew(g, poses)``
        Renew the broad phase where bodies have moved too far since the last renewal; 1 if it has been renewed.
    find : ``find(g, poses, below) -> slot, gap``
    measure : ``measure(g, poses, rates, slot) -> bodies, rate, gradient``
    tapered : ``tapered(g, poses, slot, bodies) -> rows, part, gradient, hessian``
        Contacts whose weights change with the poses; see `fsm.segments.contact_geometry.Tapered`.
    tangent : ``tangent(g, poses, rates, slot, bodies, gradient, forces, stiffness, damping)``
    passed : ``passed(g, poses)``
        Whether sides have passed through each other since the last accepted state.
    settle : ``settle(g, poses, young, new)``
        Update the memory in an accepted state, with the slots of continuing impacts; or, with `new`, that of contacts which
        the broad phase has found anew.
    """

    renew: Any
    find: Any
    measure: Any
    tapered: Any
    tangent: Any
    passed: Any
    settle: Any


class LawKernels(NamedTuple):
    """Laws: force and energy of `NormalLaw`; effort of a `FrictionLaw`, without and with bristles."""

    normal: Any
    energy: Any
    friction: Any
    bristle: Any


class ContactParts(NamedTuple):
    """Kernels that contact kernels call: of shapes, of surfaces, and of laws."""

    shapes: GeometryKernels
    surfaces: GeometryKernels
    laws: LawKernels


class ContactKernels(NamedTuple):
    """Kernels of all contacts of a model; see `fsm.segments.array_contacts`."""

    force: Any
    tangent: Any
    part_of_step: Any
    accept: Any
    longest_step: Any
    stored: Any


class ContactArrays(NamedTuple):
    """Arrays that all geometries have; those of one geometry follow in its table.

    Attributes
    ----------
    state : int array, see `STATES`
    numbers : (2,) array
        Margin (m) and time of the last accepted state (s).
    normal, friction : parameters of the laws
    resolving : (6,) array
        Restitution (0 or 1), speed of impacts (m/s), exponent, steps in an impact, speed floor (m/s) and whether steps have
        to resolve impacts (0 or 1); see `ImpactRules`.
    mobility, loose : see `ImpactRules`
    share, area, pair : (n_slots,) arrays, see `ContactGeometry`
    onset, began, depth, deflection : memory of all slots, see `ContactMemory`
    linearised, loaded : (n_slots,) int arrays
        1 for slots with a force in the last tangent, and in the last evaluated state.
    committed, rates_before : poses and rates of the last accepted state
    reference : poses of the last renewal
    moving, radii : bodies that renew the broad phase, and the distance of their farthest point, m
    dof, indptr, indices : see `BodyPattern`
    """

    state: np.ndarray
    numbers: np.ndarray
    normal: np.ndarray
    friction: np.ndarray
    resolving: np.ndarray
    mobility: np.ndarray
    loose: np.ndarray
    share: np.ndarray
    area: np.ndarray
    pair: np.ndarray
    onset: np.ndarray
    began: np.ndarray
    depth: np.ndarray
    deflection: np.ndarray
    linearised: np.ndarray
    loaded: np.ndarray
    committed: np.ndarray
    rates_before: np.ndarray
    reference: np.ndarray
    moving: np.ndarray
    radii: np.ndarray
    dof: np.ndarray
    indptr: np.ndarray
    indices: np.ndarray


STATE, NUMBERS, NORMAL, OF_FRICTION, _RESOLVING, _MOBILITY, _LOOSE, SHARE, AREA, PAIR = range(10)
ONSET, BEGAN, DEPTH, DEFLECTION, LINEARISED, LOADED, COMMITTED, RATES_BEFORE, REFERENCE, MOVING, RADII, INDEX = range(10, 22)
OWN = len(ContactArrays._fields)
"""Rows of the table of a geometry; its own arrays begin at `OWN`."""
CHANGES, STARTED, REFERRED, LACKS, EVALUATIONS, FRICTION, BRISTLE, SURFACES, LOSSY, OWN_STATE = range(10)
STATES = 13
"""Indices of `ContactArrays.state`: weights wait to be used; there is an accepted state, and a renewal; the pattern lacks a
pair of bodies; number of evaluated states; friction, and with bristles; a geometry of surfaces; forces
depend on rates. From `OWN_STATE` on the
numbers are those of a geometry."""
MARGIN, COMMITTED_AT = 0, 1
"""Indices of `ContactArrays.numbers`."""
RESTITUTION, _FAST, _EXPONENT, _STEPS, _FLOOR, _RESOLVES = range(6)


@kernel
def rules_of(g: np.ndarray) -> ImpactRules:
    """Rules of impacts."""
    numbers = floats_1d(g, _RESOLVING)
    return ImpactRules(
        floats_2d(g, _MOBILITY), integers_1d(g, _LOOSE), int(numbers[RESTITUTION]), numbers[_FAST], numbers[_EXPONENT],
        numbers[_STEPS],
    )  # fmt: skip


@kernel
def floor_of(g: np.ndarray) -> float:
    """Speed floor of the normal law, m/s."""
    return floats_1d(g, _RESOLVING)[_FLOOR]


@kernel
def resolves(g: np.ndarray) -> bool:
    """Whether steps have to resolve impacts."""
    return floats_1d(g, _RESOLVING)[_RESOLVES] > 0.0


@kernel
def index_of(g: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arrays of the pattern, see `fsm.interactions.shapes.BlockIndex`."""
    return integers_1d(g, INDEX), integers_1d(g, INDEX + 1), integers_1d(g, INDEX + 2)


@kernel
def keep_loaded(groups: np.ndarray) -> None:
    """Keep which slots have a force in this tangent."""
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        loaded, linearised = integers_1d(g, LOADED), integers_1d(g, LINEARISED)
        for i in range(loaded.shape[0]):
            linearised[i] = loaded[i]


@kernel
def have_opened(groups: np.ndarray) -> bool:
    """Whether contacts with a force in the last tangent have none in the last evaluated state."""
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        loaded, linearised = integers_1d(g, LOADED), integers_1d(g, LINEARISED)
        for i in range(loaded.shape[0]):
            if linearised[i] == 1 and loaded[i] == 0:
                return True
    return False


@kernel
def lack_pairs(groups: np.ndarray) -> bool:
    """Whether bodies have come near each other that have no block in the pattern."""
    lacks = 0
    for k in range(groups.shape[0]):
        lacks += integers_1d(table_at(groups, k), STATE)[LACKS]
    return lacks > 0
