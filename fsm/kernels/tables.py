"""Named tables: arrays of a model as one argument of a kernel, with their names as attributes.

A `NamedTuple` declares the fields of a table once: name, and type by `Floats1`, `Floats2`, `Floats3`, `Integers1` or
`Integers2`. Python keeps the arrays in this tuple; kernels get the address of a table of their addresses and shapes
(`fsm.kernels.addresses.address_table`), so that a call copies one number in place of all arrays. In a kernel,
``table.name`` is a view of the array. The caller must keep the arrays alive.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from functools import cache
from typing import Annotated, Any, TypeVar, cast, get_args, get_type_hints

import numba
import numba.extending
import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr

from fsm.kernels.addresses import ROW, address_table
from fsm.kernels.array_items import array_value

T = TypeVar("T")
U = TypeVar("U")

Floats1 = Annotated[np.ndarray, np.float64, 1]
"""Field (n,) of float64."""
Floats2 = Annotated[np.ndarray, np.float64, 2]
"""Field (m, n) of float64; (m, 1) if the array of a model in the plane is (m,)."""
Floats3 = Annotated[np.ndarray, np.float64, 3]
"""Field (l, m, n) of float64, or (l, 1, 1) as for `Floats2`."""
Integers1 = Annotated[np.ndarray, np.int64, 1]
"""Field (n,) of int64."""
Integers2 = Annotated[np.ndarray, np.int64, 2]
"""Field (m, n) of int64."""

_WORD = ir.IntType(64)


@cache
def _fields(kind: type) -> dict[str, tuple[int, Any]]:
    """Row and numba's array type of each field."""
    found = {}
    for row, (name, hint) in enumerate(get_type_hints(kind, include_extras=True).items()):
        _, number, dimensions = get_args(hint)
        found[name] = row, types.Array(numba.from_dtype(np.dtype(number)), dimensions, "C", aligned=True)
    return found


@cache
def _declared(kind: type) -> tuple[tuple[str, ...], tuple[Any, ...], tuple[int, ...]]:
    """Name, type and number of dimensions of each field."""
    hints = get_type_hints(kind, include_extras=True)
    names, declared = tuple(hints), [get_args(hint) for hint in hints.values()]
    return names, tuple(np.dtype(number) for _, number, _ in declared), tuple(of for *_, of in declared)


def number_of_fields(kind: type) -> int:
    """Number of rows of a named table."""
    return len(_fields(kind))


def named_table(*parts: Any) -> np.ndarray:
    """Table of the arrays of one or several tuples, which follow each other; arrays get the declared number of dimensions.

    Raises
    ------
    ValueError
        An array has another type than its declaration, more dimensions, or is not contiguous.
    """
    arrays = []
    for part in parts:
        for name, number, dimensions, array in zip(*_declared(part.__class__), part, strict=True):
            if array.dtype != number or array.ndim > dimensions:
                raise ValueError(f"field {name} of {type(part).__name__}: array {array.dtype} {array.shape}")
            arrays.append(array.reshape(array.shape + (1,) * (dimensions - array.ndim)))
    return address_table(arrays)


def empty_arrays(kind: type[T]) -> T:
    """Tuple of a kind whose arrays have no values."""
    _, numbers, dimensions = _declared(cast(Any, kind))
    return kind(*(np.zeros((0,) * of, dtype=number) for number, of in zip(numbers, dimensions, strict=True)))


def as_declared(arrays: T) -> T:
    """Tuple with contiguous arrays of the declared types and numbers of dimensions, as kernels see them."""
    found: Any = arrays
    return cast(T, found.__class__(*(
        np.ascontiguousarray(array, dtype=number).reshape(array.shape + (1,) * (of - array.ndim))
        for array, number, of in zip(found, *_declared(found.__class__)[1:], strict=True)
    )))  # fmt: skip


def with_rows(arrays: Any, names: Iterable[str], count: int) -> Any:
    """Tuple of arrays with `count` rows in the named ones: rows that they have already, then rows of zeros."""
    replaced = {}
    for name in names:
        old = getattr(arrays, name)
        replaced[name] = np.zeros((count, *old.shape[1:]), dtype=old.dtype)
        replaced[name][: len(old)] = old
    return arrays._replace(**replaced)


class _Table(types.Type):  # type: ignore[misc, unused-ignore]
    """Type of a table in kernels: its address. Its name identifies the fields, whose rows are constants in machine code."""

    def __init__(self, kind: type) -> None:
        self.kind = kind
        fields = ",".join(f"{name}:{of}" for name, (_, of) in _fields(kind).items())
        digest = hashlib.sha256(fields.encode()).hexdigest()[:16]
        super().__init__(name=f"Table({kind.__module__}.{kind.__qualname__}.{digest})")

    def __reduce__(self) -> Any:
        return _Table, (self.kind,)


@numba.extending.register_model(_Table)
class _Address(numba.extending.models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _WORD)


class TableExample:
    """Example of a table as an argument of a `Pointer`.

    Parameters
    ----------
    kind : NamedTuple class
    """

    def __init__(self, kind: type) -> None:
        self._numba_type_ = _Table(kind)


class Table:
    """Table of some tuples of arrays, with which Python calls kernels; the kind is that of the first tuple.

    Attributes
    ----------
    rows : (m, 4) int array
        Table of `named_table`; it keeps its place in memory.
    parts : tuples of arrays
    """

    def __init__(self, *parts: Any) -> None:
        self.parts, self.rows = parts, named_table(*parts)
        self._numba_type_, self.address = _Table(type(parts[0])), int(self.rows.ctypes.data)

    def replace(self, *parts: Any) -> None:
        """Replace the arrays by others of the same kinds."""
        self.parts, self.rows[:] = parts, named_table(*parts)

    def put(self, **arrays: np.ndarray) -> None:
        """Replace some arrays of the first tuple."""
        first, *others = self.parts
        self.parts = (first._replace(**arrays), *others)
        for name, array in arrays.items():
            self.rows[_fields(first.__class__)[name][0]] = address_table([array])[0]

    def __getattr__(self, name: str) -> np.ndarray:
        """Array of this name: kernels without the compiler read it."""
        for part in self.__dict__.get("parts", ()):
            if name in part._fields:
                return np.asarray(getattr(part, name))
        raise AttributeError(name)


if not numba.config.DISABLE_JIT:

    @numba.extending.unbox(_Table)
    def _address_of(kind: Any, table: Any, c: Any) -> Any:
        number = c.pyapi.object_getattr_string(table, "address")
        address = c.pyapi.long_as_longlong(number)
        c.pyapi.decref(number)
        return numba.extending.NativeValue(address)

    @infer_getattr
    class _FieldTypes(AttributeTemplate):  # type: ignore[misc, unused-ignore]
        key = _Table

        def generic_resolve(self, table: Any, name: str) -> Any:
            row = _fields(table.kind).get(name)
            return None if row is None else row[1]

    @lower_getattr_generic(_Table)
    def _field(context: Any, builder: Any, table: Any, address: Any, name: str) -> Any:
        row, kind = _fields(table.kind)[name]
        start = builder.inttoptr(builder.add(address, ir.Constant(_WORD, 8 * ROW * row)), _WORD.as_pointer())
        shape = [builder.load(builder.gep(start, [ir.Constant(_WORD, 1 + axis)])) for axis in range(kind.ndim)]
        data = builder.inttoptr(builder.load(start), context.get_data_type(kind.dtype).as_pointer())
        return array_value(context, builder, kind, data, shape)


def table_in(kind: type[T]) -> Callable[[np.ndarray, int], T]:
    """Function of kernels that returns one of several tables of a kind: ``f(tables, number)`` with `tables` (k, 2) as in
    `fsm.kernels.addresses.tables_of`.
    """

    def at(tables: np.ndarray, number: int) -> T:
        raise NotImplementedError  # without the compiler there are no addresses

    if numba.config.DISABLE_JIT:
        return at

    @numba.extending.intrinsic
    def found(context: Any, address: Any) -> Any:
        return _Table(kind)(types.int64), lambda context, builder, signature, arguments: arguments[0]

    @numba.extending.overload(at, strict=False)
    def choose(tables: Any, number: Any) -> Any:
        return lambda tables, number: found(tables[number, 0])

    return at


def follows(kind: type[T], before: type[U]) -> Callable[[U], T]:
    """Function of kernels that returns the table of a kind that follows directly after the fields of another kind."""

    def after(table: U) -> T:
        return cast(T, table)  # without the compiler, a `Table` has the fields of all its parts

    if numba.config.DISABLE_JIT:
        return after
    offset = 8 * ROW * number_of_fields(before)

    @numba.extending.intrinsic
    def found(context: Any, table: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.add(arguments[0], ir.Constant(_WORD, offset))

        return _Table(kind)(table), generate

    @numba.extending.overload(after, strict=False)
    def choose(table: Any) -> Any:
        return lambda table: found(table)

    return after
