"""Pull force against travel: one run with its stages and its peak, or all curves of a table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from fsm.plots.legend import add_legend
from fsm.plots.marks import EVENTS, shade_stages, summary_with_stages
from fsm.plots.style import COLOURS, GREY, SINGLE, WIDE, abscissa, figure, rounded, shortened
from fsm.results.quantities import peak
from fsm.results.solution import Solution

__all__ = ["plot_force", "plot_overlay"]

DASHES = ("-", "--", "-.", ":")


def plot_force(solution: Solution, path: str | Path) -> None:
    """Force against travel in mm, the stages shaded and named, the peak marked with its value.

    Without a drive: the normal forces of the contact pairs against time.
    """
    with figure(path, SINGLE) as fig:
        ax = fig.add_subplot()
        x, label = abscissa(solution)
        ax.set_xlabel(label)
        if not solution.travel.shape[1]:
            _draw_pairs(ax, solution)
            return
        names = solution.layout.drive_names
        for k in range(solution.force.shape[1]):
            name = names[k] if k < len(names) else f"drive {k + 1}"
            colour = COLOURS[k % len(COLOURS)]
            ax.plot(solution.travel[:, k] * 1e3, solution.force[:, k], color=colour, label=shortened(name))
        ax.set_ylabel("force (N)")
        ax.margins(x=0)
        if solution.force.shape[1] > 1:
            ax.legend(loc="best")
        summary = summary_with_stages(solution)
        stages: list[Artist] = [*shade_stages(ax, summary["stages"], float(x[-1]))]
        stages += _mark_events(ax, summary.get("events", []))
        fig.legend(handles=stages, loc="outside upper center", ncols=3, columnspacing=1.2, handlelength=1.4)
        _mark_peak(ax, solution)


def plot_overlay(curves: Sequence[tuple[str, Solution]], path: str | Path) -> None:
    """The curves of a table in one figure, peaks marked, names and peak values in the legend.

    Curves without a drive are left out.
    """
    with figure(path, WIDE) as fig:
        ax = fig.add_subplot()
        drawn = [(name, run) for name, run in curves if run.travel.shape[1]]
        for k, (name, run) in enumerate(drawn):
            colour, dashes = COLOURS[k % len(COLOURS)], DASHES[k // len(COLOURS) % len(DASHES)]
            force, travel = peak(run.travel[:, 0], run.force[:, 0])
            label = f"{name}: {rounded(force)} N at {rounded(travel * 1e3)} mm"
            ax.plot(run.travel[:, 0] * 1e3, run.force[:, 0], color=colour, linestyle=dashes, label=label)
            ax.plot(travel * 1e3, force, "o", color=colour, markersize=4.5, markeredgecolor="white", zorder=4)
        ax.set_xlabel("travel (mm)")
        ax.set_ylabel("force (N)")
        ax.margins(x=0)
        if not drawn:
            _say(ax, "no curve: none of the runs has a drive")
        else:
            add_legend(fig, ax)


def _draw_pairs(ax: Axes, solution: Solution) -> None:
    """Contact forces over time, for a scene that nothing pulls."""
    ax.set_ylabel("normal force of contact (N)")
    ax.margins(x=0)
    for k, name in enumerate(solution.layout.pair_names):
        if solution.pair_force[:, k].any():
            colour, dashes = COLOURS[k % len(COLOURS)], DASHES[k // len(COLOURS) % len(DASHES)]
            ax.plot(solution.time, solution.pair_force[:, k], dashes, color=colour, label=shortened(name))
    if ax.lines:
        ax.legend(loc="best")
    else:
        _say(ax, "no drive and no contact force")


def _say(ax: Axes, text: str) -> None:
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color=GREY)


def _mark_events(ax: Axes, events: Sequence[dict[str, Any]]) -> list[Line2D]:
    """Snaps and bifurcations on the curve; gives back what names them."""
    handles: list[Line2D] = []
    for kind, (marker, label) in EVENTS.items():
        at = [event for event in events if event["kind"] == kind]
        if not at:
            continue
        travel, force = [1e3 * event["travel"] for event in at], [event["force"] for event in at]
        style: dict[str, Any] = {"color": COLOURS[3], "marker": marker, "markersize": 5, "linestyle": "none"}
        ax.plot(travel, force, zorder=5, clip_on=False, **style)
        for event in at:
            ends = [1e3 * event["travel"], 1e3 * event["end_travel"]], [event["force"], event["end_force"]]
            ax.plot(*ends, ":", color=COLOURS[3], linewidth=1.0)
        if label not in [handle.get_label() for handle in handles]:
            handles.append(Line2D([], [], label=label, **style))
    return handles


def _mark_peak(ax: Axes, solution: Solution) -> None:
    travel = solution.travel[:, 0] * 1e3
    force, at = peak(travel, solution.force[:, 0])
    ax.plot(at, force, "o", color=COLOURS[1], markersize=5, zorder=4, clip_on=False)
    bottom, top = ax.get_ylim()
    ax.set_ylim(bottom, top + 0.08 * (top - bottom))
    right = at > travel[0] + 0.6 * (travel[-1] - travel[0])
    ax.annotate(
        f"peak {rounded(force)} N at {rounded(at)} mm", (at, force), xytext=(-8 if right else 8, 3),
        textcoords="offset points", ha="right" if right else "left", va="bottom",
    )  # fmt: skip
