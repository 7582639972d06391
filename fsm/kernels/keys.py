"""Where numbers that name things are in an ascending list of such numbers."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["places_among"]


@kernel
def places_among(known: np.ndarray, keys: np.ndarray) -> np.ndarray:
    """Place of each of `keys` (n,) in `known` (k,), which ascends; -1 for what is not there."""
    count = known.shape[0]
    place = np.empty(keys.shape[0], dtype=np.int64)
    for i in range(keys.shape[0]):
        # in nearly all cases both are the same, in the same order
        at = i if i < count and known[i] == keys[i] else np.searchsorted(known, keys[i])
        place[i] = at if at < count and known[at] == keys[i] else -1
    return place
