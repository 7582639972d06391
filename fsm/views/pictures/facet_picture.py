"""Picture of the mesh of flexible facets at the start: triangles, creases, supports, loaded and driven places, probes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from fsm.builders.patterns.flexible_mesh import flexible_mesh
from fsm.builders.patterns.foldability import bad_vertices
from fsm.builders.patterns.mesh_places import mesh_place
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import FacetMesh
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.pattern import ASSIGNMENTS
from fsm.io.atomic_write import atomic_write
from fsm.text.shown_units import shown_unit

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
