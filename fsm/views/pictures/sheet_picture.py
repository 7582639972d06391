"""Pictures of a sheet: its pattern with creases by assignment, numbers and places, and the mesh of flexible facets."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from fsm.builders.patterns.cuts import sides_of_cuts
from fsm.builders.patterns.foldability import bad_lines, bad_vertices
from fsm.builders.patterns.mesh_places import mesh_place
from fsm.builders.patterns.of_sheet import Place, flexible_mesh, pattern_of, place_of
from fsm.case.models.case import Case
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.pattern import ASSIGNMENTS, Pattern, PatternFault
from fsm.case.plan.step_items import loads_of
from fsm.errors import CaseError
from fsm.text.shown_units import ShownUnit, shown_unit
from fsm.views.plots.drawing import FORMATS
from fsm.views.plots.space import draw_axes
from fsm.views.plots.style import WIDE, add_legend_across, figure

_CREASES: dict[str, tuple[str, str, float]] = {
    "B": ("#000000", "-", 1.2), "M": ("#D55E00", "-", 1.4), "V": ("#0072B2", "--", 1.4), "F": ("#999999", "-", 0.6),
    "U": ("#CC79A7", "-", 1.2), "C": ("#009E73", "-", 1.2), "J": ("#999999", ":", 1.0),
}  # fmt: skip
"""Colour, dashes and width of the edges of each assignment; colours of Okabe and Ito (2008)."""
_MARKS = {
    "support": ("^", "#000000"), "driven": ("o", "#E69F00"), "loaded": ("v", "#56B4E9"), "probe": ("s", "#0072B2"),
}  # fmt: skip
"""Marker and colour of each kind of place; colours of Okabe and Ito (2008)."""
_NUMBERED = 130
"""Largest number of vertices and facets with numbers in the picture."""
_RED = "#E00000"
"""Colour of faults."""
_PAPER = "#F4F1E8"
"""Colour of facets."""


def draw_sheet(case: Case, path: str | Path) -> list[str]:
    """Draw the flat pattern of a sheet, if it has one, and its start in space; vertices that cannot fold are red.

    A pattern that cannot be folded as given is drawn flat before the error is raised.

    Parameters
    ----------
    case : Case
        Case with `sheet`.
    path : name of a PNG, SVG or PDF file

    Returns
    -------
    list of str
        Notes on the pattern file, and the vertices that cannot fold.

    Raises
    ------
    CaseError
        The path does not name a picture, or the pattern is faulty.
    """
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        names = ", ".join(suffix.removeprefix(".").upper() for suffix in FORMATS)
        raise CaseError(f"{path}: the preview of a sheet is a picture ({names}); give --out FILE.png")
    assert case.sheet is not None
    if case.sheet.facets == "flexible":
        try:
            _draw_mesh(case, case.sheet, path)
        except CaseError:
            if not case.sheet.is_shell:
                _draw(case, case.sheet.model_copy(update={"fold": 0.0}), path)
            raise
        return list(case.sheet.notes)
    try:
        pattern_of(case.sheet)
    except CaseError:
        if case.sheet.fold:
            _draw(case, case.sheet.model_copy(update={"fold": 0.0}), path)
        raise
    _draw(case, case.sheet, path)
    return [*case.sheet.notes, *bad_lines(pattern_of(case.sheet), case.sheet.facets != "rigid")]


def _draw(case: Case, sheet: Sheet, path: Path) -> None:
    """Draw the pattern of a sheet, flat and at the start."""
    pattern = pattern_of(sheet)
    bad = bad_vertices(pattern, sheet.facets != "rigid")
    unit = shown_unit("m", pattern.extent())
    marks: Marks = []
    for kind, at in _places(case, sheet):
        with suppress(ValueError):  # `fsm check` reports this fault
            marks.append((kind, place_of(pattern, at)))
    with figure(path, (WIDE[0], 3.9 if pattern.flat is not None else 4.6)) as fig:
        if pattern.flat is not None:
            ax = fig.add_subplot(1, 2, 1)
            _draw_flat(ax, pattern, unit, marks)
            _draw_bad(ax, pattern.flat * unit.factor, bad)
        columns = 1 if pattern.flat is None else 2
        ax = fig.add_subplot(1, columns, columns, projection="3d")
        points = unit.factor * pattern.vertices
        _draw_marks(ax, pattern, points, marks)
        ax.add_collection3d(Poly3DCollection([points[list(face)] for face in pattern.faces], facecolors=_PAPER, alpha=0.7))
        handles = _draw_lines(ax, points[pattern.edges], pattern.assignment)
        _draw_box(ax, points, unit)
        ax.set_title("start")
        for vertices, marker, _ in bad:
            ax.plot(*points[list(vertices)].T, marker, color=_RED, markersize=6, fillstyle="none")
        handles += [_handle(kind) for kind in dict.fromkeys(kind for kind, _ in marks)]
        handles += [_red(marker, name) for _, marker, name in bad]
        add_legend_across(fig, handles, "lower", columns=6)


def _draw_mesh(case: Case, sheet: Sheet, path: Path) -> None:
    """Draw the mesh of the flexible facets of a sheet at the start."""
    mesh = flexible_mesh(sheet)
    unit = shown_unit("m", float(np.ptp(mesh.positions, axis=0).max()))
    points = unit.factor * mesh.positions
    pattern = None if sheet.is_shell else pattern_of(sheet)
    with figure(path, (WIDE[0], 5.4)) as fig:
        ax: Any = fig.add_subplot(projection="3d")
        style = {"facecolors": _PAPER, "edgecolors": "#999999", "linewidths": 0.3, "alpha": 0.7}
        ax.add_collection3d(Poly3DCollection(points[mesh.triangles], **style))
        handles: list[Line2D] = []
        if pattern is not None:
            whole = pattern.with_bend_lines(most=4)
            lines = {crease.edge: points[crease.sectors[:, 0]] for crease in mesh.creases}
            cuts = [k for k, letter in enumerate(whole.assignment) if letter == "C"]
            lines |= dict(zip(cuts, unit.factor * whole.vertices[whole.edges[cuts]], strict=True))
            handles = _draw_lines(ax, [*lines.values()], [whole.assignment[edge] for edge in lines])
        places = _places(case, sheet) + [("probe", probe.at) for probe in sheet.probe]
        for kind, at in places:
            marker, colour = _MARKS[kind]
            ax.plot(*points[mesh_place(mesh, at).sectors].T, marker, color=colour, markersize=4)
        handles += [_handle(kind) for kind in dict.fromkeys(kind for kind, _ in places)]
        for vertices, marker, name in bad_vertices(pattern, bends=True) if pattern is not None else ():
            ax.plot(*points[mesh.vertices[list(vertices)]].T, marker, color=_RED, markersize=7, fillstyle="none")
            handles.append(_red(marker, name))
        _draw_box(ax, points, unit)
        ax.set_title(f"{len(mesh.triangles)} triangles at the start")
        add_legend_across(fig, handles, "lower", columns=6)


def _places(case: Case, sheet: Sheet) -> list[tuple[str, Any]]:
    """Kind and place of all supports, drives and loads."""
    driven = [f"edge {drive.edge}" if drive.edge is not None else drive.at for drive in case.drive]
    loaded = [load.at for _, load in loads_of(case) if load.pressure is None]
    found: list[tuple[str, Any]] = [("support", support.at) for support in sheet.support]
    found += [("driven", at) for at in driven if at is not None]
    return found + [("loaded", at) for at in loaded if at is not None]


def _draw_lines(ax: Any, lines: Iterable[np.ndarray], letters: Sequence[str]) -> list[Line2D]:
    """Draw the lines of a pattern by their assignments, in the plane or in space; returns the entries of the legend."""
    by_letter: dict[str, list[np.ndarray]] = {}
    for line, letter in zip(lines, letters, strict=True):
        by_letter.setdefault(letter, []).append(line)
    handles = []
    for letter, (colour, dashes, width) in _CREASES.items():
        if letter in by_letter:
            style = {"colors": colour, "linestyles": dashes, "linewidths": width}
            if ax.name == "3d":
                ax.add_collection3d(Line3DCollection(by_letter[letter], **style))
            else:
                ax.add_collection(LineCollection(by_letter[letter], **style))
            handles.append(Line2D([], [], color=colour, ls=dashes, lw=width, label=ASSIGNMENTS[letter]))
    return handles


def _draw_box(ax: Any, points: np.ndarray, unit: ShownUnit) -> None:
    """Set the axes in space for points (n, 3) in a unit."""
    low, high = points.min(axis=0), points.max(axis=0)
    draw_axes(ax, np.maximum(high - low, 0.05 * float((high - low).max())), 0.5 * (low + high), unit.name)


def _handle(kind: str) -> Line2D:
    marker, colour = _MARKS[kind]
    return Line2D([], [], color=colour, marker=marker, ls="", label=kind)


def _red(marker: str, name: str) -> Line2D:
    return Line2D([], [], color=_RED, marker=marker, ls="", label=name, fillstyle="none")


def _draw_bad(ax: Any, flat: np.ndarray, bad: list[tuple[tuple[int, ...], str, str]]) -> None:
    """Mark vertices that cannot fold in the flat pattern, with their numbers."""
    for vertices, marker, _ in bad:
        ax.plot(*flat[list(vertices)].T, marker, color=_RED, markersize=8, fillstyle="none", zorder=6)
        for vertex in vertices[:_NUMBERED]:
            text = ax.annotate(
                str(vertex + 1), flat[vertex], xytext=(3, 3), textcoords="offset points", fontsize=7, color=_RED, zorder=7
            )
            text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])


def draw_fault(fault: Exception, path: Path) -> None:
    """Draw the lines of a pattern that cannot be read, with red marks at the places of its fault.

    Parameters
    ----------
    fault : PatternFault
    path : name of a PNG, SVG or PDF file; other files are not written
    """
    if path.suffix.lower() not in FORMATS or not isinstance(fault, PatternFault):
        return
    lines = np.asarray(fault.lines)
    unit = shown_unit("m", float(np.ptp(lines.reshape(-1, lines.shape[-1]), axis=0).max()) if len(lines) else 0.0)
    lines, places = unit.factor * lines, unit.factor * fault.places
    in_space = lines.shape[-1] == 3 and bool(np.ptp(lines[..., 2]))
    with figure(path, (WIDE[0], 5.0)) as fig:
        ax = fig.add_subplot(projection="3d" if in_space else None)
        size = 3 if in_space else 2
        handles = _draw_lines(ax, lines[..., :size], fault.letters)
        if len(places):
            ax.plot(*places[:, :size].T, "o", color=_RED, markersize=9, fillstyle="none", zorder=6)
            handles.append(_red("o", "fault"))
            for label, place in zip(fault.labels[:_NUMBERED], places, strict=False):
                ax.text(*place[:size], label, color=_RED, fontsize=9)
        if in_space:
            _draw_box(ax, lines.reshape(-1, 3), unit)
        else:
            ax.set(aspect="equal", xlabel=f"x ({unit.name})", ylabel=f"y ({unit.name})")
            ax.autoscale_view()
        ax.set_title(fill(str(fault), 90), fontsize=8)
        add_legend_across(fig, handles, "lower", columns=6)


Marks = list[tuple[str, Place]]
"""Kinds of places, and the places."""


def _draw_marks(ax: Any, pattern: Pattern, points: np.ndarray, marks: Marks) -> None:
    """Draw marks at places on a pattern whose vertices are at points, in the unit of the picture."""
    for kind, place in marks:
        (marker, colour), at = _MARKS[kind], points[list(place.vertices)]
        if place.facet is not None:
            at = points[list(pattern.faces[place.facet])].mean(axis=0)[None]
        ax.plot(*at.T, marker, color=colour, markersize=5)


def _is_numbered(pattern: Pattern) -> bool:
    """Whether the picture has the numbers of vertices and facets."""
    return max(len(pattern.vertices), len(pattern.faces)) <= _NUMBERED


def _beside_cuts(pattern: Pattern, flat: np.ndarray) -> dict[int, tuple[float, float]]:
    """Displacements (points) of the numbers of vertices on cuts, into the facets of their side."""
    inwards = {v: np.zeros(2) for vertices in sides_of_cuts(pattern) for v in vertices}
    for u, v in pattern.edges[(pattern.edge_faces < 0).any(axis=1)].tolist():  # the facet is on the left
        x, y = (flat[v] - flat[u]) / np.linalg.norm(flat[v] - flat[u])
        for vertex in inwards.keys() & {u, v}:
            inwards[vertex] += (-y, x)
    sizes = {vertex: max(float(np.linalg.norm(along)), 1e-9) for vertex, along in inwards.items()}
    # the corner of the text is a digit away from its middle
    return {v: (8.0 * along[0] / sizes[v] - 3.0, 8.0 * along[1] / sizes[v] - 3.0) for v, along in inwards.items()}


def _draw_flat(ax: Any, pattern: Pattern, unit: ShownUnit, marks: Marks) -> None:
    assert pattern.flat is not None
    flat = unit.factor * pattern.flat
    _draw_lines(ax, flat[pattern.edges], pattern.assignment)
    _draw_marks(ax, pattern, flat, marks)
    if _is_numbered(pattern):
        apart = _beside_cuts(pattern, flat)
        for number, place in enumerate(flat, 1):
            text = ax.annotate(
                str(number), place, xytext=apart.get(number - 1, (3, 3)), textcoords="offset points", fontsize=7, zorder=5
            )
            text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
        for number, face in enumerate(pattern.faces, 1):
            ax.text(*flat[list(face)].mean(axis=0), str(number), fontsize=7, color="#666666", ha="center", va="center")
    title = "flat pattern (grey: numbers of facets)" if _is_numbered(pattern) else "flat pattern"
    ax.set(aspect="equal", xlabel=f"x ({unit.name})", ylabel=f"y ({unit.name})", title=title)
    ax.autoscale_view()
