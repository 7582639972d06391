"""Kernels of contacts of flexible facets with each other; see `fsm.model.bodies.contact_arrays` and
`fsm.model.contact.sheets.sheet_contacts`.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.triangles.closest_features import (
    Faces,
    Found,
    find_edge_edges,
    find_point_faces,
    height,
    list_near_edges,
    select_faces,
)
from fsm.interactions.triangles.feature_contact import parallel_weights, tangent_features, write_features
from fsm.interactions.triangles.triangles_pass import (
    edge_passes_edge,
    largest_approach,
    may_meet,
    point_passes_triangle,
    work_space,
)
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot
from fsm.model.bodies import contact_arrays as kept
from fsm.model.bodies.contact_arrays import ContactArrays, GeometryKernels, forces_of, index_of, must_renew
from fsm.model.contact.sheets import array_sheet_tables as index
from fsm.model.contact.sheets.array_sheet_search import Near, boxes, near_features, overlap, position_of
from fsm.model.contact.sheets.array_sheet_tables import SheetArrays
from fsm.solve.stepping.vectors import copy_into

RESTORED = 2
"""Value of the state REFERRED: the slots are those of the last renewal, but do not have the restored memory yet."""
_STAY, _APPROACH = 0.03, 2.0 * np.sqrt(3.0) * (1.0 + 1e-9)
"""Motion of nodes along an axis, over the margin, at which near edges are listed again, and the largest approach of two
edges over this motion."""
_PARALLEL = 0.01
"""Squared sine of the angle between two edges below which they count as nearly parallel."""


@kernel
def _places(own: SheetArrays, poses: np.ndarray) -> np.ndarray:
    """Places (n, 3) of all nodes, m."""
    out = np.empty((own.body.shape[0], 3))
    for i in range(out.shape[0]):
        for e in range(3):
            out[i, e] = poses[own.body[i], e]
    return out


@kernel
def _faces(own: SheetArrays) -> Faces:
    return Faces(own.triangles, own.beyond, own.edges)


@kernel
def _found(own: SheetArrays) -> Found:
    return Found(
        own.found_nodes, own.found_free, own.found_coefficients, own.found_directions, own.found_normal, own.found_distance
    )  # fmt: skip


# broad phase ------------------------------------------------------------------------------------------------------------


@kernel
def _tapers_of_nodes(own: SheetArrays) -> np.ndarray:
    """First taper (n + 1,) of every node; the tapers of a node are in the order of facets."""
    first, at = np.empty(own.body.shape[0] + 1, dtype=np.int64), 0
    for node in range(first.shape[0]):
        while at < own.taper_key.shape[0] and own.taper_key[at] < node * own.counts[index.FACETS]:
            at += 1
        first[node] = at
    return first


@kernel
def _taper(own: SheetArrays, first: np.ndarray, node: int, facet: int) -> float:
    """Clearance of a node at a facet, relative to the thickness."""
    key = node * own.counts[index.FACETS] + facet
    for at in range(first[node], first[node + 1]):
        if own.taper_key[at] == key:
            return own.taper[at]
    return 1.0


@kernel
def _taper_of_edge(own: SheetArrays, tapers: np.ndarray, edge: int, other: int) -> float:
    """Mean over the ends of an edge of the least clearance at the facets of another edge."""
    total, one, two = 0.0, own.edge_facets[other, 0], own.edge_facets[other, 1]
    for end in range(2):
        node = own.edges[edge, end]
        total += min(_taper(own, tapers, node, one), _taper(own, tapers, node, two))
    return 0.5 * total


@kernel
def _write_slots(g: ContactArrays, near: Near) -> None:
    """Replace all slots; the memory follows by `_recall`."""
    own = index.sheets_of(g)
    counts, clearance, nodes = own.counts, own.sizes[index.CLEARANCE], own.body.shape[0]
    share, area, pair, points, tapers = g.share, g.area, g.pair, near.node.shape[0], _tapers_of_nodes(own)
    counts[index.POINTS], counts[index.SLOTS] = points, points + near.one.shape[0]
    counts[index.LISTED], counts[index.NEAR] = near.listed.shape[0], -1
    for s in range(points):
        node, facet = near.node[s], near.facet[s]
        own.key[s] = node * counts[index.FACETS] + facet
        own.first_of[s], own.second_of[s], own.start[s] = node, facet, near.start[s]
        own.clearance[s] = clearance * _taper(own, tapers, node, facet)
        # each of both faces has half of the stiffness
        share[s], area[s] = 0.5 * own.node_area[node] / own.sizes[index.FACE], 0.5 * own.node_area[node]
    own.start[points] = near.start[points]
    for k in range(near.listed.shape[0]):
        own.listed[k] = near.listed[k]
    for k in range(near.one.shape[0]):
        s, one, two = points + k, near.one[k], near.two[k]
        own.key[s] = nodes * counts[index.FACETS] + one * own.edges.shape[0] + two
        own.first_of[s], own.second_of[s] = one, two
        both = _taper_of_edge(own, tapers, one, two) + _taper_of_edge(own, tapers, two, one)
        own.clearance[s] = 0.25 * clearance * both
        share[s], area[s] = 0.5 * min(own.edge_area[one], own.edge_area[two]) / own.sizes[index.FACE], 0.0
    for s in range(counts[index.SLOTS]):
        pair[s] = counts[index.NUMBER]


@kernel
def _recall(g: ContactArrays) -> None:
    """Copy the memory of the last accepted state to the slots."""
    own, onset, began, depth, deflection = index.sheets_of(g), g.onset, g.began, g.depth, g.deflection
    onset[:] = 0.0
    began[:] = 0.0
    depth[:] = 0.0
    deflection[:] = 0.0
    for k in range(own.counts[index.KEPT]):
        s = position_of(own.key, own.counts[index.SLOTS], own.kept_key[k])
        if s >= 0:
            onset[s], began[s], depth[s] = own.kept[k, 0], own.kept[k, 1], own.kept[k, 2]
            for c in range(deflection.shape[1]):
                deflection[s, c] = own.kept[k, 3 + c]


@kernel
def _depths(g: ContactArrays) -> tuple[np.ndarray, np.ndarray]:
    """Keys (m,) of the slots that have a depth in Newton's method of statics, and both depths (m, 2)."""
    own, pressed, before, count = index.sheets_of(g), g.pressed, g.pressed_before, 0
    keys, depths = np.empty(own.counts[index.SLOTS], dtype=np.int64), np.empty((own.counts[index.SLOTS], 2))
    for s in range(keys.shape[0]):
        if pressed[s] > 0.0 or before[s] > 0.0:
            keys[count], depths[count, 0], depths[count, 1] = own.key[s], pressed[s], before[s]
            count += 1
    return keys[:count], depths[:count]


@kernel
def _press_again(g: ContactArrays, keys: np.ndarray, depths: np.ndarray) -> None:
    """Write the depths of slots with these keys."""
    own, pressed, before = index.sheets_of(g), g.pressed, g.pressed_before
    pressed[:] = 0.0
    before[:] = 0.0
    for k in range(keys.shape[0]):
        s = position_of(own.key, own.counts[index.SLOTS], keys[k])
        if s >= 0:
            pressed[s], before[s] = depths[k, 0], depths[k, 1]


@kernel
def _with_force(g: ContactArrays) -> np.ndarray:
    """Keys of the slots that had a force in the last tangent; -1 for a slot that no longer exists."""
    key, linearised, count = index.sheets_of(g).key, g.linearised, 0
    out = np.empty(linearised.shape[0], dtype=np.int64)
    for s in range(out.shape[0]):
        if linearised[s] == 1:
            out[count] = key[s] if s < out.shape[0] - 1 else -1
            count += 1
    return out[:count]


@kernel
def _mark_again(g: ContactArrays, keys: np.ndarray) -> None:
    """Mark the slots with these keys. The last row, which is no slot, stands for a slot that no longer exists."""
    own, linearised = index.sheets_of(g), g.linearised
    linearised[:] = 0
    for k in range(keys.shape[0]):
        s = position_of(own.key, own.counts[index.SLOTS], keys[k])
        linearised[s if s >= 0 else linearised.shape[0] - 1] = 1


@kernel
def _lacks(g: ContactArrays, places: np.ndarray, nodes: np.ndarray, split: int, reach: float) -> bool:
    """Whether the pattern lacks a pair of nodes of a slot, if the nodes before and after the split are within reach."""
    for e in range(3):
        low, high, other_low, other_high = np.inf, -np.inf, np.inf, -np.inf
        for m in range(4):
            at = places[nodes[m], e]
            if m < split:
                low, high = min(low, at), max(high, at)
            else:
                other_low, other_high = min(other_low, at), max(other_high, at)
        if low - other_high > reach or other_low - high > reach:
            return False
    dof, indptr, indices = index_of(g)
    body = index.sheets_of(g).body
    for i in range(4):
        for j in range(i):
            row, column = dof[body[nodes[i]]], dof[body[nodes[j]]]
            if row >= 0 and column >= 0 and find_slot(indptr, indices, row, column) < 0:
                return True
    return False


@kernel
def _check_pattern(g: ContactArrays, places: np.ndarray) -> None:
    """Mark whether the pattern lacks a pair of bodies of slots that may touch before the next renewal."""
    own, nodes = index.sheets_of(g), np.empty(4, dtype=np.int64)
    reach, points = own.sizes[index.CLEARANCE] + 2.0 * kept.RENEWAL * g.numbers[kept.MARGIN], own.counts[index.POINTS]
    for s in range(points):
        nodes[0] = own.first_of[s]
        for k in range(own.start[s], own.start[s + 1]):
            for corner in range(3):
                nodes[1 + corner] = own.triangles[own.listed[k], corner]
            if _lacks(g, places, nodes, 1, reach):
                g.state[kept.LACKS] = 1
                return
    for s in range(points, own.counts[index.SLOTS]):
        _edge_nodes(own, s, nodes)
        if _lacks(g, places, nodes, 2, reach):
            g.state[kept.LACKS] = 1
            return


@kernel
def _edge_nodes(own: SheetArrays, slot: int, nodes: np.ndarray) -> None:
    for end in range(2):
        nodes[end], nodes[2 + end] = own.edges[own.first_of[slot], end], own.edges[own.second_of[slot], end]


@kernel
def _renew(g: ContactArrays, poses: np.ndarray) -> int:
    own, state = index.sheets_of(g), g.state
    if not must_renew(g, poses):
        if state[kept.REFERRED] == RESTORED:
            _recall(g)
            state[kept.REFERRED], state[kept.FOUND] = 1, -1
        return 0
    places, counts = _places(own, poses), own.counts
    # both sides may move before the next renewal
    near = near_features(
        own, places, places, own.sizes[index.CLEARANCE] + (1.0 + 2.0 * kept.RENEWAL) * g.numbers[kept.MARGIN]
    )
    counts[index.WANTED], counts[index.WANTED_LISTED] = near.node.shape[0] + near.one.shape[0] + 1, near.listed.shape[0]
    if counts[index.WANTED] > own.key.shape[0] or counts[index.WANTED_LISTED] > own.listed.shape[0]:
        state[kept.LACKS], state[kept.REFERRED] = 1, 0  # the slots remain until there is room
        return 0
    copy_into(poses, g.reference)
    with_force = _with_force(g)
    pressed, depths = _depths(g)
    _write_slots(g, near)
    _recall(g)
    _press_again(g, pressed, depths)
    _mark_again(g, with_force)
    if g.indptr.shape[0] > 0:
        _check_pattern(g, places)
    counts[index.SELECTED] = 0
    counts[index.RENEWALS] += 1
    state[kept.REFERRED], state[kept.FOUND] = 1, -1
    return 1


# contacts ---------------------------------------------------------------------------------------------------------------


@kernel
def _select(own: SheetArrays, places: np.ndarray) -> None:
    """Select the triangles of the next step. A node keeps its known side of a facet."""
    points, side = own.counts[index.POINTS], own.side
    select_faces(
        places, own.first_of[:points], own.start, own.listed, _faces(own), own.triangle, own.part, side
    )  # fmt: skip
    for s in range(points):
        if side[s] != 0.0:
            at = position_of(own.side_key, own.counts[index.SIDES], own.key[s])
            if at >= 0:
                side[s] = own.side_of[at]
    own.counts[index.SELECTED] = 1


@kernel
def _select_once(g: ContactArrays, places: np.ndarray) -> None:
    """Select the triangles in the last accepted state, or in these places if there is none."""
    own = index.sheets_of(g)
    if own.counts[index.SELECTED] == 0:
        _select(own, _places(own, g.committed) if g.state[kept.STARTED] == 1 else places)


@kernel
def _find_points(g: ContactArrays, places: np.ndarray, below: float) -> int:
    own = index.sheets_of(g)
    points = own.counts[index.POINTS]
    _select_once(g, places)
    return int(find_point_faces(
        places, own.first_of[:points], own.triangle, own.part, own.side, _faces(own), own.clearance, g.numbers[kept.MARGIN],
        below, g.slot, g.gap, _found(own),
    ))  # fmt: skip


@kernel
def _find(g: ContactArrays, poses: np.ndarray, below: float) -> int:
    own = index.sheets_of(g)
    places = _places(own, poses)
    count = _find_points(g, places, below)
    _renew_near_edges(own, places, below, _STAY * g.numbers[kept.MARGIN])
    return int(find_edge_edges(
        places, own.first_of, own.second_of, own.near[: own.counts[index.NEAR]], own.edges, own.clearance, below, g.slot,
        g.gap, _found(own), count,
    ))  # fmt: skip


@kernel
def _renew_near_edges(own: SheetArrays, places: np.ndarray, below: float, move: float) -> None:
    """List the slots of edges whose gap may be below a bound (m) until a node has moved by `move` (m) along an axis, unless
    the present list contains them.
    """
    counts, sizes, since = own.counts, own.sizes, own.near_at
    known = counts[index.NEAR] >= 0 and below <= sizes[index.WITHIN]
    for i in range(places.shape[0]):
        for e in range(3):
            known = known and abs(places[i, e] - since[i, e]) <= move
    if known:
        return
    copy_into(places, since)
    slots, sizes[index.WITHIN] = counts[index.SLOTS], below
    reach = below + _APPROACH * move
    counts[index.NEAR] = list_near_edges(
        places, own.first_of[:slots], own.second_of[:slots], counts[index.POINTS], own.edges, own.clearance, reach, own.near
    )


@kernel
def _measure(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    own = index.sheets_of(g)
    write_features(rates, own.body, _found(own), count, g.bodies, g.rate, g.gradient)


@kernel
def _keep_rows(g: ContactArrays, rows: np.ndarray) -> None:
    found = _found(index.sheets_of(g))
    for i in range(rows.shape[0]):
        k = rows[i]
        found.free[i], found.distance[i] = found.free[k], found.distance[k]
        for m in range(4):
            found.nodes[i, m], found.coefficients[i, m] = found.nodes[k, m], found.coefficients[k, m]
            for a in range(2):
                found.directions[i, a, m] = found.directions[k, a, m]
        for e in range(3):
            found.normal[i, e] = found.normal[k, e]


@kernel
def _tapered(g: ContactArrays, poses: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    own, slot, first = index.sheets_of(g), g.slot, count
    while first > 0 and slot[first - 1] >= own.counts[index.POINTS]:
        first -= 1
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] = parallel_weights(
        _places(own, poses), _found(own), first, count, _PARALLEL
    )
    return found


@kernel
def _tangent(
    g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    own = index.sheets_of(g)
    tangent_features(
        _places(own, poses), rates, g.bodies[:count], g.gradient[:count], _found(own), forces_of(g, 0, count), index_of(g),
        stiffness, damping,
    )  # fmt: skip


# memory -----------------------------------------------------------------------------------------------------------------


@kernel
def _keep_sides(own: SheetArrays, places: np.ndarray, margin: float) -> int:
    """Keep the known sides of nodes over a facet that are within the margin; returns their number.

    A node deeper than the margin has passed round its facet, so its present side is the new side.
    """
    left = at = 0
    for s in range(own.counts[index.POINTS]):
        while at < own.counts[index.SIDES] and own.side_key[at] < own.key[s]:
            at += 1
        known = at < own.counts[index.SIDES] and own.side_key[at] == own.key[s]
        if not known or own.side[s] == 0.0 or own.triangle[s] < 0:
            continue
        above, area = height(places, own.first_of[s], own.triangles, own.triangle[s])
        distance = own.side[s] * above / np.sqrt(area)
        if distance >= -margin and distance - own.clearance[s] < margin:
            own.side_key[left], own.side_of[left] = own.key[s], own.side_of[at]
            left += 1
    return left


@kernel
def _settle(g: ContactArrays, poses: np.ndarray, young: np.ndarray, new: bool) -> None:
    own, state = index.sheets_of(g), g.state
    if new:
        return
    counts, places = own.counts, _places(own, poses)
    _select_once(g, places)
    state[kept.FOUND] = -1
    counts[index.SIDES] = _keep_sides(own, places, g.numbers[kept.MARGIN])
    _select(own, places)
    left = 0
    for s in range(counts[index.POINTS]):
        if own.side[s] != 0.0:
            own.side_key[left], own.side_of[left] = own.key[s], own.side[s]
            left += 1
    counts[index.SIDES] = left
    _keep(g)


@kernel
def _keep(g: ContactArrays) -> None:
    """Copy the memory of the slots to the memory of the last accepted state."""
    own, onset, deflection, left = index.sheets_of(g), g.onset, g.deflection, 0
    for s in range(own.counts[index.SLOTS]):
        if onset[s] > 0.0:
            own.kept_key[left] = own.key[s]
            own.kept[left, 0], own.kept[left, 1], own.kept[left, 2] = onset[s], g.began[s], g.depth[s]
            for c in range(deflection.shape[1]):
                own.kept[left, 3 + c] = deflection[s, c]
            left += 1
    own.counts[index.KEPT] = left


# passing ----------------------------------------------------------------------------------------------------------------


@kernel
def _had_side(own: SheetArrays, node: int, facet: int) -> bool:
    return position_of(own.side_key, own.counts[index.SIDES], node * own.counts[index.FACETS] + facet) >= 0


@kernel
def _passed(g: ContactArrays, poses: np.ndarray) -> int:
    """See `GeometryKernels`: nodes through triangles, and edges through edges.

    Without clearance, a node that has a side may be behind its facet, because the contact is soft.
    """
    own = index.sheets_of(g)
    if g.state[kept.STARTED] == 0:
        return -1
    start, end = _places(own, g.committed), _places(own, poses)
    _select_once(g, start)
    listed = _listed(own)
    reference, moved, bound = g.reference, 0.0, kept.RENEWAL * g.numbers[kept.MARGIN]
    for i in range(start.shape[0]):
        for e in range(3):
            moved = max(moved, abs(start[i, e] - reference[own.body[i], e]))
    beyond = moved > bound
    if beyond:
        listed = near_features(own, start, end, 0.0)
    nodes, w, soft = np.empty(4, dtype=np.int64), work_space(), own.sizes[index.CLEARANCE] == 0.0
    reach = largest_approach(start, end)
    low, high = boxes(start, start, own.triangles, reach)
    for s in range(listed.node.shape[0]):
        node = listed.node[s]
        if soft and (_had_side(own, node, listed.facet[s]) if beyond else own.side[s] != 0.0):
            continue
        nodes[0] = node
        for k in range(listed.start[s], listed.start[s + 1]):
            if not overlap(start, start, node, low, high, listed.listed[k]):
                continue
            for corner in range(3):
                nodes[1 + corner] = own.triangles[listed.listed[k], corner]
            if may_meet(start, end, nodes, 1) and point_passes_triangle(start, end, nodes, w):
                return int(own.counts[index.NUMBER])
    low, high = boxes(start, start, own.edges, 0.5 * reach)
    for s in range(listed.one.shape[0]):
        if not overlap(low, high, listed.one[s], low, high, listed.two[s]):
            continue
        for tip in range(2):
            nodes[tip], nodes[2 + tip] = own.edges[listed.one[s], tip], own.edges[listed.two[s], tip]
        if may_meet(start, end, nodes, 2) and edge_passes_edge(start, end, nodes, w):
            return int(own.counts[index.NUMBER])
    return -1


@kernel
def _listed(own: SheetArrays) -> Near:
    """Present slots."""
    points, slots = own.counts[index.POINTS], own.counts[index.SLOTS]
    return Near(
        own.first_of[:points], own.second_of[:points], own.start[: points + 1], own.listed[: own.counts[index.LISTED]],
        own.first_of[points:slots], own.second_of[points:slots],
    )  # fmt: skip


SHEETS = GeometryKernels(_renew, _find, _measure, _keep_rows, _tapered, _tangent, _passed, _settle)
