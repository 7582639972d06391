"""Meshes of the facets of a crease pattern: grids of cells in triangles and quadrilaterals, equal along common edges.

A face with more than four corners is divided into triangles by its shortest diagonals. All edges of a triangle have the same
number of divisions, and opposite edges of a quadrilateral also have equal numbers. The longest of the edges that must have
equal numbers determines the number.

Faces that fold have separate slopes at their common nodes. Faces beside a line that does not fold share their slopes there,
as the triangles of one face do: the line is then a line of a smooth plate. If these faces are not coplanar, the surface has
a curvature at rest beside the line. Its tangent plane at a node is that of the curved surface through the nodes around it
(`fsm.builders.patterns.smooth_normals`) if faces are single cells across their curved lines. Larger faces stay flat inside,
and the plane is normal to the mean of the normals of the faces at the node. With large angles between the faces the slopes
stay separate, and the line is a joint between them. An edge in a plane of symmetry is such a line between a face and its
image.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from fsm.builders.patterns.cuts import facet_frames
from fsm.builders.patterns.smooth_normals import smooth_normals
from fsm.case.models.facet_mesh import MOST_TRIANGLES, FacetMesh, MeshCrease, graded, many
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError, Fault

_EQUAL = 1e-9
"""Relative difference below which two diagonals have equal lengths."""
_SMOOTH = math.cos(math.radians(22.5))
"""Cosine of the largest angle between the normals of faces that share slopes and the mean of these normals."""
_COPLANAR = 1e-12
"""Difference from 1 of a cosine below which faces count as coplanar, and directions as one."""
_ONE_LINE = 0.7
"""Cosine of the angle between two edges above which they form one smooth line, as in `FacetMesh.along_edges`."""
_BOUNDARY = 3
"""Rank of the first slope at a boundary; in a plane of symmetry the rank is higher."""


def pattern_mesh(
    pattern: Pattern, size: float, grading: float = 0.0, folding: str = "MVU",
    mirrors: Mapping[frozenset[int], int] | None = None,
) -> FacetMesh:  # fmt: skip
    """Mesh of a pattern at its start.

    Parameters
    ----------
    pattern : Pattern
    size : m
        Largest length of the divisions of an edge, if they are equal.
    grading : -
        Grading of the cells of each facet towards its edges (`graded`).
    folding : letters of the edges that fold
    mirrors : axes of planes of symmetry, by the vertices between which edges lie in them

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
    return _Mesher(pattern, fine, divisions, grading, folding, mirrors or {}).mesh()


def _pair(a: int, b: int) -> tuple[int, int]:
    return (a, b) if a < b else (b, a)


def _sides(face: tuple[int, ...]) -> list[tuple[int, int]]:
    return list(zip(face, (*face[1:], face[0]), strict=True))


def _triangles_of(face: tuple[int, ...], divisions: dict[tuple[int, int], int]) -> int:
    first, second = (divisions[_pair(face[k], face[k + 1])] for k in (0, 1))
    return first * first if len(face) == 3 else 2 * first * second


def _divisions(pattern: Pattern, size: float) -> dict[tuple[int, int], int]:
    """Number of divisions of every edge of the faces, by its vertices; both sides of a cut have the same number."""
    uncut = pattern.uncut or range(len(pattern.vertices))
    above: dict[tuple[int, int], tuple[int, int]] = {}

    def top(edge: tuple[int, int]) -> tuple[int, int]:
        while above.setdefault(edge, edge) != edge:
            edge = above[edge]
        return edge

    for face in pattern.faces:
        sides = [_pair(uncut[a], uncut[b]) for a, b in _sides(face)]
        for one, two in ((0, 1), (1, 2)) if len(face) == 3 else ((0, 2), (1, 3)):
            above[top(sides[one])] = top(sides[two])
    longest: dict[tuple[int, int], float] = {}
    for a, b in list(above):
        length = float(np.linalg.norm(pattern.vertices[a] - pattern.vertices[b]))
        longest[top((a, b))] = max(longest.get(top((a, b)), 0.0), length)
    number = {edge: max(1, math.ceil(longest[top(edge)] / size - _EQUAL)) for edge in list(above)}
    return {_pair(a, b): number[_pair(uncut[a], uncut[b])] for face in pattern.faces for a, b in _sides(face)}


@dataclass
class _Mesher:
    pattern: Pattern
    fine: Pattern
    divisions: dict[tuple[int, int], int]
    grading: float
    folding: str
    mirrors: Mapping[frozenset[int], int]
    places: list[np.ndarray] = field(default_factory=list)
    nodes: dict[tuple[int, ...], int] = field(default_factory=dict)
    parts: dict[tuple[int, int], int] = field(default_factory=dict)  # a part of a sector: one face at one node
    node_of: list[int] = field(default_factory=list)
    face_of: list[int] = field(default_factory=list)
    triangles: list[tuple[int, int, int]] = field(default_factory=list)
    cells: list[tuple[int, int]] = field(default_factory=list)
    corners: list[tuple[int, ...]] = field(default_factory=list)  # of cells, and of triangles that are alone
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
        parts = np.array(self.triangles)
        angle, rank = self._angles(flat)
        normal = np.cross(axes[..., 0], axes[..., 1])
        sector, mean = self._sectors(normal)
        curved = bool((np.einsum("si,si->s", normal, mean[sector]) < 1.0 - _COPLANAR).any())
        # the part with the first slope of the highest rank gives the slopes of its sector
        order = np.lexsort((np.arange(len(rank)), -rank, sector))
        lead = order[np.searchsorted(sector[order], np.arange(len(mean)))]
        along = _directions(axes, angle)
        lines = self._first_slopes(along, rank, sector, lead, mean)
        slopes = np.stack([lines, np.cross(mean, lines)], axis=1)
        own = np.flatnonzero((along != lines[sector]).any(axis=1))
        back = _tilted(lines[sector[own]], mean[sector[own]], normal[own])
        angle[own] = np.arctan2(*np.einsum("sij,si->js", axes[own], back)[::-1])
        first: dict[int, int] = {}
        owner = np.array([first.setdefault(node, k) for k, node in enumerate(node_of[lead].tolist())])
        vertices = np.array([first[self.nodes[v,]] for v in range(len(self.fine.vertices))])
        pieces = [max(1, len(face) - 2) if len(face) > 4 else 1 for face in self.pattern.faces]
        facet = np.repeat(np.arange(len(pieces)), pieces)[face_of[parts[:, 0]]]
        triangles = sector[parts]
        return FacetMesh(
            positions[lead], slopes, owner, triangles, flat[parts], angle[parts], vertices, facet,
            self._edges(triangles, sector), curved, self._creases(flat, angle, sector),
            np.array(self.cells, dtype=np.int64).reshape(-1, 2),
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

    def _part(self, face: int, node: int) -> int:
        if (face, node) not in self.parts:
            self.parts[face, node] = len(self.node_of)
            self.node_of.append(node)
            self.face_of.append(face)
        return self.parts[face, node]

    def _shares(self, count: int) -> np.ndarray:
        """Positions of the divisions of an edge, from 0 to 1."""
        return 0.5 * (1.0 + graded(np.linspace(-1.0, 1.0, count + 1), self.grading))

    def _side(self, face: int, a: int, b: int) -> list[int]:
        """Parts of a face along its edge from vertex a to b."""
        low, high = _pair(a, b)
        start, end = self.fine.vertices[low], self.fine.vertices[high]
        count = self.divisions[low, high]
        keys = [(low,), *((low, high, i) for i in range(1, count)), (high,)]
        parts = self._shares(count).tolist()
        line = [self._part(face, self._node(key, start + (end - start) * x)) for x, key in zip(parts, keys, strict=True)]
        self.of_edge.setdefault((low, high), {})[face] = line
        return line if a < b else line[::-1]

    def _triangle(self, number: int, face: tuple[int, ...]) -> np.ndarray:
        """Grid (n + 1, n + 1) of parts in a triangle; -1 outside."""
        a, b, c = face
        count = self.divisions[_pair(a, b)]
        pa, pb, pc = self.fine.vertices[list(face)]
        grid = np.full((count + 1, count + 1), -1, dtype=np.int64)
        grid[:, 0] = self._side(number, a, b)
        grid[0] = self._side(number, a, c)
        grid[np.arange(count, -1, -1), np.arange(count + 1)] = self._side(number, b, c)
        parts = self._shares(count)
        for i in range(1, count):
            for j in range(1, count - i):
                shares = parts[[count - i - j, i, j]]  # on an edge their sum is 1
                place = shares @ np.array([pa, pb, pc]) / shares.sum()
                grid[i, j] = self._part(number, self._node((-1, number, i, j), place))
        return grid

    def _quadrilateral(self, number: int, face: tuple[int, ...]) -> np.ndarray:
        """Grid of parts in a quadrilateral."""
        a, b, c, d = face
        m, n = self.divisions[_pair(a, b)], self.divisions[_pair(b, c)]
        pa, pb, pc, pd = self.fine.vertices[list(face)]
        grid = np.full((m + 1, n + 1), -1, dtype=np.int64)
        grid[:, 0], grid[:, n] = self._side(number, a, b), self._side(number, d, c)
        grid[0], grid[m] = self._side(number, a, d), self._side(number, b, c)
        along, across = self._shares(m).tolist(), self._shares(n).tolist()
        for i in range(1, m):
            for j in range(1, n):
                x, y = along[i], across[j]
                place = (1 - x) * (1 - y) * pa + x * (1 - y) * pb + x * y * pc + (1 - x) * y * pd
                grid[i, j] = self._part(number, self._node((-1, number, i, j), place))
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
                        self.corners += self.triangles[-1 - (c >= 0) :]
                    continue
                at = [self.places[self.node_of[s]] for s in (a, b, c, d)]
                ac, bd = float(np.linalg.norm(at[0] - at[2])), float(np.linalg.norm(at[1] - at[3]))
                first = (i + j) % 2 == 0 if abs(ac - bd) < _EQUAL * (ac + bd) else ac < bd
                self.cells.append((len(self.triangles), len(self.triangles) + 1))
                self.corners.append((a, b, c, d))
                self.triangles += [(a, b, c), (a, c, d)] if first else [(a, b, d), (b, c, d)]

    # slopes -----------------------------------------------------------------------------------------------------------

    def _sectors(self, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sector of each part, and unit normals of the sectors; `normal` (p, 3): unit normals of the parts.

        The parts of a node that lines without folds connect are one sector, if their normals differ little from their mean.
        """
        above = list(range(len(self.node_of)))

        def top(part: int) -> int:
            while above[part] != part:
                part = above[part]
            return part

        for number, line in self._lines():
            if self.fine.assignment[number] not in self.folding + "BC":
                one, *others = self.of_edge[_pair(*line)].values()
                for other in others:
                    for pair in zip(one, other, strict=True):
                        low, high = sorted(map(top, pair))
                        above[high] = low
        root = np.array([top(part) for part in above])
        mean = np.zeros_like(normal)
        np.add.at(mean, root, normal)
        for part, axis in self._mirrored():
            mean[root[part], axis] = 0.0  # the mean with the images of the faces
        mean /= np.maximum(np.linalg.norm(mean, axis=1), np.finfo(float).tiny)[:, None]
        far = np.einsum("pi,pi->p", normal, mean[root]) < _SMOOTH
        apart = np.isin(root, root[far])
        root = np.where(apart, np.arange(len(root)), root)
        mean[apart] = normal[apart]
        roots, sector = np.unique(root, return_inverse=True)
        mean = mean[roots]
        tilted = np.einsum("pi,pi->p", normal, mean[sector]) < 1.0 - _COPLANAR
        flat = np.bincount(sector, tilted) == 0
        mean[flat] = normal[roots[flat]]
        return sector, mean if flat.all() else self._on_surface(normal, sector, mean)

    def _mirrored(self) -> Iterator[tuple[int, int]]:
        """Parts on edges in planes of symmetry, and the axes of these planes."""
        for vertices, axis in self.mirrors.items():
            for _, line in self._outline(vertices):
                for part in line:
                    yield part, axis

    def _on_surface(self, normal: np.ndarray, sector: np.ndarray, mean: np.ndarray) -> np.ndarray:
        """Unit normals of the sectors: those of the curved surface through their nodes, beside faces that are single cells
        across their curved lines; `mean` elsewhere.
        """
        bent = set()
        for pair, (one, *others) in ((pair, list(lines.values())) for pair, lines in self.of_edge.items()):
            smooth = [other for other in others if (sector[one] == sector[other]).any()]
            if any(normal[one[0]] @ normal[other[0]] < 1.0 - _COPLANAR for other in smooth):
                bent.add(pair)
        for vertices, axis in self.mirrors.items():
            bent |= {pair for pair, line in self._outline(vertices) if abs(normal[line[0], axis]) > math.sqrt(_COPLANAR)}
        small = np.ones(len(self.fine.faces), dtype=bool)
        for number, face in enumerate(self.fine.faces):
            sides = [_pair(*side) for side in _sides(face)]
            across = [sides[k - 1] for k, side in enumerate(sides) if side in bent]
            small[number] = all(self.divisions[side] == 1 for side in across)
        corners = [tuple(sector[list(cell)].tolist()) for cell in self.corners]
        usable = small[[self.face_of[cell[0]] for cell in self.corners]]
        lead = np.full(len(mean), -1)
        lead[sector] = np.arange(len(sector))
        images: dict[int, frozenset[int]] = {}
        for part, axis in self._mirrored():
            if abs(mean[sector[part], axis]) < _COPLANAR:
                images[int(sector[part])] = images.get(int(sector[part]), frozenset()) | {axis}
        places = np.array(self.places)[np.array(self.node_of)[lead]]
        found = smooth_normals(places, corners, usable, mean, images)
        far = np.bincount(sector, np.einsum("pi,pi->p", normal, found[sector]) < _SMOOTH) > 0
        return np.where(far[:, None], mean, found)

    def _first_slopes(
        self, along: np.ndarray, rank: np.ndarray, sector: np.ndarray, lead: np.ndarray, mean: np.ndarray
    ) -> np.ndarray:
        """First slope of each sector, (s, 3), along its line of highest rank; on a curved boundary along the mean of both
        edges. `along` (p, 3): directions of the lines of the parts.
        """
        out = np.einsum("pi,pi->p", along, mean[sector])
        along = along - out[:, None] * mean[sector]
        along[out != 0.0] /= np.linalg.norm(along[out != 0.0], axis=1)[:, None]
        first = along[lead]
        cosine = np.einsum("pi,pi->p", along, first[sector])
        on = (rank == rank[lead][sector]) & (rank >= _BOUNDARY) & (np.abs(cosine) > _ONE_LINE)
        total, same = np.zeros_like(first), np.copysign(1.0, cosine[on])[:, None] * along[on]
        np.add.at(total, sector[on], same)
        bent = np.bincount(sector[on], np.linalg.norm(same - first[sector[on]], axis=1) > _COPLANAR, len(first)) > 0
        first[bent] = total[bent] / np.linalg.norm(total[bent], axis=1)[:, None]
        return first

    # edges ------------------------------------------------------------------------------------------------------------

    def _lines(self) -> list[tuple[int, tuple[int, int]]]:
        """Number and both vertices of each edge of the pattern with bend lines."""
        return [(number, (int(a), int(b))) for number, (a, b) in enumerate(self.fine.edges.tolist())]

    def _angles(self, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angle of the first slope of each part, and its rank. If the node lies on an edge of its face, the slope is along
        this edge; planes of symmetry and boundaries have the highest ranks, and lines that do not fold the lowest.
        """
        angle, rank = np.zeros(len(flat)), np.zeros(len(flat), dtype=np.int64)
        letters = {_pair(*line): self.fine.assignment[number] for number, line in self._lines()}
        ranks = {
            pair: _BOUNDARY if len(of_face) == 1 else 2 if letters[pair] in self.folding + "BC" else 1
            for pair, of_face in self.of_edge.items()
        }
        ranks |= {pair: _BOUNDARY + 1 for vertices in self.mirrors for pair, _ in self._outline(vertices)}
        for pair in sorted(ranks, key=lambda one: ranks[one]):
            for line in self.of_edge[pair].values():
                x, y = flat[line[-1]] - flat[line[0]]
                angle[line], rank[line] = math.atan2(y, x), ranks[pair]
        return angle, rank

    def _edges(self, triangles: np.ndarray, sector: np.ndarray) -> dict[str, np.ndarray]:
        """Named edges: all edges of one face between two vertices of a group of the pattern."""
        known: dict[tuple[int, int], tuple[int, int]] = {}
        for number, (a, b, c) in enumerate(triangles.tolist()):
            for k, pair in enumerate(((a, b), (b, c), (c, a))):
                known[_pair(*pair)] = number, k
        found = {}
        for name in self.pattern.groups:
            lines = [sector[line].tolist() for _, line in self._outline(self.pattern.groups[name])]
            edges = [known[_pair(a, b)] for line in lines for a, b in pairwise(line)]
            if edges:
                found[name] = np.array(edges, dtype=np.int64)
        return found

    def _outline(self, vertices: Iterable[int]) -> Iterator[tuple[tuple[int, int], list[int]]]:
        """Vertices and parts of the edges of single faces between two of some vertices of the pattern."""
        members = set(vertices)
        for pair, of_face in sorted(self.of_edge.items()):
            if len(of_face) == 1 and members.issuperset(pair):
                yield pair, next(iter(of_face.values()))

    def _creases(self, flat: np.ndarray, angle: np.ndarray, sector: np.ndarray) -> tuple[MeshCrease, ...]:
        """Nodes along the creases where both sides have separate slopes, with the slopes across and along each crease."""
        found = []
        faces = self.fine.edge_faces
        for number in self.fine.creases.tolist():
            a, b = (int(v) for v in self.fine.edges[number])
            low, high = _pair(a, b)
            lines = np.array([self.of_edge[low, high][int(face)][:: 1 if a < b else -1] for face in faces[number]])
            separate = np.flatnonzero(sector[lines[0]] != sector[lines[1]])
            if not len(separate):
                continue
            directions = []
            for line in lines:
                x, y = flat[line[-1]] - flat[line[0]]
                turned = math.atan2(y, x) - angle[line]
                directions.append(np.stack([np.cos(turned), np.sin(turned)], axis=-1))
            steps = np.diff(self._shares(lines.shape[1] - 1))
            share = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
            length = float(np.linalg.norm(self.fine.vertices[b] - self.fine.vertices[a]))
            along = np.stack(directions, axis=1)[separate]
            found.append(MeshCrease(number, sector[lines].T[separate], along, share[separate] * length))
        return tuple(found)


def _directions(axes: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) at angles (n,) from the first of the axes (n, 3, 2)."""
    return np.asarray(np.einsum("sij,sj->si", axes, np.stack([np.cos(angle), np.sin(angle)], axis=-1)))


def _tilted(vector: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) after the shortest rotations that turn unit vectors `start` (n, 3) to `end`; these are not opposite."""
    axis = np.cross(start, end)
    turned = np.cross(axis, vector)
    cosine = np.einsum("ni,ni->n", start, end)
    return np.asarray(vector + turned + np.cross(axis, turned) / (1.0 + cosine)[:, None])
