"""Tables of cases: which rows are read, how they are run, and the results."""

import csv
import math
import os
import sys
import types
from pathlib import Path

import pandas
import pytest
from click.testing import CliRunner

from fsm.case.loading.table import load_table, read_table
from fsm.cli.command_line import cli
from fsm.errors import CaseError, FsmError, NotConverged
from fsm.io.folder_lock import locked_folder
from fsm.results.summary_file import write_summary
from fsm.run.rows import RESOLVED
from fsm.run.run_case import Finished, compile_case
from fsm.run.table import failures, merge_tables, run_table
from fsm.run.table_files import flat_numbers, format_table, progress_line, write_extremes, write_summaries
from fsm.run.workers import JobOutcome
from fsm.views.plots.drawing import drawing
from fsm.views.plots.parameters import plot_parameters
from fsm.views.plots.study import varied_inputs
from tests.case_texts import strip

CASE = f"""
{strip("segments_per_panel = 2")}[contact]
stiffness = 1e5
[[drive]]
crease = 3
speed = "2 mm/s"
travel = "150 mm"
"""

TABLE = """# four conditions
case, strip.fold_angle, crease.stiffness, contact
80 low, 80 deg, 2 N mm,
80 high, 80 deg, 9e-3,
83 low, "83 deg", 2 N mm, none

base,,,
"""


def write(folder: Path, table: str = TABLE, case: str = CASE, base: str = "case.toml") -> Path:
    (folder / base).write_text(case, encoding="utf-8")
    path = folder / "table.csv"
    path.write_text(table, encoding="utf-8")
    return path


def faults(path: Path, *overrides: str) -> list[str]:
    with pytest.raises(CaseError) as caught:
        load_table(path, overrides)
    assert caught.value.source == str(path)
    return [str(fault) for fault in caught.value.faults]


def test_rows(tmp_path):
    cases = load_table(write(tmp_path))
    assert [case.name for case in cases] == ["80 low", "80 high", "83 low", "base"]
    assert cases[0].overrides == {"strip.fold_angle": "80 deg", "crease.stiffness": "2 N mm"}
    assert [case.loaded.case.crease.stiffness for case in cases] == [2e-3, 9e-3, 2e-3, 9e-3]
    assert [case.loaded.case.strip.fold_angle for case in cases[2:]] == [math.radians(83), math.radians(80)]
    assert [case.loaded.case.contact is None for case in cases] == [False, False, True, False]
    assert all(case.loaded.path == tmp_path / "case.toml" for case in cases)


def test_units_in_the_second_row_and_decimal_commas(tmp_path: Path) -> None:
    table = "case;strip.fold_angle;strip.thickness;contact\nunits;[deg];mm;\na;82,5;0,3;none\nb;1,4 rad;;\n"
    cases = load_table(write(tmp_path, table))
    assert [case.name for case in cases] == ["a", "b"]
    assert [case.loaded.case.strip.fold_angle for case in cases] == pytest.approx([math.radians(82.5), 1.4])
    assert [case.loaded.case.strip.thickness for case in cases] == pytest.approx([3e-4, 3e-4])
    assert cases[0].overrides["strip.thickness"] == "0.3 mm"
    with pytest.raises(CaseError, match='"1,200" has a comma'):  # a decimal comma, or thousands
        load_table(write(tmp_path, "case;material.young\nc;1,200\n"))


def test_another_base_and_overrides_for_all(tmp_path):
    table = "# base = other.toml\nstrip.fold_angle;drive.0.direction\n80 deg;[0, 0, 1]\n83 deg;\n"
    cases = load_table(write(tmp_path, table, base="other.toml"), ["strip.panels=4", "drive.0.crease=2"])
    assert [case.name for case in cases] == ["fold_angle-80 deg_direction-_0_ 0_ 1", "fold_angle-83 deg"]
    assert [case.loaded.case.strip.panels for case in cases] == [4, 4]


def test_all_faults_of_all_rows(tmp_path):
    table = "case,strip.thickness,drive.0.crease\na,-1,\nb,,9\nc,1 kg,0\n"
    assert faults(write(tmp_path, table, CASE.replace("young = 3e9", "young = -3"))) == [
        f"base {tmp_path / 'case.toml'}: material.young: must be greater than 0; it is -3 Pa",
        "row 2: strip.thickness: must be greater than 0; it is -1 m",
        "row 3: drive.0.crease: must be a crease number from 1 to 5, with 6 panels; it is 9",
        'row 4: strip.thickness: "1 kg" has the wrong unit; give a value in m',
    ]


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ("", "has no rows"),
        ("case,strip.length\n", "has no rows"),
        ("case,strip.lenght\na,1\n", "column strip.lenght: unknown key; did you mean `strip.length`?"),
        ("case,strip.length,strip.length\na,1,2\n", "column strip.length: appears twice in the header"),
        ("case,\na,1\n", "column 2: has no name"),
        ("case,strip.length\na,1,2\n", "row 2: has 3 cells; the header has 2"),
        ("case,strip.length\na,1\nA,2\n", 'row 3: the name "A" is already in row 2'),
        ("strip.length\n1\n1\n", "row 3: the same values are already in row 2"),
        ("# base = nowhere.toml\ncase\na\n", "base "),
    ],
)
def test_bad_tables(tmp_path, table, expected):
    assert faults(write(tmp_path, table))[0].startswith(expected)


def test_bad_overrides_of_a_table(tmp_path):
    assert faults(write(tmp_path), "strip.lenght=1") == ["--set strip.lenght: unknown key; did you mean `strip.length`?"]
    assert faults(write(tmp_path), "strip") == [
        "--set strip: write the override as path=value, for example strip.thickness=0.0003"
    ]


def test_names_cannot_leave_the_folder(tmp_path):
    cases = load_table(write(tmp_path, 'case,title\n../../etc/x,1\n..,"b"\n', CASE), ["title=t"])
    assert [case.name for case in cases] == ["etc_x", "base"]


def test_a_bad_table_through_the_command_line(tmp_path):
    path = write(tmp_path, "case,strip.thickness\na,-1\n")
    result = CliRunner().invoke(cli, ["table", str(path), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert result.stderr == f"{path}: row 2: strip.thickness: must be greater than 0; it is -1 m\n"
    assert not (tmp_path / "out").exists()


# -- running -------------------------------------------------------------------------------------------------


@pytest.fixture
def fake_run(monkeypatch):
    """Stand-in for the solver and the processes: it stores its calls."""
    calls: list[tuple[str, bool]] = []

    def run_in_locked_folder(loaded, out, *, progress, resume, figures):
        name = f"row {len(calls)}" if out is None else out.name
        calls.append((name, resume))
        if figures:
            (out / "force.png").touch()
        if name == "83 low":
            raise NotConverged("panel 2 segment 1: no equilibrium at 27 mm\ntry more segments")
        summary = {
            "peak_force": 1.992,
            "peak_travel": 0.0271,
            "peak_kind": "quasi-static",
            "stages": [
                {"name": "initial deformation", "travel": 0.0, "force": 0.1},
                {"name": "contact", "travel": 0.013},
            ],
            "warnings": ["coarse mesh"],
            "steps": 812,
            "wall_time_s": 3.5,
            "touches": [{"pair": "a"}],
        }
        if out is not None:
            write_summary(summary, out / "summary.json")
        return Finished(summary, None, [])  # type: ignore[arg-type]

    def run_here(work, jobs, workers, copies, on):
        for index, job in enumerate(jobs):
            try:
                yield JobOutcome(index, value=work(job))
            except FsmError as error:
                yield JobOutcome(index, error=tuple(str(error).splitlines()), exit_code=error.exit_code)

    module = types.ModuleType("fsm.run.run_case")
    module.run_in_locked_folder = run_in_locked_folder  # type: ignore[attr-defined]
    module.compile_case = compile_case  # type: ignore[attr-defined]
    ahead = types.ModuleType("fsm.run.warm_up")
    ahead.compile_ahead = lambda kinds, *_: calls.append(("compile ahead", *kinds))  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "fsm.run.warm_up", ahead)
    monkeypatch.setitem(sys.modules, "fsm.run.run_case", module)
    monkeypatch.setattr("fsm.run.rows.run_jobs", run_here)
    monkeypatch.setattr("fsm.run.table._plot_overlay", lambda *_: None)
    return calls


def test_one_failure_loses_no_other(tmp_path, fake_run, capsys):
    rows = run_table(write(tmp_path), tmp_path / "out")
    assert fake_run == [
        ("compile ahead", "planar", "statics in one kernel, planar"),
        ("80 low", False),
        ("80 high", False),
        ("83 low", False),
        ("base", False),
    ]
    assert [row["case"] for row in rows] == ["80 low", "80 high", "83 low", "base"]
    assert rows[0]["stage_contact_travel"] == 0.013
    assert rows[0]["crease.stiffness"] == 2e-3
    assert rows[0]["warnings"] == ["coarse mesh"]
    assert "touches" not in rows[0]
    assert rows[2]["error"] == "panel 2 segment 1: no equilibrium at 27 mm\ntry more segments"
    assert failures(rows) == 3
    assert failures(rows[:2]) == 0
    assert capsys.readouterr().err.splitlines()[1] == "[2/4] 80 high: peak 1.992 N at 27.1 mm, 3.5 s, 1 warning"
    with (tmp_path / "out" / "summary.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [row["peak_force (N)"] for row in table] == ["1.992", "1.992", "", "1.992"]
    assert table[0]["stage_initial_deformation_travel (m)"] == "0.0"
    assert list(table[0])[:9] == [
        "case", "strip.fold_angle (rad)", "crease.stiffness (N m/rad)", "contact", "peak_force (N)", "peak_travel (m)",
        "exit_code", "warnings", "error",
    ]  # fmt: skip
    angles = [float(row["strip.fold_angle (rad)"]) for row in table]
    assert angles == [math.radians(80), math.radians(80), math.radians(83), math.radians(80)]  # the last of the base case
    assert [row["contact"] for row in table] == ["", "", "none", ""]
    assert [row["warnings"] for row in table] == ["coarse mesh", "coarse mesh", "", "coarse mesh"]
    assert table[2]["error"] == "panel 2 segment 1: no equilibrium at 27 mm | try more segments"
    assert [row["exit_code"] for row in table] == ["0", "0", "3", "0"]
    assert (tmp_path / "out" / "80 low" / RESOLVED).read_text() == load_table(tmp_path / "table.csv")[0].loaded.text


def test_resume_runs_only_what_is_not_there_or_has_changed(tmp_path, fake_run):
    path = write(tmp_path)
    first = list(run_table(path, tmp_path / "out", progress=False))
    fake_run.clear()
    again = list(run_table(path, tmp_path / "out", resume=True, progress=False))
    assert fake_run == [("compile ahead", "planar", "statics in one kernel, planar"), ("83 low", False)]
    assert again == first
    fake_run.clear()
    path.write_text(TABLE.replace("80 high, 80 deg, 9e-3", "80 high, 80 deg, 8e-3"))
    run_table(path, tmp_path / "out", resume=True, progress=False)
    assert fake_run == [("compile ahead", "planar", "statics in one kernel, planar"), ("80 high", False), ("83 low", False)]
    fake_run.clear()
    (tmp_path / "out" / "80 low" / "summary.json").unlink()  # as after an interruption
    run_table(path, tmp_path / "out", resume=True, progress=False)
    assert fake_run == [("compile ahead", "planar", "statics in one kernel, planar"), ("80 low", True), ("83 low", False)]
    fake_run.clear()
    run_table(path, tmp_path / "out", progress=False)
    assert len(fake_run) == 5


def test_stale_results_of_a_row_that_fails_are_not_shown(tmp_path, fake_run):
    path = write(tmp_path)
    folder = tmp_path / "out" / "83 low"
    folder.mkdir(parents=True)
    (folder / "summary.json").write_text('{"peak_force": 99}')
    rows = run_table(path, tmp_path / "out", progress=False)
    assert "peak_force" not in rows[2]


def test_a_row_whose_folder_cannot_be_made_fails_alone(tmp_path, fake_run):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "80 low").write_text("a file")
    rows = run_table(write(tmp_path), tmp_path / "out", progress=False)
    assert [bool(row.get("error")) for row in rows] == [True, False, True, False]
    assert "80 low: the folder cannot be created" in rows[0]["error"]
    assert (tmp_path / "out" / "summary.csv").is_file()


def test_rows_without_folders_are_resumed_from_the_store(tmp_path, fake_run):
    path = write(tmp_path)
    first = run_table(path, tmp_path / "out", progress=False, keep="none")
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["rows.db", "study.parquet", "summary.csv"]
    assert first[0]["peak_force"] == 1.992 and len(fake_run) == 5
    fake_run.clear()
    path.write_text(TABLE.replace("80 high, 80 deg, 9e-3", "80 high, 80 deg, 8e-3"))
    again = run_table(path, tmp_path / "out", resume=True, progress=False, keep="none")
    assert [name for name, _ in fake_run[1:]] == ["row 1"]  # the changed row; no row failed
    assert [row["crease.stiffness"] for row in again] == [2e-3, 8e-3, 2e-3, 9e-3]
    table = pandas.read_parquet(tmp_path / "out" / "study.parquet")
    assert table["error"].tolist() == [""] * 4  # a column of texts also without an error
    assert list(table.columns) == list(pandas.read_csv(tmp_path / "out" / "summary.csv").columns)
    assert table["crease.stiffness (N m/rad)"].tolist() == [2e-3, 8e-3, 2e-3, 9e-3]
    assert table.dtypes["steps"] == "int64" and table["warnings"][0] == "coarse mesh"


def test_parts_of_a_table_are_merged(tmp_path, fake_run):
    """On machines without a scheduler."""
    path, places = write(tmp_path), [tmp_path / "one", tmp_path / "two"]
    whole = run_table(path, tmp_path / "out", progress=False, keep="none")
    for number, place in enumerate(places, 1):
        run_table(path, place, progress=False, keep="none", part=(number, 2))
    command = [cli, ["table", "--merge", *map(str, places), "--out", str(tmp_path / "all")]]
    assert CliRunner().invoke(*command).exit_code == 0
    assert (tmp_path / "all" / "summary.csv").read_text() == (tmp_path / "out" / "summary.csv").read_text()
    rows, missing = merge_tables(places[:1], tmp_path / "half")
    assert [row["case"] for row in rows] == ["80 low", "83 low"] and missing == 2
    assert list(rows) == list(whole[::2])
    with pytest.raises(CaseError, match="is a part itself; give another folder"):
        merge_tables(places, places[0])
    path.write_text(TABLE.replace("80 low, 80 deg", "80 low, 81 deg"))
    run_table(path, places[1], progress=False, keep="none")
    with pytest.raises(CaseError, match="row 1 is '80 low', in another part another case"):
        merge_tables(places, tmp_path / "all")
    with pytest.raises(CaseError, match="this is no folder of `fsm table`"):
        merge_tables([tmp_path], tmp_path / "all")


def test_a_table_that_is_too_long_is_run_in_parts(tmp_path):
    path = write(tmp_path, "case,strip.thickness\n" + "".join(f"{k},3e-4\n" for k in range(7)))
    text = "has 7 rows; a run takes at most 3: run it in parts, --part 1/3 to 3/3"
    with pytest.raises(CaseError, match=text):
        read_table(path, most=3)
    assert [case.name for case in read_table(path, part=(3, 3), most=3).cases] == ["2", "5"]
    with pytest.raises(CaseError, match="has 4 rows; a run takes at most 3: run it in parts, --part 1/3 to 3/3"):
        read_table(path, part=(1, 2), most=3)
    done = CliRunner().invoke(cli, ["table", str(path), "--out", str(tmp_path / "out"), "--part", "4/3"])
    assert done.exit_code == 2
    assert done.stderr == '--part: "4/3" is no part of a table; write K/N with K from 1 to N, for example 3/10\n'


def test_a_table_of_a_million_rows_is_counted_and_not_read(tmp_path):
    path = write(tmp_path, "case,strip.thickness\n" + "".join(f"row {k},0.0003\n" for k in range(10**6)))
    assert path.stat().st_size > 16 * 2**20  # a case file has at most 16 MB
    text = "has 1,000,000 rows; a run takes at most 200,000: run it in parts, --part 1/5 to 5/5"
    with pytest.raises(CaseError, match=text):
        run_table(path, tmp_path / "out")


WRONG_WORDS = {
    ("--part", "1/2", "--merge"): "fsm table: --merge joins parts that have run; leave --part out",
    ("b.csv",): "fsm table: 2 tables are given; give one, or --merge for folders of parts",
    ("--figures", "some"): "fsm table: invalid value for '--figures': 'some' is not one of 'none', 'first', 'all'",
    ("--keep",): "fsm table: option '--keep' requires an argument",
    ("--fast",): "fsm table: no such option '--fast'",
}


@pytest.mark.parametrize("words", WRONG_WORDS)
def test_a_wrong_word_of_the_command_line_is_one_line(words):
    done = CliRunner().invoke(cli, ["table", "a.csv", "--out", "out", *words], prog_name="fsm")
    assert (done.exit_code, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert done.stderr.startswith(WRONG_WORDS[words])
    assert done.stderr.endswith("; `fsm table --help` lists arguments and options\n")


@pytest.mark.parametrize("name", ["summary.csv", "Overlay.png", "study.png", "extremes.csv"])
def test_names_of_the_files_of_a_table_are_no_names_of_rows(tmp_path, name):
    with pytest.raises(CaseError, match="the table writes a file with the name"):
        load_table(write(tmp_path, TABLE.replace("80 low", name)))


def test_long_names_fit_a_folder(tmp_path):
    row = load_table(write(tmp_path, TABLE.replace("80 low", "\u6298" * 150)))[0]
    assert row.name == "\u6298" * 66  # 198 bytes


def test_a_summary_that_was_changed_is_not_taken_for_a_result(tmp_path, fake_run):
    path = write(tmp_path)
    run_table(path, tmp_path / "out", progress=False)
    fake_run.clear()
    summary = tmp_path / "out" / "80 low" / "summary.json"
    summary.write_text(summary.read_text().replace("1.992", "1.993"))
    rows = run_table(path, tmp_path / "out", resume=True, progress=False)
    assert ("80 low", True) in fake_run
    assert rows[0]["peak_force"] == 1.992


def test_a_second_table_into_the_same_folder_is_refused(tmp_path, fake_run):
    with locked_folder(tmp_path / "out"):
        result = CliRunner().invoke(cli, ["table", str(write(tmp_path)), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert f"process {os.getpid()} of" in result.stderr
    assert not fake_run


def test_the_command_reports_failures_at_the_end(tmp_path, fake_run):
    result = CliRunner().invoke(cli, ["table", str(write(tmp_path)), "--out", str(tmp_path / "out")])
    assert result.exit_code == 3
    assert result.stderr.splitlines()[-1] == "1 of 4 cases failed"
    assert "83 low: panel 2 segment 1: no equilibrium at 27 mm" in result.stdout


@pytest.mark.parametrize(
    ("figures", "drawn"), [("none", []), ("first", ["80 low"]), ("all", ["80 high", "80 low", "83 low", "base"])]
)
def test_figures_of_no_row_of_the_first_or_of_all(tmp_path, fake_run, figures, drawn):
    done = CliRunner().invoke(cli, ["table", str(write(tmp_path)), "--out", str(tmp_path / "out"), "--figures", figures])
    assert done.exit_code == 3
    assert sorted(path.parent.name for path in (tmp_path / "out").glob("*/force.png")) == drawn
    assert (tmp_path / "out" / "peaks.png").exists() == (figures != "none")


def test_the_peak_over_each_parameter(tmp_path):
    """A row without a number of a parameter, and one without a peak, are left out."""
    rows = [
        {"case": "a", "peak_force": 1.0, "strip.thickness": 2e-4, "crease.stiffness": 5e-3, "contact": "none"},
        {"case": "b", "peak_force": 2.0, "strip.thickness": 3e-4, "crease.stiffness": 5e-3, "contact": ""},
        {"case": "c", "peak_force": 3.0, "strip.thickness": "none", "crease.stiffness": 5e-3},
        {"case": "d", "error": "no equilibrium", "strip.thickness": 4e-4},
    ]
    units = {"strip.thickness": "m", "crease.stiffness": "N m/rad", "contact": ""}
    assert varied_inputs(rows[:3], units) == [("strip.thickness (mm)", [pytest.approx(0.2), pytest.approx(0.3), None])]
    with drawing(suffix=".svg"):
        plot_parameters(rows, units, tmp_path / "peaks.svg")
    text = (tmp_path / "peaks.svg").read_text()
    assert "strip.thickness (mm)" in text and "peak force (N)" in text and "crease.stiffness" not in text


def test_printed_table():
    """Significant digits in the unit for the largest number of a column: 0.0006 N was all that was left of a force."""
    rows = [
        {
            "case": "80 low",
            "peak_force": 1.9923e-4,
            "peak_travel": 0.02712,
            "stage_initial_deformation_travel": 0.0,
            "stage_contact_travel": 0.01301,
            "steps": 812,
        },
        {"case": "turned", "drive": "lid (turn)", "peak_force": 2.0, "peak_travel": 40.0, "steps": 7},
        {"case": "a", "error": "no equilibrium", "exit_code": 3, "wall_time_s": 12.345, "warnings": []},
    ]
    assert format_table(rows).splitlines() == [
        "case    peak force (mN)  at travel (mm)  contact from (mm)  peak moment (N m)  at turn (turns)  steps  "
        "run time (s)  warnings",
        "-" * 125,
        "80 low           0.1992           27.12              13.01                  -                -    812             "
        "-         -",
        "turned                -               -                  -                  2            6.366      7             "
        "-         -",
        "a                     -               -                  -                  -                -      -         "
        "12.35         0",
        "a: no equilibrium",
    ]


LOADED = {
    "peak_force": 0.0, "peak_travel": 0.0, "stages": [], "warnings": ["one; two", "three"], "steps": 5, "wall_time_s": 1.5,
    "loads": [{"name": "tip", "size": 2.0, "displacement": 4e-3}, {"name": "lid, moment", "size": 1.0, "displacement": 0.5}],
    "probe_displacement": {"corner": [0.0, 0.0, 1e-3]}, "deploy": {"warnings": ["x"], "steps": 3},
    "channels": {"point.tip.z": {"unit": "m", "min": 0.0, "min_time": 0.0, "max": 4e-3, "max_time": 1.0}},
}  # fmt: skip


def test_a_run_without_a_drive_has_displacements_of_loads_in_place_of_a_peak(tmp_path):
    """The table had "peak 0.0000 N at 0.00 mm", and extremes of all channels in hundreds of columns."""
    row = {"case": "a", **flat_numbers(LOADED)}
    write_summaries(tmp_path, [row], {})
    with (tmp_path / "summary.csv").open() as file:
        (found,) = csv.DictReader(file)
    assert list(found)[:8] == [
        "case", "tip (N)", "displacement of tip (m)", "lid, moment (N m)", "rotation of lid, moment (rad)", "exit_code",
        "warnings", "error",
    ]  # fmt: skip
    assert found["warnings"] == "one; two | three"
    assert found["probe_displacement_corner z (m)"] == "0.001" and found["deploy_steps"] == "3"
    assert not any("peak" in name or "point.tip" in name for name in found)
    assert progress_line(row) == "a: tip 2 N, displacement 4 mm, 1.5 s, 2 warnings"
    assert "peak" not in format_table([row]) and "displacement (mm)" in format_table([row])
    write_extremes(tmp_path, [row])
    with (tmp_path / "extremes.csv").open() as file:
        (entry,) = csv.DictReader(file)
    assert entry == {"case": "a", "channel": "point.tip.z", "unit": "m", "min": "0.0", "min_time (s)": "0.0", "max": "0.004",
                     "max_time (s)": "1.0"}  # fmt: skip
    write_extremes(tmp_path, [{"case": "a"}])
    assert not (tmp_path / "extremes.csv").exists()
