"""Worker processes of tables: failures, interrupts, and what copies of a process have."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor
from contextlib import closing
from pathlib import Path

import pytest

from fsm.run.workers import LocalTeam, _Queue, run_jobs

COPIES = [False, pytest.param(True, marks=pytest.mark.skipif(sys.platform != "linux", reason="workers are copies on Linux"))]


@pytest.mark.nightly
@pytest.mark.parametrize("copies", COPIES)
def test_jobs_that_fail_or_die_take_no_other_with_them(copies):
    jobs = [
        "6 * 7",
        "1 / 0",
        "__import__('os')._exit(7)",
        "__import__('os').environ['OMP_NUM_THREADS']",
        "[1]",
    ]
    before = os.environ.get("OMP_NUM_THREADS")
    outcomes = sorted(run_jobs(eval, jobs, 2, copies), key=lambda outcome: outcome.job)
    assert [outcome.value for outcome in outcomes] == [42, None, None, "1", [1]]
    assert outcomes[1].error == ("internal error: ZeroDivisionError: division by zero",)
    assert "Traceback" in outcomes[1].trace
    assert outcomes[2].error == ("the worker process ended with code 7",)
    assert os.environ.get("OMP_NUM_THREADS") == before


def test_foreseen_errors_keep_their_exit_code():
    (outcome,) = run_jobs(exec, ["from fsm.errors import NotConverged; raise NotConverged('a\\nb')"], 4)
    assert (outcome.error, outcome.exit_code, outcome.trace) == (("a", "b"), 3, "")
    (outcome,) = run_jobs(eval, ["__import__('numpy').zeros(10**17)"], 1)
    assert outcome.error[0].startswith("out of memory (Unable to allocate") and outcome.exit_code == 3


def test_work_that_cannot_be_imported_says_why(tmp_path, monkeypatch):
    """This is possible here, but not in a worker."""
    where = tmp_path / "broken_work.py"
    where.write_text("def work(job): ...\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    work = __import__("broken_work").work
    where.write_text("raise OSError('libwork.so: cannot open shared object file')\n")
    (outcome,) = run_jobs(work, [1], 1)
    assert outcome.error == ("internal error: OSError: libwork.so: cannot open shared object file",)
    assert "broken_work.py" in outcome.trace


@pytest.mark.skipif(sys.platform != "linux", reason="workers are copies on Linux")
def test_copies_have_what_their_parent_has(monkeypatch):
    """Its modules and kernels; a worker that is no copy imports modules anew."""
    monkeypatch.setattr("fsm.run.workers.EARLIER", 7, raising=False)
    (outcome,) = run_jobs(eval, ["__import__('fsm.run.workers').run.workers.EARLIER"], 1, copies=True)
    assert outcome.value == 7


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="needs POSIX signals")
def test_workers_start_with_interrupts_let_through():
    """They were held back while the process was started."""
    (outcome,) = run_jobs(eval, ["__import__('signal').pthread_sigmask(0, []) == set()"], 1)
    assert outcome.value is True


def test_a_job_whose_worker_dies_is_tried_again_once(tmp_path):
    """Its companions in a chunk are not lost, and a worker that dies by chance costs nothing."""
    chance = tmp_path / "once"
    by_chance = f"__import__('os')._exit(9) if not __import__('os').path.exists({str(chance)!r}) else 5"
    by_chance = by_chance.replace("__import__('os')._exit(9)", f"(open({str(chance)!r}, 'w'), __import__('os')._exit(9))")
    jobs = ["1"] * 8 + [by_chance, "__import__('os')._exit(7)"] + ["2"] * 8
    outcomes = sorted(run_jobs(eval, jobs, 1), key=lambda outcome: outcome.job)
    assert [outcome.value for outcome in outcomes] == [1] * 8 + [5, None] + [2] * 8
    assert [outcome.error for outcome in outcomes if outcome.error] == [("the worker process ended with code 7",)]


def test_a_worker_that_has_died_gets_no_further_job():
    """Its end may be seen after other calls are sent."""
    team = LocalTeam(2, copies=False)
    call = team.submit(os._exit, 7)
    assert isinstance(call.exception(), BrokenExecutor)
    assert team.submit(abs, -1).result() == 1
    assert team.lost(call, call.exception()) == "the worker process ended with code 7"
    team.end(interrupted=False)


def test_jobs_are_taken_when_workers_are_free():
    """A generator of a million jobs is not read in advance."""
    taken: list[int] = []

    def jobs():
        for number in range(10**6):
            taken.append(number)
            yield f"__import__('time').sleep(0.02) or {number}"

    with closing(run_jobs(eval, jobs(), 1)) as outcomes:
        assert [next(outcomes).value for _ in range(3)] == [0, 1, 2]
    assert len(taken) < 70


def test_short_jobs_travel_together_and_the_last_ones_are_shared():
    queue = _Queue(iter(enumerate(range(1000))), 1000, 2)
    assert len(queue.chunk()) == 1  # nothing is measured yet
    queue.returned(1, 0.05)
    assert len(queue.chunk()) == 10  # half a second
    queue.left = 12
    assert len(queue.chunk()) == 3  # both workers get as much


@pytest.mark.skipif(not hasattr(os, "getpgrp"), reason="needs POSIX process groups")
def test_the_interrupt_of_a_terminal_does_not_reach_workers_twice():
    (outcome,) = run_jobs(eval, ["__import__('os').getpgrp()"], 1)
    assert outcome.value != os.getpgrp()


@pytest.mark.nightly
@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="needs POSIX signals")
@pytest.mark.parametrize("copies", COPIES)
def test_workers_end_with_a_parent_that_is_killed(tmp_path, copies):
    """They are interrupted, so that they write their checkpoints."""
    job = (
        "import os, time, pathlib\n"
        "pathlib.Path({0!r} + '.' + str(os.getpid())).touch()\n"
        "try:\n    time.sleep(60)\n"
        "except KeyboardInterrupt:\n    pathlib.Path({0!r} + '.saved').touch(); raise\n"
    )
    jobs = [job.format(str(tmp_path / name)) for name in "ab"]
    code = f"from fsm.run.workers import run_jobs\nfor outcome in run_jobs(exec, {jobs!r}, 2, {copies}): print(outcome)"
    process = subprocess.Popen([sys.executable, "-c", code], env={"PYTHONPATH": ":".join(sys.path)}, start_new_session=True)
    deadline = time.monotonic() + 60
    while len(list(tmp_path.iterdir())) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
    workers = [int(path.suffix[1:]) for path in tmp_path.iterdir()]
    process.kill()
    process.wait()
    while any(is_running(worker) for worker in workers) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert len(workers) == 2 and not any(is_running(worker) for worker in workers)
    assert len(list(tmp_path.glob("*.saved"))) == 2


def is_running(process: int) -> bool:
    """Whether such a process runs; a finished process whose exit status was not read does not count."""
    try:
        status = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return status != "Z"


@pytest.mark.nightly
@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="needs POSIX signals")
@pytest.mark.parametrize("copies", COPIES)
def test_an_interrupt_reaches_every_worker_once_and_ends_all(tmp_path, copies):
    """Each worker writes a file in place of its checkpoint; no process remains."""
    job = (
        "import sys, time, pathlib\n"
        "pathlib.Path({0!r} + '.started').touch()\n"
        "try:\n    time.sleep(60)\n"
        "except KeyboardInterrupt:\n    time.sleep(0.3); pathlib.Path({0!r} + '.saved').touch(); raise\n"
    )
    jobs = [job.format(str(tmp_path / name)) for name in "abc"]
    code = f"from fsm.run.workers import run_jobs\nfor outcome in run_jobs(exec, {jobs!r}, 2, {copies}): print(outcome)"
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stderr=subprocess.PIPE,
        env={"PYTHONPATH": ":".join(sys.path)},
        start_new_session=True,
    )
    try:
        deadline = time.monotonic() + 60
        while len(list(tmp_path.glob("*.started"))) < 2 and time.monotonic() < deadline:
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: the signal goes to the whole process group
        _, errors = process.communicate(timeout=30)
    finally:
        process.kill()
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "a.saved",
        "a.started",
        "b.saved",
        "b.started",
    ]
    assert errors.decode().count("Traceback") == 1  # only of the parent process
