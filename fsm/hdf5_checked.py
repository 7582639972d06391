"""HDF5 in which damage is found: the layout with checksums, texts of a fixed length, and datasets as they have to be.

The HDF5 library can turn in circles for ever in a damaged file of the old layout (superblock 0 or 1), and in the heap that
texts of variable length are kept in, which has no checksum in either.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

__all__ = [
    "READ_ERRORS", "SIGNATURE", "attribute", "check_contents", "close_discarding", "fixed_text", "has_checksums", "names_in",
    "numbers_in", "plain", "text_in", "written_from_memory",
]  # fmt: skip

SIGNATURE = b"\x89HDF\r\n\x1a\n"
READ_ERRORS = (OSError, LookupError, RuntimeError, ValueError, TypeError, AttributeError, ArithmeticError, MemoryError)
"""Errors by which damage of a file shows as it is read."""
_MOST_OBJECTS = 100_000
_MOST_ATTRIBUTE = 64 * 2**20
_LARGEST = 1e150
"""Of numbers that have to be finite: sums of their squares are, too."""


def has_checksums(path: Path) -> bool:
    """Whether a file is HDF5, from its first byte, and in the layout with checksums."""
    with path.open("rb") as file:
        head = file.read(len(SIGNATURE) + 1)
    return len(head) == len(SIGNATURE) + 1 and head.startswith(SIGNATURE) and head[-1] >= 2


@contextmanager
def written_from_memory(path: Path, old: Path | None = None) -> Iterator[Any]:
    """An HDF5 file, empty or begun as a copy of another, that is put together in memory and written when the block ends.

    What HDF5 itself cannot write, it tries again when the program ends, and brings it down.
    """
    import h5py

    memory = io.BytesIO(b"" if old is None else old.read_bytes())
    with h5py.File(memory, "w" if old is None else "r+", libver="latest") as file:
        yield file
    path.write_bytes(memory.getbuffer())


def close_discarding(file: Any) -> None:
    """Close a file that cannot be written, while all its datasets are still open: what is left to write goes nowhere."""
    with suppress(OSError, RuntimeError, ValueError):
        nowhere = os.open(os.devnull, os.O_RDWR)
        os.dup2(nowhere, file.id.get_vfd_handle())
        os.close(nowhere)
    with suppress(OSError, RuntimeError, ValueError):
        file.close()


def check_contents(file: Any) -> None:
    """Refuse an HDF5 file that reaches out of itself, or whose texts and attributes say nothing of their size.

    Raises
    ------
    OSError
        A link that is not to an object of the file, external or virtual storage, or more than 100 000 objects.
    """
    import h5py

    waiting, seen = [file["/"]], set[int]()
    while waiting:
        group = waiting.pop()
        for name in group:
            path = f"{group.name.rstrip('/')}/{name[:60]}"
            if group.id.links.get_info(name.encode()).type != h5py.h5l.TYPE_HARD:
                raise OSError(f"{path} is a link to another place")
            item = group[name]
            address = h5py.h5o.get_info(item.id).addr
            if address in seen:
                continue
            seen.add(address)
            if len(seen) > _MOST_OBJECTS:
                raise OSError(f"it holds more than {_MOST_OBJECTS} objects")
            if isinstance(item, h5py.Group):
                waiting.append(item)
            elif isinstance(item, h5py.Dataset) and (item.is_virtual or item.id.get_create_plist().get_external_count()):
                raise OSError(f"{path} keeps its numbers in another file")


def attribute(item: Any, name: str) -> Any:
    """An attribute of a group or dataset as Python has it.

    Raises
    ------
    OSError
        It is of variable length, which has no checksum and may be of any size, or larger than 64 MB.
    """
    import h5py

    if name not in item.attrs:
        raise KeyError(f"{item.name} has no attribute {name[:60]}")
    found = h5py.h5a.open(item.id, name.encode())
    if found.get_type().detect_class(h5py.h5t.VLEN) or _is_variable(found.get_type()):
        raise OSError(f"the attribute {name[:60]} of {item.name} is of variable length")
    if found.get_storage_size() > _MOST_ATTRIBUTE:
        raise OSError(f"the attribute {name[:60]} of {item.name} is larger than {_MOST_ATTRIBUTE // 2**20} MB")
    return plain(item.attrs[name])


def text_in(file: Any, path: str) -> str:
    """A text of a fixed length that is a dataset.

    Raises
    ------
    OSError
        It is not such a dataset, or says that it is larger than what is on disk.
    """
    data = file[path]
    if getattr(data, "shape", None) != () or data.dtype.kind != "S" or _is_variable(data.id.get_type()):
        raise OSError(f"/{path} does not hold a text of a fixed length")
    if data.id.get_storage_size() < data.dtype.itemsize:
        raise OSError(f"/{path} says that it is {data.dtype.itemsize} bytes long, which is more than there is")
    return str(data.asstr()[()])


def _is_variable(kind: Any) -> bool:
    import h5py

    return isinstance(kind, h5py.h5t.TypeStringID) and bool(kind.is_variable_str())


def fixed_text(text: str | Sequence[str]) -> np.ndarray:
    """A text, or several, as h5py keeps them in UTF-8 of a fixed length."""
    import h5py

    encoded = np.char.encode(np.array(text, dtype=str), "utf-8")
    return encoded.astype(h5py.string_dtype("utf-8", max(encoded.dtype.itemsize, 1)))


def plain(value: Any) -> Any:
    """A value of an attribute as Python has it: a text of either kind, a number."""
    if isinstance(value, bytes):
        return value.decode("utf-8")
    return value.item() if isinstance(value, np.generic) else value


def numbers_in(file: Any, path: str, shape: tuple[int | None, ...], finite: bool = True, first: int | None = None) -> Any:
    """Numbers of a dataset.

    Parameters
    ----------
    file : h5py.File
    path : str
    shape : tuple
        None: any size.
    finite : bool
        Whether all have to be finite, and not larger than 1e150.
    first : int, optional
        Only so many rows, of at least so many.

    Raises
    ------
    OSError
        It is not such a dataset, or says that it is larger than what is on disk.
    """
    data = file[path]
    dtype, found = getattr(data, "dtype", None), getattr(data, "shape", None)
    if dtype is None or found is None or dtype.kind not in "fiu":
        raise OSError(f"/{path} does not hold numbers")
    wanted = shape if first is None else (None, *shape[1:])
    if len(found) != len(wanted) or any(n is not None and n != m for n, m in zip(wanted, found, strict=True)):
        raise OSError(f"/{path} has the shape {found}")
    if data.size and data.id.get_storage_size() < data.size * dtype.itemsize:
        raise OSError(f"/{path} says that it has the shape {found}, which is more than there is")
    if first is not None and found[0] < first:
        raise OSError(f"/{path} is too short")
    values = data[()] if first is None else data[:first]
    if finite and not np.all(np.abs(values) <= _LARGEST):
        raise OSError(f"/{path} holds numbers that are not finite, or beyond {_LARGEST:g}")
    return values


def names_in(file: Any, path: str) -> tuple[str, ...]:
    """Names of a dataset of texts."""
    data = file[path]
    names = json.loads(attribute(data, "names_json"))
    if not isinstance(names, list):
        raise OSError(f"/{path} does not hold names")
    return tuple(str(name) for name in names)
