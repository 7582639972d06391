"""Block-sparse pattern of K and D of bodies: one block for each pair of coupled bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.kernels.blocks import BlockPattern
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
