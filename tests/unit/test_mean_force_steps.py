"""The mean-force method: corrections that use earlier corrections, and steps that are halved where they are expensive."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.system.build import MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.stepping import mean_newton as newton
from fsm.solve.stepping.mean_force import divide
from fsm.solve.stepping.mean_newton import choose_prediction, predicted_rate
from fsm.solve.stepping.secants import add, improved, no_secants
from fsm.solve.time.mean_force import MeanForce


def iterations(learning: bool) -> int:
    """Corrections of K x = f to 1e-10 by the inverse of another matrix, four times as stiff along some directions."""
    rng = np.random.default_rng(3)
    basis = np.linalg.qr(rng.normal(size=(30, 30)))[0]
    stiffness = basis @ np.diag(np.linspace(1.0, 9.0, 30)) @ basis.T
    stale = stiffness + 3.0 * sum(np.outer(v, v) * (v @ stiffness @ v) for v in basis.T[:3])
    right = rng.normal(size=30)
    x, secants = np.zeros(30), no_secants(np.ones(30), 200)
    for count in range(1, 200):
        dx = np.linalg.solve(stale, right - stiffness @ x)
        if learning:
            dx = improved(secants, dx)
            add(secants, dx, dx)
        x = x + dx
        if np.linalg.norm(right - stiffness @ x) < 1e-10:
            return count
    return 200


def test_corrections_learn_what_the_tangent_does_not_know() -> None:
    assert iterations(True) < 12 < 40 < iterations(False)


def test_steps_are_halved_while_they_cost_much() -> None:
    """Steps are halved at most twice, and doubled again once they are cheap; another object continues with the same
    steps."""
    builder = MeshBuilder()
    grid = builder.film(np.linspace(0, 1, 3), np.linspace(0, 1, 3), (FilmMaterial(1e9, 0.3, 1000.0, 1e-4),))
    builder.hold(grid.edge())
    system = AncfSystem(builder.build())
    q, u = system.initial()
    u[grid.position[1, 1] + 2] = 0.1
    method = MeanForce(system, 0.0, q, u, 1e-6, 1e-3)
    for _ in range(10):
        method.step(1.0)
    assert np.isclose(method.t, 10e-3)  # an ordinary step is not halved
    for _ in range(20):
        divide(method.motion, 100.0)
    method.step(1.0)
    assert np.isclose(method.t, 10.25e-3)
    other = MeanForce(system, method.t, method.q, method.u, 1e-6, 1e-3)
    other.resume(method.state())
    for each in (method, other):
        for _ in range(20):
            divide(each.motion, 3.0)
        each.step(1.0)
    assert np.isclose(method.t, 11.25e-3, rtol=1e-3) and method.t == other.t


@pytest.mark.parametrize(("direction", "step"), [(0, 0.1), (2, 1e-4)])
def test_the_prediction_follows_fast_and_slow_modes(direction: int, step: float) -> None:
    """Undamped waves in the film's plane change their sign in every step; the error of linear extrapolation was 4 times
    their amplitude.

    Films with slack parts then needed 1.2 to 2.7 times the time (2026-11-23).
    """
    builder = MeshBuilder()
    grid = builder.film(np.linspace(0, 1, 3), np.linspace(0, 1, 3), (FilmMaterial(1e9, 0.3, 1000.0, 1e-4),))
    builder.hold(grid.edge())
    system = AncfSystem(builder.build())
    q, u = system.initial()
    u[grid.position[1, 1] + direction] = 1e-5
    method = MeanForce(system, 0.0, q, u, 1e-6, step)
    for _ in range(4):
        method.step(1e6 * step)
    predicted, before = predicted_rate(method.motion, method.rules, step).copy(), method.q
    method.step(1e6 * step)
    rate = (method.q - before) / step
    assert np.linalg.norm(predicted - rate) < 0.7 * np.linalg.norm(rate)


def test_error_control_extrapolates_only_rates_that_change_slowly() -> None:
    """The next step is predicted by the rule that was nearer in the last one: extrapolation or the last rate."""
    builder = MeshBuilder()
    grid = builder.film(np.linspace(0, 1, 3), np.linspace(0, 1, 3), (FilmMaterial(1e9, 0.3, 1000.0, 1e-4),))
    builder.hold(grid.edge())
    system = AncfSystem(builder.build())
    method = MeanForce(system, 0.0, *system.initial(), 1e-6)
    motion, mode = method.motion, np.random.default_rng(1).normal(size=system.nu)
    motion.sizes[[newton.LAST, newton.LAST_BEFORE]] = 1e-3
    for before, last, now, predicted in ((1.0, 1.2, 1.35, 1.4), (1.0, -1.0, 1.0, -1.0), (1.0, 1.2, 1.25, 1.2)):
        motion.mean_before[:], motion.mean[:] = before * mode, last * mode
        choose_prediction(method.model, motion, 1e-3, 1e-3 * now * mode)
        np.testing.assert_allclose(predicted_rate(motion, method.rules, 1e-3), predicted * mode, rtol=1e-12)
