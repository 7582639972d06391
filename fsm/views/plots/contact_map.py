"""Contact map: normal force and contact area over the travel, in a row for every contact pair.

A sheet that touches itself has a row for every facet.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import PowerNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fsm.results.film import Floats
from fsm.results.quantities import CONTACT_THRESHOLD, contact_rows
from fsm.results.solution import Solution
from fsm.views.plots import style as look
from fsm.views.plots.drawing import line_width, points

COLOUR_MAP = "viridis_r"
HALF_HEIGHT, MIN_HALF_HEIGHT = 0.4, 0.07
"""Half height of the band for the largest contact area, and for a very small area, in rows."""
MAX_NAMED_ROWS = 40
"""Largest number of rows with names; if there are more rows, only every second, third, ... is named."""


def plot_contact_map(solution: Solution, path: str | Path) -> None:
    """Draw a row for every pair that ever touches (see `contact_rows`), over the travel, or over time without a drive.

    The colour follows the square root of the normal force. The height of the band is the contact area over the largest
    area of any pair. Stages are shaded, and snaps and bifurcations are marked, as in the figure of the force.
    """
    names, force, area = contact_rows(solution)
    height = float(np.clip(1.35 + 0.26 * len(names), 2.0, 9.0))
    with look.figure(path, (look.WIDE[0], height), look.Grid()) as fig:
        (ax,) = fig.axes
        x, label = look.abscissa(solution)
        ax.set_xlabel(label)
        _name_rows(ax, names)
        # the drive moves backwards, so a record may have the travel of an earlier record
        turns = bool((np.diff(x) < 0.0).any())
        if turns:
            x = 1.0 * solution.time
            ax.set_xlabel("time (s)")
        ax.set_xlim(x[0], x[-1] if x[-1] > x[0] else x[0] + 1.0)
        handles: list[Artist] = []
        if solution.travel.shape[1] and not turns:
            summary = look.summary_with_stages(solution)
            handles += look.shade_stages(ax, summary["stages"], float(x[-1]), look.drive_units(solution)[1])
            handles += _mark_events(ax, summary.get("events", []), look.drive_units(solution)[1].factor)
        if names:
            unit = look.figure_unit("N", force)
            bands = _draw_bands(ax, x, unit.factor * force, area)
            fig.colorbar(bands, ax=ax, pad=0.01, aspect=16, label=f"normal force ({unit.name})")
            handles += _area_note(area)
        else:
            ax.text(0.5, 0.5, "nothing touches", transform=ax.transAxes, ha="center", va="center", color=look.GREY)
        look.add_legend_across(fig, handles, "upper", columns=4 if len(handles) <= 4 else 3)


def _name_rows(ax: Axes, names: Sequence[str]) -> None:
    """Name the rows, with the first pair on top."""
    every = max(1, -(-len(names) // MAX_NAMED_ROWS))
    rows = range(0, len(names), every)
    ax.set_yticks(list(rows), [look.shortened(names[row]) for row in rows])
    ax.set_ylim(max(len(names), 1) - 0.5, -0.5)
    ax.tick_params(axis="y", length=0)
    for row in range(len(names)):
        ax.axhline(row, color=look.GREY, linewidth=line_width(0.3), alpha=0.5, zorder=1)


def _draw_bands(ax: Axes, x: Floats, force: Floats, area: Floats) -> PolyCollection:
    """Draw a rectangle for each pair in contact in a record; the rectangle extends halfway to the neighbouring records."""
    largest = np.nanmax(area, initial=0.0)
    known = np.isfinite(area) & (largest > 0.0)
    height = MIN_HALF_HEIGHT + (HALF_HEIGHT - MIN_HALF_HEIGHT) * area / (largest or 1.0)
    half = np.where(known, height, HALF_HEIGHT)
    edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    record, row = np.nonzero(force > CONTACT_THRESHOLD * force.max())
    left, right, half_height = edges[record], edges[record + 1], half[record, row]
    low, high = row - half_height, row + half_height
    corners = np.stack([left, low, right, low, right, high, left, high], axis=1).reshape(-1, 4, 2)
    bands = PolyCollection(list(corners), zorder=2)
    bands.set(array=force[record, row], cmap=COLOUR_MAP, norm=PowerNorm(0.5, 0.0, float(force.max())))
    bands.set(edgecolor="face", linewidth=line_width(0.2))  # this closes gaps between neighbouring rectangles
    ax.add_collection(bands, autolim=False)
    return bands


def _area_note(area: Floats) -> list[Patch]:
    """Legend entry for the height of the bands, if areas are known."""
    largest = float(np.nanmax(area, initial=0.0))
    if not largest > 0.0:
        return []
    return [Patch(facecolor="black", label=f"full height: contact area {look.rounded(largest * 1e6)} mm²")]


def _mark_events(ax: Axes, events: Sequence[dict[str, Any]], factor: float) -> list[Line2D]:
    """Mark snaps and bifurcations by lines across all rows with markers on top; return the legend entries.

    `factor` converts travels to the unit of the axis.
    """
    handles: dict[str, Line2D] = {}
    for event in events:
        if event["kind"] not in look.EVENTS:
            continue
        marker, label = look.EVENTS[event["kind"]]
        style: dict[str, Any] = {"color": look.COLOURS[3], "marker": marker, "markersize": points(5), "linestyle": "none"}
        at = factor * event["travel"]
        ax.axvline(at, color=look.COLOURS[3], linestyle=":", linewidth=line_width(1.0), zorder=3)
        ax.plot([at], [1.0], transform=ax.get_xaxis_transform(), zorder=5, clip_on=False, **style)
        handles.setdefault(label, Line2D([], [], label=label, **style))
    return list(handles.values())
