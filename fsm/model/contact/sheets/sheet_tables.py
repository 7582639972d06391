"""Arrays of the mesh of flexible facets that touch each other, without slots; see
`fsm.model.contact.sheets.array_sheet_tables`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.interactions.search.box_pairs import curve_positions
from fsm.kernels.tables import empty_arrays, with_rows
from fsm.model.bodies.contact_arrays import OF_SLOTS, ContactArrays
from fsm.model.contact.crease_clearance import Tapers, common_lines, tapers_of
from fsm.model.contact.sheets import array_sheet_tables as index
from fsm.model.contact.sheets.array_sheet_tables import SheetArrays

_APART = 2.0
"""Distance along a facet over the longest edge, beyond which it may touch itself."""
_TIP, _BEYOND = 0.1, 1e-3
"""Lengths by which a facet extends straight beyond its outline: relative to the clearance, and relative to the height of a
triangle."""
_ON_CUT = 1e-9
"""Distance, relative to the longest edge, below which a node lies on an edge of a facet across a cut."""
_ROOM = 1.5
"""Rows over the slots of the last broad phase."""


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


def arrays_of_mesh(surface: SheetSurface, slips: int) -> SheetArrays:
    """Arrays of the mesh, without slots and without memory."""
    triangles, facet, plane = surface.triangles, surface.facet, surface.plane
    facets, count = int(facet.max()) + 1, len(triangles)
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    edges, of_side = np.unique(np.sort(sides.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    of_side = of_side.reshape(-1)
    in_facet, back, times = np.unique(of_side * facets + np.repeat(facet, 3), return_inverse=True, return_counts=True)
    on_outline = (times[back.reshape(-1)] == 1).reshape(-1, 3)
    along = np.roll(plane, -1, axis=1) - plane
    lengths = np.linalg.norm(along, axis=2)
    areas = 0.5 * np.abs(along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0])
    beyond = np.where(on_outline, _TIP * surface.clearance * lengths / (2.0 * areas[:, None]) + _BEYOND, 0.0)
    # each node and edge belongs to one triangle, so that pairs of triangles give each pair once
    owner, edge_owner = np.full(len(surface.body), -1), np.full(len(edges), -1)
    owner[triangles.ravel()] = edge_owner[of_side] = np.repeat(np.arange(count), 3)
    edge_facets = np.full((len(edges), 2), -1, dtype=np.int64)
    number, own = np.divmod(in_facet, facets)
    edge_facets[number[::-1], 0], edge_facets[number, 1] = own[::-1], own
    on, first = np.unique((triangles * facets + facet[:, None]).ravel(), return_index=True)
    on_plane, longest = plane.reshape(-1, 2)[first], float(lengths.max())
    tapers = _tapers_at_creases(on, on_plane, edges, edge_facets, facets)
    counts = np.zeros(index.NUMBER + 1, dtype=np.int64)
    counts[index.FACETS], counts[index.NEAR], counts[index.NUMBER] = facets, -1, surface.number
    own_distance = max(4.0 * surface.clearance, (_APART + 1.0) * longest)
    middle = plane.mean(axis=1)
    order = np.lexsort((curve_positions(middle, middle), facet))
    arrays = empty_arrays(SheetArrays)._replace(
        counts=counts, sizes=np.array([surface.face, surface.clearance, own_distance, longest, 0.0]), body=surface.body,
        node_area=surface.area, owner=owner, triangles=triangles, beyond=beyond, edges=edges, facet=facet,
        middle=middle, edge_of=of_side.reshape(-1, 3), order=order, edge_facets=edge_facets, edge_owner=edge_owner,
        edge_area=np.bincount(of_side, weights=np.repeat(areas / 3.0, 3)), on=on, on_plane=on_plane,
        taper_key=tapers.key, taper=tapers.factor, near_at=np.zeros((len(surface.body), 3)), kept=np.zeros((0, 3 + slips)),
        found_nodes=np.zeros((0, 4), dtype=np.int64), found_coefficients=np.zeros((0, 4)),
        found_directions=np.zeros((0, 2, 4)), found_normal=np.zeros((0, 3)),
    )  # fmt: skip
    return SheetArrays(*(np.ascontiguousarray(array) for array in arrays))


def _tapers_at_creases(on: np.ndarray, on_plane: np.ndarray, edges: np.ndarray, of: np.ndarray, facets: int) -> Tapers:
    """Clearances of nodes at neighbours of their facets."""
    node, facet = np.divmod(on, facets)
    between = of[:, 0] != of[:, 1]
    sides = np.tile(edges[between], (2, 1))
    lines = common_lines(node, facet, on_plane, sides, of[between].T.ravel(), facets)
    return tapers_of(lines, node, facet, on_plane, facets)


# rows of slots ----------------------------------------------------------------------------------------------------------


def is_full(own: SheetArrays) -> bool:
    """Whether the last broad phase needed more rows than there are."""
    return bool(own.counts[index.WANTED] > len(own.key) or own.counts[index.WANTED_LISTED] > len(own.listed))


def roomier(common: ContactArrays, own: SheetArrays, least: int = 0) -> tuple[ContactArrays, SheetArrays]:
    """Arrays with rows for the slots that the last broad phase needed and some more, and at least `least` rows."""
    slots, listed = (max(64, int(_ROOM * own.counts[row])) for row in (index.WANTED, index.WANTED_LISTED))
    own = with_rows(
        with_rows(own, index.BY_SLOT, max(slots, least, len(own.key))), ("listed",), max(listed, len(own.listed))
    )
    return with_rows(common, OF_SLOTS, len(own.key)), own


def set_sides(common: ContactArrays, own: SheetArrays, sides: np.ndarray) -> tuple[ContactArrays, SheetArrays]:
    """Arrays with these keys and values of the sides; the selection of triangles is made again."""
    key, value = np.split(sides, 2)
    if len(key) > len(own.side_key):
        common, own = roomier(common, own, len(key))
    own.counts[index.SIDES], own.counts[index.SELECTED] = len(key), 0
    own.side_key[: len(key)], own.side_of[: len(key)] = key, value
    return common, own


def bodies_of_slots(own: SheetArrays) -> np.ndarray:
    """Pairs (m, 2) of bodies that the present slots couple."""
    points, slots, nodes = own.counts[index.POINTS], own.counts[index.SLOTS], len(own.body)
    node = np.repeat(own.first_of[:points], np.diff(own.start[: points + 1]))
    passing = np.column_stack([node, own.triangles[own.listed[: own.counts[index.LISTED]]]])
    one, two = (own.edges[of[points:slots]] for of in (own.first_of, own.second_of))
    both = np.concatenate([passing, np.concatenate([one, two], axis=1)])
    coupled = [both[:, [i, j]] for i in range(4) for j in range(i + 1, 4)]
    low_high = np.sort(np.concatenate(coupled), axis=1)
    number = np.unique(low_high[:, 0] * nodes + low_high[:, 1])
    return own.body[np.stack(np.divmod(number, nodes), axis=1)]


# slots without contact --------------------------------------------------------------------------------------------------


def left_out(surface: SheetSurface, own: SheetArrays, touching: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Keys, ascending, of slots without contact: those that touch at the start, given as numbers, between facets with a
    common vertex, and those of facets across a cut.
    """
    touching = touching[_of_neighbours(surface, own, touching)]
    return np.unique(own.key[np.concatenate([touching, _at_cuts(surface, own, places)])])


def _neighbouring_facets(surface: SheetSurface, own: SheetArrays) -> np.ndarray:
    """Keys of all pairs of facets (in both orders) with a common node or across a cut, and of every facet with itself;
    sorted.
    """
    facets = own.counts[index.FACETS]
    node, facet = np.divmod(own.on, facets)
    most = int(np.bincount(node).max())
    one, two = np.array(surface.across_cuts, dtype=np.int64).reshape(-1, 2).T
    found = [facet * facets + facet, one * facets + two, two * facets + one]
    for shift in range(1, most):
        same = np.flatnonzero(node[shift:] == node[:-shift])
        one, two = facet[same], facet[same + shift]
        found += [one * facets + two, two * facets + one]
    return np.unique(np.concatenate(found))


def _of_neighbours(surface: SheetSurface, own: SheetArrays, slots: np.ndarray) -> np.ndarray:
    """Whether slots belong to facets with a common vertex."""
    neighbours, points, facets = _neighbouring_facets(surface, own), own.counts[index.POINTS], own.counts[index.FACETS]
    out = np.zeros(len(slots), dtype=bool)
    is_point = slots < points
    node, facet = np.divmod(own.on, facets)
    start = np.searchsorted(node, np.arange(len(own.body) + 1))
    for row in np.flatnonzero(is_point):
        at = own.first_of[slots[row]]
        of = facet[start[at] : start[at + 1]]
        out[row] = np.isin(of * facets + own.second_of[slots[row]], neighbours).any()
    out[~is_point] = np.isin(_facets_of_edges(own, slots[~is_point]), neighbours).any(axis=1)
    return out


def _facets_of_edges(own: SheetArrays, slots: np.ndarray) -> np.ndarray:
    """Keys (m, 4) of the pairs of facets of pairs of edges."""
    one, two = own.edge_facets[own.first_of[slots]], own.edge_facets[own.second_of[slots]]
    return np.asarray((one[:, :, None] * own.counts[index.FACETS] + two[:, None, :]).reshape(-1, 4))


def _at_cuts(surface: SheetSurface, own: SheetArrays, places: np.ndarray) -> np.ndarray:
    """Slots of facets across a cut whose node or edge lies on an edge of the other facet in these places.

    The search does not return all of them: edges may lie in one line, and the gap may be zero.
    """
    pairs, facets = np.array(surface.across_cuts, dtype=np.int64).reshape(-1, 2), own.counts[index.FACETS]
    if not len(pairs):
        return np.zeros(0, dtype=np.int64)
    points, reach = own.counts[index.POINTS], max(own.sizes[index.CLEARANCE], _ON_CUT * own.sizes[index.LONGEST])
    both = np.concatenate([pairs, pairs[:, ::-1]])
    node, facet = np.divmod(own.on, facets)
    across = np.concatenate([node[facet == one] * facets + two for one, two in both.tolist()])
    beside = np.isin(own.key[:points], across)
    number = np.repeat(np.arange(points), np.diff(own.start[: points + 1]))
    rows = np.flatnonzero(beside[number])
    corners, at = places[own.triangles[own.listed[rows]]], places[own.first_of[number[rows]]]
    near = [_to_segment(at, corners[:, [k - 1, k]]) < reach for k in range(3)]
    found = np.unique(number[rows[np.any(near, axis=0)]])
    slots = np.arange(points, own.counts[index.SLOTS])
    slots = slots[np.isin(_facets_of_edges(own, slots), both @ [facets, 1]).any(axis=1)]
    ends = [places[own.edges[of[slots]]] for of in (own.first_of, own.second_of)]
    near = [_to_segment(a[:, k], b) < 0.5 * reach for a, b in (ends, ends[::-1]) for k in (0, 1)]
    return np.concatenate([found, slots[np.any(near, axis=0)]])


def _to_segment(points: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Distances (n,) of points (n, 3) from segments (n, 2, 3)."""
    along, off = ends[:, 1] - ends[:, 0], points - ends[:, 0]
    part = np.clip(np.einsum("ij,ij->i", off, along) / np.einsum("ij,ij->i", along, along), 0.0, 1.0)
    return np.asarray(np.linalg.norm(off - part[:, None] * along, axis=1))
