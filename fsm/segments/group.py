"""What a group of interactions owes the system."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from fsm.segments.pattern import BodyPattern

__all__ = ["Group", "Past"]


class Past(NamedTuple):
    """The last state of a quasi-static path: poses of all bodies, and the time since, s."""

    poses: np.ndarray
    duration: float


class Group(Protocol):
    """A batch of interactions of one kind. Poses and rates are of all bodies, (n_bodies, 3 or 7) and (n_bodies, 3 or 6).

    With a past, rates of deformation are differences from it: free of what chords and arcs differ by.
    """

    @property
    def rate_dependent(self) -> bool:
        """Whether its forces depend on velocities."""
        ...

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: Past | None = None
    ) -> None:
        """Add generalised forces to `force` (n_bodies, 3 or 6)."""
        ...

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: Past | None = None,
    ) -> None:
        """Add the forces to `force`, and -dh/dx and -dh/du to the block data."""
        ...

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """Add what the forces at rest change by in time of their own accord, N/s and N m/s."""
        ...

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None
    ) -> tuple[dict[str, float], float, float]:
        """Potential energy by what stores it (J), dissipated power (W), input power (W)."""
        ...

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """Pairs of bodies that act on each other, (m, 2), and a number that changes when they do."""
        ...
