"""Garbage collection at the start and at the end of a process, and a quick import of Matplotlib.

Imports create about 150 000 objects that live until the process ends. The search for garbage among these
objects took one second of a run of four seconds. Objects created later are collected as usual.

Only the command line and the workers of a table may use this module, because it changes the state of the process.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["imports_outside_gc", "plain_matplotlib", "rare_gc"]

_THRESHOLDS = (50_000, 20, 100)
"""New objects, and collections of younger objects, after which the garbage of each generation is collected."""


@contextmanager
def imports_outside_gc() -> Iterator[None]:
    """Exclude objects that the block imports from garbage collection, permanently.

    The block has no effect if it imports no new module.
    """
    before = len(sys.modules)
    gc.disable()
    try:
        yield
    finally:
        if len(sys.modules) > before:
            gc.freeze()
        gc.enable()


@contextmanager
def plain_matplotlib() -> Iterator[None]:
    """Import Matplotlib within the block without the tables of properties in its docstrings, which take half of the time."""
    if "matplotlib.artist" in sys.modules:
        yield
        return
    import matplotlib.artist

    table = matplotlib.artist.kwdoc
    matplotlib.artist.kwdoc = lambda artist: ""
    try:
        yield
    finally:
        matplotlib.artist.kwdoc = table


@contextmanager
def rare_gc() -> Iterator[None]:
    """Collect garbage rarely within the block, and not at the end of the process.

    Figures and compilations create many objects without cycles. The operating system frees the memory at the end.
    """
    before = gc.get_threshold()
    gc.set_threshold(*_THRESHOLDS)
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.freeze()
