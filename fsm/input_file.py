"""Input files read whole, if they are regular files of a size that input can have."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

__all__ = ["MOST_BYTES", "read_input_file", "read_failure"]

MOST_BYTES = 64 * 2**20
"""Size of a file of measured rows, at most, bytes."""


def read_input_file(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """Bytes of a file.

    Parameters
    ----------
    path : str or Path
    most : int
        Size at most, bytes.

    Raises
    ------
    OSError
        It cannot be read, is a pipe, a device or a folder, which may have no end, or is larger.
    """
    # without O_NONBLOCK, opening a pipe waits for its other end
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "it is a pipe or a device; write it to a file first", str(path))
        data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it is larger than {most / 2**20:g} MB; give a smaller file", str(path))
    return data


def read_failure(error: OSError | ValueError) -> str:
    """Why a file cannot be read, to stand within a sentence; a name with a null byte is a ValueError."""
    text = (error.strerror if isinstance(error, OSError) else None) or str(error)
    return text[:1].lower() + text[1:]
