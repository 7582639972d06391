"""Keys found in an ascending list, compared with NumPy's search, and the memory that contacts store by these keys."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from fsm.kernels.keys import find_keys
from fsm.model.contact.contact_memory import ContactMemory

KEYS = st.lists(st.integers(0, 40), max_size=30, unique=True).map(lambda keys: np.array(keys, dtype=np.int64))


@settings(deadline=None)  # the first call may compile
@given(KEYS.map(np.sort), KEYS)
def test_places_are_those_of_equal_keys_and_no_others(known: np.ndarray, keys: np.ndarray) -> None:
    place = find_keys(known, keys)
    there = np.isin(keys, known)
    assert np.array_equal(place >= 0, there)
    assert np.array_equal(known[place[there]], keys[there])


@given(KEYS.map(np.sort), KEYS)
def test_memory_is_that_of_the_same_key_and_nothing_for_others(known: np.ndarray, keys: np.ndarray) -> None:
    own = 1.0 + known
    kept = ContactMemory(known, own, 2.0 * own, 3.0 * own, np.column_stack([own, -own]))
    found = kept.of(keys)
    there = np.where(np.isin(keys, known), 1.0 + keys, 0.0)
    assert np.array_equal(found.key, keys)
    for factor, values in zip((1.0, 2.0, 3.0), found[1:4], strict=True):
        assert np.array_equal(values, factor * there)
    assert np.array_equal(found.deflection, np.column_stack([there, -there]))
