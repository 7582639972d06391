"""Calibrated curves with their data and bands, residuals, and loops."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fsm.plots.style import COLOURS, GREY, SINGLE, figure
from fsm.results.solution import Floats

__all__ = ["CurvePlot", "FitPlot", "plot_curves", "plot_fit", "plot_loops", "plot_residuals"]

_ACROSS = 3
"""Panels side by side."""
MOST_POINTS = 2000
"""Points drawn of a curve; a million make a figure of many megabytes that shows no more."""


class CurvePlot(NamedTuple):
    """A curve with what it was fitted to.

    Attributes
    ----------
    panel, label : str
        Curves of one panel are drawn together: a panel a press time, a label an opening.
    loading, unloading : points (x, y), curve (x, y), its band (low, high); rad and N m. None: no such way
    gap_reach : half the band of what unloading lies below loading by, N m
    level : of the bands
    """

    panel: str
    label: str
    loading: tuple[Floats, ...]
    unloading: tuple[Floats, ...] | None
    gap_reach: Floats | None
    level: float


class FitPlot(NamedTuple):
    """A fit of one quantity against another, in the units that are drawn.

    Attributes
    ----------
    x, y : points
    curves : (label, x, y, low, high), low and high None for a curve without a band
    x_label, y_label : str
    logarithmic : whether x is drawn so
    """

    x: Floats
    y: Floats
    curves: Sequence[tuple[str, Floats, Floats, Floats | None, Floats | None]]
    x_label: str
    y_label: str
    logarithmic: bool = False


def plot_curves(curves: Sequence[CurvePlot], path: str | Path) -> None:
    """Moment against angle: points, curves, bands; the way back dashed."""
    with figure(path, _size(curves)) as fig:
        factor, unit = _moment_unit(curves)
        for ax, curve, colour in _in_panels(fig, curves, f"moment ({unit})"):
            _draw_way(ax, curve.loading, factor, colour, "-", curve.label)
            if curve.unloading is not None:
                _draw_way(ax, curve.unloading, factor, colour, "--", None)
        title = f"band: {100 * curves[0].level:g} % interval of the curve"
        title += "; dashed: unloading" if any(curve.unloading is not None for curve in curves) else ""
        _legend(fig, title)


def plot_residuals(curves: Sequence[CurvePlot], path: str | Path) -> None:
    """What points are off their curve by; filled on the way up, open on the way back."""
    with figure(path, _size(curves)) as fig:
        factor, unit = _moment_unit(curves)
        for ax, curve, colour in _in_panels(fig, curves, f"measured less fitted moment ({unit})"):
            for way, face, label in ((curve.loading, colour, curve.label), (curve.unloading, "none", None)):
                if way is None:
                    continue
                angle, moment = _thinned(way[0], way[1])
                inside = (angle >= way[2][0]) & (angle <= way[2][-1])
                off = moment[inside] - np.interp(angle[inside], way[2], way[3])
                style = {"markersize": 3, "markeredgecolor": colour, "markerfacecolor": face, "label": label}
                ax.plot(np.degrees(angle[inside]), off * factor, "o", linestyle="none", **style)
            ax.axhline(0.0, color=GREY, linewidth=0.7)
        back = any(curve.unloading is not None for curve in curves)
        _legend(fig, "filled: loading; open: unloading" if back else None)


def plot_loops(curves: Sequence[CurvePlot], path: str | Path) -> None:
    """What unloading lies below loading by: the area below each line is what a cycle dissipates."""
    with figure(path, _size(curves)) as fig:
        looped = [curve for curve in curves if curve.unloading is not None]
        factor, unit = _moment_unit(curves)
        for ax, curve, colour in _in_panels(fig, looped, f"loading less unloading ({unit})"):
            assert curve.unloading is not None and curve.gap_reach is not None
            angle, gap = curve.loading[2], curve.loading[3] - curve.unloading[3]
            low, high = (gap - curve.gap_reach) * factor, (gap + curve.gap_reach) * factor
            ax.fill_between(np.degrees(angle), low, high, color=colour, alpha=0.2, linewidth=0)
            area = float(np.trapezoid(gap, angle))
            ax.plot(np.degrees(angle), gap * factor, color=colour, label=f"{curve.label}: {1e3 * area:.3g} mJ")
            ax.axhline(0.0, color=GREY, linewidth=0.7)
            ax.legend(loc="best", title="dissipated in a cycle", title_fontsize=8)


def plot_fit(fit: FitPlot, path: str | Path) -> None:
    """Points, curves and bands above, what points are off the first curve by below."""
    with figure(path, (SINGLE[0], 1.25 * SINGLE[1])) as fig:
        top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        x, y = _thinned(fit.x, fit.y)
        top.plot(x, y, "o", color=GREY, markersize=3, label="measured")
        for k, (label, at, values, low, high) in enumerate(fit.curves):
            top.plot(at, values, color=COLOURS[k], label=label, linestyle="-" if k == 0 else "--")
            if low is not None and high is not None:
                top.fill_between(at, low, high, color=COLOURS[k], alpha=0.2, linewidth=0)
        _, at, values, _, _ = fit.curves[0]
        bottom.plot(x, y - np.interp(x, at, values), "o", color=GREY, markersize=3)
        bottom.axhline(0.0, color=COLOURS[0], linewidth=0.9)
        if fit.logarithmic:
            bottom.set_xscale("log")
        top.set_ylabel(fit.y_label)
        bottom.set_ylabel("off by")
        bottom.set_xlabel(fit.x_label)
        top.legend(loc="best")


def _size(curves: Sequence[CurvePlot]) -> tuple[float, float]:
    panels = len({curve.panel for curve in curves})
    columns, rows = min(panels, _ACROSS), -(-panels // _ACROSS)
    return (SINGLE[0], SINGLE[1] + 0.6) if panels == 1 else (1.0 + 3.0 * columns, 0.8 + 2.6 * rows)


def _in_panels(
    fig: Figure, curves: Sequence[CurvePlot], y_label: str
) -> Iterator[tuple[Axes, CurvePlot, str]]:
    """Every curve with its panel and its colour, which goes with its label."""
    panels = list(dict.fromkeys(curve.panel for curve in curves))
    labels = list(dict.fromkeys(curve.label for curve in curves))
    columns, rows = min(len(panels), _ACROSS), -(-len(panels) // _ACROSS)
    axes = fig.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for ax in axes.ravel()[len(panels) :]:
        ax.remove()
    for k, panel in enumerate(panels):
        ax = axes.ravel()[k]
        ax.set_title(panel)
        ax.margins(x=0.02)
        if k + columns >= len(panels):
            ax.set_xlabel("opening angle (deg)")
            ax.tick_params(labelbottom=True)
        if k % columns == 0:
            ax.set_ylabel(y_label)
        for curve in curves:
            if curve.panel == panel:
                yield ax, curve, COLOURS[labels.index(curve.label) % len(COLOURS)]


def _legend(fig: Figure, title: str | None) -> None:
    """One legend for all panels; none for a single curve without a label."""
    handles = {h.get_label(): h for ax in fig.axes for h in ax.get_legend_handles_labels()[0]}
    handles.pop("", None)
    if handles or title:
        fig.legend(
            handles=list(handles.values()), loc="outside upper center", ncols=min(len(handles), 4) or 1, title=title,
            title_fontsize=8,
        )  # fmt: skip


def _draw_way(
    ax: Axes, way: tuple[Floats, ...], factor: float, colour: str, dashes: str, label: str | None
) -> None:
    angle, moment = _thinned(way[0], way[1])
    ax.plot(np.degrees(angle), moment * factor, ".", color=colour, markersize=3, alpha=0.5)
    at = np.degrees(way[2])
    ax.fill_between(at, way[4] * factor, way[5] * factor, color=colour, alpha=0.2, linewidth=0)
    ax.plot(at, way[3] * factor, dashes, color=colour, label=label)


def _moment_unit(curves: Sequence[CurvePlot]) -> tuple[float, str]:
    largest = max(float(np.abs(curve.loading[3]).max()) for curve in curves)
    return (1.0, "N m") if largest >= 1.0 else (1e3, "N mm")


def _thinned(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    step = -(-len(x) // MOST_POINTS)
    return x[::step], y[::step]
