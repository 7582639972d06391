"""Garbage collection at the start and at the end of a process, and a quick import of Matplotlib and numba.

Imports create about 150 000 objects that live until the process ends. The search for garbage among these
objects took one second of a run of four seconds. Objects created later are collected as usual.

Only the command line and the workers of a table may use this module, because it changes the state of the process.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_THRESHOLDS = (50_000, 20, 100)
"""New objects, and collections of younger objects, after which the garbage of each generation is collected."""
_MOST_KEPT = 100
"""Number of calls of `keep_garbage` that have an effect, after the first `imports_outside_gc` of a process."""
_settled: list[bool] = []
"""Not empty after the first chunk of a worker."""
_left: list[int] = []
"""Number of calls that still have an effect; empty before `imports_outside_gc`."""


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
            if not _left:
                _left.append(_MOST_KEPT)
        gc.enable()


def keep_garbage() -> None:
    """Exclude the objects that a compilation leaves from garbage collection, in processes of the command line.

    Their collection would take a tenth of the time of a compilation; without collection they occupy 4 MB. After many calls
    the function has no effect, because it would also keep results of earlier runs in the same process.
    """
    if _left and _left[0] > 0:
        _left[0] -= 1
        gc.freeze()


@contextmanager
def plain_matplotlib() -> Iterator[None]:
    """Import Matplotlib within the block without the tables of properties in its docstrings and in signatures of `set`.

    The tables take half of the import time.
    """
    if "matplotlib.artist" in sys.modules:
        yield
        return
    import matplotlib.artist

    # Matplotlib calls this for each subclass
    name, artist = "_update_set_signature_and_docstring", matplotlib.artist.Artist
    table, signature = matplotlib.artist.kwdoc, vars(artist)[name]
    matplotlib.artist.kwdoc = lambda artist: ""
    setattr(artist, name, lambda: None)
    try:
        yield
    finally:
        matplotlib.artist.kwdoc = table
        setattr(artist, name, signature)


def import_numba() -> None:
    """Import numba without SciPy, of which it checks the version, and YAML, for a file of settings in the current folder."""
    if "numba" in sys.modules or os.path.exists(".numba_config.yaml"):
        return
    left_out = {"scipy", "yaml"} - sys.modules.keys()
    sys.modules.update(dict.fromkeys(left_out))  # type: ignore[arg-type]
    try:
        import numba  # noqa: F401
    finally:
        for name in left_out:
            del sys.modules[name]


@contextmanager
def chunk_of_jobs() -> Iterator[None]:
    """Collect garbage rarely within the block, and all of it at its end, which keeps the memory of a worker constant.

    Modules and other objects that live after the first chunk are excluded from later collections, so these take 2 ms.
    """
    before = gc.get_threshold()
    gc.set_threshold(*_THRESHOLDS)
    try:
        yield
    finally:
        gc.collect()
        if not _settled:
            _settled.append(True)
            gc.freeze()
        gc.set_threshold(*before)


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
