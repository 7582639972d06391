"""Functions of time that multiply loads."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.scene.loads import Constant, Cycle, Ramp, Table
from fsm.segments.time_function import factor, integral


def test_constant() -> None:
    assert [factor(Constant(), t) for t in (-1.0, 0.0, 7.0)] == [1.0, 1.0, 1.0]


def test_ramp_is_zero_then_smooth_then_one() -> None:
    ramp = Ramp(kind="ramp", start=1.0, end=3.0)
    assert [factor(ramp, t) for t in (-1.0, 1.0, 2.0, 3.0, 9.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]
    times = np.linspace(0.0, 4.0, 4001)
    values = np.array([factor(ramp, t) for t in times])
    slopes = np.diff(values) / np.diff(times)
    assert slopes.min() >= 0.0
    assert slopes.max() == pytest.approx(1.5 / 2.0, rel=1e-6)
    assert np.abs(np.diff(slopes)).max() < 2e-3  # C1


def test_table_is_linear_between_rows_and_constant_outside() -> None:
    table = Table(kind="table", time=(1.0, 2.0, 4.0), value=(0.5, -1.0, 3.0))
    found = [factor(table, t) for t in (0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 100.0)]
    assert found == pytest.approx([0.5, 0.5, -0.25, -1.0, 1.0, 3.0, 3.0])


def test_integral() -> None:
    """Exact against many trapezoids, also backwards in time, and zero at zero."""
    functions = (
        Constant(), Ramp(kind="ramp", start=0.5, end=2.0), Ramp(kind="ramp", end=2.0, shape="unbounded"),
        Table(kind="table", time=(0.2, 1.0, 3.0), value=(0.5, -1.0, 3.0)),
        Table(kind="table", time=(0.2, 1.0, 3.0), value=(0.0, 2.0, 3.0), interpolation="smooth"),
        Cycle(kind="cycle", period=0.7, start=0.3, cycles=2.5), Cycle(kind="cycle", period=0.7, form="alternating"),
    )  # fmt: skip
    for function in functions:
        assert integral(function, 0.0) == 0.0
        for end in (-0.4, 0.9, 2.6, 4.0):
            assert integral(function, np.float64(end)) == integral(function, end)  # as time integrators have it
            times = np.linspace(0.0, end, 200_001)
            values = np.array([factor(function, t) for t in times[::20]])
            assert integral(function, end) == pytest.approx(np.trapezoid(values, times[::20]), abs=2e-6)
