"""Surfaces of chambers of gas, with lids over rings of nodes: volumes, their gradients, and the tangents of lids.

A lid over a ring of nodes v_i consists of the triangles of its edges and of its tip c = sum w_i v_i
(`fsm.case.models.gas.Lid`). With e_i = v_i - c, an edge has the force s_i = e_i x e_(i+1)/6 of a unit pressure on
both of its nodes and on the tip, which shares it among the nodes in the parts w_i. The changes of s_i with e_i and e_(i+1)
join nodes beside each other; those with c join all nodes of the ring, so this part of the tangent is also of low rank.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fsm.case.models.chambers import Chamber, Lid
from fsm.kernels.jit import kernel
from fsm.model.nodes.facets.pressure import PressedFaces, add_triangle_force


class SurfaceArrays(NamedTuple):
    """Surfaces of k chambers.

    Attributes
    ----------
    vectors : (m + e, v) int array
        First coordinates of the nodal vectors of m triangles, then of the edges of lids: both nodes, the second one
        repeated.
    owner : (m,) int array
        Chamber of each triangle.
    pairs, coefficients : (2, p) int and (m, v, p) arrays
        See `fsm.model.nodes.facets.pressure`.
    sums : (k, 7) array
        Axes of the sum for the volume (1 or 0) and origin (m) of each chamber; 1, or -1 if its triangles point inwards.
    used, first_used : (u, 2) and (k + 1,) int arrays
        First coordinates of the vectors of each chamber, and 1 for a position.
    rings, nodes, weights : (l + 1,) int, (n,) int and (n,) arrays
        First coordinates of the ring of each lid, and their parts in its tip.
    lids : (l, 3) int array
        Chamber, 1 for a whole ring, and row of its first edge in `vectors`.
    planes : (l, 6) array
        1 for the axes along which the tip is fixed, else 0, and its position along them, m.
    """

    vectors: np.ndarray
    owner: np.ndarray
    pairs: np.ndarray
    coefficients: np.ndarray
    sums: np.ndarray
    used: np.ndarray
    first_used: np.ndarray
    rings: np.ndarray
    nodes: np.ndarray
    weights: np.ndarray
    lids: np.ndarray
    planes: np.ndarray


@kernel
def _arms(s: SurfaceArrays, lid: int, q: np.ndarray) -> np.ndarray:
    """Positions (n, 3) of the nodes of a ring from the tip of its lid, m."""
    first, last = s.rings[lid], s.rings[lid + 1]
    out = np.empty((last - first, 3))
    for a in range(3):
        tip = s.planes[lid, 3 + a]
        if s.planes[lid, a] == 0.0:
            tip = 0.0
            for i in range(first, last):
                tip += s.weights[i] * q[s.nodes[i] + a]
        for i in range(first, last):
            out[i - first, a] = q[s.nodes[i] + a] - tip
    return out


@kernel(inline=True)
def _edges(s: SurfaceArrays, lid: int) -> int:
    """Number of edges of a ring; each goes from a node to the next one."""
    return int(s.rings[lid + 1] - s.rings[lid] - 1 + s.lids[lid, 1])


@kernel
def _add_lid_force(s: SurfaceArrays, lid: int, q: np.ndarray, pressure: float, force: np.ndarray) -> None:
    """Add the forces of a pressure on a lid; the tip shares its force among the nodes."""
    arms, first, total = _arms(s, lid, q), s.rings[lid], np.zeros(3)
    count = arms.shape[0]
    for i in range(_edges(s, lid)):
        j = (i + 1) % count
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            side = pressure / 6.0 * (arms[i, b] * arms[j, c] - arms[i, c] * arms[j, b])
            total[a] += side
            force[s.nodes[first + i] + a] += side
            force[s.nodes[first + j] + a] += side
    for a in range(3):
        if s.planes[lid, a] == 0.0:
            for i in range(first, s.rings[lid + 1]):
                force[s.nodes[i] + a] += s.weights[i] * total[a]


@kernel
def set_gradients(s: SurfaceArrays, q: np.ndarray, gradients: np.ndarray) -> None:
    """Write the gradients (k, m) of all volumes: the forces of unit pressures."""
    for k in range(gradients.shape[0]):
        for n in range(s.first_used[k], s.first_used[k + 1]):
            gradients[k, s.used[n, 0] : s.used[n, 0] + 3] = 0.0
    for m in range(s.owner.shape[0]):
        k = s.owner[m]
        add_triangle_force(s.vectors[m], s.pairs[0], s.pairs[1], s.coefficients[m], q, s.sums[k, 6], gradients[k])
    for lid in range(s.lids.shape[0]):
        k = s.lids[lid, 0]
        _add_lid_force(s, lid, q, s.sums[k, 6], gradients[k])


@kernel
def set_volumes(s: SurfaceArrays, q: np.ndarray, gradients: np.ndarray, out: np.ndarray) -> None:
    """Write the enclosed volumes (k,), m^3: the flux of the positions is their product with the gradients."""
    for k in range(out.shape[0]):
        out[k] = 0.0
        for n in range(s.first_used[k], s.first_used[k + 1]):
            at, position = s.used[n, 0], s.used[n, 1]
            for a in range(3):
                out[k] += s.sums[k, a] * gradients[k, at + a] * (q[at + a] - position * s.sums[k, 3 + a])
        out[k] /= s.sums[k, :3].sum()


@kernel(inline=True)
def _put_cross(v: np.ndarray, factor: float, rows: np.ndarray, out: np.ndarray, row: int, column: int) -> int:
    """Add the rows (m,) of factor v x to `out`, from a row and a column on; returns the row after them."""
    for a in rows:
        b, c = (a + 1) % 3, (a + 2) % 3
        out[row, column + b] -= factor * v[c]
        out[row, column + c] += factor * v[b]
        row += 1
    return row


@kernel
def add_lid_tangent(
    s: SurfaceArrays, lid: int, q: np.ndarray, factor: float, slots: np.ndarray, size: int, flat: np.ndarray,
    vectors: np.ndarray, weights: np.ndarray, row: int,
) -> int:  # fmt: skip
    """Add the tangent of a lid, times a factor: its sparse part, and the part of the tip, which joins all nodes.

    With c' = W q', the tip changes the forces of the edge i by c' x (v_i - v_(i+1)). Its own force is W^T of the sum of
    all edges, whose change with the nodes is U q'. For a whole ring both derivatives have the same vectors. The result is
    the next row of the part of low rank.
    """
    arms, first = _arms(s, lid, q), s.rings[lid]
    count, whole = arms.shape[0], s.lids[lid, 1] == 1
    axes = np.flatnonzero(s.planes[lid, :3] == 0.0)
    size_of = axes.shape[0]
    by_tip, by_nodes, total = row + size_of, row + size_of if whole else row + 2 * size_of, np.zeros(3)
    for i in range(_edges(s, lid)):
        j, own = (i + 1) % count, slots[s.lids[lid, 2] + i]
        for a in range(3):
            b, d = (a + 1) % 3, (a + 2) % 3
            for end in range(2):
                for column, sense, arm in ((0, -factor, arms[j]), (1, factor, arms[i])):
                    at = own[end, column] + a * size
                    flat[at + b] -= sense * arm[d]
                    flat[at + d] += sense * arm[b]
        along, nodes = arms[i] - arms[j], (s.nodes[first + i], s.nodes[first + j])
        total += along
        for node in nodes:
            _put_cross(along, 1.0, axes, vectors, by_tip, node)
        if not whole:
            _put_cross(arms[j], -1.0, axes, vectors, by_nodes, nodes[0])
            _put_cross(arms[i], 1.0, axes, vectors, by_nodes, nodes[1])
    for m in range(size_of):
        for i in range(count):
            vectors[row + m, s.nodes[first + i] + axes[m]] = s.weights[first + i]
        weights[by_tip + m, row + m] += factor
        weights[row + m, by_nodes + m] += factor
        for n in range(size_of):  # -factor times the matrix of total x
            if axes[n] == (axes[m] + 1) % 3:
                weights[row + m, row + n] += factor * total[(axes[m] + 2) % 3]
            elif axes[n] == (axes[m] + 2) % 3:
                weights[row + m, row + n] -= factor * total[(axes[m] + 1) % 3]
    return by_nodes + size_of


class Surface(NamedTuple):
    """Triangles around a chamber, and its lids over rings of nodes, which are given by their first coordinates."""

    chamber: Chamber
    faces: PressedFaces
    lids: Sequence[Lid]


def surface_arrays(surfaces: Sequence[Surface]) -> SurfaceArrays:
    """Arrays of all surfaces; their triangles have shapes of one kind."""
    faces = [surface.faces for surface in surfaces]
    width = faces[0].vectors.shape[1]
    vectors, counts = [one.vectors for one in faces], [len(one.vectors) for one in faces]
    used, sums, lids, planes, row = [], [], [], list[list[float]](), sum(counts)
    rings: list[Lid] = []
    for k, (chamber, own, covers) in enumerate(surfaces):
        corners = own.vectors if width == 3 else own.vectors[:, ::3]
        at = np.unique(np.concatenate([own.vectors.ravel(), *(lid.nodes for lid in covers)]))
        used.append(np.column_stack([at, np.isin(at, corners)]))
        sums.append([*np.isin(range(3), chamber.axes), *chamber.origin, chamber.sign])
        for lid in covers:
            edges = lid.nodes[lid.edges]
            vectors.append(np.column_stack([edges[:, 0], *[edges[:, 1]] * (width - 1)]))
            lids.append([k, lid.whole, row])
            fixed = dict(lid.planes)
            planes.append([*(float(axis in fixed) for axis in range(3)), *(fixed.get(axis, 0.0) for axis in range(3))])
            rings.append(lid)
            row += len(edges)
    first, second = np.triu_indices(width, 1)
    return SurfaceArrays(
        np.ascontiguousarray(np.concatenate(vectors), dtype=np.int64), np.repeat(np.arange(len(faces)), counts),
        np.array([first, second], dtype=np.int64), np.concatenate([one.coefficients for one in faces]),
        np.array(sums, dtype=float), np.concatenate(used).astype(np.int64), starts([len(one) for one in used]),
        starts([len(lid.nodes) for lid in rings]),
        np.concatenate([np.zeros(0, dtype=np.int64), *(lid.nodes for lid in rings)]),
        np.concatenate([np.zeros(0), *(lid.weights for lid in rings)]), np.array(lids, dtype=np.int64).reshape(-1, 3),
        np.array(planes, dtype=float).reshape(-1, 6),
    )  # fmt: skip


def starts(counts: Sequence[int]) -> np.ndarray:
    """First row of each of several parts, and number of all rows."""
    return np.cumsum([0, *counts], dtype=np.int64)
