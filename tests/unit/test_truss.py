"""Energy, force and tangent of bars and rotational springs between points."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fsm.builders.patterns.generators import miura, waterbomb
from fsm.case.models.flexible_facets import FoldData
from fsm.case.pattern_files.pattern import Pattern
from fsm.kernels.blocks import BlockMatrix
from fsm.model.compile.fold_laws_of import fold_laws_of
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.facets.fold_kernels import fold_efforts
from fsm.model.nodes.facets.folds import BETWEEN_POINTS, FoldGroup
from fsm.model.nodes.mesh import node_pattern
from fsm.model.nodes.truss import BarGroup

POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.1, 0.2], [0.3, 0.9, -0.1], [1.2, 1.1, 0.3], [0.5, 0.4, 1.0]])


def bars(law: str, exponents: tuple[float, float] = (5.0, 1.0)) -> BarGroup:
    ends = 3 * np.array([[0, 1], [1, 2], [2, 0], [1, 3], [4, 0], [4, 3]])
    length = np.linalg.norm(POINTS[ends[:, 1] // 3] - POINTS[ends[:, 0] // 3], axis=1)
    return BarGroup(ends, length, np.linspace(3.0, 8.0, 6), law, exponents)


def between(corners: np.ndarray, stiffness: np.ndarray, rest: np.ndarray, linear_to: float = math.pi) -> FoldGroup:
    """Linear folds between points; they are flat at the start."""
    data = FoldData.linear(stiffness, rest, np.zeros(len(rest)), linear_to)
    return FoldGroup(corners, np.broadcast_to(BETWEEN_POINTS, (len(rest), 3, 4)), fold_laws_of(data))


def folds(linear_to: float = math.pi, rest: float = 0.3) -> FoldGroup:
    corners = 3 * np.array([[0, 1, 2, 3], [4, 0, 1, 2], [3, 1, 4, 0]])
    return between(corners, np.array([2.0, 5.0, 1.5]), np.array([rest, -0.2, 0.1]), linear_to)


GROUPS = [bars("linear"), bars("green"), bars("ogden"), bars("ogden", (2.0, 0.0)), folds(), folds(0.4), folds(1.0)]


def force_of(group: BarGroup | FoldGroup, q: np.ndarray) -> np.ndarray:
    force = np.zeros(len(q))
    group.add_force(q, None, force)
    return force


def tangent_of(group: BarGroup | FoldGroup, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force and stiffness matrix."""
    pattern = node_pattern(len(q) // 3, 3, [group], [])
    slots = slots_of(np.ascontiguousarray(group.vectors), 3, pattern.indptr, pattern.indices)
    force, stiffness, damping = np.zeros(len(q)), pattern.zeros(), pattern.zeros()
    group.add_linearised(q, None, slots, force, stiffness, damping)
    assert not damping.any()
    return force, BlockMatrix(pattern, stiffness).bsr().toarray()


@pytest.mark.parametrize("number", range(len(GROUPS)))
def test_forces_and_tangents_are_derivatives_of_the_energy(number: int) -> None:
    group, h = GROUPS[number], 1e-5
    q = (POINTS + 0.05 * np.random.default_rng(number).normal(size=POINTS.shape)).ravel()
    force, stiffness = tangent_of(group, q)
    np.testing.assert_allclose(force, force_of(group, q), rtol=1e-12, atol=1e-12)
    steps = h * np.eye(len(q))
    by_energy = [-(group.energy(q + e, None)[0] - group.energy(q - e, None)[0]) / (2.0 * h) for e in steps]
    np.testing.assert_allclose(force, by_energy, rtol=1e-6, atol=1e-7)
    by_force = np.array([-(force_of(group, q + e) - force_of(group, q - e)) / (2.0 * h) for e in steps])
    np.testing.assert_allclose(stiffness, by_force, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(stiffness, stiffness.T, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("number", range(len(GROUPS)))
def test_rigid_motions_change_no_energy(number: int) -> None:
    group, rng = GROUPS[number], np.random.default_rng(3)
    q = POINTS + 0.05 * rng.normal(size=POINTS.shape)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    moved = q @ turn.T + rng.normal(size=3)
    assert group.energy(moved.ravel(), None)[0] == pytest.approx(group.energy(q.ravel(), None)[0], rel=1e-11)
    force = force_of(group, q.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.cross(q, force).sum(axis=0), 0.0, atol=1e-11)


def test_unstressed_bars_have_the_stiffness_of_hooke() -> None:
    """All laws have the force E A at a unit strain, for small strains."""
    for group in GROUPS[:4]:
        assert isinstance(group, BarGroup)
        np.testing.assert_allclose(group.forces(POINTS.ravel()), 0.0, atol=1e-12)
        stretched = group.forces(1.000001 * POINTS.ravel())
        np.testing.assert_allclose(stretched, 1e-6 * group.stiffness, rtol=1e-5)


@pytest.mark.parametrize("pattern", [miura(2, 2, 1.0, 1.2, 1.0, 0.6).with_bend_lines(), waterbomb(2, 2, 1.0)])
def test_fold_angles_are_those_of_the_pattern(pattern: Pattern) -> None:
    """Sign and size, in a crumpled state."""
    at = pattern.vertices + 0.05 * np.random.default_rng(7).normal(size=pattern.vertices.shape)
    creases = pattern.creases
    corners = []
    for edge in creases:
        u, v = pattern.edges[edge]
        left, right = (next(w for w in pattern.faces[f] if w not in (u, v)) for f in pattern.edge_faces[edge])
        corners.append([left, u, v, right])
    ones = np.ones(len(creases))
    group = between(3 * np.array(corners), ones, 0.0 * ones)
    np.testing.assert_allclose(group.angles(at.ravel()), pattern.fold_angles(at)[creases], atol=1e-12)


def test_moment_rises_like_a_tangent_beyond_linear_to() -> None:
    group = between(np.array([[0, 3, 6, 9]]), np.array([2.0]), np.array([0.1]), math.radians(135.0))

    def moment(angle: float) -> float:
        points = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-math.cos(angle), 0.0, side * math.sin(angle)]]
        q = np.array(points).ravel()
        assert float(group.angles(q)[0]) == pytest.approx(angle)
        return float(group.moments(q)[0])

    side = math.copysign(1.0, float(group.angles(np.array([1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1.0]))[0]))
    assert moment(1.0) == pytest.approx(1.8) and moment(-1.0) == pytest.approx(-2.2)
    edge = math.radians(135.0)
    assert moment(edge + 1e-7) == pytest.approx(2.0 * (edge - 0.1), rel=1e-6)
    at_edge, risen = 2.0 * (edge - 0.1), math.tan(math.radians(80.0))
    assert moment(math.radians(175.0)) == pytest.approx(at_edge + risen, rel=1e-9)
    assert moment(math.radians(-175.0)) == pytest.approx(-2.0 * (edge + 0.1) - risen, rel=1e-9)


@pytest.mark.parametrize("degrees", [30.0, 135.0, 178.0])
def test_facets_that_nearly_touch_stop_large_energies(degrees: float) -> None:
    """Energy, moment and slope match each other, and are continuous where the last twentieth of the range begins; an energy
    of 1e9 times the stiffness is stored at the remaining angle of the closed form."""
    limit, k = math.radians(degrees), 3.0
    law = fold_laws_of(FoldData.linear(np.array([k]), np.zeros(1), np.zeros(1), limit)).without_memory

    def efforts(left: float, side: float = 1.0) -> np.ndarray:
        return fold_efforts(law, np.array([side * (math.pi - left)]))[:, 0]

    begins, c = 0.05 * (math.pi - limit), 0.5 * math.pi / (math.pi - limit)
    np.testing.assert_allclose(efforts((1.0 - 1e-9) * begins), efforts((1.0 + 1e-9) * begins), rtol=1e-6)
    for part in (0.95, 0.5, 0.1):
        left, h = part * begins, 1e-4 * part * begins
        energy, moment, slope = efforts(left)
        low, high = efforts(left + h), efforts(left - h)
        assert moment == pytest.approx((high[0] - low[0]) / (2.0 * h), rel=1e-6)
        assert slope == pytest.approx((high[1] - low[1]) / (2.0 * h), rel=1e-6)
        np.testing.assert_allclose(efforts(left, -1.0), [energy, -moment, slope], rtol=1e-12)
    large = 1e9 * k
    assert efforts(begins / (1.0 + (0.01 * large * c * c / k) ** (1.0 / 3.0)))[0] == pytest.approx(large, rel=1e-3)
    assert np.isnan(efforts(-1e-12)).all()
