"""Drive force over travel: one run with its stages and peaks, or all runs of a table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from fsm.results.curve import ForceCurve
from fsm.results.solution import Solution
from fsm.text.shown_units import ShownUnit
from fsm.views.plots import style as look
from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.style import EVENTS, add_legend, add_legend_across, shade_stages, summary_with_stages

Units = tuple[ShownUnit, ShownUnit]
"""Units of force and travel."""

_SMALL = 1e-3
"""Dynamic peak relative to the quasi-static one, below which it is not marked."""
_DYNAMIC_RANGE = 1.5
"""Largest range of the force axis relative to the range of the quasi-static forces; larger dynamic forces are cut off."""


def plot_force(solution: Solution, path: str | Path) -> None:
    """Draw force over travel, with shaded stages and the value of the quasi-static peak.

    Dynamic forces are thin grey lines with a marker at their peak. Without a drive the figure shows the normal forces
    of the contact pairs over time. If some drives turn and others do not, drives of the other kind than the first have
    axes of their own.
    """
    drives, first = range(solution.travel.shape[1]), solution.layout.turns()
    own = [k for k in drives if solution.layout.turns(k) == first]
    others = [k for k in drives if k not in own]
    with look.figure(path, look.WIDE if others else look.SINGLE, look.Grid(1, 2 if others else 1)) as fig:
        ax = fig.axes[0]
        if not solution.travel.shape[1]:
            ax.set_xlabel("time (s)")
            _draw_pairs(ax, solution)
            return
        units = look.drive_units(solution, own)
        x = units[1].factor * solution.travel[:, 0]
        ax.set_xlabel(look.travel_label(first, units[1]))
        curve = solution.force_curve
        _draw_drives(ax, solution, own)
        if others:
            beside = fig.axes[1]
            beside.set_xlabel(look.travel_label(not first, look.drive_units(solution, others)[1]))
            _draw_drives(beside, solution, others)
            _limit(beside, curve, others, look.drive_units(solution, others)[0].factor)
        summary = summary_with_stages(solution)
        stages: list[Artist] = [*shade_stages(ax, summary["stages"], float(x[-1]), units[1])]
        stages += _mark_events(ax, summary.get("events", []), units)
        _limit(ax, curve, own, units[0].factor)
        stages += _mark_peaks(ax, summary, float(x[-1]), units)
        add_legend_across(fig, stages, "upper")


def plot_overlay(curves: Sequence[tuple[str, Solution]], path: str | Path) -> None:
    """Draw the force curves of a table in one figure, with names and quasi-static peaks in the legend.

    Dynamic forces are thin lines, cut off at the range of the quasi-static forces. Runs without a drive are not drawn.
    """
    drawn = [(name, run) for name, run in curves if run.travel.shape[1]]
    kinds = sorted({run.layout.turns() for _, run in drawn})
    units = {turns: _common_units([run for _, run in drawn if run.layout.turns() == turns]) for turns in kinds}
    with look.figure(path, look.WIDE) as fig:
        ax = fig.add_subplot()
        for k, (name, run) in enumerate(drawn):
            colour, dashes = look.COLOURS[k % len(look.COLOURS)], look.DASHES[k // len(look.COLOURS) % len(look.DASHES)]
            summary = summary_with_stages(run)
            effort, way = own = units[run.layout.turns()]
            force, travel = effort.factor * summary["peak_force"], way.factor * summary["peak_travel"]
            label = f"{name}: {look.rounded(force)} {effort.name} at {look.rounded(travel)} {way.name}"
            curve = run.force_curve
            _draw_curve(ax, curve, 0, own, dynamic_colour=colour, clip=True, color=colour, linestyle=dashes, label=label)
            ax.plot(travel, force, "o", color=colour, markersize=points(4.5), markeredgecolor="white", zorder=4)
        ax.set_xlabel(" or ".join(look.travel_label(turns, units[turns][1]) for turns in kinds))
        ax.set_ylabel(" or ".join(f"{'moment' if turns else 'force'} ({units[turns][0].name})" for turns in kinds))
        ax.margins(x=0)
        if not drawn:
            _write_note(ax, "no curve: none of the runs has a drive")
        else:
            add_legend(fig, ax)


def _common_units(runs: Sequence[Solution]) -> Units:
    """Units of force and travel for several runs with drives of one kind: the largest units of the runs."""
    efforts, ways = zip(*(look.drive_units(run) for run in runs), strict=True)
    return min(efforts), min(ways)  # a larger unit has a smaller factor


def _draw_drives(ax: Axes, solution: Solution, drives: list[int]) -> None:
    """Draw the curves of drives of one kind, and the labels of the ordinate and of the curves."""
    names, units = solution.layout.drive_names, look.drive_units(solution, drives)
    for k in drives:
        name = names[k] if k < len(names) else f"drive {k + 1}"
        _draw_curve(
            ax, solution.force_curve, k, units, color=look.COLOURS[k % len(look.COLOURS)], label=look.shortened(name)
        )
    ax.set_ylabel(f"{'moment' if solution.layout.turns(drives[0]) else 'force'} ({units[0].name})")
    ax.margins(x=0)
    if solution.travel.shape[1] > 1:
        ax.legend(loc="best")


def _range(curve: ForceCurve, drives: list[int]) -> tuple[float, float]:
    """Smallest and largest quasi-static force of drives, N; of all their forces if the whole run is dynamic."""
    force = (curve.force[~curve.dynamic] if curve.has_quasi_static else curve.force)[:, drives]
    return float(np.nanmin(force)), float(np.nanmax(force))


def _draw_curve(
    ax: Axes, curve: ForceCurve, drive: int, units: Units, dynamic_colour: str = look.GREY, clip: bool = False, **style: Any
) -> None:
    """Draw the quasi-static force of one drive, and its dynamic force as a thin line.

    `clip` limits the dynamic force to the range of the quasi-static forces. Paths are not joined by lines.
    """
    travel, force = units[1].factor * curve.travel[:, drive], units[0].factor * curve.force[:, drive]
    if not curve.has_quasi_static:
        ax.plot(travel, force, **style)
        return
    ax.plot(travel, np.where(curve.dynamic, np.nan, force), **style)
    if curve.dynamic.any():
        edges = np.flatnonzero(np.diff(curve.dynamic.astype(int)))
        moving = curve.dynamic.copy()
        moving[edges], moving[edges + 1] = True, True  # the ends of the paths are included, so that both lines meet
        between = np.where(moving, force, np.nan)
        if clip:
            low, high = _range(curve, [drive])
            between = np.clip(between, units[0].factor * low, units[0].factor * high)
        ax.plot(travel, between, color=dynamic_colour, linewidth=line_width(0.6), zorder=1.9)


def _limit(ax: Axes, curve: ForceCurve, drives: list[int], factor: float) -> None:
    """Set the limits of the force axis from the quasi-static forces, with room for dynamic ones (`_DYNAMIC_RANGE`).

    `factor` converts forces to the unit of the axis.
    """
    low, high = _range(curve, drives)
    force = curve.force[:, drives]
    room = (_DYNAMIC_RANGE - 1.0) * max(high - low, 1e-300)
    low, high = max(float(np.nanmin(force)), low - room), min(float(np.nanmax(force)), high + room)
    margin = 0.05 * ((high - low) or 1.0)
    ax.set_ylim(factor * (low - margin), factor * (high + margin))


def _draw_pairs(ax: Axes, solution: Solution) -> None:
    """Draw contact forces over time, for a scene without a drive."""
    unit = look.figure_unit("N", solution.pair_force)
    ax.set_ylabel(f"normal force of contact ({unit.name})")
    ax.margins(x=0)
    for k, name in enumerate(solution.layout.pair_names):
        if solution.pair_force[:, k].any():
            colour, dashes = look.COLOURS[k % len(look.COLOURS)], look.DASHES[k // len(look.COLOURS) % len(look.DASHES)]
            ax.plot(solution.time, unit.factor * solution.pair_force[:, k], dashes, color=colour, label=look.shortened(name))
    if ax.lines:
        ax.legend(loc="best")
    else:
        _write_note(ax, "no drive and no contact force")


def _write_note(ax: Axes, text: str) -> None:
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color=look.GREY)


def _mark_events(ax: Axes, events: Sequence[dict[str, Any]], units: Units) -> list[Line2D]:
    """Mark snaps and bifurcations on the curve; return the legend entries."""
    handles: list[Line2D] = []
    effort, way = (unit.factor for unit in units)
    for marker, label in dict.fromkeys(EVENTS.values()):
        at = [event for event in events if EVENTS.get(event["kind"]) == (marker, label)]
        if not at:
            continue
        travel, force = [way * event["travel"] for event in at], [effort * event["force"] for event in at]
        style: dict[str, Any] = {"color": look.COLOURS[3], "marker": marker, "markersize": points(5), "linestyle": "none"}
        ax.plot(travel, force, zorder=5, clip_on=False, **style)
        for event in at:
            ends = [way * event["travel"], way * event["end_travel"]], [effort * event["force"], effort * event["end_force"]]
            ax.plot(*ends, ":", color=look.COLOURS[3], linewidth=line_width(1.0))
        handles.append(Line2D([], [], label=label, **style))
    return handles


def _mark_peaks(ax: Axes, summary: dict[str, Any], last: float, units: Units) -> list[Line2D]:
    """Mark the quasi-static peak with its value, and the dynamic peak; return the legend entry of the dynamic peak."""
    effort, way = units
    force, at = effort.factor * summary["peak_force"], way.factor * summary["peak_travel"]
    ax.plot(at, force, "o", color=look.COLOURS[1], markersize=points(5), zorder=4, clip_on=False)
    bottom, top = ax.get_ylim()
    ax.set_ylim(bottom, max(top, force) + 0.08 * (top - bottom))
    right = at > 0.6 * last
    ax.annotate(
        f"peak {look.rounded(force)} {effort.name} at {look.rounded(at)} {way.name}", (at, force),
        xytext=(-8 if right else 8, 3),
        textcoords="offset points", ha="right" if right else "left", va="bottom",
    )  # fmt: skip
    largest = summary.get("dynamic_peak_force") or 0.0
    if largest <= _SMALL * abs(summary["peak_force"]) or summary.get("peak_kind") == "dynamic":
        return []
    dynamic, where = effort.factor * largest, way.factor * summary["dynamic_peak_travel"]
    style: dict[str, Any] = {
        "color": look.GREY, "marker": "o", "markersize": points(4), "linestyle": "none", "fillstyle": "none"
    }
    bottom, top = ax.get_ylim()
    if bottom <= dynamic <= top:
        ax.plot(where, dynamic, zorder=4, **style)
    return [
        Line2D([], [], label=f"dynamic {look.rounded(dynamic)} {effort.name} at {look.rounded(where)} {way.name}", **style)
    ]
