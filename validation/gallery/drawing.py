"""Figures that many checks use: a computed curve with reference points, and convergence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from fsm.views.plots.style import COLOURS, GREY, SINGLE, figure, label_decades

__all__ = ["bars", "beside", "convergence"]

_FEW = 12
"""Points of a curve up to which they are shown."""

Line = tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray]


def beside(
    path: Path,
    ours: Mapping[str, Line],
    reference: Mapping[str, Line],
    x: str,
    y: str,
    *,
    title: str = "",
    log: bool = False,
    size: tuple[float, float] = SINGLE,
    bands: Mapping[str, tuple] | None = None,
    equal: bool = False,
) -> Path:
    """Computed curves as lines, and references as open circles of the same colour, in the given order.

    Several references of one curve have different colours and markers. With `equal`, both axes have the same scale.
    """
    several = len(ours) == 1 and len(reference) > 1
    colours = COLOURS[1:] if several else COLOURS if len(ours) > 1 else ("black",)
    markers = "os^vD" if several else "o" * len(reference)
    with figure(path, size) as fig:
        ax = fig.subplots()
        for colour, (name, line) in zip(COLOURS, ours.items(), strict=False):
            ax.plot(*line, color=colour, label=name, marker="." if len(line[0]) <= _FEW else "")
        for colour, marker, (name, line) in zip(colours, markers, reference.items(), strict=False):
            ax.plot(*line, marker, ms=5, mfc="white", mec=colour, label=name, zorder=3)
        for name, (at, low, high) in (bands or {}).items():
            ax.fill_between(at, low, high, color=GREY, alpha=0.25, lw=0, label=name)
        if log:
            ax.set_xscale("log")
            ax.set_yscale("log")
        ax.set(xlabel=x, ylabel=y)
        if equal:
            ax.set_aspect("equal")
        if title:
            ax.set_title(title, loc="left")
        if len(ax.get_legend_handles_labels()[0]) > 1:
            ax.legend()
    return path


def convergence(
    path: Path,
    counts: Sequence[float],
    errors: Mapping[str, Sequence[float]],
    order: float,
    x: str = "segments",
    y: str = "relative error",
    title: str = "",
) -> Path:
    """Errors against the number of elements, with the expected slope."""
    with figure(path) as fig:
        ax = fig.subplots()
        sizes = np.asarray(counts, dtype=float)
        for (name, row), marker in zip(errors.items(), "os^vDP<>" * 3, strict=False):
            ax.loglog(sizes, np.abs(row), marker + "-", ms=4, label=name)
        first = np.abs(np.array([row[0] for row in errors.values()])).max() * 1.6
        ax.loglog(sizes, first * (sizes / sizes[0]) ** -order, "--", color=GREY, label=f"order {order:g}")
        ax.set(xlabel=x, ylabel=y)
        ax.set_xticks(sizes, [f"{n:g}" for n in sizes])
        ax.minorticks_off()
        label_decades(ax.yaxis)
        if title:
            ax.set_title(title, loc="left")
        ax.legend()
    return path


def bars(
    path: Path,
    names: Sequence[str],
    ours: Sequence[float],
    reference: Sequence[float],
    y: str,
    title: str = "",
    band: float = 0.0,
    size: tuple[float, float] = SINGLE,
) -> Path:
    """Computed values beside reference values (NaN if there is none), one pair for each name; band: half width of the
    uncertainty of the reference."""
    with figure(path, size) as fig:
        ax = fig.subplots()
        at = np.arange(len(names))
        ax.bar(at - 0.18, ours, 0.36, color=COLOURS[0], label="fsm")
        ax.bar(at + 0.18, reference, 0.36, color=COLOURS[1], label="reference", yerr=band or None, capsize=3)
        ax.axhline(0.0, color="black", lw=0.6)
        ax.set_xticks(at, names)
        ax.set_xlim(-1.0, len(names))
        ax.margins(y=0.25)
        ax.set_ylabel(y)
        if title:
            ax.set_title(title, loc="left")
        ax.legend()
    return path
