"""Atomic writing: a file appears complete or not at all, even if the program is killed or the write fails."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["remove_partial_files", "atomic_write"]


@contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """Write to a temporary file that replaces `path` when the block ends without an error.

    Parameters
    ----------
    path : str or Path
        Final file. The temporary file of ``force.png`` is ``.force.part.png``, with the same suffix. If the process is
        killed, the temporary file remains; `remove_partial_files` deletes it.

    Yields
    ------
    Path
        Temporary file to write to.
    """
    target = Path(path)
    part = target.with_name(f".{target.stem}.part{target.suffix}")
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder, not a file; remove or rename the folder", str(target))
    try:
        yield part
        _put_in_place(part, target)
    except OSError as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        if error.filename == str(part):
            raise type(error)(error.errno, error.strerror, str(target)) from error
        raise
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def remove_partial_files(folder: Path) -> None:
    """Delete temporary files that remain from a process that was killed."""
    for part in folder.glob(".*.part*"):
        part.unlink(missing_ok=True)


def _put_in_place(source: Path, target: Path) -> None:
    """Rename a file after its data are on disk, and then flush the folder entry."""
    with source.open("rb+") as file:
        os.fsync(file.fileno())
    os.replace(source, target)
    if os.name == "posix":
        folder = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
