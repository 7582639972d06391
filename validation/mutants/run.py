"""Run tests on a copy of the repository, with and without a mutant."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from validation.mutants.mutant import Mutant

__all__ = ["CAUGHT", "GUARD_FAILS", "SURVIVED", "judge", "work_copy"]

CAUGHT, SURVIVED, GUARD_FAILS = "caught", "survived", "guard fails without mutant"
REPOSITORY = Path(__file__).parents[2]
LONGEST = 1200.0
"""For a guard, s; a mutant that makes it run longer is caught."""
_FAILED = 1
"""Exit code of pytest where tests fail; any other but 0 is no verdict."""


@contextmanager
def work_copy() -> Iterator[Path]:
    """Copy of the files that git tracks, in their present state in the work tree."""
    listed = subprocess.run(["git", "-C", str(REPOSITORY), "ls-files", "-z"], capture_output=True, check=True).stdout
    with tempfile.TemporaryDirectory(prefix="fsm_mutants_") as folder:
        root = Path(folder)
        for name in filter(None, listed.decode().split("\0")):
            if (REPOSITORY / name).is_file():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(REPOSITORY / name, root / name)
        yield root


def judge(mutant: Mutant, root: Path) -> tuple[str, str]:
    """Verdict and first failure: the test is run with the mutant and, if the test fails, without it."""
    path = root / mutant.file
    whole = path.read_text(encoding="utf-8")
    path.write_text(mutant.changed(whole), encoding="utf-8")
    try:
        good, told = _guards_hold(mutant, root)
    finally:
        path.write_text(whole, encoding="utf-8")
    if good:
        return SURVIVED, ""
    good, without = _guards_hold(mutant, root)
    return (CAUGHT, told) if good else (GUARD_FAILS, without)


def _guards_hold(mutant: Mutant, root: Path) -> tuple[bool, str]:
    return _run(["pytest", "-q", "-x", "--tb=no", "-p", "no:cacheprovider", *mutant.guard], root)


def _run(command: list[str], root: Path) -> tuple[bool, str]:
    environment = os.environ | {
        "PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1",
    }  # fmt: skip
    try:
        done = subprocess.run(
            [sys.executable, "-m", *command], cwd=root, env=environment, capture_output=True, text=True, timeout=LONGEST
        )
    except subprocess.TimeoutExpired:
        return False, f"longer than {LONGEST:g} s"
    if done.returncode not in (0, _FAILED):
        raise RuntimeError(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    failed = [line.strip() for line in done.stdout.splitlines() if line.strip().startswith(("FAILED", "ERROR"))]
    return done.returncode == 0, failed[0] if failed else ""
