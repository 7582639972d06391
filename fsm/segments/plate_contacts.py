"""Contacts of pairs of rigid plates.

A plate is a rectangle rounded by half its thickness; a facet with an outline consists of one or several convex polygons. Two
plates touch where a point of one meets the face of the other, or where two edges cross. Therefore

* each plate has a grid of points over its face, corners and edges included, as probes on the other plate. The points of a
  small plate in the middle of a large one detect this contact. Rectangles that lie on each other share the load in
  proportion to their overlap (`fsm.interactions.face_overlap`); otherwise each face has half the weight;
* in space every edge of one plate is paired with every edge of the other (`fsm.interactions.edge_edge`).

The distance is measured between the middle surfaces and has no sign. The depth must not exceed the sum of both half
thicknesses. `crossed` reports pairs that exceed it. Beside a common edge or corner of joined plates, faces touch at a
smaller distance (`fsm.segments.crease_clearance`).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fsm.interactions.box_pairs import ListedPairs
from fsm.interactions.shape_distance import POLYGON
from fsm.kernels.rotation import rotation_matrix
from fsm.segments.crease_clearance import common_lines, edge_tapers, tapers_of
from fsm.segments.plate_shapes import same_places
from fsm.segments.shape_contacts import DEEP, ShapeContacts
from fsm.segments.shape_tables import Kit, Shape, TableBuilder, shape_edges

__all__ = ["EDGE_SHARE", "PlateContacts", "Side", "add_plates", "plate_grid", "whole_plates"]

EDGE_SHARE = 0.25
"""Fraction of a face that a pair of edges of tilted plates represents, divided among the four edges of a face."""


def plate_grid(shape: Shape, points: int, spatial: bool) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a plate, m, and the fraction (n,) of the face that each represents; in the plane, the points are on
    one line along x.

    Parameters
    ----------
    shape : rectangle or polygon
    points : int
        Cells along each side, at least 1.
    """
    if shape.kind == POLYGON:
        return _polygon_grid(shape.corners, points)
    steps, corner, middle = np.linspace(-1.0, 1.0, points + 1), np.ones(points + 1), np.ones(points)
    corner[1:-1] = 2.0
    between = 0.5 * (steps[1:] + steps[:-1])
    if spatial:
        # corners (1/12 each) and centre (2/3) of every cell; exact for polynomials of degree 3
        corners, middles = np.outer(corner, corner).ravel() / 12.0, np.outer(middle, middle).ravel() / 1.5
        x, y = (np.concatenate(both) for both in zip(_grid(steps), _grid(between), strict=True))
        weights = np.concatenate([corners, middles]) / points**2
    else:
        # the same rule in the plane: Simpson's rule
        x, weights = np.concatenate([steps, between]), np.concatenate([corner / 6.0, middle / 1.5]) / points
        y = np.zeros(len(x))
    return np.column_stack([x * shape.size[0], y * shape.size[1], np.zeros(len(x))]), weights


def _polygon_grid(corners: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of a convex polygon: corners (1/12 each) and centre (3/4) of every triangular cell.

    The rule is exact for polynomials of degree 2. Cells divide the triangles between the first corner and the other sides.
    """
    places: dict[tuple[float, float], float] = {}
    origin, whole = corners[0], 0.0
    cells = [
        cell
        for i in range(points)
        for j in range(points - i)
        for cell in (((i, j), (i + 1, j), (i, j + 1)), ((i + 1, j), (i + 1, j + 1), (i, j + 1)))
        if cell[1][0] + cell[1][1] <= points
    ]
    for one, two in pairwise(corners[1:]):
        sides = np.stack([one - origin, two - origin])
        area = 0.5 * float(np.linalg.det(sides)) / points**2
        whole += area * points**2
        for cell in cells:
            of_cell = np.array(cell) @ sides / points
            for at, weight in (*((corner, 1 / 12) for corner in of_cell), (of_cell.mean(axis=0), 3 / 4)):
                key = (float(f"{at[0]:.9e}"), float(f"{at[1]:.9e}"))
                places[key] = places.get(key, 0.0) + weight * area
    parts = origin + np.array(list(places))
    return np.column_stack([parts, np.zeros(len(parts))]), np.array(list(places.values())) / whole


def _grid(steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(steps, steps, indexing="ij")
    return x.ravel(), y.ravel()


class Side(NamedTuple):
    """One side of a contact pair.

    Attributes
    ----------
    shapes : (k,) int array
    parts : (k,) array
        Fraction of its panel that each plate represents; 1 for a separate plate.
    """

    shapes: np.ndarray
    parts: np.ndarray


def whole_plates(count: int) -> list[Side]:
    """Create a separate side for each plate."""
    return [Side(np.array([number]), np.ones(1)) for number in range(count)]


def add_plates(builder: TableBuilder, plates: Sequence[Shape], points: int) -> None:
    """Add plates with the points of their grids, and in space their edges."""
    for plate in plates:
        number = builder.add_shape(plate)
        places, weights = plate_grid(plate, points, builder.spatial)
        builder.add_points(number, places, plate.radius, weights)
        if builder.spatial:
            builder.add_edges(number, shape_edges(plate))


class PlateContacts(ShapeContacts):
    """Contacts of pairs of plates.

    Parameters
    ----------
    plates : rectangles and polygons, `as_rectangle` and `as_polygon` of `fsm.segments.shape_tables`
    pairs : (m, 2) int array of sides
    spatial : bool
    margin : float, m
        Distance below which the search includes a pair.
    points : int
        Cells of a plate's grid along each side.
    sides : sequence of Side
        Default: one side for each plate, in order.
    numbers : (m,) int array
        Number of the scene's contact pair for each row; default: the row number.
    joined : (j, 2) int array
        Joined bodies, usually joined along an edge. Points and edges that overlap the other plate in the poses `reference`
        have no contact.
    reference : (n_bodies, 3 or 7) array
        Required only for joined bodies.
    creased : (c, 2) int array
        Joined bodies whose faces touch at a smaller distance beside edges and corners that coincide in `reference`; default:
        all joined bodies.
    """

    def __init__(
        self,
        plates: Sequence[Shape],
        pairs: np.ndarray,
        spatial: bool,
        margin: float,
        points: int = 2,
        sides: Sequence[Side] | None = None,
        numbers: np.ndarray | None = None,
        joined: np.ndarray | None = None,
        reference: np.ndarray | None = None,
        creased: np.ndarray | None = None,
    ) -> None:
        pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
        sides = whole_plates(len(plates)) if sides is None else sides
        builder = TableBuilder(spatial)
        add_plates(builder, plates, points)
        areas = np.array([plate.face for plate in plates])
        bodies = np.array([plate.body for plate in plates], dtype=np.int64)
        listed = ListedPairs([side.shapes for side in sides], pairs, len(plates), numbers, bodies)
        self._area = areas[listed.shape]
        self._part = np.concatenate([np.zeros(0), *(side.parts for side in sides)])
        longest = max((plate.length for plate in plates), default=0.0)
        kit = builder.kit()
        if joined is not None and reference is not None:
            kit = _with_tapers(kit, plates, joined if creased is None else creased, reference)
        super().__init__(kit, listed, spatial, margin, DEEP * longest)
        if joined is not None and reference is not None:
            self.leave_out(reference, joined)

    def _factors(self, members: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        area, part = self._area[members], self._part[members]
        whole = area / part
        points = 0.5 * area / whole.min(axis=1, keepdims=True)  # the contact stiffness belongs to the smaller face
        edges = EDGE_SHARE * part.min(axis=1, keepdims=True)
        return np.concatenate([np.repeat(points, 2, axis=1), edges], axis=1), whole, 0.5 * area


def _with_tapers(kit: Kit, plates: Sequence[Shape], creased: np.ndarray, reference: np.ndarray) -> Kit:
    """Tables with clearances beside the edges and corners that two bodies (c, 2) have in common in the poses `reference`."""
    body, count, spatial = kit.shapes.body, len(reference), reference.shape[1] == 7
    used = [(plate.body, plate.in_body(shape_edges(plate))) for plate in plates if np.any(creased == plate.body)]
    if not used:
        return kit
    of_side = np.repeat([number for number, _ in used], [len(ends) for _, ends in used])
    ends = np.concatenate([ends for _, ends in used])
    poses = reference
    if not spatial:
        half, zero = 0.5 * reference[:, 2], np.zeros(count)
        poses = np.stack([reference[:, 0], zero, reference[:, 1], np.cos(half), zero, np.sin(half), zero], axis=1)
    axes = np.array([rotation_matrix(quaternion) for quaternion in poses[:, 3:]])
    world = poses[of_side, None, :3] + np.einsum("nij,nkj->nki", axes[of_side], ends)
    node = same_places(world.reshape(-1, 3), float(np.median([plate.length for plate in plates]))).reshape(-1, 2)
    local = (ends if spatial else ends[:, :, [0, 2]]).reshape(2 * len(ends), -1)
    on, first = np.unique(node.ravel() * count + np.repeat(of_side, 2), return_index=True)
    allowed = np.concatenate([creased @ [count, 1], creased @ [1, count]])
    lines = common_lines(*np.divmod(on, count), local[first], node, of_side, count, allowed)
    edges, arm = kit.edges, kit.edges.half[:, None] * kit.edges.direction
    tips = np.stack([edges.middle - arm, edges.middle + arm], axis=1)
    of_point = np.repeat(body, np.diff(kit.point_start))
    return kit._replace(
        tapers=tapers_of(lines, np.arange(len(of_point)), of_point, kit.place, count),
        edge_tapers=edge_tapers(lines, tips, edges.body, count),
    )
