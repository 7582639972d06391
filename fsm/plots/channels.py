"""Channels of a result over travel or time, one diagram for each unit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fsm.errors import CaseError
from fsm.plots.style import COLOURS, WIDE, abscissa, figure
from fsm.results.channel import select_channels
from fsm.results.solution import Solution

__all__ = ["plot_channels"]

_LEGEND = 12
"""Largest number of lines of a diagram with a legend."""
_HEIGHT = 2.4
"""Height of one diagram, inches."""
_QUANTITY = {
    "m": "length", "rad": "angle", "m/s": "velocity", "rad/s": "angular velocity", "1/m": "curvature", "N": "force",
    "N m": "moment", "J": "energy", "Pa": "stress", "m2": "area", "m/s2": "acceleration",
}  # fmt: skip
"""Quantity that a unit measures, for the axis."""


def plot_channels(solution: Solution, patterns: Sequence[str], path: str | Path, over_time: bool = False) -> list[str]:
    """Draw all channels that match any of the patterns.

    Parameters
    ----------
    solution : Solution
    patterns : patterns of names, as in `[save] channels`
    path : file of the figure
    over_time : draw over time also if there is a drive

    Returns
    -------
    list of str
        Names of the channels in the figure.

    Raises
    ------
    CaseError
        A pattern matches no channel of the result.
    """
    names, faults = select_channels(solution.channels, patterns, "--channel")
    if faults and not solution.channels:
        raise CaseError("has no channels; name channels in [save] channels of the case, and run the case again")
    if faults:
        raise CaseError(faults)
    units: dict[str, dict[str, np.ndarray]] = {}
    for name in names:
        channel = solution.channels[name]
        units.setdefault(channel.info.unit, {}).update(channel.columns)
    x, label = (solution.time, "time (s)") if over_time else abscissa(solution)
    with figure(path, (WIDE[0], 0.6 + _HEIGHT * len(units))) as fig:
        axes = fig.subplots(len(units), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (unit, columns) in zip(axes, units.items(), strict=True):
            for k, (name, values) in enumerate(columns.items()):
                ax.plot(x, values, color=COLOURS[k % len(COLOURS)], linewidth=1.0, label=name)
            quantity = _QUANTITY.get(unit, "value")
            ax.set_ylabel(f"{quantity} ({unit})" if unit != "1" else quantity)
            ax.margins(x=0)
            if len(columns) <= _LEGEND:
                ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
        axes[-1].set_xlabel(label)
    return names
