"""Locations that cannot be written to: a full disk, a folder without write permission, a cache that cannot be stored; and
Ctrl-C."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from fsm.results.store import read_solution
from validation.faults.kills import CASES

__all__ = ["FAULTS"]

_SMALL = ["strip.segments_per_panel=2", "drive.0.travel=4 mm", "save.every=0.1 mm"]
_PATIENCE = 300.0


def _command(out: Path, *more: str) -> list[str]:
    options = [word for text in (*_SMALL, *more) for word in ("--set", text)]
    return [sys.executable, "-m", "fsm", "run", str(CASES / "strip_pull/case.toml"), "--out", str(out), *options]


def _ended(
    command: list[str], environment: dict[str, str] | None = None, largest_file: int | None = None
) -> tuple[int, str]:
    """Exit code and output of a command; a write beyond `largest_file` bytes fails as on a full disk."""

    def limit() -> None:
        if largest_file is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a write beyond this size fails, as on a full disk

    variables = {**os.environ, **(environment or {})}
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=_PATIENCE, env=variables, preexec_fn=limit
    )
    return done.returncode, done.stderr


def full_disk(folder: Path) -> str:
    """Files may have at most 60 kB: the results cannot be stored, one line states this, and no file looks complete."""
    out = folder / "out"
    unmeasured = {"COVERAGE_PROCESS_CONFIG": ""}  # the measurement of coverage would also hit the limit of the disk
    code, said = _ended([*_command(out, "strip.segments_per_panel=20"), "--quiet"], unmeasured, largest_file=60_000)
    if code != 2 or "Traceback" in said or len(said.splitlines()) != 1:
        return f"exit code {code}: {said[-300:]}"
    left = [name for name in ("result.h5", "summary.json") if (out / name).exists()]
    return f"left behind: {left}" if left else ""


def read_only_folder(folder: Path) -> str:
    """A folder on a read-only file system, to which even root cannot write."""
    code, said = _ended([*_command(Path("/proc/fsm/out")), "--quiet"])
    clear = code == 2 and "Traceback" not in said and len(said.splitlines()) == 1
    return "" if clear else f"exit code {code}: {said[-300:]}"


def no_cache(folder: Path) -> str:
    """The folder of compiled kernels cannot be created: the run is slower, with the same results."""
    environment = {"NUMBA_CACHE_DIR": "/proc/fsm/cache", "HOME": "/proc/fsm", "XDG_CACHE_HOME": "/proc/fsm"}
    code, said = _ended([*_command(folder / "out"), "--quiet"], environment)
    return "" if code == 0 and (folder / "out/summary.json").is_file() else f"exit code {code}: {said[-300:]}"


def cache_taken_away(folder: Path) -> str:
    """The folder of compiled kernels is deleted while the program runs."""
    cache = folder / "cache"
    variables = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    command = [*_command(folder / "out"), "--quiet"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=variables)
    while process.poll() is None:
        time.sleep(0.5)
        shutil.rmtree(cache, ignore_errors=True)
    said = process.communicate()[1]
    return "" if process.returncode == 0 else f"exit code {process.returncode}: {said[-300:]}"


def interrupted(folder: Path) -> str:
    """Ctrl-C gives exit code 130 and a readable file, and --resume completes the run."""
    out = folder / "out"
    command = _command(out, "solve.method=generalized-alpha", "drive.0.travel=10 mm")
    process = subprocess.Popen([*command, "--quiet"], stderr=subprocess.PIPE, text=True)
    begun = time.monotonic()
    while not (out / "result.part.h5").exists() and process.poll() is None and time.monotonic() - begun < _PATIENCE:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    said = process.communicate()[1]
    if process.returncode != 130 or "Traceback" in said:
        return f"exit code {process.returncode}: {said[-300:]}"
    kept = len(read_solution(out / "result.part.h5"))
    code, said = _ended([*command, "--resume", "--quiet"])
    return "" if code == 0 and kept and (out / "summary.json").is_file() else f"resumed: exit code {code}: {said[-300:]}"


FAULTS: dict[str, Callable[[Path], str]] = {
    "full disk": full_disk,
    "read-only folder": read_only_folder,
    "no cache": no_cache,
    "cache taken away": cache_taken_away,
    "Ctrl-C": interrupted,
}
"""Name, and function that tries to write in an empty folder; it returns the fault as text, empty if there is none."""
