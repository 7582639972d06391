"""Meshes of the facets of a crease pattern: grids of cells in triangles and quadrilaterals, equal along common edges.

A face with more than four corners is divided into triangles by its shortest diagonals. All edges of a triangle have the same
number of divisions, and opposite edges of a quadrilateral also have equal numbers. The longest of the edges that must have
equal numbers determines the number. Each face has its own slopes at each of its nodes (a sector for each node of a face), so
faces can fold along all edges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from fsm.errors import CaseError, Fault
from fsm.scene.patterns.facet_mesh import MOST_TRIANGLES, FacetMesh, MeshCrease, graded, many
from fsm.scene.patterns.facets import facet_frames
from fsm.scene.patterns.pattern import Pattern

__all__ = ["pattern_mesh"]

_EQUAL = 1e-9
"""Relative difference below which two diagonals have equal lengths."""


def pattern_mesh(pattern: Pattern, size: float, grading: float = 0.0) -> FacetMesh:
    """Mesh of a pattern at its start.

    Parameters
    ----------
    pattern : Pattern
    size : m
        Largest length of the divisions of an edge, if they are equal.
    grading : -
        Grading of the cells of each facet towards its edges (`graded`).

    Raises
    ------
    CaseError
        The mesh has too many triangles.
    """
    fine = pattern.with_bend_lines(most=4)
    divisions = _divisions(fine, size)
    count = sum(_triangles_of(face, divisions) for face in fine.faces)
    if count > MOST_TRIANGLES:
        text = f"{size:g} m gives {many(count)} triangles; at most {MOST_TRIANGLES:,} are allowed: use larger cells"
        raise CaseError(Fault("sheet.mesh_size", text))
    return _Mesher(pattern, fine, divisions, grading).mesh()


def _pair(a: int, b: int) -> tuple[int, int]:
    return (a, b) if a < b else (b, a)


def _sides(face: tuple[int, ...]) -> list[tuple[int, int]]:
    return list(zip(face, (*face[1:], face[0]), strict=True))


def _triangles_of(face: tuple[int, ...], divisions: dict[tuple[int, int], int]) -> int:
    first, second = (divisions[_pair(face[k], face[k + 1])] for k in (0, 1))
    return first * first if len(face) == 3 else 2 * first * second


def _divisions(pattern: Pattern, size: float) -> dict[tuple[int, int], int]:
    """Number of divisions of every edge of the faces, by its vertices."""
    above: dict[tuple[int, int], tuple[int, int]] = {}

    def top(edge: tuple[int, int]) -> tuple[int, int]:
        while above.setdefault(edge, edge) != edge:
            edge = above[edge]
        return edge

    for face in pattern.faces:
        sides = [_pair(a, b) for a, b in _sides(face)]
        for one, two in ((0, 1), (1, 2)) if len(face) == 3 else ((0, 2), (1, 3)):
            above[top(sides[one])] = top(sides[two])
    longest: dict[tuple[int, int], float] = {}
    for a, b in list(above):
        length = float(np.linalg.norm(pattern.vertices[a] - pattern.vertices[b]))
        longest[top((a, b))] = max(longest.get(top((a, b)), 0.0), length)
    return {edge: max(1, math.ceil(longest[top(edge)] / size - _EQUAL)) for edge in list(above)}


@dataclass
class _Mesher:
    pattern: Pattern
    fine: Pattern
    divisions: dict[tuple[int, int], int]
    grading: float
    places: list[np.ndarray] = field(default_factory=list)
    nodes: dict[tuple[int, ...], int] = field(default_factory=dict)
    sectors: dict[tuple[int, int], int] = field(default_factory=dict)
    node_of: list[int] = field(default_factory=list)
    face_of: list[int] = field(default_factory=list)
    triangles: list[tuple[int, int, int]] = field(default_factory=list)
    cells: list[tuple[int, int]] = field(default_factory=list)
    of_edge: dict[tuple[int, int], dict[int, list[int]]] = field(default_factory=dict)

    def mesh(self) -> FacetMesh:
        """Complete mesh of the pattern."""
        for number, face in enumerate(self.fine.faces):
            grid = self._triangle(number, face) if len(face) == 3 else self._quadrilateral(number, face)
            self._cells(grid, len(face) == 3)
        node_of, face_of = np.array(self.node_of), np.array(self.face_of)
        positions, axes = np.array(self.places)[node_of], self._axes()[face_of]
        first_corner = self.fine.vertices[[face[0] for face in self.fine.faces]][face_of]
        flat = np.einsum("sij,si->sj", axes, positions - first_corner)
        triangles = np.array(self.triangles)
        angle = self._angles(flat)
        along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        across = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
        slopes = np.stack([np.einsum("sij,sj->si", axes, d) for d in (along, across)], axis=1)
        first: dict[int, int] = {}
        owner = np.array([first.setdefault(node, sector) for sector, node in enumerate(self.node_of)])
        vertices = np.array([first[self.nodes[v,]] for v in range(len(self.fine.vertices))])
        pieces = [max(1, len(face) - 2) if len(face) > 4 else 1 for face in self.pattern.faces]
        facet = np.repeat(np.arange(len(pieces)), pieces)[face_of]
        return FacetMesh(
            positions, slopes, owner, triangles, flat[triangles], angle[triangles], vertices, facet, self._edges(triangles),
            False, self._creases(flat, angle), np.array(self.cells, dtype=np.int64).reshape(-1, 2),
        )  # fmt: skip

    def _axes(self) -> np.ndarray:
        """Axes in the plane of each face, (n, 3, 2), along the axes of the flat pattern if there is one; ply angles are
        measured from them.
        """
        axes = facet_frames(self.fine).axes[:, :, :2].copy()
        if self.fine.flat is None:
            return axes
        for number, (a, b, *_) in enumerate(self.fine.faces):
            x, y = (self.fine.vertices[b] - self.fine.vertices[a]) @ axes[number]
            u, v = self.fine.flat[b] - self.fine.flat[a]
            turn = math.atan2(v, u) - math.atan2(y, x)
            c, s = math.cos(turn), math.sin(turn)
            axes[number] = axes[number] @ np.array([[c, s], [-s, c]])
        return axes

    # nodes ------------------------------------------------------------------------------------------------------------

    def _node(self, key: tuple[int, ...], place: np.ndarray) -> int:
        if key not in self.nodes:
            self.nodes[key] = len(self.places)
            self.places.append(place)
        return self.nodes[key]

    def _sector(self, face: int, node: int) -> int:
        if (face, node) not in self.sectors:
            self.sectors[face, node] = len(self.node_of)
            self.node_of.append(node)
            self.face_of.append(face)
        return self.sectors[face, node]

    def _parts(self, count: int) -> np.ndarray:
        """Positions of the divisions of an edge, from 0 to 1."""
        return 0.5 * (1.0 + graded(np.linspace(-1.0, 1.0, count + 1), self.grading))

    def _side(self, face: int, a: int, b: int) -> list[int]:
        """Sectors of a face along its edge from vertex a to b."""
        low, high = _pair(a, b)
        start, end = self.fine.vertices[low], self.fine.vertices[high]
        count = self.divisions[low, high]
        keys = [(low,), *((low, high, i) for i in range(1, count)), (high,)]
        parts = self._parts(count).tolist()
        line = [self._sector(face, self._node(key, start + (end - start) * x)) for x, key in zip(parts, keys, strict=True)]
        self.of_edge.setdefault((low, high), {})[face] = line
        return line if a < b else line[::-1]

    def _triangle(self, number: int, face: tuple[int, ...]) -> np.ndarray:
        """Grid (n + 1, n + 1) of sectors in a triangle; -1 outside."""
        a, b, c = face
        count = self.divisions[_pair(a, b)]
        pa, pb, pc = self.fine.vertices[list(face)]
        grid = np.full((count + 1, count + 1), -1, dtype=np.int64)
        grid[:, 0] = self._side(number, a, b)
        grid[0] = self._side(number, a, c)
        grid[np.arange(count, -1, -1), np.arange(count + 1)] = self._side(number, b, c)
        parts = self._parts(count)
        for i in range(1, count):
            for j in range(1, count - i):
                shares = parts[[count - i - j, i, j]]  # on an edge their sum is 1
                place = shares @ np.array([pa, pb, pc]) / shares.sum()
                grid[i, j] = self._sector(number, self._node((-1, number, i, j), place))
        return grid

    def _quadrilateral(self, number: int, face: tuple[int, ...]) -> np.ndarray:
        """Grid of sectors in a quadrilateral."""
        a, b, c, d = face
        m, n = self.divisions[_pair(a, b)], self.divisions[_pair(b, c)]
        pa, pb, pc, pd = self.fine.vertices[list(face)]
        grid = np.full((m + 1, n + 1), -1, dtype=np.int64)
        grid[:, 0], grid[:, n] = self._side(number, a, b), self._side(number, d, c)
        grid[0], grid[m] = self._side(number, a, d), self._side(number, b, c)
        along, across = self._parts(m).tolist(), self._parts(n).tolist()
        for i in range(1, m):
            for j in range(1, n):
                x, y = along[i], across[j]
                place = (1 - x) * (1 - y) * pa + x * (1 - y) * pb + x * y * pc + (1 - x) * y * pd
                grid[i, j] = self._sector(number, self._node((-1, number, i, j), place))
        return grid

    def _cells(self, grid: np.ndarray, triangle: bool) -> None:
        """Two triangles of each cell, along its shorter diagonal; equal diagonals alternate."""
        for i in range(grid.shape[0] - 1):
            for j in range(grid.shape[1] - 1):
                a, b, c, d = (int(s) for s in (grid[i, j], grid[i + 1, j], grid[i + 1, j + 1], grid[i, j + 1]))
                if triangle:
                    if b >= 0 and d >= 0:
                        self.triangles.append((a, b, d))
                        if c >= 0:
                            self.triangles.append((b, c, d))
                    continue
                at = [self.places[self.node_of[s]] for s in (a, b, c, d)]
                ac, bd = float(np.linalg.norm(at[0] - at[2])), float(np.linalg.norm(at[1] - at[3]))
                first = (i + j) % 2 == 0 if abs(ac - bd) < _EQUAL * (ac + bd) else ac < bd
                self.cells.append((len(self.triangles), len(self.triangles) + 1))
                self.triangles += [(a, b, c), (a, c, d)] if first else [(a, b, d), (b, c, d)]

    # edges ------------------------------------------------------------------------------------------------------------

    def _lines(self) -> list[tuple[int, tuple[int, int]]]:
        """Number and both vertices of each edge of the pattern with bend lines."""
        return [(number, (int(a), int(b))) for number, (a, b) in enumerate(self.fine.edges.tolist())]

    def _angles(self, flat: np.ndarray) -> np.ndarray:
        """Angle of the first slope of each sector. If the node lies on an edge of its face, the slope is along this
        edge; boundaries come first.
        """
        angle = np.zeros(len(flat))
        lines = [line for of_face in self.of_edge.values() if len(of_face) > 1 for line in of_face.values()]
        lines += [line for of_face in self.of_edge.values() if len(of_face) == 1 for line in of_face.values()]
        for line in lines:
            x, y = flat[line[-1]] - flat[line[0]]
            angle[line] = math.atan2(y, x)
        return angle

    def _edges(self, triangles: np.ndarray) -> dict[str, np.ndarray]:
        """Named edges: all edges of one face between two vertices of a group of the pattern."""
        known: dict[tuple[int, int], tuple[int, int]] = {}
        for number, (a, b, c) in enumerate(triangles.tolist()):
            for k, pair in enumerate(((a, b), (b, c), (c, a))):
                known[_pair(*pair)] = number, k
        found = {}
        for name, group in self.pattern.groups.items():
            members, edges = set(group), []
            for (low, high), of_face in sorted(self.of_edge.items()):
                if len(of_face) == 1 and low in members and high in members:
                    (line,) = of_face.values()
                    edges += [known[_pair(a, b)] for a, b in pairwise(line)]
            if edges:
                found[name] = np.array(edges, dtype=np.int64)
        return found

    def _creases(self, flat: np.ndarray, angle: np.ndarray) -> tuple[MeshCrease, ...]:
        """Nodes along the creases, with the slopes across and along each crease on both sides."""
        found = []
        faces = self.fine.edge_faces
        for number in self.fine.creases.tolist():
            a, b = (int(v) for v in self.fine.edges[number])
            low, high = _pair(a, b)
            lines = [self.of_edge[low, high][int(face)][:: 1 if a < b else -1] for face in faces[number]]
            directions = []
            for line in lines:
                x, y = flat[line[-1]] - flat[line[0]]
                turned = math.atan2(y, x) - angle[line]
                directions.append(np.stack([np.cos(turned), np.sin(turned)], axis=-1))
            steps = np.diff(self._parts(len(lines[0]) - 1))
            share = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
            length = float(np.linalg.norm(self.fine.vertices[b] - self.fine.vertices[a]))
            found.append(MeshCrease(number, np.array(lines).T, np.stack(directions, axis=1), share * length))
        return tuple(found)
