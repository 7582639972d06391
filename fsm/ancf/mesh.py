"""A mesh of ANCF elements: coordinates by nodes, groups of elements, what is held, and the pattern of its matrices.

In space every node has a block of `size` coordinates, `size` // 3 vectors: position, then slopes. A node that needs fewer
vectors (a cable's) leaves the rest unused, which counts as held. Elements name the vectors they are made of, not
nodes: a cable that ends at the corner of a film has the corner's position for its own, and a slope of its own. In
a plane every vector has a block of its own: hinges, where bars share a position and nothing else, have as many slopes
as bars.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fsm.ancf.group import ElementGroup, MassPart
from fsm.blocks import BlockPattern

__all__ = ["Mesh", "node_pattern"]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh; see the module docstring.

    Attributes
    ----------
    coordinates : (n,) array
        At the start: positions in m, slopes in m/m.
    fixed : (n,) bool array
        Coordinates that are held or not used.
    groups : elements
    masses : mass besides that of the elements: points, air
    quads : (n_quads, 4) int array
        First coordinates of the positions of the corners of what a person sees, in turn.
    names : of the nodes, for messages
    pattern : BlockPattern
        Of nodes that elements join.
    dimension : 3, or 2 for what lies in a plane
    plane_positions : int array
        First coordinates of the positions, in a plane.
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
        """Coordinates of a node."""
        return self.pattern.size

    def holding(self, coordinates: np.ndarray | Iterable[int]) -> Mesh:
        """The same mesh with these coordinates held too."""
        fixed = self.fixed.copy()
        fixed[np.asarray(list(coordinates), dtype=np.int64)] = True
        return replace(self, fixed=fixed)

    @cached_property
    def places(self) -> np.ndarray:
        """First coordinate of every position; in space of those of nodes that borrow theirs too, which mean nothing."""
        if self.plane_positions is not None:
            return self.plane_positions
        return self.size * np.arange(self.pattern.order)

    @cached_property
    def is_position(self) -> np.ndarray:
        """Which coordinates are those of positions, (n,) bool array."""
        found = np.zeros(len(self.coordinates), dtype=bool)
        found[self.places[:, None] + np.arange(self.dimension)] = True
        return found

    def positions(self, q: np.ndarray) -> np.ndarray:
        """Positions, (n_places, dimension), m."""
        return np.asarray(q[self.places[:, None] + np.arange(self.dimension)])


def node_pattern(count: int, size: int, groups: Iterable[ElementGroup], masses: Iterable[MassPart]) -> BlockPattern:
    """Pattern of all nodes that an element or a mass joins, both ways, and of every node with itself."""
    diagonal = np.arange(count)
    keys = [diagonal * count + diagonal]
    for vectors in [group.vectors for group in groups] + [part.vectors for part in masses]:
        nodes = vectors // size
        keys.append(np.unique(nodes[:, :, None] * count + nodes[:, None, :]))
    row, column = np.divmod(np.unique(np.concatenate(keys)), max(count, 1))
    indptr = np.searchsorted(row, np.arange(count + 1)).astype(np.int64)
    return BlockPattern(indptr, column.astype(np.int64), size)
