"""Convergence of the pulled strip with the number of segments before contact; validation/references.md: half cell.

The reference, 0.11413 N at 4 mm of travel, is that of the trial strip (E = 3 GPa,
t = 0.3 mm, nu = 0.3, beam stiffness, creases EI/(30 mm) at rest as folded, no contact); ours is 0.1141289 N.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fsm.scene.builders.scene import build_scene
from fsm.scene.load_case import load_case
from fsm.segments.compile import compile_scene
from fsm.solve.newton import equilibrium, negative_pivots

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
REFERENCE = 0.11413
TRAVEL = 4e-3
COUNTS = (5, 10, 20, 40)


@cache
def static_force(segments: int, half_cell: bool) -> float:
    """Pull force at 4 mm, N."""
    overrides = [
        f"strip.segments_per_panel={segments}",
        f"strip.half_cell={str(half_cell).lower()}",
        "contact=none",
        "material.damping=0",
    ]
    system = compile_scene(build_scene(load_case(CASE, overrides).case))
    times = np.array([system.motions[0].time_of(x) for x in np.linspace(0.0, TRAVEL, 9)])
    q = equilibrium(system, system.initial()[0], times)
    assert negative_pivots(system, times[-1], q) == 0
    return float(system.observe(times[-1], q, np.zeros(system.nu)).drive.force[0])


def limit() -> float:
    """Richardson's limit of 80 and 160 segments with the half-cell correction (second order)."""
    coarse, fine = static_force(80, True), static_force(160, True)
    return fine + (fine - coarse) / 3


def orders(half_cell: bool) -> np.ndarray:
    errors = np.array([abs(static_force(count, half_cell) - limit()) for count in COUNTS])
    return np.log2(errors[:-1] / errors[1:])


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
