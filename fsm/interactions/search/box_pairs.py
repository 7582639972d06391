"""Broad phase of contact between rigid shapes: pairs of overlapping boxes that are allowed to touch.

The boxes are sorted along Morton's space-filling curve, so that neighbours in the table are neighbours in space. The tree
of `fsm.interactions.search.box_tree` then searches them. If each of n boxes overlaps a few others, the cost is O(n log n),
whatever the arrangement and the sizes of the boxes.

Allowed contacts are listed by sides. A side is a set of shapes. A listed pair names two sides: every shape of one side may
touch every shape of the other. If a side is paired with itself, each of its shapes may touch every other shape of the side.
The pairs of shapes are not stored. The function looks up only the pairs whose boxes overlap. Memory therefore grows with the
number of listed pairs and of nearby shapes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.interactions.search.box_tree import LEAF, fit_tree, next_node
from fsm.kernels.jit import kernel


class ListedPairs:
    """Table of the pairs of shapes that are allowed to touch.

    Parameters
    ----------
    sides : sequence of int arrays
        Shapes of each side.
    pairs : (m, 2) int array
        Indices of the two sides of each pair.
    count : int
        Number of shapes.
    numbers : (m,) int array
        Number of the scene's contact pair for each row; default: the row number.
    bodies : (count,) int array
        Body of each shape: shapes of one body do not touch each other; default: each shape is a body.

    Attributes
    ----------
    shape : (members,) int array
        Shape of each member; a shape in two sides is two members.
    """

    def __init__(
        self,
        sides: Sequence[np.ndarray],
        pairs: np.ndarray,
        count: int,
        numbers: np.ndarray | None = None,
        bodies: np.ndarray | None = None,
    ) -> None:
        pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
        self.shape = np.concatenate([np.zeros(0, dtype=np.int64), *(np.asarray(s, dtype=np.int64) for s in sides)])
        self._side = np.repeat(np.arange(len(sides)), [len(side) for side in sides])
        self._members = np.argsort(self.shape, kind="stable")
        self._start = np.searchsorted(self.shape[self._members], np.arange(count + 1))
        self._sides, self._bodies = len(sides), bodies
        keys = pairs[:, 0] * len(sides) + pairs[:, 1]
        order = np.argsort(keys, kind="stable")
        self._keys, self._numbers = keys[order], order if numbers is None else numbers[order]

    def overlapping(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the allowed pairs whose boxes have a point in common; returns as `among`.

        Parameters
        ----------
        low, high : (n, d) arrays, m
            Corners of the boxes of all shapes; may be infinite.
        """
        return self.among(overlapping_boxes(low, high))

    def everything(self) -> tuple[np.ndarray, np.ndarray]:
        """All allowed pairs; returns as `among`."""
        order = np.argsort(self._side, kind="stable")
        start = np.searchsorted(self._side[order], np.arange(self._sides + 1))
        rows = []
        for key, number in zip(self._keys.tolist(), self._numbers.tolist(), strict=True):
            one, two = (order[start[side] : start[side + 1]] for side in divmod(key, self._sides))
            members = np.stack([np.repeat(one, len(two)), np.tile(two, len(one))], axis=1)
            if key % (self._sides + 1) == 0:  # a side with itself
                members = members[members[:, 0] < members[:, 1]]
            rows.append(np.column_stack([members, np.full(len(members), number)]))
        found = np.concatenate([np.zeros((0, 3), dtype=np.int64), *rows])
        one, two = self.shape[found[:, :2]].T
        found = found[one != two if self._bodies is None else self._bodies[one] != self._bodies[two]]
        found = found[np.lexsort((found[:, 2], found[:, 1], found[:, 0]))]
        return found[:, :2].copy(), found[:, 2].copy()

    def at_most(self) -> int:
        """Upper bound of the number of allowed pairs."""
        members = np.bincount(self._side, minlength=self._sides)
        one, two = np.divmod(self._keys, self._sides)
        return int((members[one] * members[two]).sum())

    def among(self, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Select the allowed pairs among pairs (m, 2) of shapes, each given once.

        Returns
        -------
        members : (k, 2) int array
            Sorted by the first column, then by the second.
        numbers : (k,) int array
        """
        if self._bodies is not None:
            shapes = shapes[self._bodies[shapes[:, 0]] != self._bodies[shapes[:, 1]]]
        members, numbers = _allowed_pairs(
            shapes, self._start, self._members, self._side, self._sides, self._keys, self._numbers
        )
        order = np.lexsort((numbers, members[:, 1], members[:, 0]))
        return members[order], numbers[order]


def overlapping_boxes(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Pairs (k, 2) of boxes that have a point in common, each once, from their corners (n, d), m, which may be infinite."""
    order = np.argsort(curve_positions(low, high), kind="stable")
    return np.asarray(overlapping_sorted(low[order], high[order], order))


@kernel
def curve_positions(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Positions (n,) of the box centres along Morton's curve through their bounding box; infinite boxes come last."""
    count, size = low.shape
    bits = 62 // size
    least, most = np.full(size, np.inf), np.full(size, -np.inf)
    places = np.zeros(count, dtype=np.int64)
    for i in range(count):
        for c in range(size):
            middle = 0.5 * (low[i, c] + high[i, c])
            if np.isfinite(middle):
                least[c], most[c] = min(least[c], middle), max(most[c], middle)
            else:
                places[i] = -1
    widest = 0.0
    for c in range(size):
        widest = max(widest, most[c] - least[c])
    cells = 2.0**bits - 1.0
    for i in range(count):
        if places[i] < 0:
            places[i] = np.iinfo(np.int64).max
            continue
        for c in range(size):
            middle = 0.5 * (low[i, c] + high[i, c])
            cell = np.int64(cells * ((middle - least[c]) / widest)) if widest > 0.0 else np.int64(0)
            for bit in range(bits):
                places[i] |= ((cell >> bit) & 1) << (size * bit + c)
    return places


@kernel(inline=True)
def _disjoint(low: np.ndarray, high: np.ndarray, other_low: np.ndarray, other_high: np.ndarray) -> bool:
    apart = False
    for c in range(low.shape[0]):
        apart |= not (low[c] <= other_high[c] and other_low[c] <= high[c])
    return apart


@kernel
def overlapping_sorted(low: np.ndarray, high: np.ndarray, names: np.ndarray) -> np.ndarray:
    """Pairs of overlapping boxes, by their `names`; each box is compared with the sorted boxes after it."""
    count, size = low.shape
    tree = fit_tree(low, high)
    leaves = tree.shape[0] // 2
    found, out = 0, np.empty((max(64, 8 * count), 2), dtype=np.int64)
    for i in range(count):
        node, span = 1, leaves * LEAF
        while node > 0:
            first = node * span - leaves * LEAF
            if first >= count:
                break
            if first + span > i + 1 and not _disjoint(low[i], high[i], tree[node, :size], tree[node, size:]):
                if node < leaves:
                    node, span = 2 * node, span // 2
                    continue
                for j in range(max(first, i + 1), min(first + span, count)):
                    if _disjoint(low[i], high[i], low[j], high[j]):
                        continue
                    if found == out.shape[0]:
                        out = np.concatenate((out, np.empty_like(out)))
                    out[found, 0], out[found, 1] = names[i], names[j]
                    found += 1
            node, span = next_node(node, span)
    return out[:found].copy()


@kernel
def _allowed_pairs(
    shapes: np.ndarray,
    start: np.ndarray,
    members: np.ndarray,
    side: np.ndarray,
    sides: int,
    keys: np.ndarray,
    numbers: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    found = 0
    room = max(64, shapes.shape[0])
    out, number = np.empty((room, 2), dtype=np.int64), np.empty(room, dtype=np.int64)
    for i in range(shapes.shape[0]):
        for a in range(start[shapes[i, 0]], start[shapes[i, 0] + 1]):
            for b in range(start[shapes[i, 1]], start[shapes[i, 1] + 1]):
                one, two = members[a], members[b]
                for way in range(2):
                    if way == 1:
                        one, two = two, one
                    # a pair of a side with itself is listed once, but the search finds it in both orders
                    if side[one] == side[two] and one > two:
                        continue
                    key = side[one] * sides + side[two]
                    at = np.searchsorted(keys, key)
                    while at < keys.shape[0] and keys[at] == key:
                        if found == out.shape[0]:
                            out = np.concatenate((out, np.empty_like(out)))
                            number = np.concatenate((number, np.empty_like(number)))
                        out[found, 0], out[found, 1], number[found] = one, two, numbers[at]
                        found += 1
                        at += 1
    return out[:found].copy(), number[:found].copy()
