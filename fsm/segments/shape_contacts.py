"""Rounded points against shapes and edges against edges as a geometry of contact."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions import edge_edge, point_shape_planar, point_shape_spatial
from fsm.interactions.motion import moved_beyond
from fsm.interactions.shape_boxes import shape_boxes_planar, shape_boxes_spatial
from fsm.interactions.shape_distance import HALF_SPACE
from fsm.interactions.sweep import ListedPairs
from fsm.interactions.swept import edges_pass, local_edges, path_poses, points_pass, turn_between
from fsm.segments.contact_geometry import ContactForces, Measured, Touching
from fsm.segments.pattern import BodyPattern
from fsm.segments.shape_tables import Tables

__all__ = ["ShapeContacts"]

Kernel = Callable[..., Any]


class _PointKernels(NamedTuple):
    """The kernels of `point_shape_planar` or `point_shape_spatial`."""

    find: Kernel
    measure: Kernel
    tangent: Kernel
    local: Kernel
    boxes: Kernel


_TANGENT_EDGES: Kernel = edge_edge.tangent_edges

_PLANAR = _PointKernels(
    point_shape_planar.find_points_planar,
    point_shape_planar.measure_points_planar,
    point_shape_planar.tangent_points_planar,
    point_shape_planar.local_points_planar,
    shape_boxes_planar,
)
_SPATIAL = _PointKernels(
    point_shape_spatial.find_points_spatial,
    point_shape_spatial.measure_points_spatial,
    point_shape_spatial.tangent_points_spatial,
    point_shape_spatial.local_points_spatial,
    shape_boxes_spatial,
)


class ShapeContacts:
    """Contacts of all slots of some tables.

    The broad phase keeps the units whose boxes are within the margin of each other, found by a sweep; it is renewed
    when a body has moved by 0.4 of the margin since, so what is found never depends on when that happened.

    Parameters
    ----------
    tables : Tables
    spatial : bool
    margin : float, m
    depth_limit : float, m
        A point with no rounding passes into a solid shape when it goes deeper than this; one with a rounding, when its
        centre goes in.
    """

    def __init__(self, tables: Tables, spatial: bool, margin: float, depth_limit: float) -> None:
        self.tables = tables
        self.spatial = spatial
        self.margin = margin
        self.share, self.area, self.pair = tables.share, tables.area, tables.pair
        self.slips = 3 if spatial else 1
        self._kernels = _SPATIAL if spatial else _PLANAR
        self._count = len(tables.points.body)
        self._limit = np.where(tables.points.radius > 0.0, 0.0, depth_limit)
        shapes = tables.shapes
        self._listed = ListedPairs(tables.units, len(shapes.body))
        # a half-space has no end; where a shape is cut there is none either, but none that moves it
        size = np.where(np.isinf(shapes.size), 0.0, shapes.size)
        size[shapes.kind == HALF_SPACE] = 0.0
        reach = np.linalg.norm(size, axis=1) + np.linalg.norm(shapes.offset, axis=1) + shapes.radius
        self._moving, owner = np.unique(shapes.body, return_inverse=True)
        self._radii = np.zeros(len(self._moving))
        np.maximum.at(self._radii, owner, reach)
        self._reference: np.ndarray | None = None
        self._committed: np.ndarray | None = None
        self._open = np.ones(len(tables.share), dtype=bool)
        self._units = np.zeros(0, dtype=np.int64)
        self._slots = self._slots_of(self._units)
        self._bodies = np.zeros((0, 2), dtype=np.int64)
        self._version = 0

    # broad phase ----------------------------------------------------------------------------------------------------

    def _boxes(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Boxes around all shapes, low and high corners (s, 2 or 3); those of half-spaces are infinite."""
        shapes = self.tables.shapes
        low, high = self._kernels.boxes(
            poses, shapes.body, shapes.kind, shapes.size, shapes.offset, shapes.frame, shapes.radius
        )
        return low, high

    def _slots_of(self, units: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points, and pairs of edges (numbered from 0), of some units."""
        points, edges = _ranges(self.tables.point_start, units), _ranges(self.tables.pair_start, units)
        return points[self._open[points]], edges[self._open[edges + self._count]]

    def leave_out(self, poses: np.ndarray, units: np.ndarray) -> None:
        """Points and edges of some units that lie in each other in these poses never touch: they are joined there."""
        points, edges = self._slots_of(units)
        inside, _ = self._kernels.find(poses, points, *self._point_arguments, 0.0)
        self._open[inside] = False
        if len(edges):
            pairs = self.tables.edge_pairs
            whole = np.zeros(len(pairs.parallel))
            inside, _ = edge_edge.find_edges(poses, edges, pairs.edges, whole, *self.tables.edges, 0.0)
            self._open[inside + self._count] = False
        self._reference, self._version = None, 0

    def _near(self, poses: np.ndarray, reach: float) -> np.ndarray:
        """Units whose shapes may be within reach of each other."""
        low, high = self._boxes(poses)
        return self._listed.overlapping(low - reach / 2, high + reach / 2)

    def _refresh(self, poses: np.ndarray) -> None:
        # both may have moved; the rest of the margin is for small positive bounds
        if self._reference is not None and not moved_beyond(
            poses, self._reference, self._moving, self._radii, 0.4 * self.margin
        ):
            return
        self._reference = poses.copy()
        units = self._near(poses, self.margin)
        if self._version > 0 and np.array_equal(units, self._units):
            return
        self._units = units
        self._slots = self._slots_of(units)
        self._bodies = np.unique(self.tables.shapes.body[self.tables.units[units]], axis=0)
        self._version += 1

    @property
    def refreshes(self) -> int:
        """How often the broad phase was renewed and found something else."""
        return self._version

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """Pairs (m, 2) of bodies that may touch before the next renewal, and a number that changes when they do."""
        self._refresh(poses)
        return self._bodies, self._version

    # narrow phase ---------------------------------------------------------------------------------------------------

    def find(self, poses: np.ndarray, below: float) -> Touching:
        """Slots with a gap below a bound, m: 0 for contacts, larger to see how near others are."""
        self._refresh(poses)
        points, edges = self._slots
        if below > 0.2 * self.margin:
            points, edges = self._slots_of(self._near(poses, below))
        tables = self.tables
        slot, gap = self._kernels.find(poses, points, *self._point_arguments, below)
        if len(edges):
            other, other_gap = edge_edge.find_edges(poses, edges, *tables.edge_pairs, *tables.edges, below)
            slot, gap = np.concatenate([slot, other + self._count]), np.concatenate([gap, other_gap])
        return Touching(slot, gap, ())

    @property
    def _point_arguments(self) -> tuple[np.ndarray, ...]:
        return (*self.tables.points, *self.tables.shapes)

    def _split(self, touching: Touching) -> tuple[int, np.ndarray, np.ndarray]:
        """How many are points; rows of the points and of the pairs of edges."""
        count = int(np.searchsorted(touching.slot, self._count))
        return count, touching.slot[:count].copy(), touching.slot[count:] - self._count

    def measure(self, poses: np.ndarray, rates: np.ndarray, touching: Touching) -> Measured:
        """Rates and gradients of gap and slip of what was found."""
        tables = self.tables
        count, points, edges = self._split(touching)
        parts = []
        if count or not len(edges):
            parts.append(self._kernels.measure(poses, rates, points, *self._point_arguments))
        if len(edges):
            parts.append(edge_edge.measure_edges(poses, rates, edges, *tables.edge_pairs, *tables.edges))
        if len(parts) == 1:
            return Measured(*parts[0])
        bodies, rate, gradient = (np.concatenate(both) for both in zip(*parts, strict=True))
        return Measured(bodies, rate, gradient)

    def add_tangent(
        self,
        poses: np.ndarray,
        rates: np.ndarray,
        touching: Touching,
        measured: Measured,
        forces: ContactForces,
        pattern: BodyPattern,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """Add K = -dh/dx and D = -dh/du to the block data."""
        tables = self.tables
        count, points, edges = self._split(touching)
        arrays = (forces.normal, forces.by_depth, forces.by_closing, forces.effort, forces.by_slip, forces.by_normal)
        if count:
            self._kernels.tangent(
                poses, rates, points, measured.bodies[:count], measured.gradient[:count], *self._point_arguments,
                *(array[:count] for array in arrays), forces.friction, *pattern.index, stiffness, damping,
            )  # fmt: skip
        if len(edges):
            _TANGENT_EDGES(
                poses, rates, edges, measured.bodies[count:], measured.gradient[count:],
                *tables.edge_pairs, *tables.edges,
                *(array[count:] for array in arrays), forces.friction, *pattern.index, stiffness, damping,
            )  # fmt: skip

    # what stays in mind ---------------------------------------------------------------------------------------------

    def commit(self, poses: np.ndarray) -> None:
        """A step was accepted: what passes through something from here on is found by `crossed`."""
        self._committed = poses.copy()

    def memory(self) -> np.ndarray:
        """The committed poses, flat; empty before the first commit."""
        return np.zeros(0) if self._committed is None else self._committed.ravel()

    def restore(self, memory: np.ndarray) -> None:
        """Go back to what `memory` gave."""
        self._committed = memory.reshape(-1, 7 if self.spatial else 3).copy() if len(memory) else None

    def crossed(self, poses: np.ndarray) -> tuple[int, ...]:
        """Numbers of the pairs of which something passed through a face since the last commit."""
        return tuple(int(pair) for pair in np.unique(self.pair[self.passed(poses)]))

    def passed(self, poses: np.ndarray) -> np.ndarray:
        """Slots that passed through a face since the last commit."""
        if self._committed is None:
            return np.zeros(0, dtype=np.int64)
        points, edges = self._slots_of(self._swept(self._committed, poses))
        if not len(points) and not len(edges):
            return np.zeros(0, dtype=np.int64)
        tables = self.tables
        shape = tables.points.shape[points]
        kind, size, limit = tables.shapes.kind[shape], tables.shapes.size[shape], self._limit[points]
        half = tables.edges.half[tables.edge_pairs.edges[edges, 1]]
        point_passed, edge_passed = np.zeros(len(points), dtype=bool), np.zeros(len(edges), dtype=bool)
        before: tuple[np.ndarray, np.ndarray] | None = None
        for step in path_poses(self._committed, poses):
            here = self._locals(step, points, edges)
            if before is not None:
                point_passed |= points_pass(kind, size, limit, before[0], here[0])
                edge_passed |= edges_pass(half, before[1], here[1])
            before = here
        return np.concatenate([points[point_passed], edges[edge_passed] + self._count])

    def _locals(self, poses: np.ndarray, points: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points in the axes of their shapes, and first edges in those of the second."""
        probes, shapes = self.tables.points, self.tables.shapes
        local = self._kernels.local(
            poses, points, probes.body, probes.place, probes.shape, shapes.body, shapes.offset, shapes.frame
        )
        if not len(edges):
            return local, np.zeros((0, 2, 3))
        table = self.tables.edges
        return local, local_edges(
            poses, edges, self.tables.edge_pairs.edges, table.body, table.middle, table.direction, table.half
        )

    def _swept(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Units whose shapes' boxes, swept from one pose to the other, overlap."""
        low, high = self._boxes(start)
        other_low, other_high = self._boxes(end)
        # on an arc a point departs from its chord by no more than this
        turn = np.minimum(turn_between(start[self._moving], end[self._moving]), np.pi)
        bulge = np.zeros(len(start))
        bulge[self._moving] = self._radii * (1.0 - np.cos(turn / 2))
        aside = bulge[self.tables.shapes.body][:, None]
        return self._listed.overlapping(np.minimum(low, other_low) - aside, np.maximum(high, other_high) + aside)


def _ranges(start: np.ndarray, units: np.ndarray) -> np.ndarray:
    """All numbers from start[u] to start[u + 1] - 1, unit after unit."""
    lengths = start[units + 1] - start[units]
    offsets = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    return np.repeat(start[units], lengths) + offsets
