"""Convergence of the pulled strip with the number of segments before contact; validation/references.md: half cell.

The reference, 0.11413 N at 4 mm of travel, is that of the trial strip (E = 3 GPa,
t = 0.3 mm, nu = 0.3, beam stiffness, creases EI/(30 mm) at rest as folded, no contact); ours is 0.1141289 N.
"""

from __future__ import annotations

import pytest

from validation.strip_trial.check import limit, orders, static_force

REFERENCE = 0.11413


def test_limit_is_the_reference() -> None:
    assert limit() == pytest.approx(REFERENCE, abs=0.5e-5)


def test_second_order_with_half_cell() -> None:
    found = orders(half_cell=True)
    assert found.min() >= 1.8
    assert found == pytest.approx(2.0, abs=0.1)


def test_first_order_without_half_cell() -> None:
    found = orders(half_cell=False)
    assert found.min() > 0.8
    assert found.max() < 1.3


def test_five_segments_with_half_cell_beat_forty_without() -> None:
    assert abs(static_force(5, True) - limit()) < abs(static_force(40, False) - limit())
