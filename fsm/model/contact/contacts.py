"""Contact and friction as a group: geometry, force laws and memory of the contacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fsm.interactions.contact.anisotropic_friction import add_turn_stiffness, axes_of
from fsm.interactions.contact.bristle import add_way_stiffness, carried
from fsm.interactions.contact.pair_sums import AREA, CARRIED, DAMPING, FORCE, FRICTION, SLIDING, smallest_gaps, sums_of_pairs
from fsm.interactions.contact.shapes import ContactForces
from fsm.interactions.surfaces.end_taper import add_taper_tangent
from fsm.kernels.body_poses import pose_difference
from fsm.kernels.keys import find_keys
from fsm.kernels.scatter import scatter_efforts
from fsm.model.bodies.group import Group, PreviousPoses
from fsm.model.bodies.pattern import BodyPattern
from fsm.model.contact.contact_depths import ContactDepths
from fsm.model.contact.contact_geometry import ActiveContacts, ContactGeometry, ContactKinematics, Tapered
from fsm.model.contact.contact_memory import ContactMemory
from fsm.model.contact.contact_state import ContactState
from fsm.model.contact.friction_force import FrictionForce, FrictionForces
from fsm.model.contact.impacts import Impacts
from fsm.model.contact.normal_force import NormalForce
from fsm.solve.interface.records import PairState

_PRESLIDING = 1e-6
"""Tolerance of positions, relative to the deflection at which bristles slip."""


class ContactGroup(Group):
    """Contacts of one geometry.

    The memory is stored by the keys of slots. The memory holds the closing speed at the start of a contact, for laws with a
    coefficient of restitution. The memory also holds the deflection of the bristles and the memory of the geometry. The
    memory changes only when a step is accepted, so forces between steps are functions of the state.

    Parameters
    ----------
    geometry : ContactGeometry
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
        geometry: ContactGeometry,
        normal: NormalForce,
        friction: FrictionForce | None,
        mobility: np.ndarray,
        loose: np.ndarray,
        n_pairs: int,
    ) -> None:
        self.geometry, self.normal, self.friction = geometry, normal, friction
        self.n_pairs = n_pairs
        self.impacts = Impacts(geometry, normal, mobility, loose)
        self.evaluations = self.changes = 0
        self._renewals_before = 0
        self._contact_memory = ContactMemory.nothing(geometry.slips)
        self._time = 0.0
        self._poses: np.ndarray | None = None
        self._rates = np.zeros((0, 0))
        self._linearised = np.zeros(0, dtype=np.int64)
        self._evaluated: tuple[np.ndarray, np.ndarray, int, ContactDepths | None, ContactState | None] | None = None
        self._searches: dict[float, tuple[np.ndarray, int, ActiveContacts]] = {}

    @property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return self.friction is not None or self.normal.law.rate_dependent(self.normal.params)

    # forces ---------------------------------------------------------------------------------------------------------

    def _contacts(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None,
        pressed: ContactDepths | None = None,
    ) -> ContactState | None:
        """Contacts of a state; cached for the same arrays (force, then energy)."""
        _, version = self.geometry.pairs(poses)
        last = self._evaluated
        same = last is not None and last[0] is poses and last[1] is rates and last[2] == version
        if last is None or not same or last[3] is not pressed:
            last = self._evaluated = (poses, rates, version, pressed, self._find(t, poses, rates, past, pressed))
        return last[4]

    def _find(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None, pressed: ContactDepths | None
    ) -> ContactState | None:
        geometry = self.geometry
        self.evaluations += 1
        touching = self._touching(poses, 0.0) if pressed is None else self._active(poses, pressed)
        slot = touching.slot
        if not len(slot):
            return None
        measured = geometry.measure(poses, rates, touching)
        depth, slip, share = -touching.gap, np.ascontiguousarray(measured.rate[:, 1:]), geometry.share[slot]
        if measured.tapered is not None:
            share[measured.tapered.rows] *= measured.tapered.part
        memory = self._memory_of(touching)
        closing, at = -measured.rate[:, 0], depth
        if pressed is not None:
            at = pressed.at(memory.key, depth, closing, memory.onset, share, self.normal)
            if measured.tapered is not None:  # tapered contacts are linearised at their geometric depth
                at[measured.tapered.rows] = depth[measured.tapered.rows]
        normal, slopes = self.normal.law.force(at, closing, memory.onset, share, self.normal.params)
        acting = normal if pressed is None else normal + slopes[:, 0] * (depth - at)
        pull, by_distance = self._friction_forces(t, poses, past, measured, slip, normal, memory.deflection)
        forces = ContactForces(
            normal,
            np.ascontiguousarray(slopes[:, 0]),
            np.ascontiguousarray(slopes[:, 1]),
            pull.effort,
            pull.by_slip,
            pull.by_normal,
            self.friction is not None,
        )
        return ContactState(
            touching, memory, depth, share, measured, at, acting, forces, pull.deflection, by_distance, pull.by_turn
        )

    def pressed(self, most: float) -> ContactDepths:
        """Depths in the last accepted state; see `ContactDepths`."""
        return ContactDepths(self._contact_memory.key, self._contact_memory.depth, most)

    def press(
        self, t: float, poses: np.ndarray, rates: np.ndarray, change: np.ndarray, past: PreviousPoses | None,
        pressed: ContactDepths,
    ) -> ContactDepths:
        """Depths after a change (n_bodies, 3 or 6) of the poses, see `ContactDepths.advanced`."""
        found = self._contacts(t, poses, rates, past, pressed)
        if found is None:
            return ContactDepths(pressed.key[:0], pressed.depth[:0], pressed.most)
        per_second = 0.0 if past is None else 1.0 / past.duration
        return pressed.advanced(
            found.memory.key, found.measured, found.at, found.acting, found.forces, change, per_second
        )

    def _friction_forces(
        self,
        t: float,
        poses: np.ndarray,
        past: PreviousPoses | None,
        measured: ContactKinematics,
        slip: np.ndarray,
        normal: np.ndarray,
        deflection: np.ndarray,
    ) -> tuple[FrictionForces, np.ndarray | None]:
        """Friction, and its stiffness by the slip distance of the bristles (N/m)."""
        friction, (count, slips) = self.friction, slip.shape
        if friction is None:
            nothing = np.zeros((count, slips))
            return FrictionForces(nothing, np.zeros((count, slips, slips)), None, nothing, nothing), None
        mean, duration = slip, 0.0
        if friction.law.bristle:
            duration = max(0.0, t - self._time)
            mean = slip if past is not None else self._mean_slip(poses, measured, slip, duration)
        isotropic = friction.across == 1.0 or slips == 1
        axes = None if isotropic else axes_of(poses, np.ascontiguousarray(measured.bodies[:, 0]))
        pull = friction.pull(slip, mean, normal, deflection, duration, axes)
        if pull.by_mean is None:
            return pull, None
        if past is not None:
            return replace(pull, by_slip=pull.by_slip + pull.by_mean), None
        return pull, pull.by_mean / duration if duration > 0.0 else None

    def _touching(self, poses: np.ndarray, below: float) -> ActiveContacts:
        """Slots with a gap below a bound (m); the result is cached for the same poses with other rates."""
        _, version = self.geometry.pairs(poses)  # renews the broad phase first, so that slots keep their numbers
        known = self._searches.get(below)
        if known is None or known[1] != version or not (known[0] is poses or np.array_equal(known[0], poses)):
            known = self._searches[below] = poses, version, self.geometry.find(poses, below)
        return known[2]

    def _active(self, poses: np.ndarray, pressed: ContactDepths) -> ActiveContacts:
        """Active contacts, including contacts that an iteration has opened slightly but that still have a force."""
        touching = self._touching(poses, 0.0)
        among = find_keys(pressed.key, self.geometry.keys(touching.slot))
        if np.count_nonzero(among >= 0) == len(pressed.key):
            return touching
        near = self._touching(poses, self.geometry.margin)
        active = (near.gap < 0.0) | (find_keys(pressed.key, self.geometry.keys(near.slot)) >= 0)
        return ActiveContacts(near.slot[active], near.gap[active], tuple(values[active] for values in near.at))

    def _memory_of(self, touching: ActiveContacts) -> ContactMemory:
        """Memory of the contacts."""
        return self._contact_memory.of(self.geometry.keys(touching.slot))

    def _mean_slip(self, poses: np.ndarray, measured: ContactKinematics, slip: np.ndarray, duration: float) -> np.ndarray:
        """Mean slip velocity since the last accepted state, which determines the deflection of the bristles.

        If the present velocity determined it, deflections and positions would drift apart by the integration error.
        """
        if duration == 0.0 or self._poses is None:
            return slip
        moved = poses - self._poses
        if self.geometry.slips == 3:
            moved = pose_difference(self._poses.ravel(), poses.ravel()).reshape(-1, 6)
        distance = np.einsum("ncm,nm->nc", measured.gradient[:, 1:], moved[measured.bodies].reshape(len(slip), -1))
        return np.ascontiguousarray(distance / duration)

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        found = self._contacts(t, poses, rates, past)
        if found is not None:
            self._scatter(found, force)

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
        found = self._contacts(t, poses, rates, past, pressed)
        self._linearised = self._loaded_keys(found)
        if found is None:
            return
        self._scatter(found, force)
        self.geometry.add_tangent(
            poses, rates, found.touching, found.measured, found.forces, pattern, stiffness, damping
        )
        if found.measured.tapered is not None:
            self._add_taper_tangent(found, found.measured.tapered, pattern, stiffness)
        if found.by_turn is not None:
            add_turn_stiffness(found.measured.bodies, found.measured.gradient, found.by_turn, *pattern.index, stiffness)
        if found.by_distance is not None:
            add_way_stiffness(found.measured.bodies, found.measured.gradient, found.by_distance, *pattern.index, stiffness)

    def _scatter(self, found: ContactState, force: np.ndarray) -> None:
        measured, tapered = found.measured, found.measured.tapered
        effort = -found.acting[:, None]
        if found.forces.friction:
            pull = found.forces.effort
            if found.acting is not found.forces.normal:
                pull = pull + found.forces.by_normal * (found.acting - found.forces.normal)[:, None]
            effort = np.concatenate([effort, pull], axis=1)
        scatter_efforts(measured.bodies, measured.gradient, effort, len(effort), force)
        if tapered is not None:  # force due to the change of the overlap with the pose
            rows = tapered.rows
            whole = self.geometry.share[found.touching.slot[rows]]
            energy = self.normal.law.energy(found.depth[rows], whole, self.normal.params)
            scatter_efforts(measured.bodies[rows], tapered.gradient[:, None], energy[:, None], len(rows), force)

    def _add_taper_tangent(
        self, found: ContactState, tapered: Tapered, pattern: BodyPattern, stiffness: np.ndarray
    ) -> None:
        rows, params, law = tapered.rows, self.normal.params, self.normal.law
        depth, onset = found.depth[rows], found.memory.onset[rows]
        whole = self.geometry.share[found.touching.slot[rows]]
        normal, _ = law.force(depth, -found.measured.rate[rows, 0], onset, whole, params)
        add_taper_tangent(
            found.measured.bodies, found.measured.gradient, rows, tapered.gradient, tapered.hessian,
            law.energy(depth, whole, params), self.normal.elastic(depth, whole), normal, found.forces.by_normal,
            *pattern.index, stiffness,
        )  # fmt: skip

    def contacts_opened(self) -> bool:
        """Whether contacts that were active at the last linearisation are inactive at the last evaluated state."""
        found = None if self._evaluated is None else self._evaluated[4]
        return not np.isin(self._linearised, self._loaded_keys(found)).all()

    def _loaded_keys(self, found: ContactState | None) -> np.ndarray:
        """Keys of contacts with a force; a closed contact that opens fast may have none."""
        if found is None:
            return np.zeros(0, dtype=np.int64)
        return found.memory.key[found.forces.normal > 0.0]

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        found = self._contacts(t, poses, rates, past)
        if found is None:
            return {"contact": 0.0}, 0.0, 0.0
        stored = self.normal.law.energy(found.depth, found.share, self.normal.params)
        return {"contact": float(stored.sum())}, float(self._sums(found)[SLIDING:].sum()), 0.0

    def pair_power(self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None) -> np.ndarray:
        """Power that friction and damping of every pair dissipate, (2, n_pairs), W."""
        found = self._contacts(t, poses, rates, past)
        if found is None:
            return np.zeros((2, self.n_pairs))
        return self._sums(found)[SLIDING:]

    def _sums(self, found: ContactState) -> np.ndarray:
        """Sums (6, n_pairs) over the contacts of every pair; see `sums_of_pairs`."""
        if found.sums is None:
            geometry, forces, slot = self.geometry, found.forces, found.touching.slot
            part, elastic = found.share / geometry.share[slot], self.normal.elastic(found.depth, found.share)
            found.sums = sums_of_pairs(
                geometry.pair, slot, geometry.area, part, forces.normal, elastic, found.measured.rate, forces.effort,
                self.n_pairs,
            )  # fmt: skip
        return found.sums

    # results --------------------------------------------------------------------------------------------------------

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.geometry.pairs(poses)

    def observe(self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None) -> PairState:
        """State of the pairs in this group; gaps are at most the margin."""
        geometry = self.geometry
        gap = np.full(self.n_pairs, geometry.margin)
        near = self._touching(poses, geometry.margin)
        found = self._contacts(t, poses, rates, past)
        smallest_gaps(geometry.pair, near.slot, np.maximum(near.gap, 0.0), gap)
        if found is None:
            none = np.zeros(self.n_pairs)
            return PairState(none, gap, none, none, none, none, none)
        slot = found.touching.slot
        deep, tapered = found.depth, found.measured.tapered
        if tapered is not None and tapered.fades:
            deep = deep * np.minimum(found.share / geometry.share[slot], 1.0)
        smallest_gaps(geometry.pair, slot, -deep, gap)
        sums = self._sums(found)
        force = sums[FORCE]
        slip = np.divide(sums[CARRIED], force, out=np.zeros(self.n_pairs), where=force > 0.0)
        return PairState(force, gap, sums[AREA], sums[FRICTION], slip, sums[SLIDING], sums[DAMPING])

    def normal_forces(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Slots in contact, and their normal forces, N."""
        found = self._contacts(t, poses, rates, past)
        if found is None:
            return np.zeros(0, dtype=np.int64), np.zeros(0)
        return found.touching.slot, found.forces.normal

    @property
    def renewals(self) -> int:
        """Number of renewals of the broad phase."""
        return self.geometry.refreshes - self._renewals_before

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None) -> None:
        """Update the memory after an accepted step: onset of contacts and deflection of bristles."""
        found = self._contacts(t, poses, rates, past)
        memory = ContactMemory.nothing(self.geometry.slips)
        if found is not None:
            before = found.memory
            # an external force may close an impact faster than its initial speed
            closing = np.maximum(-found.measured.rate[:, 0], self.normal.speed_floor)
            deflection = found.deflection
            if self._poses is not None and self.geometry.slips == 3 and self.friction is not None:
                deflection = carried(deflection, self._poses, poses, found.measured.bodies[:, 0])
            began = np.where(before.onset == 0.0, t, before.began)
            onset = np.maximum(before.onset, closing)
            memory = ContactMemory(found.memory.key, onset, began, found.depth, deflection).ordered()
        self._contact_memory = memory
        self.changes += 1
        self._time, self._poses, self._rates = t, poses, rates
        young = np.zeros(0, dtype=np.int64)
        if found is not None:
            young = found.touching.slot[self.impacts.young(t - began, found.measured, onset)]
        self.geometry.commit(poses, young)
        self._evaluated = None
        self._searches.clear()  # the sides of points may have changed

    def memory(self) -> np.ndarray:
        """Memory as one flat array; empty before the first commit."""
        if self._poses is None:
            return np.zeros(0)
        own = (self._contact_memory.flat(), self._poses.ravel(), self._rates.ravel())
        return np.concatenate([[self._time], *own, self.geometry.memory()])

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory; an empty array clears it."""
        self.changes += 1
        self._evaluated = None
        self._searches.clear()
        if not len(memory):
            self._contact_memory = ContactMemory.nothing(self.geometry.slips)
            self._time, self._poses = 0.0, None
            self.geometry.restore(memory)
            return
        self._time = float(memory[0])
        self._contact_memory, rest = ContactMemory.from_flat(memory[1:], self.geometry.slips)
        bodies, size = self.impacts.mobility.shape
        width = 3 if size == 3 else 7
        poses, rates, of_geometry = np.split(rest, np.cumsum([bodies * width, bodies * size]))
        self._poses, self._rates = poses.reshape(bodies, width), rates.reshape(bodies, size)
        self.geometry.restore(of_geometry)

    def clear_caches(self, evaluations: int, renewals: int) -> None:
        """Clear all caches and continue the counters from these values."""
        self._evaluated = None
        self._searches.clear()
        self._linearised = np.zeros(0, dtype=np.int64)
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
        """Fraction of a step that ends before its impacts begin; see `Impacts`."""
        found = self._contacts(t, poses, rates, None) if self._poses is not None and self.resolves else None
        if found is None:
            return 1.0
        return self.impacts.fraction_before(
            found.touching, found.measured, found.forces.normal, found.memory.onset, self._rates, step
        )

    def longest_step(self, t: float, poses: np.ndarray, rates: np.ndarray) -> float:
        """Longest step that resolves present and imminent impacts, s."""
        near = self._touching(poses, self.geometry.margin) if self.resolves else None
        if near is None or not len(near.slot):
            return np.inf
        return self.impacts.longest_step(
            t, near, self.geometry.measure(poses, rates, near), self._memory_of(near), rates
        )

    def coarsen(self, factor: float) -> None:
        """Multiply the step sizes that resolve impacts by a factor."""
        self.impacts = replace(self.impacts, coarse=factor)

    @property
    def resolves(self) -> bool:
        """Whether steps have to resolve impacts of this group."""
        return self.impacts.resolved
