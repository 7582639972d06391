"""PNG files of figures."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

_LEVEL = 3
"""Compression level of zlib. Higher levels take twice the time for a tenth of the size."""
_INCH = 0.0254


def write_png(path: Path, pixels: np.ndarray, dpi: float) -> None:
    """Write an image as a PNG file without filters of rows.

    Line drawings compress as well without filters, and the search for filters takes two thirds of the time of an encoder.

    Parameters
    ----------
    path : file to write
    pixels : (height, width, 3) array of uint8
        Red, green and blue.
    dpi : pixels per inch, stored in the file
    """
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # the first byte of a row gives its filter, here none
    rows[:, 1:] = pixels.reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)  # 8 bits for each of three colours
    density = struct.pack(">IIB", round(dpi / _INCH), round(dpi / _INCH), 1)  # resolution in pixels per metre
    chunks = [(b"IHDR", header), (b"pHYs", density), (b"IDAT", zlib.compress(rows.data, _LEVEL)), (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(name, data) for name, data in chunks))


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
