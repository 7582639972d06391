"""Workers of a Dask cluster: the same rows as on this machine, lost workers and schedulers, and other versions of fsm."""

from __future__ import annotations

import os
import signal
import stat
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from click.testing import CliRunner

from fsm.case.loading.table import load_table
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.io.provenance import made_by
from fsm.run.rows import Job, Row, run_rows
from fsm.run.workers import run_chunk, run_jobs
from tests.unit.test_each_stage_once import DRIVE, STRIP

distributed = pytest.importorskip("distributed")


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[distributed.LocalCluster]:
    """Two workers with one thread each, as two machines."""
    options = {"dashboard_address": None, "host": "127.0.0.1", "silence_logs": 50, "local_directory": str(tmp_path / "dask")}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **options) as started:
        yield started


def bits(rows: Iterator[Row]) -> list[tuple[int, dict[str, object], bytes, str]]:
    """All of rows but their run times, in the order of the jobs."""
    found = []
    for row in sorted(rows, key=lambda row: row.number):
        numbers = {key: value for key, value in row.summary.items() if not key.endswith("_s")}
        found.append((row.number, numbers, row.curves["force"].tobytes() if row.curves else b"", row.error))
    return found


@pytest.mark.nightly
def test_rows_are_the_same_on_any_workers(tmp_path: Path, cluster: distributed.LocalCluster) -> None:
    (tmp_path / "case.toml").write_text(STRIP + DRIVE)
    rows = [f"{k},{2e-4 + 1e-5 * k}\n" for k in range(5)]
    (tmp_path / "table.csv").write_text("case,strip.thickness\n" + "".join(rows))
    jobs = [Job(case.loaded, curves=("force",)) for case in load_table(tmp_path / "table.csv")]
    found = [bits(run_rows(jobs, workers=1)), bits(run_rows(jobs, workers=2))]
    found.append(bits(run_rows(jobs, on=cluster.scheduler_address)))
    assert found[0] == found[1] == found[2]
    assert [number for number, *_ in found[0]] == [0, 1, 2, 3, 4]
    assert all(numbers["peak_force"] and curve and not error for _, numbers, curve, error in found[0])
    out = tmp_path / "out"
    command = ["table", str(tmp_path / "table.csv"), "--out", str(out), "--on", cluster.scheduler_address]
    assert CliRunner().invoke(cli, command).exit_code == 0
    assert not [path for path in out.iterdir() if path.is_dir()]  # the workers write nothing


@pytest.mark.nightly
def test_a_worker_that_is_killed_loses_no_job(cluster: distributed.LocalCluster) -> None:
    jobs = ["(__import__('time').sleep(0.1), __import__('os').getpid())[1]"] * 40
    with closing(run_jobs(eval, jobs, on=cluster.scheduler_address)) as outcomes:
        first = next(outcomes)
        os.kill(first.value, signal.SIGKILL)
        found = [first, *outcomes]
    assert sorted(outcome.job for outcome in found) == list(range(40))
    assert all(outcome.value and not outcome.error for outcome in found)


@pytest.mark.nightly
def test_the_end_of_the_scheduler_is_one_line(cluster: distributed.LocalCluster) -> None:
    jobs = (f"(__import__('time').sleep(0.1), {k})[1]" for k in range(10**6))
    with closing(run_jobs(eval, jobs, on=cluster.scheduler_address)) as outcomes:
        assert next(outcomes).error is None
        cluster.close()
        with pytest.raises(CaseError, match="the scheduler is gone; the finished jobs are kept, --resume runs the others"):
            list(outcomes)


@pytest.mark.nightly
def test_jobs_of_slurm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for sbatch runs the job on this machine; as sbatch it keeps the script, whose file is deleted at once."""
    dask = pytest.importorskip("dask")
    pytest.importorskip("dask_jobqueue")
    starts = 'echo "Submitted batch job 7"\ncp "$1" "$0.job"\nsh "$0.job" >/dev/null 2>&1 </dev/null &\n'
    for name, text in (("sbatch", starts), ("scancel", "")):
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}")
        (tmp_path / name).chmod(stat.S_IRWXU)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    own = {"cores": 1, "memory": "1GiB", "interface": "lo", "local-directory": str(tmp_path), "death-timeout": 60}
    with dask.config.set({f"jobqueue.slurm.{key}": value for key, value in own.items()}):
        found = list(run_jobs(eval, ["6 * 7", "1 / 0"], workers=1, on="slurm"))
    assert [(outcome.value, bool(outcome.error)) for outcome in sorted(found, key=lambda one: one.job)] == [
        (42, False), (None, True),
    ]  # fmt: skip


def test_no_cluster_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fsm.run.cluster._WAIT", 0.3)
    with pytest.raises(CaseError, match=r"--on tcp://127\.0\.0\.1:1: no cluster there \(.*\); start one"):
        list(run_jobs(eval, ["1"], on="tcp://127.0.0.1:1"))


def test_a_worker_with_another_fsm_ends_the_jobs(monkeypatch: pytest.MonkeyPatch) -> None:
    """The line names what differs; such a worker runs no job."""
    other, outcomes, _ = run_chunk(b"", 1, made_by() | {"fsm": "0.1.0", "numpy": "1.0"})
    assert "has fsm " in other and ", here 0.1.0; numpy " in other and not outcomes
    monkeypatch.setattr("fsm.run.workers.made_by", lambda: made_by() | {"fsm": "0.1.0"})
    with pytest.raises(CaseError, match=r"a worker has another fsm: .* here 0\.1\.0; install the same versions"):
        list(run_jobs(eval, ["1"], 1))
