"""Wrong crease data through the command line: exit code 2 and a line for each mistake."""

import re

import pytest

from tests.robustness.test_bad_input import SPLINE, faults, run

CURVE = "angle (deg), moment (N mm)\n0, 0\n10, 1\n20, 2\n30, 3\n"
CURVE_MISTAKES = {
    "empty": ("", ["crease.data: .*crease.csv is empty; it must have two columns, angle and moment"]),
    "only a header": (
        "angle (deg), moment (N mm)\n",
        ["crease.data: has 0 rows; cubic .* needs at least 4$"],
    ),
    "three rows": (
        CURVE.replace("30, 3\n", ""),
        ['crease.data: has 3 rows; cubic .* at least 4; or write interpolation = "pchip"'],
    ),
    "unsorted": (
        CURVE.replace("20, 2", "5, 2"),
        [r"crease.data row 4: the angle decreases \(5 deg after 10 deg\); sort the rows"],
    ),
    "unsorted, falling": (
        "angle (deg), moment (N mm)\n30, 3\n10, 1\n20, 2\n0, 0\n",
        [r"crease.data row 4: the angle increases \(20 deg after 10 deg\); sort the rows"],
    ),
    "twice": (CURVE.replace("20, 2", "10, 2"), ["crease.data row 4: the angle 10 deg appears twice"]),
    "not a number": (
        CURVE.replace("10, 1", "10, nan").replace("30, 3", "30, -"),
        [r'crease.data row 3: "nan" is not a finite number; .* \(also in row 5\)'],
    ),
    "hole": (CURVE.replace("10, 1", "10,"), ["crease.data row 3: has 1 value; the header has 2 columns"]),
    "no header": (CURVE.split("\n", 1)[1], ["crease.data row 1: has no header; add a header, for example"]),
    "unknown column": (
        CURVE.replace("moment", "momnt"),
        ['crease.data row 1: unknown column "momnt .N mm."; did you mean `moment`'],
    ),
    "half a pair": (
        CURVE.replace("moment", "force").replace("N mm", "N"),
        ["crease.data row 1: columns are angle, force"],
    ),
    "wrong unit": (
        CURVE.replace("N mm", "N"),
        ["crease.data: the unit of the column moment is wrong: .* has the wrong unit; give a value in N m"],
    ),
    "degrees for radians": (
        CURVE.replace("(deg)", "(rad)"),
        ["crease.data row 5: 30 rad is more than one turn; for degrees, write the header"],
    ),
    "binary": ("\x00\x01", ["crease.data: .*crease.csv is not a text file"]),
}


@pytest.mark.parametrize("mistake", CURVE_MISTAKES)
def test_bad_crease_data(tmp_path, mistake):
    content, expected = CURVE_MISTAKES[mistake]
    (tmp_path / "crease.csv").write_text(content, encoding="utf-8")
    lines = faults(run(tmp_path, SPLINE), tmp_path / "case.toml")
    assert len(lines) == len(expected), lines
    for line, pattern in zip(lines, expected, strict=True):
        assert re.match(pattern, line), line


def test_missing_crease_data_and_a_long_list_of_bad_rows(tmp_path):
    lines = faults(run(tmp_path, SPLINE), tmp_path / "case.toml")
    assert lines == [f"crease.data: cannot read {tmp_path / 'crease.csv'}: no such file or directory"]
    (tmp_path / "crease.csv").write_text(CURVE + "x, y\n" * 1000)
    lines = faults(run(tmp_path, SPLINE), tmp_path / "case.toml")
    assert len(lines) == 1 and lines[0].endswith("(also in rows 7, 8, 9, 10, 11 and 994 more)")


def test_bad_lists_of_a_crease(tmp_path):
    def refused(angle: str, moment: str) -> list[str]:
        text = SPLINE.replace('data = "crease.csv"', f"angle = {angle}\nmoment = {moment}")
        return faults(run(tmp_path, text), tmp_path / "case.toml")

    assert refused("[0, 1, 0.5, 2]", "[0, 1, 2, 3]")[0].startswith(
        "crease.angle.2: the angle decreases (0.5 rad after 1 rad)"
    )
    assert refused("[0, 1, 2, 3]", "[0, 1, 2]") == [
        "crease.angle: has 4 angles and 3 moments; give one moment for each angle"
    ]
    assert refused("[0, 30, 60, 90]", "[0, 1, 2, 3]")[0].startswith(
        "crease.angle.3: 90 rad is more than one turn"
    )
