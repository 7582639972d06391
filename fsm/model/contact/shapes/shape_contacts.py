"""Contact geometry of rounded points with shapes, and of edges with edges."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.contact.shapes import ContactForces, Points
from fsm.interactions.search.box_pairs import ListedPairs
from fsm.interactions.search.displacement_bound import moved_beyond
from fsm.interactions.shapes import edge_edge, point_shape_planar, point_shape_spatial
from fsm.interactions.shapes.face_overlap import COLUMNS
from fsm.interactions.shapes.shape_boxes import shape_boxes_planar, shape_boxes_spatial
from fsm.interactions.shapes.shape_distance import HALF_SPACE, POLYGON
from fsm.interactions.shapes.swept import turn_between
from fsm.interactions.shapes.swept_slots import passing_points, passing_slots
from fsm.model.bodies.pattern import BodyPattern
from fsm.model.contact.contact_geometry import ActiveContacts, ContactKinematics, Tapered
from fsm.model.contact.shapes.overlaps import Overlaps
from fsm.model.contact.shapes.shape_tables import Kit, Tables, Units, ranges

Kernel = Callable[..., Any]


class _PointKernels(NamedTuple):
    """Kernels of `point_shape_planar` or `point_shape_spatial`."""

    find: Kernel
    measure: Kernel
    tangent: Kernel
    local: Kernel
    boxes: Kernel


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


GROUND = 0
"""Index of the ground."""
_RENEWAL = 0.4
"""Displacement, relative to the margin, after which the broad phase is renewed."""
_MOST_SLOTS = 50000
"""Number of slots up to which all pairs are listed at once."""
_ON_CREASE = 1e-6
"""Clearance, relative to the sum of both roundings, below which a slot lies on a common crease."""
DEEP = 0.25
"""Depth limit of solid shapes, relative to the length of the longest plate or solid."""


class ShapeContacts:
    """Contacts of the points and edges of listed pairs of shapes.

    The broad phase finds the units (pairs of shapes) whose gap may come below the margin before the next renewal. The broad
    phase builds tables of their slots, so memory grows with the number of nearby pairs. The broad phase is renewed when a
    body has moved by 0.4 of the margin. The contacts do not depend on the time of the renewal.

    Parameters
    ----------
    kit : Kit
    listed : ListedPairs
    spatial : bool
    margin : float, m
    depth_limit : float, m
        Depth of a point's centre above which it counts as passed into a solid shape. The limit is at most half the smallest
        half size of the shape, because a deeper point may be nearer to another face. A half-space has only one face, so it
        has no limit.
    """

    def __init__(self, kit: Kit, listed: ListedPairs, spatial: bool, margin: float, depth_limit: float) -> None:
        self.kit, self.listed = kit, listed
        self.spatial, self.margin, self.depth_limit = spatial, margin, depth_limit
        self.slips = 3 if spatial else 1
        self._kernels = _SPATIAL if spatial else _PLANAR
        shapes = kit.shapes
        # unlimited sizes are ignored: sizes of half-spaces, and the direction y in the plane
        size = np.where(np.isinf(shapes.size), 0.0, shapes.size)
        size[shapes.kind == HALF_SPACE] = 0.0
        flat = shapes.kind == POLYGON
        size[flat, 0] = 0.0  # the last column is the number of corners
        self.reach = np.linalg.norm(size, axis=1) + shapes.radius
        corners = np.hypot(size[flat, 1::2], size[flat, 2::2]).max(axis=1, initial=0.0)
        self.reach[flat] = corners + shapes.radius[flat]
        reach = self.reach + np.linalg.norm(shapes.offset, axis=1)
        self.moving, owner = np.unique(shapes.body, return_inverse=True)
        self.radii = np.zeros(len(self.moving))
        np.maximum.at(self.radii, owner, reach)
        self.reference: np.ndarray | None = None
        self._committed: np.ndarray | None = None
        self._closed = np.zeros(0, dtype=np.int64)
        self._version = 0
        self._overlaps, self._changes = Overlaps.nothing(), False
        none = np.zeros((0, 2), dtype=np.int64)
        self._set_up_tables(self._units_of(none, np.zeros(0, dtype=np.int64)))
        self._near, self._bodies = np.zeros(0, dtype=np.int64), none
        self._near_slots = self._slots_of(self._near)

    @property
    def share(self) -> np.ndarray:
        """See `ContactGeometry`."""
        return self.tables.share

    @property
    def area(self) -> np.ndarray:
        """See `ContactGeometry`."""
        return self.tables.area

    @property
    def pair(self) -> np.ndarray:
        """See `ContactGeometry`."""
        return self.tables.pair

    @property
    def many(self) -> bool:
        """Whether the tables of all listed pairs are too large, so that the broad phase has to select pairs in each step."""
        return self.listed.at_most() > _MOST_SLOTS or self.kit.slots_of(self._all_units.shapes) > _MOST_SLOTS

    @cached_property
    def _all_units(self) -> Units:
        return self._units_of(*self.listed.everything())

    def whole(self) -> tuple[Units, Tables, np.ndarray, np.ndarray]:
        """All listed pairs, their tables, the open slots, and a flag for each pair: 1 if it is near at present, else 0."""
        units = self._all_units
        tables = self.kit.tables(units)
        near = np.isin(units.key, self._units.key[self._near])
        return units, tables, (~np.isin(tables.key, self._closed)).astype(np.int64), near.astype(np.int64)

    def depth_limits(self, tables: Tables) -> np.ndarray:
        """Depth (n_points,) above which a point counts as passed into a solid shape, m."""
        shape = tables.points.shape
        smallest = 0.5 * tables.shapes.size[shape, :3].min(axis=1)
        half_space = tables.shapes.kind[shape] == HALF_SPACE
        return np.asarray(np.where(half_space, self.depth_limit, np.minimum(self.depth_limit, smallest)))

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """See `ContactGeometry`."""
        return self.tables.key[slots]

    # broad phase ----------------------------------------------------------------------------------------------------

    def _factors(self, members: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Fields `share`, `whole` and `area` of `Units` from their members (u, 2)."""
        return np.ones((len(members), COLUMNS)), np.ones(members.shape), np.zeros(members.shape)

    def _units_of(self, members: np.ndarray, numbers: np.ndarray) -> Units:
        """Create units from the result of `ListedPairs`."""
        key = members[:, 0] * len(self.listed.shape) + members[:, 1]
        return Units(self.listed.shape[members], *self._factors(members), numbers, key)

    def _boxes(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corners (s, 2 or 3) of boxes around all shapes, m; infinite for half-spaces."""
        low, high = self._kernels.boxes(poses, self.kit.shapes)
        return low, high

    def _set_up_tables(self, units: Units) -> None:
        """Set up the tables of these units."""
        self._overlaps = self._overlaps.of(units)
        self._units, self.tables = units, self.kit.tables(units)
        self._apply_weights()
        self._count = len(self.tables.points.body)
        self._open = ~np.isin(self.tables.key, self._closed)
        self._slots = self._slots_of(np.arange(len(units.key)))

    def _slots_of(self, units: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points and pairs of edges (numbered from 0) of some active units, without excluded slots."""
        points, edges = ranges(self.tables.point_start, units), ranges(self.tables.pair_start, units)
        return points[self._open[points]], edges[self._open[edges + self._count]]

    def leave_out(self, poses: np.ndarray, joined: np.ndarray) -> None:
        """Exclude points and edges of joined bodies (m, 2) that touch in these poses or lie on a common crease."""
        owner = self.kit.shapes.body
        by_body = np.argsort(owner, kind="stable")
        start = np.searchsorted(owner[by_body], np.arange(joined.max(initial=-1) + 2))
        shapes = [
            (one, two)
            for a, b in np.unique(np.sort(joined, axis=1), axis=0)
            for one in by_body[start[a] : start[a + 1]]
            for two in by_body[start[b] : start[b + 1]]
        ]
        self._set_up_tables(self._units_of(*self.listed.among(np.array(shapes, dtype=np.int64).reshape(-1, 2))))
        inside = self._find(poses, *self._slots, 0.0, as_they_are=True).slot
        on_crease = np.flatnonzero(self.tables.taper < _ON_CREASE)
        self._closed = np.unique(self.tables.key[np.concatenate([inside, on_crease])])
        self.reference = None

    def _refresh(self, poses: np.ndarray) -> None:
        bound = _RENEWAL * self.margin
        if self.reference is not None and not moved_beyond(poses, self.reference, self.moving, self.radii, bound):
            return
        low, high = self._boxes(poses)
        # both bodies may move, so the search distance is the margin plus both displacements
        apart = self.margin + 2.0 * bound
        units = self._units_of(*self.listed.overlapping(low - 0.5 * apart, high + 0.5 * apart))
        same = self.reference is not None and np.array_equal(units.key, self._units.key)
        if not same:
            self._set_up_tables(units)
        self.reference = poses.copy()
        near = np.flatnonzero(
            _overlap(low - 0.5 * self.margin, high + 0.5 * self.margin, units.shapes)
            & ~self._far_above(poses, units.shapes)
        )
        if same and np.array_equal(near, self._near):
            self._update_weights(poses)
            return
        self._near, self._near_slots = near, self._slots_of(near)
        self._update_weights(poses)
        self._bodies = np.unique(self.tables.shapes.body[units.shapes[near]], axis=0)
        self._version += 1

    def _update_weights(self, poses: np.ndarray) -> None:
        """Compute the weights of new units from the last accepted state, or from these poses if there is none."""
        at, new = poses if self._committed is None else self._committed, self._near[~self._overlaps.known[self._near]]
        if len(new) and self._overlaps.look(at, self.kit, self._units, new, np.zeros(len(new), dtype=np.bool_)):
            self._overlaps.in_force[new] = self._overlaps.latest[new]
            self._apply_weights()

    def _apply_weights(self) -> None:
        tables = self.tables
        tables.share[:] = tables.weight * self._overlaps.shares[tables.unit, tables.column]

    def _activate_weights(self, poses: np.ndarray) -> None:
        """Use the weights of the last accepted state, unless the poses have not changed since then."""
        if self._changes and self._committed is not None and not np.array_equal(poses, self._committed):
            self._overlaps.in_force[:] = self._overlaps.latest
            self._apply_weights()
            self._changes = False

    def _far_above(self, poses: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """Whether the second shape is a half-space of the ground and the first is farther above it than the margin.

        Boxes of half-spaces are infinite. For a half-space on a moving body, a small rotation causes a large displacement.
        """
        shapes = self.kit.shapes
        out = np.zeros(len(pairs), dtype=bool)
        rows = np.flatnonzero((shapes.kind[pairs[:, 1]] == HALF_SPACE) & (shapes.body[pairs[:, 1]] == GROUND))
        one, two = np.ascontiguousarray(pairs[rows].T)
        centres = Points(shapes.body[one], shapes.offset[one], shapes.radius[one], two, np.zeros((len(rows), 3, 3)))
        local = self._kernels.local(poses, np.arange(len(rows)), centres, shapes)
        out[rows] = local[:, 2] > self.reach[one] + shapes.radius[two] + self.margin
        return out

    @property
    def refreshes(self) -> int:
        """Number of renewals of the broad phase with a changed result."""
        return self._version

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """Pairs (m, 2) of bodies that may touch before the next renewal, and a version number that changes with them."""
        self._refresh(poses)
        return self._bodies, self._version

    # narrow phase ---------------------------------------------------------------------------------------------------

    def find(self, poses: np.ndarray, below: float) -> ActiveContacts:
        """Find the slots with a gap below a bound, m: 0 for contacts, larger (up to the margin) for gaps."""
        self._activate_weights(poses)
        self._refresh(poses)
        near = below <= (1.0 - 2.0 * _RENEWAL) * self.margin
        return self._find(poses, *(self._near_slots if near else self._slots), below)

    def _find(
        self, poses: np.ndarray, points: np.ndarray, edges: np.ndarray, below: float, as_they_are: bool = False
    ) -> ActiveContacts:
        """Find contacts among some points and pairs of edges; the scaling of nearly parallel edges is optional."""
        tables, pairs = self.tables, self.tables.edge_pairs
        slot, gap = self._kernels.find(poses, points, tables.points, tables.shapes, below)
        if len(edges):
            unscaled = pairs._replace(parallel=np.zeros(len(pairs.parallel)))
            other, other_gap = edge_edge.find_edges(poses, edges, unscaled if as_they_are else pairs, tables.edges, below)
            slot, gap = np.concatenate([slot, other + self._count]), np.concatenate([gap, other_gap])
        return ActiveContacts(slot, gap, ())

    def _split_kinds(self, touching: ActiveContacts) -> tuple[int, np.ndarray, np.ndarray]:
        """Number of points; rows of the points and of the pairs of edges."""
        count = int(np.searchsorted(touching.slot, self._count))
        return count, touching.slot[:count].copy(), touching.slot[count:] - self._count

    def measure(self, poses: np.ndarray, rates: np.ndarray, touching: ActiveContacts) -> ContactKinematics:
        """Compute rates and gradients of gap and slip of all contacts."""
        tables = self.tables
        count, points, edges = self._split_kinds(touching)
        parts = []
        if count or not len(edges):
            parts.append(self._kernels.measure(poses, rates, points, tables.points, tables.shapes))
        if len(edges):
            parts.append(edge_edge.measure_edges(poses, rates, edges, tables.edge_pairs, tables.edges))
        if len(parts) == 1:
            bodies, rate, gradient = parts[0]
        else:
            bodies, rate, gradient = (np.concatenate(both) for both in zip(*parts, strict=True))
        return ContactKinematics(bodies, rate, gradient, self._changed_weights(poses, touching, bodies))

    def _changed_weights(self, poses: np.ndarray, touching: ActiveContacts, bodies: np.ndarray) -> Tapered | None:
        """Factors of the weights of contacts, and their gradients with respect to the bodies' coordinates."""
        tables = self.tables
        units, inverse = np.unique(tables.unit[touching.slot], return_inverse=True)
        sloped = self._overlaps.sloped(units)
        if not sloped.any():
            return None
        part, gradient = self._overlaps.changed(poses, self.kit, self._units, units)
        rows = np.flatnonzero(sloped[inverse])
        unit, column = inverse[rows], tables.column[touching.slot[rows]]
        own = gradient[unit, column]
        swapped = tables.shapes.body[self._units.shapes[units[unit], 0]] != bodies[rows, 0]
        own[swapped] = own[swapped][:, ::-1]
        flat = own.reshape(len(rows), -1)
        # weights are linear in the relative pose
        return Tapered(rows, part[unit, column], flat, np.zeros((*flat.shape, flat.shape[1])), fades=False)

    def add_tangent(
        self,
        poses: np.ndarray,
        rates: np.ndarray,
        touching: ActiveContacts,
        measured: ContactKinematics,
        forces: ContactForces,
        pattern: BodyPattern,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """Add K = -dh/dx and D = -dh/du to the block data."""
        tables = self.tables
        count, points, edges = self._split_kinds(touching)
        if count:
            self._kernels.tangent(
                poses, rates, points, measured.bodies[:count], measured.gradient[:count], tables.points, tables.shapes,
                forces.part(0, count), pattern.index, stiffness, damping,
            )  # fmt: skip
        if len(edges):
            edge_edge.tangent_edges(
                poses, rates, edges, measured.bodies[count:], measured.gradient[count:], tables.edge_pairs, tables.edges,
                forces.part(count, len(touching.slot)), pattern.index, stiffness, damping,
            )  # fmt: skip

    # memory ------------------------------------------------------------------------------------------------------------

    def commit(self, poses: np.ndarray, young: np.ndarray | None = None) -> None:
        """Update the memory after an accepted step; `crossed` then refers to these poses, and faces are weighed again.

        Weights of faces in continuing impacts do not jump, to conserve energy.
        """
        self._committed = poses.copy()
        self._refresh(poses)
        slots = self.find(poses, 0.0).slot if young is None else young
        held = np.isin(self._near, self.tables.unit[slots])
        self._changes = self._overlaps.look(poses, self.kit, self._units, self._near, held) or self._changes

    def memory(self) -> np.ndarray:
        """The memory consists of the length of the committed poses, the poses, and the overlaps of faces; it is empty before
        the first commit.
        """
        if self._committed is None:
            return np.zeros(0)
        return np.concatenate([[float(self._committed.size)], self._committed.ravel(), self._overlaps.flat()])

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory."""
        if not len(memory):
            self._committed, self._overlaps = None, Overlaps.nothing().of(self._units)
        else:
            end = 1 + int(memory[0])
            self._committed = memory[1:end].reshape(-1, 7 if self.spatial else 3).copy()
            self._overlaps = Overlaps.from_flat(memory[end:]).of(self._units)
        self._changes = bool((self._overlaps.in_force != self._overlaps.latest).any())
        self._apply_weights()

    def clear_caches(self) -> None:
        """See `ContactGeometry`."""
        self.reference = None

    def crossed(self, poses: np.ndarray) -> tuple[int, ...]:
        """Numbers of the pairs with a slot that passed through a face since the last commit."""
        tables, slots = self.passed(poses)
        return tuple(int(pair) for pair in np.unique(tables.pair[slots]))

    def passed(self, poses: np.ndarray) -> tuple[Tables, np.ndarray]:
        """Slots that passed through a face since the last commit, and their tables."""
        self._refresh(poses)
        start = self._committed
        if start is None:
            return self.tables, np.zeros(0, dtype=np.int64)
        tables, points, edges = self._swept_candidates(start, poses)
        if not len(points) and not len(edges):
            return tables, np.zeros(0, dtype=np.int64)
        known = start, poses, points, tables.points, tables.shapes, self.depth_limits(tables)
        if not self.spatial:
            return tables, points[passing_points(*known)]
        of_points, of_edges = passing_slots(*known, edges, tables.edge_pairs.edges, tables.edges)
        return tables, np.concatenate([points[of_points], edges[of_edges] + len(tables.points.body)])

    def _swept_candidates(self, start: np.ndarray, end: np.ndarray) -> tuple[Tables, np.ndarray, np.ndarray]:
        """Points and pairs of edges of units that may touch between two poses, and their tables."""
        low, high = self._swept_boxes(start, end)
        bound = _RENEWAL * self.margin
        if self.reference is not None and not moved_beyond(start, self.reference, self.moving, self.radii, bound):
            # both poses are within the allowed displacement from the last search
            meet = _overlap(low, high, self._units.shapes[self._near])
            return self.tables, *self._slots_of(self._near[meet])
        units = self._units_of(*self.listed.overlapping(low, high))
        tables = self.kit.tables(units)
        is_open, count = ~np.isin(tables.key, self._closed), len(tables.points.body)
        return tables, np.flatnonzero(is_open[:count]), np.flatnonzero(is_open[count:])

    def _swept_boxes(self, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Boxes around all shapes swept between two poses."""
        low, high = self._boxes(start)
        other_low, other_high = self._boxes(end)
        # bound of the distance of an arc from its chord
        turn = np.minimum(turn_between(start[self.moving], end[self.moving]), np.pi)
        bulge = np.zeros(len(start))
        bulge[self.moving] = self.radii * (1.0 - np.cos(turn / 2))
        aside = bulge[self.kit.shapes.body][:, None]
        return np.minimum(low, other_low) - aside, np.maximum(high, other_high) + aside


def _overlap(low: np.ndarray, high: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Whether the two boxes of each pair (m, 2) have a point in common, (m,) bool."""
    one, two = pairs.T
    return np.asarray(((low[one] <= high[two]) & (low[two] <= high[one])).all(axis=1))
