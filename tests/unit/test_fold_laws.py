"""Folds between flexible facets or points: laws, dampers, moving rest angles, and angles beyond half a turn."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fsm.case.models.flexible_facets import UNIT, FoldData
from fsm.case.models.materials import SplineCrease
from fsm.kernels.blocks import BlockMatrix
from fsm.model.compile.fold_laws_of import fold_laws_of
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.facets.folds import BETWEEN_POINTS, FoldGroup
from fsm.model.nodes.mesh import node_pattern
from fsm.model.nodes.truss import BarGroup

POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.1, 0.2], [0.3, 0.9, -0.1], [1.2, 1.1, 0.3], [0.5, 0.4, 1.0]])
CORNERS = 3 * np.array([[0, 1, 2, 3], [4, 0, 1, 2], [3, 1, 4, 0]])
ANGLE = np.linspace(-1.0, 2.5, 8)
MOMENT = np.array([-3.0, -2.2, -0.9, 0.4, 1.5, 1.9, 2.6, 2.4])


def measured(**more: Any) -> SplineCrease:
    return SplineCrease.model_validate({"law": "spline", "angle": ANGLE.tolist(), "moment": MOMENT.tolist()} | more)


LAWS = {
    "linear": UNIT, "cubic": measured(),
    "bilinear": measured(angle=[-1.0, 0.2, 2.5], moment=[-3.0, 0.6, 1.0], interpolation="pchip"),
    "hysteresis": measured(unloading=(MOMENT - 0.3).tolist(), reversal=0.5),
}  # fmt: skip


def group(law: str, damping: float = 0.0, turning: float = 0.0, weights: np.ndarray | None = None) -> FoldGroup:
    rest, start, share = np.array([0.6, -0.2, 0.9]), np.array([0.4, -0.9, 0.5]), np.array([2.0, 5.0, 1.5])
    data = replace(
        FoldData.linear(share, rest, start), laws=(UNIT, LAWS[law]), law=np.array([0, 1, 1]), damping=damping * share,
        turning=turning * share, end=2.0,
    )  # fmt: skip
    form = np.broadcast_to(BETWEEN_POINTS, (3, 3, 4)) if weights is None else weights
    return FoldGroup(CORNERS, form, fold_laws_of(data))


def force_of(group: Any, q: np.ndarray, u: np.ndarray | None) -> np.ndarray:
    force = np.zeros(len(q))
    group.add_force(q, u, force)
    return force


def tangents_of(group: Any, q: np.ndarray, u: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, stiffness matrix, damping matrix."""
    pattern = node_pattern(len(q) // 3, 3, [group], [])
    slots = slots_of(np.ascontiguousarray(group.vectors), 3, pattern.indptr, pattern.indices)
    force, stiffness, damping = np.zeros(len(q)), pattern.zeros(), pattern.zeros()
    group.add_linearised(q, u, slots, force, stiffness, damping)
    return force, *(BlockMatrix(pattern, data).bsr().toarray() for data in (stiffness, damping))


@pytest.mark.parametrize("kind", ["points", "slopes"])
@pytest.mark.parametrize("law", list(LAWS))
def test_forces_and_tangents_are_derivatives_of_the_energy(law: str, kind: str) -> None:
    rng, h = np.random.default_rng(3), 1e-6
    weights = None if kind == "points" else rng.normal(size=(3, 3, 4))
    folds = group(law, weights=weights)
    q = (POINTS + 0.05 * rng.normal(size=POINTS.shape)).ravel()
    folds.commit(0.0, q)
    q = q + 0.02 * rng.normal(size=len(q))
    force, stiffness, damping = tangents_of(folds, q, None)
    steps = h * np.eye(len(q))
    by_energy = [-(folds.energy(q + e, None)[0] - folds.energy(q - e, None)[0]) / (2.0 * h) for e in steps]
    if law != "hysteresis":  # sliders take energy
        np.testing.assert_allclose(force, by_energy, atol=1e-7 * np.abs(force).max())
    by_force = np.array([-(force_of(folds, q + e, None) - force_of(folds, q - e, None)) / (2.0 * h) for e in steps])
    np.testing.assert_allclose(force, force_of(folds, q, None), atol=1e-13 * np.abs(force).max())
    np.testing.assert_allclose(stiffness, by_force, atol=1e-7 * np.abs(stiffness).max())
    assert not damping.any()


@pytest.mark.parametrize("which", ["folds", "bars"])
def test_dampers_are_derivatives_and_take_their_power(which: str) -> None:
    rng, h = np.random.default_rng(5), 1e-6
    q, u = (POINTS + 0.05 * rng.normal(size=POINTS.shape)).ravel(), rng.normal(size=POINTS.size)
    ends = 3 * np.array([[0, 1], [1, 2], [2, 0], [4, 3]])
    damped: Any = group("cubic", 0.4) if which == "folds" else BarGroup(ends, np.ones(4), np.arange(1.0, 5.0), viscosity=0.3)
    steps = h * np.eye(len(q))
    force, stiffness, damping = tangents_of(damped, q, u)
    by_place = np.array([-(force_of(damped, q + e, u) - force_of(damped, q - e, u)) / (2.0 * h) for e in steps]).T
    by_rate = np.array([-(force_of(damped, q, u + e) - force_of(damped, q, u - e)) / (2.0 * h) for e in steps]).T
    np.testing.assert_allclose(stiffness, by_place, atol=1e-7 * np.abs(stiffness).max())
    np.testing.assert_allclose(damping, by_rate, atol=1e-7 * np.abs(damping).max())
    taken = (force_of(damped, q, None) - force) @ u
    assert taken == pytest.approx(damped.energy(q, u)[1], rel=1e-12) and taken > 0.0
    # in a step of a path, rates are means since its begin; a rotation of the whole gives none
    before = (q - 0.1 * u).copy()
    damped.at(0.1, (0.0, before))
    force, stiffness, damping = tangents_of(damped, q, u)
    by_place = np.array([-(force_of(damped, q + e, u) - force_of(damped, q - e, u)) / (2.0 * h) for e in steps]).T
    np.testing.assert_allclose(stiffness + damping / 0.1, by_place, atol=1e-7 * np.abs(stiffness + damping / 0.1).max())
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turned = (q.reshape(-1, 3) @ (turn * np.linalg.det(turn)).T).ravel()
    damped.at(0.1, (0.0, q))
    assert damped.energy(turned, (turned - q) / 0.1)[1] < 1e-20


def test_energy_of_moving_rest_angles() -> None:
    """The moment of a linear fold is k (psi - rest - change), and the change gives power to the fold that moves."""
    still, moving = group("linear"), group("linear", turning=0.7)
    q, u = POINTS.ravel(), np.random.default_rng(1).normal(size=POINTS.size)
    moving.at(1.0, None)  # half of the time
    np.testing.assert_allclose(moving.moments(q), still.moments(q) - 0.35 * np.array([2.0, 5.0, 1.5]), rtol=1e-12)
    power = (force_of(moving, q, None) - force_of(still, q, None)) @ u
    assert moving.put_in(q, u) == pytest.approx(power, rel=1e-12)
    assert moving.energy(q, u)[0] == still.energy(q, u)[0]


def flap(angle: float, side: float = 1.0) -> np.ndarray:
    """Coordinates of two triangles with a fold angle."""
    points = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-math.cos(angle), 0.0, side * math.sin(angle)]]
    return np.array(points).ravel()


def test_fold_angles_are_continuous_beyond_half_a_turn() -> None:
    """A fold to 300 degrees and back, to -330 degrees and back: moment and energy are those of the whole angle."""
    data = FoldData.linear(np.array([2.0]), np.array([0.1]), np.zeros(1))
    one = FoldGroup(np.array([[0, 3, 6, 9]]), BETWEEN_POINTS[None], fold_laws_of(data))
    side = math.copysign(1.0, float(one.angles(flap(0.5))[0]))
    there = np.radians(np.concatenate([np.arange(0.0, 300.0, 50.0), [300.0]]))
    back = np.radians(np.concatenate([np.arange(300.0, -330.0, -70.0), [-330.0, -200.0, -60.0, 0.0]]))
    at_most = {}
    for angle in np.concatenate([there, back]):
        q = flap(angle, side)
        assert one.angles(q)[0] == pytest.approx(angle, abs=1e-12)
        assert one.moments(q)[0] == pytest.approx(2.0 * (angle - 0.1), abs=1e-11)
        assert one.energy(q, None)[0] == pytest.approx((angle - 0.1) ** 2, abs=1e-11)
        one.commit(0.0, q)
        at_most[round(math.degrees(angle))] = one.memory()
    one.restore(at_most[300])  # a restart from a checkpoint
    assert one.angles(flap(math.radians(290.0), side))[0] == pytest.approx(math.radians(290.0))
    one.restore(np.zeros(0))
    assert one.angles(flap(math.radians(290.0), side))[0] == pytest.approx(math.radians(-70.0))


def test_work_of_a_crease_with_hysteresis_is_stored_or_dissipated() -> None:
    """On a path with reversals, in long steps whose loss is exact."""
    law = LAWS["hysteresis"]
    data = replace(FoldData.linear(np.array([2.0]), np.array([1.5]), np.array([1.5])), laws=(law,))
    one = FoldGroup(np.array([[0, 3, 6, 9]]), BETWEEN_POINTS[None], fold_laws_of(data))
    side = math.copysign(1.0, float(one.angles(flap(1.5))[0]))
    t, psi, work, lost = 0.0, 1.5, 0.0, 0.0
    one.commit(t, flap(psi, side))
    begin = one.energy(flap(psi, side), None)[0]
    for end in (0.3, 1.1, -0.6, 1.9):
        fine = np.linspace(psi, end, 2001)
        moments = [one.moments(flap(x, side))[0] for x in fine]  # from the memory at the begin: one monotonic step
        work += float(np.trapezoid(moments, fine))
        one.at(t + 1.0, (t, flap(psi, side)))
        slid = one.slid(flap(end, side), np.zeros(12))
        assert slid >= 0.0 == one.energy(flap(end, side), np.zeros(12))[1]
        lost += slid
        t, psi = t + 1.0, end
        one.commit(t, flap(psi, side))
        assert one.slid(flap(psi, side), np.zeros(12)) == slid  # after the step is accepted
    one.at(t, None)
    assert lost > 0.5
    assert work == pytest.approx(one.energy(flap(psi, side), None)[0] - begin + lost, rel=1e-5)
