"""Covariance of parameters from whole repeats and from a model of the wrong form: linear studies with known true values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm, t

from fsm.calibrate.uncertainty import LinearisedTest, ParameterSpread, parameter_spread

TRUE = np.array([1.0, 0.5])
TRAVEL = np.linspace(0.05, 1.0, 20)
JACOBIANS = [np.column_stack([TRAVEL, (1.0 + k) * TRAVEL**3]) for k in range(2)]


def study(
    generator: np.random.Generator, repeats: int, wrong: float, noise: float
) -> tuple[np.ndarray, ParameterSpread, list[np.ndarray]]:
    """Parameters, their spread, and the true curves of a study of two tests.

    Repeats differ by a common factor (1.5 %), by a smooth curve (0.01), and by noise of each point. `wrong` is the size of a
    smooth curve that the model does not have.
    """
    form = wrong * generator.normal() * np.sin(generator.uniform(1, 3) * np.pi * TRAVEL + generator.uniform(0, 6.3)) * TRAVEL
    truth = [jacobian @ TRUE + form for jacobian in JACOBIANS]
    tests = []
    for force in truth:
        factor = 1.0 + 0.015 * generator.normal(size=(repeats, 1))
        phase = generator.uniform(0, 6.3, size=(repeats, 1))
        smooth = 0.01 * generator.normal(size=(repeats, 1)) * np.sin(2.0 * TRAVEL + phase)
        tests.append(force * factor + smooth + noise * generator.normal(size=(repeats, len(TRAVEL))))
    gain = np.linalg.pinv(np.vstack(JACOBIANS))
    found = gain @ np.concatenate([values.mean(axis=0) for values in tests])
    count = len(TRAVEL)
    rows = [
        LinearisedTest(
            TRAVEL, values.mean(axis=0) - jacobian @ found, jacobian, gain[:, k * count : (k + 1) * count], values, None
        )
        for k, (values, jacobian) in enumerate(zip(tests, JACOBIANS, strict=True))
    ]
    return found, parameter_spread(rows, np.zeros((2, 2))), truth


@pytest.mark.parametrize("repeats", [2, 3, 6])
@pytest.mark.parametrize("wrong", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("noise", [0.002, 0.02])
def test_intervals_and_bands_hold_the_truth(repeats: int, wrong: float, noise: float) -> None:
    """95 % intervals of parameters and of the last force, over 400 studies: 90 to 99 %, and more with two repeats only.

    A standard deviation from two repeats has one degree of freedom: Welch and Satterthwaite's intervals are wide then.
    """
    generator = np.random.default_rng([repeats, int(100 * wrong), int(1000 * noise)])
    inside, peaks = np.zeros(2), 0.0
    for _ in range(400):
        found, spread, truth = study(generator, repeats, wrong, noise)
        reach = t.ppf(0.975, spread.freedom)
        inside += np.abs(found - TRUE) < reach * np.sqrt(np.diag(spread.covariance))
        for force, jacobian, misfit in zip(truth, JACOBIANS, spread.discrepancy, strict=True):
            of_parameters = reach * np.sqrt(jacobian[-1] @ spread.covariance @ jacobian[-1])
            half = np.hypot(of_parameters, norm.ppf(0.975) * misfit)
            peaks += 0.5 * (abs(jacobian[-1] @ found - force[-1]) < half)
    most = 1.0 if repeats == 2 or wrong == 0.0 else 0.995
    assert np.all(inside / 400 >= 0.89) and np.all(inside / 400 <= most), inside / 400
    assert 0.92 <= peaks / 400 <= most, peaks / 400


def test_independent_scatter_gives_the_classical_covariance() -> None:
    """Many repeats with noise alone: s^2 (J^T J)^-1 of the mean curve."""
    generator = np.random.default_rng(5)
    jacobian, repeats, noise = JACOBIANS[0], 400, 0.03
    values = jacobian @ TRUE + noise * generator.normal(size=(repeats, len(TRAVEL)))
    gain = np.linalg.pinv(jacobian)
    exact = jacobian @ TRUE
    spread = parameter_spread([LinearisedTest(TRAVEL, exact - exact, jacobian, gain, values, None)], np.zeros((2, 2)))
    classical = noise**2 / repeats * np.linalg.inv(jacobian.T @ jacobian)
    np.testing.assert_allclose(spread.covariance, classical, rtol=0.15)
    assert spread.discrepancy == pytest.approx([0.0])


def test_scatter_that_is_said_and_none_at_all() -> None:
    """A given scatter determines the covariance; without it the residuals do."""
    jacobian, noise = JACOBIANS[0], 0.03
    gain, nothing = np.linalg.pinv(jacobian), np.zeros((0, 0))
    test = LinearisedTest(TRAVEL, np.zeros(20), jacobian, gain, nothing, noise**2 * np.eye(20))
    said = parameter_spread([test], np.zeros((2, 2)))
    np.testing.assert_allclose(said.covariance, noise**2 * np.linalg.inv(jacobian.T @ jacobian), rtol=1e-9)
    assert said.freedom == np.inf
    variances = []
    for seed in range(200):
        force = noise * np.random.default_rng(seed).normal(size=20)
        residual = force - jacobian @ (gain @ force)
        test = LinearisedTest(TRAVEL, residual, jacobian, gain, nothing, None)
        variances.append(parameter_spread([test], np.zeros((2, 2))).covariance)
    ratio = np.mean(variances, axis=0) / said.covariance
    assert np.all((ratio > 0.7) & (ratio < 2.5)), ratio
