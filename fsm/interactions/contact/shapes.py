"""Tables of shapes, rounded points and edges, and forces of contacts, as arguments of kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

BlockIndex = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Arrays `dof`, `indptr` and `indices` of `fsm.kernels.scatter.add_block`."""

FoundPoints = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Probes (m,) on surfaces, their pieces, sides, and closest points: s (m,) in the plane, (s, y) (m, 2) in space."""


class Shapes(NamedTuple):
    """Table of all shapes for the kernels of `point_shape_planar` and `point_shape_spatial`.

    Attributes
    ----------
    body, kind : (s,) int arrays
    size : (s, 3) array, m
    offset : (s, 2 or 3) array, m
    frame : (s,) array of angles, rad, in the plane, (s, 3, 3) rotation matrices in space
        The angle is a rotation about +y, as for a body.
    radius : (s,) array, m
        Rounding.
    """

    body: np.ndarray
    kind: np.ndarray
    size: np.ndarray
    offset: np.ndarray
    frame: np.ndarray
    radius: np.ndarray


class Points(NamedTuple):
    """Rounded points, each paired with one shape.

    Attributes
    ----------
    body : (n,) int array
    place : (n, 2 or 3) array, m, body axes
    radius : (n,) array, m
        Near a common crease, the distance at which they touch minus the rounding of the shape.
    shape : (n,) int array
    around : (n, 3, 3) array, body axes
        Two perpendicular radii of a circle around `place`, m; then cosine and sine of the angle from the lowest point of the
        circle to this point, and 1 if it is the nearest point instead (`fsm.interactions.shapes.circle_point`). Zero for a
        fixed point, and in the plane.
    """

    body: np.ndarray
    place: np.ndarray
    radius: np.ndarray
    shape: np.ndarray
    around: np.ndarray


class Edges(NamedTuple):
    """Straight edges of `fsm.interactions.shapes.edge_edge`.

    Attributes
    ----------
    body : (e,) int array
    middle, direction : (e, 3) arrays
        Middle (m) and unit direction in body axes.
    half, radius : (e,) arrays, m
        Half length and rounding.
    """

    body: np.ndarray
    middle: np.ndarray
    direction: np.ndarray
    half: np.ndarray
    radius: np.ndarray


class EdgePairs(NamedTuple):
    """Edges (k, 2) that may touch, |t_1 x t_2|^2 (k,) below which they count as nearly parallel, and distance (k,) at which
    they touch, m: at most the sum of both roundings.
    """

    edges: np.ndarray
    parallel: np.ndarray
    clearance: np.ndarray


class ContactForces(NamedTuple):
    """Forces of contacts and their slopes: h = N grad(gap) - f_c grad(slip_c) on the bodies.

    Attributes
    ----------
    normal : (count,) array, N
    by_depth, by_closing : (count,) arrays, N/m and N s/m
        dN by depth (minus the gap) and by closing speed (minus its rate).
    effort : (count, c) array, N
        Friction f.
    by_slip : (count, c, c) array, N s/m
        df by slip velocity.
    by_normal : (count, c) array
        df by N.
    friction : bool
        If false, effort and its slopes are zero and may be skipped.
    """

    normal: np.ndarray
    by_depth: np.ndarray
    by_closing: np.ndarray
    effort: np.ndarray
    by_slip: np.ndarray
    by_normal: np.ndarray
    friction: bool
