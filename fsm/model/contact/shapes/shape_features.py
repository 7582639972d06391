"""Points and edges of shapes for contact: grids on plates, points and edges of obstacles."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fsm.interactions.quadrature import gauss_lobatto
from fsm.interactions.shapes.shape_distance import BOX, CYLINDER, POLYGON, RECTANGLE, SPHERE
from fsm.model.contact.shapes.shape_tables import Shape, TableBuilder, shape_edges

CIRCLE_POINTS = 8
"""Points of each circle of a cap."""


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


def is_round(kind: np.ndarray, spatial: bool) -> np.ndarray:
    """Mask of the shapes with one probe point: spheres, and in planar motion also cylinders."""
    return np.asarray((kind == SPHERE) | ((kind == CYLINDER) & (not spatial)))


def add_features(builder: TableBuilder, shape: Shape, points: int, spacing: float) -> None:
    """Add a shape with its points, and in space the edges of plates and boxes; the weights of each face, and of a cylinder's
    line, sum to one.

    Parameters
    ----------
    builder, shape : builder, and a shape of any kind
    points : as in `plate_grid`
    spacing : largest distance of points along an axis, m
    """
    number, spatial, rounding = builder.add_shape(shape), builder.spatial, shape.radius
    x, y = shape.size[:2]
    if shape.kind in (RECTANGLE, POLYGON):
        places, weights = plate_grid(shape, points, spatial)
        builder.add_points(number, places, rounding, weights)
    elif shape.kind == SPHERE or (shape.kind == CYLINDER and not spatial):
        builder.add_points(number, np.zeros((1, 3)), x + rounding, np.ones(1))
    elif shape.kind == BOX:
        places, weights = _box_points(shape, points, spatial)
        builder.add_points(number, places, rounding, weights)
    elif shape.kind == CYLINDER:
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
    if spatial and shape.kind in (RECTANGLE, POLYGON, BOX):
        builder.add_edges(number, shape_edges(shape))


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
