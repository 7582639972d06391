"""A lock on a folder of results: one run at a time writes there."""

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

__all__ = ["LOCK", "locked_folder"]

LOCK = ".fsm.lock"
"""Name of the lock file. It holds a line that names its owner, and is removed when the owner ends."""

_POLL = 0.1
"""Seconds between two attempts."""


@contextmanager
def locked_folder(folder: str | Path, wait: float = 0.0) -> Iterator[None]:
    """Keep other runs from writing into a folder; on Windows the folder is not locked.

    The operating system ends the lock when its owner ends, however that happens. A folder made for the lock is removed
    again if nothing has been written into it.

    Parameters
    ----------
    folder : str or Path
        Made if needed.
    wait : float
        Seconds to wait for an owner that is about to end.

    Raises
    ------
    CannotWrite
        Another run writes there; the message names it.
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
    """Open lock file that this process owns, with its name in it; None where the file system has no locks."""
    if sys.platform == "win32":
        return None
    while True:
        file = path.open("a+", encoding="utf-8")
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
                f"{path.parent}: {owner} writes its results there; wait until it ends, or give another folder"
            ) from None
        except OSError:
            file.close()
            return None
        if _is_in_place(file, path):
            file.truncate(0)
            file.write(_owner() + "\n")
            file.flush()
            return file
        file.close()  # its last owner removed it before it was locked here


def _is_in_place(file: Any, path: Path) -> bool:
    """Whether the open file is still the one of this name."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except FileNotFoundError:
        return False


def _owner() -> str:
    """Process, user, computer, start and command of this process."""
    try:
        user = getpass.getuser()
    except (OSError, KeyError):
        user = str(os.getuid()) if sys.platform != "win32" else "unknown"
    command = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])[:200]
    return f"process {os.getpid()} of {user} on {platform.node()}, since {time.strftime('%d %B %H:%M:%S')} ({command}),"
