"""Patterns of compiled statics with contact: one that lacks pairs of bodies is completed at once, and then few lack any."""

from pathlib import Path

import pytest

from fsm.case.loading.load_case import load_case
from fsm.model.system.static_arrays import StaticSegments
from fsm.run.run_case import run_case

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_pull" / "case.toml"


@pytest.fixture
def changed(monkeypatch):
    """Whether each change of a pattern gave another pattern."""
    found, change = [], StaticSegments._change_pattern

    def counted(self, pattern):
        before = self._pattern
        found.append(len(before.indices) != len(pattern.indices) or (before.indices != pattern.indices).any())
        change(self, pattern)

    monkeypatch.setattr(StaticSegments, "_change_pattern", counted)
    return found


def test_patterns_that_lack_pairs_get_them_and_last(changed, tmp_path):
    """14 changes in 137 steps; a pattern that keeps the pairs of one earlier pattern only changes 97 times, because
    predictions and rejected steps reach other bodies than accepted ones.
    """
    run_case(load_case(CASE), tmp_path, progress=False, figures=False)
    assert changed and all(changed) and len(changed) <= 30
