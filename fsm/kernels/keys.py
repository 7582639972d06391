"""Search for integer keys in a sorted list."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def find_keys(known: np.ndarray, keys: np.ndarray) -> np.ndarray:
    """Index of each of `keys` (n,) in the ascending array `known` (k,); -1 for an absent key."""
    count = known.shape[0]
    place = np.empty(keys.shape[0], dtype=np.int64)
    for i in range(keys.shape[0]):
        # both arrays are usually equal, so the same index is tried first
        at = i
        if i >= count or known[i] != keys[i]:
            at, high = 0, count
            while at < high:
                middle = (at + high) // 2
                if known[middle] < keys[i]:
                    at = middle + 1
                else:
                    high = middle
        place[i] = at if at < count and known[at] == keys[i] else -1
    return place
