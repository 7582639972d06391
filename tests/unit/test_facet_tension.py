"""Tension field in flexible facets: derivatives, and energies of uniform strains."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.kernels.blocks import BlockMatrix
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.facets.facet_group import FacetGroup
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.mesh import node_pattern

ROUNDED = 1e-3

POINTS = np.array([[0.0, 0.0], [1.0, 0.1], [1.1, 0.9], [0.1, 1.0], [0.4, 0.5]])
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
ANGLES = np.array([0.3, -0.7, 0.9, 0.1, -0.4])
MATERIAL = FilmMaterial(1e3, 0.3, 1.0, 1e-2)


def group(tension: bool) -> FacetGroup:
    vectors = (9 * TRIANGLES[:, :, None] + np.array([0, 3, 6])).reshape(-1, 9)
    return FacetGroup(vectors, POINTS[TRIANGLES], ANGLES[TRIANGLES], MATERIAL, rounding=ROUNDED if tension else None)


def stretched(gradient: np.ndarray) -> np.ndarray:
    """Coordinates of a uniform deformation of the plane."""
    nodes = np.zeros((5, 3, 3))
    nodes[:, 0, :2] = POINTS @ gradient.T
    axes = np.stack([np.stack([np.cos(ANGLES), np.sin(ANGLES)], -1), np.stack([-np.sin(ANGLES), np.cos(ANGLES)], -1)], 1)
    nodes[:, 1:, :2] = axes @ gradient.T
    return nodes.ravel()


def test_uniform_strains() -> None:
    """Taut: the energy without wrinkling; wrinkled: E t e^2/2 per area, for any contraction; slack: only the remaining
    stiffness.

    Rounding adds w^2/6 to e^2/2.
    """
    area = group(True).rows.area.sum()
    for longer, shorter in ((0.02, 0.01), (0.02, -0.03), (-0.01, -0.02)):
        turn = np.array([[0.8, -0.6], [0.6, 0.8]])
        strain = turn @ np.diag([longer, shorter]) @ turn.T
        right = turn @ np.diag(np.sqrt(1.0 + 2.0 * np.array([longer, shorter]))) @ turn.T
        assert 0.5 * (right @ right - np.eye(2)) == pytest.approx(strain)
        found, plain = (group(tension).energies(stretched(right))[0] for tension in (True, False))
        wrinkled = 10.0 * (0.5 * longer**2 + ROUNDED**2 / 6.0) * area
        if shorter == 0.01:  # rounding adds to both parts
            more = ROUNDED**2 / 6.0 * (1.0 - 0.3**2 + 1.3**2) * MATERIAL.stretch * area
            assert found == pytest.approx(plain + more, rel=1e-5)
        else:
            assert found == pytest.approx(wrinkled if shorter == -0.03 else 0.0, abs=1e-5 * plain)


@pytest.mark.parametrize("seed", range(3))
def test_force_and_tangent_are_derivatives(seed: int) -> None:
    """With taut, wrinkled and slack points in one state."""
    rng = np.random.default_rng(seed)
    one = group(True)
    q = stretched(np.diag([1.01, 0.99])) + 0.02 * rng.normal(size=45)

    def force(q: np.ndarray) -> np.ndarray:
        out = np.zeros(45)
        one.add_force(q, None, out)
        return out

    ways = rng.normal(size=(5, 45))
    pattern = node_pattern(5, 9, [one], [])
    stiffness, damping, out = pattern.zeros(), pattern.zeros(), np.zeros(45)
    one.add_linearised(q, None, slots_of(one.vectors, 9, pattern.indptr, pattern.indices), out, stiffness, damping)
    matrix = BlockMatrix(pattern, stiffness)
    np.testing.assert_allclose(out, force(q), rtol=1e-12, atol=1e-12)
    for way in ways:
        gain = (sum(one.energies(q + 1e-6 * way)) - sum(one.energies(q - 1e-6 * way))) / 2e-6
        assert force(q) @ way == pytest.approx(-gain, rel=1e-6, abs=1e-8)
        change = -(force(q + 1e-7 * way) - force(q - 1e-7 * way)) / 2e-7
        np.testing.assert_allclose(matrix.times(way), change, rtol=0.0, atol=2e-6 * np.abs(change).max())
    moved = 1e-3 * ways[0]
    efforts = (one.efforts(q, 1e-6 * moved) - one.efforts(q, -1e-6 * moved)) / 2e-6
    direct = (one.efforts(q + 1e-6 * moved) - one.efforts(q - 1e-6 * moved)) / 2e-6
    np.testing.assert_allclose(efforts, direct, rtol=0.0, atol=1e-6 * np.abs(direct).max())
