"""Base class of a group of interactions.

Block-sparse pattern of K and D of bodies: one block for each pair of coupled bodies.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fsm.kernels.blocks import BlockPattern, LowRank
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot


@dataclass(frozen=True, eq=False)
class BodyPattern(BlockPattern):
    """Block rows of the free bodies.

    Attributes
    ----------
    dof : (n_bodies,) int array
        Block number of each body, -1 for held and driven bodies.
    """

    dof: np.ndarray

    @property
    def index(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Arguments of the tangent kernels: dof, indptr, indices."""
        return self.dof, self.indptr, self.indices

    def holds(self, pairs: np.ndarray) -> bool:
        """Whether the pattern has a block for each of these pairs (m, 2) of bodies."""
        return bool(_holds(self.dof, self.indptr, self.indices, pairs))


@kernel
def _holds(dof: np.ndarray, indptr: np.ndarray, indices: np.ndarray, pairs: np.ndarray) -> bool:
    for k in range(pairs.shape[0]):
        row, column = dof[pairs[k, 0]], dof[pairs[k, 1]]
        if row < 0 or column < 0:
            continue
        if find_slot(indptr, indices, row, column) < 0:
            return False
    return True


def body_pattern(dof: np.ndarray, pairs: list[np.ndarray], size: int) -> BodyPattern:
    """Pattern of all pairs of bodies (in both orders) and of the diagonal blocks.

    Parameters
    ----------
    dof : (n_bodies,) int array
    pairs : list of (m, 2) int arrays of bodies
    size : block size
    """
    count = int(dof.max(initial=-1)) + 1
    diagonal = np.arange(count)
    rows, columns = [diagonal], [diagonal]
    for pair in pairs:
        first, second = dof[pair[:, 0]], dof[pair[:, 1]]
        both = (first >= 0) & (second >= 0)
        rows += [first[both], second[both]]
        columns += [second[both], first[both]]
    keys = np.unique(np.concatenate(rows) * count + np.concatenate(columns))
    row, column = np.divmod(keys, max(count, 1))
    indptr = np.searchsorted(row, np.arange(count + 1)).astype(np.int64)
    return BodyPattern(indptr, column.astype(np.int64), size, dof)


class PreviousPoses(NamedTuple):
    """Last state of a quasi-static path: poses of all bodies, and the elapsed time, s."""

    poses: np.ndarray
    duration: float


class BodyState(NamedTuple):
    """State of all bodies at a time (s): poses (n_bodies, 3 or 7) and rates (n_bodies, 3 or 6).

    With a past state, rates of deformation are differences from that state, without an error from finite rotations.
    """

    t: float
    poses: np.ndarray
    rates: np.ndarray
    past: PreviousPoses | None = None


class BlockSums(NamedTuple):
    """Sums to which groups add: generalised forces (n_bodies, 3 or 6), and -dh/dx and -dh/du as block data of a pattern."""

    pattern: BodyPattern
    force: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray

    @classmethod
    def zero(cls, pattern: BodyPattern, at: BodyState) -> BlockSums:
        """Empty sums for a state."""
        return cls(pattern, np.zeros(at.rates.shape), pattern.zeros(), pattern.zeros())


class GroupSteps(NamedTuple):
    """Names of the steps in which a group acts, and whether its force is zero at the beginning of the first of these
    steps.
    """

    names: tuple[str, ...]
    latch: bool


class Group(ABC):
    """Batch of interactions of one kind."""

    @property
    def rate_dependent(self) -> bool:
        """Whether the forces depend on velocities."""
        return False

    @abstractmethod
    def add_force(self, at: BodyState, force: np.ndarray) -> None:
        """Add generalised forces to `force` (n_bodies, 3 or 6)."""

    @abstractmethod
    def add_linearised(self, at: BodyState, sums: BlockSums) -> None:
        """Add the forces and their derivatives."""

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """Add the explicit time derivative of the forces at rest, N/s and N m/s; by default none."""
        return

    @abstractmethod
    def energy(self, at: BodyState) -> tuple[dict[str, float], float, float]:
        """Potential energy by category (J), dissipated power (W), input power (W)."""

    @property
    def low_rank(self) -> LowRank | None:
        """Part of -dh/dx at the last tangent that joins all bodies, with vectors (k, n_bodies, 3 or 6), flat; by default
        none.
        """
        return None

    def load_displacements(self, start: BodyState, end: BodyState) -> dict[str, tuple[float, float]]:
        """Loads of the group, see `SegmentSystem.load_displacements`; by default none."""
        return {}

    def break_times(self) -> set[float]:
        """Times at which a function of time of the group is not smooth, s; by default none."""
        return set()

    def peak_times(self) -> set[float]:
        """Times among which the forces of the group at rest are largest, s."""
        return self.break_times()

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """Pairs (m, 2) of coupled bodies, and a version number that changes with them; by default no pairs."""
        return np.zeros((0, 2), dtype=np.int64), 0
