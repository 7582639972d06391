"""Surface of a sheet whose points and edges touch the sheet itself, bodies and obstacles."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fsm.case.models.flexible import SceneFrame

MOST_POINTS = 20_000
"""Largest number of points of a sheet that touch bodies and obstacles."""


class SheetPoint(NamedTuple):
    """Point of a triangle: a weighted sum of the positions of its nodes.

    Attributes
    ----------
    frame : SceneFrame
    nodes : numbers of the nodes
    weights : weights of the nodes; their sum is 1
    area : m^2
        Area that the point represents.
    """

    frame: SceneFrame
    nodes: tuple[int, ...]
    weights: tuple[float, ...]
    area: float


@dataclass(frozen=True, eq=False)
class TouchingSheet:
    """Triangles of a sheet of flexible facets or of bars, for contact.

    Attributes
    ----------
    frames : (n,) frames at the nodes
    positions : (n, 3) array, m
        Positions of the nodes at the start.
    areas : (n,) array, m^2
        Area that each node represents.
    triangles : (m, 3) int array of nodes
    facet : (m,) int array
        Facet of each triangle.
    plane : (m, 3, 2) array, m
        Corners in the flat facet.
    mean_facet : m^2
        Area of a mean facet of the pattern, which has the whole contact stiffness.
    thickness, areal_density : m, kg/m^2
    """

    frames: tuple[SceneFrame, ...]
    positions: np.ndarray
    areas: np.ndarray
    triangles: np.ndarray
    facet: np.ndarray
    plane: np.ndarray
    mean_facet: float
    thickness: float
    areal_density: float
    _known: dict[int, dict[str, SheetPoint]] = field(default_factory=dict)

    @cached_property
    def longest_edge(self) -> float:
        """Longest edge of the flat triangles, m."""
        return float(np.linalg.norm(self.plane - np.roll(self.plane, 1, axis=1), axis=2).max())

    def parts(self, spacing: float) -> int:
        """Parts of each edge between points at most `spacing` (m) apart, or as many parts as `MOST_POINTS` permits."""
        most = max(1, math.isqrt(2 * MOST_POINTS // len(self.triangles)))
        return min(most, max(1, math.ceil(self.longest_edge / spacing)))

    def points(self, parts: int) -> dict[str, SheetPoint]:
        """Points of a regular grid on every triangle, by name; with one part, the nodes.

        Triangles with a common edge or node share the points there. Each point represents a third of the area of the small
        triangles around it.
        """
        if parts not in self._known:
            self._known[parts] = self._grid(parts)
        return self._known[parts]

    def _grid(self, parts: int) -> dict[str, SheetPoint]:
        if parts == 1:
            return {
                frame.name: SheetPoint(frame, (node,), (1.0,), area)
                for node, (frame, area) in enumerate(zip(self.frames, self.areas.tolist(), strict=True))
            }
        one, two = self.plane[:, 1] - self.plane[:, 0], self.plane[:, 2] - self.plane[:, 0]
        sizes = (0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / parts**2).tolist()
        areas = dict[tuple[tuple[int, int], ...], float]()  # by nodes and their numbers of parts
        for nodes, size in zip(self.triangles.tolist(), sizes, strict=True):
            for i in range(parts + 1):
                for j in range(parts + 1 - i):
                    on = zip(nodes, (i, j, parts - i - j), strict=True)
                    key = tuple(sorted((node, count) for node, count in on if count))
                    around = {1: 1, 2: 3, 3: 6}[len(key)]  # small triangles of this triangle at the point
                    areas[key] = areas.get(key, 0.0) + around * size / 3.0
        found = dict[str, SheetPoint]()
        for number, (key, area) in enumerate(areas.items(), 1):
            nodes = tuple(node for node, _ in key)
            frame = self.frames[nodes[0]]
            if len(nodes) > 1:
                frame = SceneFrame(name=f"contact point {number} of the sheet", on=frame.on)
            found[frame.name] = SheetPoint(frame, nodes, tuple(count / parts for _, count in key), area)
        return found
