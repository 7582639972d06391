"""Figures of the benchmarks, drawn from the CSV files alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from fsm.views.plots.style import COLOURS, GREY, SINGLE, figure
from validation.benchmarks.precision import Row

__all__ = ["plot_all_scenes", "plot_scene", "plot_segments"]

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
_FEW_DECADES = 200.0
"""Longest over shortest time of a plot up to which its ticks are at 1, 2 and 5."""
SMALLEST = 1e-16
"""An error of nothing is drawn here."""


def plot_scene(path: Path, rows: Sequence[Row], title: str, measure: str, methods: Sequence[str]) -> None:
    """Error against time for one scene; `methods` is in the order of their colours."""
    with figure(path, SINGLE) as fig:
        axes = fig.add_subplot()
        _draw(axes, rows, methods)
        axes.set(title=title, xlabel="run time (s)", ylabel=measure)
        axes.legend()


def plot_all_scenes(path: Path, rows: Sequence[Row], titles: Mapping[str, str], methods: Sequence[str]) -> None:
    """All scenes on one sheet."""
    scenes = [name for name in titles if any(row["scene"] == name for row in rows)]
    columns = min(3, max(1, len(scenes)))
    lines = math.ceil(len(scenes) / columns)
    with figure(path, (3.2 * columns, 2.7 * lines)) as fig:
        for k, name in enumerate(scenes):
            axes = fig.add_subplot(lines, columns, k + 1)
            _draw(axes, [row for row in rows if row["scene"] == name], methods)
            axes.set_title(titles[name])
            if k % columns == 0:
                axes.set_ylabel("error")
            if k // columns == lines - 1:
                axes.set_xlabel("run time (s)")
            axes.legend(fontsize=6.5)


def _draw(axes: Axes, rows: Sequence[Row], methods: Sequence[str]) -> None:
    """One line for each method through its tolerances; the legend counts the tolerances without a result."""
    for number, method in enumerate(methods):
        own = [row for row in rows if row["method"] == method]
        done = sorted(
            ((float(row["tolerance"]), float(row["time_s"]), float(row["error"])) for row in own if row["status"] == "ok"),
            reverse=True,
        )
        if not own:
            continue
        counts = {status: sum(row["status"] == status for row in own) for status in ("failed", "too slow", "skipped")}
        counts["too slow"] += counts.pop("skipped")
        notes = ", ".join(f"{count} {status}" for status, count in counts.items() if count)
        axes.plot(
            [seconds for _, seconds, _ in done],
            [max(error, SMALLEST) for _, _, error in done],
            color=COLOURS[number % len(COLOURS)],
            marker=MARKERS[number % len(MARKERS)],
            markersize=3.5,
            label=method + (f" ({notes})" if notes else ""),
        )
    axes.set(xscale="log", yscale="log")
    low, high = axes.get_xlim()
    if high < _FEW_DECADES * low:  # one label a decade is too few, and labels at every tick would overlap
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", color=GREY, alpha=0.25, linewidth=0.5)


def plot_segments(path: Path, rows: Sequence[Row]) -> None:
    """Time against the number of segments, with the slope of each line over its upper decades."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    with figure(path, (3.4 * len(scenes), 4.8)) as fig:
        for k, scene in enumerate(scenes):
            axes = fig.add_subplot(1, len(scenes), k + 1)
            own = [row for row in rows if row["scene"] == scene and row["time_s"]]
            for number, what in enumerate(dict.fromkeys(row["what"] for row in rows)):
                line = [row for row in own if row["what"] == what]
                if not line:
                    continue
                count = np.array([float(row["segments"]) for row in line])
                seconds = np.array([float(row["time_s"]) for row in line])
                label = f"{what}: n^{float(line[0]['slope']):.2f}" if line[0]["slope"] else what
                colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
                axes.loglog(count, 1e3 * seconds, color=colour, marker=marker, markersize=3.5, label=label)
            axes.set(title=scene, xlabel="segments")
            if k == 0:
                axes.set_ylabel("time (ms)")
            axes.grid(True, which="major", color=GREY, alpha=0.25, linewidth=0.5)
            # there are so many lines that the legend has no room inside
            axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.15), fontsize=6.5)
