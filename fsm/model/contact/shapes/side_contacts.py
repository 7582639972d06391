"""Contacts of sides of shapes: rigid plates, obstacles (half-spaces, boxes, cylinders, spheres), points of films and
cables.

A plate is a rectangle rounded by half its thickness; a facet with an outline consists of one or several convex polygons.
Obstacles are fixed to the ground or to a body. Two shapes touch where a point of one meets the face of the other, or
where two edges cross (`fsm.interactions.shapes.edge_edge`). Therefore

* each plate has a grid of points over its face, corners and edges included, as probes on the other shape. The points of
  a small plate in the middle of a large one detect this contact. Faces that lie on each other share the load in
  proportion to their overlap (`fsm.interactions.shapes.face_overlap`); otherwise each face has half the weight;
* a curved or pointed obstacle can touch a plate between the points of its grid, so it has probes on the plate too. A box
  has the points of a grid over its faces. A cylinder has points along its axis, rounded by its radius and at least that
  far from the caps, and points on two circles of each cap. These turn with the tilt; one of them is the lowest point of
  the rim (`fsm.interactions.shapes.circle_point`);
* a sphere touches at one point. The sphere's centre, rounded by its radius, is a probe on the other shape. This is
  exact, and the point has the whole stiffness. A cylinder in the plane is treated in the same way;
* of two solids, one is a sphere, or one is a half-space, on which a box and a cylinder have points;
* points of a film or a cable, rounded by half its thickness, are probes on the other shape. Each point represents an
  area. The contact stiffness refers to the smaller of both faces, as between plates. The stiffness per area therefore
  does not depend on the mesh. The other shape has no probes on the film, so a corner or an edge can pass between points
  that are too far apart.

The distance of plates is measured between the middle surfaces and has no sign. The depth must not exceed the sum of both
half thicknesses. `crossed` reports pairs that exceed it. Beside a common edge or corner of joined plates, faces touch at
a smaller distance (`fsm.model.contact.crease_clearance`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fsm.interactions.search.box_pairs import ListedPairs
from fsm.interactions.shapes.shape_distance import HALF_SPACE
from fsm.model.contact.shapes.plate_shapes import with_tapers
from fsm.model.contact.shapes.shape_contacts import DEEP, ShapeContacts
from fsm.model.contact.shapes.shape_features import add_features, is_round
from fsm.model.contact.shapes.shape_tables import Shape, TableBuilder

_EDGE_SHARE = 0.25
"""Fraction of a face that a pair of edges of tilted plates represents, divided among the four edges of a face."""


class Side(NamedTuple):
    """One side of a contact pair.

    Attributes
    ----------
    shapes : (k,) int array
    parts : (k,) array
        Fraction of the face with the whole stiffness that each shape represents: of its panel for a plate, of the film for a
        point; 1 for a separate plate and an obstacle.
    """

    shapes: np.ndarray
    parts: np.ndarray

    @classmethod
    def alone(cls, shape: int) -> Side:
        """Side of one shape."""
        return cls(np.array([shape]), np.ones(1))


class SideContacts(ShapeContacts):
    """Contacts of pairs of sides: of plates, of a plate and an obstacle, of two solids, or of points and another side.

    Parameters
    ----------
    shapes : plates only, plates and obstacles, obstacles only, or points followed by any of these
    pairs : (m, 2) int array
        Sides; a plate comes before an obstacle, and points come first. A shape has no contact with shapes of its own body.
    spatial : bool
    margin : float, m
        Distance below which the search includes a pair.
    points : int
        Cells of a plate's grid along each side.
    sides : sequence of Side
        Default: one side for each shape, in order.
    numbers : (m,) int array
        Number of the scene's contact pair for each row; default: the row number.
    joined : (j, 2) int array
        Joined bodies, usually joined along an edge. Points and edges that overlap the other shape in the poses `reference`
        have no contact.
    reference : (n_bodies, 3 or 7) array
        Required only for joined bodies.
    creased : (c, 2) int array
        Joined bodies whose plates touch at a smaller distance beside edges and corners that coincide in `reference`;
        default: all joined bodies.
    areas : (n_points,) array, m^2
        Areas that the first shapes, spheres at the points of films and cables, represent; default: no points.
    """

    def __init__(
        self,
        shapes: Sequence[Shape],
        pairs: np.ndarray,
        spatial: bool,
        margin: float,
        points: int = 2,
        sides: Sequence[Side] | None = None,
        numbers: np.ndarray | None = None,
        joined: np.ndarray | None = None,
        reference: np.ndarray | None = None,
        creased: np.ndarray | None = None,
        areas: np.ndarray | None = None,
    ) -> None:
        pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
        sides = [Side.alone(number) for number in range(len(shapes))] if sides is None else sides
        first = 0 if areas is None else len(areas)
        plates = [shape for shape in shapes[first:] if shape.flat]
        solids = [shape for shape in shapes[first:] if not shape.flat]
        self._of_points, self._of_plates, self._of_solids = areas is not None, not solids, not plates
        builder = TableBuilder(spatial)
        for number, shape in enumerate(shapes):
            if areas is not None and number >= first:  # these shapes have no probes
                builder.add_shape(shape)
                continue
            # spacing of the points of the smallest plate, so that no plate fits between the points
            spacing = 0.5 * min(plate.smallest for plate in plates) if plates else 0.25 * max(shape.size)
            add_features(builder, shape, points, spacing)
        bodies = np.array([shape.body for shape in shapes], dtype=np.int64)
        listed = ListedPairs([side.shapes for side in sides], pairs, len(shapes), numbers, bodies)
        faces = [shape.face for shape in shapes[first:]]
        self._area = np.concatenate([np.zeros(0) if areas is None else areas, faces])
        self._part = np.concatenate([np.zeros(0), *(side.parts for side in sides)])
        lengths = [plate.length for plate in plates]
        if self._of_points or self._of_solids:
            lengths += [solid.length for solid in solids if solid.kind != HALF_SPACE]
        kit = builder.kit()
        if joined is not None and reference is not None and self._of_plates and not self._of_points:
            kit = with_tapers(kit, plates, joined if creased is None else creased, reference)
        longest = max(lengths, default=math.inf if self._of_points else 0.0)
        super().__init__(kit, listed, spatial, margin, DEEP * longest)
        if joined is not None and reference is not None:
            self.leave_out(reference, joined)

    def _factors(self, members: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        shapes, part, count = self.listed.shape[members], self._part[members], len(members)
        area = self._area[shapes]
        of_first = np.column_stack([area[:, 0], np.zeros(count)])
        if self._of_points:
            share = np.zeros((count, 5))
            share[:, 0] = area[:, 0] / (area / part).min(axis=1, initial=np.inf)
            return share, np.ones((count, 2)), of_first
        if self._of_plates:
            whole = area / part
            half = 0.5 * area / whole.min(axis=1, keepdims=True)  # the contact stiffness belongs to the smaller face
            edges = _EDGE_SHARE * part.min(axis=1, keepdims=True)
            return np.concatenate([np.repeat(half, 2, axis=1), edges], axis=1), whole, 0.5 * area
        if self._of_solids:
            return np.tile([1.0, 1.0, 0.0, 0.0, 0.0], (count, 1)), np.ones((count, 2)), np.zeros((count, 2))
        kind, one = self.kit.shapes.kind[shapes[:, 1]], part[:, 0]
        # a half-space has no points; a round obstacle touches at one point, which has the whole stiffness
        round_ = is_round(kind, self.spatial)
        plate = np.where(round_, 0.0, np.where(kind == HALF_SPACE, one, 0.5 * one))
        other = np.where(round_, 1.0, 0.5 * one)
        share = np.column_stack([plate, plate, other, other, _EDGE_SHARE * one])
        return share, np.column_stack([area[:, 0] / one, np.ones(count)]), of_first
