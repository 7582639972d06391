"""Contacts of flexible facets with each other: nodes with facets, and edges with edges of a mesh of triangles.

A node is a probe on every facet to which it does not belong. The nodes of two facets that lie on each other represent the
area of contact; each facet contributes half. A node keeps its side of a facet. After each accepted step a node selects the
nearest triangle of the facet; in the next step it touches the plane of this triangle. A node beyond the outline of the facet
selects a part of the rounded outline. The normal therefore does not jump within a step. Edges touch where they cross, at
half of the distance at which faces touch. Contact of edges keeps facets apart where the mesh is too coarse for contact of
nodes; edges carry no load where nodes touch.

Beside a common crease or vertex, faces touch at a smaller distance (`fsm.segments.crease_clearance`).

Facets with a common vertex, and facets across a cut, have no contact where they touch at the start. Parts of one facet can
touch if their distance along the facet exceeds a bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fsm.interactions.box_pairs import overlapping_boxes
from fsm.interactions.closest_features import Faces, Found, find_edge_edges, find_point_faces, select_faces
from fsm.interactions.displacement_bound import moved_beyond
from fsm.interactions.feature_contact import measure_features, parallel_weights, tangent_features
from fsm.interactions.shapes import ContactForces
from fsm.interactions.triangles_pass import edges_pass_edges, points_pass_triangles
from fsm.segments.contact_geometry import ActiveContacts, ContactKinematics, Tapered
from fsm.segments.crease_clearance import Tapers, common_lines, tapers_of
from fsm.segments.pattern import BodyPattern

_RENEWAL = 0.4
"""Displacement, relative to the margin, after which the broad phase is renewed."""
_MARGIN = 0.25
"""Margin over the mean length of an edge."""
_APART = 2.0
"""Distance along a facet over the longest edge, beyond which it may touch itself."""
_TIP, _BEYOND = 0.1, 1e-3
"""Lengths by which a facet extends straight beyond its outline: relative to the clearance, and relative to the height of a
triangle."""
_ON_CUT = 1e-9
"""Distance, relative to the longest edge, below which a node lies on an edge of a facet across a cut."""
_PARALLEL = 0.01
"""Squared sine of the angle between two edges below which they count as nearly parallel."""


@dataclass(frozen=True, eq=False)
class SheetSurface:
    """Triangles of flexible facets.

    Attributes
    ----------
    body : (n,) int array
        Body (frame) of each node.
    area : (n,) array, m^2
        Area that each node represents.
    triangles : (t, 3) int array of nodes
    facet : (t,) int array
    plane : (t, 3, 2) array, m
        Corners in the flat facet.
    face : m^2
        Area with the whole contact stiffness.
    clearance : m
        Distance of the middle surfaces at which the faces touch.
    number : number of the scene's contact pair
    across_cuts : pairs of facets that touched each other before a cut separated them
    """

    body: np.ndarray
    area: np.ndarray
    triangles: np.ndarray
    facet: np.ndarray
    plane: np.ndarray
    face: float
    clearance: float
    number: int
    across_cuts: tuple[tuple[int, int], ...] = ()


class _Slots(NamedTuple):
    """Possible contacts: of nodes with facets, and of edges.

    Attributes
    ----------
    node, facet : (s,) int arrays
    start, listed : int arrays
        Triangles of each slot, as in `find_point_faces`.
    pairs : (p, 2) int array of edges
    """

    node: np.ndarray
    facet: np.ndarray
    start: np.ndarray
    listed: np.ndarray
    pairs: np.ndarray


class SheetContacts:
    """Contacts of flexible facets with each other; see the module docstring and `ContactGeometry`.

    The broad phase is renewed when a node has moved by 0.4 of the margin. Contacts do not depend on the time of the renewal.
    Every accepted step is checked for nodes that passed through triangles, and edges through edges.

    Parameters
    ----------
    surface : SheetSurface
    reference : (n_bodies, 7) array
        Poses at the start.
    """

    slips = 3

    def __init__(self, surface: SheetSurface, reference: np.ndarray) -> None:
        self.surface = surface
        triangles, facet = surface.triangles, surface.facet
        self._facets = int(facet.max()) + 1
        sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
        edges, of_side = np.unique(np.sort(sides.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
        of_side = of_side.reshape(-1)
        in_facet, back, times = np.unique(
            of_side * self._facets + np.repeat(facet, 3), return_inverse=True, return_counts=True
        )
        on_outline = (times[back.reshape(-1)] == 1).reshape(-1, 3)
        lengths = np.linalg.norm(np.roll(surface.plane, -1, axis=1) - surface.plane, axis=2)
        heights = 2.0 * self._areas()[:, None] / lengths
        beyond = np.where(on_outline, _TIP * surface.clearance / heights + _BEYOND, 0.0)
        self.faces = Faces(np.ascontiguousarray(triangles), beyond, np.ascontiguousarray(edges))
        # each node and edge belongs to one triangle, so that pairs of triangles give each pair once
        self._owner = np.empty(len(surface.body), dtype=np.int64)
        self._owner[triangles.ravel()] = np.repeat(np.arange(len(triangles)), 3)
        self._edge_owner = np.empty(len(edges), dtype=np.int64)
        self._edge_owner[of_side] = np.repeat(np.arange(len(triangles)), 3)
        self._edge_of = of_side.reshape(-1, 3)
        edge_facets = np.full((len(edges), 2), -1, dtype=np.int64)
        number, own = np.divmod(in_facet, self._facets)
        edge_facets[number[::-1], 0] = own[::-1]
        edge_facets[number, 1] = own
        self._edge_facets = edge_facets
        self._on, first = np.unique((triangles * self._facets + facet[:, None]).ravel(), return_index=True)
        self._on_plane = surface.plane.reshape(-1, 2)[first]
        self._longest, self._middle = float(lengths.max()), surface.plane.mean(axis=1)
        shares = np.bincount(of_side, weights=np.repeat(self._areas() / 3.0, 3))
        self._edge_area = shares
        self.margin = _MARGIN * float(lengths.mean())
        self.reference: np.ndarray | None = None
        self._committed: np.ndarray | None = None
        self._side_key, self._side = np.zeros(0, dtype=np.int64), np.zeros(0)
        self._closed = np.zeros(0, dtype=np.int64)
        self.refreshes = 0
        self._neighbours = self._neighbouring_facets()
        self._tapers = self._tapers_at_creases()
        self._refresh(reference)
        inside = self.find(reference, 0.0).slot
        inside = np.concatenate([inside[self._of_neighbours(inside)], self._at_cuts(self._places(reference))])
        self._closed = np.unique(self.keys(inside))
        self.reference = None

    def _areas(self) -> np.ndarray:
        along = np.roll(self.surface.plane, -1, axis=1) - self.surface.plane
        return 0.5 * np.abs(along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0])

    # neighbours -----------------------------------------------------------------------------------------------------

    def _neighbouring_facets(self) -> np.ndarray:
        """Keys of all pairs of facets (in both orders) with a common node or across a cut, and of every facet with itself;
        sorted.
        """
        node, facet = np.divmod(self._on, self._facets)
        start = np.searchsorted(node, np.arange(len(self.surface.body) + 1))
        most = int(np.diff(start).max())
        one, two = np.array(self.surface.across_cuts, dtype=np.int64).reshape(-1, 2).T
        found = [facet * self._facets + facet, one * self._facets + two, two * self._facets + one]
        for shift in range(1, most):
            same = np.flatnonzero(node[shift:] == node[:-shift])
            one, two = facet[same], facet[same + shift]
            found += [one * self._facets + two, two * self._facets + one]
        return np.unique(np.concatenate(found))

    def _tapers_at_creases(self) -> Tapers:
        """Clearances of nodes at neighbours of their facets."""
        node, facet = np.divmod(self._on, self._facets)
        of = self._edge_facets
        between = (of >= 0).all(axis=1) & (of[:, 0] != of[:, 1])
        sides = np.tile(self.faces.edges[between], (2, 1))
        lines = common_lines(node, facet, self._on_plane, sides, of[between].T.ravel(), self._facets)
        return tapers_of(lines, node, facet, self._on_plane, self._facets)

    def _of_neighbours(self, slots: np.ndarray) -> np.ndarray:
        """Whether slots belong to facets with a common vertex."""
        at, points = self._slots, len(self._slots.node)
        out = np.zeros(len(slots), dtype=bool)
        is_point = slots < points
        node, facet = np.divmod(self._on, self._facets)
        start = np.searchsorted(node, np.arange(len(self.surface.body) + 1))
        for row in np.flatnonzero(is_point):
            own = facet[start[at.node[slots[row]]] : start[at.node[slots[row]] + 1]]
            out[row] = np.isin(own * self._facets + at.facet[slots[row]], self._neighbours).any()
        one, two = (self._edge_facets[at.pairs[slots[~is_point] - points, side]] for side in (0, 1))
        keys = (one[:, :, None] * self._facets + two[:, None, :]).reshape(len(one), 4)
        out[~is_point] = np.isin(keys, self._neighbours).any(axis=1)
        return out

    def _at_cuts(self, places: np.ndarray) -> np.ndarray:
        """Slots of facets across a cut whose node or edge lies on an edge of the other facet in these places.

        `find` does not return all of them: edges may lie in one line, and the gap may be zero.
        """
        pairs = np.array(self.surface.across_cuts, dtype=np.int64).reshape(-1, 2)
        if not len(pairs):
            return np.zeros(0, dtype=np.int64)
        slots, edges, reach = self._slots, self.faces.edges, max(self.surface.clearance, _ON_CUT * self._longest)
        both = np.concatenate([pairs, pairs[:, ::-1]])
        node, facet = np.divmod(self._on, self._facets)
        across = np.concatenate([node[facet == one] * self._facets + two for one, two in both.tolist()])
        beside = np.isin(slots.node * self._facets + slots.facet, across)
        number = np.repeat(np.arange(len(beside)), np.diff(slots.start))
        rows = np.flatnonzero(beside[number])
        corners = places[self.faces.triangles[slots.listed[rows]]]
        at = places[slots.node[number[rows]]]
        near = [_to_segment(at, corners[:, [k - 1, k]]) < reach for k in range(3)]
        points = np.unique(number[rows[np.any(near, axis=0)]])
        one, two = (self._edge_facets[slots.pairs[:, side]] for side in (0, 1))
        keys = (one[:, :, None] * self._facets + two[:, None, :]).reshape(-1, 4)
        rows = np.flatnonzero(np.isin(keys, both @ [self._facets, 1]).any(axis=1))
        ends = [places[edges[slots.pairs[rows, side]]] for side in (0, 1)]
        near = [_to_segment(a[:, k], b) < 0.5 * reach for a, b in (ends, ends[::-1]) for k in (0, 1)]
        return np.concatenate([points, len(slots.node) + rows[np.any(near, axis=0)]])

    # broad phase ----------------------------------------------------------------------------------------------------

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """See `ContactGeometry`."""
        return self._key[slots]

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `ContactGeometry`."""
        self._refresh(poses)
        return self._bodies, self.refreshes

    def _places(self, poses: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(poses[self.surface.body, :3])

    def _refresh(self, poses: np.ndarray) -> None:
        surface = self.surface
        none = np.zeros(len(surface.body))
        if self.reference is not None and not moved_beyond(
            poses, self.reference, surface.body, none, _RENEWAL * self.margin
        ):
            return
        places = self._places(poses)
        self.reference = poses.copy()
        # both sides may move before the next renewal
        self._set_up(self._candidates(places, places, surface.clearance + (1.0 + 2.0 * _RENEWAL) * self.margin))
        self.refreshes += 1

    def _set_up(self, slots: _Slots) -> None:
        surface = self.surface
        self._slots, self._selected = slots, False
        nodes, edges = len(surface.body), len(self.faces.edges)
        of_points = slots.node * self._facets + slots.facet
        self._key = np.concatenate([of_points, nodes * self._facets + slots.pairs[:, 0] * edges + slots.pairs[:, 1]])
        own = surface.area[slots.node]
        least = self._edge_area[slots.pairs].min(axis=1, initial=np.inf)
        self.share = 0.5 * np.concatenate([own, least]) / surface.face
        self.area = np.concatenate([0.5 * own, np.zeros(len(slots.pairs))])
        self.pair = np.full(len(self.share), surface.number, dtype=np.int64)
        one, two = slots.pairs.T
        of_edges = self._tapers.of_edges(
            self.faces.edges[one], self.faces.edges[two], self._edge_facets[one], self._edge_facets[two]
        )
        self._point_clearance = surface.clearance * self._tapers.of(slots.node, slots.facet)
        self._edge_clearance = 0.5 * surface.clearance * of_edges
        corners = self.faces.triangles[slots.listed]
        node = np.repeat(slots.node, np.diff(slots.start))
        self._passing = np.column_stack([node, corners])
        self._crossing = np.concatenate([self.faces.edges[slots.pairs[:, 0]], self.faces.edges[slots.pairs[:, 1]]], axis=1)
        both = np.concatenate([self._passing, self._crossing])
        if surface.clearance == 0.0:
            both = self._passing
        coupled = [both[:, [i, j]] for i in range(4) for j in range(i + 1, 4)]
        low_high = np.sort(np.concatenate(coupled), axis=1)
        number = np.unique(low_high[:, 0] * nodes + low_high[:, 1])
        self._bodies = surface.body[np.stack(np.divmod(number, nodes), axis=1)]

    def _candidates(self, start: np.ndarray, end: np.ndarray, reach: float) -> _Slots:
        """Possible contacts of nodes that move between two sets of places (n, 3), within a distance (m)."""
        corners = np.concatenate([start[self.faces.triangles], end[self.faces.triangles]], axis=1)
        low, high = corners.min(axis=1) - 0.5 * reach, corners.max(axis=1) + 0.5 * reach
        near = overlapping_boxes(low, high)
        both = np.concatenate([near, near[:, ::-1]])
        point_low, point_high = np.minimum(start, end) - 0.5 * reach, np.maximum(start, end) + 0.5 * reach
        node = self.faces.triangles[both[:, 0]]
        row, corner = np.nonzero(self._owner[node] == both[:, :1])
        node, triangle = node[row, corner], both[row, 1]
        meet = ((point_low[node] <= high[triangle]) & (low[triangle] <= point_high[node])).all(axis=1)
        node, triangle = node[meet], triangle[meet]
        allowed = self._allowed(node, triangle)
        node, triangle = node[allowed], triangle[allowed]
        key = node * self._facets + self.surface.facet[triangle]
        is_open = ~np.isin(key, self._closed)
        node, triangle, key = node[is_open], triangle[is_open], key[is_open]
        order = np.lexsort((triangle, key))
        known, first = np.unique(key[order], return_index=True)
        return _Slots(
            *np.divmod(known, self._facets), np.append(first, len(order)).astype(np.int64), triangle[order],
            self._edge_candidates(start, end, near, reach),
        )  # fmt: skip

    def _allowed(self, node: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Whether a node does not belong to the facet of the triangle, or is far from the triangle along this facet."""
        key = node * self._facets + self.surface.facet[triangle]
        at = np.minimum(np.searchsorted(self._on, key), len(self._on) - 1)
        own = self._on[at] == key
        far = np.linalg.norm(self._on_plane[at] - self._middle[triangle], axis=1) > self._own_distance
        return np.asarray(~own | far)

    @property
    def _own_distance(self) -> float:
        return max(4.0 * self.surface.clearance, (_APART + 1.0) * self._longest)

    def _edge_candidates(self, start: np.ndarray, end: np.ndarray, near: np.ndarray, reach: float) -> np.ndarray:
        """Pairs of edges that may meet, (p, 2)."""
        edges = self.faces.edges
        one, two = (self._edge_of[near[:, side]] for side in (0, 1))
        mine, others = (self._edge_owner[of] == near[:, side, None] for side, of in ((0, one), (1, two)))
        row, i, j = np.nonzero(mine[:, :, None] & others[:, None, :])
        pairs = np.stack([one[row, i], two[row, j]], axis=1)
        ends = np.concatenate([start[edges], end[edges]], axis=1)
        low, high = ends.min(axis=1) - 0.5 * reach, ends.max(axis=1) + 0.5 * reach
        a, b = pairs.T
        meet = ((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1)
        pairs = np.sort(pairs[meet], axis=1)
        a, b = pairs.T
        common = (edges[a][:, :, None] == edges[b][:, None, :]).any(axis=(1, 2))
        same = (self._edge_facets[a][:, :, None] == self._edge_facets[b][:, None, :]).any(axis=(1, 2))
        far = (
            np.linalg.norm(self._middle[self._edge_owner[a]] - self._middle[self._edge_owner[b]], axis=1)
            > self._own_distance + self._longest
        )
        one_facet = self.surface.facet[self._edge_owner[a]] == self.surface.facet[self._edge_owner[b]]
        key = len(self.surface.body) * self._facets + a * len(edges) + b
        return pairs[~common & (~same | (one_facet & far)) & ~np.isin(key, self._closed)]

    # narrow phase ---------------------------------------------------------------------------------------------------

    def find(self, poses: np.ndarray, below: float) -> ActiveContacts:
        """See `ContactGeometry`; `at` holds the closest points, `Found`."""
        self._refresh(poses)
        places, slots, clearance = self._places(poses), self._slots, self.surface.clearance
        slot, gap, found = self._points(places, below)
        if clearance == 0.0 or not len(slots.pairs):
            return ActiveContacts(slot, gap, found)
        every = np.arange(len(slots.pairs))
        more, other, crossing = find_edge_edges(places, every, slots.pairs, self.faces.edges, self._edge_clearance, below)
        both = tuple(np.concatenate(values) for values in zip(found, crossing, strict=True))
        return ActiveContacts(np.concatenate([slot, more + len(slots.node)]), np.concatenate([gap, other]), both)

    def _points(self, places: np.ndarray, below: float) -> tuple[np.ndarray, np.ndarray, Found]:
        slots = self._slots
        if not self._selected:
            self._select(places if self._committed is None else self._committed)
        slot, gap, found = find_point_faces(
            places, slots.node, self._triangle, self._part, self._side_now, self.faces, self._point_clearance, self.margin,
            below,
        )  # fmt: skip
        return slot, gap, Found(*found)

    def _select(self, places: np.ndarray) -> None:
        """Select the triangles of the next step. A node keeps its known side of a facet."""
        slots = self._slots
        self._triangle, self._part, self._side_now = select_faces(places, slots.node, slots.start, slots.listed, self.faces)
        if len(self._side_key):
            key = self._key[: len(slots.node)]
            at = np.minimum(np.searchsorted(self._side_key, key), len(self._side_key) - 1)
            known = (self._side_key[at] == key) & (self._side_now != 0.0)
            self._side_now[known] = self._side[at[known]]
        self._selected = True

    def measure(self, poses: np.ndarray, rates: np.ndarray, touching: ActiveContacts) -> ContactKinematics:
        """See `ContactGeometry`."""
        found = Found(*touching.at)
        measured = ContactKinematics(*measure_features(rates, self.surface.body, found))
        edges = np.flatnonzero(touching.slot >= len(self._slots.node))
        if not len(edges):
            return measured
        of_edges = Found(*(np.ascontiguousarray(values[edges]) for values in found))
        rows, part, gradient, hessian = parallel_weights(self._places(poses), of_edges, _PARALLEL)
        return measured._replace(tapered=Tapered(edges[rows], part, gradient, hessian, False)) if len(rows) else measured

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
        """See `ContactGeometry`."""
        tangent_features(
            self._places(poses), rates, measured.bodies, measured.gradient, Found(*touching.at), forces, pattern.index,
            stiffness, damping,
        )  # fmt: skip

    def facet_forces(self, slots: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Normal force on each facet, (n_facets,), N, from the forces (n,) of slots.

        Both sides of a contact count. A node or an edge of several facets gives each of them an equal part.
        """
        at, total = self._slots, np.zeros(self._facets)
        points = slots < len(at.node)
        number, size = slots[points], forces[points]
        np.add.at(total, at.facet[number], size)
        node, facet = np.divmod(self._on, self._facets)
        start = np.searchsorted(node, np.arange(len(self.surface.body) + 1))
        for one, force in zip(at.node[number].tolist(), size.tolist(), strict=True):
            total[facet[start[one] : start[one + 1]]] += force / (start[one + 1] - start[one])
        pairs, size = at.pairs[slots[~points] - len(at.node)], forces[~points]
        for side in (0, 1):
            np.add.at(total, self._edge_facets[pairs[:, side]], 0.5 * size[:, None])
        return total

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, poses: np.ndarray, young: np.ndarray | None = None) -> None:
        """See `ContactGeometry`; the memory consists of positions, and the sides of nodes near facets."""
        self._refresh(poses)
        places = self._places(poses)
        # a node deeper than the limit has passed round its facet, so its present side is the new side
        within = self._points(places, self.margin)[0]
        kept = np.isin(self._side_key, self._key[within])
        self._side_key, self._side = self._side_key[kept], self._side[kept]
        self._committed = places
        self._select(places)
        known = np.flatnonzero(self._side_now)
        self._side_key, self._side = self._key[known], self._side_now[known]

    def memory(self) -> np.ndarray:
        """See `ContactGeometry`; the array contains positions, then keys and values of the sides."""
        if self._committed is None:
            return np.zeros(0)
        return np.concatenate([self._committed.ravel(), self._side_key, self._side])

    def restore(self, memory: np.ndarray) -> None:
        """See `ContactGeometry`."""
        size = 3 * len(self.surface.body)
        self._committed = memory[:size].reshape(-1, 3).copy() if len(memory) else None
        key, value = np.split(memory[size:], 2)
        self._side_key, self._side, self._selected = key.astype(np.int64), value.copy(), False

    def clear_caches(self) -> None:
        """See `ContactGeometry`."""
        self.reference = None

    def crossed(self, poses: np.ndarray) -> tuple[int, ...]:
        """See `ContactGeometry`. Without clearance, a node that has a side may be behind the facet, because the contact is
        soft.
        """
        start = self._committed
        if start is None:
            return ()
        self._refresh(poses)
        assert self.reference is not None
        places, slots = self._places(poses), self._slots
        passing, crossing, count = self._passing, self._crossing, np.diff(slots.start)
        if not self._selected:
            self._select(start)
        side = np.repeat(self._side_now, count)
        moved = np.abs(start - self._places(self.reference)).max(initial=0.0)
        if moved > _RENEWAL * self.margin:
            slots = self._candidates(start, places, 0.0)
            node = np.repeat(slots.node, np.diff(slots.start))
            passing = np.column_stack([node, self.faces.triangles[slots.listed]])
            crossing = np.concatenate([self.faces.edges[slots.pairs[:, 0]], self.faces.edges[slots.pairs[:, 1]]], axis=1)
            key = np.repeat(slots.node * self._facets + slots.facet, np.diff(slots.start))
            side = np.isin(key, self._side_key).astype(float)
        if self.surface.clearance == 0.0:
            return (self.surface.number,) if points_pass_triangles(start, places, passing[side == 0.0]).any() else ()
        through = points_pass_triangles(start, places, passing).any() or edges_pass_edges(start, places, crossing).any()
        return (self.surface.number,) if through else ()


def _to_segment(points: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Distances (n,) of points (n, 3) from segments (n, 2, 3)."""
    along, off = ends[:, 1] - ends[:, 0], points - ends[:, 0]
    part = np.clip(np.einsum("ij,ij->i", off, along) / np.einsum("ij,ij->i", along, along), 0.0, 1.0)
    return np.asarray(np.linalg.norm(off - part[:, None] * along, axis=1))
