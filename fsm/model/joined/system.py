"""System of rigid bodies and ANCF elements that act on each other through frames.

A frame is a body without degrees of freedom that a material point of an element carries. Springs, creases, contacts and
loads act on it as on any body. The body's wrenches and tangents go to the nodal vectors of the element
(`fsm.model.system.frames`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from fsm.builders.patterns.of_sheet import facets_named
from fsm.case.models.loads import Load
from fsm.kernels.block_lu import fill_in
from fsm.kernels.blocks import BlockMatrix, BlockPattern, Elimination, LowRank
from fsm.kernels.body_poses import increment_blocks, pose_difference
from fsm.kernels.minimum_degree import few_by_minimum_degree
from fsm.model.bodies.configuration import Bodies
from fsm.model.bodies.drive import PrescribedMotion, time_function
from fsm.model.bodies.group import BlockSums, BodyPattern, Group
from fsm.model.joined.configuration import JoinedConfiguration, Nodes
from fsm.model.nodes.facets.facet_group import FacetGroup
from fsm.model.nodes.facets.pressure import PressedFaces, PressureGroup
from fsm.model.nodes.group import ElementGroup, mass_data, set_held
from fsm.model.system.condense import add_condensed, add_curvatures, fold_forces
from fsm.solve.interface.records import Energy, Linearised, LockedSprings, Observation, PreviousState, Ready
from fsm.solve.stepping.model import ArrayModel
from fsm.text.load_names import PRESSURE

if TYPE_CHECKING:
    from fsm.model.joined.arrays_of import JoinedModel
    from fsm.model.system.arrays_of import ContactModel
    from fsm.model.system.static_arrays import StaticSegments

_OF_GAS = 0.01
"""Shortest step times omega of a motion against a gas."""


def _alone(pattern: BlockPattern) -> tuple[Elimination, np.ndarray]:
    """Elimination and data for factors of a pattern (`Ready`)."""
    order = few_by_minimum_degree(pattern.indptr, pattern.indices)
    known = Elimination(order, *fill_in(pattern.indptr, pattern.indices, order))
    return known, np.zeros(known.factors(pattern.size))


class JoinedSystem(JoinedConfiguration):
    """System of rigid bodies, ANCF elements and their connections; implements the `System` protocol.

    Parameters
    ----------
    bodies, motions, groups, pair_names, nodes : see `JoinedConfiguration`
    pressures : pressures on the faces (`fsm.case.models.loads.Load`)
    """

    def __init__(
        self,
        bodies: Bodies,
        motions: tuple[PrescribedMotion, ...],
        groups: tuple[Group, ...],
        pair_names: tuple[str, ...],
        nodes: Nodes,
        pressures: tuple[Load, ...] = (),
    ) -> None:
        super().__init__(bodies, motions, groups, pair_names, nodes)
        faces, chambers = self.faces, self.chambers
        self.pressures = tuple(pressure_of(load, faces) for load in pressures if faces is not None)
        self.remembers = self.remembers or chambers is not None
        self._locked_by = 0.0  # factor of the inertia in the last matrix of a step, 1/s^2
        self.replays = not self.remembers and self.elements.remembered > 0
        self._pressing: tuple[ElementGroup, ...] = (*self.pressures, *([] if chambers is None else [chambers]))
        self.elements = self.elements.under(self._pressing)
        self._array_near = self._near
        self._large: bool | None = None

    def variant(
        self, bodies: Bodies, motions: tuple[PrescribedMotion, ...], groups: tuple[Group, ...],
        pressures: tuple[Load, ...] = (),
    ) -> JoinedSystem:
        """See `SegmentSystem`."""
        return JoinedSystem(bodies, motions, groups, self.pair_names, self.nodes, pressures)

    # inertia --------------------------------------------------------------------------------------------------------

    def mass(self, q: np.ndarray) -> sparse.csr_matrix:
        """See `System`; constant."""
        return self._joined_mass

    def momentum(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """See `System`."""
        return np.asarray(self._joined_mass @ u)

    @cached_property
    def _joined_mass(self) -> sparse.csr_matrix:
        nodes = self.elements.mass(q=self.elements.start)
        return sparse.block_diag([sparse.diags_array(self._mass), nodes], format="csr")

    def inertia(self, q: np.ndarray, pattern: BlockPattern) -> np.ndarray:
        """See `System`."""
        mesh = self.elements.mesh
        data = mass_data([*(group.mass() for group in mesh.groups), *mesh.masses], pattern, self._nu)
        set_held(self._fixed, pattern.indptr, pattern.indices, self.elements.held_mass, data)
        blocks = self._mass.reshape(-1, 3)
        data[pattern.diagonal[: len(blocks), None], range(3), range(3)] = blocks
        return data

    def acceleration(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """See `System`."""
        force = self.force(t, q, u)
        nodes = self.elements.mass_solve(force[self._nu :])
        return np.concatenate([force[: self._nu] / self._mass, nodes])

    # locked directions ------------------------------------------------------------------------------------------------

    def lock(self, by_acceleration: float) -> bool:
        """See `System`."""
        self._locked_by = by_acceleration
        return super().lock(by_acceleration + self.wave_factor if by_acceleration > 0.0 else 0.0)

    @cached_property
    def arm(self) -> float:
        """See `SegmentForces`; frames are at their joints, at no distance from them."""
        return float(self.scales().length)

    def halfway(self, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
        """See `System`."""
        return self.elements.halfway(t, h, q[self._nq :], x[self._nu :])

    def consistent(self, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool = False) -> bool:
        """See `System`."""
        if self.locking:
            from fsm.kernels.addresses import floats_3d
            from fsm.model.bodies.arrays import LOCKED_BY
            from fsm.model.nodes.arrays import DAMPING

            model, bodies, *_ = self._locked
            bodies[0].interval[LOCKED_BY] = self._locked_by
            if self._locked_by > 0.0:
                assert model.nodes is not None
                floats_3d(model.nodes.table, DAMPING)[:] = self.linearise(t, q, u).damping.data
        return super().consistent(t, q, u, rate)

    def _with_locked(self, function: Any, *arguments: Any) -> Any:
        return function(self._locked[0], *arguments)  # its pointers remember the types of bodies alone

    def _forces_on_nodes(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        return self._generalised(t, q, u, None, np.zeros(self.at_rest.shape))[self._nu :]

    @cached_property
    def _locked(self) -> JoinedModel:
        """See `SegmentSystem`; the types are those of the whole model."""
        from fsm.model.joined.arrays_of import joined_of  # imports the kernels of all steps
        from fsm.model.system.arrays_of import ContactModel

        alone = self.variant(self.bodies, self.motions, self.locking)
        pattern = alone._first_pattern()
        return joined_of(alone, pattern, alone._near.copy(), _alone, ContactModel(alone.contacts, pattern, True, 0))

    # forces ---------------------------------------------------------------------------------------------------------

    def _generalised(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None, forces: np.ndarray,
        whole: bool = True,
    ) -> np.ndarray:
        out = self._all_generalised(t, q, u, before, forces, whole)
        out[self._nu :] = self.elements.free_forces(q[self._nq :], out[self._nu :])
        return out

    def _all_generalised(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None, forces: np.ndarray,
        whole: bool = True,
    ) -> np.ndarray:
        """Forces (nu,) on all coordinates, held ones included."""
        nodes = q[self._nq :]
        here, rates = self.elements.place(t, nodes, None if u is None else u[self._nu :], self._nodes_before(before))
        out = np.zeros(self.nu)
        if whole:
            out[self._nu :] = self.elements.all_forces(t, here, rates)
        maps = self._maps(here, np.zeros_like(here))[0]
        fold_forces(forces[self._ordered], self._first, self._rows, self._members(maps), out)
        return out

    def node_reactions(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None
    ) -> np.ndarray:
        """Forces that hold the coordinates of the ANCF nodes, flat, N and N m; 0 for free coordinates.

        Only in motion, the inertia of free coordinates contributes.
        """
        forces = self._all_forces(self.state(t, q, u, before))
        force = self._all_generalised(t, q, u, before, forces)[self._nu :]
        in_motion = before is None and u is not None
        return self.elements.held_forces(force) if in_motion else np.where(self.elements.fixed, -force, 0.0)

    def _folded(self, q: np.ndarray, rows: np.ndarray) -> np.ndarray:
        nodes = q[self._nq :]
        out = np.zeros(self.nu)
        wrenches = np.ascontiguousarray(rows.reshape(-1, 6)[: len(self._ordered)])
        fold_forces(wrenches, self._first, self._rows, self._members(self._maps(nodes, np.zeros_like(nodes))[0]), out)
        out[self._fixed.ravel()] = 0.0
        return out

    def locked_springs(self, t: float, q: np.ndarray) -> LockedSprings | None:
        """See `System`; springs between bodies and nodes keep their stiffness."""
        return None

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
        pattern, wrenches, body_stiffness, body_damping = sums
        joined = self._pattern_of(pattern)
        nodes = q[self._nq :]
        here, rates = self.elements.place(t, nodes, None if u is None else u[self._nu :], self._nodes_before(before))
        at_rest = np.zeros_like(here) if rates is None else rates
        moments = np.ascontiguousarray(wrenches[self.frames.bodies, 3:])
        members = self._members(self._maps(here, at_rest)[0])
        turns, curvatures = self._turns(here, at_rest, moments)
        stiffness, damping = joined.pattern.zeros(), joined.pattern.zeros()
        blocks = pattern.indptr, pattern.indices
        places = joined.starts, joined.slots
        add_condensed(*blocks, body_stiffness, self._first, members, members, *places, stiffness)
        add_condensed(*blocks, body_damping, self._first, members, members, *places, damping)
        if u is not None:
            turning = np.concatenate([np.zeros((2 * self.n_free, 6, 3)), turns])
            acting = body_damping if by_rates is None else by_rates
            add_condensed(*blocks, acting, self._first, members, turning, *places, stiffness)
        add_curvatures(
            joined.pattern.indptr, joined.pattern.indices, self.frames, self._vector_rows, curvatures, stiffness,
        )  # fmt: skip
        force = np.zeros(self.nu)
        own = force[self._nu :]
        first = 0
        for group, slots in zip(self.elements.groups, self._slots, strict=True):
            if isinstance(group, FacetGroup):
                group.give_efforts(None if efforts is None else efforts[first : first + group.effort_count])
                first += group.effort_count
            group.add_linearised(here, rates, slots, own, stiffness, damping)
        self.elements.add_loads(t, rates, own)
        fold_forces(wrenches[self._ordered], self._first, self._rows, members, force)
        own[:] = self.elements.free_forces(nodes, own)
        set_held(self._fixed, joined.pattern.indptr, joined.pattern.indices, self.elements.held_stiffness, stiffness)
        set_held(self._fixed, joined.pattern.indptr, joined.pattern.indices, 0.0, damping)
        tangent = BlockMatrix(joined.pattern, stiffness, self.low_rank)
        return Linearised(force, tangent, BlockMatrix(joined.pattern, damping))

    @property
    def _changing(self) -> tuple[LowRank, np.ndarray] | None:
        """See `SegmentForces`."""
        if self.chambers is None:
            return None
        nodes = np.where(self.elements.fixed, -1, np.arange(self.elements.nu))
        return self.chambers.low_rank, np.concatenate([np.full(self._nu, -1), nodes])

    def efforts(
        self, t: float, q: np.ndarray, before: PreviousState | None = None, dx: np.ndarray | None = None
    ) -> np.ndarray:
        """See `System`; efforts of springs, then membrane efforts of flexible facets."""
        of_springs = super().efforts(t, q, before, dx)
        here, _ = self.elements.place(t, q[self._nq :], None)
        moved = None
        if dx is not None:
            moved = dx[self._nu :].copy()
            moved[self.elements.fixed] = 0.0
        facets = (group for group in self.elements.mesh.groups if isinstance(group, FacetGroup))
        return np.concatenate([of_springs, *(group.efforts(here, moved) for group in facets)])

    def _turned(self, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None) -> np.ndarray | None:
        if before is None or u is None:
            return None
        return np.asarray(increment_blocks(pose_difference(before[1][: self._nq], q[: self._nq])))

    # energies and records -------------------------------------------------------------------------------------------

    def energy(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Energy:
        """See `System`."""
        return self._with_nodes(super().energy(t, q, u, before), t, q, u, before)

    def loss_of_elements(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> float:
        """See `System`."""
        rates = None if u is None else u[self._nu :]
        of_nodes = self.elements.energy(t, q[self._nq :], rates, self._nodes_before(before)).dissipated_power
        return super().loss_of_elements(t, q, u, before) + of_nodes

    def observe(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Observation:
        """See `System`."""
        observed = super().observe(t, q, u, before)
        reaction = observed.reaction
        # held coordinates are supports; statics does not need the reactions of supports while the system moves
        if u is None or before is not None:
            held = self.node_reactions(t, q, u, before)[self.elements.mesh.is_position]
            reaction = max(reaction, float(np.linalg.norm(held.reshape(-1, 3), axis=1).max(initial=0.0)))
        energy = self._with_nodes(observed.energy, t, q, u, before)
        return replace(observed, energy=energy, reaction=reaction)

    def _with_nodes(
        self, bodies: Energy, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None
    ) -> Energy:
        rates = None if u is None else u[self._nu :]
        return bodies.plus(self.elements.energy(t, q[self._nq :], rates, self._nodes_before(before)))

    # pressures ------------------------------------------------------------------------------------------------------

    def force_rate(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`; pressures and gas are included."""
        out = super().force_rate(t, q)
        here, _ = self.elements.place(t, q[self._nq :], None)
        for group in self._pressing:
            group.add_force_rate(t, here, out[self._nu :])
        out[self._fixed.ravel()] = 0.0
        return out

    def chamber_nodes(self, t: float, q: np.ndarray) -> np.ndarray:
        """Coordinates of the nodes, flat, as `Chambers` has them."""
        return self.elements.place(t, q[self._nq :], None)[0]

    def break_times(self) -> list[float]:
        """See `System`; pressures and gas are included."""
        return sorted({*super().break_times(), *(time for group in self._pressing for time in group.break_times())})

    def peak_times(self) -> list[float]:
        """See `System`; pressures and gas are included."""
        of_loads = (time for group in self._pressing for time in group.peak_times())
        return sorted({*super().peak_times(), *of_loads, *self.elements.peak_times()})

    def shortest_step(self) -> float:
        """See `System`; the result is at most a small fraction of 1/omega of the softest motion against the gas, at the
        present pressure.
        """
        found, chambers = super().shortest_step(), self.chambers
        if chambers is None or not found:
            return found
        nodes = self.elements.place(0.0, self.initial()[0][self._nq :], None)[0]
        for stiffness, gradient in chambers.compressions(nodes):
            free = np.where(self.elements.fixed, 0.0, gradient)
            squared = stiffness * float(free @ self.elements.mass_solve(free))
            found = min(found, _OF_GAS / math.sqrt(squared)) if squared > 0.0 else found
        return found

    def load_displacements(
        self, start: tuple[float, np.ndarray], end: tuple[float, np.ndarray]
    ) -> dict[str, tuple[float, float]]:
        """See `SegmentSystem`; a pressure has its size (Pa) and its swept volume (m^3)."""
        out = super().load_displacements(start, end)
        one, two = (self.elements.place(t, q[self._nq :], None)[0] for t, q in (start, end))
        for pressure in self.pressures:
            out[pressure.load + PRESSURE] = pressure.size(end[0]), pressure.swept(one, two)
        if self.chambers is not None:
            gases = self.chambers.pressures_and_changes((start[0], one), (end[0], two))
            out |= {name + PRESSURE: pair for name, pair in gases.items()}
        return out

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, t: float, q: np.ndarray, u: np.ndarray, before: PreviousState | None = None) -> None:
        """See `System`: also stores the quaternions of frames and the fold angles, because both must remain
        continuous.
        """
        super().commit(t, q, u, before)
        self.elements.commit(t, q[self._nq :], u[self._nu :])
        self._near = self._poses(t, q)[self.frames.bodies, 3:].copy()

    def memory(self) -> np.ndarray:
        """See `System`: quaternions of the frames, memory of the elements and the gas, then memory of the bodies."""
        return np.concatenate([self._memory_of_nodes(), super().memory()])

    def element_memory(self) -> np.ndarray:
        """See `System`."""
        return np.concatenate([self._memory_of_nodes(), super().element_memory()])

    def _memory_of_nodes(self) -> np.ndarray:
        return np.concatenate([self._near.ravel(), self.elements.memory()])

    def restore(self, memory: np.ndarray) -> None:
        """See `System`."""
        size = self._near.size
        self._near = memory[:size].reshape(-1, 4).copy() if len(memory) else self._start_near.copy()
        self._with_frames, self._moving_frames = [], None
        last = size + self.elements.remembered
        self.elements.restore(memory[size:last])
        super().restore(memory[last:])

    def replayed(self, memory: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """See `System`: fold angles beyond half a turn, and sliders of creases."""
        present, found = self.element_memory(), []
        self.recall(memory)
        for t, q in zip(times.tolist(), states, strict=True):
            self.elements.commit(t, q[self._nq :], np.zeros(self.elements.nu))
            found.append(self.element_memory())
        self.recall(present)
        return np.array(found)

    def recall(self, memory: np.ndarray) -> None:
        """See `System`."""
        first = self._near.size
        self.elements.restore(memory[first : first + self.elements.remembered])

    # arrays ---------------------------------------------------------------------------------------------------------

    def _arrays_of(
        self, pattern: BodyPattern, ready: Ready, contacts: ContactModel
    ) -> tuple[ArrayModel, tuple[object, ...]]:
        from fsm.model.joined.arrays_of import joined_of
        from fsm.model.system.array_kernels import KERNELS

        self._array_near = self._near.copy()
        model, *arrays = joined_of(self, pattern, self._array_near, ready, contacts)
        return ArrayModel.of(KERNELS, model, *self.initial()), tuple(arrays)

    def _static_arrays_of(self, ready: Ready) -> StaticSegments | None:
        """See `SegmentSystem`."""
        from fsm.model.joined.static_arrays import JoinedStatics  # imports the kernels of all steps

        return JoinedStatics(self, self._first_pattern(), ready)

    def large_statics(self, ready: Ready) -> tuple[str, ...]:
        """See `SegmentSystem`; facets have few contacts, so that nearly all blocks of their matrix are used."""
        if self._large is None:
            facets = any(isinstance(group, FacetGroup) for group in self.elements.mesh.groups)
            pattern = self._pattern_of(self._first_pattern()).pattern if facets else None
            self._large = pattern is not None and ready(pattern)[0].large(pattern.size)
        return ("statics of so many flexible facets are faster with dense fronts",) if self._large else ()

    def to_arrays(self, resolve: bool) -> None:
        """See `System`: memory of contacts, and quaternions of the frames."""
        super().to_arrays(resolve)
        self._array_near[:] = self._near

    def from_arrays(self) -> None:
        """See `to_arrays`."""
        self._near = self._array_near.copy()
        super().from_arrays()


def pressure_of(load: Load, faces: PressedFaces) -> PressureGroup:
    """Pressure of a load on some of the faces of a sheet."""
    assert load.pressure is not None and isinstance(load.at, str)
    facets = facets_named(load.at, int(faces.facet.max()) + 1)
    return PressureGroup(load.called, faces.of(np.array(facets)), load.pressure, time_function(load.time))
