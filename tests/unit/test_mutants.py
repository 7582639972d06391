"""The list of mutants agrees with the program, and their verdicts are reproduced."""

from __future__ import annotations

from pathlib import Path

import pytest

from validation.mutants import __main__ as command
from validation.mutants.listed import MUTANTS
from validation.mutants.mutant import Mutant
from validation.mutants.run import CAUGHT, GUARD_FAILS, REPOSITORY, SURVIVED, judge


def test_every_mutant_changes_one_place_and_has_a_guard_that_is_there() -> None:
    assert [fault for mutant in MUTANTS if (fault := mutant.fault(REPOSITORY))] == []
    names = [mutant.name for mutant in MUTANTS]
    assert len(set(names)) == len(names) >= 40
    for mutant in MUTANTS:
        assert mutant.guard and mutant.file.startswith("fsm/"), mutant.name
        assert mutant.new != mutant.old, mutant.name


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "law.py").write_text("def force(x):\n    return 2.0 * x\n", encoding="utf-8")
    (tmp_path / "test_law.py").write_text(
        "import pytest\nfrom law import force\n\ndef test_slope():\n    assert force(3.0) == 6.0\n\n"
        "def test_zero():\n    assert force(0.0) == 0.0\n\ndef test_wrong():\n    assert force(1.0) == 1.0\n\n"
        "@pytest.mark.nightly\ndef test_long():\n    assert force(2.0) == 4.0\n",
        encoding="utf-8",
    )
    return tmp_path


@pytest.mark.nightly
@pytest.mark.parametrize(("test", "verdict"), [("test_slope", CAUGHT), ("test_zero", SURVIVED), ("test_wrong", GUARD_FAILS)])
def test_verdicts(test: str, verdict: str, root: Path) -> None:
    mutant = Mutant("slope", "law.py", "2.0 * x", "3.0 * x", (f"test_law.py::{test}",))
    assert not mutant.fault(root)
    found, told = judge(mutant, root)
    assert found == verdict
    assert (test in told) == (verdict != SURVIVED)
    assert "2.0 * x" in (root / "law.py").read_text(encoding="utf-8")  # as it was


def test_an_entry_that_is_out_of_date_is_refused(root: Path) -> None:
    guard = ("test_law.py::test_slope",)
    assert "0 times" in Mutant("gone", "law.py", "4.0 * x", "x", guard).fault(root)
    assert "2 times" in Mutant("twice", "law.py", "x", "y", guard).fault(root)
    assert "is not there" in Mutant("moved", "laws.py", "x", "y", guard).fault(root)
    for test in ("test_slop", "test_long"):
        assert "no test" in Mutant("unguarded", "law.py", "2.0 * x", "x", (f"test_law.py::{test}",)).fault(root)


def test_a_verdict_holds_for_its_sources(root: Path) -> None:
    mutant = Mutant("slope", "law.py", "2.0 * x", "3.0 * x", ("test_law.py::test_slope",))
    before = mutant.key(root)
    assert mutant.key(root) == before
    (root / "law.py").write_text("def force(x):\n    return 2.0 * x + 0.0\n", encoding="utf-8")
    assert mutant.key(root) != before


def test_the_table_goes_between_its_marks(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text(f"head\n\n{command.BEGIN}\nstale\n{command.END}\nfoot\n", encoding="utf-8")
    found = {mutant.name: {"verdict": CAUGHT, "date": "23 November 2026"} for mutant in MUTANTS}
    found[MUTANTS[0].name]["verdict"] = SURVIVED
    command.write_table(readme, found)
    text = readme.read_text(encoding="utf-8")
    assert text.startswith("head\n") and text.endswith("foot\n") and "stale" not in text
    assert f"{len(MUTANTS) - 1} of {len(MUTANTS)} caught" in text
    assert text.count("| caught |") == len(MUTANTS) - 1
