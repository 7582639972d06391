"""Clearance of faces that are joined at a crease or a vertex: the part of the thickness at which they touch.

Two facets at a crease are joined at their middle surfaces. Their faces touch at a distance that grows from zero at the
crease to the thickness at the far end of the smaller facet, c(s) = t min(1, s/L) at the distance s from the crease, for the
following reason. A fold of thickness t that closes is round: if its middle surface turns by the angle a over the length pi
t/2, the faces of flat facets touch first at a = 180 degrees, on their whole length. In the sharp fold of the model, a point
at the distance s from the crease has the distance s sin(a) from the other facet, and with c(s) the facets also touch on
their whole length, at sin(a) = t/L: the far ends have the distance t. A constant clearance would stop the fold where it
begins, at the first point beside the crease. The same holds for facets with a common vertex, with distances from it.

Two edges touch at one distance. Long edges of rigid facets cross at a fixed place when their crease closes, and touch at
c(s) of this place. Other edges touch at the mean of c(s) over their four ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

_NEARLY = 1e-6
"""Sine of the angle of nearly parallel edges, and excess of a crossing over the end of an edge, relative to its length."""


class Tapers(NamedTuple):
    """Clearances of points at neighbours of their facets, or of edges at edges, relative to the thickness.

    Attributes
    ----------
    key : (k,) int array, ascending
        Point times number of facets, plus facet; or edge times number of edges, plus edge.
    factor : (k,) array
        min(1, s/L).
    facets : int
        Number of facets, or of edges.
    """

    key: np.ndarray
    factor: np.ndarray
    facets: int

    @classmethod
    def none(cls) -> Tapers:
        """Constant clearances."""
        return cls(np.zeros(0, dtype=np.int64), np.zeros(0), 0)

    def of(self, point: np.ndarray, facet: np.ndarray) -> np.ndarray:
        """Clearance of points at facets, relative to the thickness; arrays that broadcast, facet -1 for none."""
        if not len(self.key):
            return np.ones(np.broadcast_shapes(point.shape, facet.shape))
        key = point * self.facets + facet
        at = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
        return np.where((facet >= 0) & (self.key[at] == key), self.factor[at], 1.0)


class CommonLines(NamedTuple):
    """Common edges of facets, and common vertices of facets without a common edge.

    Attributes
    ----------
    own, other : (m,) int arrays
        Facets; each pair occurs in both orders.
    ends, ends_of_other : (m, 2, d) arrays, m
        Both ends in the coordinates of the facet `own`, and of the facet `other`; equal for a vertex.
    """

    own: np.ndarray
    other: np.ndarray
    ends: np.ndarray
    ends_of_other: np.ndarray


def common_lines(
    node: np.ndarray, facet: np.ndarray, place: np.ndarray, sides: np.ndarray, side_facet: np.ndarray, facets: int,
    allowed: np.ndarray | None = None,
) -> CommonLines:  # fmt: skip
    """Find the common edges and vertices of facets.

    Parameters
    ----------
    node, facet : (n,) int arrays
        Each node with each of its facets, in ascending order, first by nodes.
    place : (n, d) array, m
        Places of the nodes in coordinates of their facets.
    sides, side_facet : (s, 2) and (s,) int arrays
        Nodes of edges, with each of their facets.
    facets : int
        Number of facets.
    allowed : keys own * facets + other of neighbours, default all
    """
    ends = np.sort(sides, axis=1)
    nodes = int(node.max(initial=-1)) + 1
    order = np.argsort(ends[:, 0] * nodes + ends[:, 1], kind="stable")
    ends, of_side = ends[order], side_facet[order]
    rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for one, two in pairs_of_equal(ends[:, 0] * nodes + ends[:, 1]):
        rows.append((of_side[one], of_side[two], ends[one]))
    along = np.unique(np.concatenate([own * facets + other for own, other, _ in rows] or [np.zeros(0, dtype=np.int64)]))
    for one, two in pairs_of_equal(node):
        at_vertex = ~np.isin(facet[one] * facets + facet[two], along)
        rows.append((facet[one][at_vertex], facet[two][at_vertex], np.repeat(node[one][at_vertex, None], 2, axis=1)))
    if not rows:
        none, nowhere = np.zeros(0, dtype=np.int64), np.zeros((0, 2, place.shape[1]))
        return CommonLines(none, none, nowhere, nowhere)
    own, other, at = (np.concatenate(columns) for columns in zip(*rows, strict=True))
    found = own != other
    if allowed is not None:
        found &= np.isin(own * facets + other, allowed)
    own, other, at = own[found], other[found], at[found]
    ends_of = (place[np.searchsorted(node * facets + facet, at * facets + of[:, None])] for of in (own, other))
    return CommonLines(own, other, *ends_of)


def pairs_of_equal(groups: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Rows of all pairs of equal values of an ascending array, in both orders."""
    shift = 1
    while len(same := np.flatnonzero(groups[shift:] == groups[:-shift])):
        yield same, same + shift
        yield same + shift, same
        shift += 1


def tapers_of(lines: CommonLines, point: np.ndarray, facet: np.ndarray, place: np.ndarray, facets: int) -> Tapers:
    """Compute the tapers of points (n,) on facets (n,) with places (n, d) in coordinates of their facets, m.

    The depth L of a facet is the distance of its farthest point. A point of several facets has its least clearance.
    """
    if not len(lines.own):
        return Tapers.none()
    order = np.argsort(facet, kind="stable")
    start = np.searchsorted(facet[order], np.arange(facets + 1))
    count = np.diff(start)[lines.own]
    row = np.repeat(np.arange(len(count)), count)
    at = order[np.repeat(start[lines.own] - np.append(0, np.cumsum(count)[:-1]), count) + np.arange(len(row))]
    # distances of all points of the facet `own` from the lines
    first = lines.ends[row, 0]
    line, away = lines.ends[row, 1] - first, place[at] - first
    square = np.maximum((line * line).sum(axis=1), np.finfo(float).tiny)
    part = np.clip((line * away).sum(axis=1) / square, 0.0, 1.0)
    distance = np.linalg.norm(away - part[:, None] * line, axis=1)
    pair, of_row = np.unique(lines.own * facets + lines.other, return_inverse=True)
    known, back = np.unique(of_row.reshape(-1)[row] * len(point) + at, return_inverse=True)
    nearest = np.full(len(known), np.inf)
    np.minimum.at(nearest, back.reshape(-1), distance)
    of_pair, at = np.divmod(known, len(point))
    depth = np.zeros(len(pair))
    np.maximum.at(depth, of_pair, nearest)
    own, other = np.divmod(pair, facets)
    depth = np.minimum(depth, depth[np.searchsorted(pair, other * facets + own)])
    key, back = np.unique(point[at] * facets + other[of_pair], return_inverse=True)
    factor = np.ones(len(key))
    np.minimum.at(factor, back.reshape(-1), nearest / depth[of_pair])
    return Tapers(key, factor, facets)


def edge_tapers(lines: CommonLines, tips: np.ndarray, facet: np.ndarray, facets: int) -> Tapers:
    """Compute the tapers of straight edges (e,) of flat facets with ends (e, 2, d) in coordinates of their facets, m."""
    if not len(lines.own) or not len(tips):
        return Tapers.none()
    order = np.argsort(facet, kind="stable")
    start = np.searchsorted(facet[order], np.arange(facets + 1))
    count = np.diff(start)
    number = count[lines.own] * count[lines.other]
    row = np.repeat(np.arange(len(number)), number)
    place = np.arange(len(row)) - np.repeat(np.cumsum(number) - number, number)
    one, two = np.divmod(place, count[lines.other][row])
    one, two = order[start[lines.own][row] + one], order[start[lines.other][row] + two]
    # the facets folded on each other: coordinates along the crease, and distances from it
    flat = [
        _along_and_off(tips[edge], ends[row]) for edge, ends in ((one, lines.ends), (two, lines.ends_of_other))
    ]
    depth = np.zeros((2, len(number)))
    for side in (0, 1):
        np.maximum.at(depth[side], row, flat[side][:, :, 1].max(axis=1))
    (p, q), (r, s) = (both.transpose(1, 0, 2) for both in flat)
    cross = _cross(q - p, s - r)
    crossing = np.abs(cross) > _NEARLY * np.linalg.norm(q - p, axis=1) * np.linalg.norm(s - r, axis=1)
    by = np.where(crossing, cross, 1.0)
    on_one, on_two = _cross(r - p, s - r) / by, _cross(r - p, q - p) / by
    for part in (on_one, on_two):
        crossing &= (part > -_NEARLY) & (part < 1.0 + _NEARLY)
    ends_off = [np.minimum(both[:, :, 1], depth.min(axis=0)[row, None]).mean(axis=1) for both in flat]
    off = np.where(crossing, p[:, 1] + on_one * (q - p)[:, 1], 0.5 * (ends_off[0] + ends_off[1]))
    key, back = np.unique(one * len(tips) + two, return_inverse=True)
    factor = np.ones(len(key))
    np.minimum.at(factor, back.reshape(-1), off / depth.min(axis=0)[row])
    return Tapers(key, factor, len(tips))


def _along_and_off(points: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Coordinates (m, 2, 2) of points (m, 2, d) along lines (m, 2, d), and distances from them; zero along a vertex, m."""
    line, away = ends[:, 1] - ends[:, 0], points - ends[:, :1]
    length = np.linalg.norm(line, axis=1, keepdims=True)
    unit = np.divide(line, length, out=np.zeros_like(line), where=length > 0.0)
    along = np.einsum("mkd,md->mk", away, unit)
    return np.stack([along, np.linalg.norm(away - along[:, :, None] * unit[:, None], axis=2)], axis=2)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
