"""Contact shapes of plates: a rectangle, or convex polygons for an outline; bodies whose outlines share a corner."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.case.models.scene import Body, Plate
from fsm.case.pattern_files.pattern import triangles_of_face
from fsm.interactions.shapes.polygon_distance import MOST_CORNERS
from fsm.kernels.rotation import rotation_matrix
from fsm.model.contact.crease_clearance import common_lines, edge_tapers, pairs_of_equal, tapers_of
from fsm.model.contact.shapes.shape_tables import Kit, Shape, as_polygon, as_rectangle, shape_edges

_SAME = 1e-6
"""Distance of two corners, relative to the size of the plates, below which they are one vertex."""


def plate_shapes(body: int, plate: Plate) -> list[Shape]:
    """Contact shapes of the plate of a body; an outline that is not convex or has many corners consists of triangles."""
    if plate.outline is None:
        return [as_rectangle(body, plate.length, plate.width, plate.thickness)]
    corners = np.array(plate.outline)
    if _turns(corners).sum() < 0.0:
        corners = corners[::-1].copy()
    count = len(corners)
    if count <= MOST_CORNERS and (_turns(corners) >= 0.0).all():
        return [as_polygon(body, corners, (True,) * count, plate.thickness)]
    points = np.column_stack([corners, np.zeros(count)])
    pieces, _ = triangles_of_face(points, tuple(range(count)), np.array([0.0, 0.0, 1.0]))
    shapes = []
    for piece in pieces:
        rim = tuple((b - a) % count == 1 for a, b in zip(piece, (*piece[1:], piece[0]), strict=True))
        shapes.append(as_polygon(body, corners[list(piece)], rim, plate.thickness))
    return shapes


def _turns(corners: np.ndarray) -> np.ndarray:
    """Cross products of successive sides (k,), m^2; positive for a turn to the left."""
    one = corners - np.roll(corners, 1, axis=0)
    two = np.roll(corners, -1, axis=0) - corners
    return np.asarray(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])


def corner_neighbours(bodies: Sequence[Body]) -> np.ndarray:
    """Pairs (m, 2) of bodies whose outlines have a corner at the same place."""
    places, owner = [np.zeros((0, 3))], [np.zeros(0, dtype=np.int64)]
    for number, body in enumerate(bodies):
        if body.plate is not None and body.plate.outline is not None:
            corners = np.column_stack([np.array(body.plate.outline), np.zeros(len(body.plate.outline))])
            places.append(np.array(body.position) + corners @ rotation_matrix(np.array(body.orientation)).T)
            owner.append(np.full(len(corners), number))
    if len(places) == 1:
        return np.zeros((0, 2), dtype=np.int64)
    points, of = np.concatenate(places), np.concatenate(owner)
    vertex = _same_places(points, float(np.median([np.ptp(group, axis=0).max() for group in places[1:]])))
    order = np.argsort(vertex, kind="stable")
    found = [np.stack([of[order[one]], of[order[two]]], axis=1) for one, two in pairs_of_equal(vertex[order])]
    pairs = np.sort(np.concatenate([np.zeros((0, 2), dtype=np.int64), *found]), axis=1)
    return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


def _same_places(points: np.ndarray, size: float) -> np.ndarray:
    """Numbers (n,) of vertices for points (n, 3); points at one place, relative to the size of the plates (m), have one."""
    from scipy.sparse import coo_array  # a strip has no outlines, so it does not need to import SciPy
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    one, two = cKDTree(points).query_pairs(_SAME * size, output_type="ndarray").T
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(len(points), len(points)))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def with_tapers(kit: Kit, plates: Sequence[Shape], creased: np.ndarray, reference: np.ndarray) -> Kit:
    """Tables with clearances beside the edges and corners that two bodies (c, 2) have in common in the poses `reference`."""
    body, count, spatial = kit.shapes.body, len(reference), reference.shape[1] == 7
    used = [(plate.body, plate.in_body(shape_edges(plate))) for plate in plates if np.any(creased == plate.body)]
    if not used:
        return kit
    of_side = np.repeat([number for number, _ in used], [len(ends) for _, ends in used])
    ends = np.concatenate([ends for _, ends in used])
    poses = reference
    if not spatial:
        half, zero = 0.5 * reference[:, 2], np.zeros(count)
        poses = np.stack([reference[:, 0], zero, reference[:, 1], np.cos(half), zero, np.sin(half), zero], axis=1)
    axes = np.array([rotation_matrix(quaternion) for quaternion in poses[:, 3:]])
    world = poses[of_side, None, :3] + np.einsum("nij,nkj->nki", axes[of_side], ends)
    node = _same_places(world.reshape(-1, 3), float(np.median([plate.length for plate in plates]))).reshape(-1, 2)
    local = (ends if spatial else ends[:, :, [0, 2]]).reshape(2 * len(ends), -1)
    on, first = np.unique(node.ravel() * count + np.repeat(of_side, 2), return_index=True)
    allowed = np.concatenate([creased @ [count, 1], creased @ [1, count]])
    lines = common_lines(*np.divmod(on, count), local[first], node, of_side, count, allowed)
    edges, arm = kit.edges, kit.edges.half[:, None] * kit.edges.direction
    tips = np.stack([edges.middle - arm, edges.middle + arm], axis=1)
    of_point = np.repeat(body, np.diff(kit.point_start))
    return kit._replace(
        tapers=tapers_of(lines, np.arange(len(of_point)), of_point, kit.place, count),
        edge_tapers=edge_tapers(lines, tips, edges.body, count),
    )
