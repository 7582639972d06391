"""Protocol of a group of ANCF elements: vectors, mass, energy, force and tangents.

All coordinates are components of vectors (positions and slopes), and elements are connected vector by vector. Elements may
share a position, a slope or neither. Elements use the same index for a vector that they share, so no constraint equations
are needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from fsm.solve.interface.records import PreviousState


@dataclass(frozen=True, eq=False)
class MassPart:
    """Mass matrices of a batch: the block of the vectors i and j of element e is scalar[e, i, j] tensor[e].

    Attributes
    ----------
    vectors : (m, v) int array
        First coordinate of each vector.
    scalar : (m, v, v) array, kg (positions), kg m (position and slope), kg m^2 (slopes) for slopes in m/m
    tensor : (m, d, d) array, or (d, d) if all are equal
        The unit matrix, or n n^T for a mass that moves along a normal n only (air).
    """

    vectors: np.ndarray
    scalar: np.ndarray
    tensor: np.ndarray


class ElementGroup(Protocol):
    """Protocol of a batch of elements of one kind; q and u (n,) are all coordinates of the mesh and their rates."""

    @property
    def name(self) -> str:
        """Name of the energy of this group."""
        ...

    @property
    def vectors(self) -> np.ndarray:
        """First coordinate of each vector of each element, (m, v); -1 for none."""
        ...

    @property
    def rate_dependent(self) -> bool:
        """Whether the forces depend on velocities."""
        ...

    def mass(self) -> MassPart:
        """Constant mass matrices; without mass, an empty batch."""
        ...

    def add_force(self, q: np.ndarray, u: np.ndarray | None, force: np.ndarray) -> None:
        """Add the generalised forces -dU/dq - dR/du to `force` (n,); without u the rates are zero."""
        ...

    def add_linearised(
        self,
        q: np.ndarray,
        u: np.ndarray | None,
        slots: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """Add forces, and -dh/dq and -dh/du to block data.

        Parameters
        ----------
        slots : (m, v, v) int array
            Position, in the flat block data, of the first entry of the block of two vectors; rows are `size` apart.
        stiffness, damping : (n_blocks, size, size) arrays
        """
        ...

    def energy(self, q: np.ndarray, u: np.ndarray | None) -> tuple[float, float]:
        """Stored energy (J) and dissipated power (W)."""
        ...


@runtime_checkable
class TimedGroup(Protocol):
    """Protocol of a group whose forces depend on the time, or on the state at the other end of a step."""

    def at(self, t: float, before: PreviousState | None) -> None:
        """Set the time, and in a step of a path the state at its other end, for all later calls."""
        ...
