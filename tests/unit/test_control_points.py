"""Surfaces by their control points in inertial axes: the curve and its derivatives agree with those in body axes."""

import numpy as np
import pytest

from fsm.interactions.search.control_points import (
    ROW,
    ROW_S,
    ROW_SS,
    ROW_SY,
    ROW_Y,
    control_points_planar,
    control_points_spatial,
    curve_at,
    point_planar,
    point_spatial,
    surface_at,
    turned_planar,
    turned_spatial,
)
from fsm.interactions.surfaces.surface import blend, pieces_of
from fsm.kernels.rotation import rotate_by

LENGTHS = np.array([0.02, 0.03, 0.025])
OWNERS, STATIONS = pieces_of(np.arange(3), LENGTHS / 2)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def poses_planar(rng: np.random.Generator) -> np.ndarray:
    return np.column_stack([rng.normal(size=(3, 2)), rng.uniform(-3, 3, 3)])


def poses_spatial(rng: np.random.Generator) -> np.ndarray:
    turns = rng.normal(size=(3, 4))
    return np.column_stack([rng.normal(size=(3, 3)), turns / np.linalg.norm(turns, axis=1)[:, None]])


def turn_planar(poses: np.ndarray, body: int, x: float) -> np.ndarray:
    """A vector (x, 0) of a body: a positive angle about y turns it towards -z."""
    angle = poses[body, 2]
    return np.array([np.cos(angle) * x, -np.sin(angle) * x])


@pytest.mark.parametrize("s", [-0.2, 0.0, 0.3, 1.0, 1.1])
@pytest.mark.parametrize("piece", range(4))
def test_curve_is_that_of_the_bodies_own_axes(rng: np.random.Generator, s: float, piece: int) -> None:
    poses = poses_planar(rng)
    controls = control_points_planar(poses, turned_planar(poses), OWNERS, STATIONS)
    found, weights = np.empty((3, 2)), np.empty((3, 4))
    curve_at(s, controls, piece, found)
    blend(s, STATIONS[piece], weights)
    a, b = OWNERS[piece]
    for row, (wa, xa, wb, xb) in zip(found, weights, strict=True):
        expected = wa * poses[a, :2] + wb * poses[b, :2] + turn_planar(poses, a, xa) + turn_planar(poses, b, xb)
        np.testing.assert_allclose(row, expected, atol=2e-14)


@pytest.mark.parametrize("piece", range(4))
def test_surface_is_ruled_by_both_bodies_lines_across(rng: np.random.Generator, piece: int) -> None:
    poses, s, y = poses_spatial(rng), 0.3, 0.013
    controls = control_points_spatial(poses, turned_spatial(poses), OWNERS, STATIONS)
    found, weights = np.empty((5, 3)), np.empty((3, 4))
    surface_at(s, y, controls, piece, np.empty((3, 3)), found)
    blend(s, STATIONS[piece], weights)
    expected = np.zeros(3)
    for body, weight, x in zip(OWNERS[piece], weights[0, ::2], weights[0, 1::2], strict=True):
        local = np.array([x, weight * y, 0.0])
        expected += weight * poses[body, :3] + rotate_by(poses[body : body + 1, 3:], local[None])[0]
    np.testing.assert_allclose(found[ROW], expected, atol=2e-14)


def test_derivatives_of_a_surface(rng: np.random.Generator) -> None:
    poses, s, y, h = poses_spatial(rng), 0.37, -0.011, 1e-5
    controls = control_points_spatial(poses, turned_spatial(poses), OWNERS, STATIONS)

    def at(s: float, y: float) -> np.ndarray:
        found = np.empty((5, 3))
        surface_at(s, y, controls, 1, np.empty((3, 3)), found)
        return found

    found, by_s, by_y = at(s, y), (at(s + h, y) - at(s - h, y)) / (2 * h), (at(s, y + h) - at(s, y - h)) / (2 * h)
    np.testing.assert_allclose(found[[ROW_S, ROW_SS, ROW_SY]], by_s[[ROW, ROW_S, ROW_Y]], rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(found[[ROW_Y, ROW_SY]], by_y[[ROW, ROW_S]], rtol=1e-6, atol=1e-8)


def test_points_of_bodies(rng: np.random.Generator) -> None:
    flat, solid = poses_planar(rng), poses_spatial(rng)
    in_plane, in_space, place = np.empty(2), np.empty(3), np.array([0.012, -0.004])
    point_planar(flat, turned_planar(flat), 1, place[0], in_plane)
    point_spatial(solid, turned_spatial(solid), 2, place, in_space)
    np.testing.assert_allclose(in_plane, flat[1, :2] + turn_planar(flat, 1, place[0]), atol=1e-15)
    away = rotate_by(solid[2:, 3:], np.array([[*place, 0.0]]))[0]
    np.testing.assert_allclose(in_space, solid[2, :3] + away, atol=1e-15)
