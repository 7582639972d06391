"""Broad phase of contact: a balanced tree of boxes over things in a row, and what of them is near a point.

The things keep their order: pieces of surfaces follow each other along the chain, so neighbours in the array are neighbours
in space and nothing is sorted. `LEAF` of them in a row share a leaf. Nodes are numbered as in a heap, the root 1 and the
children of k being 2 k and 2 k + 1, all leaves at one depth, which makes the tree an array without pointers that a walk
crosses without a stack: down is 2 k, past a node is k + 1 after climbing out of right children. A box holds what is below it
whatever the sizes, so a plate of 80 mm beside segments of 0.1 mm only makes the few boxes above it large.

Fitting costs O(n), a search of points near the chain O(log n).

How a client with surfaces uses it, at every renewal of its broad phase (in space `chords_spatial`):

    chords = chords_planar(poses, owners, stations)
    tree = fit_tree(*chord_boxes(chords))
    window_pieces(points, first_piece, last_piece, chords, tree, reach, margin, nearest, window)

`nearest` is kept from one renewal to the next (-1 at first), which saves work and changes nothing. A piece outside its
window cannot become the nearest before some distance has changed by half the margin. A surface is not its chord: its
closest point is on a piece whose chord is farther than the nearest by at most twice what surfaces depart from chords. So

    margin = 2 (change of distances until the next renewal + departure from chords)
    reach  = largest gap or depth that counts + change of distances + departure, tips at the ends of surfaces included

where the change is the sum of what a probe and a piece move. The tips are no part of the margin: a point beside a tip has
the piece that the tip belongs to as its nearest.

With the tree fitted anew for a state, which is cheap, `nearest_piece` gives the nearest piece itself without a window.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.chord import chord_distance
from fsm.kernels.jit import kernel

__all__ = ["LEAF", "fit_tree", "nearest_of_few", "nearest_piece", "next_node", "window_pieces"]

LEAF = 4
"""Things in a leaf: looking at so many costs about as much as two more nodes."""
FEW = 12
"""Pieces up to which looking at all of them is faster than the tree."""
MANY = 64
"""Pieces up to which looking at all of their leaves is faster than coming down the tree."""


@kernel
def fit_tree(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Boxes of all nodes over the boxes of things in a row.

    Parameters
    ----------
    lower, upper : (n, D) arrays, m
        Corners. A box with anything that is not a number is in no box of the tree.

    Returns
    -------
    (2 leaves, 2 D) array, m
        Lowest, then highest corner of each node; `leaves` is a power of two. Node 0 is not used. A node without things has
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
            # in this order, what is not a number is passed over
            tree[node, i] = lower[j, i] if lower[j, i] < tree[node, i] else tree[node, i]
            tree[node, size + i] = upper[j, i] if upper[j, i] > tree[node, size + i] else tree[node, size + i]
    for node in range(leaves - 1, 0, -1):
        for i in range(size):
            tree[node, i] = min(tree[2 * node, i], tree[2 * node + 1, i])
            tree[node, size + i] = max(tree[2 * node, size + i], tree[2 * node + 1, size + i])
    return tree


@kernel(inline=True)
def next_node(node: int, span: int) -> tuple[int, int]:
    """The node after all that is below this one, from the left, and how many things it spans; node 0 at the end."""
    while node & 1:
        node >>= 1
        span *= 2
    return (node + 1 if node else 0), span


@kernel(inline=True)
def _previous_node(node: int, span: int) -> tuple[int, int]:
    """`next_node` from the right."""
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
def _likely_piece(point: np.ndarray, first: int, last: int, tree: np.ndarray) -> int:
    """First piece of the leaf that one comes to by always taking the nearer child that has pieces first ... last - 1."""
    leaves = tree.shape[0] // 2
    node, span = 1, leaves * LEAF
    while node < leaves:
        node, span = 2 * node, span // 2
        middle = (node + 1) * span - leaves * LEAF
        if middle < last and (middle <= first or _box_distance(tree[node + 1], point) < _box_distance(tree[node], point)):
            node += 1
    return max(first, (node - leaves) * LEAF)


@kernel(inline=True)
def _nearer(point: np.ndarray, low: int, high: int, chords: np.ndarray, piece: int, best: float) -> tuple[int, float]:
    """The nearest of the pieces low ... high - 1 and one that is known, with their squared distances."""
    for j in range(low, high):
        distance = chord_distance(chords[j], point)
        if distance < best or (distance == best and j < piece):
            piece, best = j, distance
    return piece, best


@kernel
def nearest_piece(
    point: np.ndarray, first: int, last: int, chords: np.ndarray, tree: np.ndarray, start: int, bound: float
) -> tuple[int, float]:
    """The piece whose chord is nearest to a point; of several equally near ones the first.

    Parameters
    ----------
    point : (D,) array, m
    first, last : int
        Pieces of the surface, `last` excluded.
    chords : see `fsm.interactions.chord`
    tree : `fit_tree` of the boxes of all these chords
    start : int
        Where to look first, for example the nearest piece of the last time; anything else than a piece of the surface leaves
        it to the tree. Changes nothing of the result.
    bound : m^2
        Only pieces nearer than this, squared.

    Returns
    -------
    piece : int
        -1 if there is none.
    float, m^2
        Its squared distance, or the bound.
    """
    leaves = tree.shape[0] // 2
    piece, best = -1, bound
    if first >= last:
        return piece, best
    if last - first > MANY and not first <= start < last:
        start = _likely_piece(point, first, last, tree)
    if first <= start < last:
        distance = chord_distance(chords[start], point)
        if distance < best:
            piece, best = start, distance
    if last - first <= MANY:
        for leaf in range(first // LEAF, (last - 1) // LEAF + 1):
            if _box_distance(tree[leaves + leaf], point) <= best:
                low, high = max(leaf * LEAF, first), min((leaf + 1) * LEAF, last)
                piece, best = _nearer(point, low, high, chords, piece, best)
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
            piece, best = _nearer(point, max(low, first), min(low + span, last), chords, piece, best)
        node, span = next_node(node, span)
    return piece, best


@kernel
def nearest_of_few(
    point: np.ndarray, first: int, last: int, chords: np.ndarray, tree: np.ndarray, start: int, bound: float
) -> tuple[int, float]:
    """As `nearest_piece`, faster where the pieces are few."""
    if last - first > FEW:
        return nearest_piece(point, first, last, chords, tree, start, bound)
    return _nearer(point, first, last, chords, -1, bound)


@kernel
def _first_within(
    point: np.ndarray, first: int, last: int, chords: np.ndarray, tree: np.ndarray, bound: float
) -> int:
    """First of the pieces first ... last - 1 with a squared distance below the bound; `last` if there is none."""
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
    """Last of the pieces first ... last - 1 with a squared distance below the bound; first - 1 if there is none."""
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
    """The pieces of its surface that may be the nearest to each probe before the next renewal.

    Parameters
    ----------
    points : (n, D) array, m
        Probes.
    first_piece, last_piece : (n,) int arrays
        Pieces of the surface that each watches, the last one excluded.
    chords, tree : see `nearest_piece`
    reach : (n,) array, m
        Pieces from here on are not seen.
    margin : m
    nearest : (n,) int array, changed in place
        Nearest piece, -1 if it is out of reach; what was in it is where to look first.
    window : (n, 2) int array, changed in place
        From the first to one past the last piece within reach that is farther than the nearest by less than the margin; all
        between them are in it, however far. Equal when the nearest is out of reach.
    """
    piece = -1
    for i in range(points.shape[0]):
        first, last = first_piece[i], last_piece[i]
        # a new probe starts where the one before it ended: they too follow each other along a chain
        start = nearest[i] if nearest[i] >= 0 else piece
        piece, square = nearest_piece(points[i], first, last, chords, tree, start, reach[i] * reach[i])
        nearest[i] = piece
        if piece < 0:
            window[i, 0] = window[i, 1] = first
            continue
        bound = min(np.sqrt(square) + margin, reach[i]) ** 2
        window[i, 0] = _first_within(points[i], first, piece, chords, tree, bound)
        window[i, 1] = _last_within(points[i], piece + 1, last, chords, tree, bound) + 1
