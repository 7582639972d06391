"""Plates against rigid obstacles: half-spaces, boxes, cylinders and spheres, at rest or fixed to a body.

A sphere touches at one point, wherever that is: it probes the plate's rectangle by its centre, rounded by its radius, which
is exact, with the whole stiffness; so does a cylinder in the plane. All others are probed by the points of the plate's grid.
A curved or pointed obstacle can meet the plate between these, so it probes the rectangle in turn, and each has half the
weight then:

* a box by its corners, and in space its edges against those of the plate;
* a cylinder by points along its axis, rounded by its radius and no nearer to the caps than that, and in space by points
  around its rims.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.interactions.box_pairs import ListedPairs
from fsm.interactions.quadrature import gauss_lobatto
from fsm.interactions.shape_distance import BOX, CYLINDER, HALF_SPACE, SPHERE
from fsm.segments.plate_contacts import EDGE_SHARE, Side, add_plates, whole_plates
from fsm.segments.shape_contacts import ShapeContacts
from fsm.segments.shape_tables import Shape, TableBuilder, shape_edges

__all__ = ["ObstacleContacts", "is_round", "probes_of"]

RIM_POINTS = 8


class ObstacleContacts(ShapeContacts):
    """Contacts of plates with obstacles.

    Parameters
    ----------
    plates : rectangles, `fsm.segments.shape_tables.as_rectangle`
    obstacles : shapes of any other kind
    pairs : (m, 2) int array
        Side and obstacle. A plate's own body is no pair: it cannot touch what is fixed to it.
    spatial, margin, points, sides, numbers, joined, reference : as in `PlateContacts`
    """

    def __init__(
        self,
        plates: Sequence[Shape],
        obstacles: Sequence[Shape],
        pairs: np.ndarray,
        spatial: bool,
        margin: float,
        points: int = 2,
        sides: Sequence[Side] | None = None,
        numbers: np.ndarray | None = None,
        joined: np.ndarray | None = None,
        reference: np.ndarray | None = None,
    ) -> None:
        pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
        sides = whole_plates(len(plates)) if sides is None else sides
        builder = TableBuilder(spatial)
        add_plates(builder, plates, points)
        for obstacle in obstacles:
            number = builder.add_shape(obstacle)
            # as close together as the points of the smallest plate are, so that none of it fits between them
            spacing = 0.5 * min(min(plate.size[:2]) for plate in plates)
            groups = probes_of(obstacle, spacing, spatial)
            for places, radius in groups:
                builder.add_points(number, places, radius, np.full(len(places), 1.0 / (len(places) * len(groups))))
            if spatial and obstacle.kind == BOX:
                builder.add_edges(number, shape_edges(obstacle))
        alone = [np.array([len(plates) + number]) for number in range(len(obstacles))]
        listed = ListedPairs(
            [*(side.shapes for side in sides), *alone], pairs + [0, len(sides)], len(builder.shapes), numbers
        )
        self._area = np.array([4.0 * plate.size[0] * plate.size[1] for plate in plates])
        self._part = np.concatenate([np.zeros(0), *(side.parts for side in sides)])
        longest = max((2 * plate.size[0] for plate in plates), default=0.0)
        super().__init__(builder.kit(), listed, spatial, margin, 0.05 * longest)
        if joined is not None and reference is not None:
            self.leave_out(reference, joined)

    def _factors(self, members: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        part = self._part[members[:, 0]]
        shapes = self.listed.shape[members]
        kind = self.kit.shapes.kind[shapes[:, 1]]
        # a half-space has no points of its own; what is round there touches at one point, which has all of the stiffness
        round_ = is_round(kind, self.spatial)
        plate = np.where(round_, 0.0, np.where(kind == HALF_SPACE, part, 0.5 * part))
        share = np.column_stack([plate, np.where(round_, 1.0, 0.5 * part)])
        return share, np.column_stack([self._area[shapes[:, 0]], np.zeros(len(part))]), EDGE_SHARE * part


def is_round(kind: np.ndarray, spatial: bool) -> np.ndarray:
    """Which kinds of shapes are a point with a rounding; cylinders only where shapes are cut by y = 0."""
    return np.asarray((kind == SPHERE) | ((kind == CYLINDER) & (not spatial)))


def probes_of(obstacle: Shape, spacing: float, spatial: bool) -> list[tuple[np.ndarray, float]]:
    """Groups of points (n, 3) of an obstacle, so far apart at most (m), in its own axes with their rounding, m."""
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
        count = int(np.clip(np.ceil(2 * (y - x) / spacing) + 1, 2, 50))
        axis = np.zeros((count, 3))
        axis[:, 1] = (y - x) * gauss_lobatto(count)[0]
        groups.append((axis, x + rounding))
    return groups
