"""Systems of ANCF meshes: M u' = h(t, q, u), q' = u with a constant sparse M (Sun et al. 2024, eqs. 23, 36).

Coordinates are positions and slopes in inertial axes, so the configuration is a vector space without gyroscopic forces.
Held, moved and unused coordinates stay in q and u, whose blocks are nodes. The corresponding rows and columns of M, K and D
are those of separate stiff oscillators at rest. Moved coordinates are set to their motion before each evaluation.

With `before` (quasi-statics), velocities are mean velocities since that state, and dampers use them at the end of the step.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from fsm.kernels.blocks import BlockMatrix
from fsm.model.nodes.cable import CableGroup
from fsm.model.nodes.films.film import MembraneGroup
from fsm.model.nodes.group import ElementGroup, clear_held
from fsm.model.nodes.loading import Loading
from fsm.model.nodes.system.array_kernels import KERNELS
from fsm.model.nodes.system.arrays_of import Compiled
from fsm.model.nodes.system.moving_mesh import MovingMesh
from fsm.solve.interface.records import Depths, DriveState, Energy, Linearised, Observation, PairState, PreviousState, Ready
from fsm.solve.interface.rest_scales import scales_at_rest
from fsm.solve.interface.scales import OF_DRIVES, AtRest, Scales
from fsm.solve.stepping.equilibrium import RestModel
from fsm.solve.stepping.model import ArrayModel

_NO_PAIRS = PairState(*(np.zeros(0) for _ in range(7)))


class AncfSystem(MovingMesh):
    """Mesh with its loads as a `System`.

    Parameters
    ----------
    mesh : Mesh
    loading : Loading
    start, rate : (n,) arrays
        Initial coordinates (absent: those of the mesh) and their rates (absent: zero).
    """

    _compiled: Compiled | None = None

    # protocol: configuration ----------------------------------------------------------------------------------------

    def scales(self) -> Scales:
        """See `System`."""
        return self._scales

    @cached_property
    def _scales(self) -> Scales:
        """Scales of the system; the length is the median side of the visible faces, or the distance between nodes."""
        places = self.mesh.positions(self.start)
        spread = float(np.ptp(places, axis=0).max())
        corners = self.start[self.mesh.quads[:, :, None] + np.arange(3)]
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
        length = float(np.median(sides)) if len(sides) else (spread or 1.0) / max(len(places) - 1, 1)
        is_position = self.mesh.is_position
        extent, driven = max(spread, length), OF_DRIVES * self.loading.fastest
        speed = max(float(np.abs(self.rate[is_position]).max(initial=0.0)), driven)
        free, turns = ~self.fixed, [False] * len(self.loading.motions)
        at_rest = AtRest(0.0, 0.0) if driven else scales_at_rest(self, free, is_position, extent)
        speed = speed or at_rest.speed
        return Scales.of(length, extent, driven, speed, is_position, is_position, free, math.inf, turns, at_rest.work)

    def arrays(self, ready: Ready) -> ArrayModel | None:
        """See `System`."""
        return None if (known := self._known_arrays(ready)) is None else known.model

    def arrays_at_rest(self, ready: Ready) -> RestModel | None:
        """See `System`; None for large meshes, whose equations `fsm.solve` solves faster."""
        if self.pattern.order and ready(self.pattern)[0].large(self.pattern.size):
            return None
        return None if (known := self._known_arrays(ready)) is None else known.at_rest

    def _known_arrays(self, ready: Ready) -> Compiled | None:
        if self._compiled is None and hasattr(KERNELS.force, "compile"):  # else the compiler is off
            self._compiled = Compiled(self, ready)
        return self._compiled

    # protocol: mechanics --------------------------------------------------------------------------------------------

    def acceleration(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """See `System`."""
        return self.mass_solve(self.force(t, q, u))

    def force(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> np.ndarray:
        """See `System`."""
        here, rates = self.place(t, q, u, before)
        return self.free_forces(q, self.all_forces(t, here, rates))

    def balance(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """See `System`."""
        here, rates = self.place(t, q, u, before)
        return self.force(t, q, u, before), self._drive_state(t, self._reactions(t, here, rates)).force

    def force_rate(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`: change of loads, and columns of K of moved coordinates times their speed."""
        total = np.zeros(self.nu)
        for forcing in self.loading.forcings:
            total += forcing.time.at(t)[1] * forcing.vector
        if self.loading.motions:
            here, moving = self.place(t, q, np.zeros(self.nu))
            assert moving is not None
            total -= self._bsr(self._elements(here, None)[1]) @ moving
        total[self.fixed] = 0.0
        return total

    def linearise(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None,
        efforts: np.ndarray | None = None, depths: Depths | None = None,
    ) -> Linearised:  # fmt: skip
        """See `System`."""
        here, rates = self.place(t, q, u, before)
        force, stiffness, damping = self._elements(here, rates)
        self.add_loads(t, rates, force)
        if self.loading.mass_damping:
            damping += self.loading.mass_damping * self.full_mass
        clear_held(self.fixed, self.pattern, self.held_stiffness, stiffness)
        clear_held(self.fixed, self.pattern, 0.0, damping)
        return Linearised(
            self.free_forces(q, force), BlockMatrix(self.pattern, stiffness), BlockMatrix(self.pattern, damping)
        )

    def energy(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Energy:
        """See `System`."""
        here, rates = self.place(t, q, u, before)
        moved = self.loading.motions and rates is not None
        return self._energy(t, here, rates, self._reactions(t, here, rates) if moved else np.zeros(self.nu))

    def reactions(self, t: float, q: np.ndarray, u: np.ndarray | None) -> np.ndarray:
        """Forces that hold or move the coordinates of each node, (n_nodes, size), N and N m; they are zero for free
        coordinates.
        """
        return self._reactions(t, *self.place(t, q, u)).reshape(-1, self.mesh.size)

    def observe(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Observation:
        """See `System`."""
        here, rates = self.place(t, q, u, before)
        in_motion = u is not None and before is None
        # held coordinates do no work, so the long evaluation of all forces is not needed
        if in_motion and not self.loading.motions:
            reactions, largest = np.zeros(self.nu), 0.0
        else:
            reactions = self._reactions(t, here, rates)
            largest = float(np.linalg.norm(self.mesh.positions(reactions), axis=1).max(initial=0.0))
        return Observation(self._drive_state(t, reactions), self._energy(t, here, rates, reactions), largest, _NO_PAIRS)

    def shape(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`; the outlines are the corners of every membrane element."""
        here, _ = self.place(t, q, None)
        return np.asarray(here[self.mesh.quads[:, :, None] + np.arange(3)])

    def worst_body(self, vector: np.ndarray) -> str:
        """See `System`."""
        return self.mesh.names[int(np.argmax(np.abs(np.nan_to_num(vector, nan=np.inf)))) // self.mesh.size]

    def halfway(self, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
        """See `System`."""
        damped, state = [group for group in self.groups if group.rate_dependent], None
        if h > 0.0 and damped:
            start, (end, rates) = self.place(t, q, None)[0], self.place(t + h, q + x, x / h, (t, q))
            assert rates is not None
            state = start + 0.5 * (end - start), rates
        for group in damped:
            group.act_halfway(state)
        return state is not None

    # protocol: internal variables -----------------------------------------------------------------------------------

    def commit(self, t: float, q: np.ndarray, u: np.ndarray, before: PreviousState | None = None) -> None:
        """See `System`: fold angles, and sliders of creases."""
        if self._with_memory:
            here, _ = self.place(t, q, None)
            for group in self._with_memory:
                group.commit(t, here)

    def memory(self) -> np.ndarray:
        """See `System`."""
        return np.concatenate([np.zeros(0), *(group.memory() for group in self._with_memory)])

    @property
    def remembered(self) -> int:
        """Length of `memory`."""
        return sum(group.remembered for group in self._with_memory)

    def restore(self, memory: np.ndarray) -> None:
        """See `System`."""
        first = 0
        for group in self._with_memory:
            group.restore(memory[first : first + group.remembered])
            first += group.remembered

    # methods beyond the protocol ------------------------------------------------------------------------------------

    def under(self, loads: Sequence[ElementGroup]) -> AncfSystem:
        """The same system with further groups, as pressures and gas; the scales are those of the mesh."""
        self.scales()
        other = copy.copy(self)
        other.groups, other._compiled = (*self.mesh.groups, *loads), None
        return other

    @property
    def _with_memory(self) -> list[ElementGroup]:
        return [group for group in self.groups if group.accept is not None]

    def held(self, q: np.ndarray, coordinates: np.ndarray, loading: Loading | None = None) -> AncfSystem:
        """System at rest in q with more coordinates held, under another loading."""
        return AncfSystem(self.mesh.holding(coordinates), loading, q)

    @property
    def tension_field(self) -> bool:
        """Whether there are films or cables that carry no compression."""
        return any(group.tension_field for group in self._tension_only)

    def release(self, t: float, q: np.ndarray, remainder: float) -> None:
        """Release the compression of tension-only films and cables in q, for all systems on this mesh."""
        q, _ = self.place(t, q, None)
        for group in self._tension_only:
            group.release(q, remainder)

    @property
    def _tension_only(self) -> list[MembraneGroup | CableGroup]:
        return [group for group in self.mesh.groups if isinstance(group, MembraneGroup | CableGroup)]

    def energies(self, t: float, q: np.ndarray) -> dict[str, float]:
        """Potential energy by kind of element, J."""
        return self._potential(self.place(t, q, None)[0])

    def place(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Coordinates and rates, with moved coordinates at time t; if no coordinate is moved, the arguments are returned.

        The method also sets the time of all groups.
        """
        for group in self.groups:
            group.at(t, before)
        motions = self.loading.motions
        if not motions:
            return q, u
        here, rates = q.copy(), None if u is None else u.copy()
        for motion in motions:
            value, slope, _ = motion.time.at(t)
            if before is not None and t > before[0]:
                slope = (value - motion.time.at(before[0])[0]) / (t - before[0])
            here[motion.coordinates] = self.start[motion.coordinates] + value * motion.displacement
            if rates is not None:
                rates[motion.coordinates] = slope * motion.displacement
        return here, rates

    # inside ---------------------------------------------------------------------------------------------------------

    def all_forces(self, t: float, q: np.ndarray, u: np.ndarray | None) -> np.ndarray:
        """Forces (nu,) of elements and loads on all coordinates, held ones included."""
        force = np.zeros(self.nu)
        for group in self.groups:
            group.add_force(q, u, force)
        self.add_loads(t, u, force)
        return force

    def add_loads(self, t: float, u: np.ndarray | None, force: np.ndarray) -> None:
        """Add weight, loads, damping by mass and inertia of moved coordinates to `force` (nu,)."""
        force += self.weight
        for forcing in self.loading.forcings:
            factor = forcing.time.at(t)[0]
            if factor:
                force += factor * forcing.vector
        if u is None:
            return
        if self.loading.mass_damping:
            force -= self.loading.mass_damping * (self.full_mass_matrix @ u)
        moved = self._moved_acceleration(t)
        if moved is not None:
            force -= self.full_mass_matrix @ moved

    def _moved_acceleration(self, t: float) -> np.ndarray | None:
        """Accelerations of moved coordinates; None if no coordinate is moved."""
        out = None
        for motion in self.loading.motions:
            curvature = motion.time.at(t)[2]
            if curvature:
                out = np.zeros(self.nu) if out is None else out
                out[motion.coordinates] += curvature * motion.displacement
        return out

    def free_forces(self, q: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Forces on free coordinates. A held coordinate has the force of a spring that keeps it at its start."""
        force[self.fixed] = -self.held_stiffness * (q - self.start)[self.fixed]
        return force

    def _reactions(self, t: float, q: np.ndarray, u: np.ndarray | None) -> np.ndarray:
        """Reactions of held coordinates, (nu,); in motion with moved coordinates including inertia."""
        force = self.all_forces(t, q, u)
        if u is not None and self.loading.motions:
            return self.held_forces(force)
        return np.where(self.fixed, -force, 0.0)

    def held_forces(self, force: np.ndarray) -> np.ndarray:
        """Forces (nu,) that hold the held coordinates in motion, computed from the forces on all coordinates; they are zero
        for free coordinates.

        The mass matrix couples held and free coordinates, so the inertia of free coordinates contributes.
        """
        free = np.where(self.fixed, 0.0, force)
        return np.where(self.fixed, self.full_mass_matrix @ self._mass_factors.solve(free) - force, 0.0)

    def _drive_state(self, t: float, reactions: np.ndarray) -> DriveState:
        """Motions as drives: travel, and force along it."""
        travel, along = [], []
        for motion in self.loading.motions:
            size = float(np.linalg.norm(motion.displacement))
            travel.append(motion.time.at(t)[0] * size)
            along.append(float(reactions[motion.coordinates] @ motion.displacement) / size)
        return DriveState(np.array(travel), np.array(along))

    def _energy(self, t: float, q: np.ndarray, u: np.ndarray | None, reactions: np.ndarray) -> Energy:
        potential = self._potential(q)
        if u is None:
            return Energy(0.0, potential, 0.0, 0.0)
        momentum = self.full_mass_matrix @ u
        dissipated = self.loading.mass_damping * float(u @ momentum)
        dissipated += sum(group.energy(q, u)[1] for group in self.groups if group.rate_dependent)
        power = sum(forcing.time.at(t)[0] * float(forcing.vector @ u) for forcing in self.loading.forcings)
        power += float(reactions @ u) + sum(group.put_in(q, u) for group in self.groups)
        sliding = sum(group.slid(q, u) for group in self.groups)
        dissipated += sliding
        return Energy(0.5 * float(u @ momentum), potential, dissipated, power, sliding_power=sliding)

    def _potential(self, q: np.ndarray) -> dict[str, float]:
        """Potential energy by kind of element, with moved coordinates at their present positions, J."""
        potential: dict[str, float] = {}
        for group in self.groups:
            if group.name:
                potential[group.name] = potential.get(group.name, 0.0) + group.energy(q, None)[0]
        if self._weighs:
            potential["gravity"] = -float(self.weight @ q)
        return potential
