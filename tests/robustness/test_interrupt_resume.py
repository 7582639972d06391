"""Interrupted runs: the files that they leave, and that `--resume` gives bitwise the results of an uninterrupted run."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm.run.recorder
import fsm.solve.statics.path_steps
import fsm.solve.time.stepwise_run
from fsm.case.loading.load_case import load_case
from fsm.errors import CannotWrite, CaseError, FsmError
from fsm.io.folder_lock import LOCK, locked_folder
from fsm.results.checkpoint_file import read_checkpoint, write_checkpoint
from fsm.results.solution import Solution
from fsm.results.store import part_path, read_solution
from fsm.results.summary_file import read_summary
from fsm.run.run_case import run_case
from tests.case_texts import strip

CASE = f"""
{strip("segments_per_panel = 2", "damping = 0.01")}[contact]
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

EAGER = "import fsm.run.recorder; fsm.run.recorder.CHECKPOINT_EVERY = 0.05; from fsm.cli.command_line import main; main()"
"""`fsm` with a checkpoint every twentieth of a second."""
PATIENCE = 120.0
CASES = Path(__file__).resolve().parents[2] / "folding_cases"


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("case") / "case.toml"
    path.write_text(CASE, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def sticking(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same test with a friction law that has bristles."""
    path = tmp_path_factory.mktemp("sticking") / "case.toml"
    speeds = 'v_static = "1 mm/s"\nv_dynamic = "10 mm/s"'
    assert speeds in CASE
    path.write_text(CASE.replace(speeds, 'law = "lugre"\nv_stribeck = "10 mm/s"\npresliding = "10 um"'), encoding="utf-8")
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
    """Wait until the file exists; return False if the process ended before."""
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
    """The part file can be read and holds the records of the checkpoint, and no file looks finished."""
    assert not (out / "summary.json").exists()
    assert not (out / "result.h5").exists()
    part = read_solution(part_path(out / "result.h5"))
    if (out / "checkpoint.h5").exists():  # not before the first renewal point
        _, attributes = read_checkpoint(out / "checkpoint.h5")
        assert 0 < int(attributes["records"]) <= len(part)
    assert np.all(np.diff(part.time) > 0)
    return part


def numbers(solution: Solution) -> dict[str, np.ndarray]:
    """All arrays over time that a results file holds."""
    found = {name: values for name, values in vars(solution).items() if isinstance(values, np.ndarray)}
    found |= {f"energy {name}": values for name, values in solution.energy.items()}
    found |= {f"samples {name}": values for name, values in vars(solution.samples).items()}
    if solution.array is not None:
        found |= {f"array {name}": values for name, values in vars(solution.array).items() if isinstance(values, np.ndarray)}
    return found


def untimed(named: dict[str, Any]) -> dict[str, Any]:
    """A summary or counters as read from a file, without the computing times."""
    kept: dict[str, Any] = json.loads(json.dumps(named))
    return {name: value for name, value in kept.items() if not name.endswith("time_s")}


def check_same(out: Path, expected: Solution, summary: dict[str, Any]) -> None:
    """The numbers are bitwise those of the uninterrupted run."""
    found = read_solution(out / "result.h5")
    again, once = numbers(found), numbers(expected)
    assert again.keys() == once.keys()
    assert [name for name in once if not np.array_equal(again[name], once[name], equal_nan=True)] == []
    assert untimed(found.stats) == untimed(expected.stats)
    assert untimed(read_summary(out / "summary.json")) == untimed(summary)


def check_finished(out: Path, whole: tuple[Solution, dict[str, Any]]) -> None:
    """The numbers are bitwise those of the uninterrupted run, and so are all files that it writes."""
    check_same(out, *whole)
    assert sorted(path.name for path in out.iterdir()) == [
        "contact.csv", "contact.png", "dynamic_force.csv", "energy.png", "force.csv", "force.png", "motion.png", "result.h5",
        "summary.json",
    ]  # fmt: skip


@pytest.mark.figures
@pytest.mark.nightly
def test_same_numbers_twice(case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path) -> None:
    """In this process, and in another one."""
    run_case(load_case(case), tmp_path / "here", progress=False)
    check_finished(tmp_path / "here", whole)
    process = start(case, tmp_path / "there", "--quiet")
    output, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, output, errors) == (0, "", "")
    check_finished(tmp_path / "there", whole)


@pytest.mark.figures
@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_interrupted_by_signal(case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path) -> None:
    process = start(case, tmp_path, "--set", "drive.0.travel=8 mm")
    assert wait_for(process, (tmp_path / "checkpoint.h5").exists)
    time.sleep(0.05)  # the whole run takes two seconds
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


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("method", ["Radau", "generalized-alpha"])
def test_killed_at_any_moment(sticking: Path, method: str, tmp_path: Path) -> None:
    chance = random.Random(20)
    out = tmp_path / "cut"
    checkpoint = out / "checkpoint.h5"
    # short steps, so that no run ends before it is killed
    overrides = [f"solve.method={method}", f"solve.max_step={'0.1 ms' if method == 'generalized-alpha' else '1 ms'}"]
    options = [word for override in overrides for word in ("--set", override)]
    kills = 0
    for _ in range(5):
        before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
        process = start(sticking, out, "--resume", "--quiet", *options, program=("-c", EAGER))

        def written(before: int = before) -> bool:
            return checkpoint.exists() and checkpoint.stat().st_mtime_ns != before

        if wait_for(process, written):
            time.sleep(chance.uniform(0.0, 0.4))
        process.kill()
        process.communicate()
        if process.returncode == 0:
            break
        kills += 1
        check_unfinished(out)
    assert kills >= 3
    run_case(load_case(sticking, overrides), out, progress=False, resume=True)
    summary = run_case(load_case(sticking, overrides), tmp_path / "whole", progress=False)
    check_same(out, read_solution(tmp_path / "whole" / "result.h5"), summary)


def test_a_fresh_start_takes_the_old_checkpoint_and_summary_away(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt(case, tmp_path, 0.3)
    (tmp_path / "summary.json").write_text("{}", encoding="utf-8")

    def killed(*_: object, **__: object) -> None:
        raise OSError("killed here")

    monkeypatch.setattr(fsm.run.recorder, "simulate", killed)
    with pytest.raises(OSError, match="killed here"):
        run_case(load_case(case), tmp_path, progress=False)
    assert not (tmp_path / "checkpoint.h5").exists()
    assert not (tmp_path / "summary.json").exists()


@pytest.mark.figures
@pytest.mark.nightly
def test_interrupted_again_and_again(case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path) -> None:
    """Also interrupted in the middle of contact, and after the last step."""
    for fraction in (0.0, 0.3, 0.62, 0.64, 1.0):
        interrupt(case, tmp_path, fraction, True)
        check_unfinished(tmp_path)
    run_case(load_case(case), tmp_path, progress=False, resume=True)
    check_finished(tmp_path, whole)


@pytest.mark.figures
@pytest.mark.nightly
def test_a_second_run_into_the_same_folder_is_refused(
    case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with locked_folder(out):
        process = start(case, out, "--quiet")
        output, errors = process.communicate(timeout=PATIENCE)
        assert (process.returncode, output) == (2, "")
        assert errors.count("\n") == 1
        assert f"process {os.getpid()} of" in errors
        assert [path.name for path in out.iterdir()] == [LOCK]
    assert not out.exists()
    run_case(load_case(case), out, progress=False)
    check_finished(out, whole)


def test_a_run_that_goes_on_waits_for_the_one_that_ends(tmp_path: Path) -> None:
    held, order = threading.Event(), list[str]()

    def hold() -> None:
        with locked_folder(tmp_path):
            held.set()
            time.sleep(0.5)
            order.append("first")

    thread = threading.Thread(target=hold)
    thread.start()
    held.wait()
    with pytest.raises(CannotWrite, match="writes its results there"), locked_folder(tmp_path):
        pass
    with locked_folder(tmp_path, wait=60.0):
        order.append("second")
    thread.join()
    assert order == ["first", "second"]


@pytest.mark.nightly
def test_a_lock_ends_with_its_owner_however_it_ends(case: Path, tmp_path: Path) -> None:
    process = start(case, tmp_path)
    assert wait_for(process, (tmp_path / "checkpoint.h5").exists)
    process.kill()
    process.communicate()
    assert (tmp_path / LOCK).exists()
    run_case(load_case(case), tmp_path, progress=False)
    assert not (tmp_path / LOCK).exists()


def test_a_flipped_bit_of_a_checkpoint_is_refused(case: Path, tmp_path: Path) -> None:
    """Bits are flipped one at a time, in the arrays and elsewhere."""
    interrupt(case, tmp_path, 0.62)
    checkpoint = tmp_path / "checkpoint.h5"
    content = checkpoint.read_bytes()
    expected = read_checkpoint(checkpoint)
    chance, refused = random.Random(3), 0
    start_of_q = content.index(expected[0]["q"].tobytes())
    for place in [start_of_q + 5, *(chance.randrange(len(content)) for _ in range(60))]:
        flipped = bytearray(content)
        flipped[place] ^= 1 << chance.randrange(8)
        checkpoint.write_bytes(flipped)
        try:
            arrays, attributes = read_checkpoint(checkpoint)
        except CaseError:
            refused += 1
        else:  # a byte that no data use
            assert attributes == expected[1]
            assert all(np.array_equal(arrays[name], values) for name, values in expected[0].items())
    assert refused > 10
    flipped = bytearray(content)
    flipped[start_of_q] ^= 1
    checkpoint.write_bytes(flipped)
    with pytest.raises(CaseError, match="checksum"):
        run_case(load_case(case), tmp_path, progress=False, resume=True)


@pytest.mark.nightly
def test_a_checkpoint_of_other_code_is_not_resumed(
    case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The stored values may have another meaning in the present code."""
    with monkeypatch.context() as older:
        older.setattr(fsm.run.recorder, "made_by", lambda: {"fsm": "0.0.1"})
        interrupt(case, tmp_path, 0.62)
    summary = run_case(load_case(case), tmp_path, progress=False, resume=True)
    assert sum("was written by another version" in warning for warning in summary["warnings"]) == 1
    again = read_solution(tmp_path / "result.h5")
    assert np.array_equal(again.q, whole[0].q) and np.array_equal(again.force, whole[0].force)


def check_cuts(case: Path, out: Path, *overrides: str) -> None:
    """Interrupted before the first restart point, several times on the way, and after the last step."""
    summary = run_case(load_case(case, overrides), out / "whole", progress=False)
    whole = read_solution(out / "whole" / "result.h5")
    for fractions in [(0.3,), (1.0,), (0.0, 0.3, 0.62, 0.64, 1.0)]:
        cut = out / str(fractions)
        for fraction in fractions:
            interrupt(case, cut, fraction, True, *overrides)
            check_unfinished(cut)
        # LSODA has restart points only every few hundred steps; a shorter run starts again from the beginning
        assert (cut / "checkpoint.h5").exists() or "solve.method=LSODA" in overrides
        run_case(load_case(case, overrides), cut, progress=False, resume=True)
        check_same(cut, whole, summary)


@pytest.mark.nightly
@pytest.mark.parametrize(
    "method",
    ["static", "Radau-blocks", "BDF", "LSODA"],
)
def test_interrupted_with_other_methods(case: Path, tmp_path: Path, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fsm.solve.statics.path_steps, "MOST_OF_PATHS", 64)  # the path is shorter than 512 steps
    check_cuts(case, tmp_path, f"solve.method={method}")


@pytest.mark.parametrize("spatial", [False, pytest.param(True, marks=pytest.mark.nightly)], ids=["plane", "space"])
def test_interrupted_where_friction_remembers(
    sticking: Path, tmp_path: Path, spatial: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fsm.solve.time.stepwise_run, "_MARCH", 64)  # the whole run has fewer steps than one kernel takes
    check_cuts(sticking, tmp_path, "solve.method=generalized-alpha", f"solve.spatial={str(spatial).lower()}")


@pytest.mark.nightly
@pytest.mark.parametrize(
    "overrides",
    [
        ("scissor_array", "solve.end_time=200 ms"),
        ("membrane_impact", "vibration.model=full", "vibration.duration=40 ms", "solve.step=0.2 ms", "impact.force=0.02 N",
         "membrane.mesh=[8,8]"),
    ],
    ids=["array", "film"],
)  # fmt: skip
def test_interrupted_in_a_flexible_structure(
    tmp_path: Path, overrides: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fsm.solve.time.stepwise_run, "_MARCH", 16)  # the whole run has fewer steps than one kernel takes
    folder, *keys = overrides
    check_cuts(CASES / folder / "case.toml", tmp_path, *keys)


@pytest.mark.figures
@pytest.mark.nightly
def test_another_case_starts_afresh(case: Path, whole: tuple[Solution, dict[str, Any]], tmp_path: Path) -> None:
    interrupt(case, tmp_path, 0.3, False, "material.young=6 GPa")
    stiff = check_unfinished(tmp_path)
    run_case(load_case(case), tmp_path, progress=False, resume=True)
    check_finished(tmp_path, whole)
    plain = read_solution(tmp_path / "result.h5")
    assert plain.force[5] != stiff.force[5]
    assert np.array_equal(plain.q, whole[0].q), "not from the start"


@pytest.mark.nightly
def test_a_run_of_another_case_is_said_to_begin_anew(case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Progress is reported in one line; a run that continues with the same case prints no such line."""
    told = "belongs to another case: the run starts from the beginning"
    short = ["drive.0.travel=2 mm"]
    interrupt(case, tmp_path, 0.5)
    assert (tmp_path / "checkpoint.h5").is_file()
    run_case(load_case(case, short), tmp_path, progress=True, resume=True)
    assert [line for line in capsys.readouterr().err.splitlines() if told in line] == [
        f"{tmp_path / 'checkpoint.h5'} {told}"
    ]
    run_case(load_case(case, short), tmp_path, progress=True, resume=True)
    assert told not in capsys.readouterr().err
    shorter = ["drive.0.travel=1 mm"]
    run_case(load_case(case, shorter), tmp_path, progress=True, resume=True)
    assert f"{tmp_path / 'result.h5'} {told}" in capsys.readouterr().err
    run_case(load_case(case, short), tmp_path, progress=False, resume=True)
    assert capsys.readouterr().err == ""


def test_interrupted_within_a_kernel(case: Path, tmp_path: Path) -> None:
    """Python reports Ctrl-C in a compiled kernel as a SystemError."""

    def tell(done: float) -> None:
        if done > 0.3:
            raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    with pytest.raises(KeyboardInterrupt):
        run_case(load_case(case), tmp_path, progress=tell)
    check_unfinished(tmp_path)


def _spoilt(arrays: dict[str, np.ndarray], attributes: dict[str, Any], number: int) -> bool:
    """Damage one entry of a checkpoint; return False if there are no more entries."""
    names = [name for name in (*arrays, *attributes) if not name.startswith("state")]  # the solver writes these entries
    name = names[number // 4] if number // 4 < len(names) else ""
    how = number % 4
    if name in arrays:
        values = arrays[name]
        if how == 0:
            del arrays[name]
        else:
            flat = values.ravel()
            arrays[name] = (flat[:-1], np.append(flat, 1.0), np.full_like(values, np.nan, float))[how - 1]
    elif name:
        if how == 0:
            del attributes[name]
        else:
            attributes[name] = ("odd", [[1], {"a": None}], -3)[how - 1]
    return bool(name)


@pytest.mark.nightly
def test_a_damaged_checkpoint_is_no_internal_error(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With any missing or changed entry the run continues, or it ends with a message."""
    monkeypatch.setattr(fsm.solve.time.stepwise_run, "_MARCH", 64)
    overrides = ("solve.method=generalized-alpha", "drive.0.travel=2 mm", "solve.max_steps=400")
    interrupt(case, tmp_path / "out", 0.3, False, *overrides)
    good = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    number, refused = 0, 0
    while True:
        arrays, attributes = read_checkpoint(tmp_path / "out" / "checkpoint.h5")
        if not _spoilt(arrays, attributes, number):
            break
        write_checkpoint(tmp_path / "out" / "checkpoint.h5", arrays, attributes)
        try:
            run_case(load_case(case, overrides), tmp_path / "out", progress=stopper(0.0), resume=True)
        except CaseError:
            refused += 1
        except (FsmError, KeyboardInterrupt):
            pass
        for path in (tmp_path / "out").iterdir():
            path.unlink()
        for name, content in good.items():
            (tmp_path / "out" / name).write_bytes(content)
        number += 1
    assert refused > 20
