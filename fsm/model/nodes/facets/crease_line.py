"""Creases of a film: lines along which its slope jumps, with a torsional spring.

The slopes a = r_X before the line and b = r_X behind it are separate. The tangent c = r_Y of the line is common.
`fsm.model.nodes.facets.fold_angle` defines the rotation psi from a to b. The moment is k (psi - psi_free) + tau k psi'; the
moment is positive upwards: from x towards z for a line along y. Each node has a share of k in proportion to its share of the
width.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.kernels.programs import CONSTANT, table_of
from fsm.laws.crease import CreaseLaws
from fsm.laws.crease_sliders import no_sliders
from fsm.model.nodes.facets.array_folds import FOLDS, fold_table
from fsm.model.nodes.facets.fold_kernels import FoldArrays, FoldCurves, FoldPath
from fsm.model.nodes.group import ElementGroup
from fsm.solve.interface.records import PreviousState


@dataclass(frozen=True, eq=False)
class CreaseLineGroup(ElementGroup):
    """Nodes of crease lines; see the module docstring.

    Attributes
    ----------
    vectors : (m, 3) int array
        First coordinates of a, b and c.
    stiffness : (m,) array, N m/rad
        Stiffness of each node's share of the line.
    free_turn : (m,) array, rad
        Rotation at zero moment.
    near : (m,) array, rad
        Rotations are determined within half a turn of this value.
    viscosity : s
        Kelvin-Voigt time tau.
    """

    vectors: np.ndarray
    stiffness: np.ndarray
    free_turn: np.ndarray
    near: np.ndarray
    viscosity: float = 0.0
    name: str = "creases"
    kernels = FOLDS

    @property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return fold_table(self.arrays)

    def at(self, t: float, before: PreviousState | None) -> None:
        """See `ElementGroup`; the rotations have no memory, and dampers use the rates of the coordinates."""

    @cached_property
    def arrays(self) -> FoldArrays:
        """Arrays of the kernels, as folds with the curve M(o) = o."""
        count = len(self.vectors)
        numbers, weights = np.zeros(count, dtype=np.int64), np.broadcast_to(np.eye(3), (count, 3, 3))
        unit = np.array([0, 1]), np.zeros(1), np.array([[0.0, 0.0, 1.0, 0.0]]), np.zeros(1)
        curves = CreaseLaws(np.array(self.free_turn, dtype=float), np.ones(count), np.zeros(count), numbers, *unit)
        stiffness = np.array(self.stiffness, dtype=float)
        law = FoldCurves(curves, stiffness, np.zeros(0), np.array([math.pi]))
        return FoldArrays(
            np.ascontiguousarray(self.vectors), np.ascontiguousarray(weights), np.array(self.near, dtype=float),
            self.viscosity * stiffness, law,
            FoldPath(np.zeros(0), table_of([CONSTANT]), np.zeros(0, dtype=np.int64), no_sliders()),
        )  # fmt: skip
