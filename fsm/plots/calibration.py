"""Calibrated curves with their data and bands, residuals, and loops."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from fsm.plots.style import COLOURS, GREY, SINGLE, WIDE, figure
from fsm.results.solution import Floats

__all__ = ["CurvePlot", "FitPlot", "plot_curves", "plot_fit", "plot_loops", "plot_residuals"]

MOST_POINTS = 2000
"""Points drawn of a curve; a million make a figure of many megabytes that shows no more."""


class CurvePlot(NamedTuple):
    """A curve with what it was fitted to.

    Attributes
    ----------
    name : str
    loading, unloading : points (x, y), curve (x, y), its band (low, high); rad and N m. None: no such way
    level : of the band
    """

    name: str
    loading: tuple[Floats, ...]
    unloading: tuple[Floats, ...] | None
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
    with figure(path, WIDE if len(curves) > 2 else SINGLE) as fig:
        ax = fig.add_subplot()
        factor, unit = _moment_unit(curves)
        for k, curve in enumerate(curves):
            colour = COLOURS[k % len(COLOURS)]
            _draw_way(ax, curve.loading, factor, colour, "-", curve.name)
            if curve.unloading is not None:
                _draw_way(ax, curve.unloading, factor, colour, "--", None)
        _label(ax, f"moment ({unit})")
        title = f"band: {100 * curves[0].level:g} % interval of the curve"
        title += "; dashed: unloading" if any(curve.unloading is not None for curve in curves) else ""
        fig.legend(loc="outside upper center", ncols=2 if len(curves) > 1 else 1, title=title, title_fontsize=8)


def plot_residuals(curves: Sequence[CurvePlot], path: str | Path) -> None:
    """What points are off their curve by; filled on the way up, open on the way back."""
    with figure(path, SINGLE) as fig:
        ax = fig.add_subplot()
        factor, unit = _moment_unit(curves)
        for k, curve in enumerate(curves):
            for way, face in ((curve.loading, COLOURS[k % len(COLOURS)]), (curve.unloading, "none")):
                if way is None:
                    continue
                angle, moment = _thinned(way[0], way[1])
                inside = (angle >= way[2][0]) & (angle <= way[2][-1])
                off = moment[inside] - np.interp(angle[inside], way[2], way[3])
                style = {"markersize": 3, "markeredgecolor": COLOURS[k % len(COLOURS)], "markerfacecolor": face}
                ax.plot(np.degrees(angle[inside]), off * factor, "o", linestyle="none", **style)
        ax.axhline(0.0, color=GREY, linewidth=0.7)
        _label(ax, f"measured less fitted moment ({unit})")


def plot_loops(curves: Sequence[CurvePlot], path: str | Path) -> None:
    """Loops, filled, each with the energy that a cycle dissipates."""
    with figure(path, SINGLE) as fig:
        ax = fig.add_subplot()
        factor, unit = _moment_unit(curves)
        for k, curve in enumerate(curves):
            if curve.unloading is None:
                continue
            colour = COLOURS[k % len(COLOURS)]
            angle, up, down = curve.loading[2], curve.loading[3], curve.unloading[3]
            area = float(np.trapezoid(up - down, angle))
            ax.fill_between(np.degrees(angle), down * factor, up * factor, color=colour, alpha=0.25, linewidth=0)
            ax.plot(np.degrees(angle), up * factor, color=colour, label=f"{curve.name}: {1e3 * area:.3g} mJ")
            ax.plot(np.degrees(angle), down * factor, "--", color=colour)
        _label(ax, f"moment ({unit})")
        ax.legend(loc="upper left", title="dissipated in a cycle", title_fontsize=8)


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


def _label(ax: Axes, moment: str) -> None:
    ax.set_xlabel("opening angle (deg)")
    ax.set_ylabel(moment)
    ax.margins(x=0.02)
