"""Closest points of the parts of a triangulated surface: a point and a triangle, and two edges.

The vector between the closest points is a sum over four nodes, r = sum c_i x_i. Each of its k free parameters moves a
closest point along a direction t_a = sum tau_ai x_i, so that dr = sum c_i dx_i - sum t_a dbeta_a and r.t_a = 0. The closest
point lies inside a triangle (k = 2), on an edge (k = 1), or at a corner (k = 0). Closest points of two edges lie inside both
(k = 2), at an end of one (k = 1), or at ends of both (k = 0). `fsm.interactions.triangles.feature_contact` has the
derivatives of |r|.

Nodes: the point, then the corners of the triangle; or the ends of the first edge, then of the second.

Products of the sides of triangles, without allocation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.vector import dot


@kernel
def cross_from(a: np.ndarray, b: np.ndarray, c: np.ndarray, out: np.ndarray) -> None:
    """Write the vector product of the sides from a to b and from a to c into `out` (3,)."""
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    u, v, w = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    out[0] = y * w - z * v
    out[1] = z * u - x * w
    out[2] = x * v - y * u


_FAR = 1.0 + 1e-9
"""Factor on a bound of the distance, so that round-off excludes no contact."""


class Faces(NamedTuple):
    """Triangles of a surface.

    Attributes
    ----------
    triangles : (t, 3) int array of nodes
    beyond : (t, 3) array
        Length by which the triangle reaches beyond the edge from this corner to the next one, over the height of the
        triangle there, if the edge is on the outline of its facet; else 0.
    edges : (e, 2) int array of nodes
    """

    triangles: np.ndarray
    beyond: np.ndarray
    edges: np.ndarray


class Found(NamedTuple):
    """Closest points of some slots, as above.

    Attributes
    ----------
    nodes : (m, 4) int array
    free : (m,) int array, k
    coefficients : (m, 4) array, c
    directions : (m, 2, 4) array, tau
    normal : (m, 3) array
        Unit vector from the second part to the first; it points to the side of the surface to which the point belongs.
    distance : (m,) array, m
        normal . r; negative for a point behind its side.
    """

    nodes: np.ndarray
    free: np.ndarray
    coefficients: np.ndarray
    directions: np.ndarray
    normal: np.ndarray
    distance: np.ndarray


@kernel
def _on_triangle(p: np.ndarray, corners: np.ndarray, weights: np.ndarray) -> int:
    """Weights (3,) of the corners (3, 3) in the point of a triangle closest to p (Ericson, 2005).

    Returns 0 if the closest point is inside, 1 to 3 if it is on the edge that starts at this corner (counted from 1), and 4
    to 6 if it is a corner.
    """
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for i in range(3):
        a, b, c, at = corners[0, i], corners[1, i], corners[2, i], p[i]
        along, over = b - a, c - a
        d1 += along * (at - a)
        d2 += over * (at - a)
        d3 += along * (at - b)
        d4 += over * (at - b)
        d5 += along * (at - c)
        d6 += over * (at - c)
    weights[0] = weights[1] = weights[2] = 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        weights[0] = 1.0
        return 4
    if d3 >= 0.0 and d4 <= d3:
        weights[1] = 1.0
        return 5
    of_c = d1 * d4 - d3 * d2
    if of_c <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        weights[1] = d1 / (d1 - d3)
        weights[0] = 1.0 - weights[1]
        return 1
    if d6 >= 0.0 and d5 <= d6:
        weights[2] = 1.0
        return 6
    of_b = d5 * d2 - d1 * d6
    if of_b <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        weights[2] = d2 / (d2 - d6)
        weights[0] = 1.0 - weights[2]
        return 3
    of_a = d3 * d6 - d5 * d4
    if of_a <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        weights[2] = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        weights[1] = 1.0 - weights[2]
        return 2
    whole = of_a + of_b + of_c
    weights[1], weights[2] = of_b / whole, of_c / whole
    weights[0] = 1.0 - weights[1] - weights[2]
    return 0


@kernel
def _extended(faces: Faces, triangle: int, extension: np.ndarray) -> None:
    """Write the corners of a triangle that is extended beyond the outline, as weights (3, 3) of the real corners, in
    rows.
    """
    for i in range(3):
        extension[i, i] = 1.0
        for j in range(3):
            if j != i:  # the edge opposite to corner j starts at corner j + 1
                extension[i, j] = -faces.beyond[triangle, (j + 1) % 3]
                extension[i, i] -= extension[i, j]


@kernel
def _of_triangle(code: int, extension: np.ndarray, tau: np.ndarray) -> int:
    """Write the directions (2, 4) of a closest point on an extended triangle; returns their number."""
    tau[:] = 0.0
    one = 0 if code == 0 else code - 1
    count = 2 if code == 0 else 1 if code <= 3 else 0
    for k in range(count):
        for i in range(3):
            tau[k, 1 + i] = extension[(one + 1 + k) % 3, i] - extension[one, i]
    return count


@kernel
def _normal_of(a: np.ndarray, b: np.ndarray, c: np.ndarray, normal: np.ndarray) -> float:
    """Unit normal of a triangle; returns the root of twice its area, a length."""
    cross_from(a, b, c, normal)
    size = np.sqrt(dot(normal, normal))
    for i in range(3):
        normal[i] = normal[i] / size if size > 0.0 else 0.0
    return np.sqrt(size)


@kernel
def _extended_corners(places: np.ndarray, faces: Faces) -> np.ndarray:
    """Corners (t, 3, 3) of all triangles, extended beyond the outline."""
    extension, out = np.empty((3, 3)), np.zeros((faces.triangles.shape[0], 3, 3))
    for k in range(out.shape[0]):
        _extended(faces, k, extension)
        for i in range(3):
            for j in range(3):
                for e in range(3):
                    out[k, i, e] += extension[i, j] * places[faces.triangles[k, j], e]
    return out


@kernel
def _nearest(
    p: np.ndarray, listed: np.ndarray, begin: int, end: int, corners: np.ndarray, weights: np.ndarray
) -> tuple[int, int, float]:  # fmt: skip
    """Nearest of the triangles `listed[begin:end]` to a point p, the region of its closest point as in `_on_triangle`, and
    the squared distance. `corners` (t, 3, 3) are those of all triangles; `weights` (3,) is scratch.
    """
    triangle, code, nearest = -1, 0, np.inf
    for k in range(begin, end):
        own = corners[listed[k]]
        region, square = _on_triangle(p, own, weights), 0.0
        for e in range(3):
            foot = weights[0] * own[0, e] + weights[1] * own[1, e] + weights[2] * own[2, e]
            square += (p[e] - foot) ** 2
        if square < nearest:
            triangle, code, nearest = listed[k], region, square
    return triangle, code, nearest


@kernel
def _over(p: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray, normal: np.ndarray, weights: np.ndarray) -> float:
    """Height of a point over the plane of a triangle; writes its unit normal, and the weights (3,) of the foot."""
    size = _normal_of(a, b, c, normal)
    cross_from(a, p, c, weights)
    of_b = dot(weights, normal) / (size * size)
    cross_from(a, b, p, weights)
    weights[1], weights[2] = of_b, dot(weights, normal) / (size * size)
    weights[0] = 1.0 - weights[1] - weights[2]
    return float(normal[0] * (p[0] - a[0]) + normal[1] * (p[1] - a[1]) + normal[2] * (p[2] - a[2]))


@kernel
def height(places: np.ndarray, node: int, triangles: np.ndarray, triangle: int) -> tuple[float, float]:
    """Height of a node over the plane of a triangle times twice its area, and the square of twice its area."""
    a, b, c = triangles[triangle, 0], triangles[triangle, 1], triangles[triangle, 2]
    p, q, r = places[b, 0] - places[a, 0], places[b, 1] - places[a, 1], places[b, 2] - places[a, 2]
    u, v, w = places[c, 0] - places[a, 0], places[c, 1] - places[a, 1], places[c, 2] - places[a, 2]
    x, y, z = q * w - r * v, r * u - p * w, p * v - q * u
    d, e, f = places[node, 0] - places[a, 0], places[node, 1] - places[a, 1], places[node, 2] - places[a, 2]
    return x * d + y * e + z * f, x * x + y * y + z * z


@kernel
def _normals(places: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals (t, 3) of all triangles."""
    out = np.empty((triangles.shape[0], 3))
    for k in range(out.shape[0]):
        corners = triangles[k]
        _normal_of(places[corners[0]], places[corners[1]], places[corners[2]], out[k])
    return out


@kernel
def select_faces(
    places: np.ndarray, node: np.ndarray, start: np.ndarray, listed: np.ndarray, faces: Faces, triangle: np.ndarray,
    part: np.ndarray, side: np.ndarray,
) -> None:  # fmt: skip
    """Select the part of the facet of every slot that the point can touch in the next step.

    Parameters
    ----------
    places : (n, 3) array, m
    node : (s,) int array
        Point of each slot, ascending.
    start, listed : int arrays
        Triangles `listed[start[s]:start[s + 1]]` of the facet that may be near.
    faces : Faces
    triangle : (s,) int array
        Written: nearest triangle; -1 if another facet at the same crease is nearer, or is equally near and comes first.
    part : (s,) int array
        Written: part of the outline that is nearest, as in `_on_triangle`; 0 over the facet.
    side : (s,) array
        Written: side of the triangle, +1 or -1; 0 beside the facet.
    """
    count = node.shape[0]
    square, nearest = np.empty(count), np.empty(count, dtype=np.int64)
    weights, corners = np.empty(3), _extended_corners(places, faces)
    for s in range(count):
        of, code, square[s] = _nearest(places[node[s]], listed, start[s], start[s + 1], corners, weights)
        nearest[s] = triangle[s] = of
        part[s] = 0
        side[s] = 1.0 if height(places, node[s], faces.triangles, of)[0] >= 0.0 else -1.0
        for edge in range(3):
            at_edge = code == 1 + edge or code == 4 + edge or code == 4 + (edge + 1) % 3
            if at_edge and faces.beyond[of, edge] > 0.0:
                part[s], side[s] = code, 0.0
    over, beside = np.full(places.shape[0], np.inf), np.full(places.shape[0], np.inf)
    first = 0
    while first < count:
        last = first
        while last < count and node[last] == node[first]:
            _note_least(over, faces.triangles[nearest[last]], square[last] if part[last] == 0 else np.inf)
            last += 1
        for s in range(first, last):
            if part[s] == 0:
                continue
            corners_of, within = faces.triangles[nearest[s]], square[s] * (1.0 + 1e-6)
            for i in range(3):
                if over[corners_of[i]] <= within or beside[corners_of[i]] <= within:
                    triangle[s] = -1
            _note_least(beside, corners_of, square[s])
        for s in range(first, last):
            for i in range(3):
                over[faces.triangles[nearest[s], i]] = beside[faces.triangles[nearest[s], i]] = np.inf
        first = last


@kernel
def _note_least(least: np.ndarray, corners: np.ndarray, square: float) -> None:
    """Update the least squared distance of the facets at each node (n,) by that of a triangle with these corners."""
    for i in range(3):
        least[corners[i]] = min(least[corners[i]], square)


@kernel
def find_point_faces(
    places: np.ndarray, node: np.ndarray, triangle: np.ndarray, part: np.ndarray, side: np.ndarray, faces: Faces,
    clearance: np.ndarray, limit: float, below: float, slot: np.ndarray, gap: np.ndarray, found: Found,
) -> int:  # fmt: skip
    """Find the slots of a point and a facet whose gap is below a bound, and return their number.

    Parameters
    ----------
    places, node, faces : as in `select_faces`
    triangle, part : (s,) int arrays
        From `select_faces` in the last accepted state. A point touches the plane of the triangle, the straight line of an
        edge, or a corner. A step is therefore not affected by the edges between triangles, where the normal jumps.
    side : (s,) array
        Side of the facet, +1 or -1, to which the point belongs; 0 beside the facet.
    clearance : (s,) array, m
        The gap is the distance minus the clearance.
    limit, below : m
        A point deeper than the limit has passed round the facet.
    slot, gap, found : results, one row for each slot that was found
    """
    weights, normal, along, extension = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    normals, number = _normals(places, faces.triangles), 0
    for s in range(node.shape[0]):
        if triangle[s] < 0 or (part[s] > 0 and clearance[s] == 0.0):
            continue
        sign = 1.0 if side[s] >= 0.0 else -1.0
        if part[s] == 0:  # most points are far from the plane
            above, corner = 0.0, faces.triangles[triangle[s], 0]
            for e in range(3):
                above += normals[triangle[s], e] * (places[node[s], e] - places[corner, e])
            if sign * above > _FAR * (clearance[s] + below):
                continue
        p, corners = places[node[s]], faces.triangles[triangle[s]]
        _extended(faces, triangle[s], extension)
        if part[s] == 0:
            distance = sign * _over(p, places[corners[0]], places[corners[1]], places[corners[2]], normal, weights)
            for e in range(3):
                normal[e] *= sign
        else:
            one, two, at = (part[s] - 1) % 3, part[s] % 3, 0.0
            if part[s] <= 3:
                whole = 0.0
                for e in range(3):
                    first = along[e] = 0.0
                    for j in range(3):
                        first += extension[one, j] * places[corners[j], e]
                        along[e] += (extension[two, j] - extension[one, j]) * places[corners[j], e]
                    at += along[e] * (p[e] - first)
                    whole += along[e] * along[e]
                at /= whole
            for j in range(3):
                weights[j] = extension[one, j] + at * (extension[two, j] - extension[one, j])
            for e in range(3):
                normal[e] = p[e]
                for j in range(3):
                    normal[e] -= weights[j] * places[corners[j], e]
            distance = np.sqrt(dot(normal, normal))
            if distance == 0.0:
                continue
            for e in range(3):
                normal[e] /= distance
        if distance < -limit or distance - clearance[s] >= below:
            continue
        slot[number], gap[number] = s, distance - clearance[s]
        found.nodes[number, 0] = node[s]
        found.nodes[number, 1:] = corners
        found.free[number] = _of_triangle(part[s], extension, found.directions[number])
        found.coefficients[number, 0] = 1.0
        for e in range(3):
            found.coefficients[number, 1 + e] = -weights[e]
            found.normal[number, e] = normal[e]
        found.distance[number] = distance
        number += 1
    return number


@kernel
def _on_edges(p: np.ndarray, q: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Parameters from 0 to 1 of the closest points of the segments p q and a b (Ericson, 2005)."""
    aa = ee = f = c = bb = 0.0
    for i in range(3):
        one, two, apart = q[i] - p[i], b[i] - a[i], p[i] - a[i]
        aa += one * one
        ee += two * two
        f += two * apart
        c += one * apart
        bb += one * two
    whole = aa * ee - bb * bb
    s = min(1.0, max(0.0, (bb * f - c * ee) / whole)) if whole > 1e-14 * aa * ee else 0.5
    t = (bb * s + f) / ee
    if t < 0.0:
        t, s = 0.0, min(1.0, max(0.0, -c / aa))
    elif t > 1.0:
        t, s = 1.0, min(1.0, max(0.0, (bb - c) / aa))
    return s, t


@kernel
def _boxes(places: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (e, 3) of the boxes of all edges."""
    low, high = np.empty((edges.shape[0], 3)), np.empty((edges.shape[0], 3))
    for k in range(edges.shape[0]):
        for e in range(3):
            start, end = places[edges[k, 0], e], places[edges[k, 1], e]
            low[k, e], high[k, e] = min(start, end), max(start, end)
    return low, high


@kernel
def _apart(low: np.ndarray, high: np.ndarray, one: int, two: int, reach: float) -> bool:
    """Whether the boxes of two edges are farther apart than the reach along an axis."""
    apart = False
    for e in range(3):
        apart |= low[one, e] - high[two, e] > reach or low[two, e] - high[one, e] > reach
    return apart


@kernel
def _distance_of_edges(
    places: np.ndarray, edges: np.ndarray, one: int, two: int, r: np.ndarray
) -> tuple[float, float, float]:
    """Distance of two edges, and the parameters of the closest points; writes the vector (3,) between them."""
    p, q, a, b = places[edges[one, 0]], places[edges[one, 1]], places[edges[two, 0]], places[edges[two, 1]]
    s, t = _on_edges(p, q, a, b)
    for e in range(3):
        r[e] = (1.0 - s) * p[e] + s * q[e] - (1.0 - t) * a[e] - t * b[e]
    return np.sqrt(dot(r, r)), s, t


@kernel
def list_near_edges(
    places: np.ndarray, first: np.ndarray, second: np.ndarray, begin: int, edges: np.ndarray, clearance: np.ndarray,
    reach: float, out: np.ndarray,
) -> int:  # fmt: skip
    """Write the slots, from `begin` on, of two edges (s,) whose gap is at most the reach, and return their number; other
    arguments as in `find_edge_edges`.
    """
    r, (low, high), number = np.empty(3), _boxes(places, edges), 0
    for i in range(begin, first.shape[0]):
        within = clearance[i] + reach
        if _apart(low, high, first[i], second[i], within):
            continue
        if _distance_of_edges(places, edges, first[i], second[i], r)[0] <= within:
            out[number] = i
            number += 1
    return number


@kernel
def find_edge_edges(
    places: np.ndarray, first: np.ndarray, second: np.ndarray, listed: np.ndarray, edges: np.ndarray,
    clearance: np.ndarray, below: float, slot: np.ndarray, gap: np.ndarray, found: Found, number: int,
) -> int:  # fmt: skip
    """Find those of the listed slots of two edges (s,) whose gap is below a bound; `clearance` (s,).

    The results follow the first `number` rows; other arguments and the result as in `find_point_faces`.
    """
    r = np.empty(3)
    low, high = _boxes(places, edges)
    for i in listed:
        reach, one, two = clearance[i] + below, first[i], second[i]
        if _apart(low, high, one, two, reach):
            continue
        distance, s, t = _distance_of_edges(places, edges, one, two, r)
        if distance >= reach or distance == 0.0:
            continue
        slot[number], gap[number] = i, distance - clearance[i]
        c, tau = found.coefficients[number], found.directions[number]
        c[0], c[1], c[2], c[3] = 1.0 - s, s, t - 1.0, -t
        tau[:] = 0.0
        k = 0
        if 0.0 < s < 1.0:
            tau[k, 0], tau[k, 1] = 1.0, -1.0
            k += 1
        if 0.0 < t < 1.0:
            tau[k, 2], tau[k, 3] = -1.0, 1.0
            k += 1
        found.free[number] = k
        for end in range(2):
            found.nodes[number, end], found.nodes[number, 2 + end] = edges[one, end], edges[two, end]
        for e in range(3):
            found.normal[number, e] = r[e] / distance
        found.distance[number] = distance
        number += 1
    return number
