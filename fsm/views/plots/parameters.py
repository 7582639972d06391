"""Figure of a table of cases: the peak over each parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fsm.text.shown_units import shown_unit, turns
from fsm.views.plots.drawing import points
from fsm.views.plots.study import varied_inputs
from fsm.views.plots.style import COLOURS, WIDE, figure

_MOST, _COLUMNS = 12, 3
"""Largest number of parameters, and number of panels side by side."""


def plot_parameters(rows: Sequence[Mapping[str, Any]], units: Mapping[str, str], path: str | Path) -> None:
    """Draw the peak of every row over each parameter that has different numbers; without such a parameter, over the rows.

    Parameters
    ----------
    rows : rows of a table; those without a peak are left out
    units : SI units of the inputs of the table by their paths
    path : path of the figure
    """
    rows = [row for row in rows if row.get("peak_force") is not None]
    turning = any(turns(row) for row in rows)
    shown = shown_unit("N m" if turning else "N", max((abs(row["peak_force"]) for row in rows), default=0.0))
    peaks = [shown.factor * row["peak_force"] for row in rows]
    panels = varied_inputs(rows, units)[:_MOST] or [("row", [float(k) for k in range(len(rows))])]
    wide = min(len(panels), _COLUMNS)
    high = -(-len(panels) // wide)
    with figure(path, (WIDE[0], 2.6 * high)) as fig:
        axes = fig.subplots(high, wide, squeeze=False, sharey=True)
        for ax, (label, numbers) in zip(axes.flat, panels, strict=False):
            x = np.array([np.nan if number is None else number for number in numbers])
            ax.plot(x, peaks, "o", color=COLOURS[0], markersize=points(3), markeredgewidth=0.0, alpha=0.7)
            ax.set_xlabel(label)
            ax.margins(0.05, 0.08)
        for ax in axes[:, 0]:
            ax.set_ylabel(f"peak {'moment' if turning else 'force'} ({shown.name})")
        for ax in axes.flat[len(panels) :]:
            ax.set_axis_off()
