"""Oscillators of the reduced model: below, at and beyond critical damping."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from fsm.model.nodes.system.reduced import ReducedModel


@pytest.mark.parametrize("damping", [0.0, 30.0, 99.9999, 100.0, 100.0001, 300.0, 1e5])
def test_an_oscillator_moves_as_its_equation_says(damping: float) -> None:
    """a'' + 2 d a' + 100^2 a = 0 from a = 1, a' = -20, against the matrix exponential; 1e5: it creeps back at 0.05 1/s."""
    one = np.ones(1)
    nothing = np.zeros((0,) * 3), np.zeros((0,) * 4)
    model = ReducedModel(np.zeros(1), np.ones((1, 1)), 1e4 * one, damping * one, *nothing)
    response = model.respond(0.05, 1e-3, amplitude=one, rate=-20.0 * one)
    matrix = np.array([[0.0, 1.0], [-1e4, -2.0 * damping]])
    exact = np.array([expm(matrix * t) @ (1.0, -20.0) for t in response.time])
    np.testing.assert_allclose(response.amplitude[:, 0], exact[:, 0], rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(response.rate[:, 0], exact[:, 1], rtol=0.0, atol=1e-6)
