"""Contacts as arrays of a model, for compiled steps; see `fsm.model.bodies.arrays` and `fsm.model.contact.array_contacts`.

Each geometry has one table of arrays (`fsm.kernels.tables`). The tables have a slot for each possible contact, so
slots keep their numbers. The memory of contacts is stored for all slots. The contacts of the last evaluated state are
stored in the first rows of arrays of the same length. Kernels that return new arrays would spend most of their time on
allocations and reference counts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.contact.impacts import ImpactRules
from fsm.interactions.contact.shapes import ContactForces
from fsm.interactions.search.displacement_bound import moved_beyond
from fsm.kernels.jit import kernel
from fsm.kernels.tables import Floats1, Floats2, Floats3, Integers1, Integers2, table_in


class GeometryKernels(NamedTuple):
    """Kernels of a geometry. The first argument of each kernel is its table `g`.

    Attributes
    ----------
    renew : ``renew(g, poses)``
        Update the broad phase if bodies have moved too far since its last update; return 1 if it was updated.
    find : ``find(g, poses, below)``
        Find the contacts with a gap below `below`. Write the slot and the gap (m) of each contact, and return their number.
    measure : ``measure(g, poses, rates, count)``
        Write bodies, rates and gradients of `count` contacts.
    select : ``select(g, rows)``
        Keep only these rows (ascending) of the arrays that `find` has written for this geometry alone.
    tapered : ``tapered(g, poses, count) -> rows, part, gradient, hessian``
        Rows (m,) of contacts whose weights change with the poses (`fsm.interactions.surfaces.end_taper` and
        `fsm.interactions.shapes.face_weights`), factors (m,) of these weights, and their derivatives (m, k size) and
        (m, k size, k size) with respect to the coordinates of the bodies.
    tangent : ``tangent(g, poses, rates, count, stiffness, damping)``
    passed : ``passed(g, poses)``
        Number of the first pair whose sides have passed through each other since the last accepted state; -1 for none.
    settle : ``settle(g, poses, young, new)``
        Update the memory in an accepted state, with the slots of continuing impacts; with `new`, update the memory of
        contacts that the broad phase has just found.
    """

    renew: Any
    find: Any
    measure: Any
    select: Any
    tapered: Any
    tangent: Any
    passed: Any
    settle: Any


class LawKernels(NamedTuple):
    """Laws: force and energy of `NormalLaw`; effort of a `FrictionLaw`, without and with bristles; kernels of
    `fsm.interactions.contact.anisotropic_friction` for friction that depends on the direction.
    """

    normal: Any
    energy: Any
    friction: Any
    bristle: Any
    stretch: Any
    stretch_efforts: Any
    add_turn_stiffness: Any


class ContactKernels(NamedTuple):
    """Kernels of all contacts of a model; see `fsm.model.contact.array_contacts`. Only statics uses those from `advance` on,
    and only steps in time use `part_of_step`, `longest_step`, `stored` and `losses`.
    """

    force: Any
    tangent: Any
    part_of_step: Any
    accept: Any
    longest_step: Any
    stored: Any
    losses: Any
    advance: Any
    passed: Any
    sums: Any
    press: Any


class ContactArrays(NamedTuple):
    """Arrays that all geometries have; further arrays of a geometry follow in its table.

    Attributes
    ----------
    state : int array, see `STATES`
    calls : (8,) int array
        Addresses of the `GeometryKernels` of the table.
    numbers : (5,) array
        Margin (m), time of the last accepted state (s), bound of the gaps of the last search (m), in statics the largest
        normal force of a contact without a depth of linearisation (N), and the coefficient of friction across the length of
        a plate over that along it.
    normal, friction : parameters of the laws
    resolving : (6,) array
        Restitution (0 or 1), speed of impacts (m/s), exponent, steps in an impact, speed floor (m/s) and whether steps have
        to resolve impacts (0 or 1); see `ImpactRules`.
    mobility, loose : see `ImpactRules`
    share, area, pair : (n_slots,) arrays, see `ContactTable`
    onset, began, depth, deflection : memory of all slots, see `ContactMemory`
    linearised, loaded : (n_slots,) int arrays
        1 for slots with a force in the last tangent, and in the last evaluated state.
    committed, rates_before : poses and rates of the last accepted state
    reference : poses at the last update of the broad phase
    moving, radii : bodies whose motion requires an update of the broad phase, and the distance of the farthest point of each
    body, m
    dof, indptr, indices : see `BodyPattern`
    slot, gap, bodies, rate, gradient : contacts of the last search
        Numbers of their slots, gaps (m), and the fields of `ContactKinematics`. Like the next arrays, they have rows for all
        slots.
    closing, slip, share_of, onset_of, at : arguments of the laws
        Closing speed and slip velocity (m/s); share, with the change of weights; onset and depth (m) of these contacts.
    normal_force, by_depth, by_closing, effort, by_slip, by_normal, deflected, by_distance, by_turn : forces
        Forces as in `ContactForces`. `deflected` is the new deflection of bristles (m), `by_distance` their stiffness (N/m),
        and `by_turn` the derivative of friction that depends on the direction by rotations of the first body (N).
    pull : (n_slots,) array
        Force on the bodies over the normal force of the law: the gradient of the gap by the first body's place, along the
        normal. 1 for a contact at a point; `measure` writes it if depths are means (MEANS). Friction follows from this
        force.
    acting : normal forces of the law linearised at `at`, N; those of `normal_force` except in Newton's method of statics
    pressed, pressed_before : (n_slots,) arrays, m
        Depths at which Newton's method of statics linearises the law, and those before its last increment; zero for none.
        See `fsm.interactions.contact.contact_depths`.
    found_poses, found_rates : poses of the last search, and rates of the last evaluation
    """

    state: Integers1
    calls: Integers1
    numbers: Floats1
    normal: Floats1
    friction: Floats1
    resolving: Floats1
    mobility: Floats2
    loose: Integers1
    share: Floats1
    area: Floats1
    pair: Integers1
    onset: Floats1
    began: Floats1
    depth: Floats1
    deflection: Floats2
    linearised: Integers1
    loaded: Integers1
    committed: Floats2
    rates_before: Floats2
    reference: Floats2
    moving: Integers1
    radii: Floats1
    dof: Integers1
    indptr: Integers1
    indices: Integers1
    slot: Integers1
    gap: Floats1
    bodies: Integers2
    rate: Floats2
    gradient: Floats3
    closing: Floats1
    slip: Floats2
    share_of: Floats1
    onset_of: Floats1
    at: Floats1
    normal_force: Floats1
    by_depth: Floats1
    by_closing: Floats1
    effort: Floats2
    by_slip: Floats3
    by_normal: Floats2
    deflected: Floats2
    by_distance: Floats3
    by_turn: Floats3
    pull: Floats1
    acting: Floats1
    pressed: Floats1
    pressed_before: Floats1
    found_poses: Floats2
    found_rates: Floats2


contacts_at = table_in(ContactArrays)
"""Table of one of several groups, in kernels; see `fsm.kernels.tables.table_in`."""
CHANGES, STARTED, REFERRED, LACKS, EVALUATIONS, FRICTION, BRISTLE, LOSSY = range(8)
FOUND, MEASURED, ACTIVE, RENUMBERS, FADES, MEANS, OWN_STATE = range(8, 15)
STATES = 20
"""Indices of `ContactArrays.state`, and their number. 1 means: new weights are not yet used (CHANGES); there is an accepted
state (STARTED), and a renewal (REFERRED); the pattern lacks a pair of bodies, or the table a row (LACKS); there is
friction, with bristles; forces depend on rates (LOSSY). EVALUATIONS counts states. FOUND is the number of contacts of the
last search, -1 if they do not hold any longer; MEASURED: they have been measured. ACTIVE is the number of contacts of the
last tangent at depths of statics. RENUMBERS and FADES: see `ContactTable`. MEANS: depths are means, so that the
force on the bodies is not the normal force of the law (`pull`). A geometry has its own numbers from OWN_STATE on."""
OF_SLOTS = tuple(
    name for name in ContactArrays._fields
    if name not in (
        "state", "calls", "numbers", "normal", "friction", "resolving", "mobility", "loose", "committed", "rates_before",
        "reference", "moving", "radii", "dof", "indptr", "indices", "found_poses", "found_rates",
    )
)  # fmt: skip
"""Arrays with a row for each slot."""
MARGIN, COMMITTED_AT, BELOW, MOST, ACROSS = range(5)
"""Indices of `ContactArrays.numbers`."""
RENEWAL = 0.4
"""Displacement relative to the margin after which the broad phase is updated."""
RESTITUTION, FAST, EXPONENT, STEPS, FLOOR, RESOLVES = range(6)
"""Indices of `ContactArrays.resolving`."""


@kernel
def must_renew(g: ContactArrays, poses: np.ndarray) -> bool:
    """Whether bodies have moved too far since the last renewal of the broad phase."""
    bound = RENEWAL * g.numbers[MARGIN]
    if g.state[REFERRED] == 0:
        return True
    return bool(moved_beyond(poses, g.reference, g.moving, g.radii, bound))


@kernel
def rules_of(g: ContactArrays) -> ImpactRules:
    """Rules of impacts."""
    numbers = g.resolving
    return ImpactRules(
        g.mobility, g.loose, int(numbers[RESTITUTION]), numbers[FAST], numbers[EXPONENT],
        numbers[STEPS],
    )  # fmt: skip


@kernel
def floor_of(g: ContactArrays) -> float:
    """Speed floor of the normal law, m/s."""
    return g.resolving[FLOOR]


@kernel
def exponent_of(g: ContactArrays) -> float:
    """Exponent of the normal law."""
    return g.resolving[EXPONENT]


@kernel
def resolves(g: ContactArrays) -> bool:
    """Whether steps have to resolve impacts."""
    return g.resolving[RESOLVES] > 0.0


@kernel
def index_of(g: ContactArrays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arrays of the pattern, see `fsm.interactions.contact.shapes.BlockIndex`."""
    return g.dof, g.indptr, g.indices


@kernel
def forces_of(g: ContactArrays, first: int, last: int) -> ContactForces:
    """Forces of the contacts from `first` up to, and without, `last`."""
    return ContactForces(
        g.normal_force[first:last], g.by_depth[first:last], g.by_closing[first:last],
        g.effort[first:last], g.by_slip[first:last], g.by_normal[first:last],
        g.state[FRICTION] == 1,
    )  # fmt: skip


@kernel
def keep_loaded(groups: np.ndarray) -> None:
    """Store which slots have a force in this tangent."""
    for k in range(groups.shape[0]):
        g = contacts_at(groups, k)
        loaded, linearised = g.loaded, g.linearised
        for i in range(loaded.shape[0]):
            linearised[i] = loaded[i]


@kernel
def restore_depths(groups: np.ndarray) -> None:
    """Restore the depths of statics before their last increment."""
    for k in range(groups.shape[0]):
        g = contacts_at(groups, k)
        before, pressed = g.pressed_before, g.pressed
        for i in range(pressed.shape[0]):
            pressed[i] = before[i]


@kernel
def touching(groups: np.ndarray) -> tuple[int, bool]:
    """Number of contacts with a force in the last evaluated state, and whether others of the last tangent have none."""
    count, opened = 0, False
    for k in range(groups.shape[0]):
        g = contacts_at(groups, k)
        loaded, linearised = g.loaded, g.linearised
        for i in range(loaded.shape[0]):
            count += loaded[i]
            opened = opened or (linearised[i] == 1 and loaded[i] == 0)
    return count, opened


@kernel
def lack_pairs(groups: np.ndarray) -> bool:
    """Whether two bodies without a block in the pattern have come near each other."""
    lacks = 0
    for k in range(groups.shape[0]):
        lacks += contacts_at(groups, k).state[LACKS]
    return lacks > 0
