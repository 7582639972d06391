"""Group of planar beams of one kind: gathering of coordinates, and assembly of forces and matrices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fsm.model.nodes.beams.array_beams import BEAMS, BeamArrays, beam_table, gathered
from fsm.model.nodes.beams.beam_strain import at_points
from fsm.model.nodes.group import ElementGroup, MassPart

_NO_MASS = 1e-12
"""Mass, relative to the largest of an element, below which a mass is round-off."""


@dataclass(frozen=True, eq=False)
class BeamGroup(ElementGroup):
    """Group of m beam elements; `fsm.model.nodes.beams.beam_strain` defines the array shapes.

    Attributes
    ----------
    strains : kernel of the element
        Kernel that computes strains and gradients of `BeamArrays` from z.
    vectors : (m, v) int array
        First coordinate of each vector of each element.
    frames : (m, v, 2) array
        Cosine and sine of the rotation of every vector before its use; vectors that share a mass have equal rotations.
    rows, stiffness, beta : arrays
    masses : (m, v, v) array
    """

    strains: Callable[..., Any]
    vectors: np.ndarray
    frames: np.ndarray
    rows: np.ndarray
    stiffness: np.ndarray
    beta: np.ndarray
    masses: np.ndarray
    name: str = "bars"
    kernels = BEAMS

    @property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return beam_table(self.arrays, self.strains)

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
