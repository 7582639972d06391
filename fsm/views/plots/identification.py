"""Figures of force-displacement tests with their fit, and of predictions with their band."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fsm.results.film import Floats
from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.style import COLOURS, GREY, SINGLE, figure


class TestPlot(NamedTuple):
    """Computed curve with its band, and the measured forces if there are any.

    Attributes
    ----------
    title : str
    travel, force, low, high : (n,) arrays, m and N
    measured : (n,) array or None, N
        Measured forces at the same travels.
    half_band : (n,) array or None, N
        Half width of the band of the measured forces.
    level : -
        Confidence level of the bands.
    """

    title: str
    travel: Floats
    force: Floats
    low: Floats
    high: Floats
    measured: Floats | None
    half_band: Floats | None
    level: float


def plot_tests(tests: Sequence[TestPlot], path: str | Path) -> None:
    """Draw one column per test, with the curves above and the residuals below."""
    residuals = any(test.measured is not None for test in tests)
    height = 1.35 * SINGLE[1] if residuals else SINGLE[1]
    with figure(path, (SINGLE[0] * len(tests), height)) as fig:
        grid = fig.subplots(1 + residuals, len(tests), squeeze=False, sharex="col", height_ratios=(3, 1)[: 1 + residuals])
        for column, test in zip(grid.T, tests, strict=True):
            x, top = 1e3 * np.asarray(test.travel), column[0]
            top.plot(x, test.force, color=COLOURS[0], label="model")
            band = f"{100 * test.level:g} % band of the model"
            top.fill_between(x, test.low, test.high, color=COLOURS[0], alpha=0.25, linewidth=0, label=band)
            if test.measured is not None:
                measured = np.asarray(test.measured)
                style = {"fmt": "o", "color": GREY, "markersize": points(3), "linewidth": line_width(0.8)}
                name = "test" if test.half_band is None else f"test with its {100 * test.level:g} % band"
                top.errorbar(x, measured, test.half_band, label=name, **style)
                column[1].errorbar(x, measured - test.force, test.half_band, **style)
                column[1].axhline(0.0, color=COLOURS[0], linewidth=line_width(0.9))
                column[1].set_ylabel("residual (N)")
            top.set_title(test.title)
            top.set_ylabel("force (N)")
            column[-1].set_xlabel("travel (mm)")
            top.legend(loc="best")
