"""Atomic writing: a file appears complete or not at all, even if the program is killed or the write fails."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def atomic_write(path: str | Path, *, to_disk: bool = False) -> Iterator[Path]:
    """Write to a temporary file that replaces `path` when the block ends without an error.

    Parameters
    ----------
    path : str or Path
        Final file. The temporary file of ``force.png`` is ``.force.part.png``, with the same suffix. If the process is
        killed, the temporary file remains; `remove_partial_files` deletes it. A symbolic link remains, and the file that it
        names is replaced.
    to_disk : bool
        Wait until the file is on the disk, so that it also survives a power failure. Files that can be written again from a
        results file do not need this.

    Raises
    ------
    OSError
        The path is a folder, a device, a pipe or a socket, or the file cannot be written.

    Yields
    ------
    Path
        Temporary file to write to.
    """
    target = file_to_replace(path)
    part = target.with_name(f".{target.stem}.part{target.suffix}")
    try:
        yield part
        if to_disk:
            with part.open("rb+") as file:
                os.fsync(file.fileno())
        os.replace(part, target)
        if to_disk and os.name == "posix":
            _flush_entries(target.parent)
    except OSError as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        if error.errno is not None and error.filename in (None, str(part)):  # a full disk names no file
            raise type(error)(error.errno, error.strerror, str(target)) from error
        raise
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def file_to_replace(path: str | Path) -> Path:
    """File that a path names after all symbolic links; an `OSError` if it is anything but a file or a free name."""
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder, not a file; remove or rename the folder", str(path))
    if target.exists() and not target.is_file():
        kinds = {stat.S_IFIFO: "pipe", stat.S_IFSOCK: "socket"}
        kind = kinds.get(stat.S_IFMT(target.stat().st_mode), "device")
        raise OSError(errno.EEXIST, f"is a {kind}, not a file; give the name of a file", str(path))
    return target


def remove_partial_files(folder: Path) -> None:
    """Delete temporary files that remain from a process that was killed."""
    for part in folder.glob(".*.part*"):
        part.unlink(missing_ok=True)


def _flush_entries(folder: Path) -> None:
    """Wait until the names in a folder are on the disk."""
    entry = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(entry)
    finally:
        os.close(entry)
