"""Folds: rotational springs between the sides of a crease of flexible facets, or between triangles of points.

The vectors a and b across the fold on its sides, and c along it, are sums of four nodal vectors:

* a crease of flexible facets, at a node: a and b are sums of the slopes of the facets on both sides. The two sides share
positions and have separate slopes; c is the mean of their slopes along the crease.
* triangles (i, j, k) and (l, k, j) of points: a = x_j - x_i, b = x_l - x_j, c = x_k - x_j.

The fold angle is the rotation about c from a to b, as in `fsm.model.nodes.facets.fold_angle`: zero if flat, positive for a
valley. `fsm.model.nodes.facets.fold_laws` defines the moments.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.model.nodes.arrays import FORCE_AT
from fsm.model.nodes.facets.array_folds import FOLDS, MOMENTS, commit_folds, fold_table
from fsm.model.nodes.facets.fold_kernels import FoldArrays, fold_angles
from fsm.model.nodes.facets.fold_laws import FoldLaws
from fsm.model.nodes.group import ElementGroup

BETWEEN_POINTS = np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, -1.0, 1.0, 0.0]])
"""a, b and c as sums of the points i, j, k, l of two triangles."""


@dataclass(eq=False)
class FoldGroup(ElementGroup):
    """Folds; see the module docstring.

    Attributes
    ----------
    vectors : (m, 4) int array
        First coordinates of the nodal vectors.
    weights : (m, 3, 4) array
        Factors of these vectors in a, b and c.
    laws : FoldLaws
    name : name of their energy
    """

    vectors: np.ndarray
    weights: np.ndarray
    laws: FoldLaws
    name: str = "creases"
    kernels = FOLDS
    accept = staticmethod(commit_folds)

    @cached_property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return fold_table(self.arrays)

    @cached_property
    def rate_dependent(self) -> bool:
        """See `ElementGroup`."""
        return bool(np.any(self.laws.damping))

    @cached_property
    def arrays(self) -> FoldArrays:
        """Arrays of the kernels; the laws give `near`."""
        return FoldArrays(
            np.ascontiguousarray(self.vectors), np.ascontiguousarray(self.weights), self.laws.near,
            np.array(self.laws.damping, dtype=float), self.laws.without_memory, self.laws.path,
        )  # fmt: skip

    def angles(self, q: np.ndarray) -> np.ndarray:
        """Fold angle of every fold, (m,), rad."""
        return np.asarray(fold_angles(self.arrays, q))

    def moments(self, q: np.ndarray, u: np.ndarray | None = None) -> np.ndarray:
        """Moment of every fold, (m,), N m."""
        self._alone.call(FORCE_AT, q, u, np.zeros_like(q))
        return self.table[MOMENTS].copy()

    def break_times(self) -> list[float]:
        """See `ElementGroup`."""
        return list(self.laws.time.breaks())

    @property
    def kept(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """See `ElementGroup`."""
        laws = self.laws
        angles = laws.near, np.array(laws.start, dtype=float)
        return [angles] if laws.sliders is None else [angles, (laws.sliders.memory, laws.sliders.first)]
