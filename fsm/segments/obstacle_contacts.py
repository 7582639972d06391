"""Contacts of plates with rigid obstacles: half-spaces, boxes, cylinders and spheres, fixed to the ground or to a body.

A sphere touches at one point. The sphere's centre, rounded by its radius, is a probe on the plate's rectangle. This is
exact, and the point has the whole stiffness. A cylinder in the plane is treated in the same way. All other obstacles are
probed by the points of the plate's grid. A curved or pointed obstacle can touch the plate between these points. Such an
obstacle therefore also has probes on the rectangle, and each side has half the weight:

* a box has the points of a grid over its faces, and in space its edges are also paired with the edges of the plate;
* a cylinder has points along its axis, rounded by its radius and at least that far from the caps, and points on two circles
  of each cap. These turn with the tilt; one of them is the lowest point of the rim (`fsm.interactions.circle_point`).

Faces that lie on each other share the load in proportion to their overlap (`fsm.interactions.face_overlap`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.interactions.box_pairs import ListedPairs
from fsm.interactions.quadrature import gauss_lobatto
from fsm.interactions.shape_distance import BOX, CYLINDER, HALF_SPACE, SPHERE
from fsm.segments.plate_contacts import EDGE_SHARE, Side, add_plates, plate_grid, whole_plates
from fsm.segments.shape_contacts import DEEP, ShapeContacts
from fsm.segments.shape_tables import Shape, TableBuilder, shape_edges

__all__ = ["ObstacleContacts", "add_probes", "is_round"]

CIRCLE_POINTS = 8
"""Points of each circle of a cap."""


class ObstacleContacts(ShapeContacts):
    """Contacts of plates with obstacles.

    Parameters
    ----------
    plates : as in `PlateContacts`
    obstacles : shapes of any kind except rectangles and polygons
    pairs : (m, 2) int array
        Side and obstacle. A plate has no contact with obstacles fixed to its own body.
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
            # spacing of the points of the smallest plate, so that no plate fits between the points
            spacing = 0.5 * min(plate.smallest for plate in plates)
            add_probes(builder, number, obstacle, spacing, points)
            if spatial and obstacle.kind == BOX:
                builder.add_edges(number, shape_edges(obstacle))
        alone = [np.array([len(plates) + number]) for number in range(len(obstacles))]
        listed = ListedPairs(
            [*(side.shapes for side in sides), *alone], pairs + [0, len(sides)], len(builder.shapes), numbers
        )
        self._area = np.array([plate.face for plate in plates])
        self._part = np.concatenate([np.zeros(0), *(side.parts for side in sides)])
        longest = max((plate.length for plate in plates), default=0.0)
        super().__init__(builder.kit(), listed, spatial, margin, DEEP * longest)
        if joined is not None and reference is not None:
            self.leave_out(reference, joined)

    def _factors(self, members: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        part = self._part[members[:, 0]]
        shapes = self.listed.shape[members]
        kind = self.kit.shapes.kind[shapes[:, 1]]
        # a half-space has no points; a round obstacle touches at one point, which has the whole stiffness
        round_ = is_round(kind, self.spatial)
        plate = np.where(round_, 0.0, np.where(kind == HALF_SPACE, part, 0.5 * part))
        other = np.where(round_, 1.0, 0.5 * part)
        area = self._area[shapes[:, 0]]
        share = np.column_stack([plate, plate, other, other, EDGE_SHARE * part])
        return share, np.column_stack([area / part, np.ones(len(part))]), np.column_stack([area, np.zeros(len(part))])


def is_round(kind: np.ndarray, spatial: bool) -> np.ndarray:
    """Mask of the shapes with one probe point: spheres, and in planar motion also cylinders."""
    return np.asarray((kind == SPHERE) | ((kind == CYLINDER) & (not spatial)))


def add_probes(builder: TableBuilder, number: int, obstacle: Shape, spacing: float, points: int) -> None:
    """Add the probe points of an obstacle; the weights of each face, and of a cylinder's line, sum to one.

    Parameters
    ----------
    builder, number, obstacle : builder, number of the obstacle in it, and the obstacle
    spacing : largest distance of points along an axis, m
    points : as in `plate_grid`
    """
    x, y, _ = obstacle.size
    spatial, rounding = builder.spatial, obstacle.radius
    if obstacle.kind == SPHERE or (obstacle.kind == CYLINDER and not spatial):
        builder.add_points(number, np.zeros((1, 3)), x + rounding, np.ones(1))
    elif obstacle.kind == BOX:
        places, weights = _box_points(obstacle, points, spatial)
        builder.add_points(number, places, rounding, weights)
    elif obstacle.kind == CYLINDER:
        angle = 2 * np.pi * np.arange(CIRCLE_POINTS) / CIRCLE_POINTS
        # weights 1/3 on the rim and 2/3 half-way reproduce the means of r and r^2 over the cap
        caps = [
            (np.column_stack([part * x * np.cos(angle), np.full(CIRCLE_POINTS, side * y), part * x * np.sin(angle)]), weight)
            for side in (-1, 1)
            for part, weight in ((1.0, 1 / 3), (0.5, 2 / 3))
        ]
        weights = np.repeat([weight / CIRCLE_POINTS for _, weight in caps], CIRCLE_POINTS)
        builder.add_points(number, np.concatenate([places for places, _ in caps]), rounding, weights, turns=True)
        if y >= x:
            count = int(np.clip(np.ceil(2 * (y - x) / spacing) + 1, 2, 50))
            axis = np.zeros((count, 3))
            nodes, weights = gauss_lobatto(count)
            axis[:, 1] = (y - x) * nodes
            builder.add_points(number, axis, x + rounding, weights / 2, on_axis=True)


def _box_points(box: Shape, points: int, spatial: bool) -> tuple[np.ndarray, np.ndarray]:
    """Points of all faces of a box, without duplicates, and their weights in a face."""
    size = np.array(box.size)
    found: dict[tuple[float, ...], float] = {}
    for k in range(3):
        if k == 1 and not spatial:
            continue
        i, j = [c for c in range(3) if c != k]
        if not spatial and i == 1:
            i, j = j, i
        face = Shape(0, BOX, (size[i], size[j], 0.0))
        places, weights = plate_grid(face, points, spatial)
        for side in (-1.0, 1.0):
            for place, weight in zip(places, weights, strict=True):
                at = np.zeros(3)
                at[i], at[j], at[k] = place[0], place[1], side * size[k]
                found[tuple(at.tolist())] = float(weight)
    return np.array(list(found)), np.array(list(found.values()))
