"""Slots whose points or edges pass through shapes or edges on the path of their bodies between two poses."""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import Edges, Points, Shapes
from fsm.interactions.shapes.point_shape_planar import local_points_planar
from fsm.interactions.shapes.point_shape_spatial import local_points_spatial
from fsm.interactions.shapes.swept import edges_pass, local_edges, path_pose, path_steps, points_pass
from fsm.kernels.jit import kernel


@kernel
def _faces(
    slots: np.ndarray, points: Points, shapes: Shapes, limit: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Kinds and sizes of the shapes of some slots, and the depth limits of these slots."""
    count, width = slots.shape[0], shapes.size.shape[1]
    kinds, sizes, limits = np.empty(count, dtype=np.int64), np.empty((count, width)), np.empty(count)
    for i in range(count):
        of = points.shape[slots[i]]
        kinds[i], limits[i] = shapes.kind[of], limit[slots[i]]
        for c in range(width):
            sizes[i, c] = shapes.size[of, c]
    return kinds, sizes, limits


@kernel
def passing_points(
    start: np.ndarray, end: np.ndarray, slots: np.ndarray, points: Points, shapes: Shapes, limit: np.ndarray
) -> np.ndarray:
    """Whether the points of slots (m,) pass through their shapes in the plane; `limit` of all slots as in `points_pass`."""
    kinds, sizes, limits = _faces(slots, points, shapes, limit)
    out, steps = np.zeros(slots.shape[0], dtype=np.bool_), path_steps(start, end)
    before = local_points_planar(start, slots, points, shapes)
    for k in range(steps):
        after = local_points_planar(path_pose(start, end, (k + 1) / steps), slots, points, shapes)
        out |= points_pass(kinds, sizes, limits, before, after)
        before = after
    return out


@kernel
def passing_slots(
    start: np.ndarray, end: np.ndarray, slots: np.ndarray, points: Points, shapes: Shapes, limit: np.ndarray,
    edge_slots: np.ndarray, pairs: np.ndarray, edges: Edges,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """As `passing_points` in space, and whether the edges of slots (k,) of pairs of edges pass through each other."""
    kinds, sizes, limits = _faces(slots, points, shapes, limit)
    half, steps = np.empty(edge_slots.shape[0]), path_steps(start, end)
    for i in range(edge_slots.shape[0]):
        half[i] = edges.half[pairs[edge_slots[i], 1]]
    out, others = np.zeros(slots.shape[0], dtype=np.bool_), np.zeros(edge_slots.shape[0], dtype=np.bool_)
    before, ends = local_points_spatial(start, slots, points, shapes), local_edges(start, edge_slots, pairs, edges)
    for k in range(steps):
        poses = path_pose(start, end, (k + 1) / steps)
        after, further = local_points_spatial(poses, slots, points, shapes), local_edges(poses, edge_slots, pairs, edges)
        out |= points_pass(kinds, sizes, limits, before, after)
        others |= edges_pass(half, ends, further)
        before, ends = after, further
    return out, others
