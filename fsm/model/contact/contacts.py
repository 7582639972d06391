"""Contact and friction as a group: the laws of the contacts of one geometry, whose state is in its table."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.contact.anisotropic_friction import add_turn_stiffness, stretch, stretch_efforts
from fsm.interactions.contact.bristle import add_way_stiffness
from fsm.interactions.contact.impacts import CORNER_WEIGHT, shared_weight
from fsm.interactions.contact.pair_sums import AREA, CARRIED, DAMPING, FORCE, FRICTION, SLIDING, smallest_gaps
from fsm.interactions.surfaces.end_taper import add_taper_tangent
from fsm.model.bodies.contact_arrays import (
    ACROSS,
    BRISTLE,
    EVALUATIONS,
    EXPONENT,
    FAST,
    FLOOR,
    LOSSY,
    RESOLVES,
    RESTITUTION,
    STARTED,
    STEPS,
)
from fsm.model.bodies.contact_arrays import FRICTION as HAS_FRICTION
from fsm.model.bodies.group import Group, PreviousPoses
from fsm.model.bodies.pattern import BodyPattern
from fsm.model.contact.array_contact_state import (
    Weighed,
    add_forces,
    any_limited,
    bristle_arguments,
    find_pressed,
    measure_slots,
    prepare,
    set_depths,
    taper_arguments,
    write_bristles,
    write_friction,
    write_normal,
)
from fsm.model.contact.array_contacts import (
    accept_group,
    advanced,
    deepest_of_pairs,
    longest_of_impacts,
    part_before_impacts,
    sums_of_contacts,
)
from fsm.model.contact.contact_forces import FrictionForce, NormalForce
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

    The table of the geometry holds the state. The methods call the kernels of compiled steps on this table one by one; only
    the laws, which may be functions of a user in Python, are called from here.

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
        self.n_pairs, self.mobility = n_pairs, mobility
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
        rules[RESTITUTION], rules[FAST] = restitution, _IMPACT_SPEED * normal.speed_floor
        rules[EXPONENT], rules[STEPS], rules[FLOOR] = normal.exponent, self._steps, normal.speed_floor
        common.state[LOSSY] = self.rate_dependent
        if friction is not None:
            common.state[HAS_FRICTION], common.state[BRISTLE] = 1, friction.law.bristle
            common.numbers[ACROSS] = friction.across if geometry.slips == 3 else 1.0

    @property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return self.friction is not None or self.normal.law.rate_dependent(self.normal.params)

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
        rules[:], rules[RESOLVES] = other.geometry.common.resolving, resolve and self.resolves
        self.restore(other.memory())

    # forces ---------------------------------------------------------------------------------------------------------

    def _evaluate(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        past: PreviousPoses | None,
        pressed: ContactDepths | None = None,
    ) -> _Evaluated | None:
        """Contacts of a state; cached for the same arrays (force, then energy)."""
        geometry = self.geometry
        geometry.refresh(poses)  # first, so that slots keep their numbers
        at, version = (poses, rates, pressed), (geometry.refreshes, geometry.touched)
        if version != self._version or any(one is not other for one, other in zip(at, self._at, strict=True)):
            self._found = self._find(t, poses, rates, past, pressed)
            self._at, self._version = at, (geometry.refreshes, geometry.touched)
        return self._found

    def _find(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None, pressed: ContactDepths | None
    ) -> _Evaluated | None:
        geometry, law, params = self.geometry, self.normal.law, self.normal.params
        self.evaluations += 1
        if pressed is None:
            count = geometry.search(poses, 0.0)
        else:
            geometry.press(pressed)
            count = int(geometry.call(find_pressed, poses))
        if not count:
            return None
        table, g = geometry.table, geometry.common
        weighed = geometry.call(prepare, poses, rates, count)
        at, rest = g.at[:count], (g.closing[:count], g.onset_of[:count], g.share_of[:count], params)
        if pressed is not None:
            force = _floats(law.force(at, *rest)[0]) if any_limited(table, count) else np.zeros(0)
            set_depths(table, force, weighed.rows, count)
        normal, slopes = law.force(at, *rest)
        write_normal(table, _floats(normal), _floats(slopes))
        return _Evaluated(count, weighed, self._set_friction(t, poses, past is not None, count))

    def _set_friction(self, t: float, poses: np.ndarray, mean_rates: bool, count: int) -> bool:
        """Write friction and its derivatives; return whether bristles have a stiffness."""
        friction, table, g = self.friction, self.geometry.table, self.geometry.common
        if friction is None:
            return False
        slip, normal, bodies = g.slip[:count], g.normal_force[:count], g.bodies[:count]
        across, mean, duration, deflected = g.numbers[ACROSS], slip[:0], 0.0, slip
        by_mean = g.by_slip[:0]
        if friction.law.bristle:
            mean, deflection, duration = bristle_arguments(table, float(t), poses, mean_rates, count)
        seen = mean
        if across != 1.0:
            seen = mean.copy()
            stretch(slip, poses, bodies, across)
            stretch(seen, poses, bodies, across)
        if friction.law.bristle:
            results = friction.law.effort(slip, seen, normal, deflection, duration, friction.params)
            effort, by_slip, by_mean, by_normal, deflected = map(_floats, results)
        else:
            effort, by_slip, by_normal = map(_floats, friction.law.effort(slip, normal, friction.params))
        if across != 1.0:
            of_rate = g.rate[:count], mean, effort, by_slip, by_mean, by_normal, g.by_turn[:count]
            stretch_efforts(poses, bodies, across, *of_rate)
        write_friction(table, effort, by_slip, by_normal)
        return bool(friction.law.bristle and write_bristles(table, by_mean, deflected, duration, mean_rates))

    def pressed(self, most: float) -> ContactDepths:
        """Depths in the last accepted state; see `ContactDepths`."""
        kept = self.geometry.contacts()
        return ContactDepths(kept.key, kept.depth, most)

    def press(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        change: np.ndarray,
        past: PreviousPoses | None,
        pressed: ContactDepths,
    ) -> ContactDepths:
        """Depths after a change (n_bodies, 3 or 6) of the poses, to first order; contacts that would pull are released."""
        found, geometry = self._evaluate(t, poses, rates, past, pressed), self.geometry
        if found is None:
            return ContactDepths(pressed.key[:0], pressed.depth[:0], pressed.most)
        depth = advanced(geometry.table, found.number, change, 0.0 if past is None else 1.0 / past.duration)
        key, pressing = geometry.keys(geometry.common.slot[: found.number]), depth > 0.0
        return ContactDepths(key[pressing], depth[pressing], pressed.most)

    def _taper_energy(self, rows: np.ndarray) -> np.ndarray:
        """Energies of contacts whose weights change with the poses, J."""
        if not len(rows):
            return np.zeros(0)
        depth, whole = taper_arguments(self.geometry.table, rows)
        return _floats(self.normal.law.energy(depth, whole, self.normal.params))

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        found = self._evaluate(t, poses, rates, past)
        if found is not None:
            energy = self._taper_energy(found.weighed.rows)
            add_forces(self.geometry.table, found.weighed, energy, found.number, force)

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: PreviousPoses | None = None,
        pressed: ContactDepths | None = None,
    ) -> None:
        """See `Group`; with `pressed`, the normal law is linearised at those depths."""
        found, g = self._evaluate(t, poses, rates, past, pressed), self.geometry.common
        self._linearised = self._loaded_keys(found)
        if found is None:
            return
        count, rows = found.number, found.weighed.rows
        energy, (bodies, gradient) = self._taper_energy(rows), (g.bodies[:count], g.gradient[:count])
        add_forces(self.geometry.table, found.weighed, energy, count, force)
        self.geometry.add_tangent(poses, rates, count, pattern, stiffness, damping)
        if len(rows):
            depth, whole = taper_arguments(self.geometry.table, rows)
            normal, _ = self.normal.law.force(depth, -g.rate[rows, 0], g.onset_of[rows], whole, self.normal.params)
            add_taper_tangent(
                bodies, gradient, *found.weighed, energy, self.normal.elastic(depth, whole), _floats(normal),
                g.by_normal[:count], *pattern.index, stiffness,
            )  # fmt: skip
        if g.numbers[ACROSS] != 1.0:
            add_turn_stiffness(bodies, gradient, g.by_turn[:count], *pattern.index, stiffness)
        if found.bristles:
            add_way_stiffness(bodies, gradient, g.by_distance[:count], *pattern.index, stiffness)

    def contacts_opened(self) -> bool:
        """Whether contacts that were active at the last linearisation are inactive at the last evaluated state."""
        return not np.isin(self._linearised, self._loaded_keys(self._found)).all()

    def _loaded_keys(self, found: _Evaluated | None) -> np.ndarray:
        """Keys of contacts with a force; a closed contact that opens fast may have none."""
        if found is None:
            return np.zeros(0, dtype=np.int64)
        g = self.geometry.common
        return self.geometry.keys(g.slot[: found.number][g.normal_force[: found.number] > 0.0])

    # results --------------------------------------------------------------------------------------------------------

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        found, g = self._evaluate(t, poses, rates, past), self.geometry.common
        if found is None:
            return {"contact": 0.0}, 0.0, 0.0
        stored = self.normal.law.energy(-g.gap[: found.number], g.share_of[: found.number], self.normal.params)
        return {"contact": float(stored.sum())}, float(self._sums(found.number)[SLIDING:].sum()), 0.0

    def pair_power(self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None) -> np.ndarray:
        """Power that friction and damping of every pair dissipate, (2, n_pairs), W."""
        found = self._evaluate(t, poses, rates, past)
        return np.zeros((2, self.n_pairs)) if found is None else self._sums(found.number)[SLIDING:]

    def _sums(self, count: int) -> np.ndarray:
        """Sums (6, n_pairs) over the contacts of every pair; see `sums_of_pairs`."""
        g = self.geometry.common
        elastic = self.normal.elastic(-g.gap[:count], g.share_of[:count])
        return np.asarray(sums_of_contacts(self.geometry.table, elastic, self.n_pairs))

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.geometry.pairs(poses)

    def observe(self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None) -> PairState:
        """State of the pairs in this group; gaps are at most the margin."""
        geometry, gap = self.geometry, np.full(self.n_pairs, self.geometry.margin)
        near = geometry.find(poses, geometry.margin)
        smallest_gaps(geometry.pair, near.slot, np.maximum(near.gap, 0.0), gap)
        found = self._evaluate(t, poses, rates, past)
        if found is None:
            none = np.zeros(self.n_pairs)
            return PairState(none, gap, none, none, none, none, none)
        deepest_of_pairs(geometry.table, found.weighed.rows, found.number, gap)
        sums = self._sums(found.number)
        force = sums[FORCE]
        slip = np.divide(sums[CARRIED], force, out=np.zeros(self.n_pairs), where=force > 0.0)
        return PairState(force, gap, sums[AREA], sums[FRICTION], slip, sums[SLIDING], sums[DAMPING])

    def normal_forces(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Slots in contact, and their normal forces, N."""
        found, g = self._evaluate(t, poses, rates, past), self.geometry.common
        count = 0 if found is None else found.number
        return g.slot[:count].copy(), g.normal_force[:count].copy()

    @property
    def renewals(self) -> int:
        """Number of renewals of the broad phase."""
        return self.geometry.refreshes - self._renewals_before

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None) -> None:
        """Update the memory after an accepted step: onset of contacts and deflection of bristles."""
        found = self._evaluate(t, poses, rates, past)
        unit_energy = self._unit_energy(np.full(0 if found is None else found.number, CORNER_WEIGHT))
        self.geometry.call(accept_group, unit_energy, float(t), poses, rates)
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

    def fraction_before_impacts(self, t: float, poses: np.ndarray, rates: np.ndarray, step: float) -> float:
        """Fraction of a step that ends before its impacts begin; see `fsm.interactions.contact.impacts`."""
        geometry = self.geometry
        started = geometry.common.state[STARTED] == 1 and self.resolves
        found = self._evaluate(t, poses, rates, None) if started else None
        if found is None:
            return 1.0
        share = geometry.share[geometry.common.slot[: found.number]]
        return float(part_before_impacts(geometry.table, self._unit_energy(share), step))

    def longest_step(self, t: float, poses: np.ndarray, rates: np.ndarray) -> float:
        """Longest step that resolves present and imminent impacts, s."""
        geometry = self.geometry
        count = geometry.search(poses, geometry.margin) if self.resolves else 0
        if not count:
            return np.inf
        geometry.touched += 1
        geometry.call(measure_slots, poses, rates, count)
        unit_energy = self._unit_energy(geometry.share[geometry.common.slot[:count]])
        return float(longest_of_impacts(geometry.table, unit_energy, float(t), rates))

    def _unit_energy(self, share: np.ndarray) -> np.ndarray:
        """Energies (m,) at the depth 1 m, J."""
        return _floats(self.normal.law.energy(np.ones(len(share)), shared_weight(share), self.normal.params))

    def coarsen(self, factor: float) -> None:
        """Multiply the step sizes that resolve impacts by a factor."""
        self.geometry.common.resolving[STEPS] = self._steps / factor

    def count(self, twin: ContactGroup) -> None:
        """Add the number of states that compiled steps have evaluated on a twin."""
        self.evaluations += int(twin.geometry.common.state[EVALUATIONS])
        twin.geometry.common.state[EVALUATIONS] = 0


def _floats(values: np.ndarray) -> np.ndarray:
    """Contiguous array of a law, which may be a function of a user."""
    return np.ascontiguousarray(values, dtype=float)
