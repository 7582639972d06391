"""Square matrices of dense square blocks, one block for each pair of coupled nodes.

SciPy is imported when a function needs it, because its import takes longer than many runs of small models.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy import sparse

FRONTS_FROM = 5e7
"""Number of multiplications of a symmetric factorisation above which dense fronts are faster than single blocks;
measured on a film of 20 x 20 cells (`validation/benchmarks/README.md`)."""


SMALL_BLOCKS = 0.06
"""Part of these multiplications from which fronts are faster for blocks of 3 x 3, whose products are slow."""


@dataclass(frozen=True, eq=False)
class BlockPattern:
    """Block sparsity pattern in compressed rows: structurally symmetric, with all diagonal blocks.

    Patterns are compared by identity, so that a solver can reuse its symbolic factorisation for the same object.

    Attributes
    ----------
    indptr, indices : int arrays
        Row pointers and column numbers; the columns of each row are sorted.
    size : int
        Rows of a block: 3 in the plane, 6 in space.
    """

    indptr: np.ndarray
    indices: np.ndarray
    size: int

    @property
    def order(self) -> int:
        """Number of block rows."""
        return len(self.indptr) - 1

    @cached_property
    def rows(self) -> np.ndarray:
        """Row of every block, (n_blocks,)."""
        return np.repeat(np.arange(self.order), np.diff(self.indptr))

    @cached_property
    def diagonal(self) -> np.ndarray:
        """Index of the diagonal block of every row, (order,)."""
        return np.flatnonzero(self.rows == self.indices)

    @cached_property
    def transposed(self) -> np.ndarray:
        """Index of the block (j, i) for every block (i, j), (n_blocks,)."""
        return np.lexsort((self.rows, self.indices))

    @cached_property
    def mirrored(self) -> np.ndarray:
        """Position of the entry (j, i) for every entry (i, j) of the block data, (n_blocks size^2,)."""
        entries = np.arange(len(self.indices) * self.size**2).reshape(-1, self.size, self.size)
        return np.ascontiguousarray(entries[self.transposed].transpose(0, 2, 1)).ravel()

    def zeros(self) -> np.ndarray:
        """Block data of zeros, (n_blocks, size, size)."""
        return np.zeros((len(self.indices), self.size, self.size))


@dataclass(frozen=True, eq=False)
class LowRank:
    """Matrix V^T W V of low rank, which is not stored in a pattern because its vectors have few zeros.

    Attributes
    ----------
    vectors : (k, n) array
        V.
    weights : (k, k) array
        W.
    """

    vectors: np.ndarray
    weights: np.ndarray

    def times(self, vector: np.ndarray) -> np.ndarray:
        """Product V^T W V x, (n,)."""
        return np.asarray(self.vectors.T @ (self.weights @ (self.vectors @ vector)))

    def scaled(self, factor: float) -> LowRank:
        """Matrix times a number."""
        return LowRank(self.vectors, factor * self.weights)

    def plus(self, other: LowRank | None) -> LowRank:
        """Sum of two such matrices."""
        if other is None:
            return self
        own, both = len(self.weights), len(self.weights) + len(other.weights)
        weights = np.zeros((both, both))
        weights[:own, :own], weights[own:, own:] = self.weights, other.weights
        return LowRank(np.concatenate([self.vectors, other.vectors]), weights)

    def symmetric(self) -> LowRank:
        """Symmetric part."""
        return LowRank(self.vectors, 0.5 * (self.weights + self.weights.T))


@dataclass(frozen=True, eq=False)
class BlockMatrix:
    """Square matrix as a pattern and its block data, plus a matrix of low rank if there is one.

    Attributes
    ----------
    pattern : BlockPattern
    data : (n_blocks, size, size) array
    low_rank : LowRank or None
    """

    pattern: BlockPattern
    data: np.ndarray
    low_rank: LowRank | None = None

    @property
    def order(self) -> int:
        """Number of rows."""
        return self.pattern.order * self.pattern.size

    def with_data(self, data: np.ndarray) -> BlockMatrix:
        """Matrix with other block data and the same part of low rank."""
        return BlockMatrix(self.pattern, data, self.low_rank)

    def times(self, vector: np.ndarray) -> np.ndarray:
        """Product A x, (order,)."""
        pattern = self.pattern
        parts = np.einsum("bij,bj->bi", self.data, vector.reshape(-1, pattern.size)[pattern.indices])
        product = np.add.reduceat(parts, pattern.indptr[:-1]).ravel()  # each row contains its diagonal block
        return product if self.low_rank is None else product + self.low_rank.times(vector)

    def symmetric(self) -> BlockMatrix:
        """Symmetric part, (A + A^T)/2."""
        data = np.take(self.data, self.pattern.mirrored).reshape(self.data.shape)
        data += self.data
        data *= 0.5
        return BlockMatrix(self.pattern, data, None if self.low_rank is None else self.low_rank.symmetric())

    def blocks(self) -> sparse.bsr_matrix:
        """Block matrix of SciPy that shares the data, without the part of low rank."""
        from scipy import sparse

        return sparse.bsr_matrix((self.data, self.pattern.indices, self.pattern.indptr), shape=(self.order, self.order))

    def bsr(self) -> sparse.bsr_matrix:
        """Block matrix of SciPy. The result shares the data, or is nearly full if there is a part of low rank."""
        blocks = self.blocks()
        if self.low_rank is None:
            return blocks
        from scipy import sparse

        vectors = sparse.csr_matrix(self.low_rank.vectors)
        return (blocks + vectors.T @ sparse.csr_matrix(self.low_rank.weights) @ vectors).tobsr()


@dataclass(frozen=True, eq=False)
class Elimination:
    """Symbolic LU factorisation of a pattern; see `fsm.kernels.block_lu.fill_in`.

    Attributes
    ----------
    order : (n,) int array
        Elimination order: number of the row that is eliminated as the i-th.
    indptr, indices, diagonal : int arrays
        Pattern of L + U in this order, and the position of each diagonal block.
    place : (n_blocks,) int array
        Position in L + U of each block of the matrix.
    """

    order: np.ndarray
    indptr: np.ndarray
    indices: np.ndarray
    diagonal: np.ndarray
    place: np.ndarray

    def factors(self, size: int) -> tuple[int, int, int]:
        """Shape of the factors of a matrix with blocks of this size; see `fsm.kernels.block_lu.factorise`."""
        return len(self.indices) + len(self.diagonal), size, size

    @cached_property
    def products(self) -> int:
        """Products of two blocks in the factorisation of a symmetric matrix."""
        later = self.indptr[1:] - self.diagonal - 1
        return int(np.sum(later * (later + 1) // 2))

    def large(self, size: int, part: float = 1.0) -> bool:
        """Whether the factorisation of symmetric matrices with blocks of this size takes a part of `FRONTS_FROM` or more."""
        return self.products * size**3 >= part * FRONTS_FROM

    def fronts_are_faster(self, size: int) -> bool:
        """Whether dense fronts are faster than single blocks of this size, for symmetric matrices with few zero blocks."""
        return self.large(size, SMALL_BLOCKS if size <= 3 else 1.0)
