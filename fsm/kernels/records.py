"""Records: NamedTuples that kernels get by their address.

numba passes each array of a NamedTuple as seven numbers and counts its references wherever the tuple is read or passed on.
For a model with dozens of arrays, most of the code of a kernel would do that, and the compiler takes long for it. A call
of a kernel from Python writes the fields of a record once to the stack; kernels pass its address and read the fields that
they need. Kernels cannot make or return records (see `replaced`), and their arrays have no owners: the caller in Python
keeps them alive.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

import numba
import numba.extending
import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.core.typing.typeof import typeof_impl
from numba.np.arrayobj import make_array

from fsm.kernels.array_items import array_value

K = TypeVar("K", bound=type)

types: Any = numba.types
_WORD = ir.IntType(64)


class Record(types.Type):  # type: ignore[misc, unused-ignore]
    """Type of a record, for numba.

    Parameters
    ----------
    whole : numba's type of the NamedTuple
    """

    def __init__(self, whole: Any) -> None:
        self.whole = whole
        self.instance_class = kind = whole.instance_class
        self.first: dict[str, int] = {}
        self.kinds: dict[str, Any] = dict(zip(whole.fields, whole.types, strict=True))
        self.words = 0
        for field, of in self.kinds.items():
            self.first[field] = self.words
            self.words += _words(of)
        named = ",".join(f"{field}:{of}" for field, of in self.kinds.items())
        digest = hashlib.sha256(f"{kind.__module__}.{kind.__qualname__}({named})".encode()).hexdigest()[:32]
        super().__init__(name=f"Record({kind.__name__}.{digest})")

    def __reduce__(self) -> Any:
        return Record, (self.whole,)


def record(kind: K) -> K:
    """Make a NamedTuple class a record (decorator)."""

    def find(value: Any, context: Any) -> Any:
        return record_type(kind, kinds_of(value))

    typeof_impl.register(kind)(find)
    return kind


_made: dict[tuple[Any, ...], Record] = {}
_known: dict[Any, Any] = {}


def kinds_of(values: Iterable[Any]) -> tuple[Any, ...]:
    """Types of values, for numba, which takes 20 us to find that of an array, and 1 ms for a NamedTuple of pointers."""
    return tuple(map(_kind_of, values))


def _kind_of(value: Any) -> Any:
    kind: Any = value.__class__
    parts: tuple[Any, ...] = ()
    if kind is np.ndarray:
        key: Any = (value.dtype, value.ndim, value.flags.num)
    elif kind is float or kind is bool:
        key = kind
    elif hasattr(kind, "_fields") and typeof_impl.dispatch(kind) is typeof_impl.dispatch(tuple):
        parts = kinds_of(value)
        key = (kind, *map(id, parts))  # equal types are one object, and their hashes take long
    else:
        return numba.typeof(value)
    if key not in _known:
        _known[key] = types.NamedTuple(parts, kind) if parts else numba.typeof(value)
    return _known[key]


def record_type(kind: type, fields: Sequence[Any]) -> Record:
    """Type of a record with fields of these types."""
    key = (kind, *map(id, fields))  # equal types are one object, and their hashes take long
    if key not in _made:
        _made[key] = Record(types.NamedTuple(fields, kind))
    return _made[key]


def _words(kind: Any) -> int:
    """Number of words of a field."""
    if isinstance(kind, types.Array):
        if kind.layout != "C":
            raise numba.core.errors.TypingError(f"array {kind} of a record is not contiguous")
        return 1 + int(kind.ndim)
    if isinstance(kind, types.BaseTuple):
        return sum(map(_words, kind.types))
    return 0 if isinstance(kind, types.NoneType) else 1


def _place(builder: Any, memory: Any, word: int) -> Any:
    """Pointer to a word; `memory` is the address of a record."""
    return builder.gep(builder.bitcast(memory, _WORD.as_pointer()), [ir.Constant(_WORD, word)])


def _write(context: Any, builder: Any, kind: Any, value: Any, memory: Any, word: int) -> None:
    """Write a field from this word on."""
    if isinstance(kind, types.Array):
        array = make_array(kind)(context, builder, value)
        builder.store(builder.ptrtoint(array.data, _WORD), _place(builder, memory, word))
        for axis, length in enumerate(cgutils.unpack_tuple(builder, array.shape, kind.ndim)):
            builder.store(length, _place(builder, memory, word + 1 + axis))
    elif isinstance(kind, types.BaseTuple):
        for k, of in enumerate(kind.types):
            _write(context, builder, of, builder.extract_value(value, k), memory, word)
            word += _words(of)
    elif not isinstance(kind, types.NoneType):
        place = _place(builder, memory, word)
        builder.store(value, builder.bitcast(place, context.get_value_type(kind).as_pointer()))


def _read(context: Any, builder: Any, kind: Any, memory: Any, word: int) -> Any:
    """Value of a field."""
    if isinstance(kind, types.Array):
        shape = [builder.load(_place(builder, memory, word + 1 + axis)) for axis in range(kind.ndim)]
        start = builder.load(_place(builder, memory, word))
        data = builder.inttoptr(start, context.get_data_type(kind.dtype).as_pointer())
        return array_value(context, builder, kind, data, shape)
    if isinstance(kind, types.BaseTuple):
        parts = []
        for of in kind.types:
            parts.append(_read(context, builder, of, memory, word))
            word += _words(of)
        return context.make_tuple(builder, kind, parts)
    if isinstance(kind, types.NoneType):
        return context.get_dummy_value()
    return builder.load(builder.bitcast(_place(builder, memory, word), context.get_value_type(kind).as_pointer()))


if numba.config.DISABLE_JIT:

    def replaced(whole: Any, name: str, value: Any) -> Any:
        """Record with another value of a field."""
        return whole._replace(**{name: value})

else:

    @numba.extending.register_model(Record)
    class _RecordModel(numba.extending.models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
        def __init__(self, manager: Any, kind: Any) -> None:
            super().__init__(manager, kind, cgutils.voidptr_t)

    @numba.extending.unbox(Record)
    def _unpack(kind: Any, value: Any, c: Any) -> Any:
        whole = c.unbox(kind.whole, value)
        memory = cgutils.alloca_once(c.builder, _WORD, size=max(kind.words, 1))
        _write(c.context, c.builder, kind.whole, whole.value, memory, 0)
        with c.builder.if_then(c.builder.not_(whole.is_error)):  # the arrays in the record have no owners
            c.context.nrt.decref(c.builder, kind.whole, whole.value)
        address = c.builder.bitcast(memory, cgutils.voidptr_t)
        return numba.extending.NativeValue(address, is_error=whole.is_error, cleanup=whole.cleanup)

    @infer_getattr
    class _FieldTypes(AttributeTemplate):  # type: ignore[misc, unused-ignore]
        key = Record

        def generic_resolve(self, whole: Any, name: str) -> Any:
            return whole.kinds.get(name)

    @lower_getattr_generic(Record)
    def _field(context: Any, builder: Any, whole: Any, address: Any, name: str) -> Any:
        return _read(context, builder, whole.kinds[name], address, whole.first[name])

    @numba.extending.intrinsic(prefer_literal=True)
    def replaced(context: Any, whole: Any, name: Any, value: Any) -> Any:
        """Record with another value of a field; only calls of the kernel that makes it may use it. `name` is a constant."""
        field = name.literal_value
        if whole.kinds[field] != value:
            raise numba.core.errors.TypingError(f"field {field} of {whole} has another type than {value}")

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            memory = cgutils.alloca_once(builder, _WORD, size=whole.words)
            cgutils.memcpy(builder, memory, builder.bitcast(arguments[0], memory.type), ir.Constant(_WORD, whole.words))
            _write(context, builder, value, arguments[2], memory, whole.first[field])
            return builder.bitcast(memory, cgutils.voidptr_t)

        return whole(whole, name, value), generate
