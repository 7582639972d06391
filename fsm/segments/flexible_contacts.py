"""Contacts of films and cables with plates and obstacles.

Points of a film or a cable, rounded by half its thickness, are probes on the other shape. Each point represents an
area. The contact stiffness refers to the smaller of both faces, as between plates. The stiffness per area therefore
does not depend on the mesh. The other shape has no probes on the film, so a corner or an edge can pass between points that
are too far apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fsm.interactions.box_pairs import ListedPairs
from fsm.interactions.shape_distance import BOX, CYLINDER, HALF_SPACE, SPHERE
from fsm.segments.plate_contacts import Side
from fsm.segments.shape_contacts import DEEP, ShapeContacts
from fsm.segments.shape_tables import Shape, TableBuilder

__all__ = ["FlexibleContacts"]


class FlexibleContacts(ShapeContacts):
    """Contacts of points of films and cables with plates and obstacles.

    Parameters
    ----------
    points : spheres at the points
    areas : (n,) array, m^2
        Area that each point represents.
    plates, obstacles : shapes
    films : sequence of Side
        Points of each film or cable; `parts` is its area over the area with the whole stiffness.
    sides : sequence of Side
        Plates of each other side.
    pairs : (m, 2) int array
        Number of the film; number of the side, or of the obstacle plus len(sides).
    margin : float, m
    numbers : (m,) int array
        Number of the scene's contact pair for each row.
    joined : (j, 2) int array
        Bodies that have no contact where they touch in the poses `reference`.
    reference : (n_bodies, 7) array
    """

    def __init__(
        self,
        points: Sequence[Shape],
        areas: np.ndarray,
        plates: Sequence[Shape],
        obstacles: Sequence[Shape],
        films: Sequence[Side],
        sides: Sequence[Side],
        pairs: np.ndarray,
        margin: float,
        numbers: np.ndarray,
        joined: np.ndarray,
        reference: np.ndarray,
    ) -> None:
        builder = TableBuilder(True)
        for point in points:
            number = builder.add_shape(point)
            builder.add_points(number, np.zeros((1, 3)), point.size[0], np.ones(1))
        for shape in (*plates, *obstacles):
            builder.add_shape(shape)
        first = len(points) + len(plates)
        members = [side.shapes for side in films] + [len(points) + side.shapes for side in sides]
        members += [np.array([first + k]) for k in range(len(obstacles))]
        listed = ListedPairs(members, pairs + [0, len(films)], len(builder.shapes), numbers)
        self._area = np.concatenate([areas, [_face(shape) for shape in (*plates, *obstacles)]])
        whole = [areas[side.shapes].sum() / side.parts for side in films]
        whole += [np.full(len(side.shapes), _face(plates[side.shapes[0]]) / side.parts[0]) for side in sides]
        whole += [np.array([_face(shape)]) for shape in obstacles]
        self._whole = np.concatenate(whole)
        sizes = [plate.length for plate in plates]
        sizes += [2.0 * max(shape.size) for shape in obstacles if shape.kind != HALF_SPACE]
        super().__init__(builder.kit(), listed, True, margin, DEEP * max(sizes, default=math.inf))
        self.leave_out(reference, joined)

    def _factors(self, members: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        count = len(members)
        area = self._area[self.listed.shape[members[:, 0]]]
        share = np.zeros((count, 5))
        share[:, 0] = area / self._whole[members].min(axis=1, initial=np.inf)
        return share, np.ones((count, 2)), np.column_stack([area, np.zeros(count)])


def _face(shape: Shape) -> float:
    """Area of the largest face of a shape, or of its section, m^2."""
    if shape.kind == HALF_SPACE:
        return math.inf
    if shape.kind == SPHERE:
        return math.pi * shape.size[0] ** 2
    if shape.kind == CYLINDER:
        return max(4.0 * shape.size[0] * shape.size[1], math.pi * shape.size[0] ** 2)
    if shape.kind == BOX:
        x, y, z = shape.size
        return 4.0 * max(x * y, y * z, x * z)
    return shape.face
