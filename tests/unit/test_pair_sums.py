"""Sums over the contacts of a pair, against NumPy; how far bodies have moved at most."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.interactions.contact.pair_sums import AREA, CARRIED, DAMPING, FORCE, FRICTION, SLIDING, smallest_gaps, sums_of_pairs
from fsm.interactions.search.displacement_bound import furthest_motion


@pytest.mark.parametrize("slips", [1, 3])
def test_sums_are_those_of_the_contacts_of_each_pair(slips: int) -> None:
    rng = np.random.default_rng(1)
    pair, area = rng.integers(0, 3, 20), rng.uniform(1.0, 2.0, 20)
    slot = rng.permutation(20)[:12]
    part, normal, elastic, pull = rng.uniform(0.1, 1.0, (4, 12))
    rate, effort = rng.normal(size=(12, 1 + slips)), rng.normal(size=(12, slips))
    sums = sums_of_pairs(pair, slot, area, part, normal, pull, elastic, rate, effort, 4)
    wanted = {
        FORCE: normal * pull,
        AREA: area[slot] * part,
        FRICTION: np.linalg.norm(effort, axis=1),
        CARRIED: normal * pull * np.linalg.norm(rate[:, 1:], axis=1),
        SLIDING: (effort * rate[:, 1:]).sum(axis=1),
        DAMPING: (normal - elastic) * -rate[:, 0],
    }
    for row, values in wanted.items():
        np.testing.assert_allclose(sums[row], np.bincount(pair[slot], values, 4), rtol=1e-13, atol=1e-15)
    gap = np.full(4, 0.5)
    smallest_gaps(pair, slot, normal, gap)
    for of in range(4):
        assert gap[of] == min([0.5, *normal[pair[slot] == of]])


@pytest.mark.parametrize("size", [3, 7])
def test_no_point_of_a_body_moves_further(size: int) -> None:
    rng = np.random.default_rng(2)
    before, change = rng.normal(size=(5, size)), 0.1 * rng.normal(size=(5, size))
    bodies, radii = np.array([1, 3, 4]), np.array([0.5, 2.0, 0.1])
    n = 2 if size == 3 else 3
    factor = 1.0 if size == 3 else 2.2
    moved = np.abs(change[bodies])
    wanted = (moved[:, :n].sum(axis=1) + factor * moved[:, n:].sum(axis=1) * radii).max()
    assert furthest_motion(before, before + change, bodies, radii) == pytest.approx(wanted, rel=1e-12)
    assert furthest_motion(before, before, bodies, radii) == 0.0
