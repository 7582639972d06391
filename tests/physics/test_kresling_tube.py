"""Geometry of printed Kresling tubes, and how their tests are read."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from validation.kresling_tube.measured import RATIOS, first_compression
from validation.kresling_tube.tube import COMPRESSED, RADIUS, SIDES, angles, height

TRAVELS = {0.69: 26.18e-3, 0.75: 30.74e-3, 0.85: 36.77e-3}
"""Of the tests, m."""


@pytest.mark.parametrize("ratio", RATIOS)
def test_edges_have_the_same_lengths_in_both_states(ratio: float) -> None:
    printed, compressed = angles(ratio)
    for turn in (0.0, 2.0 * math.pi / SIDES):
        lengths = [
            math.sqrt(z**2 + 2.0 * RADIUS**2 * (1.0 - math.cos(angle + turn)))
            for z, angle in ((height(ratio), printed), (COMPRESSED, compressed))
        ]
        assert lengths[0] == pytest.approx(lengths[1], rel=1e-12)
    assert height(ratio) - COMPRESSED == pytest.approx(TRAVELS[ratio], abs=3e-5)


def test_first_compression_ends_at_the_first_turn(tmp_path: Path) -> None:
    path = tmp_path / "test.csv"
    path.write_text(
        "Force,Distance,Time\nN,mm,min\n\nSample 1\n0,0,0\n-10,-1,1\n-20,-2,2\n-9,-1,3\n-25,-2,4\n", encoding="utf-8"
    )
    travel, forces = first_compression(path)
    assert np.allclose(travel, [0.0, 1.0, 2.0])
    assert np.allclose(forces, np.array([0.0, 10.0, 20.0]) + 1.32435)
