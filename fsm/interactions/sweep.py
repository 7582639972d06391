"""Which of the listed pairs of boxes overlap, found by sweeping along an axis.

Boxes are taken in the order of their beginnings; each is compared with those that begin before it ends. A list of all pairs
of n boxes is never gone through: the pairs that overlap are looked up in it.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["ListedPairs"]


class ListedPairs:
    """Pairs of boxes that matter.

    Parameters
    ----------
    pairs : (m, 2) int array
    count : int
        How many boxes there are.
    """

    def __init__(self, pairs: np.ndarray, count: int) -> None:
        keys = pairs.min(axis=1, initial=count) * count + pairs.max(axis=1, initial=0)
        self._rows = np.argsort(keys, kind="stable")
        self._keys = keys[self._rows]

    def overlapping(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Rows of the pairs whose boxes have a point in common, (k,) int array, in order.

        Parameters
        ----------
        low, high : (n, d) arrays, m
            Corners of the boxes; may be infinite.
        """
        ends = np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1)
        along = int(np.argmax(np.ptp(low[ends], axis=0))) if ends.any() else 0
        order = np.argsort(low[:, along], kind="stable")
        return np.sort(_overlapping(low, high, order, along, self._keys, self._rows))


@kernel
def _overlapping(
    low: np.ndarray, high: np.ndarray, order: np.ndarray, along: int, keys: np.ndarray, rows: np.ndarray
) -> np.ndarray:
    count, size = low.shape
    found, out = 0, np.empty(256, dtype=np.int64)
    for place in range(count):
        one = order[place]
        for next_place in range(place + 1, count):
            two = order[next_place]
            if low[two, along] > high[one, along]:
                break
            meet = True
            for i in range(size):
                meet = meet and low[one, i] <= high[two, i] and low[two, i] <= high[one, i]
            if not meet:
                continue
            key = min(one, two) * count + max(one, two)
            at = np.searchsorted(keys, key)
            while at < keys.shape[0] and keys[at] == key:
                if found == out.shape[0]:
                    out = np.concatenate((out, np.empty_like(out)))
                out[found] = rows[at]
                found += 1
                at += 1
    return out[:found].copy()
