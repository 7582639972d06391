"""Helper process that compiles kernels; another process needs them later (see `fsm.run.compile_beside`).

    python -m fsm.run.compile_helper (--case CASE.toml [KEY=VALUE ...] | KIND ...)

It begins with the linear solver and then compiles kernels in the reverse of the order in which a run needs them. The process
ends when its standard input is closed, so that it does not survive the process that started it.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress

from fsm.analyses.choose import analysis_of
from fsm.case.loading.load_case import load_case
from fsm.kernels.pointers import compile_backwards
from fsm.run.warm_up import KINDS, compile_linear_solver


def _end_with_input() -> None:
    """End this process when its standard input is closed."""
    with suppress(OSError):
        while os.read(0, 1024):  # sys.stdin has a lock, which would abort the end of this process
            pass
    os._exit(0)


def main(arguments: Sequence[str]) -> None:
    """Compile kernels until all are compiled, or until the standard input is closed."""
    threading.Thread(target=_end_with_input, daemon=True).start()
    kinds = list(arguments)
    compile_backwards()
    compile_linear_solver()
    if kinds and kinds[0] == "--case":
        kinds = list(analysis_of(load_case(kinds[1], kinds[2:]).case).kernels)
    for kind in reversed(kinds):
        for use in KINDS[kind]:
            use()


if __name__ == "__main__":
    main(sys.argv[1:])
