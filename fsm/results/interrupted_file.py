"""Reading of an HDF5 file whose writer was killed or is still running.

HDF5 marks a file that is open for writing, and refuses to open a marked file again. The SWMR mode (single writer,
multiple readers) would open it, but retries a damaged block with ever longer pauses, practically without end.
This module copies the file to memory, clears the marks in the first block, and reads the copy.
Flushed data are consistent on disk, because the writer uses SWMR mode.
"""

from __future__ import annotations

import io
import struct
from pathlib import Path

from fsm.io.hdf5_checked import SIGNATURE

SUPERBLOCK = struct.Struct("<8sBBBBQQQQ")
"""First block: signature, version (3), sizes (offsets, lengths), marks, base, extension, end, root; a checksum follows."""
CHECKSUM = struct.Struct("<I")


def is_marked_open(path: Path) -> bool:
    """Whether a file is marked as open for writing; only HDF5 files with superblock 3, as `fsm` writes them, are."""
    with path.open("rb") as file:
        head = file.read(SUPERBLOCK.size + CHECKSUM.size)
    if len(head) < SUPERBLOCK.size + CHECKSUM.size:
        return False
    signature, version, offsets, _, marks, *_ = SUPERBLOCK.unpack_from(head)
    return bool(signature == SIGNATURE and version == 3 and offsets == 8 and marks)


def without_open_marks(path: Path) -> io.BytesIO:
    """Copy in memory of a file that is marked open, with the marks cleared and the end of file corrected."""
    data = bytearray(path.read_bytes())
    signature, version, offsets, lengths, _, base, extension, end, root = SUPERBLOCK.unpack_from(data)
    fields = (signature, version, offsets, lengths, 0, base, extension, max(end, len(data)), root)
    SUPERBLOCK.pack_into(data, 0, *fields)
    CHECKSUM.pack_into(data, SUPERBLOCK.size, checksum(bytes(data[: SUPERBLOCK.size])))
    return io.BytesIO(data)


def checksum(data: bytes) -> int:
    """Checksum of HDF5 metadata: Bob Jenkins' lookup3 (`hashlittle`), starting from 0."""
    a = b = c = (0xDEADBEEF + len(data)) & 0xFFFFFFFF
    words = struct.unpack(f"<{-(-len(data) // 12) * 3}I", data.ljust(-(-len(data) // 12) * 12, b"\0"))
    for i in range(0, len(words), 3):
        a, b, c = _add(a, words[i]), _add(b, words[i + 1]), _add(c, words[i + 2])
        if i + 3 < len(words):
            a, b, c = _mix(a, b, c)
    return _final(a, b, c) if data else c


def _add(x: int, y: int) -> int:
    return (x + y) & 0xFFFFFFFF


def _rotate_left(x: int, bits: int) -> int:
    return ((x << bits) | (x >> (32 - bits))) & 0xFFFFFFFF


def _mix(a: int, b: int, c: int) -> tuple[int, int, int]:
    for bits in (4, 6, 8, 16, 19, 4):  # each pass is one line of lookup3's mix(), and the three names rotate
        a, c = ((a - c) & 0xFFFFFFFF) ^ _rotate_left(c, bits), _add(c, b)
        a, b, c = b, c, a
    return a, b, c


def _final(a: int, b: int, c: int) -> int:
    for bits in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _rotate_left(b, bits)) & 0xFFFFFFFF
        a, b, c = b, c, a
    return b
