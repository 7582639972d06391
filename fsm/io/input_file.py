"""Reading of input files: regular files of bounded size only."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

MOST_BYTES = 64 * 2**20
"""Largest size of a file of measured rows, bytes."""


def read_input_file(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """Bytes of a file.

    Parameters
    ----------
    path : str or Path
    most : int
        Largest size accepted, bytes.

    Raises
    ------
    OSError
        The file cannot be read, is no regular file (a pipe or a device may have no end), or is too large.
    """
    # without O_NONBLOCK, opening a pipe waits until another process writes to it
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file; write its content to a file first", str(path))
        data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it is larger than {most / 2**20:g} MB, the limit; give a smaller file", str(path))
    return data


def read_failure(error: OSError | ValueError) -> str:
    """Reason why a file cannot be read, as a part of a sentence; a name with a null byte raises a ValueError."""
    text = (error.strerror if isinstance(error, OSError) else None) or str(error)
    return text[:1].lower() + text[1:]
