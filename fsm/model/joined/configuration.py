"""Configuration of rigid bodies and ANCF elements that act on each other through frames: positions, shape, typical
sizes.

The configuration contains the poses of the free bodies, then the coordinates of the ANCF nodes. The velocity has the
same order.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import sparse

from fsm.kernels.blocks import BlockPattern
from fsm.kernels.body_poses import increment_blocks
from fsm.kernels.vector import equal_vectors
from fsm.model.bodies.configuration import Bodies
from fsm.model.bodies.drive import PrescribedMotion
from fsm.model.bodies.group import BodyPattern, Group
from fsm.model.joined.chambers import Chambers
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.facets.facet_group import FacetGroup
from fsm.model.nodes.facets.pressure import PressedFaces
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.system.condense import JoinedPattern, joined_pattern, members_of
from fsm.model.system.frames import Frames, frame_maps, frame_turns, place_frames
from fsm.model.system.system import SegmentSystem
from fsm.solve.interface.records import PreviousState
from fsm.solve.interface.scales import Scales
from fsm.solve.interface.system import System

_WAVES = 1e-2
"""Part of the square of the rate of axial waves in an element that counts in penalties; 100 times its stiffness."""
_FOLLOWED = 0.5
"""Shortest step times omega of the shortest axial wave that the mesh resolves."""


class DrawnLines(NamedTuple):
    """Lines that are drawn for cables and beams.

    Attributes
    ----------
    vectors : (n, 4) int array
        First coordinates of the vectors of the element to which each line belongs.
    weights : (n, 2, 4) array
        Factors of these vectors that give the ends.
    half : (n,) array, m
        Half the width along y, of beams; 0 for cables.
    names : (n,) names of the cables and beams
    faces : names of the parts of the faces of the mesh
    panels : (m,) int array
        Number of the panel of each face (`fsm.results.solution`): -1 for a film, 0 for a face of a truss.
    """

    vectors: np.ndarray
    weights: np.ndarray
    half: np.ndarray
    names: tuple[str, ...]
    faces: tuple[str, ...]
    panels: np.ndarray


class Nodes(NamedTuple):
    """Part of a joined system that all its variants share.

    Attributes
    ----------
    elements : AncfSystem
        Elements, supports and loads of the ANCF nodes.
    frames : Frames
    lines : DrawnLines
    faces : PressedFaces or None
        Triangles of a sheet that can carry a pressure.
    chambers : Chambers or None
        Chambers of gas.
    """

    elements: AncfSystem
    frames: Frames
    lines: DrawnLines
    faces: PressedFaces | None = None
    chambers: Chambers | None = None


class JoinedConfiguration(SegmentSystem):
    """Rigid bodies, ANCF elements and frames, and their positions.

    Parameters
    ----------
    bodies, motions, groups, pair_names : see `SegmentSystem`
    nodes : Nodes
    """

    def __init__(
        self,
        bodies: Bodies,
        motions: tuple[PrescribedMotion, ...],
        groups: tuple[Group, ...],
        pair_names: tuple[str, ...],
        nodes: Nodes,
    ) -> None:
        super().__init__(bodies, motions, groups, pair_names)
        self.nodes = nodes
        self.elements, self.frames, self.lines, self.faces, self.chambers = nodes
        elements, frames = self.elements, self.frames
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

    @property
    def first_facet(self) -> int:
        """First coordinate of the mesh of flexible facets among those of the ANCF nodes."""
        groups = (group for group in self.elements.mesh.groups if isinstance(group, FacetGroup))
        return next((group.first for group in groups), 0)

    @property
    def frames_near(self) -> np.ndarray:
        """Quaternions of the frames in the last accepted state, (n, 4)."""
        return self._near

    @frames_near.setter
    def frames_near(self, near: np.ndarray) -> None:
        self._near = near

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
                # `change` refers to the state of the last evaluation
                self._with_frames.insert(0, self._with_frames.pop(k))
                return poses
        of_bodies, nodes = q[: self._nq], q[self._nq :]
        poses = super()._poses(t, of_bodies).copy()
        here, _ = self.elements.place(t, nodes, None)
        place_frames(self.frames.bodies, *self._arrays, here, self._near, poses)
        self._with_frames = [(t, q.copy(), poses), *self._with_frames[:1]]
        return poses

    def poses_over_time(self, times: np.ndarray, q: np.ndarray) -> np.ndarray:
        """See `Configuration`; frames included."""
        return np.array([self._poses(float(t), state) for t, state in zip(times, q, strict=True)])

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
        rates[self.frames.bodies] = self._maps(nodes, moving)[1]
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
        out[self.frames.bodies] = self._maps(here, moved)[1]
        return out

    # joined matrix --------------------------------------------------------------------------------------------------

    def _members(self, maps: np.ndarray) -> np.ndarray:
        """Maps of the members of bodies and frames, (m, 6, 3); a body has its two halves."""
        halves = np.zeros((self.n_free, 2, 6, 3))
        halves[:, 0, range(3), range(3)] = 1.0
        halves[:, 1, range(3, 6), range(3)] = 1.0
        return np.concatenate([halves.reshape(-1, 6, 3), maps])

    def members(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Members of free bodies and frames (`members_of`), and their maps, without those of frames."""
        return self._first, self._rows, self._members(np.zeros((len(self.frames.vectors), 6, 3)))

    def joined_matrix(self, bodies: BodyPattern) -> tuple[JoinedPattern, list[np.ndarray], np.ndarray]:
        """Pattern of the joined matrix, the slots there of every group of elements of nodes, and held coordinates (n, 3)."""
        return self._pattern_of(bodies), self._slots, self._fixed

    def _pattern_of(self, bodies: BodyPattern) -> JoinedPattern:
        if self._joined is None or self._joined_of is not bodies:
            mesh, shift = self.elements.mesh, 2 * self.n_free
            vectors = [group.vectors for group in self.elements.groups] + [part.vectors for part in mesh.masses]
            joined = [vector // 3 + shift for vector in vectors if len(vector)]
            self._joined = joined_pattern(self.nu // 3, bodies, self._first, self._rows, joined)
            self._joined_of = bodies
            pattern = self._joined.pattern
            self._slots = [
                slots_of(np.ascontiguousarray(group.vectors + self._nu), 3, pattern.indptr, pattern.indices)
                for group in self.elements.groups
            ]
        return self._joined

    # shape ----------------------------------------------------------------------------------------------------------

    @property
    def panels(self) -> np.ndarray:
        """See `Configuration`; numbers of films, cables and beams as in `fsm.results.solution`."""
        return np.concatenate([super().panels, self.lines.panels, np.where(self.lines.half > 0.0, -3, -2)])

    @property
    def quad_names(self) -> tuple[str, ...]:
        """See `Configuration`; names of films, faces of trusses, cables and beams."""
        return (*super().quad_names, *self.lines.faces, *self.lines.names)

    @property
    def dof(self) -> int:
        """See `System`."""
        return int(np.count_nonzero(~self._fixed))

    def shape(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`; outlines of plates and of films, and lines of cables and beams as quadrilaterals."""
        nodes = q[self._nq :]
        ends = np.einsum("nev,nvc->nec", self.lines.weights, nodes[self.lines.vectors[:, :, None] + np.arange(3)])
        across = np.zeros((len(ends), 1, 3))
        across[:, 0, 1] = self.lines.half
        bands = np.concatenate([ends - across, (ends + across)[:, ::-1]], axis=1)
        return np.concatenate([super().shape(t, q), self.elements.shape(t, nodes), bands])

    def shapes(self, times: np.ndarray, q: np.ndarray) -> np.ndarray:
        """See `System`."""
        return System.shapes(self, times, q)

    def worst_body(self, vector: np.ndarray) -> str:
        """See `System`."""
        worst = int(np.argmax(np.abs(np.nan_to_num(vector, nan=np.inf))))
        return super().worst_body(vector[: self._nu]) if worst < self._nu else self.elements.worst_body(vector[self._nu :])

    @cached_property
    def _scales(self) -> Scales:
        """Typical sizes of bodies and of elements.

        The velocity of a node is the material velocity in an axial wave with this amplitude and the length of an
        element. Errors of waves that the mesh resolves are therefore measured by their displacements.
        """
        nodes, (in_q, in_u) = self.elements.scales(), self._positions
        positions, extent = self.elements.mesh.is_position, max(self.spread, nodes.extent)
        in_q, in_u = np.concatenate([in_q, positions]), np.concatenate([in_u, positions])
        length = min(nodes.length, self._body_length) if self.n_free else nodes.length
        scales = self._sized(length, extent, in_q, in_u, ~self._fixed.ravel())
        velocity, resolution = scales.velocity.copy(), scales.resolution.copy()
        velocity[self._nu :] = self._wave_speed / nodes.length * nodes.increment
        resolution[self._nu :] = math.inf
        return replace(scales, velocity=velocity, resolution=resolution)

    @cached_property
    def _wave_speed(self) -> float:
        """Largest speed of axial waves in films, cables and facets, sqrt(E/rho), m/s.

        A model of trusses alone has its mass in points; the result is then the length times the largest frequency.
        """
        elements = self.elements
        known = max((getattr(group, "wave_speed", 0.0) for group in elements.mesh.groups), default=0.0)
        return known or elements.scales().length * math.sqrt(elements.held_stiffness / elements.held_mass)

    @property
    def wave_factor(self) -> float:
        """Least factor on the inertia of a locked direction in its penalty over `STIFF`, 1/s^2.

        A vector of the mesh is as stiff as its inertia times (c/l)^2, with the speed c of axial waves and the length l of
        an element. In steps longer than l/c, inertia alone gives a penalty below the stiffness of the mesh.
        """
        return _WAVES * (self._wave_speed / self.elements.scales().length) ** 2

    def shortest_step(self) -> float:
        """See `System`; the result is a fraction of 1/omega of the shortest axial wave that the mesh resolves, which is four
        elements long.
        """
        if not self._wave_speed:
            return 0.0
        return _FOLLOWED * self.elements.scales().length / (0.5 * math.pi * self._wave_speed)

    def _maps(self, nodes: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Maps and rates of all frames, see `frame_maps`."""
        out = np.zeros((len(self.frames.vectors), 6, 3)), np.zeros((len(self.frames.bodies), 6))
        frame_maps(*self._arrays, nodes, rates, *out)
        return out

    def _turns(self, nodes: np.ndarray, rates: np.ndarray, moments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the maps and curvatures of all frames, see `frame_turns`."""
        out = np.zeros((len(self.frames.vectors), 6, 3)), np.zeros((len(self.frames.bodies), 6, 6))
        first, vectors, _, along, across, fixed, oriented = self._arrays
        frame_turns(first, vectors, along, across, fixed, oriented, nodes, rates, moments, *out)
        return out
