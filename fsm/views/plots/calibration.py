"""Figures of calibrations: curves with data and bands, residuals, hysteresis loops, tests of forces with their fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fsm.results.film import Floats
from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.style import COLOURS, GREY, SINGLE, figure, label_decades

_MAX_COLUMNS = 3
"""Largest number of panels in a row of the figure."""
MAX_POINTS = 2000
"""Largest number of drawn points of a curve; more points would only enlarge the file."""


class CurvePlot(NamedTuple):
    """Fitted crease curve with its data.

    Attributes
    ----------
    panel, label : str
        Title of the panel (one per press time), and label of the curve in it (one per opening).
    loading, unloading : tuple of arrays, rad and N m
        Points (x, y), curve (x, y) and its band (low, high) of each branch; None for an absent unloading branch.
    gap_half_width : (n,) array or None, N m
        Half width of the band of loading minus unloading.
    level : -
        Confidence level of the bands.
    """

    panel: str
    label: str
    loading: tuple[Floats, ...]
    unloading: tuple[Floats, ...] | None
    gap_half_width: Floats | None
    level: float


class FitPlot(NamedTuple):
    """Fit of one quantity against another, in the units of the figure.

    Attributes
    ----------
    x, y : arrays
        Measured points.
    curves : sequence of (label, x, y, low, high)
        Fitted curves; low and high are None for a curve without band.
    x_label, y_label : str
    logarithmic : bool
        Whether the x axis is logarithmic.
    """

    x: Floats
    y: Floats
    curves: Sequence[tuple[str, Floats, Floats, Floats | None, Floats | None]]
    x_label: str
    y_label: str
    logarithmic: bool = False


def plot_curves(curves: Sequence[CurvePlot], path: str | Path) -> None:
    """Moment against angle: points, curves and bands; the unloading branch is dashed."""
    with figure(path, _size(curves)) as fig:
        factor, unit = _moment_unit(curves)
        for ax, curve, colour in _in_panels(fig, curves, f"moment ({unit})"):
            _draw_branch(ax, curve.loading, factor, colour, "-", curve.label)
            if curve.unloading is not None:
                _draw_branch(ax, curve.unloading, factor, colour, "--", None)
        title = f"points: measured; band: {100 * curves[0].level:g} % interval of the curve"
        title += "; dashed: unloading" if any(curve.unloading is not None for curve in curves) else ""
        _legend(fig, title)


def plot_residuals(curves: Sequence[CurvePlot], path: str | Path) -> None:
    """Residuals of the points; filled markers for loading, open markers for unloading."""
    with figure(path, _size(curves)) as fig:
        factor, unit = _moment_unit(curves)
        for ax, curve, colour in _in_panels(fig, curves, f"measured minus fitted moment ({unit})"):
            for branch, face, label in ((curve.loading, colour, curve.label), (curve.unloading, "none", None)):
                if branch is None:
                    continue
                angle, moment = _decimated(branch[0], branch[1])
                inside = (angle >= branch[2][0]) & (angle <= branch[2][-1])
                residual = moment[inside] - np.interp(angle[inside], branch[2], branch[3])
                style = {"markersize": points(3), "markeredgecolor": colour, "markerfacecolor": face, "label": label}
                ax.plot(np.degrees(angle[inside]), residual * factor, "o", linestyle="none", **style)
            ax.axhline(0.0, color=GREY, linewidth=line_width(0.7))
        unloaded = any(curve.unloading is not None for curve in curves)
        _legend(fig, "filled: loading; open: unloading" if unloaded else None)


def plot_loops(curves: Sequence[CurvePlot], path: str | Path) -> None:
    """Loading minus unloading moment; the area below each line is the energy that one cycle dissipates."""
    with figure(path, _size(curves)) as fig:
        loops = [curve for curve in curves if curve.unloading is not None]
        factor, unit = _moment_unit(curves)
        for ax, curve, colour in _in_panels(fig, loops, f"loading minus unloading ({unit})"):
            assert curve.unloading is not None and curve.gap_half_width is not None
            angle, gap = curve.loading[2], curve.loading[3] - curve.unloading[3]
            low, high = (gap - curve.gap_half_width) * factor, (gap + curve.gap_half_width) * factor
            ax.fill_between(np.degrees(angle), low, high, color=colour, alpha=0.2, linewidth=0)
            area = float(np.trapezoid(gap, angle))
            label = f"{curve.label}: {1e3 * area:.3g} mJ".removeprefix(": ")
            ax.plot(np.degrees(angle), gap * factor, color=colour, label=label)
            ax.axhline(0.0, color=GREY, linewidth=line_width(0.7))
            ax.legend(loc="best", title="dissipated in a cycle", title_fontsize=points(8))


def plot_fit(fit: FitPlot, path: str | Path) -> None:
    """Points, curves and bands above; residuals of the first curve below."""
    with figure(path, (SINGLE[0], 1.25 * SINGLE[1])) as fig:
        top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        x, y = _decimated(fit.x, fit.y)
        top.plot(x, y, "o", color=GREY, markersize=points(3), label="measured")
        for k, (label, at, values, low, high) in enumerate(fit.curves):
            top.plot(at, values, color=COLOURS[k], label=label, linestyle="-" if k == 0 else "--")
            if low is not None and high is not None:
                top.fill_between(at, low, high, color=COLOURS[k], alpha=0.2, linewidth=0)
        _, at, values, _, _ = fit.curves[0]
        bottom.plot(x, y - np.interp(x, at, values), "o", color=GREY, markersize=points(3))
        bottom.axhline(0.0, color=COLOURS[0], linewidth=line_width(0.9))
        if fit.logarithmic:
            bottom.set_xscale("log")
            label_decades(bottom.xaxis)
        top.set_ylabel(fit.y_label)
        unit = fit.y_label[fit.y_label.rfind("(") :] if fit.y_label.endswith(")") else ""
        bottom.set_ylabel(f"residual {unit}".rstrip())
        bottom.set_xlabel(fit.x_label)
        top.legend(loc="best")


def _size(curves: Sequence[CurvePlot]) -> tuple[float, float]:
    panels = len({curve.panel for curve in curves})
    columns, rows = min(panels, _MAX_COLUMNS), -(-panels // _MAX_COLUMNS)
    return (SINGLE[0], SINGLE[1] + 0.6) if panels == 1 else (1.0 + 3.0 * columns, 0.8 + 2.6 * rows)


def _in_panels(
    fig: Figure, curves: Sequence[CurvePlot], y_label: str
) -> Iterator[tuple[Axes, CurvePlot, str]]:
    """Axes, curve and colour of every curve; curves of equal label have the same colour."""
    panels = list(dict.fromkeys(curve.panel for curve in curves))
    labels = list(dict.fromkeys(curve.label for curve in curves))
    columns, rows = min(len(panels), _MAX_COLUMNS), -(-len(panels) // _MAX_COLUMNS)
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
    """Add one legend for all panels, unless there is neither a label nor a title."""
    handles = {h.get_label(): h for ax in fig.axes for h in ax.get_legend_handles_labels()[0]}
    handles.pop("", None)
    if handles or title:
        fig.legend(
            handles=list(handles.values()), loc="outside upper center", ncols=min(len(handles), 4) or 1, title=title,
            title_fontsize=points(8),
        )  # fmt: skip


def _draw_branch(
    ax: Axes, branch: tuple[Floats, ...], factor: float, colour: str, dashes: str, label: str | None
) -> None:
    angle, moment = _decimated(branch[0], branch[1])
    ax.plot(np.degrees(angle), moment * factor, ".", color=colour, markersize=points(3), alpha=0.5)
    at = np.degrees(branch[2])
    ax.fill_between(at, branch[4] * factor, branch[5] * factor, color=colour, alpha=0.2, linewidth=0)
    ax.plot(at, branch[3] * factor, dashes, color=colour, label=label)


def _moment_unit(curves: Sequence[CurvePlot]) -> tuple[float, str]:
    largest = max(float(np.abs(curve.loading[3]).max()) for curve in curves)
    return (1.0, "N m") if largest >= 1.0 else (1e3, "N mm")


def _decimated(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    step = -(-len(x) // MAX_POINTS)
    return x[::step], y[::step]


class TestPlot(NamedTuple):
    """Computed curve with its band, and the measured forces if there are any.

    Attributes
    ----------
    title : str
    travel, force, low, high : (n,) arrays, m and N
    measured : (n,) array or None, N
        Measured forces at the same travels.
    half_band : (n,) array or None, N
        Half width of the band of the measured forces.
    level : -
        Confidence level of the bands.
    """

    title: str
    travel: Floats
    force: Floats
    low: Floats
    high: Floats
    measured: Floats | None
    half_band: Floats | None
    level: float


def plot_tests(tests: Sequence[TestPlot], path: str | Path) -> None:
    """Draw one column per test, with the curves above and the residuals below."""
    residuals = any(test.measured is not None for test in tests)
    height = 1.35 * SINGLE[1] if residuals else SINGLE[1]
    with figure(path, (SINGLE[0] * len(tests), height)) as fig:
        grid = fig.subplots(1 + residuals, len(tests), squeeze=False, sharex="col", height_ratios=(3, 1)[: 1 + residuals])
        for column, test in zip(grid.T, tests, strict=True):
            x, top = 1e3 * np.asarray(test.travel), column[0]
            top.plot(x, test.force, color=COLOURS[0], label="model")
            band = f"{100 * test.level:g} % band of the model"
            top.fill_between(x, test.low, test.high, color=COLOURS[0], alpha=0.25, linewidth=0, label=band)
            if test.measured is not None:
                measured = np.asarray(test.measured)
                style = {"fmt": "o", "color": GREY, "markersize": points(3), "linewidth": line_width(0.8)}
                name = "test" if test.half_band is None else f"test with its {100 * test.level:g} % band"
                top.errorbar(x, measured, test.half_band, label=name, **style)
                column[1].errorbar(x, measured - test.force, test.half_band, **style)
                column[1].axhline(0.0, color=COLOURS[0], linewidth=line_width(0.9))
                column[1].set_ylabel("residual (N)")
            top.set_title(test.title)
            top.set_ylabel("force (N)")
            column[-1].set_xlabel("travel (mm)")
            top.legend(loc="best")
