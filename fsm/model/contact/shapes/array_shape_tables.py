"""Tables of contacts of shapes for a compiled model (`ArrayModel`): indices of the arrays, and kernels that fetch them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.contact.shapes import EdgePairs, Edges, Points, Shapes
from fsm.kernels.jit import kernel
from fsm.kernels.tables import Floats1, Floats2, Floats3, Integers1, Integers2, follows
from fsm.model.bodies.contact_arrays import OWN_STATE, ContactArrays

GROUND = 0
"""Index of the ground."""


class ShapeArrays(NamedTuple):
    """Arrays of shapes, after `ContactArrays`; see `fsm.model.contact.shapes.shape_tables`.

    Attributes
    ----------
    point_..., shape_..., edge_..., pair_... : fields of `Points`, `Shapes`, `Edges` and `EdgePairs`
    reach : (s,) array, m
        Distance of the farthest point of a shape from its centre.
    limit : (n_points,) array, m
        Depth above which a point has passed into a solid shape.
    units, point_start, pair_start, unit, column, weight : see `Tables`
    slots_open : (n_slots,) int array
        1 for slots that may have contact.
    met : (u,) int array
        1 for units that have been near in this run; their bodies have blocks in the pattern.
    near, near_points, near_edges : int arrays
        Units, points and pairs of edges that are near; `state` contains their counts.
    known, latest, in_force : see `Overlaps`
    whole, base : areas and weights for tilted faces, see `Units`
    solid_size, solid_offset, solid_axes, kit_start, kit_local, kit_weight, kit_on_axis : see `Kit`
    """

    point_body: Integers1
    point_place: Floats2
    point_radius: Floats1
    point_shape: Integers1
    point_around: Floats3
    shape_body: Integers1
    shape_kind: Integers1
    shape_size: Floats2
    shape_offset: Floats2
    shape_frame: Floats3
    shape_radius: Floats1
    edge_body: Integers1
    edge_middle: Floats2
    edge_direction: Floats2
    edge_half: Floats1
    edge_radius: Floats1
    pair_edges: Integers2
    pair_parallel: Floats1
    pair_clearance: Floats1
    reach: Floats1
    limit: Floats1
    units: Integers2
    point_start: Integers1
    pair_start: Integers1
    unit: Integers1
    column: Integers1
    weight: Floats1
    slots_open: Integers1
    met: Integers1
    near: Integers1
    near_points: Integers1
    near_edges: Integers1
    known: Integers1
    latest: Floats2
    in_force: Floats2
    whole: Floats2
    base: Floats2
    solid_size: Floats2
    solid_offset: Floats2
    solid_axes: Floats3
    kit_start: Integers1
    kit_local: Floats2
    kit_weight: Floats1
    kit_on_axis: Integers1


shape_arrays_of = follows(ShapeArrays, ContactArrays)
"""Arrays of the shapes of a table, in kernels."""
UNITS_NEAR, POINTS_NEAR, EDGES_NEAR = OWN_STATE, OWN_STATE + 1, OWN_STATE + 2
"""Indices of `ContactArrays.state`: numbers of near units, points and pairs of edges."""


@kernel
def points_of(g: ContactArrays) -> Points:
    """Table of the points."""
    own = shape_arrays_of(g)
    return Points(own.point_body, own.point_place, own.point_radius, own.point_shape, own.point_around)


@kernel
def shapes_planar(g: ContactArrays) -> Shapes:
    """Table of the shapes in the plane."""
    own = shape_arrays_of(g)
    frame = own.shape_frame.reshape(-1)
    return Shapes(own.shape_body, own.shape_kind, own.shape_size, own.shape_offset, frame, own.shape_radius)


@kernel
def shapes_spatial(g: ContactArrays) -> Shapes:
    """Table of the shapes in space."""
    own = shape_arrays_of(g)
    return Shapes(own.shape_body, own.shape_kind, own.shape_size, own.shape_offset, own.shape_frame, own.shape_radius)


@kernel
def edges_of(g: ContactArrays) -> Edges:
    """Table of the edges."""
    own = shape_arrays_of(g)
    return Edges(own.edge_body, own.edge_middle, own.edge_direction, own.edge_half, own.edge_radius)


@kernel
def edge_pairs_of(g: ContactArrays) -> EdgePairs:
    """Table of the pairs of edges."""
    own = shape_arrays_of(g)
    return EdgePairs(own.pair_edges, own.pair_parallel, own.pair_clearance)


@kernel
def near_points(g: ContactArrays) -> np.ndarray:
    """Points that are near their shapes."""
    own = shape_arrays_of(g)
    return own.near_points[: g.state[POINTS_NEAR]]


@kernel
def near_edges(g: ContactArrays) -> np.ndarray:
    """Pairs of edges that are near."""
    own = shape_arrays_of(g)
    return own.near_edges[: g.state[EDGES_NEAR]]
