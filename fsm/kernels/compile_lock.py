"""Lock of a kernel in the cache: one process compiles it, and other processes wait for the entry."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Final

from fsm.kernels.cache_folder import create_folder

try:
    import fcntl
except ImportError:  # on Windows each process compiles its own kernels
    fcntl = None  # type: ignore[assignment, unused-ignore]

_LONGEST: Final = 60.0
"""Longest time to wait for another process, s; the kernel is then compiled here, too."""
_POLL: Final = 0.005
"""Time between attempts, s."""
_waited = [0.0]


def waited() -> float:
    """Return the time that this process has waited for kernels that other processes compiled, s."""
    return _waited[0]


class CompileLock:
    """Lock by a file that the system releases when its process ends.

    Parameters
    ----------
    file : Path
        The file is created, and remains in the cache.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._descriptor = -1

    def acquire(self) -> bool:
        """Wait for the lock; return whether another process held it, so that the cache may have the entry now."""
        if fcntl is None or self._descriptor >= 0:
            return False
        try:
            create_folder(self._file.parent)
            self._descriptor = os.open(self._file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError:  # nothing can be written, so the kernel is not cached
            return False
        begun, others = time.perf_counter(), False
        while not self._taken():
            others = True
            if time.perf_counter() - begun > _LONGEST:
                break
            time.sleep(_POLL)
        _waited[0] += time.perf_counter() - begun if others else 0.0
        return others

    def is_taken(self) -> bool:
        """Whether another process holds the lock."""
        if fcntl is None or self._descriptor >= 0:
            return False
        try:
            descriptor = os.open(self._file, os.O_RDWR | os.O_CLOEXEC)
        except OSError:
            return False
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:  # a file system without locks
            pass
        finally:
            os.close(descriptor)
        return False

    def release(self) -> None:
        """Release the lock, if this process holds it."""
        if self._descriptor >= 0:
            with suppress(OSError):
                os.close(self._descriptor)
            self._descriptor = -1

    def _taken(self) -> bool:
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:  # a file system without locks
            pass
        return True
