"""The helper process that compiles kernels during a run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fsm.run.compile_beside import _started


def test_a_helper_ends_when_its_standard_input_is_closed(tmp_path: Path) -> None:
    """Otherwise the process would survive a run that is killed."""
    command = [sys.executable, "-m", "fsm.run.compile_helper", "lattice"]
    quiet, environment = subprocess.DEVNULL, os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet, env=environment) as helper:
        assert helper.stdin is not None
        helper.stdin.close()
        assert helper.wait(60.0) == 0


@pytest.mark.nightly
def test_a_helper_imports_nothing_from_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A script of a user can have the name of a module of Python."""
    for name in ("json", "statistics", "fractions", "queue"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit(3)\n")
    monkeypatch.chdir(tmp_path)
    helper = _started([])  # the process compiles the linear solver, and ends
    assert helper.wait(120.0) == 0
    assert helper.stdin is not None
    helper.stdin.close()
