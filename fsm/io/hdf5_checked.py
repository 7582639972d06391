"""HDF5 files in which damage is detected: layout with checksums, strings of fixed length, verified datasets.

The HDF5 library can loop for ever in a damaged file of the old layout (superblock 0 or 1). The library can also loop in the
heap of variable-length strings, which has no checksum in any layout.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

SIGNATURE = b"\x89HDF\r\n\x1a\n"
READ_ERRORS = (OSError, LookupError, RuntimeError, ValueError, TypeError, AttributeError, ArithmeticError, MemoryError)
"""Errors that reading a damaged file can raise."""
_MOST_OBJECTS = 100_000
_MOST_ATTRIBUTE = 64 * 2**20
_LARGEST = 1e150
"""Largest magnitude accepted where numbers must be finite; sums of their squares stay finite as well."""


def has_checksums(path: Path) -> bool:
    """Whether a file starts as an HDF5 file in the layout with checksums."""
    with path.open("rb") as file:
        head = file.read(len(SIGNATURE) + 1)
    return len(head) == len(SIGNATURE) + 1 and head.startswith(SIGNATURE) and head[-1] >= 2


@contextmanager
def written_from_memory(path: Path, begin: bytes = b"") -> Iterator[Any]:
    """Build an HDF5 file in memory, from nothing or from another file, and write it to disk when the block ends.

    HDF5 must not write to the disk itself: after a failed write the library tries again at exit, and the program
    crashes.
    """
    import h5py

    memory = io.BytesIO(begin)
    with h5py.File(memory, "r+" if begin else "w", libver="latest") as file:
        yield file
    path.write_bytes(memory.getbuffer())


def close_discarding(file: Any) -> None:
    """Close a file that cannot be written, and discard its unwritten data."""
    with suppress(OSError, RuntimeError, ValueError):
        nowhere = os.open(os.devnull, os.O_RDWR)
        os.dup2(nowhere, file.id.get_vfd_handle())
        os.close(nowhere)
    with suppress(OSError, RuntimeError, ValueError):
        file.close()


def check_contents(file: Any) -> None:
    """Refuse an HDF5 file that refers to other files, or that has too many objects.

    Raises
    ------
    OSError
        The file has a soft or external link, external or virtual storage, or more than 100 000 objects.
    """
    import h5py

    waiting, seen = [file["/"]], set[int]()
    while waiting:
        group = waiting.pop()
        for name in group:
            path = f"{group.name.rstrip('/')}/{name[:60]}"
            if group.id.links.get_info(name.encode()).type != h5py.h5l.TYPE_HARD:
                raise OSError(f"{path} is a link; only datasets and groups of the file itself are read")
            item = group[name]
            address = h5py.h5o.get_info(item.id).addr
            if address in seen:
                continue
            seen.add(address)
            if len(seen) > _MOST_OBJECTS:
                raise OSError(f"it contains more than {_MOST_OBJECTS} objects")
            if isinstance(item, h5py.Group):
                waiting.append(item)
            elif isinstance(item, h5py.Dataset) and (item.is_virtual or item.id.get_create_plist().get_external_count()):
                raise OSError(f"{path} stores its numbers in another file")


def write_attribute(item: Any, name: str, value: Any) -> None:
    """Add an attribute to an object of the lower level of h5py; a string gets a variable length."""
    from h5py import h5a

    values = np.array(value, dtype=object if isinstance(value, str) else None)
    stored, given = kinds_of(values)
    h5a.create(item, name.encode(), stored, space_of(values.shape)).write(values, mtype=given)


def kinds_of(values: np.ndarray) -> tuple[Any, Any]:
    """Type of an array of numbers or texts in a file, and in memory; texts of variable length are objects."""
    dtype = values.dtype
    if dtype.kind in "biufO":
        return _kinds(dtype)
    return _kinds_of_text(dtype.itemsize) if dtype.metadata == _UTF_8 else _new_kinds(dtype)


def _new_kinds(dtype: np.dtype[Any]) -> tuple[Any, Any]:
    from h5py import h5t, string_dtype

    dtype = string_dtype() if dtype.kind == "O" else dtype
    return h5t.py_create(dtype, logical=True), h5t.py_create(dtype)


_kinds = cache(_new_kinds)
_UTF_8 = {"h5py_encoding": "utf-8"}
"""Mark of `h5py` on types of texts of fixed length; types with different marks are equal."""


@lru_cache(maxsize=1024)
def _kinds_of_text(size: int) -> tuple[Any, Any]:
    """Types of a text of `fixed_text`."""
    from h5py import string_dtype

    return _new_kinds(string_dtype("utf-8", size))


@lru_cache(maxsize=256)
def space_of(shape: tuple[int, ...]) -> Any:
    """Space of an array of fixed shape."""
    from h5py import h5s

    return h5s.create_simple(shape) if shape else h5s.create(h5s.SCALAR)


def attribute(item: Any, name: str) -> Any:
    """Value of an attribute of a group or dataset.

    Raises
    ------
    OSError
        The attribute has a variable length, which has no checksum and no bound, or it is larger than 64 MB.
    """
    import h5py

    if name not in item.attrs:
        raise KeyError(f"{item.name} has no attribute {name[:60]}")
    found = h5py.h5a.open(item.id, name.encode())
    if found.get_type().detect_class(h5py.h5t.VLEN) or _is_variable(found.get_type()):
        raise OSError(f"the attribute {name[:60]} of {item.name} has a variable length")
    if found.get_storage_size() > _MOST_ATTRIBUTE:
        raise OSError(f"the attribute {name[:60]} of {item.name} is larger than {_MOST_ATTRIBUTE // 2**20} MB")
    return plain(item.attrs[name])


def text_in(file: Any, path: str) -> str:
    """String of fixed length that is stored as a dataset.

    Raises
    ------
    OSError
        The dataset has another type, or it declares more bytes than the file holds.
    """
    data = file[path]
    if getattr(data, "shape", None) != () or data.dtype.kind != "S" or _is_variable(data.id.get_type()):
        raise OSError(f"/{path} is not a fixed-length string; another program wrote the file, or it is damaged")
    if data.id.get_storage_size() < data.dtype.itemsize:
        raise OSError(f"/{path} declares {data.dtype.itemsize} bytes, more than the file holds")
    return str(data.asstr()[()])


def _is_variable(kind: Any) -> bool:
    import h5py

    return isinstance(kind, h5py.h5t.TypeStringID) and bool(kind.is_variable_str())


def fixed_text(text: str | Sequence[str]) -> np.ndarray:
    """One string, or several, as an array of UTF-8 strings of fixed length."""
    import h5py

    texts = [text] if isinstance(text, str) else text
    encoded = [one.encode("utf-8", "backslashreplace") for one in texts]  # a path may hold any bytes
    kind = h5py.string_dtype("utf-8", max(map(len, encoded), default=0) or 1)
    return np.array(encoded[0] if isinstance(text, str) else encoded, dtype=kind)


def plain(value: Any) -> Any:
    """Value of an attribute as a Python string or number."""
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
        Required size along each axis; None accepts any size.
    finite : bool
        Whether all numbers must be finite and at most 1e150 in magnitude.
    first : int, optional
        Number of rows to read; the dataset must have at least as many.

    Raises
    ------
    OSError
        The dataset has another type or shape, or it declares more numbers than the file holds.
    """
    data = file[path]
    dtype, found = getattr(data, "dtype", None), getattr(data, "shape", None)
    if dtype is None or found is None or dtype.kind not in "fiu":
        raise OSError(f"/{path} does not contain numbers")
    wanted = shape if first is None else (None, *shape[1:])
    if len(found) != len(wanted) or any(n is not None and n != m for n, m in zip(wanted, found, strict=True)):
        raise OSError(f"/{path} has the shape {found}")
    if data.size and data.id.get_storage_size() < data.size * dtype.itemsize:
        raise OSError(f"/{path} declares the shape {found}, more than the file holds")
    if first is not None and found[0] < first:
        raise OSError(f"/{path} has {found[0]} rows; at least {first} are needed")
    values = data[()] if first is None else data[:first]
    if finite and not is_finite(values):
        raise OSError(f"/{path} contains numbers that are not finite or exceed {_LARGEST:g}")
    return values


def is_finite(values: np.ndarray) -> bool:
    """Whether all numbers are finite and at most 1e150 in magnitude."""
    return bool(np.all(np.abs(values) <= _LARGEST))


def names_in(file: Any, path: str) -> tuple[str, ...]:
    """Names listed in the attribute `names_json` of a dataset."""
    data = file[path]
    names = json.loads(attribute(data, "names_json"))
    if not isinstance(names, list):
        raise OSError(f"/{path} does not contain names")
    return tuple(str(name) for name in names)
