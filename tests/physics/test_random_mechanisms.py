"""Random mechanisms of ideal joints against equations of motion that share nothing with the program."""

from __future__ import annotations

from pathlib import Path

import pytest

import fsm
from validation.strangers.cases import draw
from validation.strangers.joint_equations import by_equations


@pytest.mark.parametrize("number", [0, 4, 6, 10])  # with up to five bodies; others have up to 25
def test_a_random_mechanism(number: int, tmp_path: Path) -> None:
    """Trees, redundant plane linkages in space, and spatial linkages, by `validation.strangers`."""
    tables = draw("mechanisms", number, 5).tables
    tables["solve"]["error_estimates"] = "off"
    summary = fsm.load(tables).run(tmp_path).summary
    assert summary["method"] == "explicit"
    assert summary["energy_error"] < 1e-6
    verdict = by_equations(tables, tmp_path)
    assert verdict["off"] < 1e-6, verdict
