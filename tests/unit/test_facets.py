"""ANCF-DKT triangles: forces and tangents against differences, rigid motions, patch tests."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.kernels.blocks import BlockMatrix
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.facets.facet_group import FacetGroup
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.mesh import node_pattern

POINTS = np.array([[0.0, 0.0], [1.0, 0.1], [1.1, 0.9], [0.1, 1.0], [0.4, 0.5]])
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
ANGLES = np.array([0.3, -0.7, 0.9, 0.1, -0.4])
VECTORS = (9 * TRIANGLES[:, :, None] + np.array([0, 3, 6])).reshape(-1, 9)
SIZE = 9 * len(POINTS)


def group(rest: np.ndarray | None = None, thickness: float = 0.1) -> FacetGroup:
    material = FilmMaterial(1e3, 0.3, 2.0, thickness)
    return FacetGroup(VECTORS, POINTS[TRIANGLES], ANGLES[TRIANGLES], material, rest)


def placed(matrix: np.ndarray, second: np.ndarray | None = None) -> np.ndarray:
    """Coordinates of r = matrix x + second x x/2, with (3, 2) and (3, 2, 2) arrays."""
    second = np.zeros((3, 2, 2)) if second is None else second
    nodes = []
    for x, angle in zip(POINTS, ANGLES, strict=True):
        slopes = matrix + second @ x
        along, across = [np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]
        nodes.append([matrix @ x + 0.5 * second @ x @ x, slopes @ along, slopes @ across])
    return np.array(nodes).ravel()


def rotation(seed: int) -> np.ndarray:
    matrix, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


def force(facets: FacetGroup, q: np.ndarray) -> np.ndarray:
    out = np.zeros(len(q))
    facets.add_force(q, None, out)
    return out


def stiffness(facets: FacetGroup, q: np.ndarray, efforts: np.ndarray | None = None) -> np.ndarray:
    pattern = node_pattern(len(POINTS), 9, [facets], [])
    data, damping = pattern.zeros(), pattern.zeros()
    slots = slots_of(np.ascontiguousarray(VECTORS), 9, pattern.indptr, pattern.indices)
    facets.give_efforts(efforts)
    facets.add_linearised(q, None, slots, np.zeros(len(q)), data, damping)
    facets.give_efforts(None)
    assert not damping.any()
    return BlockMatrix(pattern, data).bsr().toarray()


FLAT = placed(np.eye(3)[:, :2])
CURVED = FLAT + 0.1 * np.random.default_rng(7).normal(size=SIZE)


@pytest.mark.parametrize("rest", [None, CURVED], ids=["flat", "curved"])
def test_force_and_tangent_are_derivatives(rest: np.ndarray | None) -> None:
    facets, q = group(rest), FLAT + 0.1 * np.random.default_rng(1).normal(size=SIZE)
    steps = 1e-6 * np.eye(SIZE)
    numeric = np.array([-(sum(facets.energies(q + d)) - sum(facets.energies(q - d))) / 2e-6 for d in steps])
    found = force(facets, q)
    np.testing.assert_allclose(found, numeric, rtol=0.0, atol=1e-8 * np.abs(found).max())
    matrix = stiffness(facets, q)
    columns = np.array([-(force(facets, q + d) - force(facets, q - d)) / 2e-6 for d in steps]).T
    np.testing.assert_allclose(matrix, columns, rtol=0.0, atol=1e-8 * np.abs(matrix).max())
    np.testing.assert_array_equal(matrix, matrix.T)  # exactly, since unsymmetric matrices are factorised by a slower method


@pytest.mark.parametrize("rest", [None, CURVED], ids=["flat", "curved"])
def test_round_off_does_not_depend_on_the_place(rest: np.ndarray | None) -> None:
    """Energies and forces far from the origin are those at the origin, exactly. Their round-off would stop small steps."""
    facets, far = group(rest), np.zeros((len(POINTS), 3, 3))
    far[:, 0] = 1024.0, -2048.0, 512.0
    # multiples of 2^-30, whose sums with these places are exact
    q = np.round((FLAT + 0.1 * np.random.default_rng(4).normal(size=SIZE)) * 2.0**30) / 2.0**30
    assert facets.energies(q + far.ravel()) == facets.energies(q)
    np.testing.assert_array_equal(force(facets, q + far.ravel()), force(facets, q))
    np.testing.assert_array_equal(facets.efforts(q + far.ravel()), facets.efforts(q))
    np.testing.assert_array_equal(facets.curvatures(q + far.ravel()), facets.curvatures(q))


def test_efforts_of_the_mixed_newton_method() -> None:
    """Efforts after an increment are exact to first order; with the efforts of the state, the stiffness is the tangent."""
    facets, q = group(), FLAT + 0.1 * np.random.default_rng(1).normal(size=SIZE)
    dx = np.random.default_rng(2).normal(size=SIZE)
    near, far = (np.abs(facets.efforts(q, s * dx) - facets.efforts(q + s * dx)).max() for s in (1e-4, 1e-3))
    assert far > 50.0 * near > 0.0
    np.testing.assert_allclose(stiffness(facets, q, facets.efforts(q)), stiffness(facets, q), rtol=0.0, atol=1e-10)
    assert np.abs(stiffness(facets, q, 0.0 * facets.efforts(q)) - stiffness(facets, q)).max() > 1.0


@pytest.mark.parametrize("curved", [False, True])
def test_rigid_motions_do_nothing(curved: bool) -> None:
    turn, shift = rotation(3), np.tile([0.3, -2.0, 1.0, 0, 0, 0, 0, 0, 0], len(POINTS))
    rest = CURVED if curved else None
    moved = (CURVED if curved else FLAT).reshape(-1, 3) @ turn.T
    q = moved.ravel() + shift
    facets = group(rest)
    assert abs(sum(facets.energies(q))) < 1e-12
    assert np.abs(force(facets, q)).max() < 1e-10
    if not curved:
        assert np.sum(np.linalg.eigvalsh(stiffness(facets, q)) < 1e-9) == 6


def test_patch_of_uniform_strain() -> None:
    """A uniform large strain, turned in space, has the exact energy and no force at the node inside."""
    stretch = np.array([[1.1, 0.2], [0.05, 0.9], [0.0, 0.0]])
    facets = group(thickness=0.01)
    q = placed(rotation(5) @ stretch)
    strain = 0.5 * (stretch.T @ stretch - np.eye(2))
    density = strain[0, 0] ** 2 + strain[1, 1] ** 2 + 0.6 * strain[0, 0] * strain[1, 1] + 1.4 * strain[0, 1] ** 2
    area = facets.rows.area.sum()
    assert facets.energies(q)[0] == pytest.approx(0.5 * facets.material.stretch * density * area, rel=1e-12)
    assert np.abs(force(facets, q)[-9:]).max() < 1e-12 * np.abs(force(facets, q)).max()


def test_patch_of_uniform_curvature() -> None:
    """A quadratic deflection has its curvatures at all points, the exact energy, and no force at the node inside."""
    second = np.zeros((3, 2, 2))
    second[2] = 1e-6 * np.array([[2.0, 0.5], [0.5, -1.0]])
    facets = group()
    q = placed(np.eye(3)[:, :2], second)
    exact = np.array([second[2, 0, 0], second[2, 1, 1], second[2, 0, 1]])
    np.testing.assert_allclose(facets.curvatures(q), np.broadcast_to(exact, (4, 3, 3)), rtol=1e-6)
    density = exact[0] ** 2 + exact[1] ** 2 + 0.6 * exact[0] * exact[1] + 1.4 * exact[2] ** 2
    area = facets.rows.area.sum()
    # a hundred times the curvature, so that round-off of the places of nodes is small
    energy = facets.energies(placed(np.eye(3)[:, :2], 100.0 * second))[1]
    assert energy == pytest.approx(1e4 * 0.5 * facets.material.bending * density * area, rel=1e-6, abs=0.0)
    found = force(facets, q)[2::3]  # the other components are stretches of second order
    assert np.abs(found[-3:]).max() < 1e-6 * np.abs(found).max()


def test_linear_strain_is_exact() -> None:
    """A quadratic displacement in the plane has the exact energy of its linear strain, to first order."""
    size = 1e-6
    second = np.zeros((3, 2, 2))
    second[0], second[1] = size * np.array([[1.0, 0.4], [0.4, -0.6]]), size * np.array([[0.2, -0.8], [-0.8, 0.5]])
    facets = group()
    energy = 0.0
    middles = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]])
    for triangle, area in zip(POINTS[TRIANGLES], facets.rows.area, strict=True):
        for x in middles @ triangle:  # exact for a quadratic density
            gradient = second[:2] @ x
            e = 0.5 * (gradient + gradient.T)
            density = e[0, 0] ** 2 + e[1, 1] ** 2 + 0.6 * e[0, 0] * e[1, 1] + 1.4 * e[0, 1] ** 2
            energy += area / 3.0 * 0.5 * facets.material.stretch * density
    assert facets.energies(placed(np.eye(3)[:, :2], second))[0] == pytest.approx(energy, rel=1e-4, abs=0.0)


def test_mass() -> None:
    """The mass of translations is exact, and so is the moment of inertia of a linear velocity field."""
    facets = group()
    part = facets.mass()
    total = facets.rows.area.sum() * facets.material.areal_density
    positions = np.zeros(9)
    positions[::3] = 1.0
    assert np.einsum("i,mij,j->", positions, part.scalar, positions) == pytest.approx(total, rel=1e-12)
    along = placed(np.eye(3)[:, :2]).reshape(-1, 3)[:, 0][VECTORS // 3]
    corners = POINTS[TRIANGLES][:, :, 0]
    exact = sum(a * (c**2).sum() + a * c.sum() ** 2 for a, c in zip(facets.rows.area, corners, strict=True)) / 12.0
    found = np.einsum("mi,mij,mj->", along, part.scalar, along)
    assert found == pytest.approx(facets.material.areal_density * exact, rel=1e-12)


@pytest.mark.parametrize("rest", [None, CURVED], ids=["flat", "curved"])
def test_damping(rest: np.ndarray | None) -> None:
    """Tangents are the derivatives of the damping forces, whose power is dissipated; rigid motions dissipate nothing."""
    random = np.random.default_rng(11)
    material = FilmMaterial(1e3, 0.3, 2.0, 0.1)
    damped = FacetGroup(VECTORS, POINTS[TRIANGLES], ANGLES[TRIANGLES], material, rest, viscosity=0.3)
    plain = group(rest)
    q, u = FLAT + 0.1 * random.normal(size=SIZE), random.normal(size=SIZE)

    def force_at(q: np.ndarray, u: np.ndarray) -> np.ndarray:
        out = np.zeros(SIZE)
        damped.add_force(q, u, out)
        return out

    loss = (force(plain, q) - force_at(q, u)) @ u
    assert loss == pytest.approx(damped.energy(q, u)[1], rel=1e-12) and loss > 0.0
    pattern = node_pattern(len(POINTS), 9, [damped], [])
    slots = slots_of(np.ascontiguousarray(VECTORS), 9, pattern.indptr, pattern.indices)
    found, data = np.zeros(SIZE), (pattern.zeros(), pattern.zeros())
    damped.add_linearised(q, u, slots, found, *data)
    np.testing.assert_allclose(found, force_at(q, u), atol=1e-12 * np.abs(found).max())
    by_place, by_rate = (BlockMatrix(pattern, part).bsr().toarray() for part in data)
    steps = 1e-6 * np.eye(SIZE)
    for matrix, differences in (
        (by_place, [force_at(q - d, u) - force_at(q + d, u) for d in steps]),
        (by_rate, [force_at(q, u - d) - force_at(q, u + d) for d in steps]),
    ):
        np.testing.assert_allclose(matrix, np.array(differences).T / 2e-6, atol=1e-8 * np.abs(matrix).max())
    # in a step of a path, rates are differences
    damped.at(0.1, (0.0, q - 0.01 * u))
    data = pattern.zeros(), pattern.zeros()
    damped.add_linearised(q, u, slots, found, *data)
    matrix = sum(factor * BlockMatrix(pattern, part).bsr().toarray() for factor, part in zip((1.0, 10.0), data, strict=True))
    differences = [force_at(q - d, u) - force_at(q + d, u) for d in steps]
    np.testing.assert_allclose(matrix, np.array(differences).T / 2e-6, atol=1e-8 * np.abs(matrix).max())
    turned = (q.reshape(-1, 3) @ rotation(9).T).ravel()
    damped.at(0.1, (0.0, q))
    assert damped.energy(turned, (turned - q) / 0.1)[1] < 1e-15 * loss
    damped.at(0.1, None)
    spin = np.array([[0.0, -0.7, 0.2], [0.7, 0.0, -1.1], [-0.2, 1.1, 0.0]])
    rigid = (q.reshape(-1, 3) @ spin.T).ravel() + np.tile([0.3, -2.0, 1.0, 0, 0, 0, 0, 0, 0], len(POINTS))
    assert damped.energy(q, rigid)[1] < 1e-15 * loss
