"""Picture of the pattern of a sheet: creases coloured by assignment, numbers, supports and driven vertices."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from fsm.atomic_write import atomic_write
from fsm.errors import CaseError
from fsm.scene.case import Case
from fsm.scene.patterns.of_sheet import pattern_of
from fsm.scene.patterns.pattern import ASSIGNMENTS, Pattern
from fsm.scene.patterns.places import place_of
from fsm.scene.sheet import Sheet

__all__ = ["draw_sheet"]

_STYLES: dict[str, tuple[str, str, float]] = {
    "B": ("#000000", "-", 1.2), "M": ("#D55E00", "-", 1.4), "V": ("#0072B2", "--", 1.4), "F": ("#999999", "-", 0.6),
    "U": ("#CC79A7", "-", 1.2), "C": ("#009E73", "-", 1.2), "J": ("#999999", ":", 1.0),
}  # fmt: skip
"""Colour, dashes and width of each letter; colours of Okabe and Ito (2008)."""
_NUMBERED = 130
"""Largest number of vertices and facets with numbers in the picture."""


def draw_sheet(case: Case, path: str | Path) -> None:
    """Draw the flat pattern of a sheet, if it has one, and its start in space.

    Parameters
    ----------
    case : Case
        Case with `sheet`.
    path : name of a PNG file

    Raises
    ------
    CaseError
        The path does not name a PNG file, or the pattern is faulty.
    """
    path = Path(path)
    if path.suffix.lower() != ".png":
        raise CaseError(f"{path}: is not the name of a PNG; the preview of a sheet is a picture, give --out FILE.png")
    assert case.sheet is not None
    pattern = pattern_of(case.sheet)
    figure = Figure(figsize=(10.0, 5.2), dpi=150)
    FigureCanvasAgg(figure)
    if pattern.flat is not None:
        _draw_flat(figure.add_subplot(1, 2, 1), pattern, pattern.flat * 1e3, _marks(case, case.sheet, pattern))
    columns = 1 if pattern.flat is None else 2
    _draw_space(figure.add_subplot(1, columns, columns, projection="3d"), pattern)
    letters = [letter for letter in ASSIGNMENTS if letter in pattern.assignment]
    styles = [(ASSIGNMENTS[letter], *_STYLES[letter]) for letter in letters]
    handles = [Line2D([], [], color=colour, ls=dashes, lw=width, label=name) for name, colour, dashes, width in styles]
    if pattern.flat is not None:
        handles += [Line2D([], [], color="#000000", marker="^", ls="", label="support")] if case.sheet.support else []
        handles += [Line2D([], [], color="#E69F00", marker="o", ls="", label="driven")] if case.drive else []
    figure.legend(handles=handles, loc="lower center", ncols=len(handles), fontsize=8, frameon=False)
    with atomic_write(path) as part:
        figure.savefig(part, format="png")


def _marks(case: Case, sheet: Sheet, pattern: Pattern) -> list[tuple[np.ndarray, str, str]]:
    """Points (n, 2) of the flat pattern with marker and colour: supports and driven places, m."""
    places = [(support.at, "^", "#000000") for support in sheet.support]
    for drive in case.drive:
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        places += [(at, "o", "#E69F00")] if at is not None else []
    assert pattern.flat is not None
    found = []
    for at, marker, colour in places:
        try:
            place = place_of(pattern, at)
        except ValueError:
            continue  # `fsm check` reports it
        points = pattern.flat[list(place.vertices)]
        if place.facet is not None:
            points = pattern.flat[list(pattern.faces[place.facet])].mean(axis=0)[None]
        found.append((points, marker, colour))
    return found


def _draw_flat(ax: Any, pattern: Pattern, flat: np.ndarray, marks: list[tuple[np.ndarray, str, str]]) -> None:
    for letter, (colour, dashes, width) in _STYLES.items():
        chosen = [k for k, own in enumerate(pattern.assignment) if own == letter]
        lines = list(flat[pattern.edges[chosen]])
        ax.add_collection(LineCollection(lines, colors=colour, linestyles=dashes, linewidths=width))
    for points, marker, colour in marks:
        ax.plot(*(1e3 * points.T), marker, color=colour, markersize=5)
    if max(len(flat), len(pattern.faces)) <= _NUMBERED:
        for number, place in enumerate(flat, 1):
            ax.annotate(str(number), place, xytext=(2, 2), textcoords="offset points", fontsize=6)
        for number, face in enumerate(pattern.faces, 1):
            ax.text(*flat[list(face)].mean(axis=0), str(number), fontsize=6, color="#666666", ha="center", va="center")
    ax.set(aspect="equal", xlabel="x (mm)", ylabel="y (mm)", title="flat pattern; numbers of vertices, of facets in grey")
    ax.title.set_fontsize(9)
    ax.autoscale_view()


def _draw_space(ax: Any, pattern: Pattern) -> None:
    points = 1e3 * pattern.vertices
    ax.add_collection3d(Poly3DCollection([points[list(face)] for face in pattern.faces], facecolors="#F4F1E8", alpha=0.7))
    for letter, (colour, dashes, width) in _STYLES.items():
        chosen = [k for k, own in enumerate(pattern.assignment) if own == letter]
        if chosen:
            lines = list(points[pattern.edges[chosen]])
            ax.add_collection3d(Line3DCollection(lines, colors=colour, linestyles=dashes, linewidths=width))
    low, high = points.min(axis=0), points.max(axis=0)
    sides = np.maximum(high - low, 0.05 * float((high - low).max()))
    middle = 0.5 * (low + high)
    for axis, centre, side in zip("xyz", middle, sides, strict=True):
        getattr(ax, f"set_{axis}lim")(centre - 0.5 * side, centre + 0.5 * side)
    ax.set_box_aspect(sides)
    ax.set(xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)", title="start")
    ax.title.set_fontsize(9)
    ax.tick_params(labelsize=6)
