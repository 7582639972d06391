"""Reading an HDF5 file whose writer was killed, or is still at work.

HDF5 marks a file that is open for writing and refuses to open it afterwards; in its own way round that (SWMR
reading) it tries a damaged block again and again, with pauses that double, practically for ever. So: take a
copy in memory, take the marks off its first block, and read that. What was flushed is consistent on disk: the
writer is in SWMR mode.
"""

from __future__ import annotations

import io
import struct
from pathlib import Path

from fsm.hdf5_checked import SIGNATURE

__all__ = ["checksum", "is_marked_open", "unmarked"]

SUPERBLOCK = struct.Struct("<8sBBBBQQQQ")
"""Signature, version (3), sizes (offsets, lengths), marks, base, extension, end, root; then a checksum."""
CHECKSUM = struct.Struct("<I")


def is_marked_open(path: Path) -> bool:
    """Whether a file says that it is open for writing; only HDF5 files like ours (superblock 3) say so."""
    with path.open("rb") as file:
        head = file.read(SUPERBLOCK.size + CHECKSUM.size)
    if len(head) < SUPERBLOCK.size + CHECKSUM.size:
        return False
    signature, version, offsets, _, marks, *_ = SUPERBLOCK.unpack_from(head)
    return bool(signature == SIGNATURE and version == 3 and offsets == 8 and marks)


def unmarked(path: Path) -> io.BytesIO:
    """Copy of a file that is marked open, in memory, without the marks and with its true end."""
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


def _turn(x: int, bits: int) -> int:
    return ((x << bits) | (x >> (32 - bits))) & 0xFFFFFFFF


def _mix(a: int, b: int, c: int) -> tuple[int, int, int]:
    for bits in (4, 6, 8, 16, 19, 4):  # each line of lookup3's mix(), with the three names moved on by one
        a, c = ((a - c) & 0xFFFFFFFF) ^ _turn(c, bits), _add(c, b)
        a, b, c = b, c, a
    return a, b, c


def _final(a: int, b: int, c: int) -> int:
    for bits in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _turn(b, bits)) & 0xFFFFFFFF
        a, b, c = b, c, a
    return b
