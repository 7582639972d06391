"""Test of the accuracy of factors, from which the signs of their pivots follow."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

ACCURATE = 1e-4
"""Largest error of a test vector with entries of size 1, up to which the signs of pivots hold."""


@lru_cache(maxsize=16)
def trial_vector(order: int) -> np.ndarray:
    """Fixed vector (n,) of entries 1 and -1 in random order, shared by all callers."""
    return np.random.default_rng(0).choice((-1.0, 1.0), order)
