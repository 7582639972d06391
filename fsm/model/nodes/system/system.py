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
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from fsm.kernels.blocks import BlockMatrix, BlockPattern
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.cable import CableGroup
from fsm.model.nodes.films.film import MembraneGroup
from fsm.model.nodes.group import ElementGroup
from fsm.model.nodes.loading import Loading
from fsm.model.nodes.matrices import clear_held, mass_data
from fsm.model.nodes.mesh import Mesh
from fsm.model.nodes.system.array_kernels import KERNELS
from fsm.model.nodes.system.arrays_of import Compiled
from fsm.solve.interface.records import DriveState, Energy, Linearised, Observation, PairState, PreviousState, Ready
from fsm.solve.interface.scales import OF_DRIVES, AtRest, Scales, scales_at_rest
from fsm.solve.interface.system import System
from fsm.solve.stepping.equilibrium import RestModel
from fsm.solve.stepping.model import ArrayModel

_NO_PAIRS = PairState(*(np.zeros(0) for _ in range(7)))


class AncfSystem(System):
    """Mesh with its loads as a `System`.

    Parameters
    ----------
    mesh : Mesh
    loading : Loading
    start, rate : (n,) arrays
        Initial coordinates (absent: those of the mesh) and their rates (absent: zero).
    """

    _compiled: Compiled | None = None
    fixed_pattern = of_vectors = True

    def __init__(
        self, mesh: Mesh, loading: Loading | None = None, start: np.ndarray | None = None, rate: np.ndarray | None =
        None
    ) -> None:
        self.mesh = mesh
        self.loading = Loading() if loading is None else loading
        self.start = mesh.coordinates.copy() if start is None else np.array(start, dtype=float)
        self.rate = np.zeros(len(self.start)) if rate is None else np.array(rate, dtype=float)
        self.nq = self.nu = len(self.start)
        self.pattern = mesh.pattern
        self.fixed = mesh.fixed.copy()
        for motion in self.loading.motions:
            self.fixed[motion.coordinates] = True
        self.rate[self.fixed] = 0.0
        self.rate_dependent = self.loading.mass_damping > 0.0 or any(group.rate_dependent for group in mesh.groups)
        self.groups: tuple[ElementGroup, ...] = tuple(mesh.groups)
        self.slots = [
            slots_of(np.ascontiguousarray(group.vectors), mesh.size, self.pattern.indptr, self.pattern.indices)
            for group in mesh.groups
        ]
        material = mass_data([group.mass() for group in mesh.groups], self.pattern)
        points = [part for part in mesh.masses if part.vectors.shape[1] == 1]
        others = [part for part in mesh.masses if part.vectors.shape[1] > 1]
        material += mass_data(points, self.pattern)
        self.weight = self._bsr(material) @ self._translation(np.array(self.loading.gravity))
        self._weighs = bool(np.any(self.weight))
        self.full_mass = material + mass_data(others, self.pattern)
        self.full_mass_matrix = self._bsr(self.full_mass).tocsr()
        self.full_mass_matrix.eliminate_zeros()  # two thirds of every block: x, y and z are not coupled
        self.held_stiffness, self.held_mass = self._oscillators()
        self._mass = self.full_mass.copy()
        clear_held(self.fixed, self.pattern, self.held_mass, self._mass)

    # protocol: configuration ----------------------------------------------------------------------------------------

    @property
    def dof(self) -> int:
        """See `System`."""
        return int(np.count_nonzero(~self.fixed))

    def initial(self) -> tuple[np.ndarray, np.ndarray]:
        """See `System`."""
        return self.start.copy(), self.rate.copy()

    def end_time(self) -> float | None:
        """See `System`: last time at which a motion is not smooth."""
        return max((max(motion.time.breaks(), default=0.0) for motion in self.loading.motions), default=None)

    def break_times(self) -> list[float]:
        """See `System`."""
        return list(self.loading.breaks)

    def peak_times(self) -> list[float]:
        """See `System`: ends and middles of the pieces of all functions of time, of loads and of rest angles."""
        times = sorted({*self.loading.breaks, *(time for group in self.mesh.groups for time in group.break_times())})
        return [*times, *(0.5 * (begin + end) for begin, end in pairwise(times))]

    def accepting(self) -> list[tuple[Any, list[np.ndarray]]]:
        """Kernels that record accepted states in compiled steps, besides those of groups, and their arrays."""
        return []

    def mass(self, q: np.ndarray) -> sparse.csr_matrix:
        """See `System`; constant."""
        return self._mass_matrix

    @cached_property
    def _mass_matrix(self) -> sparse.csr_matrix:
        matrix = self._bsr(self._mass).tocsr()
        matrix.eliminate_zeros()
        return matrix

    @cached_property
    def _mass_factors(self) -> Any:
        return splu(self._mass_matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})

    def inertia(self, q: np.ndarray, pattern: BlockPattern) -> np.ndarray:
        """See `System`."""
        return self._mass

    def mass_solve(self, force: np.ndarray) -> np.ndarray:
        """M^-1 f, (nu,)."""
        return np.asarray(self._mass_factors.solve(force))

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

    def linearise(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Linearised:
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

    def _elements(self, q: np.ndarray, u: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forces, K and D of all elements and coordinates."""
        force, stiffness, damping = np.zeros(self.nu), self.pattern.zeros(), self.pattern.zeros()
        for group, slots in zip(self.mesh.groups, self.slots, strict=True):
            group.add_linearised(q, u, slots, force, stiffness, damping)
        return force, stiffness, damping

    def _oscillators(self) -> tuple[float, float]:
        """Stiffness and mass of the oscillators of held coordinates, with the largest frequency of free coordinates."""
        stiffness = self._bsr(self._elements(self.start, None)[1]).diagonal()
        mass = self.full_mass_matrix.diagonal()
        free = ~self.fixed & (mass > 0.0)
        if not np.any(free):
            return 1.0, 1.0
        ratio = np.abs(stiffness[free]) / mass[free]
        fastest = int(np.argmax(ratio))
        heavy, stiff = float(mass[free][fastest]), float(abs(stiffness[free][fastest]))
        return (stiff, heavy) if stiff > 0.0 else (1.0, 1.0)

    def _translation(self, vector: np.ndarray) -> np.ndarray:
        """Change of the coordinates in a translation by a vector (3,), of positions that elements use."""
        out = np.zeros(self.nu)
        out[self.mesh.places[:, None] + np.arange(self.mesh.dimension)] = vector[: self.mesh.dimension]
        return out

    def _bsr(self, data: np.ndarray) -> sparse.bsr_matrix:
        return BlockMatrix(self.pattern, data).bsr()

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
