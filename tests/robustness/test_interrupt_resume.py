"""Runs that are cut off: what they leave behind, and that `--resume` gives what an uncut run gives."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm.recorder
from fsm.results.solution import Solution
from fsm.results.store import part_path, read_checkpoint, read_solution
from fsm.run import run_case
from fsm.scene.load_case import load_case

CASE = """
[strip]
length = "480 mm"
width = "40 mm"
thickness = "0.3 mm"
panels = 6
fold_angle = "80 deg"
segments_per_panel = 2
[material]
young = "3 GPa"
density = "800 kg/m^3"
damping = "10 ms"
[crease]
law = "linear"
stiffness = "9 N mm/rad"
[contact]
stiffness = "1e8 N/m^1.5"
damping = "10 N s/m"
[friction]
mu_static = 0.3
mu_dynamic = 0.2
v_static = "1 mm/s"
v_dynamic = "10 mm/s"
[[drive]]
crease = 3
speed = "2 mm/s"
travel = "8 mm"
[solve]
method = "Radau"
rtol = 1e-6
[save]
every = "0.1 mm"
"""

EAGER = "import fsm.recorder; fsm.recorder.CHECKPOINT_EVERY = 0.05; from fsm.cli import main; main()"
"""`fsm` with a checkpoint every twentieth of a second."""
PATIENCE = 120.0


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("case") / "case.toml"
    path.write_text(CASE, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def whole(case: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Solution, dict[str, Any]]:
    """The run without an interruption."""
    out = tmp_path_factory.mktemp("whole")
    summary = run_case(load_case(case), out, progress=False)
    return read_solution(out / "result.h5"), summary


def start(case: Path, out: Path, *options: str, program: tuple[str, ...] = ("-m", "fsm")) -> subprocess.Popen[str]:
    command = [sys.executable, *program, "run", str(case), "--out", str(out), *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(process: subprocess.Popen[str], there: Callable[[], bool]) -> bool:
    """Wait until something is there; False if the process ended before."""
    end = time.monotonic() + PATIENCE
    while not there():
        if process.poll() is not None:
            return False
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.01)
    return True


def stopper(fraction: float) -> Callable[[float], None]:
    """A progress report that interrupts the run."""

    def tell(done: float) -> None:
        if done >= fraction:
            raise KeyboardInterrupt

    return tell


def interrupt(case: Path, out: Path, fraction: float, resume: bool = False, *overrides: str) -> None:
    out.mkdir(exist_ok=True)
    with pytest.raises(KeyboardInterrupt):
        run_case(load_case(case, overrides), out, progress=stopper(fraction), resume=resume)


def check_unfinished(out: Path) -> Solution:
    """A readable part file with the records of the checkpoint, and nothing that looks finished."""
    assert not (out / "summary.json").exists()
    assert not (out / "result.h5").exists()
    part = read_solution(part_path(out / "result.h5"))
    _, attributes = read_checkpoint(out / "checkpoint.h5")
    assert 0 < int(attributes["records"]) <= len(part)
    assert np.all(np.diff(part.time) > 0)
    return part


def check_finished(out: Path, whole: tuple[Solution, dict[str, Any]]) -> None:
    """The same records as those of the uncut run, and the same numbers drawn from them."""
    expected, summary = whole
    found, named = read_solution(out / "result.h5"), json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert np.array_equal(found.time, expected.time)
    assert np.array_equal(found.travel, expected.travel)
    peak = summary["peak_force"]
    assert named["peak_force"] == pytest.approx(peak, rel=1e-5)
    assert named["peak_travel"] == pytest.approx(summary["peak_travel"], abs=1e-5)
    assert found.force == pytest.approx(expected.force, abs=1e-5 * peak)
    assert found.pair_force == pytest.approx(expected.pair_force, abs=1e-4 * expected.pair_force.max())
    for name in ("dissipated", "work"):
        assert found.energy[name] == pytest.approx(expected.energy[name], abs=1e-5 * expected.energy["work"].max())
    lost = expected.pair_damping_energy + expected.pair_friction_energy
    again = found.pair_damping_energy + found.pair_friction_energy
    assert again == pytest.approx(lost, abs=1e-2 * lost.max())
    assert [pair["pair"] for pair in named["contact"]] == [pair["pair"] for pair in summary["contact"]]
    for name in ("contact_travel", "bending_travel"):  # drawn from points that lie as the steps do
        assert named[name] == pytest.approx(summary[name], abs=3e-5)
    assert 0.1 * summary["energy_error"] < named["energy_error"] < 1e-6
    assert [touch["pair"] for touch in named["touches"]] == [touch["pair"] for touch in summary["touches"]]
    assert sorted(path.name for path in out.iterdir()) == [
        "contact.csv", "contact.png", "energy.png", "force.csv", "force.png", "motion.png", "result.h5", "summary.json",
    ]  # fmt: skip


def test_same_numbers_twice(case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path) -> None:
    run_case(load_case(case), tmp_path, progress=False)
    again = read_solution(tmp_path / "result.h5")
    for name in ("time", "q", "u", "force", "pair_force"):
        assert np.array_equal(getattr(again, name), getattr(whole[0], name)), name


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_interrupted_by_signal(case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path) -> None:
    process = start(case, tmp_path, "--set", "drive.0.travel=8 mm")
    assert wait_for(process, part_path(tmp_path / "result.h5").exists)
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, output + errors
    assert errors.splitlines()[-1] == "interrupted"
    assert "Traceback" not in errors
    part = check_unfinished(tmp_path)
    assert len(part) < len(whole[0])
    process = start(case, tmp_path, "--resume", "--quiet")
    output, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, output, errors) == (0, "", "")
    check_finished(tmp_path, whole)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_killed_at_any_moment(case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path) -> None:
    chance = random.Random(20)
    checkpoint = tmp_path / "checkpoint.h5"
    kills = 0
    for _ in range(5):
        before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
        process = start(case, tmp_path, "--resume", "--quiet", program=("-c", EAGER))

        def written(before: int = before) -> bool:
            return checkpoint.exists() and checkpoint.stat().st_mtime_ns != before

        if wait_for(process, written):
            time.sleep(chance.uniform(0.0, 0.4))
        process.kill()
        process.communicate()
        if process.returncode == 0:
            break
        kills += 1
        check_unfinished(tmp_path)
    assert kills >= 3
    run_case(load_case(case), tmp_path, progress=False, resume=True)
    check_finished(tmp_path, whole)


def test_a_fresh_start_takes_the_old_checkpoint_and_summary_away(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt(case, tmp_path, 0.3)
    (tmp_path / "summary.json").write_text("{}", encoding="utf-8")

    def killed(*_: object, **__: object) -> None:
        raise OSError("killed here")

    monkeypatch.setattr(fsm.recorder, "solve", killed)
    with pytest.raises(OSError, match="killed here"):
        run_case(load_case(case), tmp_path, progress=False)
    assert not (tmp_path / "checkpoint.h5").exists()
    assert not (tmp_path / "summary.json").exists()


def test_interrupted_again_and_again(case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path) -> None:
    """Also in the middle of contact, and after the last step."""
    for fraction in (0.0, 0.3, 0.62, 0.64, 1.0):
        interrupt(case, tmp_path, fraction, True)
        check_unfinished(tmp_path)
    run_case(load_case(case), tmp_path, progress=False, resume=True)
    check_finished(tmp_path, whole)


@pytest.mark.parametrize(
    ("method", "state", "rate", "force", "energy", "end"),
    [
        # on the flank of the first touch, the force depends on where the steps are
        pytest.param("static", 1e-3, 0.5, 1e-2, 3e-3, 1e-6, id="static"),
        pytest.param("generalized-alpha", 1e-5, 1e-3, 1e-4, 2e-5, 1e-6, id="generalized-alpha"),
    ],
)
def test_interrupted_again_and_again_with_other_methods(
    case: Path, tmp_path: Path, method: str, state: float, rate: float, force: float, energy: float, end: float
) -> None:
    """Also before the first step, just before and after the first touch, and after the last step.

    `state`, `rate`, `force`, `energy` bound what any record is off by, `end` what state and force are off by at the end.
    """
    override = f"solve.method={method}"
    summary = run_case(load_case(case, [override]), tmp_path / "whole", progress=False)
    whole = read_solution(tmp_path / "whole" / "result.h5")
    assert summary["method"] == method
    for fractions in [(0.0,), (0.3,), (0.62,), (1.0,), (0.0, 0.3, 0.62, 0.64, 1.0)]:
        out = tmp_path / str(fractions)
        for fraction in fractions:
            interrupt(case, out, fraction, True, override)
            check_unfinished(out)
        named = run_case(load_case(case, [override]), out, progress=False, resume=True)
        found = read_solution(out / "result.h5")
        assert np.array_equal(found.time, whole.time)
        assert np.array_equal(found.travel, whole.travel)
        for name, bound in (("q", state), ("u", rate), ("force", force), ("pair_force", force)):
            expected = getattr(whole, name)
            scale = np.abs(expected).max()
            assert getattr(found, name) == pytest.approx(expected, abs=bound * scale), (fractions, name)
            if name in ("q", "force"):
                assert getattr(found, name)[-1] == pytest.approx(expected[-1], abs=end * scale), (fractions, name)
        assert named["peak_force"] == pytest.approx(summary["peak_force"], rel=end)
        assert named["peak_travel"] == pytest.approx(summary["peak_travel"], abs=1e-9)
        for name in ("dissipated", "work"):
            work = whole.energy["work"].max()
            assert found.energy[name] == pytest.approx(whole.energy[name], abs=energy * work), name
        for name in ("contact_travel", "bending_travel"):
            assert named[name] == pytest.approx(summary[name], abs=1e-4)
        assert named["energy_error"] < 4.0 * summary["energy_error"]
        assert named["events"] == summary["events"] == []


def test_another_case_starts_afresh(case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path) -> None:
    interrupt(case, tmp_path, 0.3, False, "material.young=6 GPa")
    stiff = check_unfinished(tmp_path)
    run_case(load_case(case), tmp_path, progress=False, resume=True)
    check_finished(tmp_path, whole)
    plain = read_solution(tmp_path / "result.h5")
    assert plain.force[5] != stiff.force[5]
    assert np.array_equal(plain.q, whole[0].q), "not from the start"
