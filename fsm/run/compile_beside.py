"""Compilation on a second processor: a helper process compiles kernels that this process needs later.

Each kernel is compiled by one of the two, and the other loads it from the cache (`fsm.kernels.compile_lock`).
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fsm.io.threads import processors
from fsm.kernels import jit
from fsm.kernels.cache_folder import cache_folder

_FEW = 3
"""Number of kernels that a process compiles before it starts a helper, which needs a second to start."""


@contextmanager
def compiled_beside(arguments: Sequence[str]) -> Iterator[None]:
    """Start a helper, if kernels are compiled in this block, and end it behind the block.

    Parameters
    ----------
    arguments : sequence of str
        Arguments of the helper, see `fsm.run.compile_helper`.
    """
    helper, compiled = list[subprocess.Popen[bytes]](), 0

    def count(name: str) -> None:
        nonlocal compiled
        compiled += name.startswith("fsm.")
        if compiled == _FEW:
            helper.append(_started(arguments))

    several = processors() > 1 and cache_folder() is not None
    unsubscribe = jit.on_compile(count) if several else lambda: None
    try:
        yield
    finally:
        unsubscribe()
        for process in helper:
            process.kill()
            process.wait()
            if process.stdin is not None:
                process.stdin.close()


def _started(arguments: Sequence[str]) -> subprocess.Popen[bytes]:
    # with -P the helper imports nothing from the current folder, where a script may have the name of a module
    command = [sys.executable, "-P", "-m", "fsm.run.compile_helper", *arguments]
    quiet, folders = subprocess.DEVNULL, os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet, start_new_session=True,
        env=os.environ | {"PYTHONPATH": folders.strip(os.pathsep)},
    )  # fmt: skip
