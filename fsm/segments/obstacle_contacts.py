"""Plates against rigid obstacles: half-spaces, boxes, cylinders and spheres, at rest or fixed to a body.

The points of a plate's grid probe the obstacle. A curved or pointed obstacle can meet the plate between these, so it probes
the plate's rectangle in turn, and each has half the weight then:

* a sphere by its centre, rounded by its radius: exact;
* a box by its corners, and in space its edges against those of the plate;
* a cylinder by points along its axis, rounded by its radius and no nearer to the caps than that, and in space by points
  around its rims.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.interactions.quadrature import gauss_lobatto
from fsm.interactions.shape_distance import BOX, CYLINDER, HALF_SPACE, SPHERE
from fsm.segments.plate_contacts import EDGE_SHARE, plate_grid
from fsm.segments.shape_contacts import ShapeContacts
from fsm.segments.shape_tables import Shape, TableBuilder, shape_edges

__all__ = ["ObstacleContacts"]

RIM_POINTS = 8


class ObstacleContacts(ShapeContacts):
    """Contacts of plates with obstacles.

    Parameters
    ----------
    plates : rectangles, `fsm.segments.shape_tables.as_rectangle`
    obstacles : shapes of any other kind
    pairs : (m, 2) int array
        Plate and obstacle. A plate's own body is no pair: it cannot touch what is fixed to it.
    share : (m,) array
        Fraction of its panel that each plate is.
    spatial, margin, points, numbers, joined, reference : as in `PlateContacts`
    """

    def __init__(
        self,
        plates: Sequence[Shape],
        obstacles: Sequence[Shape],
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
        parts = np.ones(len(pairs)) if share is None else share
        builder = TableBuilder(spatial)
        for shape in (*plates, *obstacles):
            builder.add_shape(shape)
        plate_edges, box_edges = {}, {}
        if spatial:
            plate_edges = {
                int(p): builder.add_edges(plates[p], shape_edges(plates[p])) for p in np.unique(pairs[:, 0])
            }
            box_edges = {
                int(o): builder.add_edges(obstacles[o], shape_edges(obstacles[o]))
                for o in np.unique(pairs[:, 1])
                if obstacles[o].kind == BOX
            }
        for (own, other), number, part in zip(pairs.tolist(), numbers.tolist(), parts.tolist(), strict=True):
            plate, obstacle, against = plates[own], obstacles[other], len(plates) + other
            half = 1.0 if obstacle.kind == HALF_SPACE else 0.5
            places, weights = plate_grid(plate, points, spatial)
            area = 4.0 * plate.size[0] * plate.size[1] * weights
            builder.add_points(own, places, plate.radius, half * part * weights, area, against, number)
            groups = _probes_of(obstacle, plate, spatial)
            for back, radius in groups:
                each = np.full(len(back), 0.5 * part / (len(back) * len(groups)))
                builder.add_points(against, back, radius, each, np.zeros(len(back)), own, number)
            builder.add_edge_pairs(plate_edges.get(own, []), box_edges.get(other, []), EDGE_SHARE * part, number)
            builder.close_unit(own, against)
        longest = max((2 * plate.size[0] for plate in plates), default=0.0)
        super().__init__(builder.tables(), spatial, margin, 0.05 * longest)
        if joined is not None and reference is not None:
            self.leave_out(reference, np.flatnonzero(joined))


def _probes_of(obstacle: Shape, plate: Shape, spatial: bool) -> list[tuple[np.ndarray, float]]:
    """Groups of points (n, 3) of an obstacle in its own axes with their rounding, m."""
    x, y, z = obstacle.size
    rounding = obstacle.radius
    if obstacle.kind == SPHERE:
        return [(np.zeros((1, 3)), x + rounding)]
    if obstacle.kind == BOX:
        across = (-y, y) if spatial else (0.0,)
        return [(np.array([(i * x, j, k * z) for i in (-1, 1) for j in across for k in (-1, 1)]), rounding)]
    if obstacle.kind != CYLINDER:
        return []
    if not spatial:
        return [(np.zeros((1, 3)), x + rounding)]
    angle = 2 * np.pi * np.arange(RIM_POINTS) / RIM_POINTS
    rim = np.column_stack([x * np.cos(angle), np.zeros(RIM_POINTS), x * np.sin(angle)])
    groups = [(np.concatenate([rim + [0.0, side * y, 0.0] for side in (-1, 1)]), rounding)]
    if y >= x:
        # as close together as the plate's own points are, so that none of it fits between them
        spacing = 0.5 * min(plate.size[0], plate.size[1])
        count = int(np.clip(np.ceil(2 * (y - x) / spacing) + 1, 2, 50))
        axis = np.zeros((count, 3))
        axis[:, 1] = (y - x) * gauss_lobatto(count)[0]
        groups.append((axis, x + rounding))
    return groups
