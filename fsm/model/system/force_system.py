"""Forces and matrices of rigid segments from groups of interactions (Li and Huang 2025, eqs. 15, 16).

u holds inertial velocities and body rates, so the mass matrix is diagonal and constant (principal axes). Held and driven
bodies have no degrees of freedom; the forces on them are summed like all others and are their reactions.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from fsm.interactions.driven import Driven
from fsm.interactions.joint_tree import JointTree
from fsm.kernels.blocks import BlockMatrix, BlockPattern, LowRank
from fsm.kernels.body_poses import gather_free
from fsm.kernels.newton_euler import (
    add_gyroscopic,
    drive_reactions,
    gyroscopic_damping,
)
from fsm.kernels.programs import table_of
from fsm.kernels.scatter import multiply_block_diagonal
from fsm.model.bodies.arrays import AGAIN, LARGEST, STEP, WORK
from fsm.model.bodies.configuration import Bodies, Configuration
from fsm.model.bodies.drive import PrescribedMotion
from fsm.model.bodies.group import BlockSums, BodyPattern, BodyState, Group, GroupSteps, PreviousPoses, body_pattern
from fsm.model.contact.contact_memory import ContactDepths
from fsm.model.contact.contact_set import ContactSet
from fsm.model.contact.contacts import ContactGroup
from fsm.model.elements.element_group import ElementGroup
from fsm.model.elements.elements import BushingGroup
from fsm.model.elements.locked_inertia import length_at
from fsm.model.elements.spring_locks import SpringLocks
from fsm.model.plan.in_python import of_compiler
from fsm.solve.interface.records import DriveState, Linearised, PreviousState
from fsm.solve.interface.rest_scales import scales_at_rest
from fsm.solve.interface.scales import OF_DRIVES, AtRest, Scales
from fsm.solve.stepping.accuracy import ACCURATE, trial_vector

if TYPE_CHECKING:
    from scipy import sparse

_AT_REST = 1e-9
"""Speed relative to the largest angular velocity times the extent, below which bodies only turn: corrections of initial
velocities leave round-off, which is no scale."""


class NewerMemory(Protocol):
    """Arrays of statics, which hold the memory of contacts (`fsm.model.system.static_arrays.StaticSegments`)."""

    def to_groups(self) -> None:
        """Give the groups the memory of the arrays, if it is newer."""


class SegmentForces(Configuration):
    """Forces, stiffness, damping and mass of finite segments; see `SegmentSystem`."""

    _statics: NewerMemory | None = None
    mixed = True

    def __init__(
        self,
        bodies: Bodies,
        motions: tuple[PrescribedMotion, ...],
        groups: tuple[Group, ...],
        pair_names: tuple[str, ...],
    ) -> None:
        super().__init__(bodies, motions)
        self._groups = groups
        self._contacts = ContactSet(group for group in groups if isinstance(group, ContactGroup))
        self.pair_names = pair_names
        self.fixed_pattern, self.of_vectors = not self._contacts, False
        self.rate_dependent = any(group.rate_dependent for group in groups)
        self._mass = bodies.inertia[bodies.free].ravel()
        self._dof = np.full(len(bodies.names), -1, dtype=np.int64)
        self._dof[bodies.free] = np.arange(self.n_free)
        self._ordered = bodies.free
        self._springs = tuple(group for group in groups if isinstance(group, BushingGroup))
        self._held = tuple(group for group in groups if isinstance(group, SpringLocks))
        self._others = tuple(group for group in groups if not isinstance(group, BushingGroup | ContactGroup))
        self._sliding = tuple(group for group in groups if isinstance(group, ElementGroup) and len(group.memory_of))
        self.remembers = bool(self._sliding)
        self.locking = tuple(group for group in groups if isinstance(group, ElementGroup) and group.locks)
        self.feels_reactions = any(isinstance(group, ElementGroup) and group.feels_reactions for group in groups)
        frictions = [group.friction for group in self._contacts if group.friction is not None]
        self.bristles = any(friction.law.bristle for friction in frictions)
        # springs without dampers do not depend on the last state
        self._looks_back = self.rate_dependent or groups != (*self._springs, *self._held)
        self._last_before: PreviousState | None = None
        self._last_poses = bodies.pose
        self._pattern: BodyPattern | None = None
        self._pattern_version: tuple[int, ...] = ()
        self._pattern_pairs: tuple[np.ndarray, ...] = ()
        self._driven_pattern: BodyPattern | None = None
        self._driven_key: tuple[int, ...] = ()
        self.steps_of: list[tuple[Group, GroupSteps]] = []
        self.of_elements: tuple[Group, ...] = ()
        self.latched: dict[str, np.ndarray] = {}
        self.in_python = of_compiler()
        self.spread = float(np.ptp(bodies.pose[:, : 3 if self.spatial else 2], axis=0).max())

    @property
    def groups(self) -> tuple[Group, ...]:
        """Interactions, with the present memory of contacts."""
        if self._statics is not None:
            self._statics.to_groups()
        return self._groups

    @property
    def contacts(self) -> ContactSet:
        """Contact groups among the interactions, with their present memory."""
        if self._statics is not None:
            self._statics.to_groups()
        return self._contacts

    def scales(self) -> Scales:
        """See `System`."""
        return self._scales

    @cached_property
    def _scales(self) -> Scales:
        """Typical sizes.

        The scale of the length is the median length of segments, else of solids, else the distance between bodies. The scale
        of the speed is the largest initial speed, or follows from the drives, else from the forces at rest. Contact
        forces and latches that open give the resolution of increments.
        """
        free = np.ones(self.nu, dtype=bool)
        return self._sized(self._body_length, self.spread, *self._positions, free)

    def _sized(self, length: float, extent: float, in_q: np.ndarray, in_u: np.ndarray, free: np.ndarray) -> Scales:
        """Sizes as in `Scales.of`, with the drives and contacts."""
        drives = OF_DRIVES * max((motion.pace(extent) for motion in self.motions), default=0.0)
        rates, n = np.abs(self.bodies.rate), 3 if self.spatial else 2
        fastest = float(rates[:, :n].max(initial=0.0))
        if fastest <= _AT_REST * extent * rates[:, n:].max(initial=0.0):
            fastest = 0.0
        at_rest = AtRest(0.0, 0.0) if drives else scales_at_rest(self, free, in_u, max(extent, length))
        speed, turns = max(drives, fastest) or at_rest.speed, [motion.axis is not None for motion in self.motions]
        of_elements = (group.resolution(length) for group in self.groups if isinstance(group, ElementGroup))
        resolution = min(self.contacts.resolution, *of_elements, math.inf)
        return Scales.of(length, extent, drives, speed, in_q, in_u, free, resolution, turns, at_rest.work)

    @cached_property
    def _positions(self) -> tuple[np.ndarray, np.ndarray]:
        """Whether each component of q and of u of the free bodies is a position."""
        n = 3 if self.spatial else 2
        width = self.bodies.pose.shape[1]
        return np.tile(np.arange(width) < n, self.n_free), np.tile(np.arange(self.size) < n, self.n_free)

    @property
    def _body_length(self) -> float:
        """Median length of free segments, else of free solids, else the distance between bodies, m."""
        lengths = [plate.length for body, plate, _ in self.bodies.plates if self._dof[body] >= 0]
        lengths = lengths or [size for body, size in self.bodies.solids if self._dof[body] >= 0]
        return float(np.median(lengths)) if lengths else (self.spread or 1.0)

    def mass(self, q: np.ndarray) -> sparse.csr_matrix:
        """See `System`; diagonal and constant."""
        return self._mass_matrix

    def momentum(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """See `System`."""
        return self._mass * u

    @cached_property
    def _mass_matrix(self) -> sparse.csr_matrix:
        from scipy import sparse

        return sparse.diags_array(self._mass, format="csr")

    def inertia(self, q: np.ndarray, pattern: BlockPattern) -> np.ndarray:
        """See `System`."""
        data = pattern.zeros()
        diagonal = range(self.size)
        data[pattern.diagonal[:, None], diagonal, diagonal] = self._mass.reshape(-1, self.size)
        return data

    def acceleration(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """See `System`."""
        return self.force(t, q, u) / self._mass

    def force(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> np.ndarray:
        """See `System`."""
        return self._generalised(t, q, u, before, self._all_forces(self.state(t, q, u, before)))

    def force_rate(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`; the result is the product of the columns of K of driven bodies and their speed."""
        poses, rates = self.place(t, q, None)
        direct = np.zeros_like(rates)
        for group in self.groups:
            group.add_force_rate(t, poses, direct)
        change = self._folded(q, direct[self._ordered].ravel())
        if len(self.driven):
            pattern, _, stiffness, _ = self._with_driven(BodyState(t, poses, rates), self.groups)
            speeds = np.zeros((pattern.order, self.size))
            moving = self._body_rates(np.zeros(self.n_free * self.size), t)
            speeds[pattern.dof[self.driven]] = moving[self.driven]
            change = self._folded(q, -BlockMatrix(pattern, stiffness).times(speeds.ravel())) + change
            if self._of_all is not None:
                vectors, weights, free = self._on_all_bodies()
                change -= (weights @ (vectors @ moving.ravel())) @ free
        return np.asarray(change)

    def _with_driven(self, at: BodyState, groups: tuple[Group, ...], turned: np.ndarray | None = None) -> BlockSums:
        """Sums of groups; here driven bodies count as free, and come after the free bodies."""
        pairs, versions = zip(*(group.pairs(at.poses) for group in groups), strict=True) if groups else ((), ())
        key = (*map(id, groups), *versions)
        if self._driven_pattern is None or key != self._driven_key:
            dof = self._dof.copy()
            moving = [body for motion in self.motions for body in motion.bodies]
            dof[moving] = len(self._ordered) + np.arange(len(moving))
            self._driven_pattern, self._driven_key = body_pattern(dof, list(pairs), self.size), key
        sums = BlockSums.zero(self._driven_pattern, at)
        by_rates = [group for group in groups if isinstance(group, ContactGroup)]
        others = [group for group in groups if not isinstance(group, ContactGroup)]
        for contacts in by_rates:
            contacts.add_linearised(at, sums)
        if by_rates and turned is not None:
            multiply_block_diagonal(sums.damping, turned, sums.pattern.indices)
        for group in others:
            group.add_linearised(at, sums)
        return sums

    @cached_property
    def _of_all(self) -> Group | None:
        """Group with a stiffness of low rank, which joins all bodies."""
        return next((group for group in self._groups if group.low_rank is not None), None)

    @property
    def _changing(self) -> tuple[LowRank, np.ndarray] | None:
        """Stiffness of low rank at the last tangent, whose arrays change in place, and column of its vectors of each
        coordinate (nu,), or -1; None without any.
        """
        found = None if self._of_all is None else self._of_all.low_rank
        if found is None:
            return None
        return found, (self.size * self.bodies.free[:, None] + np.arange(self.size)).ravel()

    def _on_all_bodies(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vectors (k, n_bodies * size) of this stiffness, weights, and vectors (k, nu) of the free bodies."""
        assert self._changing is not None
        low_rank, free = self._changing
        return low_rank.vectors, low_rank.weights, low_rank.vectors[:, free]

    @property
    def low_rank(self) -> LowRank | None:
        """Stiffness of low rank at the last tangent."""
        found = self._changing
        if found is None:
            return None
        (changing, columns) = found
        vectors = np.where(columns >= 0, changing.vectors[:, columns], 0.0)
        return LowRank(np.ascontiguousarray(vectors), changing.weights.copy())

    def low_rank_table(self) -> np.ndarray | None:
        """Table of this stiffness for compiled models."""
        found = self._changing
        if found is None:
            return None
        from fsm.kernels.low_rank import LowRankEquations  # imports the kernels of all steps

        changing, columns = found
        return LowRankEquations(changing.vectors, changing.weights, columns, trial_vector(self.nu), ACCURATE).table

    # linearisation ----------------------------------------------------------------------------------------------------

    def linearise(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None,
        efforts: np.ndarray | None = None, depths: tuple[ContactDepths, ...] | None = None,
    ) -> Linearised:  # fmt: skip
        """See `System`."""
        at = self.state(t, q, u, before)
        sums = BlockSums.zero(self._current_pattern(at.poses), at)
        pattern, damping = sums.pattern, sums.damping
        for k, contacts in enumerate(self.contacts):
            contacts.add_linearised(at, sums, None if depths is None else depths[k])
        if self.spatial and u is not None:
            add_gyroscopic(at.rates, self.bodies.inertia, sums.force)
            gyroscopic_damping(at.rates, self.bodies.inertia, *pattern.index, damping)
        # these groups use increments over the time as rates; the other groups use the deformations of the last state
        turned = self._turned(q, u, before)
        if turned is not None:
            multiply_block_diagonal(damping, turned, pattern.indices)
        by_rates = None if before is None else damping.copy() if self._ordered is not self.bodies.free else damping
        first = 0
        for springs in self._springs:
            last = first + springs.rest.size
            own = None if efforts is None else efforts[first:last].reshape(springs.rest.shape)
            springs.add_linearised(at, sums, own)
            first = last
        for group in self._others:
            group.add_linearised(at, sums)
        others = None if efforts is None else efforts[first:]
        return self._assembled(t, q, u, before, sums, by_rates, others)

    def sticking_damping(self, t: float, q: np.ndarray) -> BlockMatrix | None:
        """See `System`."""
        if not any(group.friction is not None for group in self.contacts):
            return None
        at = self.state(t, q, None)
        sums = BlockSums.zero(self._current_pattern(at.poses), at)
        for contacts in self.contacts:
            contacts.add_linearised(at, sums)
        return self._assembled(t, q, None, None, sums, None).damping

    def driven_arrays(self) -> Driven:
        """Driven bodies, for kernels."""
        turning = () if self.turns is None else self.turns.bodies
        rows = [[turn.motion, turn.body] for turn in turning]
        turns = [[*turn.axis, *turn.centre, *turn.arm, *turn.own] for turn in turning]
        return Driven(
            table_of([motion.program for motion in self.motions]), *self.drives,
            np.array(rows, dtype=np.int64).reshape(-1, 2), np.array(turns, dtype=float).reshape(-1, 12),
            np.ascontiguousarray(self.bodies.pose[self.driven]), self.scales().of_drives,
        )  # fmt: skip

    # locked directions ------------------------------------------------------------------------------------------------

    @cached_property
    def tree(self) -> JointTree:
        """Tree of joints of the free bodies, in space; without links if forces depend on reactions."""
        from fsm.model.elements.joint_trees import joint_tree

        locking = self.locking if self.spatial and not self.feels_reactions else ()
        return joint_tree(locking, len(self.bodies.names), self.bodies.free, bool(self.motions))

    def lock(self, by_acceleration: float) -> bool:
        """See `System`."""
        for group in self.locking:
            group.lock(by_acceleration)
        for locks in self._held:
            locks.go_back()
        return bool(self.locking)

    def advance(self, change: np.ndarray, part: float = 1.0, again: bool = False) -> bool:
        """See `System`."""
        rows = self.change(change) if self.locking else change
        for group in self.locking:
            group.advance(rows, part, AGAIN if again else STEP)
        return bool(self.locking)

    def advance_in_time(self, t: float, change: np.ndarray, passed: float) -> None:
        """See `System`."""
        rows = self.change(change) + passed * self._body_rates(np.zeros(self.nu), t) if self.locking else change
        for group in self.locking:
            group.pass_time(t, passed)
            group.advance(rows)

    def work_of_locks(self, change: np.ndarray) -> float:
        """See `System`."""
        rows = self.change(change) if self.locking else change
        return sum(group.advance(rows, 1.0, WORK) for group in self.locking)

    def largest_multiplier(self) -> float:
        """Largest force of the multipliers at the last evaluated state in statics, N; forces of mechanisms may balance
        without supports.
        """
        still = [group for group in self.locking if group.still[0] > 0.0]
        return max((group.advance(self.at_rest, 0.0, LARGEST) for group in still), default=0.0)

    def swap_multipliers(self) -> None:
        """See `System`."""
        for group in (*self.locking, *self._held):
            group.swap()

    def hold_still(self, still: bool) -> bool:
        """See `System`."""
        before = bool(self.locking) and bool(self.locking[0].still[0] > 0.0)
        if not self.locking or still == before:
            return before
        span, poses = np.where(np.arange(self.size) < 3, self.arm, 1.0), self.bodies.pose
        for group in self.locking:
            if still:
                group.sizes[:] = 1.0 / np.sum((group.gradients(poses) * span) ** 2, axis=(1, 2))
            group.still[0], group.still[2] = self._energy_at_rest if still else 0.0, self.arm
            group.lock(0.0)
        return before

    @cached_property
    def arm(self) -> float:
        """Typical length of the bodies at locked directions, m; moments over it count as reactions."""
        return length_at(self.locking, self.bodies.pose, self._dof) or float(self.scales().length)

    @cached_property
    def _energy_at_rest(self) -> float:
        """Energy scale of the penalties at rest, J: of the softest component and of loads at the start, without locked
        directions. With stiff springs it is at least 1e-5 of that of the stiffest one: no opening is stiffer than the
        springs next to it, and larger penalties would leave the softest components to round-off.
        """
        free, q, scales = self.without_locks(), self.initial()[0], self.scales()
        linear, per_second = free.linearise(0.0, q, np.zeros(self.nu)), 1.0 / (self.end_time() or 1.0)
        data = np.abs(linear.stiffness.data) + per_second * np.abs(linear.damping.data)
        stiff = scales.span_forces(linear.stiffness.with_data(data)) * scales.span
        loads = [np.abs(free.force(t, q, None)) * scales.span for t in sorted({0.0, *free.peak_times()})]
        most, of_loads = float(stiff.max(initial=0.0)), max(float(each.max(initial=0.0)) for each in loads)
        softest = float(stiff[stiff > 1e-12 * most].min(initial=most))
        return max(1e-5 * most, softest, of_loads) or 1.0

    @abstractmethod
    def without_locks(self) -> SegmentForces:
        """System of the same bodies without locked directions."""

    def locked_rows(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`."""
        poses, _ = self.place(t, q, None)
        rows = np.zeros((sum(len(group.sizes) for group in self.locking), *self.at_rest.shape))
        first = 0
        for group in self.locking:
            found = group.gradients(poses) * group.acting[:, None, None]
            for row, gradient, ends in zip(rows[first:], found, group.bodies.tolist(), strict=False):
                row[ends if found.shape[1] == 2 else slice(None)] += gradient
            first += len(found)
        folded = [self._folded(q, np.ravel(row)) for row in rows[:, self._ordered]]
        return np.array(folded).reshape(len(rows), self.nu)

    # mixed Newton method ----------------------------------------------------------------------------------------------

    def take_up(self, efforts: np.ndarray, task: int) -> float:
        """See `System`."""
        first, found = 0, 0.0
        for springs in self._springs:
            last = first + springs.rest.size
            if springs.locks is not None:
                found += springs.locks.take_up(efforts[first:last].reshape(springs.rest.shape), task)
            first = last
        return found

    def copy_locks(self, other: SegmentForces) -> None:
        """Take the multipliers of locked springs from a system with the same springs."""
        for own, given in zip(self._held, other._held, strict=False):  # a system of contacts alone has no springs
            own.restore(given.memory_of.copy())

    def depths(self, most: float) -> tuple[ContactDepths, ...]:
        """See `System`."""
        return tuple(group.pressed(most) for group in self.contacts)

    def advance_depths(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray | None,
        before: PreviousState | None,
        dx: np.ndarray,
        depths: tuple[ContactDepths, ...],
    ) -> tuple[ContactDepths, ...]:
        """See `System`."""
        if not depths:
            return depths
        at, change = self.state(t, q, u, before), self.change(dx)
        return tuple(group.press(at, change, own) for group, own in zip(self.contacts, depths, strict=True))

    def efforts(
        self, t: float, q: np.ndarray, before: PreviousState | None = None, dx: np.ndarray | None = None
    ) -> np.ndarray:
        """See `System`."""
        poses, at_rest = self.place(t, q, None)
        change = at_rest if dx is None else self.change(dx)
        past = self.past(t, before)
        parts = [group.efforts(poses, change, past) for group in self._springs]
        return parts[0].ravel() if len(parts) == 1 else np.concatenate([np.zeros(0), *(part.ravel() for part in parts)])

    # parts ------------------------------------------------------------------------------------------------------------

    def _generalised(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray | None,
        before: PreviousState | None,
        forces: np.ndarray,
        whole: bool = True,
    ) -> np.ndarray:
        """Generalised forces (nu,) from the wrenches (n_bodies, 6) on all bodies; if `whole` is true, they include the
        forces on nodes.
        """
        return np.asarray(gather_free(self.bodies.free, forces))

    def _folded(self, q: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Generalised forces (nu,) from forces on the block rows of the pattern."""
        return rows[: self.nu]

    def _assembled(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray | None,
        before: PreviousState | None,
        sums: BlockSums,
        by_rates: np.ndarray | None,
        efforts: np.ndarray | None = None,
    ) -> Linearised:
        """Equations from the sums of all bodies.

        `by_rates` is the part of D that acts on velocities. `efforts` are the efforts of elements that are not springs.
        """
        pattern, force, stiffness, damping = sums
        tangent = BlockMatrix(pattern, stiffness, self.low_rank)
        return Linearised(gather_free(self.bodies.free, force), tangent, BlockMatrix(pattern, damping))

    def _turned(self, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None) -> np.ndarray | None:
        """Derivative of increments since the last state with respect to further rotations; None for the identity."""
        return None if before is None or u is None else self.increment_map(self.difference(before[1], q))

    def drive_state(self, t: float, reactions: np.ndarray) -> DriveState:
        """Travels and forces of all drives from the reactions (n_bodies, 3 or 6) of all bodies."""
        force = np.asarray(drive_reactions(reactions, self.driven, self._motion, self._directions))
        if self.turns is not None:
            for k, body, twist in self.turns.twists(self._travels(t)):
                force[k] += float(twist @ reactions[body])
        return DriveState(self._travels(t).copy(), force)

    def state(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> BodyState:
        """State of all bodies; arguments as in `place`."""
        return BodyState(t, *self.place(t, q, u, before), self.past(t, before))

    def past(self, t: float, before: PreviousState | None) -> PreviousPoses | None:
        """Poses of the last state (cached), or None if no force depends on them."""
        if before is None or not self._looks_back:
            return None
        last = self._last_before
        if last is None or last[0] != before[0] or last[1] is not before[1]:
            self._last_before, self._last_poses = before, self.place(*before, None)[0]
        return PreviousPoses(self._last_poses, t - before[0])

    def _all_forces(self, at: BodyState) -> np.ndarray:
        force = np.zeros(at.rates.shape)
        for group in self.groups:
            group.add_force(at, force)
        if self.spatial and at.rates is not self.at_rest:
            add_gyroscopic(at.rates, self.bodies.inertia, force)
        return force

    def compiled_pattern(self, contacts: Sequence[np.ndarray]) -> BodyPattern:
        """Pattern of compiled steps, with blocks for pairs of bodies in contact, (m, 2) arrays."""
        pairs = [group.pairs(self.bodies.pose)[0] for group in (*self._springs, *self._others)] + list(contacts)
        return body_pattern(self._dof, pairs, self.size)

    def _first_pattern(self) -> BodyPattern:
        return self.compiled_pattern([group.geometry.coupled_first(self.bodies.pose) for group in self.contacts])

    def _current_pattern(self, poses: np.ndarray) -> BodyPattern:
        if self._pattern is not None and self.fixed_pattern:
            return self._pattern
        pairs, versions = zip(*(group.pairs(poses) for group in self.groups), strict=True) if self.groups else ((), ())
        if self._pattern is None or versions != self._pattern_version:
            # the pairs of the last pattern are kept, because a shortened step often needs them again
            if self._pattern is None or not all(self._pattern.holds(of_group) for of_group in pairs):
                self._pattern = body_pattern(self._dof, [*pairs, *self._pattern_pairs], self.size)
                self._pattern_pairs = pairs
            self._pattern_version = versions
        return self._pattern
