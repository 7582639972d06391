"""A mesh of ANCF elements: coordinates by nodes, groups of elements, held coordinates, and the pattern of its matrices.

In space every node has a block of `size` coordinates: `size` // 3 vectors, first the position and then the slopes. A
node that needs fewer vectors (for example of a cable) leaves the others unused; they count as held. Elements refer to
vectors and not to nodes. A cable that ends at a film corner thus uses the position of the corner, and a separate slope.
In a plane every vector has a separate block, because bars at a hinge share a position only and have separate slopes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fsm.kernels.blocks import BlockPattern
from fsm.model.nodes.group import ElementGroup, MassPart


@dataclass(frozen=True, eq=False)
class Mesh:
    """Mesh of ANCF elements; see the module docstring.

    Attributes
    ----------
    coordinates : (n,) array
        Initial coordinates: positions in m, slopes in m/m.
    fixed : (n,) bool array
        Coordinates that are held or unused.
    groups : groups of elements
    masses : mass besides that of the elements: points, air
    quads : (n_quads, 4) int array
        First coordinates of the corner positions of drawn faces, in cyclic order.
    names : names of the nodes, for messages
    pattern : BlockPattern
        Pattern of nodes that elements join.
    dimension : 3, or 2 for a planar mesh
    plane_positions : int array
        First coordinates of the positions of a planar mesh.
    """

    coordinates: np.ndarray
    fixed: np.ndarray
    groups: tuple[ElementGroup, ...]
    masses: tuple[MassPart, ...]
    quads: np.ndarray
    names: tuple[str, ...]
    pattern: BlockPattern
    dimension: int = 3
    plane_positions: np.ndarray | None = None

    @property
    def size(self) -> int:
        """Number of coordinates of a node."""
        return self.pattern.size

    def holding(self, coordinates: np.ndarray | Iterable[int]) -> Mesh:
        """Copy of the mesh in which these coordinates are also held."""
        fixed = self.fixed.copy()
        fixed[np.asarray(list(coordinates), dtype=np.int64)] = True
        return replace(self, fixed=fixed)

    @cached_property
    def places(self) -> np.ndarray:
        """First coordinate of every position; in space also the unused positions of nodes that share another position."""
        if self.plane_positions is not None:
            return self.plane_positions
        return self.size * np.arange(self.pattern.order)

    @cached_property
    def is_position(self) -> np.ndarray:
        """Mask (n,) of the coordinates that belong to positions."""
        found = np.zeros(len(self.coordinates), dtype=bool)
        found[self.places[:, None] + np.arange(self.dimension)] = True
        return found

    def positions(self, q: np.ndarray) -> np.ndarray:
        """Positions, (n_places, dimension), m."""
        return np.asarray(q[self.places[:, None] + np.arange(self.dimension)])


def node_pattern(count: int, size: int, groups: Iterable[ElementGroup], masses: Iterable[MassPart]) -> BlockPattern:
    """Pattern of all pairs of nodes that an element or a mass joins, in both orders, and of the diagonal."""
    diagonal = np.arange(count)
    keys = [diagonal * count + diagonal]
    for vectors in [group.vectors for group in groups] + [part.vectors for part in masses]:
        nodes = vectors // size
        keys.append(np.unique(nodes[:, :, None] * count + nodes[:, None, :]))
    row, column = np.divmod(np.unique(np.concatenate(keys)), max(count, 1))
    indptr = np.searchsorted(row, np.arange(count + 1)).astype(np.int64)
    return BlockPattern(indptr, column.astype(np.int64), size)
