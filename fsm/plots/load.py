"""Loads over their displacements on paths by arc length and of static steps, with limit points."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fsm.load_names import load_units
from fsm.plots.drawing import line_width, points
from fsm.plots.legend import add_legend
from fsm.plots.style import COLOURS, DASHES, GREY, SINGLE, figure, rounded, shortened
from fsm.results.solution import Solution
from fsm.results.step_data import LoadPath

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_load"]

_LABELLED = 6
"""Largest number of limit points with their size beside them."""


def plot_load(solution: Solution, path: str | Path) -> None:
    """Draw every load over its displacement, with dots at limit points; the lines are dashed along unstable equilibria.

    Forces, moments and pressures have separate axes.
    """
    found = solution.load_path
    assert found is not None
    kinds = list(dict.fromkeys(load_units(name) for name in found.names))
    width, height = SINGLE
    with figure(path, (width, height * len(kinds))) as fig:
        for ax, kind in zip(fig.subplots(len(kinds), squeeze=False)[:, 0], kinds, strict=True):
            own = [k for k, name in enumerate(found.names) if load_units(name) is kind]
            motions = _motions(solution, found)
            unstable = [k for k in own if not _draw(ax, found, k, motions)]
            if unstable:
                ax.plot([], [], color=GREY, linestyle=DASHES[1], label="unstable")
            if motions.any():
                ax.plot([], [], color=GREY, linestyle=DASHES[2], label="motion")
            ax.axhline(0.0, color=GREY, linewidth=line_width(0.6), zorder=0)
            ax.set_xlabel(kind.curve)
            ax.set_ylabel(kind.load)
            ax.margins(y=0.12)
            add_legend(fig, ax)


def _motions(solution: Solution, found: LoadPath) -> np.ndarray:
    """Whether a motion lies between each point of a path (n,) and the point before it."""
    out = np.zeros(len(found.time), dtype=bool)
    for event in solution.summary.get("events", ()):
        if event["kind"] in ("motion", "snap", "release"):
            first, last = np.searchsorted(found.time, [event["time"], event["end_time"]], side="right")
            out[first : last + 1] = True
    return out


def _draw(ax: Axes, found: LoadPath, k: int, motions: np.ndarray) -> bool:
    """Draw one load, with lines of its own across `motions`; return whether all of its equilibria are stable."""
    colour, label, all_stable = COLOURS[k % len(COLOURS)], shortened(found.names[k]), True
    for step in np.unique(found.step):
        of_step = np.flatnonzero((found.step == step) & np.isfinite(found.size[:, k]))
        way, size, stable = 1e3 * found.way[of_step, k], found.size[of_step, k], found.stable[of_step] > 0.0
        for at in np.split(np.arange(len(of_step)), np.flatnonzero(motions[of_step])):
            ax.plot(way[at], np.where(_near(stable[at]), size[at], np.nan), color=colour, label=label)
            ax.plot(way[at], np.where(_near(~stable[at]), size[at], np.nan), color=colour, linestyle=DASHES[1], zorder=1.9)
            label = "_"
        for at in np.flatnonzero(motions[of_step])[np.flatnonzero(motions[of_step]) > 0]:
            ax.plot(way[at - 1 : at + 1], size[at - 1 : at + 1], color=colour, linestyle=DASHES[2], zorder=1.8)
        label, all_stable = "_", all_stable and bool(stable.all())
        limits = np.flatnonzero(np.diff(np.sign(np.diff(found.time[of_step]))) != 0.0) + 1
        dot = {"markersize": points(4.5), "markeredgecolor": "white", "zorder": 4}
        ax.plot(way[limits], size[limits], "o", color=colour, **dot)
        for at in limits[:_LABELLED]:
            above = size[at] > size[at - 1]
            ax.annotate(
                rounded(float(size[at])), (way[at], size[at]), (0.0, points(5.0 if above else -5.0)),
                textcoords="offset points", ha="center", va="bottom" if above else "top", fontsize="small",
            )  # fmt: skip
    return all_stable


def _near(marked: np.ndarray) -> np.ndarray:
    """Marked points and the points after them, so that lines of marked and other points meet."""
    return marked | np.concatenate([[False], marked[:-1]])
