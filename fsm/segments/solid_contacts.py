"""Contacts between rigid solids: spheres with all shapes, boxes and cylinders with half-spaces.

A sphere touches at one point. The sphere's centre, rounded by its radius, is a probe on the other shape. This contact is
exact. The point has the whole stiffness. A box and a cylinder have points as probes on a half-space.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.interactions.box_pairs import ListedPairs
from fsm.interactions.shape_distance import HALF_SPACE, SPHERE
from fsm.segments.obstacle_contacts import add_probes
from fsm.segments.shape_contacts import DEEP, ShapeContacts
from fsm.segments.shape_tables import Shape, TableBuilder

__all__ = ["SolidContacts"]


class SolidContacts(ShapeContacts):
    """Contacts of pairs of solids.

    Parameters
    ----------
    solids : shapes that are not rectangles
    pairs : (m, 2) int array
        Solids; one of each pair is a sphere, or exactly one is a half-space.
    spatial, margin, points : as in `PlateContacts`
    numbers : (m,) int array
        Number of the scene's contact pair for each row; default: the row number.
    joined, reference : as in `PlateContacts`
    """

    def __init__(
        self,
        solids: Sequence[Shape],
        pairs: np.ndarray,
        spatial: bool,
        margin: float,
        points: int = 2,
        numbers: np.ndarray | None = None,
        joined: np.ndarray | None = None,
        reference: np.ndarray | None = None,
    ) -> None:
        builder = TableBuilder(spatial)
        for solid in solids:
            number = builder.add_shape(solid)
            add_probes(builder, number, solid, 0.25 * max(solid.size), points)
        ordered = np.array([_probing_first(solids, *pair) for pair in pairs], dtype=np.int64).reshape(-1, 2)
        listed = ListedPairs([np.array([k]) for k in range(len(solids))], ordered, len(solids), numbers)
        super().__init__(builder.kit(), listed, spatial, margin, 2.0 * DEEP * max(max(solid.size) for solid in solids))
        if joined is not None and reference is not None:
            self.leave_out(reference, joined)

    def _factors(self, members: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        count = len(members)
        return np.tile([1.0, 1.0, 0.0, 0.0, 0.0], (count, 1)), np.ones((count, 2)), np.zeros((count, 2))


def _probing_first(solids: Sequence[Shape], one: int, two: int) -> tuple[int, int]:
    """Order a pair: a sphere comes first, a half-space last."""
    kinds = solids[one].kind, solids[two].kind
    turned = kinds[0] == HALF_SPACE or (kinds[1] == SPHERE and kinds[0] != SPHERE)
    return (two, one) if turned else (one, two)
