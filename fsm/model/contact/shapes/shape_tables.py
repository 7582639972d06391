"""Tables of rounded points, shapes and edges for contact, built from plates and obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fsm.interactions.contact.shapes import EdgePairs, Edges, Points, Shapes
from fsm.interactions.shapes.shape_distance import BOX, CYLINDER, HALF_SPACE, POLYGON, RECTANGLE, SPHERE
from fsm.kernels.rotation import rotation_matrix
from fsm.model.contact.crease_clearance import Tapers


@dataclass(frozen=True)
class Shape:
    """Shape fixed to a body.

    Attributes
    ----------
    body : int
    kind, size : as in `fsm.interactions.shapes.shape_distance`, m
    radius : m
        Rounding, added on all sides; half the thickness of a plate.
    offset : m, body axes
    orientation : unit quaternion, the shape's axes in the body's
    rim : bool for each side of a polygon
        Whether the side is an edge of the facet; other sides are inside the facet.
    """

    body: int
    kind: int
    size: tuple[float, ...]
    radius: float = 0.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    rim: tuple[bool, ...] = ()

    @property
    def corners(self) -> np.ndarray:
        """Corners (k, 2) of a polygon, m."""
        return np.array(self.size[1:]).reshape(-1, 2)

    @property
    def flat(self) -> bool:
        """Whether the shape is a plate: a rectangle or a polygon."""
        return self.kind in (RECTANGLE, POLYGON)

    @property
    def face(self) -> float:
        """Area of a plate, of the largest face of a solid, or of its section, m^2."""
        if self.kind == POLYGON:
            x, y = self.corners.T
            return float(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
        x, y, z = self.size
        if self.kind == HALF_SPACE:
            return math.inf
        if self.kind == SPHERE:
            return math.pi * x**2
        if self.kind == CYLINDER:
            return max(4.0 * x * y, math.pi * x**2)
        return 4.0 * max(x * y, y * z, x * z) if self.kind == BOX else 4.0 * x * y

    @property
    def length(self) -> float:
        """Length of a rectangle, longest diagonal or side of a polygon, or longest dimension of a solid, m."""
        if self.kind == POLYGON:
            return float(np.linalg.norm(self.corners[:, None] - self.corners[None], axis=2).max())
        return 2.0 * (self.size[0] if self.kind == RECTANGLE else max(self.size))

    @property
    def smallest(self) -> float:
        """Half of the shorter side of a rectangle, or of the area over the length of a polygon, m."""
        return self.face / self.length / 2.0 if self.kind == POLYGON else min(self.size[:2])

    def in_body(self, local: np.ndarray) -> np.ndarray:
        """Transform points (..., 3) from the shape's axes to the body's axes."""
        turned = local @ rotation_matrix(np.array(self.orientation)).T
        return np.asarray(self.offset + turned)


class Units(NamedTuple):
    """Pairs of shapes whose points and edges may touch each other.

    Attributes
    ----------
    shapes : (u, 2) int array
    share : (u, 5) array
        Factors of the weights for tilted faces. The columns are: face points and axis points of the first shape, face points
        and axis points of the second shape, and pairs of edges. A shape with factor zero has no probes on the other.
    whole : (u, 2) array, m^2
        Areas of the complete faces to which the shapes belong, for plates.
    area : (u, 2) array
        Factor that converts the weight of a point of either shape to an area, m^2.
    pair : (u,) int array
        Contact pair of the scene.
    key : (u,) int array
        Constant key that does not change at a renewal, ascending.
    """

    shapes: np.ndarray
    share: np.ndarray
    whole: np.ndarray
    area: np.ndarray
    pair: np.ndarray
    key: np.ndarray


class Tables(NamedTuple):
    """All slots of some units.

    A slot is a point against a shape or, numbered after all points, a pair of edges.

    Attributes
    ----------
    units : (u, 2) int array
        Shapes.
    point_start, pair_start : (u + 1,) int arrays
        First point and first pair of edges of every unit.
    unit, column, weight : (n_slots,) arrays
        Row of the unit, column of its factors, and weight of the slot.
    share, area, pair, key : (n_slots,) arrays
        Fraction of a face, area that the slot represents (m^2), number of the contact pair, and constant key.
    taper : (n_slots,) array
        Gap at which the slot touches, relative to the sum of both roundings; below 1 near a common crease.
    """

    shapes: Shapes
    points: Points
    edges: Edges
    edge_pairs: EdgePairs
    units: np.ndarray
    point_start: np.ndarray
    pair_start: np.ndarray
    unit: np.ndarray
    column: np.ndarray
    weight: np.ndarray
    share: np.ndarray
    area: np.ndarray
    pair: np.ndarray
    key: np.ndarray
    taper: np.ndarray


class TableBuilder:
    """Builder of the tables of shapes, points and edges.

    In the plane, shapes are cut by y = 0, and their edges are points.
    """

    def __init__(self, spatial: bool) -> None:
        self.spatial = spatial
        self.shapes: list[Shape] = []
        self._edges: list[tuple[int, int, np.ndarray, np.ndarray, float, float]] = []
        self._points: list[tuple[int, np.ndarray, float, np.ndarray, bool, bool]] = []

    def add_shape(self, shape: Shape) -> int:
        """Add a shape; returns its number."""
        self.shapes.append(shape)
        return len(self.shapes) - 1

    def add_edges(self, number: int, ends: np.ndarray) -> None:
        """Add edges to a shape by their ends (n, 2, 3) in its axes, m."""
        shape = self.shapes[number]
        for start, end in shape.in_body(ends):
            along = end - start
            length = float(np.linalg.norm(along))
            self._edges.append((number, shape.body, (start + end) / 2, along / length, length / 2, shape.radius))

    def add_points(
        self, number: int, local: np.ndarray, radius: float, weight: np.ndarray, on_axis: bool = False, turns: bool = False
    ) -> None:
        """Add points (n, 3) to a shape in its axes, with rounding, m, and weights (n,); `on_axis` for a cylinder's axis.

        Points that turn are on circles about y, at their angle from the lowest point of the circle (`Points.around`).
        """
        self._points.append((number, local, radius, weight, on_axis, turns))

    def kit(self) -> Kit:
        """Build the tables."""
        points = sorted(self._points, key=lambda row: row[0])
        edges = sorted(self._edges, key=lambda row: row[0])
        lengths = [len(local) for _, local, *_ in points]
        around = [_circles(self.shapes[row[0]], row[1], row[5] and self.spatial) for row in points]
        places = np.concatenate([np.zeros((0, 3)), *(places for places, _ in around)])
        numbers = np.arange(len(self.shapes) + 1)
        owner = np.repeat(np.array([number for number, *_ in points], dtype=np.int64), lengths)
        return Kit(
            self._shape_table(),
            np.searchsorted(owner, numbers),
            places if self.spatial else np.ascontiguousarray(places[:, [0, 2]]),
            np.repeat(np.array([row[2] for row in points]), lengths),
            np.concatenate([np.zeros((0, 3, 3)), *(circles for _, circles in around)]),
            np.concatenate([np.zeros(0), *(row[3] for row in points)]),
            np.concatenate([np.zeros((0, 3)), *(local for _, local, *_ in points)]),
            np.repeat(np.array([row[4] for row in points], dtype=np.bool_), lengths),
            Solids(
                _sizes(self.shapes),
                np.array([shape.offset for shape in self.shapes]).reshape(-1, 3),
                np.array([rotation_matrix(np.array(shape.orientation)) for shape in self.shapes]).reshape(-1, 3, 3),
            ),
            np.searchsorted(np.array([row[0] for row in edges], dtype=np.int64), numbers),
            Edges(
                np.array([row[1] for row in edges], dtype=np.int64),
                np.array([row[2] for row in edges]).reshape(-1, 3),
                np.array([row[3] for row in edges]).reshape(-1, 3),
                np.array([row[4] for row in edges]),
                np.array([row[5] for row in edges]),
            ),
        )

    def _shape_table(self) -> Shapes:
        size = _sizes(self.shapes)
        kind = np.array([shape.kind for shape in self.shapes], dtype=np.int64)
        offset = np.array([shape.offset for shape in self.shapes]).reshape(-1, 3)
        frame = np.array([rotation_matrix(np.array(shape.orientation)) for shape in self.shapes]).reshape(-1, 3, 3)
        if not self.spatial:
            size[(kind != SPHERE) & (kind != HALF_SPACE), 1] = np.inf
            offset = np.ascontiguousarray(offset[:, [0, 2]])
            frame = np.arctan2(-frame[:, 2, 0], frame[:, 0, 0])
        return Shapes(
            np.array([shape.body for shape in self.shapes], dtype=np.int64),
            kind,
            size,
            offset,
            frame,
            np.array([shape.radius for shape in self.shapes]),
        )


def _circles(shape: Shape, local: np.ndarray, turns: bool) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) in body axes of fixed points, or of the centres of circles of points that turn; `Points.around`."""
    around = np.zeros((len(local), 3, 3))
    if not turns:
        return shape.in_body(local), around
    radius, axes = np.hypot(local[:, 0], local[:, 2]), rotation_matrix(np.array(shape.orientation))
    around[:, 0], around[:, 1] = radius[:, None] * axes[:, 0], radius[:, None] * axes[:, 2]
    around[:, 2, 0], around[:, 2, 1] = local[:, 0] / radius, local[:, 2] / radius
    # the lowest point of the rim becomes the nearest one where it is not over the other shape
    around[:, 2, 2] = (around[:, 2, 0] == 1.0) & (radius == shape.size[0])
    return shape.in_body(local * [0.0, 1.0, 0.0]), around


def _sizes(shapes: list[Shape]) -> np.ndarray:
    """Sizes (s, 3) of shapes, with more columns if there are polygons."""
    out = np.zeros((len(shapes), max((len(shape.size) for shape in shapes), default=3)))
    for row, shape in zip(out, shapes, strict=True):
        row[: len(shape.size)] = shape.size
    return out


class Solids(NamedTuple):
    """Shapes in space, also for a plane motion: half sizes, positions and axes in their bodies."""

    size: np.ndarray
    offset: np.ndarray
    axes: np.ndarray


class Kit(NamedTuple):
    """Shapes with their points and edges, from which the tables of units are built.

    Attributes
    ----------
    point_start, edge_start : (s + 1,) int arrays
        First point and first edge of every shape.
    place, radius, around, weight : (p, 2 or 3), (p,), (p, 3, 3), (p,) arrays
        Position in body axes (m), rounding (m), circle (`Points.around`) and weight of the points.
    local, on_axis : (p, 3), (p,) arrays
        Positions of the points in the axes of their shapes, m, and whether they lie on the axis of a cylinder.
    solids : shapes in space
    tapers, edge_tapers : Tapers
        Clearances near common creases: of points at bodies, and of edges at edges.
    """

    shapes: Shapes
    point_start: np.ndarray
    place: np.ndarray
    radius: np.ndarray
    around: np.ndarray
    weight: np.ndarray
    local: np.ndarray
    on_axis: np.ndarray
    solids: Solids
    edge_start: np.ndarray
    edges: Edges
    tapers: Tapers = Tapers.none()
    edge_tapers: Tapers = Tapers.none()

    def tables(self, units: Units) -> Tables:
        """Slots of some units: points of the first shape, then of the second; all pairs of edges."""
        owner, other = units.shapes.ravel(), units.shapes[:, ::-1].ravel()
        probes = (units.share[:, [0, 2]] > 0.0).ravel()
        lengths = np.where(probes, np.diff(self.point_start)[owner], 0)
        rows, side = ranges(self.point_start, owner[probes]), np.repeat(np.arange(len(owner)), lengths)
        shape = np.ascontiguousarray(other[side])
        taper, of_shape = self.tapers.of(rows, self.shapes.body[shape]), self.shapes.radius[shape]
        radius = self.radius[rows] - (1.0 - taper) * (self.radius[rows] + of_shape)
        points = Points(self.shapes.body[owner][side], self.place[rows], radius, shape, self.around[rows])
        point_start = np.concatenate([[0], np.cumsum(lengths.reshape(-1, 2).sum(axis=1))])
        weight, of_point = self.weight[rows], side // 2
        edge_pairs, pair_start, of_pair, taper_of_pair = self._edge_pairs(units.shapes)
        column = np.concatenate([2 * (side % 2) + self.on_axis[rows], np.full(len(of_pair), 4)])
        area = np.concatenate([weight * units.area.ravel()[side], np.zeros(len(of_pair))])
        unit = np.concatenate([of_point, of_pair])
        place = np.concatenate(
            [
                np.arange(len(of_point)) - point_start[of_point],
                np.diff(point_start)[of_pair] + np.arange(len(of_pair)) - pair_start[of_pair],
            ]
        )
        key = units.key[unit] * self._most_slots + place
        weight = np.concatenate([weight, np.ones(len(of_pair))])
        return Tables(
            self.shapes, points, self.edges, edge_pairs, units.shapes, point_start, pair_start, unit, column, weight,
            weight * units.share[unit, column], area, units.pair[unit], key, np.concatenate([taper, taper_of_pair]),
        )  # fmt: skip

    def slots_of(self, shapes: np.ndarray) -> int:
        """Largest number of slots of pairs (u, 2) of shapes."""
        points, edges = np.diff(self.point_start)[shapes], np.diff(self.edge_start)[shapes]
        return int(points.sum() + edges.prod(axis=1).sum())

    @property
    def _most_slots(self) -> int:
        """Largest number of slots in a unit."""
        points, edges = np.diff(self.point_start).max(initial=0), np.diff(self.edge_start).max(initial=0)
        return int(2 * points + edges**2)

    def _edge_pairs(self, shapes: np.ndarray) -> tuple[EdgePairs, np.ndarray, np.ndarray, np.ndarray]:
        """Pairs of edges of units, the first of each unit (u + 1,), and the unit and taper of each."""
        number, edges = np.diff(self.edge_start), self.edges
        across = number[shapes[:, 1]]
        lengths = number[shapes[:, 0]] * across
        start = np.concatenate([[0], np.cumsum(lengths)])
        unit = np.repeat(np.arange(len(shapes)), lengths)
        one, two = np.divmod(np.arange(start[-1]) - start[unit], np.maximum(across[unit], 1))
        one, two = one + self.edge_start[shapes[unit, 0]], two + self.edge_start[shapes[unit, 1]]
        taper = self.edge_tapers.of(one, two)
        clearance = taper * (edges.radius[one] + edges.radius[two])
        return EdgePairs(np.column_stack([one, two]), nearly_parallel(edges, one, two), clearance), start, unit, taper


def nearly_parallel(edges: Edges, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Bound of |t_1 x t_2|^2 below which pairs of edges count as nearly parallel.

    The bound is reached if one edge rises over the other, from its middle to its end, by the sum of both roundings. Below
    it the points along the edges have contact.
    """
    sine = (edges.radius[one] + edges.radius[two]) / np.minimum(edges.half[one], edges.half[two])
    return np.asarray(np.clip(sine, 1e-3, 0.2) ** 2)


def ranges(start: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Concatenated integer ranges start[r] ... start[r + 1] - 1 of the given rows."""
    lengths = start[rows + 1] - start[rows]
    offsets = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    return np.repeat(start[rows], lengths) + offsets


def shape_edges(shape: Shape) -> np.ndarray:
    """Straight edges of a polygon (on its rim), a rectangle (4) or a box (12) in its own axes, (n, 2, 3), m."""
    size = np.array(shape.size)
    if shape.kind == POLYGON:
        outline = np.column_stack([shape.corners, np.zeros(len(shape.corners))])
        sides = np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)
        return sides[np.array(shape.rim)]
    ends = []
    for axis in range(3):
        if size[axis] == 0.0:
            continue
        others = [c for c in range(3) if c != axis]
        corners = {(i * size[others[0]], j * size[others[1]]) for i in (-1, 1) for j in (-1, 1)}
        for u, v in sorted(corners):
            start = np.zeros(3)
            start[others] = u, v
            end = start.copy()
            start[axis], end[axis] = -size[axis], size[axis]
            ends.append((start, end))
    return np.array(ends)


def as_rectangle(body: int, length: float, width: float, thickness: float) -> Shape:
    """Plate centred in its body's x-y plane, with edges rounded by half its thickness."""
    return Shape(body, RECTANGLE, (length / 2, width / 2, 0.0), thickness / 2)


def as_polygon(body: int, corners: np.ndarray, rim: tuple[bool, ...], thickness: float) -> Shape:
    """Convex polygon in its body's x-y plane, with edges rounded by half its thickness.

    Parameters
    ----------
    body : int
    corners : (k, 2) array, m
        Counterclockwise, in body axes, at most `MOST_CORNERS`.
    rim : k bool
        Whether the sides from each corner to the next are edges of the facet.
    thickness : float, m
    """
    return Shape(body, POLYGON, (float(len(corners)), *corners.ravel().tolist()), thickness / 2, rim=rim)
