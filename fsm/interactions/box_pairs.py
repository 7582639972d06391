"""Broad phase of contact: which boxes of many overlap.

Loose bodies have no order in space. `morton_order` gives them one, along a curve that fills it, and the tree of `box_tree`
over that order has compact boxes. The pairs found are those of a comparison of all with all, in ascending order, whatever
order the tree has; a poor or an old order only costs time.

    order = morton_order(lower, upper)            once in a while
    pairs = overlapping_pairs(lower, upper, order)

Bodies that move get the boxes of all their way, or boxes enlarged by a margin; then the pairs hold until something has
moved by as much. O(n log n + pairs).
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.box_tree import LEAF, fit_tree, next_node
from fsm.kernels.jit import kernel

__all__ = ["morton_order", "overlapping_pairs", "overlapping_pairs_between"]


@kernel
def morton_order(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Order of boxes along a Morton curve through their middles.

    Parameters
    ----------
    lower, upper : (n, D) arrays, m
        D = 2 or 3. Boxes without end or with what is not a number come first.

    Returns
    -------
    (n,) int array
        A permutation; boxes in one cell of the curve, 2^-(62//D) of the extent wide, stay in the order they are in.
    """
    count, size = lower.shape
    bits = 62 // size
    middle = 0.5 * lower + 0.5 * upper
    codes = np.zeros(count, dtype=np.int64)
    for i in range(size):
        low, high = np.inf, -np.inf
        for j in range(count):
            if np.isfinite(middle[j, i]):
                low, high = min(low, middle[j, i]), max(high, middle[j, i])
        # half, since high - low may be beyond the largest number; no scale if all are at one place
        scale = (2.0**bits - 1.0) / (0.5 * high - 0.5 * low) if high > low else 0.0
        if not np.isfinite(scale):
            continue
        for j in range(count):
            if np.isfinite(middle[j, i]):
                cell = int((0.5 * middle[j, i] - 0.5 * low) * scale)
                for bit in range(bits):
                    codes[j] |= ((cell >> bit) & 1) << (size * bit + i)
    return np.argsort(codes, kind="mergesort")  # stable


@kernel
def _visit(
    low_corner: np.ndarray,
    high_corner: np.ndarray,
    first: int,
    lower: np.ndarray,
    upper: np.ndarray,
    tree: np.ndarray,
    hits: np.ndarray,
    count: int,
) -> int:
    """Append the boxes from number `first` on that overlap one box to `hits` from place `count` on; the new count.

    What is past the end of `hits` is counted only.
    """
    size = lower.shape[1]
    leaves = tree.shape[0] // 2
    node, span = 1, leaves * LEAF
    while node > 0:
        low = node * span - leaves * LEAF
        enter = low + span > first
        for i in range(size):
            enter = enter and tree[node, i] <= high_corner[i] and low_corner[i] <= tree[node, size + i]
        if enter and node < leaves:
            node, span = 2 * node, span // 2
            continue
        if enter:
            for j in range(max(low, first), min(low + span, lower.shape[0])):
                meet = True
                for i in range(size):
                    meet = meet and lower[j, i] <= high_corner[i] and low_corner[i] <= upper[j, i]
                if meet:
                    if count < hits.shape[0]:
                        hits[count] = j
                    count += 1
        node, span = next_node(node, span)
    return count


@kernel
def _split(keys: np.ndarray, count: int) -> np.ndarray:
    """Pairs (m, 2) in ascending order from keys, the first number times `count` plus the second."""
    keys = np.sort(keys)
    pairs = np.empty((keys.shape[0], 2), dtype=np.int64)
    for k in range(keys.shape[0]):
        pairs[k, 0] = keys[k] // count
        pairs[k, 1] = keys[k] - pairs[k, 0] * count
    return pairs


@kernel
def overlapping_pairs(lower: np.ndarray, upper: np.ndarray, order: np.ndarray) -> np.ndarray:
    """All pairs of boxes that overlap or touch.

    Parameters
    ----------
    lower, upper : (n, D) arrays, m
        Corners. A box with what is not a number overlaps nothing.
    order : (n,) int array
        Permutation in which neighbours should be near each other (`morton_order`). Changes nothing of the result.

    Returns
    -------
    (m, 2) int array
        Pairs i < j in ascending order.
    """
    count = lower.shape[0]
    sorted_lower, sorted_upper = lower[order], upper[order]
    tree = fit_tree(sorted_lower, sorted_upper)
    hits = np.empty(0, dtype=np.int64)
    total = 0
    for j in range(count):
        total = _visit(sorted_lower[j], sorted_upper[j], j + 1, sorted_lower, sorted_upper, tree, hits, total)
    keys = np.empty(total, dtype=np.int64)
    start = 0
    for j in range(count):
        end = _visit(sorted_lower[j], sorted_upper[j], j + 1, sorted_lower, sorted_upper, tree, keys, start)
        for k in range(start, end):
            one, other = order[j], order[keys[k]]
            keys[k] = min(one, other) * count + max(one, other)
        start = end
    return _split(keys, count)


@kernel
def overlapping_pairs_between(
    lower: np.ndarray,
    upper: np.ndarray,
    other_lower: np.ndarray,
    other_upper: np.ndarray,
    other_order: np.ndarray,
) -> np.ndarray:
    """All pairs of a box of one set and a box of another that overlap or touch; see `overlapping_pairs`.

    Parameters
    ----------
    lower, upper : (n, D) arrays, m
    other_lower, other_upper : (p, D) arrays, m
    other_order : (p,) int array
        `morton_order` of the other set. The tree is over it, so let it be the larger one.

    Returns
    -------
    (m, 2) int array
        Number in the one set and number in the other, in ascending order.
    """
    count = other_lower.shape[0]
    sorted_lower, sorted_upper = other_lower[other_order], other_upper[other_order]
    tree = fit_tree(sorted_lower, sorted_upper)
    hits = np.empty(0, dtype=np.int64)
    total = 0
    for j in range(lower.shape[0]):
        total = _visit(lower[j], upper[j], 0, sorted_lower, sorted_upper, tree, hits, total)
    keys = np.empty(total, dtype=np.int64)
    start = 0
    for j in range(lower.shape[0]):
        end = _visit(lower[j], upper[j], 0, sorted_lower, sorted_upper, tree, keys, start)
        for k in range(start, end):
            keys[k] = j * count + other_order[keys[k]]
        start = end
    return _split(keys, count)
