"""Inflated cantilever: initial slope, straight up to the wrinkling force, and the curve of a wrinkled beam beyond it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from validation.inflated_beam.beam import POISSON, Fit, collapse_force, run, slender, timoshenko

STIFFNESS = 2.15e5


def test_a_coarse_tube_bends_and_wrinkles_as_the_closed_forms(tmp_path: Path) -> None:
    fit = Fit(0.08, 0.4)
    found = run(tmp_path, fit, STIFFNESS, cells=(8, 6), most=0.6, steps=8)
    slope = timoshenko(STIFFNESS, STIFFNESS / (2.0 + 2.0 * POISSON), fit.radius, fit.pressure)
    assert found.slope == pytest.approx(slope, rel=0.02)
    limit = collapse_force(fit.radius, fit.pressure)
    share = np.array([0.5, 0.7])
    bending = slender(STIFFNESS, fit.radius, fit.pressure, share)
    deflection = bending + limit * share * (1.0 / slope - 1.0 / (3.0 * np.pi * fit.radius**3 * STIFFNESS))
    # wrinkles take 7 % of the force that a straight line would give
    assert deflection[1] > 1.05 * limit * share[1] / slope
    for at, force in zip(deflection, limit * share, strict=True):
        assert found.at(at) == pytest.approx(force, rel=0.03)


def test_the_closed_form_of_wrinkled_bending_is_a_straight_beam_up_to_half_of_collapse() -> None:
    """v = F L^3/(3 E I) with I = pi r^3 t."""
    limit = collapse_force(0.08, 0.4)
    half = slender(STIFFNESS, 0.08, 0.4, np.array([0.25, 0.5]))
    np.testing.assert_allclose(half, limit * np.array([0.25, 0.5]) / (3.0 * np.pi * 0.08**3 * STIFFNESS), rtol=1e-4)
