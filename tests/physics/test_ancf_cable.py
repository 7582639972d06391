"""ANCF cable against cantilevers, a rolled-up beam, strings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from validation.closed_forms.ancf import LENGTH, rolled_up, string_ratio
from validation.closed_forms.ancf import cable_cantilever as cantilever


def test_cantilever_with_one_element_and_converged() -> None:
    # published one-element value, and a converged one of another program; both with the engineering strain
    np.testing.assert_allclose(cantilever(1), [-0.362245, -0.994145], atol=1e-6)
    np.testing.assert_allclose(cantilever(64), [-0.508537304, -1.207239855], atol=2e-8)


def test_cantilever_converges_at_fourth_order_with_either_strain() -> None:
    for engineering in (True, False):
        fine = cantilever(64, engineering)
        errors = [np.linalg.norm(cantilever(n, engineering) - fine) for n in (8, 16)]
        assert math.log2(errors[0] / errors[1]) == pytest.approx(5.6, abs=0.5)
    # Green strain: the values are the same except for eps^2/2 of the stretch
    np.testing.assert_allclose(cantilever(64, False), [-0.508537304, -1.207239855], atol=1e-6)


def test_a_moment_rolls_a_beam_up_into_a_circle() -> None:
    elements = 16
    nodes = rolled_up(elements)
    assert np.linalg.norm(nodes[-1, :3]) < 1e-4 * LENGTH
    middle = nodes[elements // 2, [0, 2]]
    np.testing.assert_allclose(middle, [0.0, LENGTH / math.pi], atol=1e-4 * LENGTH)
    np.testing.assert_allclose(nodes[-1, 3:], [1.0, 0.0, 0.0], atol=1e-3)


@pytest.mark.parametrize(("ratio", "wanted"), [(0.0, 1.0), (0.5, 0.6855592720), (1.0, 0.5477053736)])
def test_string_with_a_central_mass(ratio: float, wanted: float) -> None:
    """f/f0 of a tensioned string with a mass m in the middle, m/(mu L) = ratio."""
    assert string_ratio(ratio) == pytest.approx(wanted, rel=1e-4)
