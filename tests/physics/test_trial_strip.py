"""The trial strip against two elastic curves with rigid contact (`validation.strip_trial.half_model`)."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.results.quantities import peak
from validation.strip_trial.check import CASE, RIGID, Setting, by_default, followed, pulled
from validation.strip_trial.half_model import HalfModel

half_model = cache(lambda angle, end: HalfModel(angle).follow(end, 0.5e-3))


def test_half_model_is_that_of_another_hand() -> None:
    path = half_model(80.0, 0.0285)
    assert path.peak[1] == pytest.approx(RIGID, rel=1e-3)
    assert path.peak[1] == pytest.approx(2.00486, abs=2e-5)
    assert path.bottoms_touch == pytest.approx(4.9683e-3, abs=1e-6)
    assert path.panels_touch == pytest.approx(12.907e-3, abs=2e-6)


def test_many_segments_and_a_stiff_contact_come_to_it() -> None:
    travel, force = pulled(80.0, Setting(80, 1e12, 0.2, 2.0), 0.0285)
    assert peak(travel, force)[0] == pytest.approx(2.00486, rel=1e-3)


@pytest.mark.parametrize("angle", [80.0, 83.0])
def test_a_case_that_gives_nothing_is_within_half_a_percent(angle: float) -> None:
    """Defaults: the peak within 0.5 %, and the curve at first touch within 1 % of it."""
    end = 0.0285 if angle == 80.0 else 0.021
    exact = half_model(angle, end)
    travel, force = by_default(angle, end)
    top = exact.peak[1]
    assert peak(travel, force)[0] == pytest.approx(top, rel=5e-3)
    near = np.linspace(exact.bottoms_touch - 1e-3, exact.bottoms_touch + 1e-3, 200)
    assert np.abs(np.interp(near, travel, force) - exact.force_at(near)).max() < 0.01 * top


@pytest.mark.parametrize("segments", [5, 40])
def test_a_thick_strip_runs_through(segments: int) -> None:
    """The strip is twice as thick, at 84 degrees: the bottoms press on each other with 25 N.

    Soft contact (1e9 N/m^1.5) allowed a penetration of half a thickness, and passage through corners; contact from the
    material does not.
    """
    changes = [
        'strip.fold_angle="84 deg"', 'strip.thickness="0.6 mm"', "crease.stiffness=0.072", 'drive.0.travel="45 mm"',
        f"strip.segments_per_panel={segments}", "contact.stiffness=none", "material.damping=none", "expect=none",
    ]  # fmt: skip
    travel, force = followed(load_case(CASE, changes).case)
    assert travel[-1] == pytest.approx(0.045, rel=1e-9)
    assert 27.0 < force.max() < 36.0
