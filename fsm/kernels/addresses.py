"""Arrays by their addresses: many arrays as one argument of a kernel.

A kernel with a NamedTuple of many arrays as argument copies all arrays and counts their references at each call, and
the compiler handles every field separately. Here one table contains the address and shape of each array, and kernels
fetch the arrays that they need. The caller must keep the arrays alive.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numba
import numba.extending
import numpy as np
from numba import carray
from numba.core import cgutils

from fsm.kernels.jit import kernel

ROW = 4
"""Numbers of an array in a table: address and up to three sizes."""
_TYPES = frozenset({np.dtype(np.float64), np.dtype(np.int64)})
_NO_SIZES = tuple((0,) * (ROW - 1 - dimensions) for dimensions in range(ROW))


def address_table(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Table (m, 4) of arrays, C-contiguous and of type float64 or int64.

    Raises
    ------
    ValueError
        An array has another type or order.
    """
    rows = np.zeros((len(arrays), ROW), dtype=np.int64)
    numbers: list[int] = []
    for array in arrays:
        if not array.flags.c_contiguous or array.dtype not in _TYPES:
            raise ValueError(f"array of type {array.dtype} is not contiguous, or neither float64 nor int64")
        numbers += (_address(array), *array.shape, *_NO_SIZES[array.ndim])
    rows.reshape(-1)[:] = numbers
    return rows


def _address(array: Any) -> int:
    """Address of an array, 0 without elements. The interface of NumPy takes four times as long as a buffer."""
    if not array.size:
        return 0
    if array.flags.writeable:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    return int(array.__array_interface__["data"][0])


def tables_of(tables: Sequence[np.ndarray]) -> np.ndarray:
    """Addresses and lengths (k, 2) of several tables, for `table_at`; the caller keeps the tables."""
    return np.array([(table.ctypes.data, len(table)) for table in tables], dtype=np.int64).reshape(-1, 2)


def _in_python(kind: Any, address: int, shape: tuple[int, ...]) -> np.ndarray:
    count = int(np.prod(shape))
    if count == 0:
        return np.zeros(shape, dtype=np.dtype(kind))
    return np.ctypeslib.as_array((kind * count).from_address(int(address))).reshape(shape)


if numba.config.DISABLE_JIT:

    def _floats(address: int, shape: tuple[int, ...]) -> np.ndarray:
        return _in_python(ctypes.c_double, address, shape)

    def _integers(address: int, shape: tuple[int, ...]) -> np.ndarray:
        return _in_python(ctypes.c_int64, address, shape)

else:

    @numba.extending.intrinsic
    def _pointer(context: Any, address: Any) -> Any:
        """Pointer to an address."""

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], cgutils.voidptr_t)

        return numba.types.voidptr(numba.types.int64), generate

    @numba.extending.register_jitable
    def _floats(address: int, shape: tuple[int, ...]) -> np.ndarray:
        array: np.ndarray = carray(_pointer(address), shape, np.float64)
        return array

    @numba.extending.register_jitable
    def _integers(address: int, shape: tuple[int, ...]) -> np.ndarray:
        array: np.ndarray = carray(_pointer(address), shape, np.int64)
        return array


@kernel(inline=True)
def floats_1d(table: np.ndarray, row: int) -> np.ndarray:
    """Array (n,) of float64."""
    return _floats(table[row, 0], (table[row, 1],))


@kernel(inline=True)
def floats_2d(table: np.ndarray, row: int) -> np.ndarray:
    """Array (m, n) of float64."""
    return _floats(table[row, 0], (table[row, 1], table[row, 2]))


@kernel(inline=True)
def floats_3d(table: np.ndarray, row: int) -> np.ndarray:
    """Array (l, m, n) of float64."""
    return _floats(table[row, 0], (table[row, 1], table[row, 2], table[row, 3]))


@kernel(inline=True)
def integers_1d(table: np.ndarray, row: int) -> np.ndarray:
    """Array (n,) of int64."""
    return _integers(table[row, 0], (table[row, 1],))


@kernel(inline=True)
def integers_2d(table: np.ndarray, row: int) -> np.ndarray:
    """Array (m, n) of int64."""
    return _integers(table[row, 0], (table[row, 1], table[row, 2]))


@kernel(inline=True)
def table_at(tables: np.ndarray, number: int) -> np.ndarray:
    """One of several tables."""
    return _integers(tables[number, 0], (tables[number, 1], ROW))


@kernel(inline=True)
def put_array(table: np.ndarray, row: int, array: np.ndarray) -> None:
    """Write address and shape of an array to a row of a table."""
    table[row, 0] = array.ctypes.data
    for k in range(array.ndim):
        table[row, 1 + k] = array.shape[k]
