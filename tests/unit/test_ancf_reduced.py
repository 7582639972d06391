"""Oscillators of a reduced film: exact in the linear range, and their force is the gradient of their energy."""

from __future__ import annotations

import numpy as np

from fsm.model.nodes.system.reduced import _transition, march, nonlinear_force


def test_damped_oscillators_move_as_they_have_to() -> None:
    squared, damping, h = np.array([4.0, 25.0]), np.array([0.1, 0.0]), 0.05
    transition = _transition(squared, damping, h)
    none = np.zeros((2, 2, 2)), np.zeros((2, 2, 2, 2))
    times = h * np.arange(60)
    start, rate = np.array([1.0, -0.5]), np.array([0.3, 2.0])
    a, v = march(h, transition, *none, np.zeros((60, 2)), start, rate, False)
    omega = np.sqrt(squared - damping**2)
    turned, fade = np.outer(times, omega), np.exp(-np.outer(times, damping))
    wanted = fade * (start * np.cos(turned) + (rate + damping * start) / omega * np.sin(turned))
    np.testing.assert_allclose(a, wanted, atol=1e-13)
    np.testing.assert_allclose(v[0], rate)
    # a load that grows linearly: a = t - 2 damping/squared, after the transient of the start has decayed
    ramp = np.outer(times, squared)
    a, _ = march(h, transition, *none, ramp, -2.0 * damping / squared, np.ones(2), False)
    np.testing.assert_allclose(a, times[:, None] - 2.0 * damping / squared, atol=1e-12)


def potential(quadratic: np.ndarray, cubic: np.ndarray, a: np.ndarray) -> float:
    third = np.einsum("ijm,i,j,m", quadratic, a, a, a) / 3.0
    return float(third + np.einsum("ijmn,i,j,m,n", cubic, a, a, a, a) / 4.0)


def symmetric(rng: np.random.Generator, order: int) -> np.ndarray:
    from itertools import permutations

    drawn = rng.normal(size=(3,) * order)
    return np.ascontiguousarray(sum(drawn.transpose(axes) for axes in permutations(range(order))))


def test_force_is_minus_the_slope_of_the_potential_and_energy_stays() -> None:
    rng = np.random.default_rng(0)
    quadratic, cubic, a, force = symmetric(rng, 3), symmetric(rng, 4), rng.normal(size=3), np.empty(3)
    nonlinear_force(quadratic, cubic, a, force)
    steps = 1e-6 * np.eye(3)
    slope = [(potential(quadratic, cubic, a + s) - potential(quadratic, cubic, a - s)) / 2e-6 for s in steps]
    np.testing.assert_allclose(force, -np.array(slope), rtol=1e-7)

    squared, h, stiff = np.array([1.0, 4.0, 9.0]), 0.002, np.zeros((3, 3, 3, 3))
    stiff[0, 0, 0, 0] = stiff[1, 1, 1, 1] = 3.0
    nothing = np.zeros((3, 3, 3))
    transition = _transition(squared, np.zeros(3), h)
    a, v = march(h, transition, nothing, stiff, np.zeros((1000, 3)), np.array([1.0, -0.5, 0.2]), np.zeros(3), True)
    energy = 0.5 * (v**2).sum(axis=1) + 0.5 * (a**2 @ squared) + 0.75 * (a**4)[:, :2].sum(axis=1)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-5)
    assert np.ptp(a[:, 0]) > 1.0
