"""Creases of a film: lines along which its slope jumps, with a torsional spring.

The slopes a = r_X before the line and b = r_X behind it are separate. The tangent c = r_Y of the line is common.
`fsm.model.nodes.facets.fold_angle` defines the rotation psi from a to b. The moment is k (psi - psi_free) + tau k psi'; the
moment is positive upwards: from x towards z for a line along y. Each node has a share of k in proportion to its share of the
width.
"""

from __future__ import annotations

import numpy as np

from fsm.laws.crease import CreaseLaws
from fsm.model.nodes.facets.folds import FoldGroup, FoldLaws


def crease_line(
    vectors: np.ndarray, stiffness: np.ndarray, free_turn: np.ndarray, near: np.ndarray, viscosity: float = 0.0
) -> FoldGroup:
    """Nodes of crease lines as folds with the curve M(o) = o; see the module docstring.

    Parameters
    ----------
    vectors : (m, 3) int array
        First coordinates of a, b and c.
    stiffness : (m,) array, N m/rad
        Stiffness of each node's share of the line.
    free_turn : (m,) array, rad
        Rotation at zero moment.
    near : (m,) array, rad
        Rotations at the start, within half a turn.
    viscosity : s
        Kelvin-Voigt time tau.
    """
    count = len(vectors)
    unit = np.array([0, 1]), np.zeros(1), np.array([[0.0, 0.0, 1.0, 0.0]]), np.zeros(1)
    numbers = np.zeros(count, dtype=np.int64)
    curves = CreaseLaws(np.array(free_turn, dtype=float), np.ones(count), np.zeros(count), numbers, *unit)
    laws = FoldLaws(near, curves, stiffness, viscosity * stiffness, np.zeros(count))
    return FoldGroup(vectors, np.tile(np.eye(3), (count, 1, 1)), laws)
