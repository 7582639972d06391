"""Drive force over travel: one run with its stages and peaks, or all runs of a table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from fsm.plots.drawing import line_width, points
from fsm.plots.legend import add_legend, add_legend_across
from fsm.plots.marks import EVENTS, shade_stages, summary_with_stages
from fsm.plots.style import COLOURS, DASHES, GREY, SINGLE, WIDE, abscissa, drive_units, figure, rounded, shortened
from fsm.results.curve import ForceCurve
from fsm.results.solution import Floats, Solution

__all__ = ["plot_force", "plot_overlay"]

_DYNAMIC_RANGE = 1.5
"""Largest range of the force axis relative to the range of the quasi-static forces; larger dynamic forces are cut off."""


def plot_force(solution: Solution, path: str | Path) -> None:
    """Draw force over travel in mm, with shaded stages and the value of the quasi-static peak.

    Dynamic forces are thin grey lines with a marker at their peak. Without a drive the figure shows the normal forces
    of the contact pairs over time.
    """
    with figure(path, SINGLE) as fig:
        ax = fig.add_subplot()
        x, label = abscissa(solution)
        ax.set_xlabel(label)
        if not solution.travel.shape[1]:
            _draw_pairs(ax, solution)
            return
        names = solution.layout.drive_names
        curve = solution.force_curve
        for k in range(solution.force.shape[1]):
            name = names[k] if k < len(names) else f"drive {k + 1}"
            _draw_curve(ax, curve, k, color=COLOURS[k % len(COLOURS)], label=shortened(name))
        ax.set_ylabel("moment (N m)" if solution.layout.turns() else "force (N)")
        ax.margins(x=0)
        if solution.force.shape[1] > 1:
            ax.legend(loc="best")
        summary = summary_with_stages(solution)
        units = drive_units(solution)
        stages: list[Artist] = [*shade_stages(ax, summary["stages"], float(x[-1]), units[1])]
        stages += _mark_events(ax, summary.get("events", []))
        _limit(ax, curve)
        stages += _mark_peaks(ax, summary, float(x[-1]), units)
        add_legend_across(fig, stages, "upper")


def plot_overlay(curves: Sequence[tuple[str, Solution]], path: str | Path) -> None:
    """Draw the force curves of a table in one figure, with names and quasi-static peaks in the legend.

    Dynamic forces are thin lines, cut off at the range of the quasi-static forces. Runs without a drive are not drawn.
    """
    with figure(path, WIDE) as fig:
        ax = fig.add_subplot()
        drawn = [(name, run) for name, run in curves if run.travel.shape[1]]
        for k, (name, run) in enumerate(drawn):
            colour, dashes = COLOURS[k % len(COLOURS)], DASHES[k // len(COLOURS) % len(DASHES)]
            summary = summary_with_stages(run)
            force, travel = summary["peak_force"], summary["peak_travel"]
            effort, way = drive_units(run)
            label = f"{name}: {rounded(force)} {effort} at {rounded(travel * 1e3)} {way}"
            curve = run.force_curve
            _draw_curve(ax, curve, 0, dynamic_colour=colour, clip=True, color=colour, linestyle=dashes, label=label)
            ax.plot(travel * 1e3, force, "o", color=colour, markersize=points(4.5), markeredgecolor="white", zorder=4)
        kinds = sorted({run.layout.turns() for _, run in drawn}) or [False]
        ax.set_xlabel(" or ".join("turn (mrad)" if turns else "travel (mm)" for turns in kinds))
        ax.set_ylabel(" or ".join("moment (N m)" if turns else "force (N)" for turns in kinds))
        ax.margins(x=0)
        if not drawn:
            _write_note(ax, "no curve: none of the runs has a drive")
        else:
            add_legend(fig, ax)


def _quasi_static(curve: ForceCurve, drive: int) -> tuple[Floats, Floats]:
    """Travel (mm) and quasi-static force (N) of a drive; NaN between paths, so that no line joins them."""
    return 1e3 * curve.travel[:, drive], np.where(curve.dynamic, np.nan, curve.force[:, drive])


def _range(curve: ForceCurve) -> tuple[float, float]:
    """Smallest and largest quasi-static force of all drives, N; of all forces if the whole run is dynamic."""
    force = curve.force[~curve.dynamic] if curve.has_quasi_static else curve.force
    return float(np.nanmin(force)), float(np.nanmax(force))


def _draw_curve(
    ax: Axes, curve: ForceCurve, drive: int, dynamic_colour: str = GREY, clip: bool = False, **style: Any
) -> None:
    """Draw the quasi-static force of one drive, and its dynamic force as a thin line.

    `clip` limits the dynamic force to the range of the quasi-static forces.
    """
    travel, force = _quasi_static(curve, drive)
    if not curve.has_quasi_static:
        ax.plot(travel, curve.force[:, drive], **style)
        return
    ax.plot(travel, force, **style)
    if curve.dynamic.any():
        edges = np.flatnonzero(np.diff(curve.dynamic.astype(int)))
        moving = curve.dynamic.copy()
        moving[edges], moving[edges + 1] = True, True  # the ends of the paths are included, so that both lines meet
        between = np.where(moving, curve.force[:, drive], np.nan)
        if clip:
            between = np.clip(between, *_range(curve))
        ax.plot(travel, between, color=dynamic_colour, linewidth=line_width(0.6), zorder=1.9)


def _limit(ax: Axes, curve: ForceCurve) -> None:
    """Set the limits of the force axis from the quasi-static forces, with room for dynamic ones (`_DYNAMIC_RANGE`)."""
    low, high = _range(curve)
    room = (_DYNAMIC_RANGE - 1.0) * max(high - low, 1e-300)
    low, high = max(float(np.nanmin(curve.force)), low - room), min(float(np.nanmax(curve.force)), high + room)
    margin = 0.05 * ((high - low) or 1.0)
    ax.set_ylim(low - margin, high + margin)


def _draw_pairs(ax: Axes, solution: Solution) -> None:
    """Draw contact forces over time, for a scene without a drive."""
    ax.set_ylabel("normal force of contact (N)")
    ax.margins(x=0)
    for k, name in enumerate(solution.layout.pair_names):
        if solution.pair_force[:, k].any():
            colour, dashes = COLOURS[k % len(COLOURS)], DASHES[k // len(COLOURS) % len(DASHES)]
            ax.plot(solution.time, solution.pair_force[:, k], dashes, color=colour, label=shortened(name))
    if ax.lines:
        ax.legend(loc="best")
    else:
        _write_note(ax, "no drive and no contact force")


def _write_note(ax: Axes, text: str) -> None:
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color=GREY)


def _mark_events(ax: Axes, events: Sequence[dict[str, Any]]) -> list[Line2D]:
    """Mark snaps and bifurcations on the curve; return the legend entries."""
    handles: list[Line2D] = []
    for marker, label in dict.fromkeys(EVENTS.values()):
        at = [event for event in events if EVENTS.get(event["kind"]) == (marker, label)]
        if not at:
            continue
        travel, force = [1e3 * event["travel"] for event in at], [event["force"] for event in at]
        style: dict[str, Any] = {"color": COLOURS[3], "marker": marker, "markersize": points(5), "linestyle": "none"}
        ax.plot(travel, force, zorder=5, clip_on=False, **style)
        for event in at:
            ends = [1e3 * event["travel"], 1e3 * event["end_travel"]], [event["force"], event["end_force"]]
            ax.plot(*ends, ":", color=COLOURS[3], linewidth=line_width(1.0))
        handles.append(Line2D([], [], label=label, **style))
    return handles


def _mark_peaks(ax: Axes, summary: dict[str, Any], last: float, units: tuple[str, str]) -> list[Line2D]:
    """Mark the quasi-static peak with its value, and the dynamic peak; return the legend entry of the dynamic peak."""
    force, at = summary["peak_force"], 1e3 * summary["peak_travel"]
    effort, way = units
    ax.plot(at, force, "o", color=COLOURS[1], markersize=points(5), zorder=4, clip_on=False)
    bottom, top = ax.get_ylim()
    ax.set_ylim(bottom, max(top, force) + 0.08 * (top - bottom))
    right = at > 0.6 * last
    ax.annotate(
        f"peak {rounded(force)} {effort} at {rounded(at)} {way}", (at, force), xytext=(-8 if right else 8, 3),
        textcoords="offset points", ha="right" if right else "left", va="bottom",
    )  # fmt: skip
    if summary.get("dynamic_peak_force") is None or summary.get("peak_kind") == "dynamic":
        return []
    dynamic, where = summary["dynamic_peak_force"], 1e3 * summary["dynamic_peak_travel"]
    style: dict[str, Any] = {"color": GREY, "marker": "o", "markersize": points(4), "linestyle": "none", "fillstyle": "none"}
    bottom, top = ax.get_ylim()
    if bottom <= dynamic <= top:
        ax.plot(where, dynamic, zorder=4, **style)
    return [Line2D([], [], label=f"dynamic {rounded(dynamic)} {effort} at {rounded(where)} {way}", **style)]
