"""Distances of points from shapes against a search over the surface, and their derivatives against differences."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import minimize

from fsm.interactions.shapes.shape_distance import (
    BOX,
    CYLINDER,
    HALF_SPACE,
    POLYGON,
    RECTANGLE,
    SPHERE,
    shape_derivatives,
    shape_distance,
)
from tests.tangents import differences

SIZES = {
    HALF_SPACE: np.zeros(3),
    BOX: np.array([0.3, 0.5, 0.2]),
    CYLINDER: np.array([0.3, 0.4, 0.3]),
    SPHERE: np.array([0.35, 0.35, 0.35]),
    RECTANGLE: np.array([0.4, 0.25, 0.0]),
    POLYGON: np.array([5, -0.4, -0.2, 0.3, -0.3, 0.5, 0.1, 0.1, 0.45, -0.35, 0.3]),
}
KINDS = pytest.mark.parametrize("kind", list(SIZES), ids=["half-space", "box", "cylinder", "sphere", "rectangle", "polygon"])


def nearest_of_solid(kind: int, point: np.ndarray) -> float:
    """Distance from the nearest point of a solid shape, found by a bounded search in the coordinates of the shape."""
    if kind == POLYGON:
        # nearest point of the triangles between the first corner and the sides
        corners = np.column_stack([SIZES[kind][1:].reshape(-1, 2), np.zeros(5)])
        found = []
        for one, two in pairwise(corners[1:] - corners[0]):
            place = lambda v, one=one, two=two: corners[0] + v[0] * ((1 - v[1]) * one + v[1] * two)  # noqa: E731
            bounds = [(0.0, 1.0), (0.0, 1.0)]
            square = lambda v, place=place: np.sum((place(v) - point) ** 2)  # noqa: E731
            starts = [0.5, 0.5], [1.0, 0.1], [1.0, 0.9]
            found += [minimize(square, start, bounds=bounds, tol=1e-16).fun for start in starts]
        return float(np.sqrt(min(found)))
    a, b, c = SIZES[kind]
    if kind in (BOX, RECTANGLE):
        bounds, place = [(-a, a), (-b, b), (-c, c)], lambda v: v
        starts = [np.clip(point, [-a, -b, -c], [a, b, c])]
    else:
        bounds = [(0.0, a), (-np.pi, np.pi), (-b, b) if kind == CYLINDER else (-np.pi / 2, np.pi / 2)]
        angle = np.arctan2(point[2], point[0])
        if kind == CYLINDER:
            place = lambda v: np.array([v[0] * np.cos(v[1]), v[2], v[0] * np.sin(v[1])])  # noqa: E731
        else:
            place = lambda v: v[0] * np.array(  # noqa: E731
                [np.cos(v[2]) * np.cos(v[1]), np.sin(v[2]), np.cos(v[2]) * np.sin(v[1])]
            )
        starts = [np.array([a, angle, 0.1]), np.array([a / 2, angle + 0.2, -0.1])]
    found = [minimize(lambda v: np.sum((place(v) - point) ** 2), s, bounds=bounds, tol=1e-16).fun for s in starts]
    return float(np.sqrt(min(found)))


@KINDS
def test_outside_it_is_the_distance_from_the_nearest_point(kind: int) -> None:
    rng = np.random.default_rng(kind)
    checked = 0
    for point in rng.uniform(-1, 1, (60, 3)):
        value = shape_distance(kind, SIZES[kind], point)
        if kind == HALF_SPACE:
            assert value == point[2]
        elif value > 0.0:
            assert value == pytest.approx(nearest_of_solid(kind, point), abs=1e-7)
        checked += value > 0.0
    assert checked > 10


def test_inside_it_is_minus_the_distance_to_the_nearest_face() -> None:
    rng = np.random.default_rng(5)
    for point in rng.uniform(-1, 1, (50, 3)):
        box = point * SIZES[BOX]
        faces = [abs(s - sign * v) for v, s in zip(box, SIZES[BOX], strict=True) for sign in (-1, 1)]
        assert shape_distance(BOX, SIZES[BOX], box) == pytest.approx(-min(faces))
        radius, half = SIZES[CYLINDER][:2]
        turned = np.array([0.7 * point[0] * radius, point[1] * half, 0.7 * point[2] * radius])
        side = radius - np.hypot(turned[0], turned[2])
        assert shape_distance(CYLINDER, SIZES[CYLINDER], turned) == pytest.approx(-min(side, half - abs(turned[1])))
        ball = 0.3 * point
        assert shape_distance(SPHERE, SIZES[SPHERE], ball) == pytest.approx(np.linalg.norm(ball) - 0.35)


@KINDS
def test_derivatives_are_those_of_the_distance(kind: int) -> None:
    """At random points, no nearer to a change of feature than the step is long."""
    rng, size = np.random.default_rng(10 + kind), SIZES[kind]
    gradient, hessian, steps = np.empty(3), np.empty((3, 3)), np.full(3, 1e-5)
    bent = 0

    def gradient_at(point: np.ndarray) -> np.ndarray:
        found = np.empty(3)
        shape_derivatives(kind, size, point, found, np.empty((3, 3)))
        return found

    for point in rng.uniform(-1, 1, (200, 3)):
        value = shape_derivatives(kind, size, point, gradient, hessian)
        assert value == shape_distance(kind, size, point)
        rows = differences(lambda x, at=point: shape_distance(kind, size, at + x), steps)
        slopes = differences(lambda x, at=point: gradient_at(at + x), steps)
        np.testing.assert_allclose(gradient, rows, atol=1e-7)
        assert np.linalg.norm(gradient) == pytest.approx(1.0, abs=1e-14)
        np.testing.assert_allclose(hessian, slopes, atol=1e-6 * max(1.0, np.abs(hessian).max() ** 2))
        bent += bool(np.any(hessian))
    assert (bent > 50) == (kind != HALF_SPACE)


@pytest.mark.parametrize(
    ("kind", "start", "end"),
    [
        (BOX, (0.1, 0.2, 0.21), (0.9, 0.9, 0.25)),
        (CYLINDER, (0.05, 0.41, 0.1), (0.9, 0.45, 0.2)),
        (CYLINDER, (0.31, 0.0, 0.1), (0.35, 0.9, 0.1)),
        (RECTANGLE, (0.1, 0.1, 0.01), (0.9, 0.6, 0.02)),
    ],
    ids=["box", "over the cap", "along the side", "rectangle"],
)
def test_gradient_is_continuous_over_edges_and_corners(kind: int, start: tuple[float, ...], end: tuple[float, ...]) -> None:
    """The gradient turns, by no more than the Hessian of a point so near an edge allows."""
    gradient, last, hessian = np.empty(3), np.full(3, np.nan), np.empty((3, 3))
    path = np.linspace(start, end, 20001)
    nearest = min(shape_distance(kind, SIZES[kind], point) for point in path)
    assert nearest > 0.0
    step, turned = float(np.linalg.norm(path[1] - path[0])), 0.0
    for point in path:
        shape_derivatives(kind, SIZES[kind], point, gradient, hessian)
        if not np.isnan(last[0]):
            change = float(np.linalg.norm(gradient - last))
            assert change <= 1.001 * step / nearest
            turned += change
        last = gradient.copy()
    assert turned > 0.5


def test_shapes_without_an_end() -> None:
    """A half size may be infinite; the shape is then the same wherever it is cut."""
    gradient, hessian = np.empty(3), np.empty((3, 3))
    for kind in (BOX, CYLINDER, RECTANGLE):
        long = SIZES[kind].copy()
        long[1] = np.inf
        for point in np.random.default_rng(3).uniform(-0.6, 0.6, (40, 3)):
            cut = point * [1.0, 0.0, 1.0]
            assert shape_derivatives(kind, long, point, gradient, hessian) == shape_distance(kind, long, cut)
            assert gradient[1] == 0.0
            assert not hessian[1].any()
            if shape_distance(kind, SIZES[kind], cut) > 0.0:
                assert shape_distance(kind, long, cut) == shape_distance(kind, SIZES[kind], cut)
    assert shape_derivatives(SPHERE, SIZES[SPHERE], np.zeros(3), gradient, hessian) == -0.35
    assert np.isfinite(gradient).all()
    assert np.isfinite(hessian).all()
