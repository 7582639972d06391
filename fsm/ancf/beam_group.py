"""A batch of planar beams of one kind: gathers their coordinates, and scatters what their strains give."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fsm.ancf.beam_strain import at_points, strain_energy, strain_force, strain_tangent
from fsm.ancf.group import MassPart
from fsm.kernels.jit import kernel

__all__ = ["BeamGroup"]


@kernel
def _gathered(vectors: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Coordinates of every element, (m, v, 2)."""
    count, width = vectors.shape
    out = np.empty((count, width, 2))
    for e in range(count):
        for i in range(width):
            out[e, i, 0], out[e, i, 1] = q[vectors[e, i]], q[vectors[e, i] + 1]
    return out


@kernel
def _scatter_forces(vectors: np.ndarray, element: np.ndarray, force: np.ndarray) -> None:
    """Add element forces (m, v, 2)."""
    for e in range(vectors.shape[0]):
        for i in range(vectors.shape[1]):
            force[vectors[e, i]] += element[e, i, 0]
            force[vectors[e, i] + 1] += element[e, i, 1]


@kernel
def _scatter_matrices(slots: np.ndarray, size: int, element: np.ndarray, flat: np.ndarray) -> None:
    """Add element matrices (m, 2 v, 2 v) to the flat block data."""
    for e in range(slots.shape[0]):
        for i in range(slots.shape[1]):
            for j in range(slots.shape[2]):
                slot = slots[e, i, j]
                for a in range(2):
                    for b in range(2):
                        flat[slot + a * size + b] += element[e, 2 * i + a, 2 * j + b]


@dataclass(frozen=True, eq=False)
class BeamGroup:
    """Beams of m elements; see `fsm.ancf.beam_strain` for the shapes.

    Attributes
    ----------
    strains, hessians : kernels of the element, of `derivatives`
    vectors : (m, v) int array
        First coordinate of each vector of each element.
    rows, stiffness, beta : arrays
    masses : (m, v, v) array
    """

    strains: Callable[..., Any]
    hessians: Callable[..., Any]
    vectors: np.ndarray
    rows: np.ndarray
    stiffness: np.ndarray
    beta: np.ndarray
    masses: np.ndarray
    name: str = "bars"

    @cached_property
    def rate_dependent(self) -> bool:
        """Whether its forces depend on velocities."""
        return bool(np.any(self.beta > 0.0))

    def mass(self) -> MassPart:
        """See `ElementGroup`."""
        return MassPart(self.vectors, self.masses, np.eye(2))

    def derivatives(self, q: np.ndarray) -> np.ndarray:
        """Derivatives of r at all points, (m, g, 2 p), which strains are functions of."""
        return np.asarray(at_points(_gathered(self.vectors, q), self.rows))

    @cached_property
    def _none(self) -> np.ndarray:
        return np.zeros((*self.vectors.shape, 2))

    def _rates(self, u: np.ndarray | None) -> np.ndarray:
        """Rates of the coordinates of every element, (m, v, 2), where they matter."""
        return np.asarray(_gathered(self.vectors, u)) if self.rate_dependent and u is not None else self._none

    def add_force(self, q: np.ndarray, u: np.ndarray | None, force: np.ndarray) -> None:
        """See `ElementGroup`."""
        strain, gradient = self.strains(self.derivatives(q))
        element = strain_force(strain, gradient, self._rates(u), self.rows, self.stiffness, self.beta)
        _scatter_forces(self.vectors, element, force)

    def add_linearised(
        self,
        q: np.ndarray,
        u: np.ndarray | None,
        slots: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """See `ElementGroup`."""
        z = self.derivatives(q)
        strain, gradient = self.strains(z)
        law = self._rates(u), self.rows, self.stiffness, self.beta
        _scatter_forces(self.vectors, strain_force(strain, gradient, *law), force)
        of_coordinates, of_rates = strain_tangent(strain, gradient, self.hessians(z), *law)
        size = stiffness.shape[1]
        _scatter_matrices(slots, size, of_coordinates, stiffness.reshape(-1))
        if self.rate_dependent:
            _scatter_matrices(slots, size, of_rates, damping.reshape(-1))

    def energy(self, q: np.ndarray, u: np.ndarray | None) -> tuple[float, float]:
        """Stored energy (J) and dissipated power (W)."""
        strain, gradient = self.strains(self.derivatives(q))
        return strain_energy(strain, gradient, self._rates(u), self.rows, self.stiffness, self.beta)
