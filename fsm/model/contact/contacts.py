"""Contact and friction as a group: the laws of the contacts of one geometry, whose state is in its table."""

from __future__ import annotations

import copy
from typing import NamedTuple

import numpy as np

from fsm.interactions.contact.impacts import CORNER_WEIGHT
from fsm.interactions.contact.pair_sums import AREA, CARRIED, DAMPING, FORCE, FRICTION, SLIDING, smallest_gaps
from fsm.model.bodies import contact_arrays as rows
from fsm.model.bodies.contact_arrays import FRICTION as HAS_FRICTION
from fsm.model.bodies.group import BlockSums, BodyState, Group
from fsm.model.contact import array_contact_state as contact_state
from fsm.model.contact import array_contacts
from fsm.model.contact.array_contact_state import Weighed
from fsm.model.contact.contact_forces import FrictionForce, NormalForce, laws_in_python
from fsm.model.contact.contact_memory import ContactDepths
from fsm.model.contact.contact_table import ContactTable
from fsm.solve.interface.records import PairState

_PRESLIDING = 1e-6
"""Tolerance of positions, relative to the deflection at which bristles slip."""
_STEPS, _FEWER_STEPS = 90, 30
"""Approximate minimum number of steps in an impact: first for laws with a coefficient of restitution, then for other
laws."""
_IMPACT_SPEED = 3.0
"""Closing speed, relative to the speed floor of its law, above which a contact is an impact."""


class _Evaluated(NamedTuple):
    """Number of the contacts of a state, which are in the first rows of the table, and whether bristles have a stiffness."""

    number: int
    weighed: Weighed
    bristles: bool


class ContactGroup(Group):
    """Contacts of one geometry.

    The table of the geometry holds the state. The methods call the functions of compiled steps on this table one by one,
    with laws that may be functions of a user in Python.

    Parameters
    ----------
    geometry : ContactTable
    normal : NormalForce
    friction : FrictionForce or None
    mobility : (n_bodies, 3 or 6) array
        Inverse masses and moments of inertia; zero for fixed degrees of freedom.
    loose : (n_bodies,) bool array
        Bodies that can move and have no force element.
    n_pairs : int

    Attributes
    ----------
    evaluations, changes : int
        Numbers of evaluated states, and of changes of the memory.
    """

    def __init__(
        self,
        geometry: ContactTable,
        normal: NormalForce,
        friction: FrictionForce | None,
        mobility: np.ndarray,
        loose: np.ndarray,
        n_pairs: int,
    ) -> None:
        self.geometry, self.normal, self.friction = geometry, normal, friction
        self.n_pairs, self.mobility, self._laws = n_pairs, mobility, laws_in_python(normal, friction)
        self.resolves = normal.law.restitution or bool(loose.any())
        self.evaluations = self.changes = 0
        self._renewals_before = 0
        self._linearised = np.zeros(0, dtype=np.int64)
        self._at: tuple[object, ...] = (None, None, None)
        self._version: tuple[int, int] = (-1, -1)
        self._found: _Evaluated | None = None
        geometry.size_for(len(mobility))
        geometry.table.put(mobility=np.ascontiguousarray(mobility), loose=loose.astype(np.int64))
        common, restitution = geometry.common, normal.law.restitution
        self._steps = _STEPS if restitution else _FEWER_STEPS
        rules = common.resolving
        rules[rows.RESTITUTION], rules[rows.FAST] = restitution, _IMPACT_SPEED * normal.speed_floor
        rules[rows.EXPONENT], rules[rows.STEPS], rules[rows.FLOOR] = normal.exponent, self._steps, normal.speed_floor
        common.state[rows.LOSSY] = self.rate_dependent
        if friction is not None:
            common.state[HAS_FRICTION], common.state[rows.BRISTLE] = 1, friction.law.bristle
            common.numbers[rows.ACROSS] = friction.across if geometry.slips == 3 else 1.0

    @property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return self.friction is not None or self.normal.law.rate_dependent(self.normal.params)

    def with_laws(self, normal: NormalForce, friction: FrictionForce | None) -> ContactGroup | None:
        """Group with the same table and other numbers in its laws, for Python; None if the table depends on these numbers.

        The groups share the memory. The mobility, which only impacts need, is that of this group.
        """
        other = copy.copy(self)
        other.normal, other.friction, other._laws = normal, friction, laws_in_python(normal, friction)
        across = [None if one is None else (one.law, one.across) for one in (friction, self.friction)]
        same = normal.law is self.normal.law and across[0] == across[1] and other.rate_dependent == self.rate_dependent
        return other if same else None

    def twin(self) -> ContactGroup:
        """Copy with a table of its own, for compiled steps."""
        found = ContactGroup(
            self.geometry.twin(), self.normal, self.friction, self.mobility, self.geometry.common.loose, self.n_pairs
        )
        friction = np.zeros(0) if self.friction is None else self.friction.params
        found.geometry.table.put(normal=np.ascontiguousarray(self.normal.params), friction=np.ascontiguousarray(friction))
        return found

    def follow(self, other: ContactGroup, resolve: bool) -> None:
        """Take the memory of another group. If `resolve` is true, steps must resolve impacts."""
        rules = self.geometry.common.resolving
        rules[:], rules[rows.RESOLVES] = other.geometry.common.resolving, resolve and self.resolves
        self.restore(other.memory())

    # forces ---------------------------------------------------------------------------------------------------------

    def _evaluate(self, at: BodyState, pressed: ContactDepths | None = None) -> _Evaluated | None:
        """Contacts of a state; cached for the same arrays (force, then energy)."""
        geometry = self.geometry
        geometry.refresh(at.poses)  # first, so that slots keep their numbers
        own, version = (at.poses, at.rates, pressed), (geometry.refreshes, geometry.touched)
        if version != self._version or any(one is not other for one, other in zip(own, self._at, strict=True)):
            self._found = self._find(at, pressed)
            self._at, self._version = own, (geometry.refreshes, geometry.touched)
        return self._found

    def _find(self, at: BodyState, pressed: ContactDepths | None) -> _Evaluated | None:
        geometry = self.geometry
        self.evaluations, geometry.touched = self.evaluations + 1, geometry.touched + 1  # for groups with the same table
        if pressed is None:
            count = geometry.search(at.poses, 0.0)
        else:
            geometry.press(pressed)
            count = int(contact_state.find_pressed(geometry.table, at.poses))
        if not count:
            return None
        mean_rates, at_depths = at.past is not None, pressed is not None
        found = contact_state.evaluate(
            geometry.table, self._laws, float(at.t), at.poses, at.rates, mean_rates, count, at_depths
        )
        return _Evaluated(count, *found)

    def pressed(self, most: float) -> ContactDepths:
        """Depths in the last accepted state; see `ContactDepths`."""
        kept = self.geometry.contacts()
        return ContactDepths(kept.key, kept.depth, most)

    def press(self, at: BodyState, change: np.ndarray, pressed: ContactDepths) -> ContactDepths:
        """Depths after a change (n_bodies, 3 or 6) of the poses, to first order; contacts that would pull are released."""
        found, geometry = self._evaluate(at, pressed), self.geometry
        if found is None:
            return ContactDepths(pressed.key[:0], pressed.depth[:0], pressed.most)
        depth = array_contacts.advanced(
            geometry.table, found.number, change, 0.0 if at.past is None else 1.0 / at.past.duration
        )
        key, pressing = geometry.keys(geometry.common.slot[: found.number]), depth > 0.0
        return ContactDepths(key[pressing], depth[pressing], pressed.most)

    def add_force(self, at: BodyState, force: np.ndarray) -> None:
        """See `Group`."""
        found = self._evaluate(at)
        if found is not None:
            self._add_forces(found, force)

    def _add_forces(self, found: _Evaluated, force: np.ndarray) -> None:
        table = self.geometry.table
        contact_state.add_forces(
            table, found.weighed, contact_state.taper_energy(table, self._laws, found.weighed.rows), found.number, force
        )

    def add_linearised(self, at: BodyState, sums: BlockSums, pressed: ContactDepths | None = None) -> None:
        """See `Group`; with `pressed`, the normal law is linearised at those depths."""
        found = self._evaluate(at, pressed)
        self._linearised = self._loaded_keys(found)
        if found is None:
            return
        self._add_forces(found, sums.force)
        of_state = found.weighed, found.bristles, at.poses, at.rates, found.number, *sums[2:]
        self.geometry.call_with(sums.pattern, array_contacts.add_tangent, self._laws, *of_state)

    def touching(self) -> tuple[int, bool]:
        """See `fsm.model.contact.contact_set.ContactSet`."""
        loaded = self._loaded_keys(self._found)
        return len(loaded), not np.isin(self._linearised, loaded).all()

    def _loaded_keys(self, found: _Evaluated | None) -> np.ndarray:
        """Keys of contacts with a force; a closed contact that opens fast may have none."""
        if found is None:
            return np.zeros(0, dtype=np.int64)
        g = self.geometry.common
        return self.geometry.keys(g.slot[: found.number][g.normal_force[: found.number] > 0.0])

    # results --------------------------------------------------------------------------------------------------------

    def energy(self, at: BodyState) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        found, g = self._evaluate(at), self.geometry.common
        if found is None:
            return {"contact": 0.0}, 0.0, 0.0
        stored = self._laws.energy(-g.gap[: found.number], g.share_of[: found.number], None)
        return {"contact": float(stored.sum())}, float(self._sums(found.number)[SLIDING:].sum()), 0.0

    def pair_power(self, at: BodyState) -> np.ndarray:
        """Power that friction and damping of every pair dissipate, (2, n_pairs), W."""
        found = self._evaluate(at)
        return np.zeros((2, self.n_pairs)) if found is None else self._sums(found.number)[SLIDING:]

    def _sums(self, count: int) -> np.ndarray:
        """Sums (6, n_pairs) over the contacts of every pair; see `sums_of_pairs`."""
        return np.asarray(array_contacts.sums(self.geometry.table, self._laws, count, self.n_pairs))

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.geometry.pairs(poses)

    def observe(self, at: BodyState) -> PairState:
        """State of the pairs in this group; gaps are at most the margin."""
        geometry, gap = self.geometry, np.full(self.n_pairs, self.geometry.margin)
        near = geometry.find(at.poses, geometry.margin)
        smallest_gaps(geometry.pair, near.slot, np.maximum(near.gap, 0.0), gap)
        found = self._evaluate(at)
        if found is None:
            none = np.zeros(self.n_pairs)
            return PairState(none, gap, none, none, none, none, none)
        array_contacts.deepest_of_pairs(geometry.table, found.weighed.rows, found.number, gap)
        of_pair = self._sums(found.number)
        force = of_pair[FORCE]
        slip = np.divide(of_pair[CARRIED], force, out=np.zeros(self.n_pairs), where=force > 0.0)
        return PairState(force, gap, of_pair[AREA], of_pair[FRICTION], slip, of_pair[SLIDING], of_pair[DAMPING])

    def normal_forces(self, at: BodyState) -> tuple[np.ndarray, np.ndarray]:
        """Slots in contact, and their normal forces, N."""
        found, g = self._evaluate(at), self.geometry.common
        count = 0 if found is None else found.number
        return g.slot[:count].copy(), g.normal_force[:count].copy()

    @property
    def renewals(self) -> int:
        """Number of renewals of the broad phase."""
        return self.geometry.refreshes - self._renewals_before

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, at: BodyState) -> None:
        """Update the memory after an accepted step: onset of contacts and deflection of bristles."""
        found = self._evaluate(at)
        share = np.full(0 if found is None else found.number, CORNER_WEIGHT)
        array_contacts.accept_group(self.geometry.table, self._unit_energies(share), float(at.t), at.poses, at.rates)
        self._changed()

    def _changed(self) -> None:
        self.changes, self._version, self._found = self.changes + 1, (-1, -1), None
        self.geometry.touched += 1

    def memory(self) -> np.ndarray:
        """Memory as one flat array; empty before the first commit."""
        return self.geometry.memory()

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory; an empty array clears it."""
        self.geometry.restore(memory)
        self._changed()

    def clear_caches(self, evaluations: int, renewals: int) -> None:
        """Clear all caches and continue the counters from these values."""
        self._version, self._found, self._linearised = (-1, -1), None, np.zeros(0, dtype=np.int64)
        self.geometry.clear_caches()
        self.evaluations, self._renewals_before = evaluations, self.geometry.refreshes - renewals

    # steps ----------------------------------------------------------------------------------------------------------

    @property
    def resolution(self) -> float:
        """Tolerance of positions that the contact forces require, m.

        The error of an iteration bends the bristles. A deflection beyond the slip limit is not recovered. A plate at rest
        would therefore creep by the tolerance of Newton's method in each step.
        """
        return np.inf if self.friction is None else _PRESLIDING * self.friction.presliding

    def fraction_before_impacts(self, at: BodyState, step: float) -> float:
        """Fraction of a step that ends before its impacts begin; see `fsm.interactions.contact.impacts`."""
        geometry = self.geometry
        started = geometry.common.state[rows.STARTED] == 1 and self.resolves
        found = self._evaluate(at) if started else None
        if found is None:
            return 1.0
        share = geometry.share[geometry.common.slot[: found.number]]
        return float(array_contacts.part_before_impacts(geometry.table, self._unit_energies(share), step))

    def longest_step(self, at: BodyState) -> float:
        """Longest step that resolves present and imminent impacts, s."""
        geometry = self.geometry
        count = geometry.search(at.poses, geometry.margin) if self.resolves else 0
        if not count:
            return np.inf
        geometry.touched += 1
        contact_state.measure_slots(geometry.table, at.poses, at.rates, count)
        of_unit = self._unit_energies(geometry.share[geometry.common.slot[:count]])
        return float(array_contacts.longest_of_impacts(geometry.table, of_unit, float(at.t), at.rates))

    def _unit_energies(self, share: np.ndarray) -> np.ndarray:
        return contact_state.unit_energies(self.geometry.table, self._laws, share)

    def coarsen(self, factor: float) -> None:
        """Multiply the step sizes that resolve impacts by a factor."""
        self.geometry.common.resolving[rows.STEPS] = self._steps / factor

    def count(self, twin: ContactGroup) -> None:
        """Add the number of states that compiled steps have evaluated on a twin."""
        self.evaluations += int(twin.geometry.common.state[rows.EVALUATIONS])
        twin.geometry.common.state[rows.EVALUATIONS] = 0
