"""Mesh of triangles of flexible facets: nodes with slopes, edges by name, and points on it.

A node has one position. Facets that fold along creases have separate slopes at their common nodes: each part of the sheet
around a node with one pair of slopes is a sector. Vectors are numbered by sectors: 3 s is the position of sector s, 3 s + 1
and 3 s + 2 are its slopes along two orthogonal directions. All sectors of a node use the position of the first one.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

MOST_TRIANGLES = 100_000
"""Largest number of triangles of a sheet."""
_ALIGNED = 0.1
"""Sine of the angle between an edge and a slope below which the slope counts as along the edge.

The angle is zero to round-off except at corners, where the chord of a curved edge differs from its tangent. A support that
held both slopes there would clamp the corner.
"""
_SMOOTH = 0.7
"""Cosine of the angle between two edges above which they form one smooth line."""
_CONVEX = 0.01
"""Least area of the triangles beside either diagonal of a cell, relative to the cell, for a mean of both diagonals."""
_LONG = 10**12
_GAUSS = 0.5 - 0.5 / np.sqrt(3.0)


def many(number: int) -> str:
    """Text of a number with commas; very large numbers in scientific notation."""
    return f"{number:,}" if number < _LONG else "10^" + str(len(str(number)) - 1)


def graded(place: np.ndarray, grading: float | np.ndarray) -> np.ndarray:
    """Positions from -1 to 1 of a uniform mesh, moved towards both ends: (1 - g) x + g sin(pi x/2) with the grading g."""
    return np.asarray((1.0 - grading) * place + grading * np.sin(0.5 * np.pi * place))


class MeshPoint(NamedTuple):
    """Point of the mesh: numbers of vectors, and their factors in the position and in two slopes; a point with zero slopes
    has no axes.
    """

    vectors: np.ndarray
    weights: np.ndarray
    along: np.ndarray
    across: np.ndarray


def line_mean(parts: Sequence[tuple[MeshPoint, float, float]]) -> MeshPoint:
    """Mean of a line: mean position, slope of the linear fit of the positions along the line, and mean slope across it.

    Parameters
    ----------
    parts : Gauss points of the line, each with its place along the line, m from the middle, and its length, m
    """
    whole = sum(length for _, _, length in parts)
    vectors, index = np.unique(np.concatenate([point.vectors for point, _, _ in parts]), return_inverse=True)
    shares = [length / whole for _, _, length in parts]
    weights = [share * point.weights for share, (point, _, _) in zip(shares, parts, strict=True)]
    along = [12.0 * place / whole**2 * weight for weight, (_, place, _) in zip(weights, parts, strict=True)]
    across = [share * point.across for share, (point, _, _) in zip(shares, parts, strict=True)]
    sums = (np.bincount(index, np.concatenate(part), len(vectors)) for part in (weights, along, across))
    return MeshPoint(vectors, *sums)


class MeshCrease(NamedTuple):
    """Nodes along a crease.

    Attributes
    ----------
    edge : number of the edge in the pattern
    sectors : (k, 2) int array
        Sectors of the left and of the right facet at each node.
    along : (k, 2, 2) array
        Direction of the crease by the slopes of these sectors.
    lengths : (k,) array, m
        Length of the crease that each node represents.
    """

    edge: int
    sectors: np.ndarray
    along: np.ndarray
    lengths: np.ndarray


class MeshFaces(NamedTuple):
    """Triangles of a surface of the mesh in arrays as of `FacetMesh`, with the part `weight` (m,) of each in the surface."""

    triangles: np.ndarray
    plane: np.ndarray
    angle: np.ndarray
    weight: np.ndarray
    facet: np.ndarray


@dataclass(frozen=True, eq=False)
class FacetMesh:
    """Triangles of all facets; see the module docstring.

    Attributes
    ----------
    positions : (s, 3) array, m
        Position of each sector at the start; sectors of one node have equal positions.
    slopes : (s, 2, 3) array
        Slopes of each sector at the start.
    owner : (s,) int array
        First sector of the node that a sector belongs to.
    triangles : (m, 3) int array
        Sectors at the corners, counter-clockwise in the plane of the facet.
    plane : (m, 3, 2) array, m
        Corners in the flat facet.
    angle : (m, 3) array, rad
        Angle between the first slope of each corner and the first axis of the facet.
    vertices : (v,) int array
        One sector of each vertex of the pattern.
    facet : (m,) int array
        Facet of the pattern of each triangle.
    edges : named edges, (k, 2) int arrays of triangle and number of the edge in the triangle (the edge starts at the corner
    of this number)
    curved : whether the sheet starts curved, with zero stress
    creases : edges between facets with separate slopes
    cells : (c, 2) int array
        Triangles of each cell of four corners, on both sides of its diagonal.
    """

    positions: np.ndarray
    slopes: np.ndarray
    owner: np.ndarray
    triangles: np.ndarray
    plane: np.ndarray
    angle: np.ndarray
    vertices: np.ndarray
    facet: np.ndarray
    edges: Mapping[str, np.ndarray]
    curved: bool = False
    creases: tuple[MeshCrease, ...] = ()
    cells: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))

    @cached_property
    def lengths(self) -> np.ndarray:
        """Length of the edges of each triangle, (m, 3), m."""
        return np.asarray(np.linalg.norm(np.roll(self.plane, -1, axis=1) - self.plane, axis=2))

    @cached_property
    def facet_areas(self) -> np.ndarray:
        """Area of each facet of the pattern, (n,), m^2."""
        along = np.roll(self.plane, -1, axis=1) - self.plane
        areas = 0.5 * (along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0])
        return np.bincount(self.facet, weights=areas)

    @cached_property
    def vectors(self) -> np.ndarray:
        """All vectors at the start, (3 s, 3)."""
        return np.concatenate([self.positions[:, None], self.slopes], axis=1).reshape(-1, 3)

    @property
    def area(self) -> float:
        """Area of all triangles, m^2."""
        return float(self.facet_areas.sum())

    @property
    def nodes(self) -> np.ndarray:
        """Sectors that are the first of their node."""
        return np.flatnonzero(self.owner == np.arange(len(self.owner)))

    @cached_property
    def node_areas(self) -> np.ndarray:
        """Area that each of the `nodes` represents, a third of its triangles, m^2."""
        along = np.roll(self.plane, -1, axis=1) - self.plane
        areas = 0.5 * (along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0])
        owners = self.owner[self.triangles].ravel()
        return np.bincount(owners, np.repeat(areas / 3.0, 3), len(self.owner))[self.nodes]

    @cached_property
    def loaded(self) -> MeshFaces:
        """Surface that carries pressure: the mean of the two surfaces with either diagonal in each convex cell.

        Alternating diagonals join 4 or 8 triangles at a node. On the triangles alone, pressure loads these nodes with 2/3
        and 4/3 of their area, and nodes of a curved surface move in and out in turn. The mean of both diagonals gives each
        corner of a rectangle a quarter of its load.
        """
        first, second = self.triangles[self.cells].swapaxes(0, 1)
        alone = ~(first[:, :, None] == second[:, None, :]).any(axis=2)  # the corner beside the diagonal
        other = ~(second[:, :, None] == first[:, None, :]).any(axis=2)
        start, end = alone.argmax(axis=1), other.argmax(axis=1)
        cell = np.arange(len(self.cells))

        def corners(values: np.ndarray) -> np.ndarray:
            """Values at the corners of the triangles beside the other diagonal, (2 c, 3, ...)."""
            of_first, of_second = values[self.cells[:, 0]], values[self.cells[:, 1]]
            a, b, d = (of_first[cell, (start + k) % 3] for k in range(3))
            c = of_second[cell, end]
            return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])

        plane = corners(self.plane)
        along = np.roll(plane, -1, axis=1) - plane
        areas = 0.5 * (along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0]).reshape(2, -1)
        convex = areas.min(axis=0) > _CONVEX * areas.sum(axis=0)
        weight = np.ones(len(self.triangles))
        weight[self.cells[convex]] = 0.5
        both = np.tile(convex, 2)
        return MeshFaces(
            np.concatenate([self.triangles, corners(self.triangles)[both]]), np.concatenate([self.plane, plane[both]]),
            np.concatenate([self.angle, corners(self.angle)[both]]),
            np.concatenate([weight, np.full(2 * int(convex.sum()), 0.5)]),
            np.concatenate([self.facet, np.tile(self.facet[self.cells[convex, 0]], 2)]),
        )  # fmt: skip

    def depth(self, crease: MeshCrease) -> float:
        """Smallest size across a crease of the triangles beside it, m."""
        on = np.isin(self.triangles, crease.sectors)
        count = on.sum(axis=1)
        k = np.flatnonzero(count == count.max())  # with an edge on the crease, or with its only node
        across = on[k].argmin(axis=1) if count.max() == 2 else on[k].argmax(axis=1)
        one, two = self.plane[k, 1] - self.plane[k, 0], self.plane[k, 2] - self.plane[k, 0]
        double = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
        return float((double / self.lengths[k, (across + 1) % 3]).min())

    def ends(self, edge: np.ndarray) -> np.ndarray:
        """Sectors at both ends of edges (k, 2) of triangles, (k, 2)."""
        triangle, number = edge.T
        return np.stack([self.triangles[triangle, number], self.triangles[triangle, (number + 1) % 3]], axis=1)

    def directions(self, edge: np.ndarray) -> np.ndarray:
        """Directions of edges (k, 2) by the slopes at both ends, (k, 2, 2): end, component."""
        triangle, number = edge.T
        after = (number + 1) % 3
        along = self.plane[triangle, after] - self.plane[triangle, number]
        along /= np.linalg.norm(along, axis=1)[:, None]
        angle = np.stack([self.angle[triangle, number], self.angle[triangle, after]], axis=1)
        c, s = np.cos(angle), np.sin(angle)
        x, y = along[:, 0, None], along[:, 1, None]
        return np.stack([c * x + s * y, -s * x + c * y], axis=-1)

    def along_edges(self, edge: np.ndarray) -> dict[int, set[int]]:
        """Number (0 or 1) of the slope that lies along an edge, by sector; both slopes if the edge lies between them.

        The direction of an edge at a node is that of its chord in the tangent plane of the node. At a node of a curved line,
        the direction of the line is the mean of both edges.
        """
        lines: dict[int, list[np.ndarray]] = {}
        for sectors in self.ends(edge).tolist():
            chord = self.positions[sectors[1]] - self.positions[sectors[0]]
            for sector in sectors:
                direction = self.slopes[sector] @ chord
                lines.setdefault(sector, []).append(direction / np.linalg.norm(direction))
        found: dict[int, set[int]] = {}
        for sector, along in lines.items():
            if len(along) == 2 and abs(cosine := float(along[0] @ along[1])) > _SMOOTH:
                mean = along[0] + math.copysign(1.0, cosine) * along[1]
                along = [mean / np.linalg.norm(mean)]
            for direction in along:
                own = {0} if abs(direction[1]) < _ALIGNED else {1} if abs(direction[0]) < _ALIGNED else {0, 1}
                found.setdefault(sector, set()).update(own)
        return found

    def at_node(self, sector: int, oriented: bool = False) -> MeshPoint:
        """Point at the node of a sector."""
        position = 3 * int(self.owner[sector])
        if not oriented:
            return MeshPoint(np.array([position]), np.ones(1), np.zeros(1), np.zeros(1))
        vectors = np.array([position, 3 * sector + 1, 3 * sector + 2])
        return MeshPoint(vectors, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))

    def on_edge(self, edge: np.ndarray) -> list[tuple[MeshPoint, float]]:
        """Gauss points of one edge (2,) of a triangle, with axes, and the lengths that they represent, m.

        Two points integrate the cubic of the edge exactly.
        """
        half = 0.5 * float(self.lengths[edge[0], edge[1]])
        return [(self.edge_point(edge, x), half) for x in (_GAUSS, 1.0 - _GAUSS)]

    def edge_point(self, edge: np.ndarray, x: float) -> MeshPoint:
        """Point of one edge (2,) of a triangle at the part x of its length, on the cubic of the edge, with axes."""
        (sectors,), (directions,) = self.ends(edge[None]), self.directions(edge[None])
        length = float(self.lengths[edge[0], edge[1]])
        vectors = np.array([v for s in sectors.tolist() for v in (3 * int(self.owner[s]), 3 * s + 1, 3 * s + 2)])
        value = (1 - x) ** 2 * (1 + 2 * x), length * x * (1 - x) ** 2, x * x * (3 - 2 * x), length * x * x * (x - 1)
        slope = (
            6 * x * (x - 1) / length, (1 - x) * (1 - 3 * x), 6 * x * (1 - x) / length, x * (3 * x - 2),
        )  # fmt: skip
        (a, b), (c, d) = directions
        weights = np.array([value[0], value[1] * a, value[1] * b, value[2], value[3] * c, value[3] * d])
        along = np.array([slope[0], slope[1] * a, slope[1] * b, slope[2], slope[3] * c, slope[3] * d])
        across = np.array([0.0, -(1 - x) * b, (1 - x) * a, 0.0, -x * d, x * c])
        return MeshPoint(vectors, weights, along, across)

    def in_box(self, corners: np.ndarray) -> np.ndarray:
        """Owners of the nodes in a box (2, 3) at the start."""
        low, high = corners.min(axis=0), corners.max(axis=0)
        margin = 1e-9 * float(np.ptp(self.positions, axis=0).max())
        own = self.nodes
        inside = ((self.positions[own] >= low - margin) & (self.positions[own] <= high + margin)).all(axis=1)
        return own[inside]


def facet_vectors(mesh: FacetMesh, triangles: np.ndarray | None = None) -> np.ndarray:
    """Numbers (m, 9) of the vectors r, r_1, r_2 at the corners of all triangles, or of given triangles (m, 3) of sectors."""
    sectors = mesh.triangles if triangles is None else triangles
    numbers = np.stack([3 * mesh.owner[sectors], 3 * sectors + 1, 3 * sectors + 2], axis=-1)
    return np.asarray(numbers.reshape(len(sectors), 9))
