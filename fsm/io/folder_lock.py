"""Lock on a results folder: only one run at a time writes there."""

from __future__ import annotations

import getpass
import os
import platform
import shlex
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from fsm.errors import CannotWrite

if sys.platform != "win32":
    import fcntl

LOCK = ".fsm.lock"
"""Name of the lock file. The file names its owner in one line; the file is removed when the owner ends."""

ENDING = 30.0
"""Time that a restarted run waits until the interrupted run has written its checkpoint, s."""
_POLL = 0.1
"""Seconds between two attempts."""


@contextmanager
def locked_folder(folder: str | Path, wait: float = 0.0) -> Iterator[None]:
    """Lock a folder against other runs while the block runs; on Windows there is no lock.

    The operating system releases the lock when its owner ends, also after a crash. A folder made for the lock is removed
    if it is still empty at the end.

    Parameters
    ----------
    folder : str or Path
        The folder is created if it does not exist.
    wait : float
        Time to wait for the release of the lock, s.

    Raises
    ------
    CannotWrite
        Another run holds the lock; the message names this run.
    """
    folder = Path(folder)
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    file = _acquired(folder / LOCK, time.monotonic() + wait)
    try:
        yield
    finally:
        if file is not None:
            (folder / LOCK).unlink(missing_ok=True)
            file.close()
        with suppress(OSError):  # not empty
            for place in made:
                place.rmdir()


def _acquired(path: Path, deadline: float) -> Any:
    """Open lock file that this process owns; None if the file system has no locks."""
    if sys.platform == "win32":
        return None
    while True:
        file = path.open("a+", encoding="utf-8", errors="backslashreplace")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.seek(0)
            owner = file.read(1000).strip() or "another run"
            file.close()
            if time.monotonic() < deadline:
                time.sleep(_POLL)
                continue
            raise CannotWrite(
                f"{path.parent}: {owner} writes its results there; wait until that run ends, or give another folder"
            ) from None
        except OSError:
            file.close()
            return None
        if _is_in_place(file, path):
            file.truncate(0)
            file.write(_owner() + "\n")
            file.flush()
            return file
        file.close()  # the previous owner removed the file before it was locked here


def _is_in_place(file: Any, path: Path) -> bool:
    """Whether the path still names the open file."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except FileNotFoundError:
        return False


def _owner() -> str:
    """Description of this process: number, user, computer, time and command."""
    try:
        user = getpass.getuser()
    except (OSError, KeyError):
        user = str(os.getuid()) if sys.platform != "win32" else "unknown"
    command = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])[:200]
    return f"process {os.getpid()} of {user} on {platform.node()}, since {time.strftime('%d %B %H:%M:%S')} ({command}),"
