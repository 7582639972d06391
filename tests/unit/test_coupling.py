"""Bodies that contacts may couple, compared with an explicit list of all of them."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.interactions.search.contact_body_pairs import coupled_bodies


@pytest.mark.parametrize("seed", range(5))
def test_coupled_bodies(seed: int) -> None:
    rng = np.random.default_rng(seed)
    owners = np.array([[max(0, j - 1), min(j, 39)] for j in range(41)])
    probe_body = np.repeat(rng.permutation(60)[:30], rng.integers(1, 6, 30))
    first = rng.integers(0, 41, len(probe_body))
    window = np.column_stack([first, np.minimum(41, first + rng.integers(0, 12, len(first)))])
    window[rng.random(len(first)) < 0.3] = window[0]  # neighbours often have the same window
    wanted = set()
    for body, (low, high) in zip(probe_body, window, strict=True):
        for a, b in owners[low:high]:
            wanted |= {(body, a), (body, b), (a, b)}
    found = coupled_bodies(probe_body, window, owners, 60)
    assert {tuple(pair) for pair in found.tolist()} == wanted
    assert len(found) <= 3 * len(wanted) * 6


def test_nothing_near() -> None:
    none = coupled_bodies(np.array([3, 3]), np.array([[2, 2], [0, 0]]), np.array([[0, 0], [0, 1], [1, 1]]), 4)
    assert none.shape == (0, 2)
