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
def _meet(
    number: int,
    lower: np.ndarray,
    upper: np.ndarray,
    order: np.ndarray,
    other_lower: np.ndarray,
    other_upper: np.ndarray,
    other_order: np.ndarray,
    tree: np.ndarray,
    same: bool,
    keys: np.ndarray,
    count: int,
) -> int:
    """Append the keys of the pairs of the `LEAF` boxes in a row from `number` on with the others; the new count.

    The boxes go through the tree together, neighbours as they are. If both sets are the same, pairs with later boxes only.
    What is past the end of `keys` is counted only.
    """
    size = lower.shape[1]
    end = min(number + LEAF, lower.shape[0])
    leaves = tree.shape[0] // 2
    node, span = 1, leaves * LEAF
    while node > 0:
        low = node * span - leaves * LEAF
        enter = False
        if not same or low + span > number:
            for q in range(number, end):
                enter = enter or _touch(lower[q], upper[q], tree[node, :size], tree[node, size:])
        if enter and node < leaves:
            node, span = 2 * node, span // 2
            continue
        if enter:
            for q in range(number, end):
                for j in range(max(low, q + 1) if same else low, min(low + span, other_lower.shape[0])):
                    if _touch(lower[q], upper[q], other_lower[j], other_upper[j]):
                        if count < keys.shape[0]:
                            one, other = order[q], other_order[j]
                            if same and one > other:
                                one, other = other, one
                            keys[count] = one * other_lower.shape[0] + other
                        count += 1
        node, span = next_node(node, span)
    return count


@kernel(inline=True)
def _touch(lower: np.ndarray, upper: np.ndarray, other_lower: np.ndarray, other_upper: np.ndarray) -> bool:
    """Whether two boxes overlap or touch."""
    touch = True
    for i in range(lower.shape[0]):
        touch = touch and lower[i] <= other_upper[i] and other_lower[i] <= upper[i]
    return touch


@kernel
def _pairs(
    lower: np.ndarray,
    upper: np.ndarray,
    order: np.ndarray,
    other_lower: np.ndarray,
    other_upper: np.ndarray,
    other_order: np.ndarray,
    same: bool,
) -> np.ndarray:
    """Pairs in ascending order of boxes that are in the order given."""
    tree = fit_tree(other_lower, other_upper)
    # a pair's key is the first number times the count of the others plus the second
    keys = np.empty(4 * lower.shape[0] + 16, dtype=np.int64)
    count = 0
    for leaf in range((lower.shape[0] + LEAF - 1) // LEAF):
        while True:
            new = _meet(
                leaf * LEAF, lower, upper, order, other_lower, other_upper, other_order, tree, same, keys, count
            )  # fmt: skip
            if new <= keys.shape[0]:
                break
            longer = np.empty(2 * new, dtype=np.int64)
            longer[:count] = keys[:count]
            keys = longer
        count = new
    keys = np.sort(keys[:count])
    pairs = np.empty((count, 2), dtype=np.int64)
    for k in range(count):
        pairs[k, 0] = keys[k] // other_lower.shape[0]
        pairs[k, 1] = keys[k] - pairs[k, 0] * other_lower.shape[0]
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
    lower, upper = lower[order], upper[order]
    return _pairs(lower, upper, order, lower, upper, order, True)


@kernel
def overlapping_pairs_between(
    lower: np.ndarray,
    upper: np.ndarray,
    order: np.ndarray,
    other_lower: np.ndarray,
    other_upper: np.ndarray,
    other_order: np.ndarray,
) -> np.ndarray:
    """All pairs of a box of one set and a box of another that overlap or touch; see `overlapping_pairs`.

    Parameters
    ----------
    lower, upper, order : (n, D), (n, D) and (n,) arrays
    other_lower, other_upper, other_order : (p, D), (p, D) and (p,) arrays
        The tree is over these.

    Returns
    -------
    (m, 2) int array
        Number in the one set and number in the other, in ascending order.
    """
    return _pairs(
        lower[order], upper[order], order, other_lower[other_order], other_upper[other_order], other_order, False
    )  # fmt: skip
