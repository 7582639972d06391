"""Contact geometry of rounded points with shapes, and of edges with edges."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from fsm.interactions.search.box_pairs import ListedPairs
from fsm.interactions.search.displacement_bound import moved_beyond
from fsm.interactions.shapes.edge_edge import find_edges
from fsm.interactions.shapes.face_overlap import COLUMNS
from fsm.interactions.shapes.face_weights import ROW
from fsm.interactions.shapes.face_weights import SHARE as SHARES
from fsm.interactions.shapes.point_shape_planar import local_points_planar
from fsm.interactions.shapes.point_shape_spatial import local_points_spatial
from fsm.interactions.shapes.shape_distance import (
    HALF_SPACE,
    POLYGON,
    points_within,
    shape_boxes_planar,
    shape_boxes_spatial,
)
from fsm.interactions.shapes.swept import turn_between
from fsm.kernels.keys import find_keys
from fsm.kernels.tables import empty_arrays
from fsm.model.bodies.contact_arrays import CHANGES, REFERRED, RENEWAL, STARTED
from fsm.model.bodies.group import BodyPattern
from fsm.model.contact.contact_table import ContactTable
from fsm.model.contact.shapes.array_shape_tables import UNITS_NEAR, ShapeArrays
from fsm.model.contact.shapes.array_shapes import PLANAR_SHAPES, SPATIAL_SHAPES
from fsm.model.contact.shapes.shape_tables import Kit, Tables, Units

_MOST_SLOTS = 50000
"""Number of slots up to which all pairs are listed at once."""
_ON_CREASE = 1e-6
"""Clearance, relative to the sum of both roundings, below which a slot lies on a common crease."""
DEEP = 0.25
"""Depth limit of solid shapes, relative to the length of the longest plate or solid."""


class ShapeContacts(ContactTable):
    """Contacts of the points and edges of listed pairs of shapes.

    The table has slots for the units (pairs of shapes) whose gap may come below the margin before a body has moved by 0.4 of
    the margin, so memory grows with the number of nearby pairs. Compiled steps have a table of all units, in which the broad
    phase only selects those that are near. The contacts do not depend on the time of a renewal.

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

    coupled_bodies = 2

    def __init__(self, kit: Kit, listed: ListedPairs, spatial: bool, margin: float, depth_limit: float) -> None:
        self.kit, self.listed, self.spatial, self.depth_limit = kit, listed, spatial, depth_limit
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
        kernels = SPATIAL_SHAPES if spatial else PLANAR_SHAPES
        super().__init__(kernels, 3 if spatial else 1, margin, self.moving, self.radii, empty_arrays(ShapeArrays))
        self._closed = np.zeros(0, dtype=np.int64)
        self._has_all = False
        self._laid_out_at: np.ndarray | None = None
        self._near: tuple[bytes, bytes] = b"", b""
        self.units = self._units_of(np.zeros((0, 2), dtype=np.int64), np.zeros(0, dtype=np.int64))
        self.tables = kit.tables(self.units)
        self._lay_out(self.units)

    @property
    def many(self) -> bool:
        """Whether a table of all units is too large, so that the units have to be selected in Python."""
        return self.listed.at_most() > _MOST_SLOTS or self.kit.slots_of(self._all_units.shapes) > _MOST_SLOTS

    @cached_property
    def _all_units(self) -> Units:
        return self._units_of(*self.listed.everything())

    def twin(self) -> ShapeContacts:
        """See `ContactTable`; all units have slots."""
        other, other._has_all = super().twin(), True
        other._lay_out(self._all_units)
        return other

    def index(self, pattern: BodyPattern) -> None:
        """See `ContactTable`."""
        super().index(pattern)
        self.own.met[:] = 0

    def _depth_limits(self, tables: Tables) -> np.ndarray:
        """Depth (n_points,) above which a point counts as passed into a solid shape, m."""
        shape = tables.points.shape
        smallest = 0.5 * tables.shapes.size[shape, :3].min(axis=1)
        half_space = tables.shapes.kind[shape] == HALF_SPACE
        return np.asarray(np.where(half_space, self.depth_limit, np.minimum(self.depth_limit, smallest)))

    # slots ----------------------------------------------------------------------------------------------------------

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """See `ContactTable`."""
        return self.tables.key[slots]

    def _factors(self, members: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Fields `share`, `whole` and `area` of `Units` from their members (u, 2)."""
        return np.ones((len(members), COLUMNS)), np.ones(members.shape), np.zeros(members.shape)

    def _units_of(self, members: np.ndarray, numbers: np.ndarray) -> Units:
        """Create units from the result of `ListedPairs`."""
        key = members[:, 0] * len(self.listed.shape) + members[:, 1]
        return Units(self.listed.shape[members], *self._factors(members), numbers, key)

    def _lay_out(self, units: Units) -> None:
        """Replace the slots by those of other units; the memory is kept."""
        weights, contacts = self.own_memory(), self.contacts()
        tables, kit, number = self.kit.tables(units), self.kit, len(units.key)
        self.units, self.tables = units, tables
        points, edges, none = len(tables.points.body), len(tables.edge_pairs.edges), np.zeros(number, dtype=np.int64)
        own = ShapeArrays(
            *tables.points, *tables.shapes, *tables.edges, *tables.edge_pairs, self.reach, self._depth_limits(tables),
            units.shapes, tables.point_start, tables.pair_start, tables.unit, tables.column, tables.weight,
            ~np.isin(tables.key, self._closed), none, none.copy(), np.zeros(points, dtype=np.int64),
            np.zeros(edges, dtype=np.int64), none.copy(), np.zeros((number, ROW)), np.zeros((number, ROW)), units.whole,
            units.share, kit.solids.size, kit.solids.offset, kit.solids.axes, kit.point_start, kit.local, kit.weight,
            kit.on_axis,
        )  # fmt: skip
        self.with_slots(own, len(tables.key), tables.share, tables.area, tables.pair)
        self.load_own(weights)
        self.load_contacts(contacts)

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
        tables = self.kit.tables(self._units_of(*self.listed.among(np.array(shapes, dtype=np.int64).reshape(-1, 2))))
        points, pairs, own = len(tables.points.body), tables.edge_pairs, (tables.points, tables.shapes)
        slot, every = np.empty(points, dtype=np.int64), np.arange(points)
        local = (local_points_spatial if self.spatial else local_points_planar)(poses, every, *own)
        inside = slot[: points_within(local, every, *own, 0.0, slot, np.empty(points))]
        if len(pairs.edges):
            unscaled = pairs._replace(parallel=np.zeros(len(pairs.parallel)))
            other, _ = find_edges(poses, np.arange(len(pairs.edges)), unscaled, tables.edges, 0.0)
            inside = np.concatenate([inside, other + points])
        on_crease = np.flatnonzero(tables.taper < _ON_CREASE)
        self._closed = np.unique(tables.key[np.concatenate([inside, on_crease])])

    # search ---------------------------------------------------------------------------------------------------------

    def refresh(self, poses: np.ndarray) -> None:
        """See `ContactTable`."""
        self.size_for(len(poses))
        self._select(poses)
        super().refresh(poses)

    def _select(self, poses: np.ndarray) -> None:
        """Lay out the units that may touch before a body has moved too far, if the present ones are no longer sufficient."""
        at, bound = self._laid_out_at, RENEWAL * self.margin
        if not self._has_all and (at is None or moved_beyond(poses, at, self.moving, self.radii, bound)):
            # both bodies may move, so the search distance is the margin plus both displacements
            low, high, aside = *self._swept_boxes(poses), 0.5 * self.margin + bound
            units = self._units_of(*self.listed.overlapping(low - aside, high + aside))
            if not np.array_equal(units.key, self.units.key):
                self._lay_out(units)
            self._laid_out_at = poses.copy()

    def search(self, poses: np.ndarray, below: float) -> int:
        """See `ContactTable`; the selected units are sufficient for small gaps only, unless they are selected again."""
        if below > (1.0 - 2.0 * RENEWAL) * self.margin and not np.array_equal(poses, self.common.reference):
            self.common.state[REFERRED] = 0
        return super().search(poses, below)

    def _swept_boxes(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corners (s, 2 or 3) of boxes around all shapes, swept from the last accepted state, m; infinite
        for half-spaces.
        """
        boxes = shape_boxes_spatial if self.spatial else shape_boxes_planar
        low, high = boxes(poses, self.kit.shapes)
        start = self.common.committed
        if not self.common.state[STARTED] or np.array_equal(start, poses):
            return low, high
        other_low, other_high = boxes(start, self.kit.shapes)
        # bound of the distance of an arc from its chord
        turn = np.minimum(turn_between(start[self.moving], poses[self.moving]), np.pi)
        bulge = np.zeros(len(start))
        bulge[self.moving] = self.radii * (1.0 - np.cos(turn / 2))
        aside = bulge[self.kit.shapes.body][:, None]
        return np.minimum(low, other_low) - aside, np.maximum(high, other_high) + aside

    def _renewed(self) -> None:
        near = self.units.key.tobytes(), self.own.near[: self.common.state[UNITS_NEAR]].tobytes()
        if near != self._near:
            self._near, self.refreshes = near, self.refreshes + 1

    def coupled(self) -> np.ndarray:
        """See `ContactTable`."""
        near = self.own.near[: self.common.state[UNITS_NEAR]]
        return np.unique(self.own.shape_body[self.units.shapes[near]], axis=0)

    def coupled_ahead(self) -> np.ndarray:
        """See `ContactTable`: bodies that have been near each other."""
        return np.asarray(self.own.shape_body[self.units.shapes[self.own.met == 1]])

    # memory ---------------------------------------------------------------------------------------------------------

    def clear_caches(self) -> None:
        """See `ContactTable`."""
        super().clear_caches()
        self._laid_out_at = None

    def restore(self, memory: np.ndarray) -> None:
        """See `ContactTable`; first the slots are those near each other in the last accepted state."""
        if len(memory):
            poses, first = self.common.committed, 2 + (4 + self.slips) * int(memory[1])
            self.common.state[STARTED] = 0
            self._select(memory[first : first + poses.size].reshape(poses.shape))
        super().restore(memory)

    def load_own(self, memory: np.ndarray) -> None:
        """See `ContactTable`: weights of faces, see `fsm.interactions.shapes.face_weights.weigh_units`; unknown weights are
        those of tilted faces.
        """
        own, rows, share = self.own, memory.reshape(-1, 1 + 2 * ROW), slice(SHARES, SHARES + COLUMNS)
        place = find_keys(self.units.key, rows[:, 0].astype(np.int64))
        kept = np.flatnonzero(place >= 0)
        own.known[:] = 0
        own.known[place[kept]] = 1
        for weights, known in ((own.latest, rows[kept, 1 : 1 + ROW]), (own.in_force, rows[kept, 1 + ROW :])):
            weights[:] = 0.0
            weights[:, share] = self.units.share
            weights[place[kept]] = known
        self.common.share[:] = own.weight * own.in_force[own.unit, SHARES + own.column]
        self.common.state[CHANGES] = int((own.in_force != own.latest).any())

    def own_memory(self) -> np.ndarray:
        """See `ContactTable`."""
        rows = np.flatnonzero(self.own.known)
        weights = self.units.key[rows, None], self.own.latest[rows], self.own.in_force[rows]
        return np.concatenate(weights, axis=1).ravel()
