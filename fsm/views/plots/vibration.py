"""Figures of a vibrating film: histories, spectrum, mode shapes, tension."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection, TriMesh
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.tri import Triangulation

from fsm.results.film import STATES, Film, Floats, Integers
from fsm.results.solution import Solution
from fsm.results.spectrum import spectrum
from fsm.text.shown_units import ShownUnit
from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.style import COLOURS, GREY, WIDE, add_legend_across, figure, figure_unit, label_decades, rounded

_LONG = 0.35
"""Height over width below which a film is long."""
_UNIFORM = 1e-3
"""Relative difference of stresses, below which they count as equal."""
_HATCHES = {1: "///", 2: "xxx"}
"""Hatching of wrinkled and slack elements, by `film.state`."""
_LIGHT = ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.35, 1.0, 256)))
"""Bright colours, on which black lines are visible."""


def _film(solution: Solution) -> Film:
    film = solution.layout.film
    if film is None:
        raise ValueError("the result is not of a film; give a result of the analysis \"vibrate\"")
    return film


def plot_history(solution: Solution, path: str | Path) -> None:
    """Draw the normal displacement of every probe over time on a common scale; the title gives frequency and decay rate."""
    film = _film(solution)
    names = film.probe_names
    unit = figure_unit("m", solution.samples.displacement[:, :, 2])
    moved = unit.factor * solution.samples.displacement[:, :, 2]
    time = solution.samples.time
    with figure(path, (WIDE[0], 0.6 + 1.5 * len(names))) as fig:
        axes = fig.subplots(len(names), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
        for k, (ax, name) in enumerate(zip(axes, names, strict=True)):
            ax.axhline(0, color=GREY, linewidth=line_width(0.6))
            ax.plot(time, moved[:, k], color=COLOURS[k % len(COLOURS)], linewidth=line_width(0.9))
            ax.set_ylabel(f"displacement ({unit.name})" if len(names) < 3 else f"({unit.name})")
            ax.margins(x=0, y=0.12)
            largest = f"{rounded(float(np.abs(moved[:, k]).max(initial=0.0)))} {unit.name}"
            top = f"{name}: normal displacement, largest {largest}" if moved.size else name
            ax.text(0.99, 0.99, top, transform=ax.transAxes, ha="right", va="top")
        axes[0].set_title(_frequency_title(solution))
        axes[-1].set_xlabel("time (s)")


def _frequency_title(solution: Solution) -> str:
    summary = solution.summary
    if summary.get("frequency_hz") is None:
        return ""
    text = f"center: {summary['frequency_hz']:.4g} Hz by fit"
    if summary.get("decay_rate") is not None:
        text += f", decay {summary['decay_rate']:.3g} 1/s"
    return f"{text}; {summary['frequency_fft_hz']:.4g} ± {0.5 * summary['frequency_resolution_hz']:.2g} Hz by FFT"


def plot_spectrum(solution: Solution, path: str | Path) -> None:
    """Draw the amplitude spectrum of the free motion of every probe; ticks at the bottom mark natural frequencies."""
    film = _film(solution)
    begin = solution.samples.time >= float(solution.summary.get("free_from", 0.0))
    time = solution.samples.time[begin]
    unit = figure_unit("m", solution.samples.displacement[begin, :, 2])
    with figure(path, WIDE) as fig:
        ax = fig.add_subplot()
        highest = float(np.abs(film.frequency).max(initial=1.0))
        if len(time) >= 8:
            for k, name in enumerate(film.probe_names):
                lines = spectrum(time, unit.factor * solution.samples.displacement[begin, k, 2])
                amplitude = np.maximum(lines.amplitude[1:], 1e-30)
                ax.semilogy(lines.frequency[1:], amplitude, label=name, linewidth=line_width(1.0))
            largest = max(float(line.get_ydata().max()) for line in ax.lines)
            ax.set_ylim(1e-5 * largest, 3.0 * largest)
            label_decades(ax.yaxis)
            highest = min(1.2 * highest, float(lines.frequency[-1]))
        for frequency in film.frequency:
            ax.axvline(frequency, ymin=0.0, ymax=0.04, color=GREY, linewidth=line_width(0.8))
        ax.plot([], [], color=GREY, linewidth=line_width(0.8), label="natural frequencies")
        ax.set_xlim(0.0, highest)
        ax.set_xlabel("frequency (Hz)")
        ax.set_ylabel(f"amplitude ({unit.name})")
        ax.set_title(_frequency_title(solution))
        ax.legend(loc="upper right")


def plot_modes(solution: Solution, path: str | Path) -> None:
    """Draw the normal motion of the first natural modes, seen from above and scaled to a largest value of 1.

    Where elements lie above each other, the element with the largest motion is visible.
    """
    film = _film(solution)
    unit = _size_unit(solution)
    corners = solution.shape[0][..., :2] * unit.factor
    beside = _ratio(corners) > _LONG
    chosen = range(min(9 if beside else 8, len(film.frequency)))
    columns = min(3 if beside else 2, max(len(chosen), 1))
    rows = max(1, -(-len(chosen) // columns))
    width = (WIDE[0] - 1.4) / columns
    with figure(path, (WIDE[0], points(0.55) + rows * (points(0.3) + width * _ratio(corners)))) as fig:
        axes = fig.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for ax in axes.ravel()[len(chosen) :]:
            ax.remove()
        drawn = None
        for k, ax in zip(chosen, axes.ravel(), strict=False):
            shape = film.mode_shape[k]
            normal = float(np.abs(shape[..., 2]).max()) > 0.1
            values = shape[..., 2] if normal else np.linalg.norm(shape, axis=-1)
            size = float(np.abs(values).max()) or 1.0
            order = np.argsort(np.abs(values).max(axis=1), kind="stable")
            drawn = _draw_smooth(ax, corners[order], values[order] / size)
            _frame(ax, corners, solution.layout.panel > 0)
            ax.set_title(f"{k + 1}: {film.frequency[k]:.4g} Hz" + ("" if normal else " (in plane)"))
            ax.tick_params(labelbottom=k + columns >= len(chosen))
        fig.supxlabel(f"x ({unit.name})", fontsize=points(9.0))
        fig.supylabel(f"y ({unit.name})", fontsize=points(9.0))
        if drawn is not None:
            between = "\n" if rows * _ratio(corners) < 1.0 else " "
            label = f"normal displacement{between}over the largest one (-)"
            fig.colorbar(drawn, ax=list(fig.axes), label=label, pad=0.02, aspect=30)


def plot_tension(solution: Solution, path: str | Path) -> None:
    """Draw both principal stresses of the tensioned film and the direction of the larger one.

    Wrinkled and slack elements are hatched.
    """
    film = _film(solution)
    order = _upwards(solution)
    size, force = _size_unit(solution), figure_unit("Pa", film.stress)
    corners = solution.shape[0][order, :, :2] * size.factor
    panel, stress, state = solution.layout.panel[order], film.stress[order] * force.factor, film.state[order]
    of_film, differ = panel == 0, np.ptp(stress, axis=1) > _UNIFORM * np.abs(stress).max(axis=1)
    beside = _ratio(corners) > _LONG
    height = WIDE[0] * (0.36 * _ratio(corners) if beside else 1.6 * _ratio(corners))
    with figure(path, (WIDE[0], points(1.3 if beside else 1.9) + height)) as fig:
        axes = fig.subplots(*((1, 2) if beside else (2, 1)), sharex=True, sharey=True)
        for column, (ax, name) in enumerate(zip(axes, ("larger", "smaller"), strict=True)):
            values = stress[:, column]
            inner = values[of_film] if of_film.any() else values
            low, high = (float(x) for x in np.percentile(inner, [2, 98]))
            if column == 1:
                low = min(low, 0.0)
            high = max(high, low + _UNIFORM * max(abs(low), abs(high)) + 1e-9)
            drawn = _draw_elements(ax, corners, values, (low, high))
            if column == 0:
                _directions(ax, corners[differ], film.direction[order][differ])
            for number, hatch in _HATCHES.items():
                here = state == number
                if here.any():
                    style = {"facecolors": "none", "edgecolors": "black", "linewidths": 0, "hatch": hatch}
                    ax.add_collection(PolyCollection(corners[here], **style))
            _frame(ax, corners, panel > 0)
            below, above = bool(values.min() < low), bool(values.max() > high)
            extend = "both" if below and above else "min" if below else "max" if above else "neither"
            location = "bottom" if beside else "right"
            label = f"{name} principal stress ({force.name})" if beside else f"stress ({force.name})"
            if not beside:
                ax.set_title(f"{name} principal stress")
            fig.colorbar(drawn, ax=ax, label=label, location=location, extend=extend, aspect=25 if beside else 12)
            if beside or column == 1:
                ax.set_xlabel(f"x ({size.name})")
            if not beside or column == 0:
                ax.set_ylabel(f"y ({size.name})")
        handles = _tension_handles(solution, film, bool(differ.any()))
        add_legend_across(fig, handles, "upper", columns=2)


def _tension_handles(solution: Solution, film: Film, directed: bool) -> list[Artist]:
    """Entries of the legend: direction, if any is drawn, share of wrinkled and of slack elements, patches."""
    of_film = solution.layout.panel == 0
    of_direction = Line2D([], [], color="black", linewidth=line_width(0.7), label="direction of the larger stress")
    equal = Line2D([], [], linestyle="none", label="stress equal in all directions")
    handles: list[Artist] = [of_direction if directed else equal]
    for number, hatch in _HATCHES.items():
        part = float(np.mean(film.state[of_film] == number)) if of_film.any() else 0.0
        if part:
            label = f"{STATES[number]}: {100 * part:.0f} % of the elements"
            handles.append(Patch(facecolor="none", edgecolor="black", linewidth=0, hatch=hatch, label=label))
    if len(handles) == 1:
        handles.append(Line2D([], [], linestyle="none", label="taut everywhere"))
    if (solution.layout.panel > 0).any():
        handles.append(Patch(facecolor="none", edgecolor="black", linewidth=line_width(0.9), label="patch"))
    return handles


def _size_unit(solution: Solution) -> ShownUnit:
    """Unit of the positions on a film."""
    return figure_unit("m", np.ptp(solution.shape[0][..., :2].reshape(-1, 2), axis=0))


def _ratio(corners: Floats) -> float:
    """Height over width of the corner points, limited to 0.1 to 1.5."""
    width, height = np.ptp(corners.reshape(-1, 2), axis=0)
    return float(np.clip(height / width, 0.1, 1.5)) if width > 0.0 else 1.0


def _draw_elements(ax: Axes, corners: Floats, values: Floats, limits: tuple[float, float]) -> PolyCollection:
    """Draw elements from above in the colour of their value."""
    drawn = PolyCollection(corners, array=values, cmap=_LIGHT, edgecolors="face", linewidths=0.2, antialiased=False)
    drawn.set_clim(*limits)
    ax.add_collection(drawn)
    return drawn


def _draw_smooth(ax: Axes, corners: Floats, values: Floats) -> TriMesh:
    """Draw elements from above; the colour between the values (n, 4) of their corners is interpolated."""
    triangles = (4 * np.arange(len(corners))[:, None] + [0, 1, 2, 0, 2, 3]).reshape(-1, 3)
    mesh = Triangulation(corners[..., 0].ravel(), corners[..., 1].ravel(), triangles)
    drawn = ax.tripcolor(mesh, values.ravel(), shading="gouraud", cmap="RdBu_r", vmin=-1.0, vmax=1.0, rasterized=True)
    return cast(TriMesh, drawn)


def _upwards(solution: Solution) -> Integers:
    """Numbers of the elements from the lowest to the highest one: seen from above, higher ones hide lower ones."""
    return np.argsort(solution.shape[0][..., 2].mean(axis=1), kind="stable")


def _frame(ax: Axes, corners: Floats, patch: np.ndarray) -> None:
    """Draw the outlines of patches, and set the limits of the axes."""
    if patch.any():
        ax.add_collection(PolyCollection(corners[patch], facecolors="none", edgecolors="black", linewidths=line_width(0.9)))
    points_of_film = corners.reshape(-1, 2)
    margin = 0.02 * float(np.ptp(points_of_film, axis=0).max())
    ax.set_xlim(points_of_film[:, 0].min() - margin, points_of_film[:, 0].max() + margin)
    ax.set_ylim(points_of_film[:, 1].min() - margin, points_of_film[:, 1].max() + margin)
    ax.set_aspect("equal")
    ax.locator_params(nbins=4)


def _directions(ax: Axes, corners: Floats, direction: Floats) -> None:
    """Draw a short line along the larger principal stress in every element."""
    middle = corners.mean(axis=1)
    size = 0.35 * np.sqrt(np.abs(_area(corners)))[:, None]
    ends = np.stack([middle - size * direction[:, :2], middle + size * direction[:, :2]], axis=1)
    ax.add_collection(LineCollection(list(ends), colors="black", linewidths=line_width(0.5)))


def _area(corners: Floats) -> Floats:
    x, y = corners[..., 0], corners[..., 1]
    return 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
