"""Square matrices made of dense square blocks, one for each pair of nodes that act on each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

__all__ = ["BlockMatrix", "BlockPattern", "Elimination"]


@dataclass(frozen=True, eq=False)
class BlockPattern:
    """Where the blocks are: block compressed sparse rows, symmetric in structure, every diagonal block there.

    Compared by identity: a solver keeps what it has worked out for a pattern as long as it meets the same object.

    Attributes
    ----------
    indptr, indices : int arrays
        Columns of each row are sorted.
    size : rows of a block: 3 in the plane, 6 in space
    """

    indptr: np.ndarray
    indices: np.ndarray
    size: int

    @property
    def order(self) -> int:
        """Block rows."""
        return len(self.indptr) - 1

    @cached_property
    def rows(self) -> np.ndarray:
        """Row of every block, (n_blocks,)."""
        return np.repeat(np.arange(self.order), np.diff(self.indptr))

    @cached_property
    def diagonal(self) -> np.ndarray:
        """Number of the diagonal block of every row, (order,)."""
        return np.flatnonzero(self.rows == self.indices)

    @cached_property
    def transposed(self) -> np.ndarray:
        """Number of the block (j, i) for every block (i, j), (n_blocks,)."""
        return np.lexsort((self.rows, self.indices))

    @cached_property
    def mirrored(self) -> np.ndarray:
        """Place of the entry (j, i) for every entry (i, j) of the block data, (n_blocks size^2,)."""
        entries = np.arange(len(self.indices) * self.size**2).reshape(-1, self.size, self.size)
        return np.ascontiguousarray(entries[self.transposed].transpose(0, 2, 1)).ravel()

    def zeros(self) -> np.ndarray:
        """Empty block data, (n_blocks, size, size)."""
        return np.zeros((len(self.indices), self.size, self.size))


@dataclass(frozen=True, eq=False)
class BlockMatrix:
    """Blocks on a pattern.

    Attributes
    ----------
    pattern : BlockPattern
    data : (n_blocks, size, size) array
    """

    pattern: BlockPattern
    data: np.ndarray

    @property
    def order(self) -> int:
        """Rows."""
        return self.pattern.order * self.pattern.size

    def times(self, vector: np.ndarray) -> np.ndarray:
        """The product A x, (order,)."""
        return np.asarray(self.bsr() @ vector)

    def symmetric(self) -> BlockMatrix:
        """The symmetric part, (A + A^T)/2."""
        data = np.take(self.data, self.pattern.mirrored).reshape(self.data.shape)
        data += self.data
        data *= 0.5
        return BlockMatrix(self.pattern, data)

    def bsr(self) -> sparse.bsr_matrix:
        """The same as SciPy's block matrix, which shares the data."""
        return sparse.bsr_matrix((self.data, self.pattern.indices, self.pattern.indptr), shape=(self.order, self.order))


@dataclass(frozen=True, eq=False)
class Elimination:
    """What an LU factorisation knows of a pattern before it has seen a number; see `fsm.kernels.block_lu.fill_in`.

    Attributes
    ----------
    order : (n,) int array
        Row that is eliminated as number i.
    indptr, indices, diagonal : int arrays
        Rows of L + U in that order, and the place of each diagonal block in them.
    place : (n_blocks,) int array
        Place of each block of the pattern in L + U.
    """

    order: np.ndarray
    indptr: np.ndarray
    indices: np.ndarray
    diagonal: np.ndarray
    place: np.ndarray
