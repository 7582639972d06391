"""Keys found in an ascending list, compared with NumPy's search."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from fsm.kernels.keys import find_keys

KEYS = st.lists(st.integers(0, 40), max_size=30, unique=True).map(lambda keys: np.array(keys, dtype=np.int64))


@settings(deadline=None)  # the first call may compile
@given(KEYS.map(np.sort), KEYS)
def test_places_are_those_of_equal_keys_and_no_others(known: np.ndarray, keys: np.ndarray) -> None:
    place = find_keys(known, keys)
    there = np.isin(keys, known)
    assert np.array_equal(place >= 0, there)
    assert np.array_equal(known[place[there]], keys[there])
