"""Normals of a curved surface at the nodes of a mesh of flat cells.

The nodes lie on the surface. The tangent plane at a node is that of the paraboloid through the node that fits the nodes
around it, by least squares. Its error is of second order in the cells, for cells of any shape and at boundaries. The mean of
the normals of the flat cells is wrong by half a cell's angle at a boundary, and by a part of it beside cells of different
shapes. The curvature at rest is then wrong by a finite part in every such cell, however small the cells are.

In a plane of symmetry the nodes around a node include their mirror images, so the normal lies in this plane.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

_DETERMINED = 0.03
"""Least singular value, relative to the largest, of the equations of a paraboloid that count as independent."""
_UNKNOWN = 5
"""Coefficients of a paraboloid through its apex."""
_RINGS = 3
"""Most rings of cells around a node."""
_AGAIN = 2
"""Fits of each paraboloid, each along the normal of the one before."""


def smooth_normals(
    places: np.ndarray, cells: Sequence[tuple[int, ...]], usable: np.ndarray, start: np.ndarray,
    mirrors: Mapping[int, frozenset[int]],
) -> np.ndarray:  # fmt: skip
    """Unit normals (n, 3) at the nodes; nodes without enough nodes around them keep their `start`.

    Parameters
    ----------
    places : (n, 3) array, m
    cells : nodes at the corners of each cell
    usable : (c,) bool array
        Whether the corners of a cell are points of a curved surface. Nodes beside other cells keep their normals.
    start : (n, 3) array
        Unit normals that differ little from those of the surface.
    mirrors : axes of the planes of symmetry in which a node lies, by the node
    """
    beside: dict[int, list[int]] = {}
    for cell, corners in enumerate(cells):
        for node in corners:
            beside.setdefault(node, []).append(cell)
    normals, open_nodes = start.copy(), list(beside)
    reached = {node: {node} for node in open_nodes}
    for _ in range(_RINGS):
        by_size: dict[int, list[tuple[int, np.ndarray]]] = {}
        for node in open_nodes:
            around = {cell for inner in reached[node] for cell in beside[inner]}
            if not usable[list(around)].all():
                continue
            reached[node] = {corner for cell in around for corner in cells[cell]}
            others = places[sorted(reached[node] - {node})] - places[node]
            for axis in mirrors.get(node, ()):
                others = np.concatenate([others, others * (1.0 - 2.0 * np.eye(3)[axis])])
            by_size.setdefault(len(others), []).append((node, others))
        open_nodes = []
        for _, group in sorted(by_size.items()):
            nodes = np.array([node for node, _ in group])
            found, done = _paraboloids(np.array([others for _, others in group]), start[nodes])
            normals[nodes[done]] = found[done]
            open_nodes += nodes[~done].tolist()
    return normals


def _paraboloids(others: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normals (k, 3) at the apexes of paraboloids through points (k, p, 3) relative to them, and which are determined."""
    done = np.ones(len(others), dtype=bool)
    if others.shape[1] < _UNKNOWN:
        return normal, ~done
    away = np.linalg.norm(others, axis=2)
    away[away == 0.0] = np.inf  # another sector of the node
    for _ in range(_AGAIN):
        height = np.einsum("kpi,ki->kp", others, normal)
        within = others - height[..., None] * normal[:, None]
        *_, axes = np.linalg.svd(within, full_matrices=False)  # principal axes of the points in the tangent plane
        u, v = np.einsum("kpi,kai->akp", within, axes[:, :2])
        rows = np.stack([u, v, u * u, u * v, v * v], axis=-1) / away[..., None]
        sizes = np.maximum(np.linalg.norm(rows, axis=1), np.finfo(float).tiny)
        left, singular, right = np.linalg.svd(rows / sizes[:, None], full_matrices=False)
        done &= singular[:, -1] > _DETERMINED * singular[:, 0]
        by = np.maximum(singular, _DETERMINED * singular[:, :1])
        found = np.einsum("kji,kj,kpj,kp->ki", right, 1.0 / by, left, height / away, optimize=True) / sizes
        slope = found[:, 0, None] * axes[:, 0] + found[:, 1, None] * axes[:, 1]
        normal = normal - slope
        normal = normal / np.linalg.norm(normal, axis=1)[:, None]
    return normal, done
