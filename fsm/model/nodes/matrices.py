"""Constant block matrices of a mesh, and elimination of the rows and columns of held coordinates."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fsm.kernels.blocks import BlockPattern
from fsm.kernels.jit import kernel
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.group import MassPart


def mass_data(parts: Iterable[MassPart], pattern: BlockPattern, first: int = 0) -> np.ndarray:
    """Mass matrix of all coordinates as block data; `first` is the row of coordinate 0."""
    data = pattern.zeros()
    flat = data.reshape(-1)
    for part in parts:
        if not len(part.vectors):
            continue
        slots = slots_of(np.ascontiguousarray(part.vectors + first), pattern.size, pattern.indptr, pattern.indices)
        tensor = np.broadcast_to(part.tensor, (len(slots), *part.tensor.shape[-2:]))
        for a in range(tensor.shape[-2]):
            for b in range(tensor.shape[-1]):
                if np.any(tensor[:, a, b]):
                    values = part.scalar * tensor[:, a, b, None, None]
                    np.add.at(flat, slots + a * pattern.size + b, values)
    return data


@kernel
def set_held(
    fixed: np.ndarray, indptr: np.ndarray, indices: np.ndarray, diagonal: float, data: np.ndarray
) -> None:
    """Set the rows and columns of held coordinates (n_nodes, size) to zero, and their diagonal to `diagonal`."""
    size = data.shape[1]
    for i in range(indptr.shape[0] - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            for a in range(size):
                if fixed[i, a]:
                    for b in range(size):
                        data[k, a, b] = 0.0
            for b in range(size):
                if fixed[j, b]:
                    for a in range(size):
                        data[k, a, b] = 0.0
            if i == j:
                for a in range(size):
                    if fixed[i, a]:
                        data[k, a, a] = diagonal


def clear_held(fixed: np.ndarray, pattern: BlockPattern, diagonal: float, data: np.ndarray) -> None:
    """Apply `set_held` with `fixed` of shape (n,)."""
    set_held(fixed.reshape(-1, pattern.size), pattern.indptr, pattern.indices, diagonal, data)
