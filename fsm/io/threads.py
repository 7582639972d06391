"""Number of processors, and one thread for linear algebra, both in the command line and in the workers of a table.

The number of threads changes the order of sums, and so the last bits of a result. The matrices are small, so a second
thread saves no time. The linear algebra libraries read their number of threads from environment variables
(`OMP_NUM_THREADS` and others) when they are imported. These variables must therefore be set before the import.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit libraries that are imported within the block, and processes started there, to one thread."""
    before = {name: os.environ.get(name) for name in _VARIABLES}
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def processors() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
