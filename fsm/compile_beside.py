"""Compilation on a second processor: a helper process compiles kernels that this process needs later.

    python -m fsm.compile_beside (--case CASE.toml [KEY=VALUE ...] | KIND ...)

Each kernel is compiled by one of the two, and the other loads it from the cache (`fsm.kernels.compile_lock`). The helper
begins with the linear solver and then compiles kernels in the reverse of the order in which a run needs them. It ends when
its standard input is closed, so that it does not survive the process that started it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

from fsm.kernels import jit

__all__ = ["compiled_beside"]

_FEW = 3
"""Number of kernels that a process compiles before it starts a helper, which needs a second to start."""


@contextmanager
def compiled_beside(arguments: Sequence[str]) -> Iterator[None]:
    """Start a helper, if kernels are compiled in this block, and end it behind the block.

    Parameters
    ----------
    arguments : sequence of str
        Arguments of the helper, see the head of this module.
    """
    helper, compiled = list[subprocess.Popen[bytes]](), 0

    def count(name: str) -> None:
        nonlocal compiled
        compiled += name.startswith("fsm.")
        if compiled == _FEW:
            helper.append(_started(arguments))

    several = _processors() > 1 and jit.cache_folder() is not None
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
    command = [sys.executable, "-m", "fsm.compile_beside", *arguments]
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet, start_new_session=True)


def _processors() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _end_with_input() -> None:
    """End this process when its standard input is closed."""
    with suppress(OSError, ValueError):
        sys.stdin.buffer.read()
    os._exit(0)


def _main(arguments: Sequence[str]) -> None:
    """Compile kernels until all are compiled, or until the standard input is closed."""
    threading.Thread(target=_end_with_input, daemon=True).start()
    from fsm.warm_up import KINDS, compile_linear_solver

    kinds = list(arguments)
    compile_linear_solver()
    if kinds and kinds[0] == "--case":
        from fsm.analyses.choose import analysis_of
        from fsm.scene.load_case import load_case

        kinds = list(analysis_of(load_case(kinds[1], kinds[2:]).case).kernels)
    for kind in reversed(kinds):
        for use in KINDS[kind]:
            use()


if __name__ == "__main__":
    _main(sys.argv[1:])
