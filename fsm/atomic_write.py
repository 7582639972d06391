"""Files that are there whole or not at all, whenever the program is killed and whatever fails while they are written."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["remove_partial_files", "atomic_write"]


@contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """A file beside `path` to write to, which takes its name and place when the block ends without an error.

    Parameters
    ----------
    path : where the file goes
        Until then ``force.png`` is ``.force.part.png``: programs that look at the suffix see the same one.
        What a kill leaves of it goes with `remove_partial_files`.
    """
    target = Path(path)
    part = target.with_name(f".{target.stem}.part{target.suffix}")
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder, where a file is to be written; remove or rename it", str(target))
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
    """Take away what a kill left of files that were being written."""
    for part in folder.glob(".*.part*"):
        part.unlink(missing_ok=True)


def _put_in_place(source: Path, target: Path) -> None:
    """Rename with the data and then the name on disk."""
    with source.open("rb+") as file:
        os.fsync(file.fileno())
    os.replace(source, target)
    if os.name == "posix":
        folder = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
