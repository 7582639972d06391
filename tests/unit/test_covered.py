"""Lines and branches that tests reach are told and judged apart."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.covered import covered, main


@pytest.mark.parametrize(
    ("lines", "branches", "code"), [(90, 45, 0), (89, 50, 1), (100, 44, 1)], ids=["enough", "few lines", "few branches"]
)
def test_both_are_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture, lines: int, branches: int, code: int) -> None:
    totals = {"covered_lines": lines, "num_statements": 100, "covered_branches": branches, "num_branches": 50}
    report = tmp_path / "data.json"
    report.write_text(json.dumps({"totals": totals}), encoding="utf-8")
    assert covered(report) == {"lines": lines, "branches": 2 * branches}
    assert main(report) == code
    told = capsys.readouterr().out.splitlines()
    assert [" less than 90 %" in line for line in told] == [lines < 90, 2 * branches < 90]
