"""Detection of bodies that passed through each other between two poses: swept boxes, exact tests on straight paths.

A rotation is divided into steps. In each step the moving point or edge follows a straight line in the axes of the other
body.

Slots whose points or edges pass through shapes or edges on the path of their bodies between two poses.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import Edges, Points, Shapes
from fsm.interactions.shapes.point_shape_planar import local_points_planar
from fsm.interactions.shapes.point_shape_spatial import local_points_spatial
from fsm.interactions.shapes.polygon_distance import polygon_passed
from fsm.interactions.shapes.shape_distance import POLYGON, RECTANGLE, shape_distance
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.vector import cross, dot, rotate

STEP = 0.2
"""Largest rotation of a step, rad."""

INSIDE = 1.0 - 1e-6
"""Fraction of a face or edge that is tested; joined bodies always touch at their common edge."""


def turn_between(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Rotation angle (n_bodies,) of each body between two sets of poses (n_bodies, 3 or 7), rad."""
    if start.shape[1] == 3:
        return np.abs(end[:, 2] - start[:, 2])
    half = np.minimum(1.0, np.abs(np.einsum("ij,ij->i", start[:, 3:], end[:, 3:])))
    return np.asarray(2.0 * np.arccos(half))


@kernel
def path_steps(start: np.ndarray, end: np.ndarray) -> int:
    """Number of steps of the path between two sets of poses (n_bodies, 3 or 7), of at most 0.2 rad each."""
    largest = 0.0
    for i in range(start.shape[0]):
        if start.shape[1] == 3:
            turn = abs(end[i, 2] - start[i, 2])
        else:
            half = 0.0
            for k in range(3, 7):
                half += start[i, k] * end[i, k]
            turn = 2.0 * np.arccos(min(1.0, abs(half)))
        largest = max(largest, turn)
    return max(1, int(np.ceil(largest / STEP)))


@kernel
def path_pose(start: np.ndarray, end: np.ndarray, part: float) -> np.ndarray:
    """Poses after a part of the path between two sets of poses."""
    out = np.empty(start.shape)
    for i in range(start.shape[0]):
        sign = 1.0
        if start.shape[1] == 7:
            half = 0.0
            for k in range(3, 7):
                half += start[i, k] * end[i, k]
            sign = -1.0 if half < 0.0 else 1.0
        for k in range(start.shape[1]):
            far = sign * end[i, k] if k >= 3 else end[i, k]
            out[i, k] = start[i, k] + part * (far - start[i, k])
        if start.shape[1] == 7:
            square = 0.0
            for k in range(3, 7):
                square += out[i, k] ** 2
            for k in range(3, 7):
                out[i, k] /= np.sqrt(square)
    return out


@kernel
def points_pass(
    kind: np.ndarray, size: np.ndarray, limit: np.ndarray, start: np.ndarray, end: np.ndarray
) -> np.ndarray:
    """Whether points that move on straight lines in the axes of their shapes pass through them.

    Parameters
    ----------
    kind, size : (m,) int and (m, 3) arrays
        As in `fsm.interactions.shapes.shape_distance`. A flat shape is passed if the height over it changes sign inside it.
    limit : (m,) array, m
        Depth of the path above which a solid shape counts as passed.
    start, end : (m, 3) arrays, m

    Returns
    -------
    (m,) bool array
    """
    out = np.zeros(kind.shape[0], dtype=np.bool_)
    at = np.empty(3)
    for i in range(kind.shape[0]):
        if kind[i] == POLYGON:
            out[i] = polygon_passed(size[i], start[i], end[i], INSIDE)
            continue
        step = end[i] - start[i]
        if kind[i] == RECTANGLE:
            if (start[i, 2] >= 0.0) == (end[i, 2] >= 0.0):
                continue
            part = -start[i, 2] / step[2]
            inside = True
            for c in range(2):
                if not abs(start[i, c] + part * step[c]) <= INSIDE * size[i, c]:
                    inside = False
            out[i] = inside
            continue
        length, part = np.sqrt(dot(step, step)), 0.0
        while True:
            for c in range(3):
                at[c] = start[i, c] + part * step[c]
            above = shape_distance(kind[i], size[i], at) + limit[i]
            if not above >= 0.0:
                out[i] = True
                break
            if part >= 1.0:
                break
            # the distance changes by at most the path length; near a graze the smallest step is a thousandth
            part = min(1.0, part + max(above / length if length > 0.0 else 1.0, 1e-3))
    return out


@kernel
def local_edges(
    poses: np.ndarray,
    slots: np.ndarray,
    pairs: np.ndarray,
    edges: Edges,
) -> np.ndarray:
    """Ends (m, 2, 3) of the first edges of pairs, m, in axes of the second edges: origin at the middle, x along the edge."""
    out = np.empty((slots.shape[0], 2, 3))
    frame, axes = np.empty((3, 3)), np.empty((3, 3))
    unit, point, local = np.zeros(3), np.empty(3), np.empty(3)
    for i in range(slots.shape[0]):
        one, two = pairs[slots[i], 0], pairs[slots[i], 1]
        a, b = edges.body[one], edges.body[two]
        along = edges.direction[two]
        smallest = 0
        for c in range(3):
            unit[c] = 0.0
            if abs(along[c]) < abs(along[smallest]):
                smallest = c
        unit[smallest] = 1.0
        axes[0] = along
        cross(along, unit, axes[1])
        axes[1] /= np.sqrt(dot(axes[1], axes[1]))
        cross(along, axes[1], axes[2])
        for side in range(2):
            reach = edges.half[one] if side == 1 else -edges.half[one]
            for c in range(3):
                local[c] = edges.middle[one, c] + reach * edges.direction[one, c]
            fill_rotation(poses[a, 3:], frame)
            rotate(frame, local, point)
            for c in range(3):
                point[c] += poses[a, c] - poses[b, c]
            fill_rotation(poses[b, 3:], frame)
            for c in range(3):
                local[c] = dot(frame[:, c], point) - edges.middle[two, c]
            rotate(axes, local, out[i, side])
    return out


@kernel
def edges_pass(half: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Whether edges whose ends move on straight lines pass through an edge at rest on the x axis, (m,) bool.

    In the projection along x, the moving edge P Q passes the origin when P x Q = 0 and the origin is between P and Q. This
    is a quadratic equation in time.

    Parameters
    ----------
    half : (m,) array, m
        Half lengths of the edges at rest.
    start, end : (m, 2, 3) arrays of `local_edges`
    """
    out = np.zeros(half.shape[0], dtype=np.bool_)
    times = np.empty(2)
    for i in range(half.shape[0]):
        p, q = start[i, 0], start[i, 1]
        u, v = end[i, 0] - p, end[i, 1] - q
        a = u[1] * v[2] - u[2] * v[1]
        b = p[1] * v[2] - p[2] * v[1] + u[1] * q[2] - u[2] * q[1]
        c = p[1] * q[2] - p[2] * q[1]
        if c == 0.0 or b * b < 4.0 * a * c:
            continue
        root = -0.5 * (b + (np.sqrt(b * b - 4.0 * a * c) if b >= 0.0 else -np.sqrt(b * b - 4.0 * a * c)))
        times[0] = root / a if a != 0.0 else 2.0
        times[1] = c / root if root != 0.0 else 2.0
        for k in range(2):
            time = times[k]
            if not 0.0 <= time <= 1.0:
                continue
            py, pz, qy, qz = p[1] + time * u[1], p[2] + time * u[2], q[1] + time * v[1], q[2] + time * v[2]
            if py * qy + pz * qz > 0.0:
                continue
            near, far = np.sqrt(py * py + pz * pz), np.sqrt(qy * qy + qz * qz)
            if near + far == 0.0:
                continue
            part = near / (near + far)
            x = (1.0 - part) * (p[0] + time * u[0]) + part * (q[0] + time * v[0])
            if abs(x) <= INSIDE * half[i] and abs(2.0 * part - 1.0) <= INSIDE:
                out[i] = True
    return out


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
