"""Mesh with its loads as a mechanical system: coordinates, masses, and times at which its loads change."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from fsm.kernels.blocks import BlockMatrix, BlockPattern
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.group import ElementGroup, clear_held, mass_data
from fsm.model.nodes.loading import Loading
from fsm.model.nodes.mesh import Mesh
from fsm.solve.interface.system import System


class MovingMesh(System):
    """Coordinates and masses of a mesh; see `AncfSystem` for the parameters."""

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
