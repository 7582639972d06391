"""Named table of contacts of flexible facets with each other, for kernels; see `fsm.model.contact.sheets.sheet_contacts`.

Pairs of edges are too many for a slot each, so the slots are those of the last broad phase: nodes with facets, then pairs of
edges, both in the order of their keys. The memory of the last accepted state is stored by keys, and a renewal of the broad
phase copies it to the new slots.
"""

from __future__ import annotations

from typing import NamedTuple

from fsm.kernels.tables import Floats1, Floats2, Floats3, Integers1, Integers2, follows
from fsm.model.bodies.contact_arrays import ContactArrays


class SheetArrays(NamedTuple):
    """Arrays of flexible facets, after `ContactArrays`.

    Attributes
    ----------
    counts : int array
        POINTS, SLOTS: numbers of nodes with facets, and of all slots; LISTED: triangles of the slots; KEPT, SIDES: rows of
        the memory; SELECTED: 1 if the triangles of the slots are selected; RENEWALS of the broad phase; WANTED,
        WANTED_LISTED: rows that the last renewal needed; FACETS: number of facets; NEAR: number of slots of edges near each
        other, -1 if they are not known; NUMBER of the scene's contact pair.
    sizes : array
        FACE: area with the whole contact stiffness, m^2; CLEARANCE of the middle surfaces, m; OWN_DISTANCE: distance along a
        facet beyond which it may touch itself, m; LONGEST edge, m; WITHIN: bound of the gaps of edges near each other, m.
    body, node_area, owner : (n,) arrays
        Body and area of each node, and the triangle to which the node belongs.
    triangles, beyond, edges : see `fsm.interactions.triangles.closest_features.Faces`
    facet, middle, edge_of : (t,), (t, 2), (t, 3) arrays
        Facet of each triangle, its middle in the flat facet (m), and its edges.
    order : (t,) int array
        Triangles in an order in which neighbours are near each other.
    edge_facets, edge_owner, edge_area : (e, 2), (e,), (e,) arrays
        Facets of each edge, the triangle to which the edge belongs, and a third of the area of its triangles.
    on, on_plane : (k,) and (k, 2) arrays
        Keys node * facets + facet of nodes on facets, ascending, and their places in the flat facet, m.
    closed : (c,) int array
        Keys, ascending, of slots without contact.
    taper_key, taper : see `fsm.model.contact.crease_clearance.Tapers`
    near_at : (n, 3) array, m
        Places of the nodes for which `near` was found.
    key, first_of, second_of : (s,) int arrays
        Key of each slot; its node and facet, or its two edges.
    start, listed : int arrays, see `fsm.interactions.triangles.closest_features.select_faces`
    clearance : (s,) array, m
    near : (s,) int array
        Slots of edges near each other, ascending.
    triangle, part, side : (s,) arrays
        Selection for the next step, as `select_faces`; sides of nodes that had a side before keep it.
    kept_key, kept : (s,) and (s, 3 + slips) arrays
        Memory of the last accepted state: onset, began, depth and deflection of contacts, by ascending keys.
    side_key, side_of : (s,) arrays
        Sides of nodes in the last accepted state, by ascending keys.
    found_nodes, found_free, found_coefficients, found_directions, found_normal, found_distance : arrays of `Found`
    """

    counts: Integers1
    sizes: Floats1
    body: Integers1
    node_area: Floats1
    owner: Integers1
    triangles: Integers2
    beyond: Floats2
    edges: Integers2
    facet: Integers1
    middle: Floats2
    edge_of: Integers2
    order: Integers1
    edge_facets: Integers2
    edge_owner: Integers1
    edge_area: Floats1
    on: Integers1
    on_plane: Floats2
    closed: Integers1
    taper_key: Integers1
    taper: Floats1
    near_at: Floats2
    key: Integers1
    first_of: Integers1
    second_of: Integers1
    start: Integers1
    listed: Integers1
    clearance: Floats1
    near: Integers1
    triangle: Integers1
    part: Integers1
    side: Floats1
    kept_key: Integers1
    kept: Floats2
    side_key: Integers1
    side_of: Floats1
    found_nodes: Integers2
    found_free: Integers1
    found_coefficients: Floats2
    found_directions: Floats3
    found_normal: Floats2
    found_distance: Floats1


sheets_of = follows(SheetArrays, ContactArrays)
"""Arrays of the flexible facets of a table, in kernels."""
(
    POINTS, SLOTS, LISTED, KEPT, SIDES, SELECTED, RENEWALS, WANTED, WANTED_LISTED, FACETS, NEAR, NUMBER,
) = range(12)  # fmt: skip
"""Indices of `SheetArrays.counts`."""
FACE, CLEARANCE, OWN_DISTANCE, LONGEST, WITHIN = range(5)
"""Indices of `SheetArrays.sizes`."""
_FIRST = SheetArrays._fields.index("key")
BY_SLOT = tuple(name for name in SheetArrays._fields[_FIRST:] if name != "listed")
"""Arrays with a row for each slot."""
