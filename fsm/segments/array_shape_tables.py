"""Tables of contacts of shapes for a compiled model (`ArrayModel`): indices of the arrays, and kernels that fetch them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.shapes import EdgePairs, Edges, Points, Shapes
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.segments.contact_arrays import OWN, OWN_STATE, STATE

__all__ = [
    "BASE", "COLUMN", "EDGES", "EDGES_NEAR", "EDGE_PAIRS", "GROUND", "IN_FORCE", "KIT_LOCAL", "KIT_ON_AXIS", "KIT_START",
    "KIT_WEIGHT", "KNOWN", "LATEST", "LIMIT", "MET", "NEAR", "NEAR_EDGES", "NEAR_POINTS", "OPEN", "PAIR_START", "POINTS",
    "POINTS_NEAR", "POINT_START", "REACH", "SHAPES", "SOLID_AXES", "SOLID_OFFSET", "SOLID_SIZE", "UNIT", "UNITS",
    "UNITS_NEAR", "WEIGHT", "WHOLE", "ShapeArrays", "edge_pairs_of", "edges_of", "near_edges", "near_points",
    "points_of", "shapes_planar", "shapes_spatial",
]  # fmt: skip

GROUND = 0
"""Index of the ground."""


class ShapeArrays(NamedTuple):
    """Arrays of shapes, after `ContactArrays`; see `fsm.segments.shape_tables`.

    Attributes
    ----------
    points, shapes, edges, edge_pairs : tables
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

    points: Points
    shapes: Shapes
    edges: Edges
    edge_pairs: EdgePairs
    reach: np.ndarray
    limit: np.ndarray
    units: np.ndarray
    point_start: np.ndarray
    pair_start: np.ndarray
    unit: np.ndarray
    column: np.ndarray
    weight: np.ndarray
    slots_open: np.ndarray
    met: np.ndarray
    near: np.ndarray
    near_points: np.ndarray
    near_edges: np.ndarray
    known: np.ndarray
    latest: np.ndarray
    in_force: np.ndarray
    whole: np.ndarray
    base: np.ndarray
    solid_size: np.ndarray
    solid_offset: np.ndarray
    solid_axes: np.ndarray
    kit_start: np.ndarray
    kit_local: np.ndarray
    kit_weight: np.ndarray
    kit_on_axis: np.ndarray


POINTS, SHAPES, EDGES, EDGE_PAIRS, REACH = OWN, OWN + 5, OWN + 11, OWN + 16, OWN + 19
(
    LIMIT, UNITS, POINT_START, PAIR_START, UNIT, COLUMN, WEIGHT, OPEN, MET, NEAR, NEAR_POINTS, NEAR_EDGES,
    KNOWN, LATEST, IN_FORCE, WHOLE, BASE, SOLID_SIZE, SOLID_OFFSET, SOLID_AXES, KIT_START, KIT_LOCAL,
    KIT_WEIGHT, KIT_ON_AXIS,
) = range(REACH + 1, REACH + 25)  # fmt: skip
UNITS_NEAR, POINTS_NEAR, EDGES_NEAR = OWN_STATE, OWN_STATE + 1, OWN_STATE + 2
"""Indices of `ContactArrays.state`: numbers of near units, points and pairs of edges."""


@kernel
def points_of(g: np.ndarray) -> Points:
    """Table of the points."""
    k = POINTS
    return Points(
        integers_1d(g, k), floats_2d(g, k + 1), floats_1d(g, k + 2), integers_1d(g, k + 3), floats_3d(g, k + 4)
    )


@kernel
def shapes_planar(g: np.ndarray) -> Shapes:
    """Table of the shapes in the plane."""
    k = SHAPES
    return Shapes(
        integers_1d(g, k), integers_1d(g, k + 1), floats_2d(g, k + 2), floats_2d(g, k + 3), floats_1d(g, k + 4),
        floats_1d(g, k + 5),
    )  # fmt: skip


@kernel
def shapes_spatial(g: np.ndarray) -> Shapes:
    """Table of the shapes in space."""
    k = SHAPES
    return Shapes(
        integers_1d(g, k), integers_1d(g, k + 1), floats_2d(g, k + 2), floats_2d(g, k + 3), floats_3d(g, k + 4),
        floats_1d(g, k + 5),
    )  # fmt: skip


@kernel
def edges_of(g: np.ndarray) -> Edges:
    """Table of the edges."""
    k = EDGES
    return Edges(integers_1d(g, k), floats_2d(g, k + 1), floats_2d(g, k + 2), floats_1d(g, k + 3), floats_1d(g, k + 4))


@kernel
def edge_pairs_of(g: np.ndarray) -> EdgePairs:
    """Table of the pairs of edges."""
    return EdgePairs(integers_2d(g, EDGE_PAIRS), floats_1d(g, EDGE_PAIRS + 1), floats_1d(g, EDGE_PAIRS + 2))


@kernel
def near_points(g: np.ndarray) -> np.ndarray:
    """Points that are near their shapes."""
    return integers_1d(g, NEAR_POINTS)[: integers_1d(g, STATE)[POINTS_NEAR]]


@kernel
def near_edges(g: np.ndarray) -> np.ndarray:
    """Pairs of edges that are near."""
    return integers_1d(g, NEAR_EDGES)[: integers_1d(g, STATE)[EDGES_NEAR]]
