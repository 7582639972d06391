"""Patterns of compiled statics with contact: a pattern that lacks pairs of bodies is completed at once."""

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


def test_pattern_that_lacks_pairs_gets_them(changed, tmp_path):
    loaded = load_case(CASE, ['drive.0.travel="8 mm"', "solve.max_steps=60"])
    run_case(loaded, tmp_path, progress=False, figures=False)
    assert changed and all(changed)
