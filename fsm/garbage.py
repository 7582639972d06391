"""Python's search for garbage in processes that are ours alone: seldom, and not at the end.

Some 150 000 objects come with the libraries and stay. Looked through at the usual rate while they are imported, and once
more when the process ends, they took a second of a run of four.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["seldom"]

_AFTER = (50_000, 20, 100)
"""New objects after which the young ones are looked through, such looks after which older ones are, and the oldest."""


@contextmanager
def seldom() -> Iterator[None]:
    """All that a process does. A library has no business here: the process is another's."""
    gc.set_threshold(*_AFTER)
    try:
        yield
    finally:
        gc.freeze()  # what is left goes with the process
