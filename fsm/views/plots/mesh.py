"""Mesh of a result for exporters: points over time, cells, and channels as data of cells and points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fsm.errors import CaseError
from fsm.results.all_channels import all_channels
from fsm.results.film import Floats, Integers
from fsm.results.solution import BEAM, FILM, JOINT_AXIS, LINE, LINK, Solution
from fsm.text.short_repr import ShortRepr
from fsm.views.plots.parts import lattice_squares

_SAME = 1e-9
"""Distance of nodes of a film that are one node, relative to the size of the structure."""
_LONGEST, _SHORTEST = 20.0, 2.0
"""Durations of a motion that is shown in real time, s; others are shown in `_SHOWN` seconds."""
_SHOWN = 8.0
_KINDS = {FILM: "film", LINE: "cable", BEAM: "beam", LINK: "body", JOINT_AXIS: "axis of joint"}


@dataclass(repr=False)
class Mesh(ShortRepr):
    """Points and cells of a result; the cells do not change.

    Attributes
    ----------
    time : (n,) array, s
    points : (n, p, 3) array, m
    cells : (c, 4) array of int
        Points of each cell in cyclic order. A triangle has its third point twice; a line has two points, each twice.
    corners : (c,) array of int
        Number of corners: 4, 3, or 2 for a line.
    panel : (c,) array of int
        Panel or patch of each cell; FILM, LINE, BEAM, ... for other parts of a scene.
    labels : names of the parts of the structure, such as "panel 3"
    label : (c,) array of int
        Part of each cell, as index of `labels`.
    solution : Solution
    """

    time: Floats
    points: Floats
    cells: Integers
    corners: Integers
    panel: Integers
    labels: tuple[str, ...]
    label: Integers
    solution: Solution

    @cached_property
    def channels(self) -> dict[str, Any]:
        """All channels of the result by name."""
        return all_channels(self.solution)

    @cached_property
    def cell_data(self) -> dict[str, tuple[str, Floats]]:
        """Unit and values (n, c, ...) of quantities of cells, by name; NaN for cells without the quantity."""
        found: dict[str, tuple[str, Floats]] = {}
        for name, channel in self.channels.items():
            kind, _, rest = name.partition(".")
            unit, values = channel.info.unit, np.asarray(channel.values, dtype=float)
            owner, _, quantity = rest.rpartition(".")
            if kind == "panel" and values.ndim == 2:
                cells = np.flatnonzero(self.panel == int(owner)) if owner.isdigit() else np.zeros(0, dtype=int)
                if len(cells) == values.shape[1] + 1:
                    self._put(found, f"panel.{quantity}", unit, cells, _between(values))
            elif kind == "film":
                cells = self._films
                if values.ndim > 1 and values.shape[1] == len(cells):
                    self._put(found, name, unit, cells, values)
            elif kind == "cable":
                cells = np.flatnonzero(self.corners == 2)
                if values.ndim > 1 and values.shape[1] == len(cells):
                    self._put(found, name, unit, cells, values)
            elif kind in ("body", "bar", "support"):
                cells = self._cells_of(owner)
                if len(cells):
                    self._put(found, f"{kind}.{quantity}", unit, cells, np.repeat(values[:, None], len(cells), axis=1))
            elif kind == "contact" and quantity in ("normal_force", "friction_force", "area"):
                for side in owner.split(" - "):
                    cells = self._cells_of(side)
                    values_of = np.repeat(np.nan_to_num(values)[:, None], len(cells), axis=1)
                    self._put(found, f"contact.{quantity}", unit, cells, values_of, add=True)
        return found

    @cached_property
    def point_data(self) -> dict[str, tuple[str, Floats]]:
        """Unit and values (n, p, ...) of quantities of points: displacement, and those of creases at their lines."""
        found = {"displacement": ("m", self.points - self.points[0])}
        for name, channel in self.channels.items():
            kind, number, quantity = (*name.split(".", 2), "", "")[:3]
            points = self._points_of_crease(int(number)) if kind == "crease" and number.isdigit() else []
            if not len(points):
                continue
            values = np.asarray(channel.values, dtype=float)
            key = f"crease.{quantity}"
            if key not in found:
                found[key] = (channel.info.unit, np.full((*self.points.shape[:2], *values.shape[1:]), np.nan))
            found[key][1][:, points] = values[:, None]
        return found

    def _put(
        self, found: dict[str, tuple[str, Floats]], name: str, unit: str, cells: Integers, values: Floats, add: bool = False
    ) -> None:
        if name not in found:
            empty = np.zeros if add else lambda shape: np.full(shape, np.nan)
            found[name] = (unit, empty((len(self.time), len(self.cells), *values.shape[2:])))
        data = found[name][1]
        data[:, cells] = data[:, cells] + values if add else values

    @cached_property
    def _films(self) -> Integers:
        if self.solution.layout.film is not None:
            return np.flatnonzero(self.corners > 2)
        return np.flatnonzero(self.panel == FILM)

    def _cells_of(self, name: str) -> Integers:
        """Cells of a part, or of one segment of a panel."""
        part, _, segment = name.partition(" segment ")
        if part not in self.labels:
            return np.zeros(0, dtype=np.int64)
        cells = np.flatnonzero(self.label == self.labels.index(part))
        if not segment:
            return cells
        return cells[[int(segment) - 1]] if segment.isdigit() and 0 < int(segment) <= len(cells) else cells[:0]

    def _points_of_crease(self, number: int) -> list[int]:
        """Points on both sides of a crease of a strip."""
        before, after = (np.flatnonzero(self.panel == panel) for panel in (number, number + 1))
        if not len(before) or not len(after):
            return []
        return [*self.cells[before[-1], [1, 2]].tolist(), *self.cells[after[0], [0, 3]].tolist()]


def mesh_of(solution: Solution) -> Mesh:
    """Mesh of a solution; elements of a film share their nodes.

    Raises
    ------
    CaseError
        The result has no plates, films, cables or beams.
    """
    squares, panel = lattice_squares(solution, solution.shape), solution.layout.panel
    shape = solution.shape if squares is None else squares
    if not shape.shape[1]:
        raise CaseError("the result has no plates, films, cables or beams to show; give bodies a `plate`", "export")
    count = shape.shape[1]
    panel = panel if len(panel) == count else np.zeros(count, dtype=np.int64)
    cells = np.arange(4 * count).reshape(-1, 4)
    points = np.ascontiguousarray(shape.reshape(len(shape), -1, 3))
    flat = np.linalg.norm(shape[0] - shape[0][:, [3, 0, 1, 2]], axis=-1)  # distance of each corner from the previous corner
    size = float(np.max(np.ptp(points[0], axis=0))) or 1.0
    lines = (flat[:, 0] < _SAME * size) & (flat[:, 2] < _SAME * size)
    triangles = ~lines & ((flat[:, 0] < _SAME * size) | (flat[:, 3] < _SAME * size))
    corners = np.where(lines, 2, np.where(triangles, 3, 4))
    film = (panel == FILM) if solution.layout.film is None else np.ones(count, dtype=bool)
    cells, points = _joined(cells, points, cells[film & (corners > 2)], size)
    cells[lines, 3], cells[lines, 2] = cells[lines, 0], cells[lines, 1]
    cells[triangles, 3] = cells[triangles, 2]
    names = _names(solution, panel)
    labels = tuple(dict.fromkeys(names))
    label = np.array([labels.index(name) for name in names], dtype=np.int64)
    return Mesh(solution.time, points, cells, corners, panel, labels, label, solution)


def playback(time: Floats) -> float:
    """Factor from the time of a motion to the time in which it is shown."""
    duration = float(time[-1] - time[0])
    if duration <= 0.0 or _SHORTEST <= duration <= _LONGEST:
        return 1.0
    return _SHOWN / duration


def _between(values: Floats) -> Floats:
    """Values of the segments of a panel (n, m + 1) from values at its joints (n, m): mean of both joints, or the value
    of the single joint at an edge.
    """
    edge = np.concatenate([values[:, :1], values, values[:, -1:]], axis=1)
    return np.asarray(0.5 * (edge[:, 1:] + edge[:, :-1]))


def _joined(cells: Integers, points: Floats, of_films: Integers, size: float) -> tuple[Integers, Floats]:
    """Cells and points after a merger of film points that coincide in the first and in the last record."""
    chosen = np.unique(of_films)
    if not len(chosen):
        return cells, points
    both = np.concatenate([points[0, chosen], points[-1, chosen]], axis=1)
    _, first, inverse = np.unique(np.round(both / (_SAME * size * 1e3)), axis=0, return_index=True, return_inverse=True)
    target = np.arange(points.shape[1])
    target[chosen] = chosen[first[inverse.ravel()]]
    used, renumbered = np.unique(target[cells], return_inverse=True)
    return renumbered.reshape(cells.shape), np.ascontiguousarray(points[:, used])


def _names(solution: Solution, panel: Integers) -> list[str]:
    """Name of the part of every cell; older results have names of panels and of kinds only."""
    film, known = solution.layout.film is not None, list(solution.layout.quad_names)
    bars: tuple[str, ...] = () if solution.array is None else solution.array.bar_names
    if len(bars) and len(panel) % len(bars) == 0:
        return np.repeat(bars, len(panel) // len(bars)).tolist()
    if film or len(known) != len(panel):
        known = ["film" if film else _KINDS.get(number, "plate") for number in panel.tolist()]
    numbered = "patch" if film else "panel"
    return [f"{numbered} {number}" if number > 0 else name for number, name in zip(panel.tolist(), known, strict=True)]
