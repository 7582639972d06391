"""Python's search for garbage in processes that are ours alone: not in what the libraries bring, and not at the end.

Some 150 000 objects come with the libraries and stay. Looked through again and again while they are imported, and once
more when the process ends, they took a second of a run of four. What comes later is looked through as ever.

A library has no business here: only the command line and the workers of a table may use this.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["imports_outside_gc", "skip_final_gc"]


@contextmanager
def imports_outside_gc() -> Iterator[None]:
    """Imports, whose objects are never looked through; nothing where all has been imported before."""
    before = len(sys.modules)
    gc.disable()
    try:
        yield
    finally:
        if len(sys.modules) > before:
            gc.freeze()
        gc.enable()


@contextmanager
def skip_final_gc() -> Iterator[None]:
    """All that a process does: what is left goes with it."""
    try:
        yield
    finally:
        gc.freeze()
