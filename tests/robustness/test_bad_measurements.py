"""Measured data with mistakes: the program prints one clear line for every mistake, ends with exit code 2, and writes
nothing."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from fsm.calibrate.report import Calibration, Options, write_calibration
from fsm.cli.command_line import cli

UP = [(a, 2.0 * math.sin(math.radians(a))) for a in range(0, 91, 5)]
DOWN = [(a, m - 0.2 * (1.0 - (a / 90.0) ** 2)) for a, m in UP[-2::-1]]
CREASE = "angle [deg], moment [N mm]\n"
BEND = "force [N], deflection [mm], length [mm]\n"
RELAX = "time [s], angle [deg]\n"


def rows(values: list[tuple[float, ...]]) -> str:
    return "".join(", ".join(f"{value:g}" for value in row) + "\n" for row in values)


def bent(deflection: float, length: float = 80.0, longer: float = 0.0, same: bool = False) -> str:
    """Three rows of a cantilever test, N and mm."""
    steps = (1, 2, 3)
    return BEND + rows([(0.1 * k, deflection * (1 if same else k), length + longer * k) for k in steps])


def calibrate(tmp_path: Path, kind: str, text: str, *options: str) -> Result:
    (tmp_path / "data.csv").write_text(text)
    arguments = ["calibrate", kind, str(tmp_path / "data.csv"), "--out", str(tmp_path / "out"), *options]
    return CliRunner().invoke(cli, arguments)


BAD = {
    "one row": ("crease", CREASE + "10, 1\n", 'curve has 1 row of 1 different angles; the fit "smooth" needs 5'),
    "one angle": ("crease", CREASE + "30, 1\n" * 20, "angle is 30 deg in all 20 rows; a curve needs different angles"),
    "cycles": ("crease", CREASE + rows(UP + DOWN + UP[1:] + DOWN), "the angle reverses 3 times (at rows 20, 38, 56)"),
    "cycles in an opening": (
        "crease",
        "angle [deg], moment [N mm], opening\n" + rows([(*row, 1) for row in UP + DOWN + UP]),
        "reverses 2 times (at rows 20, 38) within one opening",
    ),
    "units of another kind": ("crease", "angle [deg], moment [N]\n" + rows(UP), 'column moment: "1 N" has the wrong unit'),
    "units in cells": ("crease", CREASE + rows(UP[:6]) + "0.6 rad, 1\n", 'row 8: angle is "0.6 rad"; a column has one unit'),
    "degrees for radians": ("crease", "angle [rad], moment [N mm]\n" + rows(UP), "row 4: angle is 10 rad, more than a turn"),
    "no unit": ("crease", "angle, moment [N mm]\n" + rows(UP), "column angle: has no unit; write `angle [deg]`"),
    "negative lever arm": (
        "crease",
        "angle [deg], force [N], lever_arm [mm]\n" + rows([(a, m, -35) for a, m in UP]),
        "row 2: lever_arm is -35 mm; it must be greater than 0; give the sign to the force (and 18 more rows like this)",
    ),
    "no moment": ("crease", CREASE + "".join(f"{a}, 0\n" for a in range(20)), "the moment is 0 in all rows"),
    "no lever arm": ("crease", "angle [deg], force [N]\n" + rows(UP), "no column moment, and no lever_arm either"),
    "moment and force": (
        "crease",
        "angle [deg], moment [N mm], force [N]\n" + rows([(a, m, m) for a, m in UP]),
        "has both moment and force, which may disagree; delete one",
    ),
    "not a number": ("crease", CREASE + rows(UP[:5]) + "23, nan\n" + rows(UP[5:]), 'row 7: moment is "nan", not a finite'),
    "opening 0": (
        "crease",
        "angle [deg], moment [N mm], opening\n" + rows([(*row, 0) for row in UP]),
        "row 2: opening is 0; it must be a whole number of at least 1",
    ),
    "unloading only": (
        "crease",
        "angle [deg], moment [N mm], branch\n" + "".join(f"{a}, {m}, unloading\n" for a, m in UP),
        "has an unloading branch only; add the loading branch",
    ),
    "empty file": ("crease", "", "data.csv is empty"),
    "relaxation of one time": ("relaxation", RELAX + "1, 2\n", "has 1 row at 1 different time; the law has three"),
    "nothing relaxes": ("relaxation", RELAX + rows([(t, 30) for t in range(9)]), "angle is 30 deg in all 9"),
    "before release": ("relaxation", RELAX + rows([(t - 3, t) for t in range(9)]), "row 2: time is -3 s"),
    "sooner than can be": ("relaxation", RELAX + rows([(1e-300, 20), *UP[1:]]), "row 2: time is 1e-300 s, outside"),
    "later than can be": ("relaxation", RELAX + rows([*UP[1:], (1e13, 20)]), "row 20: time is 1e+13 s, outside"),
    "bending of one row": ("bending", BEND + "0.1, 2, 80\n", "has 1 row with 1 different forces; a scatter needs"),
    "no length": ("bending", "force [N], deflection [mm]\n0.1, 2\n", "no column length among force [N], deflection [mm]"),
    "longer than the panel": ("bending", bent(20, 40), "row 3: deflection is 40 mm, more than 95 %"),
    "opposite signs": ("bending", bent(-2), "forces and deflections have opposite"),
    "gauge that stands still": ("bending", bent(2, same=True), "deflection is 2 mm in all 3 rows"),
    "negative length": ("bending", bent(2, -80), "row 2: length is -80 mm; it must be"),
    "two panels": ("bending", bent(2, 80, longer=1), "row 3: length is 82 mm after 81 mm"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_mistake_gets_a_line_and_nothing_is_written(tmp_path: Path, name: str) -> None:
    kind, text, message = BAD[name]
    result = calibrate(tmp_path, kind, text)
    assert result.exit_code == 2, result.output
    assert message in result.output
    assert "data." in result.output.splitlines()[0]
    assert "Traceback" not in result.output and "internal error" not in result.output
    assert {path.name for path in tmp_path.iterdir()} == {"data.csv"}


def test_files_that_are_not_there(tmp_path: Path) -> None:
    result = CliRunner().invoke(cli, ["calibrate", "crease", str(tmp_path / "no.csv"), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "no.csv: no such file" in result.output
    (tmp_path / "empty").mkdir()
    result = CliRunner().invoke(cli, ["calibrate", "crease", str(tmp_path / "empty"), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "holds no CSV file" in result.output
    result = CliRunner().invoke(cli, ["calibrate", "bending", str(tmp_path / "empty"), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2


def test_an_unknown_kind_names_those_there_are(tmp_path: Path) -> None:
    result = calibrate(tmp_path, "creas", CREASE)
    assert result.exit_code == 2
    assert "'crease'" in result.output


def test_an_error_while_writing_leaves_the_old_results_alone(tmp_path: Path) -> None:
    """All files are first written beside the folder."""

    def fails(path: Path) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device", str(path))

    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "calibration.json").write_text("old")
    found = Calibration("crease", (), plots=[("curves.png", lambda path: path.write_text("new")), ("loops.png", fails)])
    with pytest.raises(OSError, match="No space left"):
        write_calibration(found, folder, Options())
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert {path.name: path.read_text() for path in folder.iterdir()} == {"calibration.json": "old"}


def test_what_a_kill_left_goes_with_the_next_calibration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that is killed while it writes leaves its temporary folder."""

    def killed(path: Path) -> None:
        path.write_text("half")
        raise KeyboardInterrupt

    folder = tmp_path / "out"
    half_done = Calibration("crease", (), plots=[("curves.png", killed)])
    with monkeypatch.context() as patch:
        # because nothing removes temporary files after a kill
        patch.setattr("fsm.calibrate.report.shutil.rmtree", lambda *_, **__: None)
        with pytest.raises(KeyboardInterrupt):
            write_calibration(half_done, folder, Options())
    assert not folder.exists() and len(list(tmp_path.iterdir())) == 1
    write_calibration(Calibration("crease", ()), folder, Options())
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert [path.name for path in folder.iterdir()] == ["calibration.json"]


def test_numbers_that_are_not_finite_are_written_as_null(tmp_path: Path) -> None:
    found = Calibration("crease", (), numbers={"a": math.nan, "b": np.array([1.0, math.inf]), "c": np.int64(3)})
    write_calibration(found, tmp_path / "out", Options())
    told = json.loads((tmp_path / "out" / "calibration.json").read_text())
    assert (told["a"], told["b"], told["c"]) == (None, [1.0, None], 3)
    assert told["options"]["seed"] == 0
    assert "fsm" in told["provenance"]


@pytest.mark.nightly
def test_a_million_rows(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    angle = np.concatenate([np.linspace(0, 90, 500_000), np.linspace(90, 0, 500_000)]) + 0.01 * rng.normal(size=1_000_000)
    moment = 2.0 * np.sin(np.radians(angle)) + 0.02 * rng.normal(size=1_000_000)
    moment[1234] = 5.0
    np.savetxt(
        tmp_path / "big.csv", np.column_stack([angle, moment]), fmt="%.5f", delimiter=",", header=CREASE.strip(), comments=""
    )
    result = CliRunner().invoke(cli, ["calibrate", "crease", str(tmp_path / "big.csv"), "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    assert "row 1236: outlier" in result.output
    told = json.loads((tmp_path / "out" / "calibration.json").read_text())["curves"][0]["loading"]
    # means of 2500 neighbours, the outlier among them, have a scatter of 4e-4 N mm, and points one of 0.02
    assert told["scatter_Nm"] == pytest.approx(2e-5, rel=0.15)
