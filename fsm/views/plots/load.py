"""Loads over their displacements on paths by arc length and of static steps, with limit points."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fsm.results.solution import Solution
from fsm.results.step_data import LoadPath
from fsm.text.load_names import LoadUnits, load_units
from fsm.text.shown_units import ShownUnit
from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.style import COLOURS, DASHES, GREY, SINGLE, WIDE, add_legend, figure, figure_unit, rounded, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LoadAxes = tuple[ShownUnit, ShownUnit]
"""Units of the displacements and of the sizes of loads of one kind."""

_LABELLED = 6
"""Largest number of limit points with their size beside them."""


def load_axes(found: LoadPath) -> dict[LoadUnits, LoadAxes]:
    """Units of the axes of every kind of load in a path, in the order of the loads."""
    kinds: dict[LoadUnits, list[int]] = {}
    for k, name in enumerate(found.names):
        kinds.setdefault(load_units(name), []).append(k)
    return {
        kind: (
            figure_unit(kind.displacement, float(np.nanmax(np.abs(found.way[:, own]), initial=0.0))),
            figure_unit(kind.size, float(np.nanmax(np.abs(found.size[:, own]), initial=0.0))),
        )
        for kind, own in kinds.items()
    }


def plot_load(solution: Solution, path: str | Path) -> None:
    """Draw every load over its displacement, with dots at limit points; the lines are dashed along unstable equilibria.

    Forces, moments and pressures have separate axes.
    """
    found = solution.load_path
    assert found is not None
    kinds = load_axes(found)
    width, height = SINGLE
    with figure(path, (width, height * len(kinds))) as fig:
        motions = _motions(solution, found)
        for ax, (kind, units) in zip(fig.subplots(len(kinds), squeeze=False)[:, 0], kinds.items(), strict=True):
            own = _of_kind(found, kind)
            unstable = [k for k in own if not _draw(ax, found, k, units, motions)]
            for k in own:
                _draw_limits(ax, solution, found, k, units)
            if unstable:
                ax.plot([], [], color=GREY, linestyle=DASHES[1], label="unstable")
            if motions.any():
                ax.plot([], [], color=GREY, linestyle=DASHES[2], label="motion")
            ax.axhline(0.0, color=GREY, linewidth=line_width(0.6), zorder=0)
            ax.set_xlabel(f"{kind.curve} ({units[0].name})")
            ax.set_ylabel(f"{kind.load} ({units[1].name})")
            ax.margins(y=0.12)
            add_legend(fig, ax)


def plot_load_overlay(curves: Sequence[tuple[str, Solution]], path: str | Path) -> None:
    """Draw the load-displacement curves of the runs of a table, with the end of each curve in the legend.

    The kinds of loads (forces, moments, pressures) have separate axes. Runs without a curve are not drawn.
    """
    drawn = [(name, run.load_path) for name, run in curves if run.load_path is not None and run.load_path.names]
    axes = [load_axes(found) for _, found in drawn]
    kinds = list(dict.fromkeys(kind for one in axes for kind in one))
    if not kinds:
        return
    width, height = WIDE
    with figure(path, (width, height * len(kinds))) as fig:
        for ax, kind in zip(fig.subplots(len(kinds), squeeze=False)[:, 0], kinds, strict=True):
            way, size = (min(one[kind][k] for one in axes if kind in one) for k in range(2))  # the largest units
            lines = [(name, found, k) for name, found in drawn for k in _of_kind(found, kind)]
            for number, (name, found, k) in enumerate(lines):
                x, y = way.factor * found.way[:, k], size.factor * found.size[:, k]
                end = f"{rounded(float(y[-1]))} {size.name} at {rounded(float(x[-1]))} {way.name}"
                called = name if len(_of_kind(found, kind)) == 1 else f"{name}, {shortened(found.names[k])}"
                colour, dashes = COLOURS[number % len(COLOURS)], DASHES[number // len(COLOURS) % len(DASHES)]
                ax.plot(x, y, dashes, color=colour, label=f"{called}: {end}")
            ax.axhline(0.0, color=GREY, linewidth=line_width(0.6), zorder=0)
            ax.set_xlabel(f"{kind.curve} ({way.name})")
            ax.set_ylabel(f"{kind.load} ({size.name})")
            add_legend(fig, ax)


def _of_kind(found: LoadPath, kind: LoadUnits) -> list[int]:
    """Numbers of the loads of a kind."""
    return [k for k, name in enumerate(found.names) if load_units(name) is kind]


def _motions(solution: Solution, found: LoadPath) -> np.ndarray:
    """Whether a motion lies between each point of a path (n,) and the point before it."""
    out = np.zeros(len(found.time), dtype=bool)
    for event in solution.summary.get("events", ()):
        if event["kind"] in ("motion", "snap", "release"):
            first, last = np.searchsorted(found.time, [event["time"], event["end_time"]], side="right")
            out[first : last + 1] = True
    return out


def _draw(ax: Axes, found: LoadPath, k: int, units: LoadAxes, motions: np.ndarray) -> bool:
    """Draw one load, with lines of its own across `motions`; return whether all of its equilibria are stable."""
    colour, label, all_stable = COLOURS[k % len(COLOURS)], shortened(found.names[k]), True
    for step in np.unique(found.step):
        of_step = np.flatnonzero((found.step == step) & np.isfinite(found.size[:, k]))
        way, size = units[0].factor * found.way[of_step, k], units[1].factor * found.size[of_step, k]
        stable = found.stable[of_step] > 0.0
        for at in np.split(np.arange(len(of_step)), np.flatnonzero(motions[of_step])):
            ax.plot(way[at], np.where(_near(stable[at]), size[at], np.nan), color=colour, label=label)
            ax.plot(way[at], np.where(_near(~stable[at]), size[at], np.nan), color=colour, linestyle=DASHES[1], zorder=1.9)
            label = "_"
        for at in np.flatnonzero(motions[of_step])[np.flatnonzero(motions[of_step]) > 0]:
            ax.plot(way[at - 1 : at + 1], size[at - 1 : at + 1], color=colour, linestyle=DASHES[2], zorder=1.8)
        label, all_stable = "_", all_stable and bool(stable.all())
    return all_stable


def _draw_limits(ax: Axes, solution: Solution, found: LoadPath, k: int, units: LoadAxes) -> None:
    """Draw the interpolated limit points of a load, the first of each step with their size beside them."""
    for number, step in enumerate(solution.summary.get("step", ()), 1):
        of_step = np.flatnonzero((found.step == number) & np.isfinite(found.size[:, k]))
        named = [point["loads"] for point in step.get("limit_points", ()) if found.names[k] in point["loads"]]
        for order, loads in enumerate(named):
            way, size = loads[found.names[k]]["displacement"], loads[found.names[k]]["size"]
            at = (units[0].factor * way, units[1].factor * size)
            colour = COLOURS[k % len(COLOURS)]
            ax.plot(*at, "o", color=colour, markersize=points(4.5), markeredgecolor="white", zorder=4)
            if order < _LABELLED:
                above = size >= found.size[of_step, k][np.argmin(np.abs(found.way[of_step, k] - way))]  # a maximum
                ax.annotate(
                    rounded(at[1]), at, (0.0, points(5.0 if above else -5.0)),
                    textcoords="offset points", ha="center", va="bottom" if above else "top", fontsize="small",
                )  # fmt: skip


def _near(marked: np.ndarray) -> np.ndarray:
    """Marked points and the points after them, so that lines of marked and other points meet."""
    return marked | np.concatenate([[False], marked[:-1]])
