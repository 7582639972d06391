"""The System of rigid segments: steps, energies, reactions and internal variables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fsm.case.models.loads import Load
from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.body_poses import shift_body
from fsm.kernels.newton_euler import (
    add_gyroscopic,
    largest_force,
    largest_moment,
    motion_energy,
    support_reactions,
)
from fsm.kernels.pointers import enter
from fsm.model.bodies.configuration import Bodies
from fsm.model.bodies.drive import PrescribedMotion
from fsm.model.bodies.group import BodyPattern, BodyState, Group
from fsm.model.contact.contacts import ContactGroup
from fsm.model.contact.shapes.shape_contacts import ShapeContacts
from fsm.model.elements.element_group import ElementGroup
from fsm.model.elements.elements import BushingGroup
from fsm.model.elements.spring_locks import SpringLocks
from fsm.model.system.force_system import SegmentForces
from fsm.solve.interface.records import Energy, LockedSprings, Observation, PreviousState, Ready, StepRejection
from fsm.solve.stepping.model import ArrayModel

if TYPE_CHECKING:
    from fsm.model.system.arrays_of import ContactModel
    from fsm.model.system.static_arrays import StaticSegments


def _locks(group: Group) -> bool:
    return isinstance(group, ElementGroup) and group.locks


class SegmentSystem(SegmentForces):
    """Finite segments with the `System` protocol; created by `compile_scene`.

    Parameters
    ----------
    bodies : Bodies
    motions : prescribed motions
    groups : interactions
    pair_names : names of the contact pairs
    """

    _array_model: tuple[ArrayModel, tuple[object, ...]] | None = None
    _contact_model: ContactModel | None = None
    _statics: StaticSegments | None = None

    def variant(
        self,
        bodies: Bodies,
        motions: tuple[PrescribedMotion, ...],
        groups: tuple[Group, ...],
        pressures: tuple[Load, ...] = (),
    ) -> SegmentSystem:
        """System of the same bodies with a different choice of free, driven and held bodies, under pressures on nodes.

        Groups keep their memory.
        """
        return SegmentSystem(bodies, motions, groups, self.pair_names)

    def all_states(self, t: float, q: np.ndarray, u: np.ndarray) -> dict[str, np.ndarray]:
        """Poses and rates of all bodies, and coordinates and velocities of nodes. The form is the same in all steps."""
        poses, rates = self.place(t, q, u)
        return {"poses": poses.copy(), "rates": rates.copy(), "nodes": np.zeros(0), "node_rates": np.zeros(0)}

    def from_states(self, states: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Configuration and velocity of this system in given states of all bodies and nodes."""
        free = self.bodies.free
        return states["poses"][free].ravel(), states["rates"][free].ravel()

    def load_displacements(
        self, start: tuple[float, np.ndarray], end: tuple[float, np.ndarray]
    ) -> dict[str, tuple[float, float]]:
        """Size (N, N m) of every load at the end of a path, and displacement (m, rad) of its point along the load, by
        name.

        `start` and `end` are times (s) and configurations.
        """
        first, last = (BodyState(t, self.place(t, q, None)[0].copy(), self.at_rest) for t, q in (start, end))
        found = dict[str, tuple[float, float]]()
        for group in self.groups:
            found |= group.load_displacements(first, last)
        return found

    # protocol: configuration ------------------------------------------------------------------------------------------

    @property
    def dof(self) -> int:
        """See `System`."""
        return self.nu

    def end_time(self) -> float | None:
        """See `System`."""
        return max((motion.end_time for motion in self.motions), default=None)

    def drive_turns(self, number: int) -> bool:
        """See `System`."""
        return self.motions[number].axis is not None

    def progress(self, t: float) -> float:
        """See `System`: travel of the first drive, plus a small part of the time for the end of the drive."""
        if not self.motions:
            return t
        program = self.motions[0].program
        return program.at(t)[0] + 1e-6 * program.speed * t if program.forward else t

    def break_times(self) -> list[float]:
        """See `System`."""
        times = {time for motion in self.motions for time in motion.program.breaks()}
        return sorted(times.union(*(group.break_times() for group in self.groups)))

    def peak_times(self) -> list[float]:
        """See `System`."""
        return sorted({time for group in self.groups for time in group.peak_times()})

    # protocol: drives -------------------------------------------------------------------------------------------------

    def balance(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray | None,
        before: PreviousState | None = None,
        contacts: bool | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Force h (nu,) and the reactions of all drives (n_drives,) in a state.

        If `contacts` is true, only contacts count; if false, all forces except contacts. Other arguments as in
        `System.force`.
        """
        at = self.state(t, q, u, before)
        forces = np.zeros(at.rates.shape)
        for group in self.groups:
            if contacts is None or contacts == isinstance(group, ContactGroup):
                group.add_force(at, forces)
        if self.spatial and u is not None and not contacts:
            add_gyroscopic(at.rates, self.bodies.inertia, forces)
        reactions = np.asarray(support_reactions(forces, self._ordered))
        return self._generalised(t, q, u, before, forces, not contacts), self.drive_state(t, reactions).force

    def drive_tangent(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None
    ) -> np.ndarray:
        """d(reaction)/dx of every drive, (n_drives, nu); with `before`, the last state is kept constant."""
        at = self.state(t, q, u, before)
        driven = [body for motion in self.motions for body in motion.bodies]
        groups = tuple(
            group for group in self.groups if group is self._of_all or np.isin(group.pairs(at.poses)[0], driven).any()
        )
        pattern, _, stiffness, damping = self._with_driven(at, groups, self._turned(q, u, before))
        whole = np.zeros((len(self.motions), *self.at_rest.shape))
        for k, motion in enumerate(self.motions):
            whole[k, motion.bodies, : len(motion.direction)] = motion.direction
        if self.turns is not None:
            for k, body, twist in self.turns.twists(self._travels(t)):
                whole[k, body] = twist
        along = np.zeros((len(self.motions), pattern.order, self.size))
        along[:, pattern.dof[driven]] = whole[:, driven]
        pull = along.reshape(len(self.motions), -1).T
        tangent = np.asarray(BlockMatrix(pattern, stiffness).bsr().T @ pull).T
        if before is not None and self.rate_dependent:
            tangent += np.asarray(BlockMatrix(pattern, damping).bsr().T @ pull).T / (t - before[0])
        found = np.array([self._folded(q, row) for row in tangent]).reshape(len(tangent), self.nu)
        if self._of_all is not None:
            vectors, weights, free = self._on_all_bodies()
            found += whole.reshape(len(whole), -1) @ vectors.T @ weights @ free
        return found

    # protocol: locked directions --------------------------------------------------------------------------------------

    def measure_step(self, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
        """See `System`."""
        if not self.locking:
            return False
        from fsm.model.system.array_locked import measure_step

        return bool(self._with_locked(measure_step, float(t), float(h), q, x))

    def consistent(self, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool = False) -> bool:
        """See `System`."""
        if not self.locking:
            return False
        from fsm.model.system.array_locked import MOST, close_openings, find_multipliers, settled

        arrays = self._locked[1][0]
        self._with_locked(close_openings, float(t), q, u, inside)
        on_nodes, before = self._forces_on_nodes(t, q, u), np.zeros(self.nu)
        for _ in range(MOST):
            arrays.force[:] = self._all_forces(self.state(t, q, u))
            self._with_locked(find_multipliers, float(t), rate, on_nodes, inside)
            if not self.feels_reactions or self._with_locked(settled, float(t), before, rate):
                return True
        if inside:
            rate[:] = math.nan
        return True

    def _with_locked(self, function: Any, *arguments: Any) -> Any:
        """Call a kernel with the model of `_locked`."""
        model = self._locked[0]
        return enter(model.equations.factorise, function, model, *arguments)

    def _forces_on_nodes(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Forces on coordinates of nodes without those of bodies and frames."""
        return q[:0]

    def without_locks(self) -> SegmentSystem:
        """See `SegmentForces`."""
        return self.variant(self.bodies, self.motions, tuple(group for group in self.groups if not _locks(group)))

    def locked_springs(self, t: float, q: np.ndarray) -> LockedSprings | None:
        """See `System`."""
        if not self._held:
            return None
        from scipy import sparse

        poses, _ = self.place(t, q, None)
        gradients, columns, stiffness = [], [], []
        for group in self._springs:
            element, direction = np.nonzero(group.locked)
            measured = group.measure(poses, self.at_rest, group.bodies, *group.geometry)[2]
            places = self._dof[group.bodies[element]][:, :, None] * self.size + np.arange(self.size)
            gradients.append(measured[element, direction])
            columns.append(np.where(places < 0, -1, places).reshape(len(element), 2 * self.size))
            stiffness.append(group.stiffness[element, direction])
        values, at = np.concatenate(gradients), np.concatenate(columns)
        row, k = np.nonzero(at >= 0)
        rows = sparse.csr_matrix((values[row, k], (row, at[row, k])), shape=(len(at), self.nu))
        others = list[Group]()
        for one in (group for group in self.groups if not isinstance(group, SpringLocks)):
            if isinstance(one, BushingGroup):
                others.append(replace(one, stiffness=np.where(one.locked, 0.0, one.stiffness)))
            else:
                others.append(one)
        without = self.variant(self.bodies, self.motions, tuple(others))
        remaining = without.linearise(t, q, None, None, self.efforts(t, q)).stiffness
        return LockedSprings(rows, np.concatenate(stiffness), remaining)

    @cached_property
    def _locked(self) -> tuple[Any, ...]:
        """Model with the locked directions alone, arrays of its bodies, and others; the groups share their multipliers."""
        from fsm.model.system.arrays_of import locked_of  # imports the kernels of all steps

        alone = self.variant(self.bodies, self.motions, self.locking)
        return locked_of(alone, alone._current_pattern(self.bodies.pose))

    # protocol: observation --------------------------------------------------------------------------------------------

    def arrays(self, ready: Ready) -> ArrayModel | None:
        """See `System`."""
        further_forces = type(self).force is not SegmentSystem.force and type(self)._arrays_of is SegmentSystem._arrays_of
        if further_forces or self.in_python.motion or self.large_contacts() or not self.nu:
            return None
        contacts = self._contact_model
        if self._array_model is None:
            from fsm.model.system.arrays_of import ContactModel  # imports the kernels of all steps

            pattern = self._first_pattern()
            pairs = len(self.pair_names)
            contacts = ContactModel(self.contacts, pattern, self.spatial, pairs)
            self._contact_model, self._array_model = contacts, self._arrays_of(pattern, ready, contacts)
        elif contacts is not None and contacts.lacks:
            pattern = self.compiled_pattern(contacts.pairs())
            contacts.index(pattern)
            self._array_model = self._arrays_of(pattern, ready, contacts)
        from fsm.model.elements.joint_trees import follows, set_tree

        if not follows(self.tree, self.locking):
            set_tree(self.tree, self.locking[0], self.bodies.free)
        return self._array_model[0]

    def large_contacts(self) -> tuple[str, ...]:
        """Reason why motions have their steps in Python: too many pairs of shapes; empty if there are few."""
        if any(isinstance(group.geometry, ShapeContacts) and group.geometry.many for group in self.contacts):
            return ("contact: pairs of so many plates have no compiled form",)
        return ()

    def large_statics(self, ready: Ready) -> tuple[str, ...]:
        """Reason why statics has steps in Python: dense fronts solve so many equations faster; empty if there are few."""
        return ()

    def _arrays_of(
        self, pattern: BodyPattern, ready: Ready, contacts: ContactModel
    ) -> tuple[ArrayModel, tuple[object, ...]]:
        """Compiled model (`ArrayModel`), and the NumPy arrays that it needs."""
        from fsm.model.system.arrays_of import arrays_of

        return arrays_of(self, pattern, ready, contacts)

    def static_arrays(self, ready: Ready) -> StaticSegments | None:
        """See `System`."""
        if self._statics is None:
            if self.in_python.of("static") or self.large_contacts() or not self.nu or self.large_statics(ready):
                return None
            self._statics = self._static_arrays_of(ready)
            if self._statics is None:
                return None
        self._statics.use(ready)
        return self._statics

    def _static_arrays_of(self, ready: Ready) -> StaticSegments | None:
        """New arrays for statics; None if there are forces without arrays."""
        if type(self).force is not SegmentSystem.force:
            return None
        from fsm.model.system.static_arrays import StaticSegments  # imports the kernels of all steps

        return StaticSegments(self, self._first_pattern(), ready)

    def lacks_arrays(self) -> bool:
        """See `System`."""
        return self._contact_model is not None and self._contact_model.lacks

    def to_arrays(self, resolve: bool) -> None:
        """See `System`: memory of contacts."""
        if self._contact_model is not None and self.contacts:
            self._contact_model.load(resolve)

    def from_arrays(self) -> None:
        """See `System`: memory of contacts."""
        if self._contact_model is not None:
            self._contact_model.store()

    def energy(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Energy:
        """See `System`."""
        at = self.state(t, q, u, before)
        return self._energy(at, self._reactions(at))

    def loss_of_elements(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> float:
        """See `System`."""
        at = self.state(t, q, u, before)
        return sum(group.energy(at)[1] for group in self.groups if not isinstance(group, ContactGroup))

    def reactions(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> np.ndarray:
        """See `System`."""
        reactions = self._reactions(self.state(t, q, u, before))
        if u is not None and before is None:
            self._accelerate(t, reactions)
        return reactions

    def observe(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Observation:
        """See `System`."""
        at = self.state(t, q, u, before)
        reactions = self._reactions(at)
        energy = self._energy(at, reactions)
        if u is not None and before is None:
            self._accelerate(t, reactions)
        pairs = self.contacts.observe(at, len(self.pair_names))
        moment = largest_moment(reactions) / self.arm if self.locking else 0.0
        largest = max(float(largest_force(reactions)), float(moment), self.largest_multiplier())
        return Observation(self.drive_state(t, reactions), energy, largest, pairs)

    # protocol: internal variables -------------------------------------------------------------------------------------

    def commit(self, t: float, q: np.ndarray, u: np.ndarray, before: PreviousState | None = None) -> None:
        """See `System`."""
        if not self.contacts and not self._sliding:
            return
        at = self.state(t, q, u, before)
        self.contacts.commit(at)
        for group in self._sliding:
            group.commit(at)

    def memory(self) -> np.ndarray:
        """See `System`: memory of contacts, then of creases."""
        return np.concatenate([self.contacts.memory(), SegmentSystem.element_memory(self)])

    def element_memory(self) -> np.ndarray:
        """See `System`."""
        return np.concatenate([np.zeros(0), *(group.memory() for group in self._sliding)])

    def memory_in_place(self) -> Sequence[np.ndarray] | None:
        """See `System`: memory of elements, if there are no contacts."""
        if self.contacts or type(self).memory is not SegmentSystem.memory:
            return None
        return [group.memory_of for group in self._sliding]

    def restore(self, memory: np.ndarray) -> None:
        """See `System`."""
        end = len(memory)
        for group in reversed(self._sliding):
            begin = max(0, end - len(group.memory_of))
            group.restore(memory[begin:end])
            end = begin
        self.contacts.restore(memory[:end])

    def counters(self) -> np.ndarray:
        """See `System`: evaluated states and renewals of the contact search of every group."""
        return self.contacts.counters()

    def clear_caches(self, counters: np.ndarray) -> None:
        """See `System`."""
        if not self.fixed_pattern:
            self._pattern, self._pattern_version, self._pattern_pairs = None, (), ()
            self._driven_pattern, self._driven_key = None, ()
        if self._contact_model is not None and self._contact_model.grown:
            self._array_model = self._contact_model = None
        if self._statics is not None:
            self._statics.clear()
        self.contacts.clear_caches(counters)

    def touching(self) -> tuple[int, bool]:
        """See `System`."""
        return self.contacts.touching()

    def rejection(self, t: float, q: np.ndarray, u: np.ndarray | None, step: float) -> StepRejection | None:
        """See `System`."""
        found = None
        if self._contacts:
            found = self.contacts.rejection(self.state(t, q, u), None if u is None else step, self.pair_names)
        if found is not None or u is None:
            return found
        part = self.part_before_event(t, q, u, step)
        return StepRejection(part) if part < 1.0 else None

    def part_before_event(self, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
        """See `System`: events of elements."""
        elements = [group for group in self.groups if isinstance(group, ElementGroup) and group.has_events]
        return min((group.part_of_step(self.state(t, q, u), step) for group in elements), default=2.0)

    def hold(self, held: bool) -> None:
        """See `System`."""
        for group in self._sliding:
            group.hold(held)

    def longest_step(self, t: float, q: np.ndarray, u: np.ndarray) -> float:
        """See `System`: limit from impacts."""
        if not any(group.resolves for group in self.contacts):
            return math.inf
        return self.contacts.longest_step(self.state(t, q, u))

    def contact_force(self, t: float, q: np.ndarray) -> float:
        """See `System`."""
        if not self._contacts:
            return 0.0
        at = self.state(t, q, None)
        forces = np.zeros(at.rates.shape)
        for contacts in self.contacts:
            contacts.add_force(at, forces)
        return float(largest_force(forces))

    def max_joint_opening(self, t: float, q: np.ndarray) -> tuple[float, str]:
        """See `System`."""
        return self.opening_of(self.place(t, q, None)[0])

    def opening_of(self, poses: np.ndarray) -> tuple[float, str]:
        """`max_joint_opening` at poses of all bodies."""
        sometimes = [group for group, _ in self.steps_of]  # joints that may not act at this time
        gaps = [group.gap(poses) for group in self._springs if not any(group is other for other in sometimes)]
        return max(gaps, default=(0.0, "none"))

    # parts ------------------------------------------------------------------------------------------------------------

    def _reactions(self, at: BodyState) -> np.ndarray:
        """Reactions of held and driven bodies, without the inertial forces of driven bodies."""
        return np.asarray(support_reactions(self._all_forces(at), self._ordered))

    def _accelerate(self, t: float, reactions: np.ndarray) -> None:
        """Add the inertial forces of driven bodies (dynamics only)."""
        if self.turns is not None:
            states = np.array([motion.at(t) for motion in self.motions])
            self.turns.add_inertial(reactions, self.bodies.inertia, states)
        for motion in self.motions:
            _, _, acceleration = motion.at(t)
            if acceleration and motion.axis is None:
                n = len(motion.direction)
                for body in motion.bodies:
                    shift_body(reactions, body, self.bodies.inertia[body, :n] * motion.direction, acceleration)

    def _energy(self, at: BodyState, reactions: np.ndarray) -> Energy:
        potential: dict[str, float] = {}
        dissipated = power = sliding = 0.0
        for group in self.groups:
            stored, lost, gained = group.energy(at)
            for name, value in stored.items():
                potential[name] = potential.get(name, 0.0) + value
            dissipated += lost
            power += gained
            sliding += lost if any(group is one for one in self._sliding) else 0.0
        pair_power = self.contacts.pair_power(at, len(self.pair_names))
        if self.bristles:  # bristles also resist at zero speed
            sliding += float(pair_power[0].sum())
        kinetic, driving, driven = motion_energy(self.bodies.inertia, at.rates, reactions, self.driven)
        if self.turns is not None:
            driven += self.turns.kinetic(self.bodies.inertia, at.rates)
        return Energy(kinetic, potential, dissipated, power + driving, pair_power, sliding, driven, power)
