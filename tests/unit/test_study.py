"""Studies of films: varied parameters, changes against a reference, the figure, and the printed comparison."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from fsm.case.loading.table import load_reference
from fsm.errors import CaseError
from fsm.run.table_files import format_comparison, format_table
from fsm.views.plots.study import plot_study, relative_changes, varied_column

CASES = Path(__file__).parents[2] / "folding_cases" / "membrane_impact"
ROWS: list[dict[str, Any]] = [
    {"case": "10 N", "tension.pull": 10.0, "frequency_hz": 34.0, "amplitude_center": 1e-3, "amplitude_patch": 5e-4},
    {"case": "12.5 N", "tension.pull": 12.5, "frequency_hz": 38.0, "amplitude_center": 9e-4, "amplitude_patch": 4e-4},
    {"case": "15 N", "tension.pull": 15.0, "frequency_hz": 41.0, "amplitude_center": 8e-4, "amplitude_patch": 4e-4},
    {"case": "20 N", "tension.pull": 20.0, "frequency_hz": 50.0, "amplitude_center": 7e-4, "amplitude_patch": 3e-4},
    {"case": "uniform", "frequency_hz": 44.0, "amplitude_center": 7e-4},
]


def test_what_is_varied() -> None:
    label, x = varied_column(ROWS, {"patch": "", "tension.pull": "N"})
    assert label == "tension.pull (N)"
    assert x == [10.0, 12.5, 15.0, 20.0, None]
    assert varied_column(ROWS, {}) == ("", [0.0, 1.0, 2.0, 3.0, 4.0])


def test_changes_count_from_the_first_row_of_the_reference() -> None:
    reference = {"12.5 N": {"frequency_hz": 10.0}, "15 N": {"frequency_hz": 20.58, "frequency_hz band": 2.5}}
    found = relative_changes(ROWS, reference, "frequency_hz")
    assert found[0] is None and found[1] == pytest.approx((0.0, 0.0, 0.0))
    assert found[2] == pytest.approx((100 * (41 / 38 - 1), 100 * (1.2058 / 1.1 - 1), 2.5))
    assert relative_changes(ROWS, reference, "amplitude_center") == [None] * 5


def test_the_references_of_the_case_are_whole_bins() -> None:
    tension = load_reference(CASES / "tension.csv")
    assert [34 * (1 + 0.01 * row["frequency_hz"]) for row in tension.values()] == pytest.approx([34, 41, 47], abs=0.01)
    size = load_reference(CASES / "size.csv")
    assert [41 * (1 + 0.01 * row["frequency_hz"]) for row in size.values()] == pytest.approx([41, 39, 36, 44], abs=0.01)
    assert load_reference(CASES / "position.csv") == {}


def test_a_bad_reference(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("# reference = r.csv\ncase, title\na, b\n")
    (tmp_path / "r.csv").write_text("case, frequency_hz\na, much\n")
    with pytest.raises(CaseError, match=r"r\.csv: row 2: .*give percentages as plain numbers"):
        load_reference(tmp_path / "t.csv")


def test_the_comparison_says_what_is_within_its_band() -> None:
    lines = format_comparison(CASES / "tension.csv", ROWS).splitlines()
    assert "15 N: frequency_hz +20.59 %, reference +20.58 %, within its band of 2.5 %" in lines
    assert "20 N: frequency_hz +47.06 %, reference +38.24 %, outside its band of 2.5 %" in lines
    assert "15 N: amplitude_center -20.00 %, reference -14.50 %" in lines


def test_the_printed_table_of_films() -> None:
    text = format_table(ROWS).splitlines()
    assert text[0].split("  ")[0] == "case" and "frequency (Hz)" in text[0] and "peak force" not in text[0]
    assert " 34  " in text[2]


@pytest.mark.parametrize("with_reference", [True, False])
def test_the_figure(tmp_path: Path, with_reference: bool) -> None:
    reference = load_reference(CASES / "tension.csv") if with_reference else {}
    plot_study(ROWS, {"tension.pull": "N"}, reference, tmp_path / "study.png")
    image = imread(tmp_path / "study.png")
    assert np.mean(image[..., :3].min(axis=-1) < 0.8) > 0.01
    assert (image.shape[0] > 800) == with_reference
