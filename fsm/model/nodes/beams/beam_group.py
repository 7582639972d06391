"""Group of planar beams of one kind: gathering of coordinates, and assembly of forces and matrices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.model.nodes.beams.beam_strain import at_points, strain_energy, strain_force, strain_tangent
from fsm.model.nodes.group import MassPart

_NO_MASS = 1e-12
"""Mass, relative to the largest of an element, below which a mass is round-off."""


@kernel
def gathered(vectors: np.ndarray, frames: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Coordinates of every element, (m, v, 2), each turned by the angle of its frame."""
    count, width = vectors.shape
    out = np.empty((count, width, 2))
    for e in range(count):
        for i in range(width):
            x, y = q[vectors[e, i]], q[vectors[e, i] + 1]
            cosine, sine = frames[e, i, 0], frames[e, i, 1]
            out[e, i, 0], out[e, i, 1] = cosine * x - sine * y, sine * x + cosine * y
    return out


@kernel
def scatter_forces(vectors: np.ndarray, frames: np.ndarray, element: np.ndarray, force: np.ndarray) -> None:
    """Add element forces (m, v, 2)."""
    for e in range(vectors.shape[0]):
        for i in range(vectors.shape[1]):
            x, y = element[e, i, 0], element[e, i, 1]
            cosine, sine = frames[e, i, 0], frames[e, i, 1]
            force[vectors[e, i]] += cosine * x + sine * y
            force[vectors[e, i] + 1] += cosine * y - sine * x


@kernel
def scatter_matrices(slots: np.ndarray, frames: np.ndarray, size: int, element: np.ndarray, flat: np.ndarray) -> None:
    """Add element matrices (m, 2 v, 2 v) to the flat block data."""
    for e in range(slots.shape[0]):
        for i in range(slots.shape[1]):
            c, s = frames[e, i, 0], frames[e, i, 1]
            for j in range(slots.shape[2]):
                slot, k, n = slots[e, i, j], 2 * i, 2 * j
                d, t = frames[e, j, 0], frames[e, j, 1]
                xx, xy, yx, yy = element[e, k, n], element[e, k, n + 1], element[e, k + 1, n], element[e, k + 1, n + 1]
                # R_i^T K_ij R_j, row by row
                one, two, three, four = c * xx + s * yx, c * xy + s * yy, c * yx - s * xx, c * yy - s * xy
                flat[slot] += one * d + two * t
                flat[slot + 1] += two * d - one * t
                flat[slot + size] += three * d + four * t
                flat[slot + size + 1] += four * d - three * t


class BeamArrays(NamedTuple):
    """Arrays of m beam elements for the kernels.

    Attributes
    ----------
    vectors, frames, rows, stiffness, beta : see `BeamGroup`
    z : (m, g, 2 p) array
        Derivatives of r at all points; this and the next arrays are work space.
    strain, gradient, hessian : (m, g, s), (m, g, s, 2 p), (m, g, s, 2 p, 2 p) arrays
    """

    vectors: np.ndarray
    frames: np.ndarray
    rows: np.ndarray
    stiffness: np.ndarray
    beta: np.ndarray
    z: np.ndarray
    strain: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray


@dataclass(frozen=True, eq=False)
class BeamGroup:
    """Group of m beam elements; `fsm.model.nodes.beams.beam_strain` defines the array shapes.

    Attributes
    ----------
    strains, hessians : kernels of the element
        Kernels that compute arrays of `BeamArrays` from z: strains and gradients, and hessians.
    vectors : (m, v) int array
        First coordinate of each vector of each element.
    frames : (m, v, 2) array
        Cosine and sine of the rotation of every vector before its use; vectors that share a mass have equal rotations.
    rows, stiffness, beta : arrays
    masses : (m, v, v) array
    """

    strains: Callable[..., Any]
    hessians: Callable[..., Any]
    vectors: np.ndarray
    frames: np.ndarray
    rows: np.ndarray
    stiffness: np.ndarray
    beta: np.ndarray
    masses: np.ndarray
    name: str = "bars"

    @cached_property
    def rate_dependent(self) -> bool:
        """Whether the forces depend on velocities."""
        return bool(np.any(self.beta > 0.0))

    def mass(self) -> MassPart:
        """See `ElementGroup`. Vectors i and j that are turned by R_i and R_j have the mass m_ij R_i^T R_j."""
        turned = self.frames[..., 1] != 0.0
        alike = turned[:, :, None] == turned[:, None, :]
        vectors, scalars, tensors = [self.vectors], [self.masses * alike], [np.tile(np.eye(2), (len(turned), 1, 1))]
        mixed = np.abs(self.masses * ~alike).max(axis=(1, 2)) > _NO_MASS * np.abs(self.masses).max(axis=(1, 2))
        if np.any(mixed):
            angle = self.frames[mixed][np.arange(mixed.sum()), turned[mixed].argmax(axis=1)]
            turn = np.stack([angle * [1.0, -1.0], angle[:, ::-1]], axis=1)
            later = ~turned[mixed][:, :, None] & turned[mixed][:, None, :]
            vectors += [self.vectors[mixed]] * 2
            scalars += [self.masses[mixed] * later, self.masses[mixed] * later.transpose(0, 2, 1)]
            tensors += [turn, turn.transpose(0, 2, 1)]
        return MassPart(np.concatenate(vectors), np.concatenate(scalars), np.concatenate(tensors))

    @cached_property
    def arrays(self) -> BeamArrays:
        """Arrays of the kernels."""
        (count, points, derivatives, _), strains = self.rows.shape, self.stiffness.shape[2]
        width = 2 * derivatives
        return BeamArrays(
            np.ascontiguousarray(self.vectors), np.ascontiguousarray(self.frames), np.ascontiguousarray(self.rows),
            np.ascontiguousarray(self.stiffness), np.ascontiguousarray(self.beta), np.zeros((count, points, width)),
            np.zeros((count, points, strains)), np.zeros((count, points, strains, width)),
            np.zeros((count, points, strains, width, width)),
        )  # fmt: skip

    def strained(self, q: np.ndarray) -> BeamArrays:
        """Arrays with the strains at q and their gradients."""
        own = self.arrays
        at_points(gathered(own.vectors, own.frames, q), own.rows, own.z)
        self.strains(own.z, own.strain, own.gradient)
        return own

    @cached_property
    def _zero_rates(self) -> np.ndarray:
        return np.zeros((*self.vectors.shape, 2))

    def _rates(self, u: np.ndarray | None) -> np.ndarray:
        """Rates of the coordinates of every element, (m, v, 2); zero without damping."""
        if u is None or not self.rate_dependent:
            return self._zero_rates
        return np.asarray(gathered(self.vectors, self.frames, u))

    def add_force(self, q: np.ndarray, u: np.ndarray | None, force: np.ndarray) -> None:
        """See `ElementGroup`."""
        own = self.strained(q)
        element = strain_force(own.strain, own.gradient, self._rates(u), own.rows, own.stiffness, own.beta)
        scatter_forces(own.vectors, own.frames, element, force)

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
        own = self.strained(q)
        law = self._rates(u), own.rows, own.stiffness, own.beta
        scatter_forces(own.vectors, own.frames, strain_force(own.strain, own.gradient, *law), force)
        self.hessians(own.z, own.hessian)
        of_coordinates, of_rates = strain_tangent(own.strain, own.gradient, own.hessian, *law)
        size = stiffness.shape[1]
        scatter_matrices(slots, own.frames, size, of_coordinates, stiffness.reshape(-1))
        if self.rate_dependent:
            scatter_matrices(slots, own.frames, size, of_rates, damping.reshape(-1))

    def energy(self, q: np.ndarray, u: np.ndarray | None) -> tuple[float, float]:
        """Stored energy (J) and dissipated power (W)."""
        own = self.strained(q)
        return strain_energy(own.strain, own.gradient, self._rates(u), own.rows, own.stiffness, own.beta)
