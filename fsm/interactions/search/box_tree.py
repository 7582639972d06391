"""Broad phase of contact: a balanced tree of boxes over an ordered table, and the search for boxes near a point.

The table keeps its order. Pieces of surfaces follow each other along the chain, so neighbours in the table are neighbours
in space and no sorting is needed. `LEAF` consecutive entries share a leaf. Nodes are numbered as in a heap: the root is 1,
and the children of node k are 2 k and 2 k + 1. All leaves have the same depth, so the tree is an array without pointers
and a search needs no stack. The search goes down to 2 k. To skip a node, the search moves up while it is at a right child,
and then goes to the next node k + 1. Each box encloses all entries below it, so entries of very different sizes may be
mixed.

Fitting costs O(n); a search for a point near the chain costs O(log n).

Use with surfaces, at every renewal of the broad phase (in space with `chords_spatial`):

    chords = chords_planar(poses, owners, stations)
    tree = fit_tree(*chord_boxes(chords))
    window_pieces(points, first_piece, last_piece, chords, tree, reach, margin, nearest, window)

`nearest` is reused from one renewal to the next (-1 at first); the reuse saves work and does not change the result. A piece
outside its window cannot become the nearest before some distance has changed by half the margin. A surface differs from
its chords: the chord of the closest piece is farther than the nearest chord by at most twice the deviation. Therefore

    margin = 2 (change of distances until the next renewal + deviation of surfaces from chords)
    reach  = largest gap or depth of a contact + change of distances + deviation, tips at the ends of surfaces included

The change of distances is the sum of the displacements of a probe and of a piece. The margin does not include the tips: for
a point beside a tip, the nearest piece is the one that carries the tip.

If the tree is fitted for the present state, which is cheap, `nearest_piece` finds the nearest piece without a window.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.search.chord import chord_distance
from fsm.kernels.jit import kernel

LEAF = 4
"""Entries in a leaf; testing them costs about as much as two more nodes."""
FEW = 12
"""Number of pieces up to which testing all of them is faster than the tree."""
MANY = 64
"""Number of pieces up to which testing all their leaves is faster than descending the tree."""


@kernel
def fit_tree(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Bounding boxes of all nodes of a tree over an ordered table of boxes.

    Parameters
    ----------
    lower, upper : (n, D) arrays, m
        Lower and upper corner of each box. A box with NaN in a corner is left out of the tree.

    Returns
    -------
    (2 leaves, 2 D) array, m
        Lowest, then highest corner of each node; `leaves` is a power of two. Node 0 is not used. A node without entries has
        its lowest corner at infinity and its highest at minus infinity.
    """
    count, size = lower.shape
    leaves = 1
    while leaves * LEAF < count:
        leaves *= 2
    tree = np.empty((2 * leaves, 2 * size))
    tree[:, :size] = np.inf
    tree[:, size:] = -np.inf
    for j in range(count):
        node = leaves + j // LEAF
        for i in range(size):
            # the order of the comparison skips NaN
            tree[node, i] = lower[j, i] if lower[j, i] < tree[node, i] else tree[node, i]
            tree[node, size + i] = upper[j, i] if upper[j, i] > tree[node, size + i] else tree[node, size + i]
    for node in range(leaves - 1, 0, -1):
        for i in range(size):
            tree[node, i] = min(tree[2 * node, i], tree[2 * node + 1, i])
            tree[node, size + i] = max(tree[2 * node, size + i], tree[2 * node + 1, size + i])
    return tree


@kernel(inline=True)
def next_node(node: int, span: int) -> tuple[int, int]:
    """Next node from the left after this node and its subtree, and the number of entries that it spans; 0 at the end."""
    while node & 1:
        node >>= 1
        span *= 2
    return (node + 1 if node else 0), span


@kernel(inline=True)
def _previous_node(node: int, span: int) -> tuple[int, int]:
    """Node that follows from the right; see `next_node`."""
    while node > 1 and not node & 1:
        node >>= 1
        span *= 2
    return (node - 1 if node > 1 else 0), span


@kernel(inline=True)
def _box_distance(box: np.ndarray, point: np.ndarray) -> float:
    """Squared distance of a point from a node's box; 0 inside."""
    size = point.shape[0]
    total = 0.0
    for i in range(size):
        away = max(0.0, box[i] - point[i], point[i] - box[size + i])
        total += away * away
    return total


@kernel
def _first_guess(point: np.ndarray, first: int, last: int, tree: np.ndarray) -> int:
    """First piece of a leaf that contains pieces first ... last - 1; the search descends to the nearer child."""
    leaves = tree.shape[0] // 2
    node, span = 1, leaves * LEAF
    while node < leaves:
        node, span = 2 * node, span // 2
        middle = (node + 1) * span - leaves * LEAF
        if middle < last and (middle <= first or _box_distance(tree[node + 1], point) < _box_distance(tree[node], point)):
            node += 1
    return max(first, (node - leaves) * LEAF)


@kernel(inline=True)
def _nearest_in(point: np.ndarray, low: int, high: int, chords: np.ndarray, piece: int, best: float) -> tuple[int, float]:
    """Nearest piece among low ... high - 1 and a known piece, and its squared distance."""
    for j in range(low, high):
        distance = chord_distance(chords[j], point)
        if distance < best or (distance == best and j < piece):
            piece, best = j, distance
    return piece, best


@kernel
def nearest_piece(
    point: np.ndarray, first: int, last: int, chords: np.ndarray, tree: np.ndarray, start: int, bound: float
) -> tuple[int, float]:
    """Find the piece whose chord is nearest to a point; among equally near pieces, the first one.

    Parameters
    ----------
    point : (D,) array, m
    first, last : int
        First and last piece of the surface that may be nearest, `last` excluded.
    chords : see `fsm.interactions.search.chord`
    tree : `fit_tree` of the boxes of all these chords
    start : int
        Piece that is tested first, for example the nearest piece of the last search. A value outside the surface is ignored.
        The result does not depend on it.
    bound : m^2
        Square of the largest distance that is searched.

    Returns
    -------
    piece : int
        -1 if there is none.
    float, m^2
        Squared distance of the piece, or the bound.
    """
    leaves = tree.shape[0] // 2
    piece, best = -1, bound
    if first >= last:
        return piece, best
    if last - first > MANY and not first <= start < last:
        start = _first_guess(point, first, last, tree)
    if first <= start < last:
        distance = chord_distance(chords[start], point)
        if distance < best:
            piece, best = start, distance
    if last - first <= MANY:
        for leaf in range(first // LEAF, (last - 1) // LEAF + 1):
            if _box_distance(tree[leaves + leaf], point) <= best:
                low, high = max(leaf * LEAF, first), min((leaf + 1) * LEAF, last)
                piece, best = _nearest_in(point, low, high, chords, piece, best)
        return piece, best
    node, span = 1, leaves * LEAF
    while node > 0:
        low = node * span - leaves * LEAF
        if low >= last:
            break
        if low + span > first and _box_distance(tree[node], point) <= best:
            if node < leaves:
                node, span = 2 * node, span // 2
                continue
            piece, best = _nearest_in(point, max(low, first), min(low + span, last), chords, piece, best)
        node, span = next_node(node, span)
    return piece, best


@kernel
def nearest_of_few(
    point: np.ndarray, first: int, last: int, chords: np.ndarray, tree: np.ndarray, start: int, bound: float
) -> tuple[int, float]:
    """Find the nearest piece as `nearest_piece` does; faster for few pieces."""
    if last - first > FEW:
        return nearest_piece(point, first, last, chords, tree, start, bound)
    return _nearest_in(point, first, last, chords, -1, bound)


@kernel
def _first_within(
    point: np.ndarray, first: int, last: int, chords: np.ndarray, tree: np.ndarray, bound: float
) -> int:
    """First piece of first ... last - 1 whose squared distance is below the bound; `last` if there is none."""
    leaves = tree.shape[0] // 2
    node, span = 1, leaves * LEAF
    while node > 0:
        low = node * span - leaves * LEAF
        if low >= last:
            break
        if low + span > first and _box_distance(tree[node], point) < bound:
            if node < leaves:
                node, span = 2 * node, span // 2
                continue
            for j in range(max(low, first), min(low + span, last)):
                if chord_distance(chords[j], point) < bound:
                    return j
        node, span = next_node(node, span)
    return last


@kernel
def _last_within(
    point: np.ndarray, first: int, last: int, chords: np.ndarray, tree: np.ndarray, bound: float
) -> int:
    """Last piece of first ... last - 1 whose squared distance is below the bound; first - 1 if there is none."""
    leaves = tree.shape[0] // 2
    node, span = 1, leaves * LEAF
    while node > 0:
        low = node * span - leaves * LEAF
        if low + span <= first:
            break
        if low < last and _box_distance(tree[node], point) < bound:
            if node < leaves:
                node, span = 2 * node + 1, span // 2
                continue
            for j in range(min(low + span, last) - 1, max(low, first) - 1, -1):
                if chord_distance(chords[j], point) < bound:
                    return j
        node, span = _previous_node(node, span)
    return first - 1


@kernel
def window_pieces(
    points: np.ndarray,
    first_piece: np.ndarray,
    last_piece: np.ndarray,
    chords: np.ndarray,
    tree: np.ndarray,
    reach: np.ndarray,
    margin: float,
    nearest: np.ndarray,
    window: np.ndarray,
) -> None:
    """Find the pieces that may become the nearest to each probe before the next renewal.

    Parameters
    ----------
    points : (n, D) array, m
        Probes.
    first_piece, last_piece : (n,) int arrays
        First and last piece of the surface that each probe may touch, the last one excluded.
    chords, tree : see `nearest_piece`
    reach : (n,) array, m
        Pieces at this distance or farther are ignored.
    margin : m
    nearest : (n,) int array, changed in place
        Nearest piece, -1 if it is out of reach; the search starts with the previous content.
    window : (n, 2) int array, changed in place
        First and one past the last piece that is within reach and farther than the nearest by less than the margin. All
        pieces between them are included. Both are equal if the nearest piece is out of reach.
    """
    piece = -1
    for i in range(points.shape[0]):
        first, last = first_piece[i], last_piece[i]
        # a new probe starts at the piece of the previous probe, because successive probes are neighbours along a chain
        start = nearest[i] if nearest[i] >= 0 else piece
        piece, square = nearest_piece(points[i], first, last, chords, tree, start, reach[i] * reach[i])
        nearest[i] = piece
        if piece < 0:
            window[i, 0] = window[i, 1] = first
            continue
        bound = min(np.sqrt(square) + margin, reach[i]) ** 2
        window[i, 0] = _first_within(points[i], first, piece, chords, tree, bound)
        window[i, 1] = _last_within(points[i], piece + 1, last, chords, tree, bound) + 1
