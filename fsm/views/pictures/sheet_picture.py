"""Pictures of a sheet: its pattern with creases by assignment, numbers and places, and the mesh of flexible facets."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from fsm.builders.patterns.cuts import sides_of_cuts
from fsm.builders.patterns.flexible_mesh import flexible_mesh
from fsm.builders.patterns.foldability import bad_lines, bad_vertices
from fsm.builders.patterns.mesh_places import mesh_place
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.builders.patterns.places import Place, place_of
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import FacetMesh
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.pattern import ASSIGNMENTS, Pattern
from fsm.case.pattern_files.reading import PatternFault
from fsm.case.plan.step_items import loads_of
from fsm.errors import CaseError
from fsm.io.atomic_write import atomic_write
from fsm.text.shown_units import ShownUnit, shown_unit
from fsm.views.plots.drawing import FORMATS
from fsm.views.plots.legend import add_legend_across
from fsm.views.plots.space import draw_axes
from fsm.views.plots.style import WIDE, figure

CREASES: dict[str, tuple[str, str, float]] = {
    "B": ("#000000", "-", 1.2), "M": ("#D55E00", "-", 1.4), "V": ("#0072B2", "--", 1.4), "F": ("#999999", "-", 0.6),
    "U": ("#CC79A7", "-", 1.2), "C": ("#009E73", "-", 1.2), "J": ("#999999", ":", 1.0),
}  # fmt: skip
"""Colour, dashes and width of the edges of each assignment; colours of Okabe and Ito (2008)."""

_MARKS = {
    "support": ("^", "#000000"), "load": ("v", "#D55E00"), "driven": ("o", "#E69F00"), "probe": ("s", "#0072B2"),
}  # fmt: skip
"""Marker and colour of each kind of place; colours of Okabe and Ito (2008)."""


def draw_facets(case: Case, path: Path) -> None:
    """Draw the mesh of the flexible facets of a case into a PNG, SVG or PDF file."""
    assert case.sheet is not None
    mesh = flexible_mesh(case.sheet)
    figure = Figure(figsize=(8.0, 6.0), dpi=150)
    FigureCanvasAgg(figure)
    ax = figure.add_subplot(projection="3d")
    unit = shown_unit("m", float(np.ptp(mesh.positions, axis=0).max()))
    points = unit.factor * mesh.positions
    ax.add_collection3d(
        Poly3DCollection(points[mesh.triangles], facecolors="#F4F1E8", edgecolors="#999999", linewidths=0.3, alpha=0.7)
    )
    seen = {} if case.sheet.kind == "plate" else _draw_creases(ax, mesh, case.sheet, unit.factor)
    for kind, at in _places(case, case.sheet):
        seen[kind] = _mark(ax, points[mesh_place(mesh, at).sectors], kind)
    pattern = None if case.sheet.is_shell else pattern_of(case.sheet)
    for vertices, marker, text in bad_vertices(pattern, bends=True) if pattern is not None else ():
        ax.plot(*points[mesh.vertices[list(vertices)]].T, marker, color="#E00000", markersize=7, fillstyle="none")
        seen[text] = Line2D([], [], color="#E00000", marker=marker, ls="", label=text, fillstyle="none")
    low, high = points.min(axis=0), points.max(axis=0)
    sides = np.maximum(high - low, 0.05 * float((high - low).max()))
    for axis, middle, side in zip("xyz", 0.5 * (low + high), sides, strict=True):
        getattr(ax, f"set_{axis}lim")(middle - 0.5 * side, middle + 0.5 * side)
    ax.set_box_aspect(sides)
    ax.set(**{f"{axis}label": f"{axis} ({unit.name})" for axis in "xyz"})
    ax.set_title(f"{len(mesh.triangles)} triangles at the start")
    figure.legend(handles=list(seen.values()), loc="lower center", ncols=4, fontsize=8, frameon=False)
    with atomic_write(path) as part:
        figure.savefig(part, format=path.suffix.removeprefix(".").lower())


def _draw_creases(ax: Any, mesh: FacetMesh, sheet: Sheet, factor: float) -> dict[str, Line2D]:
    """Draw the creases by their assignments; returns the entries of the legend."""
    pattern = pattern_of(sheet).with_bend_lines(most=4)
    points, letters = factor * mesh.positions, pattern.assignment
    seen = {}
    for letter, name in ASSIGNMENTS.items():
        lines = [points[crease.sectors[:, 0]] for crease in mesh.creases if letters[crease.edge] == letter]
        if letter == "C":
            cuts = [k for k, own in enumerate(letters) if own == letter]
            lines = list(factor * pattern.vertices[pattern.edges[cuts]])
        if lines:
            colour, dashes, width = CREASES[letter]
            ax.add_collection3d(Line3DCollection(lines, colors=colour, linestyles=dashes, linewidths=width))
            seen[name] = Line2D([], [], color=colour, ls=dashes, lw=width, label=name)
    return seen


def _places(case: Case, sheet: Sheet) -> list[tuple[str, Any]]:
    """Kind and place of all supports, loads, drives and probes."""
    found: list[tuple[str, Any]] = [("support", support.at) for support in sheet.support]
    found += [("load", load.at) for load in case.load if load.at is not None and load.pressure is None]
    driven = [f"edge {drive.edge}" if drive.edge is not None else drive.at for drive in case.drive]
    return found + [("driven", at) for at in driven if at is not None] + [("probe", probe.at) for probe in sheet.probe]


def _mark(ax: Any, points: np.ndarray, kind: str) -> Line2D:
    marker, colour = _MARKS[kind]
    ax.plot(*points.T, marker, color=colour, markersize=4)
    return Line2D([], [], color=colour, marker=marker, ls="", label=kind)


_NUMBERED = 130
"""Largest number of vertices and facets with numbers in the picture."""
_RED = "#E00000"
"""Colour of faults."""


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
            draw_facets(case, path)
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
    with figure(path, (WIDE[0], 3.9 if pattern.flat is not None else 4.6)) as fig:
        marks = _marks(case, sheet, pattern)
        if pattern.flat is not None:
            ax = fig.add_subplot(1, 2, 1)
            _draw_flat(ax, pattern, unit, marks)
            _draw_bad(ax, pattern.flat * unit.factor, bad)
        columns = 1 if pattern.flat is None else 2
        ax = fig.add_subplot(1, columns, columns, projection="3d")
        _draw_space(ax, pattern, unit, marks)
        for vertices, marker, _ in bad:
            ax.plot(*unit.factor * pattern.vertices[list(vertices)].T, marker, color=_RED, markersize=6, fillstyle="none")
        letters = [letter for letter in ASSIGNMENTS if letter in pattern.assignment]
        styles = [(ASSIGNMENTS[letter], *CREASES[letter]) for letter in letters]
        handles = [Line2D([], [], color=c, ls=dashes, lw=width, label=name) for name, c, dashes, width in styles]
        roles = {"^": "support", "o": "driven", "s": "loaded"}
        shown = dict.fromkeys((marker, colour) for _, marker, colour in marks)
        handles += [Line2D([], [], color=c, marker=marker, ls="", label=roles[marker]) for marker, c in shown]
        handles += [
            Line2D([], [], color=_RED, marker=m, ls="", label=name, fillstyle="none") for _, m, name in bad
        ]  # fmt: skip
        add_legend_across(fig, handles, "lower", columns=6)


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
        kind: Any = Line3DCollection if in_space else LineCollection
        size = 3 if in_space else 2
        handles = []
        for letter, (colour, dashes, width) in CREASES.items():
            own = [k for k, found in enumerate(fault.letters) if found == letter]
            if own:
                chosen = list(lines[own][..., :size])
                (ax.add_collection3d if in_space else ax.add_collection)(
                    kind(chosen, colors=colour, linestyles=dashes, linewidths=width)
                )
                handles.append(Line2D([], [], color=colour, ls=dashes, lw=width, label=ASSIGNMENTS[letter]))
        if len(places):
            ax.plot(*places[:, :size].T, "o", color=_RED, markersize=9, fillstyle="none", zorder=6)
            handles.append(Line2D([], [], color=_RED, marker="o", ls="", label="fault", fillstyle="none"))
            for label, place in zip(fault.labels[:_NUMBERED], places, strict=False):
                ax.text(*place[:size], label, color=_RED, fontsize=9)
        ends = lines.reshape(-1, lines.shape[-1])[:, :size]
        if in_space:
            low, high = ends.min(axis=0), ends.max(axis=0)
            draw_axes(ax, np.maximum(high - low, 0.05 * float((high - low).max())), 0.5 * (low + high), unit.name)
        else:
            ax.set(aspect="equal", xlabel=f"x ({unit.name})", ylabel=f"y ({unit.name})")
            ax.autoscale_view()
        ax.set_title(fill(str(fault), 90), fontsize=8)
        add_legend_across(fig, handles, "lower", columns=6)


Marks = list[tuple[Place, str, str]]
"""Places with marker and colour."""


def _marks(case: Case, sheet: Sheet, pattern: Pattern) -> Marks:
    """Supports, driven and loaded places."""
    places = [(support.at, "^", "#000000") for support in sheet.support]
    for drive in case.drive:
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        places += [(at, "o", "#E69F00")] if at is not None else []
    places += [(load.at, "s", "#56B4E9") for _, load in loads_of(case) if load.at is not None and load.pressure is None]
    found = []
    for at, marker, colour in places:
        try:
            found.append((place_of(pattern, at), marker, colour))
        except ValueError:
            continue  # `fsm check` reports this fault
    return found


def _draw_marks(ax: Any, pattern: Pattern, points: np.ndarray, marks: Marks) -> None:
    """Draw marks at places on a pattern whose vertices are at points, in the unit of the picture."""
    for place, marker, colour in marks:
        at = points[list(place.vertices)]
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
    for letter, (colour, dashes, width) in CREASES.items():
        chosen = [k for k, own in enumerate(pattern.assignment) if own == letter]
        lines = list(flat[pattern.edges[chosen]])
        ax.add_collection(LineCollection(lines, colors=colour, linestyles=dashes, linewidths=width))
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


def _draw_space(ax: Any, pattern: Pattern, unit: ShownUnit, marks: Marks) -> None:
    points = unit.factor * pattern.vertices
    _draw_marks(ax, pattern, points, marks)
    ax.add_collection3d(Poly3DCollection([points[list(face)] for face in pattern.faces], facecolors="#F4F1E8", alpha=0.7))
    for letter, (colour, dashes, width) in CREASES.items():
        chosen = [k for k, own in enumerate(pattern.assignment) if own == letter]
        if chosen:
            lines = list(points[pattern.edges[chosen]])
            ax.add_collection3d(Line3DCollection(lines, colors=colour, linestyles=dashes, linewidths=width))
    low, high = points.min(axis=0), points.max(axis=0)
    draw_axes(ax, np.maximum(high - low, 0.05 * float((high - low).max())), 0.5 * (low + high), unit.name)
    ax.set_title("start")
