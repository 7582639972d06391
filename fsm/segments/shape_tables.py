"""Tables of rounded points, shapes and edges that may touch, put together from plates and obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fsm.interactions.shape_distance import HALF_SPACE, RECTANGLE, SPHERE
from fsm.kernels.rotation import rotation_matrix

__all__ = ["EdgePairs", "Edges", "Points", "Shape", "Shapes", "TableBuilder", "Tables", "as_rectangle", "shape_edges"]


@dataclass(frozen=True)
class Shape:
    """A shape fixed in a body.

    Attributes
    ----------
    body : int
    kind, size : as in `fsm.interactions.shape_distance`, m
    radius : m
        What is added all around; half the thickness of a plate.
    offset : m, body axes
    orientation : unit quaternion, the shape's axes in the body's
    """

    body: int
    kind: int
    size: tuple[float, float, float]
    radius: float = 0.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def in_body(self, local: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the shape's axes in the body's."""
        turned = local @ rotation_matrix(np.array(self.orientation)).T
        return np.asarray(self.offset + turned)


class Shapes(NamedTuple):
    """All shapes; what the kernels of `point_shape_planar` and `point_shape_spatial` take.

    Attributes
    ----------
    body, kind : (s,) int arrays
    size : (s, 3) array, m
    offset : (s, 2 or 3) array, m
    frame : (s,) array of angles, rad, in the plane, (s, 3, 3) rotation matrices in space
    radius : (s,) array, m
    """

    body: np.ndarray
    kind: np.ndarray
    size: np.ndarray
    offset: np.ndarray
    frame: np.ndarray
    radius: np.ndarray


class Points(NamedTuple):
    """Rounded points, each against one shape.

    Attributes
    ----------
    body : (n,) int array
    place : (n, 2 or 3) array, m, body axes
    radius : (n,) array, m
    shape : (n,) int array
    """

    body: np.ndarray
    place: np.ndarray
    radius: np.ndarray
    shape: np.ndarray


class Edges(NamedTuple):
    """Straight edges; see `fsm.interactions.edge_edge`. Attributes have a row an edge."""

    body: np.ndarray
    middle: np.ndarray
    direction: np.ndarray
    half: np.ndarray
    radius: np.ndarray


class EdgePairs(NamedTuple):
    """Edges (k, 2) that may touch, and |t_1 x t_2|^2 (k,) below which they count as nearly parallel."""

    edges: np.ndarray
    parallel: np.ndarray


class Tables(NamedTuple):
    """Everything that may touch.

    A slot is a point against a shape or, numbered after all points, a pair of edges. Slots that can be near only together
    are a unit: those of two shapes.

    Attributes
    ----------
    units : (u, 2) int array
        Shapes.
    point_start, pair_start : (u + 1,) int arrays
        First point and first pair of edges of every unit.
    share, area, pair : (n_slots,) arrays
        Fraction of a face, area that it stands for (m^2), and number of the contact pair.
    """

    shapes: Shapes
    points: Points
    edges: Edges
    edge_pairs: EdgePairs
    units: np.ndarray
    point_start: np.ndarray
    pair_start: np.ndarray
    share: np.ndarray
    area: np.ndarray
    pair: np.ndarray


class TableBuilder:
    """Collects rows; shapes are cut by y = 0 in the plane, and there are no edges there (they are points)."""

    def __init__(self, spatial: bool) -> None:
        self.spatial = spatial
        self.shapes: list[Shape] = []
        self._edges: list[tuple[int, np.ndarray, np.ndarray, float, float]] = []
        self._points: list[tuple[int, np.ndarray, float, int]] = []
        self._pairs: list[tuple[np.ndarray, np.ndarray]] = []
        self._units: list[tuple[int, int]] = []
        self._starts: list[tuple[int, int]] = [(0, 0)]
        self._point_share: list[tuple[np.ndarray, np.ndarray, int]] = []
        self._pair_share: list[tuple[float, int, int]] = []
        self._point_count = self._pair_count = 0

    def add_shape(self, shape: Shape) -> int:
        """Number of the new shape."""
        self.shapes.append(shape)
        return len(self.shapes) - 1

    def add_edges(self, shape: Shape, ends: np.ndarray) -> list[int]:
        """Numbers of the new edges, from their ends (n, 2, 3) in the shape's axes."""
        first = len(self._edges)
        for start, end in shape.in_body(ends):
            along = end - start
            length = float(np.linalg.norm(along))
            self._edges.append((shape.body, (start + end) / 2, along / length, length / 2, shape.radius))
        return list(range(first, len(self._edges)))

    def add_points(
        self,
        owner: int,
        local: np.ndarray,
        radius: float,
        share: np.ndarray,
        area: np.ndarray,
        against: int,
        pair: int,
    ) -> None:
        """Points (n, 3) in the axes of the shape `owner` that probe another shape; to the unit that is open."""
        shape = self.shapes[owner]
        self._points.append((shape.body, shape.in_body(local), radius, against))
        self._point_share.append((share, area, pair))
        self._point_count += len(local)

    def add_edge_pairs(self, first: list[int], second: list[int], share: float, pair: int) -> None:
        """Each edge of one list with each of the other; to the unit that is open."""
        one, two = np.array(first, dtype=np.int64), np.array(second, dtype=np.int64)
        self._pairs.append((np.repeat(one, len(two)), np.tile(two, len(one))))
        self._pair_share.append((share, pair, len(one) * len(two)))
        self._pair_count += len(one) * len(two)

    def close_unit(self, first: int, second: int) -> None:
        """What was added since the last unit is that of these two shapes."""
        self._units.append((first, second))
        self._starts.append((self._point_count, self._pair_count))

    def tables(self) -> Tables:
        """All rows as arrays."""
        starts = np.array(self._starts, dtype=np.int64)
        counts = np.array([len(places) for _, places, _, _ in self._points], dtype=np.int64)
        places = np.concatenate([np.zeros((0, 3)), *(places for _, places, _, _ in self._points)])
        edges = self._edge_table()
        crossings = np.array([count for _, _, count in self._pair_share], dtype=np.int64)
        shares = np.repeat(np.array([share for share, _, _ in self._pair_share]), crossings)
        pairs = [pair for _, _, pair in self._point_share], [pair for _, pair, _ in self._pair_share]
        of_points, of_edges = (np.array(numbers, dtype=np.int64) for numbers in pairs)
        return Tables(
            self._shape_table(),
            Points(
                np.repeat(np.array([body for body, _, _, _ in self._points], dtype=np.int64), counts),
                places if self.spatial else np.ascontiguousarray(places[:, [0, 2]]),
                np.repeat(np.array([radius for _, _, radius, _ in self._points]), counts),
                np.repeat(np.array([against for _, _, _, against in self._points], dtype=np.int64), counts),
            ),
            edges,
            self._edge_pairs(edges),
            np.array(self._units, dtype=np.int64).reshape(-1, 2),
            np.ascontiguousarray(starts[:, 0]),
            np.ascontiguousarray(starts[:, 1]),
            np.concatenate([*(share for share, _, _ in self._point_share), shares]),
            np.concatenate([*(area for _, area, _ in self._point_share), np.zeros(self._pair_count)]),
            np.concatenate([np.repeat(of_points, counts), np.repeat(of_edges, crossings)]),
        )

    def _edge_table(self) -> Edges:
        return Edges(
            np.array([row[0] for row in self._edges], dtype=np.int64),
            np.array([row[1] for row in self._edges]).reshape(-1, 3),
            np.array([row[2] for row in self._edges]).reshape(-1, 3),
            np.array([row[3] for row in self._edges]),
            np.array([row[4] for row in self._edges]),
        )

    def _edge_pairs(self, edges: Edges) -> EdgePairs:
        """They count as nearly parallel when one rises over the other by less than both roundings, from its middle to its
        end: there the points along it touch.
        """
        none = np.zeros(0, dtype=np.int64)
        one, two = (np.concatenate([none, *(both[k] for both in self._pairs)]) for k in (0, 1))
        if not len(one):
            return EdgePairs(np.zeros((0, 2), dtype=np.int64), np.zeros(0))
        sine = (edges.radius[one] + edges.radius[two]) / np.minimum(edges.half[one], edges.half[two])
        return EdgePairs(np.column_stack([one, two]), np.clip(sine, 1e-3, 0.2) ** 2)

    def _shape_table(self) -> Shapes:
        size = np.array([shape.size for shape in self.shapes]).reshape(-1, 3)
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


def shape_edges(shape: Shape) -> np.ndarray:
    """Straight edges of a rectangle (4) or a box (12) in its own axes, (n, 2, 3), m."""
    size = np.array(shape.size)
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
    """A plate centred in its body's x-y plane, its edges rounded by half its thickness."""
    return Shape(body, RECTANGLE, (length / 2, width / 2, 0.0), thickness / 2)
