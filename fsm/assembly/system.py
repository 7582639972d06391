"""System of rigid bodies and ANCF elements that act on each other through frames.

A frame is a body without degrees of freedom that a material point of an element carries. Springs, creases, contacts and
loads act on it as on any body. Its wrenches and tangents go to the nodal vectors of the element (`fsm.assembly.frames`).

The configuration holds the poses of the free bodies, then the coordinates of the ANCF nodes; the velocity likewise.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy import sparse

from fsm.ancf.assembly import slots_of
from fsm.ancf.matrices import mass_data, set_held
from fsm.ancf.system import AncfSystem
from fsm.assembly.condense import JoinedPattern, add_condensed, add_curvatures, fold_forces, joined_pattern, members_of
from fsm.assembly.drawn_lines import DrawnLines
from fsm.assembly.frames import Frames, frame_maps, place_frames
from fsm.blocks import BlockMatrix, BlockPattern
from fsm.kernels.body_poses import increment_blocks, pose_difference
from fsm.kernels.vector import equal_vectors
from fsm.segments.configuration import Bodies
from fsm.segments.contacts import ContactGroup
from fsm.segments.drive import PrescribedMotion
from fsm.segments.group import Group
from fsm.segments.pattern import BodyPattern
from fsm.segments.system import SegmentSystem
from fsm.system_records import Energy, Linearised, Observation, PreviousState, Scales

__all__ = ["JoinedSystem"]

_FOLLOWED = 0.5
"""Shortest step times omega of the shortest axial wave that the mesh resolves."""


class JoinedSystem(SegmentSystem):
    """System of rigid bodies, ANCF elements and their connections; implements the `System` protocol.

    Parameters
    ----------
    bodies, motions, groups, contacts, pair_names : see `SegmentSystem`
    elements : AncfSystem
        Elements, supports and loads of the ANCF nodes.
    frames : Frames
    lines : DrawnLines
    """

    def __init__(
        self,
        bodies: Bodies,
        motions: tuple[PrescribedMotion, ...],
        groups: tuple[Group, ...],
        contacts: tuple[ContactGroup, ...],
        pair_names: tuple[str, ...],
        elements: AncfSystem,
        frames: Frames,
        lines: DrawnLines,
    ) -> None:
        super().__init__(bodies, motions, groups, contacts, pair_names)
        self.elements, self.frames, self.lines = elements, frames, lines
        self._dof[frames.bodies] = self.n_free + np.arange(len(frames.bodies))
        self._ordered = np.concatenate([bodies.free, frames.bodies])
        self._nq, self._nu = self.nq, self.nu
        self.nq, self.nu = self._nq + elements.nq, self._nu + elements.nu
        self.rate_dependent = self.rate_dependent or elements.rate_dependent
        self._looks_back = self.of_vectors = True
        self._first, self._rows = members_of(self.n_free, frames)
        self._vector_rows = self._rows[2 * self.n_free :]
        self._fixed = np.concatenate([np.zeros(self._nu, dtype=bool), elements.fixed]).reshape(-1, 3)
        self._near = bodies.pose[frames.bodies, 3:].copy()
        self._start_near = self._near.copy()
        self._arrays = (
            frames.first, frames.vectors, frames.weights, frames.along, frames.across, frames.fixed, frames.oriented,
        )  # fmt: skip
        self._joined: JoinedPattern | None = None
        self._joined_of: BlockPattern | None = None
        self._slots: list[np.ndarray] = []
        self._with_frames: list[tuple[float, np.ndarray, np.ndarray]] = []
        self._moving_frames: tuple[np.ndarray, float | None, np.ndarray, np.ndarray] | None = None

    def variant(
        self, bodies: Bodies, motions: tuple[PrescribedMotion, ...], groups: tuple[Group, ...]
    ) -> JoinedSystem:
        """See `SegmentSystem`."""
        contacts = tuple(group for group in groups if isinstance(group, ContactGroup))
        return JoinedSystem(bodies, motions, groups, contacts, self.pair_names, self.elements, self.frames, self.lines)

    def all_states(self, t: float, q: np.ndarray, u: np.ndarray) -> dict[str, np.ndarray]:
        """See `SegmentSystem`."""
        return super().all_states(t, q, u) | {"nodes": q[self._nq :].copy(), "node_rates": u[self._nu :].copy()}

    def from_states(self, states: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """See `SegmentSystem`."""
        q, u = super().from_states(states)
        return np.concatenate([q, states["nodes"]]), np.concatenate([u, states["node_rates"]])

    # configuration --------------------------------------------------------------------------------------------------

    def initial(self) -> tuple[np.ndarray, np.ndarray]:
        """See `System`."""
        q, u = super().initial()
        start, rate = self.elements.initial()
        return np.concatenate([q, start]), np.concatenate([u, rate])

    def kinematic_map(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """See `System`."""
        return np.concatenate([super().kinematic_map(q[: self._nq], u[: self._nu]), u[self._nu :]])

    def kinematic_jacobian(self, q: np.ndarray, u: np.ndarray) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """See `System`."""
        of_bodies = super().kinematic_jacobian(q[: self._nq], u[: self._nu])
        others = self.elements.kinematic_jacobian(q[self._nq :], u[self._nu :])
        by_q, by_u = (sparse.block_diag([one, other], format="csr") for one, other in zip(of_bodies, others, strict=True))
        return by_q, by_u

    def tangent_map(self, q: np.ndarray) -> sparse.csr_matrix:
        """See `System`."""
        of_bodies = super().tangent_map(q[: self._nq])
        return sparse.block_diag([of_bodies, sparse.eye_array(self.elements.nu)], format="csr")

    def retract(self, q: np.ndarray, dx: np.ndarray) -> np.ndarray:
        """See `System`."""
        return np.concatenate([super().retract(q[: self._nq], dx[: self._nu]), q[self._nq :] + dx[self._nu :]])

    def difference(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """See `System`."""
        of_bodies = super().difference(start[: self._nq], end[: self._nq])
        return np.concatenate([of_bodies, end[self._nq :] - start[self._nq :]])

    def increment_map(self, dx: np.ndarray) -> np.ndarray:
        """See `System`: two blocks of three rows for each body, one for each vector."""
        blocks = np.zeros((self.nu // 3, 3, 3))
        blocks[:, range(3), range(3)] = 1.0
        blocks[1 : 2 * self.n_free : 2] = increment_blocks(dx[: self._nu])[:, 3:, 3:]
        return blocks

    def _poses(self, t: float, q: np.ndarray) -> np.ndarray:
        for k, (at, known, poses) in enumerate(self._with_frames):
            if t == at and equal_vectors(q, known):
                self._with_frames.insert(0, self._with_frames.pop(k))  # `change` is at the state asked for last
                return poses
        of_bodies, nodes = q[: self._nq], q[self._nq :]
        poses = super()._poses(t, of_bodies).copy()
        here, _ = self.elements.place(t, nodes, None)
        place_frames(self.frames.bodies, *self._arrays, here, self._near, poses)
        self._with_frames = [(t, q.copy(), poses), *self._with_frames[:1]]
        return poses

    def place(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """See `Configuration`; frames included."""
        poses = self._poses(t, q)
        if u is None:
            return poses, self.at_rest
        since, last = None if before is None else before[0], self._moving_frames
        if last is not None and last[0] is poses and last[1] == since and equal_vectors(u, last[2]):
            return poses, last[3]
        rates = self._body_rates(u[: self._nu], t, before)
        nodes, moving = self.elements.place(t, q[self._nq :], u[self._nu :], self._nodes_before(before))
        assert moving is not None
        rates[self.frames.bodies] = self._maps(nodes, moving, None)[3]
        self._moving_frames = poses, since, u.copy(), rates
        return poses, rates

    def _nodes_before(self, before: PreviousState | None) -> PreviousState | None:
        return None if before is None else (before[0], before[1][self._nq :])

    def change(self, dx: np.ndarray) -> np.ndarray:
        """Increments (n_bodies, 6) of all bodies and frames; zero for held and driven bodies."""
        out = super().change(dx[: self._nu])
        nodes = self._with_frames[0][1][self._nq :]
        here, _ = self.elements.place(self._with_frames[0][0], nodes, None)
        moved = dx[self._nu :].copy()
        moved[self.elements.fixed] = 0.0
        out[self.frames.bodies] = self._maps(here, moved, None)[3]
        return out

    @property
    def panels(self) -> np.ndarray:
        """See `Configuration`; numbers of films, cables and beams as in `fsm.results.solution`."""
        films = np.full(len(self.elements.mesh.quads), -1, dtype=np.int64)
        return np.concatenate([super().panels, films, np.where(self.lines.half > 0.0, -3, -2)])

    @property
    def quad_names(self) -> tuple[str, ...]:
        """See `Configuration`; names of films, cables and beams."""
        return (*super().quad_names, *self.lines.films, *self.lines.names)

    @property
    def dof(self) -> int:
        """See `System`."""
        return int(np.count_nonzero(~self._fixed))

    def shape(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`: outlines of plates, of films, and lines of cables and beams as quadrilaterals."""
        nodes = q[self._nq :]
        ends = np.einsum("nev,nvc->nec", self.lines.weights, nodes[self.lines.vectors[:, :, None] + np.arange(3)])
        across = np.zeros((len(ends), 1, 3))
        across[:, 0, 1] = self.lines.half
        bands = np.concatenate([ends - across, (ends + across)[:, ::-1]], axis=1)
        return np.concatenate([super().shape(t, q), self.elements.shape(t, nodes), bands])

    def worst_body(self, vector: np.ndarray) -> str:
        """See `System`."""
        worst = int(np.argmax(np.abs(np.nan_to_num(vector, nan=np.inf))))
        return super().worst_body(vector[: self._nu]) if worst < self._nu else self.elements.worst_body(vector[self._nu :])

    @cached_property
    def _scales(self) -> Scales:
        """Typical sizes of bodies and of elements.

        The velocity of a node is the material velocity in an axial wave with this amplitude and the length of an element. So
        errors of waves that the mesh resolves are measured by their displacements.
        """
        nodes = self.elements.scales()
        wave = self._wave_speed / nodes.length
        velocity = wave * nodes.increment
        if not self.n_free:
            return replace(nodes, velocity=velocity)
        bodies: Scales = SegmentSystem._scales.func(self)  # type: ignore[attr-defined]
        length = min(bodies.length, nodes.length)
        in_u = np.tile(np.arange(6) < 3, self.n_free)
        in_q = np.tile(np.arange(7) < 3, self.n_free)
        is_position = self.elements.mesh.is_position
        span = np.concatenate([in_u, is_position])
        return Scales(
            length,
            np.where(np.concatenate([in_q, is_position]), length, 1.0),
            np.concatenate([bodies.velocity, velocity]),
            np.where(span, length, 1.0),
            np.where(span, max(bodies.largest_span, nodes.largest_span), 1.0),
            np.concatenate([bodies.resolution, nodes.resolution]),
        )

    @cached_property
    def _wave_speed(self) -> float:
        """Largest speed of axial waves in films and cables, sqrt(E/rho), m/s."""
        return max((getattr(group, "wave_speed", 0.0) for group in self.elements.mesh.groups), default=0.0)

    def shortest_step(self) -> float:
        """See `System`: a part of 1/omega of an axial wave four elements long, the shortest that a mesh resolves."""
        if not self._wave_speed:
            return 0.0
        return _FOLLOWED * self.elements.scales().length / (0.5 * math.pi * self._wave_speed)

    # inertia --------------------------------------------------------------------------------------------------------

    def mass(self, q: np.ndarray) -> sparse.csr_matrix:
        """See `System`; constant."""
        return self._joined_mass

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

    # forces ---------------------------------------------------------------------------------------------------------

    def _maps(
        self, nodes: np.ndarray, rates: np.ndarray, moments: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Maps, turns, curvatures and rates of all frames, see `frame_maps`."""
        count, size = len(self.frames.bodies), len(self.frames.vectors)
        out = np.zeros((size, 6, 3)), np.zeros((size, 6, 3)), np.zeros((count, 6, 6)), np.zeros((count, 6))
        frame_maps(*self._arrays, nodes, rates, np.zeros((count, 3)) if moments is None else moments, *out)
        return out

    def _members(self, maps: np.ndarray) -> np.ndarray:
        """Maps of the members of bodies and frames, (m, 6, 3); a body has its two halves."""
        halves = np.zeros((self.n_free, 2, 6, 3))
        halves[:, 0, range(3), range(3)] = 1.0
        halves[:, 1, range(3, 6), range(3)] = 1.0
        return np.concatenate([halves.reshape(-1, 6, 3), maps])

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
        maps = self._maps(here, np.zeros_like(here), None)[0]
        fold_forces(forces[self._ordered], self._first, self._rows, self._members(maps), out)
        return out

    def node_reactions(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None
    ) -> np.ndarray:
        """Forces that hold the coordinates of the ANCF nodes, flat, N and N m; 0 for free coordinates."""
        forces = self._all_forces(t, *self.place(t, q, u, before), self._past(t, before))
        force = self._all_generalised(t, q, u, before, forces)[self._nu :]
        return self.elements.held_forces(force) if before is None else np.where(self.elements.fixed, -force, 0.0)

    def _folded(self, q: np.ndarray, rows: np.ndarray) -> np.ndarray:
        nodes = q[self._nq :]
        out = np.zeros(self.nu)
        wrenches = np.ascontiguousarray(rows.reshape(-1, 6)[: len(self._ordered)])
        fold_forces(wrenches, self._first, self._rows, self._members(self._maps(nodes, np.zeros_like(nodes), None)[0]), out)
        out[self._fixed.ravel()] = 0.0
        return out

    def _pattern_of(self, bodies: BodyPattern) -> JoinedPattern:
        if self._joined is None or self._joined_of is not bodies:
            mesh, shift = self.elements.mesh, 2 * self.n_free
            vectors = [group.vectors for group in mesh.groups] + [part.vectors for part in mesh.masses]
            joined = [vector // 3 + shift for vector in vectors if len(vector)]
            self._joined = joined_pattern(self.nu // 3, bodies, self._first, self._rows, joined)
            self._joined_of = bodies
            pattern = self._joined.pattern
            self._slots = [
                slots_of(np.ascontiguousarray(group.vectors + self._nu), 3, pattern.indptr, pattern.indices)
                for group in mesh.groups
            ]
        return self._joined

    def _assembled(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray | None,
        before: PreviousState | None,
        pattern: BodyPattern,
        sums: tuple[np.ndarray, np.ndarray, np.ndarray],
        by_rates: np.ndarray | None,
    ) -> Linearised:
        wrenches, body_stiffness, body_damping = sums
        joined = self._pattern_of(pattern)
        nodes = q[self._nq :]
        here, rates = self.elements.place(t, nodes, None if u is None else u[self._nu :], self._nodes_before(before))
        at_rest = np.zeros_like(here) if rates is None else rates
        moments = np.ascontiguousarray(wrenches[self.frames.bodies, 3:])
        maps, turns, curvatures, _ = self._maps(here, at_rest, moments)
        members = self._members(maps)
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
            joined.pattern.indptr, joined.pattern.indices, self.frames.first, self._vector_rows, self.frames.along,
            self.frames.across, curvatures, stiffness,
        )  # fmt: skip
        force = np.zeros(self.nu)
        own = force[self._nu :]
        for group, slots in zip(self.elements.mesh.groups, self._slots, strict=True):
            group.add_linearised(here, rates, slots, own, stiffness, damping)
        self.elements.add_loads(t, rates, own)
        fold_forces(wrenches[self._ordered], self._first, self._rows, members, force)
        own[:] = self.elements.free_forces(nodes, own)
        set_held(self._fixed, joined.pattern.indptr, joined.pattern.indices, self.elements.held_stiffness, stiffness)
        set_held(self._fixed, joined.pattern.indptr, joined.pattern.indices, 0.0, damping)
        return Linearised(force, BlockMatrix(joined.pattern, stiffness), BlockMatrix(joined.pattern, damping))

    def _turned(self, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None) -> np.ndarray | None:
        if before is None or u is None:
            return None
        return np.asarray(increment_blocks(pose_difference(before[1][: self._nq], q[: self._nq])))

    # energies and records -------------------------------------------------------------------------------------------

    def energy(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Energy:
        """See `System`."""
        return self._with_nodes(super().energy(t, q, u, before), t, q, u, before)

    def observe(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Observation:
        """See `System`."""
        observed = super().observe(t, q, u, before)
        return replace(observed, energy=self._with_nodes(observed.energy, t, q, u, before))

    def _with_nodes(
        self, bodies: Energy, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None
    ) -> Energy:
        nodes = self.elements.energy(t, q[self._nq :], None if u is None else u[self._nu :], self._nodes_before(before))
        potential = dict(bodies.potential)
        for name, value in nodes.potential.items():
            potential[name] = potential.get(name, 0.0) + value
        return Energy(
            bodies.kinetic + nodes.kinetic,
            potential,
            bodies.dissipated_power + nodes.dissipated_power,
            bodies.input_power + nodes.input_power,
            bodies.pair_power,
            bodies.sliding_power,
            bodies.driven,
            (bodies.load_power or 0.0) + nodes.input_power,
        )

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, t: float, q: np.ndarray, u: np.ndarray, before: PreviousState | None = None) -> None:
        """See `System`: stores the quaternions of frames too, which must remain continuous."""
        super().commit(t, q, u, before)
        self._near = self._poses(t, q)[self.frames.bodies, 3:].copy()

    def memory(self) -> np.ndarray:
        """See `System`: quaternions of the frames, then all else."""
        return np.concatenate([self._near.ravel(), super().memory()])

    def restore(self, memory: np.ndarray) -> None:
        """See `System`."""
        size = self._near.size
        self._near = memory[:size].reshape(-1, 4).copy() if len(memory) else self._start_near.copy()
        self._with_frames, self._moving_frames = [], None
        super().restore(memory[size:])

    def newton_pattern(self) -> None:
        """See `MixedSystem`: None, because the single call supports only springs between bodies."""
        return None
