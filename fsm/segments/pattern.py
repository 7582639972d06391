"""The block-sparse pattern of K and D: one block a pair of bodies that act on each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

__all__ = ["BlockPattern", "block_pattern"]


@dataclass(frozen=True)
class BlockPattern:
    """Block rows and sorted block columns of the free bodies.

    Attributes
    ----------
    dof : (n_bodies,) int array
        Block number of each body, -1 for held and driven bodies.
    indptr, indices : int arrays, block CSR
    size : 3 in the plane, 6 in space
    """

    dof: np.ndarray
    indptr: np.ndarray
    indices: np.ndarray
    size: int

    @property
    def index(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What the tangent kernels take."""
        return self.dof, self.indptr, self.indices

    def zeros(self) -> np.ndarray:
        """Empty block data, (n_blocks, size, size)."""
        return np.zeros((len(self.indices), self.size, self.size))

    def matrix(self, data: np.ndarray) -> sparse.bsr_matrix:
        """The sparse matrix of block data."""
        order = self.size * (len(self.indptr) - 1)
        return sparse.bsr_matrix((data, self.indices, self.indptr), shape=(order, order))


def block_pattern(dof: np.ndarray, pairs: list[np.ndarray], size: int) -> BlockPattern:
    """Pattern of all pairs of bodies (both ways) and of every free body with itself.

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
    return BlockPattern(dof, indptr, column.astype(np.int64), size)
