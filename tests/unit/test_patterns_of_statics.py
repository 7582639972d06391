"""Patterns of compiled statics with contact: one that lacks pairs of bodies is completed at once, and then few lack any."""

from pathlib import Path

import pytest

from fsm.case.loading.load_case import load_case
from fsm.model.system.static_arrays import StaticSegments
from fsm.run.run_case import run_case

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_pull" / "case.toml"


@pytest.fixture
def changed(monkeypatch):
    """For each change of a pattern, whether it gave another pattern, and its number of blocks over that of the bodies."""
    found, change = [], StaticSegments._change_pattern

    def counted(self, pattern):
        before = self._pattern
        other = len(before.indices) != len(pattern.indices) or (before.indices != pattern.indices).any()
        found.append((other, len(pattern.indices) / len(pattern.diagonal)))
        change(self, pattern)

    monkeypatch.setattr(StaticSegments, "_change_pattern", counted)
    return found


def test_patterns_that_lack_pairs_get_them_and_last(changed, tmp_path):
    """5 changes in 137 steps; a pattern that keeps the pairs of one earlier pattern only changes more often, because
    predictions and rejected steps reach other bodies than accepted ones. The matrix has 3 blocks for each body of a strip,
    and few more for contacts: with blocks for all pairs of bodies near each other it had 25.
    """
    run_case(load_case(CASE), tmp_path, progress=False, figures=False)
    assert changed and all(other for other, _ in changed) and len(changed) <= 20
    assert max(blocks for _, blocks in changed) < 12.0
