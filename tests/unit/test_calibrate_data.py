"""Measured tables: units in headings, a TOML file beside them, and mistakes reported with their rows."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fsm.calibrate.branches import split_sweeps
from fsm.calibrate.data import MeasuredTable, read_table
from fsm.errors import CaseError

KINDS = {
    "angle": "angle", "moment": "moment", "force": "force", "lever_arm": "length", "press_time": "time",
    "opening": "number", "repeat": "number", "branch": "branch",
}  # fmt: skip
UP = np.arange(0.0, 91.0, 5.0)


def read(tmp_path: Path, text: str, beside: str = "", required: tuple[str, ...] = ("angle", "moment")) -> MeasuredTable:
    file = tmp_path / "test.csv"
    file.write_text(text)
    if beside:
        file.with_suffix(".toml").write_text(beside)
    return read_table(file, KINDS, required)


@pytest.mark.parametrize(
    "text",
    [
        "angle [deg], moment [N mm]\n0, 0\n90, 1.5\n",
        "# bench 3\n\nmoment (mN m); angle (deg)\n0; 0\n1,5; 90\n",
        "angle_deg\tmoment_N_mm\n0\t0\n90\t1.5\n",
        "Angle[deg] Moment[Nmm]\n".replace("Nmm", "N mm") + "0 0\n90 1.5\n",
        '"angle [deg]","moment [N mm]"\n"0","0"\n"90","1.5"\n',
    ],
    ids=["commas", "semicolons and decimal commas", "tabs and suffixes", "blanks", "quotes"],
)
def test_units_and_separators(tmp_path: Path, text: str) -> None:
    table = read(tmp_path, text)
    np.testing.assert_allclose(table.columns["angle"], [0.0, math.pi / 2])
    np.testing.assert_allclose(table.columns["moment"], [0.0, 1.5e-3])
    assert table.rows[-1] == len(text.splitlines())


def test_the_file_beside(tmp_path: Path) -> None:
    beside = """
columns = ["angle", "moment"]
units = { angle = "deg", moment = "mN m" }
values = { press_time = "1 h", opening = 2, branch = "unloading" }
"""
    table = read(tmp_path, "0 0\n90 1.5\n", beside)
    np.testing.assert_allclose(table.columns["moment"], [0.0, 1.5e-3])
    assert table.columns["press_time"].tolist() == [3600.0, 3600.0]
    assert table.columns["opening"].tolist() == [2.0, 2.0]
    assert table.columns["branch"].tolist() == [-1.0, -1.0]


def test_columns_that_nobody_asks_for_are_told_of(tmp_path: Path) -> None:
    table = read(tmp_path, "angle [deg], moment [N mm], remark, branch\n0, 0, wet, loading\n5, 1, -, unloading\n")
    assert table.notes == ("columns not read: remark",)
    assert table.columns["branch"].tolist() == [1.0, -1.0]


FAULTS = {
    "no unit": ("angle, moment [N mm]\n0, 0\n", "", "column angle: has no unit; write `angle \\[deg\\]`"),
    "wrong unit": ("angle [N], moment [N mm]\n0, 0\n", "", 'column angle: "1 N" has the wrong unit'),
    "unknown unit": ("angle [dge], moment [N mm]\n0, 0\n", "", "unknown unit 'dge'; did you mean `deg`"),
    "misspelt": ("angle [deg], momen [N mm]\n0, 0\n", "", "row 1: no column moment .* is it `momen`"),
    "twice": ("angle [deg], angle [rad], moment [N m]\n0, 0, 0\n", "", "column angle is given twice"),
    "nan": ("angle [deg], moment [N mm]\n0, 0\n5, nan\n", "", 'row 3: moment is "nan", not a finite number'),
    "infinite": ("angle [deg], moment [N mm]\n0, 0\n5, inf\n", "", 'row 3: moment is "inf", not a finite number'),
    "empty cell": ("angle [deg], moment [N mm]\n0, 0\n5,\n", "", "row 3: moment is empty; fill it in or delete"),
    "unit in a cell": ("angle [deg], moment [N mm]\n0, 0\n0.1 rad, 1\n", "", 'row 3: angle is "0.1 rad"; a column has one'),
    "too many": ("angle [deg], moment [N mm]\n0, 0, 3\n", "", "row 2: has 3 values, but there are 2 columns"),
    "no rows": ("angle [deg], moment [N mm]\n", "", "has headings but no rows"),
    "no headings": ("0, 0\n1, 1\n", "", "row 1: no headings; write `angle \\[deg\\], moment \\[N mm\\]` above"),
    "headings without a name": ("@ @\n0 0\n", "", "row 1: no headings; required columns: angle, moment"),
    "empty headings": ('"", ""\n0, 0\n', "", "row 1: no headings; write `angle"),
    "empty headings, named beside": ('"", ""\n0, 0\n', 'columns = ["angle", "moment"]\n', "row 1: has 0 values, but"),
    "unnamed columns": ("0, 0, 1\n", 'columns = ["angle", "moment"]\n', "has 3 values, but `columns` in test.toml names 2"),
    "bad word": ("angle [deg], moment [N mm], branch\n0, 0, up\n", "", 'branch is "up"; write loading or unloading'),
    "empty": ("# nothing\n", "", "is empty; required columns: angle, moment"),
    "unknown key": ("angle [deg], moment [N mm]\n0, 0\n", "unit = 1\n", "unit: unknown key; did you mean `units`"),
    "no unit beside": ("angle [deg], moment [N mm]\n0, 0\n", "values = { press_time = 3 }\n", "3 has no unit; .*\"3 s\""),
    "wrong unit beside": ("angle [deg], moment [N mm]\n0, 0\n", 'units = { angle = "N" }\n', "units.angle: .* wrong unit"),
    "not TOML": ("angle [deg], moment [N mm]\n0, 0\n", "values = 1 h\n", "put text and numbers with a unit in quotes"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_faults(tmp_path: Path, name: str) -> None:
    text, beside, message = FAULTS[name]
    with pytest.raises(CaseError, match=message) as caught:
        read(tmp_path, text, beside)
    assert "test." in str(caught.value)  # every line names the file


def test_many_bad_rows_are_shortened(tmp_path: Path) -> None:
    with pytest.raises(CaseError) as caught:
        read(tmp_path, "angle [deg], moment [N mm]\n" + "x, 1\n" * 1000)
    (line,) = caught.value.lines()
    assert 'row 2: angle is "x", not a finite number' in line
    assert line.endswith("(also in rows 3, 4, 5, 6, 7 and 994 more)")


def test_all_faults_of_a_file_at_once(tmp_path: Path) -> None:
    with pytest.raises(CaseError) as caught:
        read(tmp_path, "angle, torque [kg], moment [N mm]\n0, 1, 2\nx, 1, 2\n1, 2\n3, 2, y\n")
    told = " / ".join(caught.value.lines())
    for words in ("column moment is given twice", "column angle: has no unit", "column moment: ", 'row 3: angle is "x"'):
        assert words in told, told


@pytest.mark.parametrize(
    "text",
    [
        "angle, moment\ndeg, N mm\n0, 0\n90, 1\n",
        "angle;moment\n[°];[Nmm]\n0;0\n90;1\n",
        "Winkel [°];Drehmoment [Nmm]\n0,0;0,0\n90,0;1,0\n",
        "Faltwinkel in deg;Biegemoment / mNm\n0;0\n90;1\n",
        "Winkel_deg\tMoment_N_mm\n0\t0\n90\t1\n",
        "Winkel\tMoment\tBemerkung\ndeg\tNmm\t-\n0\t0\t1\n90\t1\t1\n",
    ],
)
def test_headings_as_testing_machines_write_them(text: str, tmp_path: Path) -> None:
    table = read(tmp_path, text)
    np.testing.assert_allclose(table.columns["angle"], [0.0, np.pi / 2])
    np.testing.assert_allclose(table.columns["moment"], [0.0, 1e-3])


def test_a_million_rows_are_read_at_once(tmp_path: Path) -> None:
    """Read by the reader of NumPy, which agrees with the checking reader."""
    file = tmp_path / "test.csv"
    values = np.random.default_rng(0).normal(size=(20_000, 2)).round(6)
    np.savetxt(file, values, fmt="%.6f", delimiter=",", header="angle [rad],moment [N m]", comments="")
    fast = read_table(file, KINDS, ("angle", "moment"))
    np.testing.assert_array_equal(fast.columns["angle"], values[:, 0])
    slow = "angle [rad];moment [N m]\n" + "".join(f"{a};{m}\n".replace(".", ",") for a, m in values[:50])
    file.write_text(slow)
    np.testing.assert_array_equal(read_table(file, KINDS, ("angle", "moment")).columns["moment"], values[:50, 1])


# contents of a table ----------------------------------------------------------------------------------------------


def table_of(**columns: np.ndarray) -> MeasuredTable:
    count = len(columns["angle"])
    return MeasuredTable({k: np.asarray(v, dtype=float) for k, v in columns.items()}, np.arange(2, count + 2), "test.csv")


def test_one_way_is_one_curve_whichever_way_it_was_measured() -> None:
    for angle in (UP, UP[::-1]):
        (sweep,) = split_sweeps(table_of(angle=angle, moment=angle))
        assert len(sweep.loading) == len(UP)
        assert not len(sweep.unloading)


def test_a_loop_is_taken_apart_where_the_angle_turns() -> None:
    angle = np.concatenate([UP, UP[-2::-1]])
    jitter = 0.2 * np.random.default_rng(1).uniform(-1, 1, len(angle))
    (sweep,) = split_sweeps(table_of(angle=angle + jitter, moment=angle))
    assert sweep.loading.tolist() == list(range(19))
    assert sweep.unloading.tolist() == list(range(18, 37))


def test_a_loop_that_begins_with_closing() -> None:
    angle = np.concatenate([UP[::-1], UP[1:]])
    (sweep,) = split_sweeps(table_of(angle=angle, moment=angle))
    assert sweep.unloading.tolist() == list(range(19))
    assert sweep.loading.tolist() == list(range(18, 37))


def test_cycles_are_numbered_or_refused() -> None:
    loop = np.concatenate([UP, UP[-2::-1]])
    angle, opening = np.concatenate([loop, loop]), np.repeat([1, 2], len(loop))
    with pytest.raises(CaseError, match=r"row 38: the angle reverses 3 times .*no column identifies .*`opening`.*`repeat`"):
        split_sweeps(table_of(angle=angle, moment=angle))
    first, second = split_sweeps(table_of(angle=angle, moment=angle, opening=opening))
    assert (first.opening, second.opening) == (1, 2)
    assert second.loading[0] == len(loop)


def test_outliers_and_spikes_are_flagged_and_nothing_else() -> None:
    rng = np.random.default_rng(3)
    angle = np.concatenate([np.linspace(0, 90, 60), np.linspace(90, 0, 60)[1:]])
    moment = np.sin(np.radians(angle)) + 0.005 * rng.normal(size=len(angle))
    assert not split_sweeps(table_of(angle=angle, moment=moment))[0].flags
    moment[20] += 0.2
    moment[61] -= 0.3  # two rows after the turn
    (sweep,) = split_sweeps(table_of(angle=angle, moment=moment))
    assert [(flag.row, flag.kind) for flag in sweep.flags] == [(22, "outlier"), (63, "reversal spike")]
    back = angle.copy()
    back[30] -= 3.0
    (sweep,) = split_sweeps(table_of(angle=back, moment=np.sin(np.radians(back))))
    assert [(flag.row, flag.kind) for flag in sweep.flags] == [(32, "reversal")]
