"""Pairs of rigid plates that may touch.

A plate is a rectangle rounded by half its thickness. Two of them touch where a point of one meets the other's rectangle or
where two edges cross, so

* each plate probes the other with the points of a Gauss-Lobatto grid over its face, corners and edges among them, and half
  the weight: faces that lie on each other share the load as their areas do, and a small plate in the middle of a large
  one is found by its own points;
* in space every edge of one is watched against every edge of the other (`fsm.interactions.edge_edge`).

The distance is that of the middle surfaces and has no sign: plates must not go deeper than both half thicknesses. When they
do, `crossed` says so.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.interactions.quadrature import gauss_lobatto
from fsm.segments.shape_contacts import ShapeContacts
from fsm.segments.shape_tables import Shape, TableBuilder, shape_edges

__all__ = ["EDGE_SHARE", "PlateContacts", "plate_grid"]

EDGE_SHARE = 0.25
"""Part of a face that a pair of edges stands for: the four edges of a face have it between them."""


def plate_grid(shape: Shape, points: int, spatial: bool) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) on a plate, m, and the parts (n,) of its face that they stand for; one line along x in the plane.

    Parameters
    ----------
    shape : rectangle
    points : int
        Intervals between the points of a line, at least 1.
    """
    nodes, weights = gauss_lobatto(points + 1)
    across, share = (nodes, weights / 2) if spatial else (np.zeros(1), np.ones(1))
    x, y = np.meshgrid(nodes * shape.size[0], across * shape.size[1], indexing="ij")
    places = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    return places, np.outer(weights / 2, share).ravel()


class PlateContacts(ShapeContacts):
    """Contacts of pairs of plates.

    Parameters
    ----------
    plates : rectangles, `fsm.segments.shape_tables.as_rectangle`
    pairs : (m, 2) int array of plates
    spatial : bool
    margin : float, m
        How near plates are before they are watched.
    points : int
        Intervals between the points of a line of a plate's grid.
    share : (m, 2) array
        Fraction of its panel that each plate of a pair is.
    numbers : (m,) int array
        Contact pair of the scene that each is; by default its own row.
    joined : (m,) bool array
        Pairs that are joined, along an edge as a rule: points and edges that lie in the other plate in the poses
        `reference` never touch it.
    reference : (n_bodies, 3 or 7) array
        Needed only where pairs are joined.
    """

    def __init__(
        self,
        plates: Sequence[Shape],
        pairs: np.ndarray,
        spatial: bool,
        margin: float,
        points: int = 2,
        share: np.ndarray | None = None,
        numbers: np.ndarray | None = None,
        joined: np.ndarray | None = None,
        reference: np.ndarray | None = None,
    ) -> None:
        pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
        numbers = np.arange(len(pairs)) if numbers is None else numbers
        parts = np.ones(pairs.shape) if share is None else share
        builder = TableBuilder(spatial)
        for plate in plates:
            builder.add_shape(plate)
        edges = {
            int(plate): builder.add_edges(plates[plate], shape_edges(plates[plate])) if spatial else []
            for plate in np.unique(pairs)
        }
        grids = {int(plate): plate_grid(plates[plate], points, spatial) for plate in np.unique(pairs)}
        for (one, two), both, number in zip(pairs.tolist(), parts.tolist(), numbers.tolist(), strict=True):
            areas = [4.0 * plates[k].size[0] * plates[k].size[1] for k in (one, two)]
            # the stiffness is that of the smaller face
            smaller = min(areas[0] / both[0], areas[1] / both[1])
            for own, other, area in ((one, two, areas[0]), (two, one, areas[1])):
                places, weights = grids[own]
                each = 0.5 * area * weights
                builder.add_points(own, places, plates[own].radius, each / smaller, each, other, number)
            builder.add_edge_pairs(edges[one], edges[two], EDGE_SHARE * min(both), number)
            builder.close_unit(one, two)
        longest = max((2 * plate.size[0] for plate in plates), default=0.0)
        super().__init__(builder.tables(), spatial, margin, 0.05 * longest)
        if joined is not None and reference is not None:
            self.leave_out(reference, np.flatnonzero(joined))
