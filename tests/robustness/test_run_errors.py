"""Runs that cannot be completed: exit code, messages, and files that remain."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from fsm.cli.command_line import cli
from fsm.results.store import part_path, read_solution
from tests.case_texts import strip

CASE = f"""
{strip("segments_per_panel = 2", "damping = 0.01")}[contact]
stiffness = "1e8 N/m^1.5"
[[drive]]
crease = 3
speed = "2 mm/s"
travel = "1 mm"
[solve]
rtol = 1e-4
[save]
every = "50 um"
"""

WRITTEN = ["energy.png", "force.csv", "force.png", "motion.png", "result.h5", "summary.json"]


def run(folder: Path, *overrides: str, options: tuple[str, ...] = ("--quiet",)) -> tuple[Result, Path]:
    case = folder / "case.toml"
    case.write_text(CASE, encoding="utf-8")
    settings = [word for override in overrides for word in ("--set", override)]
    result = CliRunner().invoke(cli, ["run", str(case), "--out", str(folder / "out"), *options, *settings])
    assert "Traceback" not in result.output
    return result, folder / "out"


def check_stopped(result: Result, out: Path, code: int) -> str:
    """One line says when, where and what to try; the records solved until then can be read, and no file looks finished."""
    assert result.exit_code == code, result.output
    (line,) = result.stderr.splitlines()
    assert not (out / "summary.json").exists()
    assert not (out / "result.h5").exists()
    part = read_solution(part_path(out / "result.h5"))
    assert len(part) >= 1
    assert part.time[0] == 0.0
    assert not part.summary
    return line


def test_overlap_at_the_start(tmp_path: Path) -> None:
    """A strip that is too thick for its folding angle is refused before anything is written, with one line for each pair."""
    result, out = run(tmp_path, "strip.thickness=20 mm")
    assert result.exit_code == 2
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    source = re.escape(str(tmp_path / "case.toml"))
    pattern = rf"{source}: strip: panel (\d) and panel (\d) overlap at the start by [\d.]+ mm; use a smaller fold_angle .*"
    found = [match.groups() for line in lines if (match := re.fullmatch(pattern, line))]
    assert len(found) == len(lines) > 0, result.stderr
    assert len(set(found)) == len(found), "a pair is named twice"
    assert not out.exists()


@pytest.mark.parametrize(
    ("method", "blamed"),
    [
        ("Radau", "Fastest changing body:"),
        ("Radau-blocks", "Fastest changing body:"),
        ("generalized-alpha", "Fastest changing body:"),
        ("static", r"Joint strained most: joint panel \d segment \d -"),
    ],
)
def test_not_converged(method: str, blamed: str, tmp_path: Path) -> None:
    result, out = run(tmp_path, "solve.max_steps=3", f"solve.method={method}")
    line = check_stopped(result, out, 3)
    where = rf"at t = [\d.e-]+ s \(travel [\d.e-]+ [mun]m\), step 3, method {method}"
    match = re.fullmatch(rf"{where}: (.*)\. {blamed} panel \d segment \d", line)
    assert match is not None, line
    assert match[1] == "more steps than solve.max_steps; raise solve.max_steps, loosen solve.rtol, or pull faster"


def test_a_run_that_fails_says_what_was_doubtful_before(tmp_path: Path) -> None:
    """The likely cause is a curve through the scatter of a bench test; only `fsm check` mentioned it."""
    angles = ", ".join(f'"{5 * k} deg"' for k in range(33))
    moments = ", ".join(f'"{k + 1.2 * (-1) ** k} N mm"' for k in range(33))
    curve = f'crease={{law="spline", interpolation="pchip", angle=[{angles}], moment=[{moments}]}}'
    result, out = run(tmp_path, "solve.max_steps=3", "strip.half_cell=false", curve)
    line = check_stopped(result, out, 3)
    assert re.search(r"^at t = .*max_steps.*\. Warning: crease: the moment changes \d+ times .* `fsm calibrate crease", line)


@pytest.mark.parametrize("method", ["Radau", "Radau-blocks", "generalized-alpha", "static"])
def test_energy_lost(method: str, tmp_path: Path) -> None:
    """A bound on the energy balance that no method can keep."""
    result, out = run(tmp_path, "solve.energy_abort=1e-30", f"solve.method={method}")
    line = check_stopped(result, out, 5)
    which = "" if method == "static" else rf", step \d+, method {method}"
    assert re.match(rf"at t = [\d.e-]+ s \(travel [\d.e-]+ [mun]m\){which}: the energy balance residual is above", line)
    remedy = "tighten solve.rtol, which" if method == "static" else "tighten solve.rtol, or set solve.max_step"
    assert remedy in line
    assert re.search(r"Energy error [\d.e-]+ J; reference energy [\d.e-]+ J$", line)


def test_energy_lost_in_steps_that_were_asked_for(tmp_path: Path) -> None:
    """A tolerance does not change fixed steps, so the message does not advise one."""
    result, out = run(tmp_path, "solve.energy_abort=1e-30", "solve.method=generalized-alpha", "solve.step=0.1 ms")
    line = check_stopped(result, out, 5)
    assert "energy_abort; reduce solve.step. " in line
    assert "rtol" not in line


@pytest.mark.parametrize("method", ["generalized-alpha", "Radau"])
def test_rest_is_no_loss_of_energy(method: str, tmp_path: Path) -> None:
    """A strip starts in equilibrium with its load and remains there: only round-off moves it, so its energy balance has no
    meaning."""
    load = 'load=[{body="panel 6 segment 1",force=[0,0,0.001]}]'
    changes = "drive=none", load, "strip.held=[1]", "solve.end_time=0.2 s", f"solve.method={method}", "save=none"
    result, out = run(tmp_path, *changes)
    assert result.exit_code == 0, result.output
    summary = json.loads((out / "summary.json").read_text())
    assert summary["energy_error"] == 0.0
    assert summary["warnings"] == []


@pytest.mark.figures
def test_expectation_missed(tmp_path: Path) -> None:
    """All files are written; every violated limit has a line, and limits that were kept have none."""
    result, out = run(
        tmp_path,
        'expect={peak_force={value=1000.0,rtol=0.01}, final_travel={value=1e-3,atol=1e-9}, peak_travel={value=5,rtol=0.1}}',
        options=(),
    )
    assert result.exit_code == 4, result.output
    said = [line for line in result.stderr.splitlines() if line.startswith("expect.")]
    assert len(said) == 2
    assert re.fullmatch(r"expect\.peak_force: 0\.\d+, expected 1000 \+- 10", said[0])
    assert re.fullmatch(r"expect\.peak_travel: 0\.001, expected 5 \+- 0\.5", said[1])
    assert "peak force" in result.stdout
    assert sorted(path.name for path in out.iterdir()) == WRITTEN
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert read_solution(out / "result.h5").summary["peak_force"] == summary["peak_force"]
    result, out = run(tmp_path, options=("--quiet", "--figures", "none"))  # figures of the earlier run would be out of date
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in out.iterdir()) == [name for name in WRITTEN if not name.endswith(".png")]


def test_expectation_of_what_never_happens(tmp_path: Path) -> None:
    result, _ = run(tmp_path, "expect.contact_travel={value=1e-3,rtol=0.1}", "contact=none")
    assert result.exit_code == 4
    assert result.stderr == "expect.contact_travel: 0.001 expected, but this event did not occur in the run\n"


def test_expectation_met(tmp_path: Path) -> None:
    result, _ = run(tmp_path, "expect.final_travel={value=1e-3,rtol=1e-9}")
    assert (result.exit_code, result.output) == (0, "")


def test_unknown_expectation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The case is refused before anything is solved or written."""

    def solve(*_: object, **__: object) -> None:
        raise AssertionError("it solves")

    monkeypatch.setattr("fsm.run.recorder.simulate", solve)
    result, out = run(tmp_path, "expect.peak_farce={value=1,rtol=0.1}", "expect.dof={value=30,atol=0}")
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"{tmp_path / 'case.toml'}: expect.peak_farce: is not a number of the summary; did you mean")
    assert "peak_force" in line
    assert not out.exists()


GENTLE = """
[strip]
length = "180 mm"
width = "3 mm"
thickness = "0.066 mm"
panels = 12
fold_angle = "86 deg"
segments_per_panel = 16
[material]
young = "41.9 GPa"
poisson = 0.3
density = "1600 kg/m^3"
damping = "10 ms"
[crease]
law = "linear"
stiffness = "0.0644 N mm/rad"
[contact]
stiffness = "1e8 N/m^1.5"
damping = "10 N s/m"
ramp = "10 um"
thickness_in_gap = false
[[drive]]
direction = [1, 0, 0]
crease = 5
speed = "5 mm/s"
travel = "2.1 mm"
"""


def test_an_error_that_soon_is_nothing_ends_no_run(tmp_path: Path) -> None:
    """A hundredth of the energy has been turned over at a tenth of the way, and the jerk of the start is 11 % of that."""
    (tmp_path / "case.toml").write_text(GENTLE, encoding="utf-8")
    result = CliRunner().invoke(cli, ["run", str(tmp_path / "case.toml"), "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["method"] == "generalized-alpha"
    assert summary["energy_error"] < 0.01


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform != "linux", reason="names of files as bytes")
def test_a_folder_whose_name_is_not_text(tmp_path: Path) -> None:
    folder = os.path.join(os.fsencode(tmp_path), b"caf\xe9")
    os.mkdir(folder)
    Path(os.fsdecode(folder), "case.toml").write_text(CASE, encoding="utf-8")
    for words in (["run", b"case.toml", b"--out", folder + b"/out", b"--quiet"], ["plot", folder + b"/out/result.h5"]):
        done = subprocess.run([sys.executable, "-m", "fsm", *words], cwd=folder, capture_output=True, check=False)
        assert done.returncode == 0, done.stderr


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform != "linux", reason="file descriptors of POSIX")
def test_closed_outputs(tmp_path: Path) -> None:
    """No file of the run receives messages, although the first file that is opened gets the number of standard error."""
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    command = f"exec {sys.executable} -m fsm run case.toml --out out >&- 2>&-"
    assert subprocess.run(["sh", "-c", command], cwd=tmp_path, check=False).returncode == 0
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["peak_force"] > 0.0
