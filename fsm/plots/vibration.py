"""Figures of a vibrating film: histories, spectrum, mode shapes, tension."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from fsm.plots.style import COLOURS, GREY, WIDE, figure, label_decades, rounded
from fsm.results.film import STATES, Film
from fsm.results.solution import Floats, Solution
from fsm.results.spectrum import spectrum

__all__ = ["plot_history", "plot_modes", "plot_spectrum", "plot_tension"]


def _film(solution: Solution) -> Film:
    film = solution.layout.film
    if film is None:
        raise ValueError("the result is not of a film")
    return film


def plot_history(solution: Solution, path: str | Path) -> None:
    """Draw the normal displacement of every probe over time on a common scale; the title gives frequency and decay rate."""
    film = _film(solution)
    names = film.probe_names
    moved = solution.samples.displacement[:, :, 2] * 1e3
    time = solution.samples.time
    with figure(path, (WIDE[0], 0.6 + 1.5 * len(names))) as fig:
        axes = fig.subplots(len(names), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
        for k, (ax, name) in enumerate(zip(axes, names, strict=True)):
            ax.axhline(0, color=GREY, linewidth=0.6)
            ax.plot(time, moved[:, k], color=COLOURS[k % len(COLOURS)], linewidth=0.9)
            ax.set_ylabel(f"{name} (mm)")
            ax.margins(x=0)
            if moved.size:
                top = float(np.abs(moved[:, k]).max())
                ax.text(0.99, 0.95, f"largest {rounded(top)} mm", transform=ax.transAxes, ha="right", va="top")
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
    with figure(path, WIDE) as fig:
        ax = fig.add_subplot()
        highest = float(np.abs(film.frequency).max(initial=1.0))
        if len(time) >= 8:
            for k, name in enumerate(film.probe_names):
                lines = spectrum(time, solution.samples.displacement[begin, k, 2] * 1e3)
                ax.semilogy(lines.frequency[1:], np.maximum(lines.amplitude[1:], 1e-30), label=name, linewidth=1.0)
            largest = max(float(line.get_ydata().max()) for line in ax.lines)
            ax.set_ylim(1e-5 * largest, 3.0 * largest)
            label_decades(ax.yaxis)
            highest = min(1.2 * highest, float(lines.frequency[-1]))
        for frequency in film.frequency:
            ax.axvline(frequency, ymin=0.0, ymax=0.04, color=GREY, linewidth=0.8)
        ax.plot([], [], color=GREY, linewidth=0.8, label="natural frequencies")
        ax.set_xlim(0.0, highest)
        ax.set_xlabel("frequency (Hz)")
        ax.set_ylabel("amplitude (mm)")
        ax.set_title(_frequency_title(solution))
        ax.legend(loc="upper right")


def plot_modes(solution: Solution, path: str | Path, count: int = 9) -> None:
    """Draw the normal motion of the first natural modes, seen from above and scaled to a largest value of 1."""
    film = _film(solution)
    chosen = range(min(count, len(film.frequency)))
    columns = 3
    rows = max(1, -(-len(chosen) // columns))
    corners = solution.shape[0][..., :2] * 1e3
    with figure(path, (WIDE[0], 0.3 + rows * (0.3 + 2.1 * _ratio(corners)))) as fig:
        for k in chosen:
            ax = fig.add_subplot(rows, columns, k + 1)
            shape = film.mode_shape[k]
            normal = float(np.abs(shape[..., 2]).max()) > 0.1
            values = shape[..., 2].mean(axis=1) if normal else np.linalg.norm(shape, axis=-1).mean(axis=1)
            size = float(np.abs(values).max()) or 1.0
            _map(ax, corners, values / size, "RdBu_r", (-1.0, 1.0), solution)
            ax.set_title(f"{k + 1}: {film.frequency[k]:.4g} Hz" + ("" if normal else " (in plane)"))


def plot_tension(solution: Solution, path: str | Path) -> None:
    """Draw both principal stresses of the tensioned film and the direction of the larger one.

    Wrinkled and slack elements are hatched.
    """
    film = _film(solution)
    corners = solution.shape[0][..., :2] * 1e3
    of_film = solution.layout.panel == 0
    with figure(path, (WIDE[0], 1.2 + 2.5 * _ratio(corners))) as fig:
        axes = fig.subplots(1, 2)
        for column, (ax, name) in enumerate(zip(axes, ("larger", "smaller"), strict=True)):
            values = film.stress[:, column] * 1e-6
            inner = values[of_film] if of_film.any() else values
            low, high = (float(x) for x in np.percentile(inner, [2, 98]))
            if column == 1:
                low = min(low, 0.0)
            drawn = _map(ax, corners, values, "viridis", (low, max(high, low + 1e-9)), solution)
            if column == 0:
                _directions(ax, corners, film.direction)
            for number, hatch in ((1, "//"), (2, "xx")):
                here = film.state == number
                if here.any():
                    ax.add_collection(
                        PolyCollection(corners[here], facecolors="none", edgecolors="white", linewidths=0, hatch=hatch)
                    )
            fig.colorbar(drawn, ax=ax, label="MPa", shrink=0.85)
            ax.set_title(f"{name} principal stress")
        share = [float(np.mean(film.state[of_film] == number)) for number in (1, 2)] if of_film.any() else [0.0, 0.0]
        hatched = [f"{100 * part:.0f} % {STATES[number]}" for number, part in zip((1, 2), share, strict=True) if part]
        fig.suptitle("hatched: " + ", ".join(hatched) + " (of the elements)" if hatched else "taut everywhere", fontsize=9)


def _ratio(corners: Floats) -> float:
    """Height over width of the corner points, limited to 0.25 to 1.5."""
    width, height = np.ptp(corners.reshape(-1, 2), axis=0)
    return float(np.clip(height / width, 0.25, 1.5)) if width > 0.0 else 1.0


def _map(
    ax: Axes, corners: Floats, values: Floats, colours: str, limits: tuple[float, float], solution: Solution
) -> PolyCollection:
    """Draw elements from above, coloured by their value, with the outlines of patches in black."""
    drawn = PolyCollection(corners, array=values, cmap=colours, edgecolors="face", linewidths=0.2, antialiased=False)
    drawn.set_clim(*limits)
    ax.add_collection(drawn)
    patch = solution.layout.panel > 0
    if patch.any():
        ax.add_collection(PolyCollection(corners[patch], facecolors="none", edgecolors="black", linewidths=0.7))
    points = corners.reshape(-1, 2)
    margin = 0.03 * float(np.ptp(points, axis=0).max())
    ax.set_xlim(points[:, 0].min() - margin, points[:, 0].max() + margin)
    ax.set_ylim(points[:, 1].min() - margin, points[:, 1].max() + margin)
    ax.set_aspect("equal")
    ax.set_xticks([])
    ax.set_yticks([])
    return drawn


def _directions(ax: Axes, corners: Floats, direction: Floats) -> None:
    """Draw a short line along the larger principal stress in every element."""
    middle = corners.mean(axis=1)
    size = 0.35 * np.sqrt(np.abs(_area(corners)))[:, None]
    ends = np.stack([middle - size * direction[:, :2], middle + size * direction[:, :2]], axis=1)
    for line in ends:
        ax.plot(line[:, 0], line[:, 1], color="white", linewidth=0.5)


def _area(corners: Floats) -> Floats:
    x, y = corners[..., 0], corners[..., 1]
    return 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
