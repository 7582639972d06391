"""Closed forms of wrinkles, and the interpolation of their heights on a mesh."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.films.wrinkle import corner_wrinkles, lifted, strip_wrinkles
from fsm.model.nodes.system.build import MeshBuilder

FILM = FilmMaterial(3.0e9, 0.31, 1420.0, 25e-6)


def test_sheared_strip() -> None:
    found = strip_wrinkles(0.128, 25e-6, 0.31, 1e-3 / 0.128)
    assert found.half_wavelength == pytest.approx(8.311e-3, rel=1e-4)
    assert found.amplitude == pytest.approx(0.2747e-3, rel=1e-4)
    # what bending and tension E gamma/2 make cheapest along sqrt(2) H, and the width to be taken up
    stress, length = 0.5 * FILM.young * 1e-3 / 0.128, math.sqrt(2) * 0.128
    assert found.half_wavelength**4 == pytest.approx(
        math.pi**2 * FILM.bending * length**2 / (stress * FILM.thickness), rel=1e-12
    )
    excess = 0.5 * (1 - FILM.poisson) * 1e-3 / 0.128
    assert found.amplitude == pytest.approx(2 * found.half_wavelength * math.sqrt(excess) / math.pi, rel=1e-12)


def test_corner_wrinkles_end_at_their_radius_and_grow_finer_with_tension() -> None:
    side = 0.3
    low, high = corner_wrinkles(FILM, side, 10.0), corner_wrinkles(FILM, side, 20.0)
    assert low.radius == pytest.approx(side / math.sqrt(2) * math.exp(-0.31), rel=1e-12)
    assert high.half_wavelength / low.half_wavelength == pytest.approx(2**-0.25, rel=1e-12)
    assert high.amplitude / low.amplitude == pytest.approx(2**0.25, rel=1e-12)
    assert 0.0 < low.amplitude < low.half_wavelength
    along = np.linspace(0.01, 0.99, 400) * side / 2
    heights = low.height(along, along)
    distance = along * math.sqrt(2)
    assert not np.any(heights[distance > low.radius])
    assert np.abs(heights).max() == pytest.approx(low.amplitude, rel=1e-3)
    # the same at all corners
    x, y = np.array([0.03]), np.array([0.05])
    for u, v in ((side - x, y), (x, side - y), (y, x)):
        np.testing.assert_allclose(low.height(u, v), low.height(x, y), rtol=1e-12)


def test_heights_on_a_mesh_have_their_slopes() -> None:
    builder = MeshBuilder()
    lines = np.linspace(0.0, 0.3, 7)
    grid = builder.film(lines, lines, (FILM,))
    mesh = builder.build()
    wrinkles = corner_wrinkles(FILM, 0.3, 15.0)
    q = lifted(mesh.coordinates, grid.position, wrinkles.height).reshape(-1, 9)
    x, y, h = mesh.coordinates[::9], mesh.coordinates[1::9], 1e-7
    np.testing.assert_allclose(q[:, 2], wrinkles.height(x, y), atol=1e-18)
    # away from the rim, where the shape has a kink
    inside = np.abs(np.hypot(x, y) - wrinkles.radius) > 1e-3
    by_x = (wrinkles.height(x + h, y) - wrinkles.height(x - h, y)) / (2 * h)
    by_y = (wrinkles.height(x, y + h) - wrinkles.height(x, y - h)) / (2 * h)
    inner = inside & (x > 0) & (x < 0.3) & (y > 0) & (y < 0.3)
    np.testing.assert_allclose(q[inner, 5], by_x[inner], atol=1e-6)
    np.testing.assert_allclose(q[inner, 8], by_y[inner], atol=1e-6)
