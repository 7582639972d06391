"""Estimates: covariance against the closed form of a straight line, coverage, warnings."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.calibrate.uncertainty import Estimate, bootstrap, from_samples, identifiability, laplace


def line(seed: int, repeats: int = 5, noise: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    x = np.linspace(-1.0, 2.0, 12)
    generator = np.random.default_rng(seed)
    return x, 2.0 - 0.7 * x + noise * generator.normal(size=(repeats, len(x)))


def fitted(x: np.ndarray, y: np.ndarray, scale: float | None = None) -> Estimate:
    jacobian = np.column_stack([np.ones_like(x), x])
    values = np.linalg.lstsq(jacobian, y, rcond=None)[0]
    return laplace(("a", "b"), values, jacobian, jacobian @ values - y, scale)


def test_covariance_of_a_straight_line_is_the_textbook_one() -> None:
    x, repeats = line(1)
    estimate = fitted(x, repeats[0], scale=0.1)
    spread = np.sum((x - x.mean()) ** 2)
    exact = 0.01 * np.array([[1 / len(x) + x.mean() ** 2 / spread, -x.mean() / spread], [-x.mean() / spread, 1 / spread]])
    np.testing.assert_allclose(estimate.covariance, exact, rtol=1e-12)
    np.testing.assert_allclose(np.diff(estimate.interval(), axis=1)[:, 0], 2 * 1.959964 * np.sqrt(np.diag(exact)), rtol=1e-6)
    assert estimate.correlation[0, 1] == pytest.approx(exact[0, 1] / np.sqrt(exact[0, 0] * exact[1, 1]))
    # an unknown scatter is estimated from the residuals over their degrees of freedom, which are two less than the data
    unknown = fitted(x, repeats[0])
    residuals = repeats[0] - unknown.values[0] - unknown.values[1] * x
    np.testing.assert_allclose(unknown.covariance, exact / 0.01 * np.sum(residuals**2) / (len(x) - 2), rtol=1e-9)


@pytest.mark.filterwarnings("error")
def test_a_parameter_next_to_nothing_has_its_interval() -> None:
    estimate = Estimate(("zero", "size"), np.array([1e-17, 2.0]), np.diag([1.0, 0.04]), positive=("size",))
    wanted = [[-1.959964, 1.959964], [2.0 * np.exp(-0.1959964), 2.0 * np.exp(0.1959964)]]
    np.testing.assert_allclose(estimate.interval(), wanted, rtol=1e-6)


@pytest.mark.parametrize("scale", [None, 0.1])
def test_intervals_cover_the_truth_as_often_as_they_say(scale: float | None) -> None:
    inside = np.zeros(2)
    for seed in range(2000):
        x, repeats = line(seed, repeats=1)
        interval = fitted(x, repeats[0], scale).interval()
        inside += (interval[:, 0] <= [2.0, -0.7]) & (interval[:, 1] >= [2.0, -0.7])
    # 2000 trials: 95 % within three standard deviations, 1.5 %
    assert np.all(np.abs(inside / 2000 - 0.95) < 0.015)


def test_bootstrap_has_the_variance_of_a_mean() -> None:
    generator = np.random.default_rng(3)
    spreads, covered = [], 0
    for seed in range(200):
        repeats = generator.normal(1.0, 0.3, size=6)
        samples = bootstrap(lambda draw, data=repeats: np.array([data[draw].mean()]), 6, count=200, seed=seed)  # type: ignore[misc]
        estimate = from_samples(("mean",), np.array([repeats.mean()]), samples, 6)
        spreads.append(estimate.covariance[0, 0])
        low, high = estimate.interval()[0]
        covered += low <= 1.0 <= high
    assert np.mean(spreads) == pytest.approx(0.3**2 / 6, rel=0.1)
    assert 0.9 <= covered / 200 <= 0.99


def test_same_seed_same_draws() -> None:
    first, again, other = (bootstrap(lambda draw: draw.astype(float), 4, count=5, seed=s) for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)


def test_two_parameters_that_act_alike_are_told() -> None:
    x = np.linspace(0.0, 1.0, 20)
    jacobian = np.column_stack([x, 2.0 * x, np.ones_like(x)])
    estimate = laplace(("k", "c", "offset"), np.array([1.0, 1.0, 1.0]), jacobian, np.full(20, 0.01))
    warnings = identifiability(estimate)
    assert any("k and c are strongly correlated" in text for text in warnings)
    assert any("k is poorly identifiable" in text for text in warnings)
    assert not any("offset" in text for text in warnings)


def test_good_data_warn_of_nothing() -> None:
    x, repeats = line(5)
    assert identifiability(fitted(x, repeats[0])) == []


def test_too_few_data_are_refused() -> None:
    with pytest.raises(ValueError, match="2 data"):
        laplace(("a", "b"), np.ones(2), np.eye(2), np.zeros(2))
    with pytest.raises(ValueError, match="two repeats"):
        bootstrap(lambda draw: draw, 1)
