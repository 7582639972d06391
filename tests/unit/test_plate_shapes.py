"""Contact shapes of facets: convex polygons against rectangles, areas and moments of their points, outlines in pieces."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.case.models.scene import Body, Plate
from fsm.interactions.shapes.shape_distance import POLYGON, RECTANGLE, shape_boxes_spatial, shape_derivatives
from fsm.interactions.shapes.swept import points_pass
from fsm.model.contact.shapes.plate_shapes import corner_neighbours, plate_shapes
from fsm.model.contact.shapes.shape_features import add_features, plate_grid
from fsm.model.contact.shapes.shape_tables import TableBuilder

HALF = np.array([0.4, 0.25])
CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * HALF
ARROW = ((0.0, 0.0), (0.3, -0.2), (0.1, 0.0), (0.3, 0.2))
"""Quadrilateral with an inner angle above 180 degrees, area 0.02 m^2."""


def plate(outline: object = None) -> Plate:
    corners = np.array(CORNERS if outline is None else outline)
    length, width = np.ptp(corners, axis=0)
    given = None if outline is None else tuple(map(tuple, corners.tolist()))
    return Plate(length=length, width=width, thickness=0.01, outline=given)


def test_a_rectangle_as_a_polygon_is_the_same_shape() -> None:
    (flat,), (polygon,) = plate_shapes(0, plate()), plate_shapes(0, plate(CORNERS))
    assert (flat.kind, polygon.kind) == (RECTANGLE, POLYGON)
    assert polygon.face == pytest.approx(flat.face)
    rng = np.random.default_rng(3)
    found = [(np.empty(3), np.empty((3, 3))) for _ in range(2)]
    for point in rng.uniform(-0.6, 0.6, (300, 3)):
        values = [
            shape_derivatives(shape.kind, np.array(shape.size), point, *arrays)
            for shape, arrays in zip((flat, polygon), found, strict=True)
        ]
        assert values[0] == pytest.approx(values[1], abs=1e-15)
        for one, two in zip(*found, strict=True):
            np.testing.assert_allclose(one, two, atol=1e-13)
    ends = rng.uniform(-0.6, 0.6, (2, 400, 3))
    passes = []
    for shape in (flat, polygon):
        size = np.tile(shape.size, (400, 1))
        passes.append(points_pass(np.full(400, shape.kind), size, np.zeros(400), *ends))
    np.testing.assert_array_equal(*passes)
    assert 50 < passes[0].sum() < 350


def test_boxes_enclose_polygons() -> None:
    builder = TableBuilder(True)
    for shape in (*plate_shapes(0, plate()), *plate_shapes(0, plate(CORNERS))):
        add_features(builder, shape, 2, 1.0)
    pose = np.array([[0.1, 0.2, 0.3, *(np.array([0.9, 0.2, -0.3, 0.1]) / np.linalg.norm([0.9, 0.2, -0.3, 0.1]))]])
    for corner in shape_boxes_spatial(pose, builder.kit().shapes):
        np.testing.assert_allclose(corner[0], corner[1], atol=1e-15)


@pytest.mark.parametrize("points", [1, 2, 3])
def test_points_of_a_polygon_have_its_area_and_moments(points: int) -> None:
    """Against integrals over the polygon by Green's theorem, up to degree 2."""
    corners = np.array([[-0.4, -0.2], [0.3, -0.3], [0.5, 0.1], [0.1, 0.45], [-0.35, 0.3]])
    (shape,) = plate_shapes(0, plate(corners))
    places, weights = plate_grid(shape, points, True)
    x, y = corners.T
    x1, y1 = np.roll(corners, -1, axis=0).T
    cross = x * y1 - x1 * y
    area = cross.sum() / 2
    assert weights.sum() == pytest.approx(1.0)
    assert (weights * places[:, 0]).sum() == pytest.approx(((x + x1) * cross).sum() / 6 / area)
    assert (weights * places[:, 0] ** 2).sum() == pytest.approx(((x**2 + x * x1 + x1**2) * cross).sum() / 12 / area)
    product = ((x * y1 + 2 * x * y + 2 * x1 * y1 + x1 * y) * cross).sum() / 24 / area
    assert (weights * places[:, 0] * places[:, 1]).sum() == pytest.approx(product)
    assert len(np.unique(places.round(12), axis=0)) == len(places)


def test_an_outline_that_is_not_convex_has_pieces_with_edges_on_its_rim_only() -> None:
    for outline in (ARROW, ARROW[::-1]):
        pieces = plate_shapes(0, plate(outline))
        assert len(pieces) == 2
        assert sum(piece.face for piece in pieces) == pytest.approx(0.02)
        assert all(piece.face > 0.0 for piece in pieces)
        assert sum(sum(piece.rim) for piece in pieces) == 4
    hexagon = [(np.cos(angle), np.sin(angle)) for angle in np.arange(12) * np.pi / 6]
    assert sum(sum(piece.rim) for piece in plate_shapes(0, plate(hexagon))) == 12


def test_bodies_with_a_common_corner_are_found() -> None:
    def body(name: str, x: float, y: float) -> Body:
        return Body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0), position=(x, y, 0.0), plate=plate(CORNERS))

    bodies = [body("a", 0.0, 0.0), body("b", 0.8, 0.5), body("c", 0.8, 0.0), body("d", 3.0, 0.0)]
    assert corner_neighbours(bodies).tolist() == [[0, 1], [0, 2], [1, 2]]
