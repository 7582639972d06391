"""Closest points of triangles and edges: distances, gradients and second derivatives against central differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fsm.interactions.contact.shapes import ContactForces
from fsm.interactions.triangles.closest_features import (
    Faces,
    Found,
    find_edge_edges,
    find_point_faces,
    list_near_edges,
    select_faces,
)
from fsm.interactions.triangles.feature_contact import parallel_weights, tangent_features, write_features
from fsm.interactions.triangles.triangles_pass import (
    edge_passes_edge,
    may_meet,
    point_passes_triangle,
    work_space,
)
from fsm.model.bodies.group import body_pattern
from tests.tangents import differences

ONE, NODES = np.zeros(1, dtype=np.int64), np.arange(4)
TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.1, 0.2], [0.2, 0.9, -0.1]])
POINTS = {
    "inside": ([0.4, 0.3, 0.5], 2), "below": ([0.4, 0.3, -0.5], 2), "first edge": ([0.4, -0.5, 0.4], 1),
    "second edge": ([0.9, 0.8, 0.3], 1), "third edge": ([-0.4, 0.5, 0.3], 1), "first corner": ([-0.3, -0.4, 0.2], 0),
    "second corner": ([1.5, 0.0, 0.4], 0), "third corner": ([0.2, 1.6, -0.4], 0),
}  # fmt: skip
EDGES = {
    "crossing": ([[-0.5, 0.1, 0.3], [0.6, 0.2, 0.4], [0.0, -0.6, 0.0], [0.1, 0.7, 0.1]], 2),
    "end of the first": ([[0.2, 0.1, 0.3], [0.9, 0.2, 0.4], [0.0, -0.6, 0.0], [0.1, 0.7, 0.1]], 1),
    "end of the second": ([[-0.5, 0.1, 0.3], [0.6, 0.2, 0.4], [0.0, 0.4, 0.0], [0.1, 0.9, 0.1]], 1),
    "both ends": ([[0.2, 0.1, 0.3], [0.9, 0.2, 0.4], [0.0, 0.4, 0.0], [-0.1, 0.9, 0.1]], 0),
    "nearly parallel": ([[-0.5, 0.1, 0.3], [0.6, 0.1, 0.3], [-0.4, 0.05, 0.0], [0.7, 0.15, 0.0]], 2),
}  # fmt: skip


def nothing_found() -> Found:
    return Found(
        np.zeros((1, 4), dtype=np.int64), np.zeros(1, dtype=np.int64), np.zeros((1, 4)), np.zeros((1, 2, 4)),
        np.zeros((1, 3)), np.zeros(1),
    )  # fmt: skip


def measured(rates: np.ndarray, found: Found) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bodies, rates and gradients of gap and slip."""
    out = np.zeros((1, 4), dtype=np.int64), np.zeros((1, 4)), np.zeros((1, 4, 24))
    write_features(rates, NODES, found, 1, *out)
    return out


def of_point(outline: int, side: float) -> Callable[[np.ndarray], Found]:
    """Closest points of node 0 and the triangle of nodes 1 to 3; its edges may lie on the outline of a facet."""
    faces = Faces(np.array([[1, 2, 3]]), np.full((1, 3), 0.02 * outline), np.zeros((0, 2), dtype=np.int64))

    def find(places: np.ndarray) -> Found:
        triangle, part, found = ONE.copy(), ONE.copy(), nothing_found()
        select_faces(places, ONE, np.array([0, 1]), ONE, faces, triangle, part, np.zeros(1))
        chosen = ONE, triangle, part, np.array([side])
        assert find_point_faces(places, *chosen, faces, np.array([0.01]), 9.0, 9.0, ONE.copy(), np.zeros(1), found) == 1
        return found

    return find


def of_edges(places: np.ndarray) -> Found:
    found, edges, slots = nothing_found(), np.array([[0, 1], [2, 3]]), (np.array([0]), np.array([1]), np.array([0]))
    assert find_edge_edges(places, *slots, edges, np.array([0.01]), 9.0, ONE.copy(), np.zeros(1), found, 0) == 1
    return found


def cases() -> list[tuple[str, Callable[[np.ndarray], Found], np.ndarray, int]]:
    found: list[tuple[str, Callable[[np.ndarray], Found], np.ndarray, int]] = []
    for name, (place, free) in POINTS.items():
        for side in (-1.0, 1.0):
            places = np.concatenate([[place], TRIANGLE])
            found.append((f"{name}, {side:g}", of_point(1, side), places, free))
    found.append(("over the plane", of_point(0, 1.0), np.concatenate([[POINTS["first edge"][0]], TRIANGLE]), 2))
    return found + [(name, of_edges, np.array(places), free) for name, (places, free) in EDGES.items()]


CASES = pytest.mark.parametrize(("name", "find", "places", "free"), cases(), ids=[name for name, *_ in cases()])


def central(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray, step: float = 1e-5) -> np.ndarray:
    """Derivatives by all positions; the last axis is 3 node + component."""
    return differences(lambda dx: function(x + dx.reshape(x.shape)), np.full(x.size, step))


def in_order(find: Callable[[np.ndarray], Found]) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Gradient of the gap (12,) and of the slip (3, 12), by 3 node + component."""

    def gradients(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = find(places)
        bodies, _, gradient = measured(np.zeros((4, 6)), found)
        out = np.zeros((4, 4, 3))
        out[:, bodies[0]] = gradient[0].reshape(4, 4, 6)[:, :, :3]
        return out[0].ravel(), out[1:].reshape(3, 12)

    return gradients


@CASES
def test_the_gradient_is_that_of_the_distance(name: str, find: Callable[..., Found], places: np.ndarray, free: int) -> None:
    found = find(places)
    assert found.free[0] == free
    np.testing.assert_allclose(in_order(find)(places)[0], central(lambda x: find(x).distance[0], places), atol=1e-8, rtol=0)
    r = found.coefficients[0] @ places[found.nodes[0]]
    assert found.normal[0] @ r == pytest.approx(found.distance[0], abs=1e-14)
    assert abs(found.coefficients[0].sum()) < 1e-14, "a translation changes nothing"


def test_the_side_of_a_point_gives_the_sign() -> None:
    above = np.concatenate([[POINTS["inside"][0]], TRIANGLE])
    assert of_point(0, 1.0)(above).distance[0] > 0.0
    assert of_point(0, -1.0)(above).distance[0] == -of_point(0, 1.0)(above).distance[0]
    beside = np.concatenate([[POINTS["first edge"][0]], TRIANGLE])
    assert of_point(1, -1.0)(beside).distance[0] > 0.0, "round at the outline"
    assert of_point(0, -1.0)(beside).distance[0] < 0.0


@CASES
def test_the_tangent_is_that_of_the_force(name: str, find: Callable[..., Found], places: np.ndarray, free: int) -> None:
    """Normal force and friction as functions of positions and rates; the laws depend on depth, slip and normal force
    only."""
    random = np.random.default_rng(1)
    rates = np.zeros((4, 6))
    rates[:, :3] = random.normal(size=(4, 3))
    depth_rate, closing_rate, sliding = 3.0, 0.2, random.normal(size=(3, 3))

    def forces(x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, ContactForces, tuple[np.ndarray, ...]]:
        found = find(x)
        moving = np.zeros((4, 6))
        moving[:, :3] = u
        known = measured(moving, found)
        depth, closing, slip = 2.0 - found.distance, -known[1][:, 0], known[1][:, 1:]
        normal = depth_rate * depth + closing_rate * closing
        effort = slip @ sliding.T * normal[:, None]
        acting = ContactForces(
            normal,
            np.full(1, depth_rate),
            np.full(1, closing_rate),
            effort,
            sliding[None] * normal[0],
            slip @ sliding.T,
            True,
        )
        wrench = np.zeros((4, 6))
        generalised = normal[0] * known[2][0, 0] - effort[0] @ known[2][0, 1:]
        wrench[known[0][0]] = generalised.reshape(4, 6)
        return wrench[:, :3].ravel(), acting, known

    pattern = body_pattern(NODES, [np.array([[i, j] for i in range(4) for j in range(i)])], 6)
    stiffness, damping = pattern.zeros(), pattern.zeros()
    _, acting, (bodies, _, gradient) = forces(places, rates[:, :3])
    tangent_features(places, rates, bodies, gradient, find(places), acting, pattern.index, stiffness, damping)
    for block, derivative in (
        (stiffness, central(lambda x: forces(x, rates[:, :3])[0], places)),
        (damping, central(lambda u: forces(places, u)[0], rates[:, :3].copy())),
    ):
        dense = np.zeros((4, 4, 6, 6))
        for row in range(4):
            for k in range(pattern.indptr[row], pattern.indptr[row + 1]):
                dense[row, pattern.indices[k]] = block[k]
        exact = dense[:, :, :3, :3].transpose(0, 2, 1, 3).reshape(12, 12)
        np.testing.assert_allclose(exact, -derivative, atol=2e-7 * max(1.0, np.abs(derivative).max()), rtol=0)
        assert not dense[:, :, 3:].any() and not dense[:, :, :, 3:].any()


def test_weights_of_nearly_parallel_edges() -> None:
    places, least = np.array(EDGES["nearly parallel"][0]), 0.01

    def weight(x: np.ndarray) -> np.ndarray:
        return parallel_weights(x, of_edges(x), 0, 1, least)[1][0]

    rows, part, gradient, hessian = parallel_weights(places, of_edges(places), 0, 1, least)
    u, v = places[1] - places[0], places[3] - places[2]
    y = (1.0 - (u @ v) ** 2 / (u @ u) / (v @ v)) / least
    assert 0.0 < y < 1.0
    assert rows[0] == 0 and part[0] == pytest.approx(y * (2.0 - y), rel=1e-9)
    flat = [6 * k + e for k in range(4) for e in range(3)]
    np.testing.assert_allclose(gradient[0, flat], central(weight, places), rtol=1e-5, atol=1e-6)

    def slope(x: np.ndarray) -> np.ndarray:
        return parallel_weights(x, of_edges(x), 0, 1, least)[2][0, flat]

    np.testing.assert_allclose(hessian[0][np.ix_(flat, flat)], central(slope, places), rtol=1e-5, atol=1e-4)
    crossing = np.array(EDGES["crossing"][0])
    assert not len(parallel_weights(crossing, of_edges(crossing), 0, 1, least)[0])


def _point_passes_triangle(start: np.ndarray, end: np.ndarray) -> bool:
    near = may_meet(start, end, NODES, 1)
    return bool(near and point_passes_triangle(start, end, NODES, work_space()))


def _edge_passes_edge(start: np.ndarray, end: np.ndarray) -> bool:
    near = may_meet(start, end, NODES, 2)
    return bool(near and edge_passes_edge(start, end, NODES, work_space()))


@pytest.mark.parametrize(("place", "passes"), [([0.4, 0.3], True), ([0.9, 0.9], False), ([-0.1, 0.2], False)])
def test_points_that_pass_through_a_moving_triangle(place: list[float], passes: bool) -> None:
    start = np.concatenate([[[*place, 1.0]], TRIANGLE])
    end = np.concatenate([[[*place, 0.2]], TRIANGLE + [0.0, 0.0, 0.6]])
    assert _point_passes_triangle(start, end) == passes
    assert _point_passes_triangle(end, start) == passes
    assert not _point_passes_triangle(start, start + [0.0, 0.0, 5.0])


def test_a_point_that_passes_there_and_back() -> None:
    """The plane of a triangle that turns over passes the point twice; only the first time is the point inside the
    triangle."""
    start = np.array([[0.0, 0.0, 0.1], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    end = start.copy()
    end[0, 2] = -0.1
    assert _point_passes_triangle(start, end)
    end[0] = [3.0, 0.0, -0.1]
    assert not _point_passes_triangle(start, end)


@pytest.mark.parametrize(("shift", "passes"), [(0.0, True), (2.0, False)])
def test_edges_that_pass_through_each_other(shift: float, passes: bool) -> None:
    start = np.array([[-1.0, shift, 0.3], [1.0, shift, 0.4], [0.0, -1.0, 0.0], [0.1, 1.0, 0.1]])
    end = start.copy()
    end[:2, 2] -= 1.0
    assert _edge_passes_edge(start, end) == passes
    assert not _edge_passes_edge(start, start + 1.0)


def _meetings(start: np.ndarray, end: np.ndarray) -> list[np.ndarray]:
    """Places of four nodes at the times at which they are in one plane, by NumPy's roots of a cubic."""
    times = np.linspace(0.0, 1.0, 4)
    volumes = [np.linalg.det(x[1:] - x[0]) for x in (start + tau * (end - start) for tau in times)]
    roots = np.roots(np.polyfit(times, volumes, 3))
    real = roots[np.abs(roots.imag) < 1e-9].real
    return [start + tau * (end - start) for tau in real if 0.0 < tau < 1.0]


def test_no_pair_that_meets_is_excluded_before_its_cubic_is_solved() -> None:
    """Random steps of all sizes, against weights of the meeting points from linear equations."""
    random, met = np.random.default_rng(5), np.zeros(2, dtype=int)
    for _ in range(600):
        start = random.normal(size=(4, 3))
        end = start + random.choice([0.03, 0.3, 3.0]) * random.normal(size=(4, 3))
        inside = crossing = False
        for x in _meetings(start, end):
            sides = np.linalg.lstsq(np.stack([x[2] - x[1], x[3] - x[1]], axis=1), x[0] - x[1], rcond=None)[0]
            inside |= bool(sides.min() >= 0.0 and sides.sum() <= 1.0)
            ways = np.linalg.lstsq(np.stack([x[1] - x[0], x[2] - x[3]], axis=1), x[2] - x[0], rcond=None)[0]
            crossing |= bool(ways.min() >= 0.0 and ways.max() <= 1.0)
        assert _point_passes_triangle(start, end) == inside
        assert _edge_passes_edge(start, end) == crossing
        met += inside, crossing
    assert met.min() > 10


def test_near_edges_contain_all_contacts_until_nodes_have_moved() -> None:
    random, count, move, clearance = np.random.default_rng(5), 40, 0.02, 0.05
    places, edges = random.uniform(0.0, 1.0, (2 * count, 3)), np.arange(2 * count).reshape(count, 2)
    first, second = (part.astype(np.int64) for part in np.triu_indices(count, 1))
    every, near = np.arange(len(first)), np.zeros(len(first), dtype=np.int64)
    reach, clearances = 2.0 * np.sqrt(3.0) * move, np.full(len(first), clearance)
    number = list_near_edges(places, first, second, 0, edges, clearances, reach, near)
    moved = places + random.choice([-move, move], places.shape)

    def found(listed: np.ndarray) -> list[int]:
        slots, rows = np.zeros(len(first), dtype=np.int64), len(first)
        closest = Found(
            np.zeros((rows, 4), dtype=np.int64), np.zeros(rows, dtype=np.int64), np.zeros((rows, 4)), np.zeros((rows, 2, 4)),
            np.zeros((rows, 3)), np.zeros(rows),
        )  # fmt: skip
        of_edges = moved, first, second, listed, edges, clearances
        return slots[: find_edge_edges(*of_edges, 0.0, slots, np.zeros(rows), closest, 0)].tolist()

    assert found(near[:number]) == found(every)
    assert 10 < len(found(every)) < number < len(every) // 2
