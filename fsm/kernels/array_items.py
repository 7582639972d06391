"""Elements and parts of contiguous arrays in kernels, with a third of the code that numba generates for them.

numba copies the seven numbers of an array to the stack for every element that a kernel reads or writes. The compiler removes
this code again, but takes long for it. The functions here read the address and the sizes where they are; a negative index
counts from the end, as in Python. Parts are rows, and slices without a step along the first axis that has no index.

For an assignment of an array to a part, numba generates two loops, tests for common memory, and the text of an error message
with both shapes. In kernels of this package a part is one move of memory.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from llvmlite import ir
from numba import types as _types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed, lower_builtin
from numba.np import arrayobj

types: Any = _types
_META, _PARENT, _COUNT, _SIZE, _DATA, _SHAPE, _STRIDES = range(7)
"""Members of an array in numba's data model."""


def _indices(kind: Any, index: Any, builder: Any) -> tuple[Any, Any]:
    """Types and values of indices, if all are integers except for a slice at the end, or None."""
    kinds, indices = (kind,), (index,)
    if isinstance(kind, types.BaseTuple):
        kinds, indices = kind.types, cgutils.unpack_tuple(builder, index, count=len(kind))
    first = kinds[:-1] if _is_slice(kinds[-1:]) else kinds
    return (kinds, indices) if all(isinstance(one, types.Integer) for one in first) else (None, None)


def _is_slice(kinds: Any) -> bool:
    """Whether the last index is a slice without a step."""
    return bool(kinds) and isinstance(kinds[-1], types.SliceType) and not kinds[-1].has_step


def _offset(context: Any, builder: Any, array: Any, kinds: Any, indices: Any) -> Any:
    """Number of the element, or of the row in units of rows."""
    offset = None
    for axis, (kind, index) in enumerate(zip(kinds, indices, strict=True)):
        length = None
        number = context.cast(builder, index, kind, types.intp)
        if kind.signed and not (isinstance(kind, types.IntegerLiteral) and kind.literal_value >= 0):
            length = builder.extract_value(array, (_SHAPE, axis))
            negative = builder.icmp_signed("<", number, ir.Constant(number.type, 0))
            number = builder.select(negative, builder.add(number, length), number)
        if offset is not None:
            length = length or builder.extract_value(array, (_SHAPE, axis))
            number = builder.add(builder.mul(offset, length), number)
        offset = number
    return offset


def _is_covered(array: Any, kinds: Any) -> bool:
    return kinds is not None and array.layout == "C" and len(kinds) <= array.ndim


def _element(context: Any, builder: Any, of: Any, array: Any, kinds: Any, indices: Any) -> Any:
    """Pointer to an element."""
    return builder.gep(builder.extract_value(array, _DATA), [_offset(context, builder, array, kinds, indices)])


def _part(context: Any, builder: Any, of: Any, array: Any, kinds: Any, indices: Any) -> tuple[Any, list[Any], Any]:
    """Address, shape and number of elements of a part of an array."""
    given = len(kinds) - _is_slice(kinds)
    shape = [builder.extract_value(array, (_SHAPE, axis)) for axis in range(given, of.ndim)]
    offset = _offset(context, builder, array, kinds[:given], indices[:given]) if given else None
    if given < len(kinds):
        begin, length = _bounds(context, builder, kinds[given], indices[given], shape[0])
        offset = begin if offset is None else builder.add(builder.mul(offset, shape[0]), begin)
        shape[0] = length
    inner = None
    for length in shape[given < len(kinds) :]:
        inner = length if inner is None else builder.mul(inner, length)
    if inner is not None:
        offset = builder.mul(offset, inner)
    count = inner if given == len(kinds) else shape[0] if inner is None else builder.mul(shape[0], inner)
    return builder.gep(builder.extract_value(array, _DATA), [offset]), shape, count


def _bounds(context: Any, builder: Any, kind: Any, given: Any, size: Any) -> tuple[Any, Any]:
    """First element and length of a slice of an axis of this size."""
    part, zero = context.make_helper(builder, kind, value=given), ir.Constant(size.type, 0)

    def within(bound: Any) -> Any:
        bound = builder.select(builder.icmp_signed("<", bound, zero), builder.add(bound, size), bound)
        bound = builder.select(builder.icmp_signed("<", bound, zero), zero, bound)
        return builder.select(builder.icmp_signed(">", bound, size), size, bound)

    begin, length = within(part.start), builder.sub(within(part.stop), within(part.start))
    return begin, builder.select(builder.icmp_signed("<", length, zero), zero, length)


def _view(context: Any, builder: Any, of: Any, array: Any, kinds: Any, indices: Any) -> Any:
    """Part of an array as an array."""
    data, shape, count = _part(context, builder, of, array, kinds, indices)
    if len(shape) == of.ndim:  # a slice of the first axis
        for place, number in ((_DATA, data), (_COUNT, count), ((_SHAPE, 0), shape[0])):
            array = builder.insert_value(array, number, place)
        return array
    axes = range(of.ndim - len(shape), of.ndim)
    strides = [builder.extract_value(array, (_STRIDES, axis)) for axis in axes]
    owner = None if has_no_owner(array) else builder.extract_value(array, _META)
    return array_value(context, builder, of.copy(ndim=len(shape)), data, shape, strides, owner, count)


def array_value(
    context: Any, builder: Any, kind: Any, data: Any, shape: Any, strides: Any = None, owner: Any = None, count: Any = None
) -> Any:
    """Contiguous array at an address, without an owner if none is given."""
    size = ir.Constant(shape[0].type, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    if strides is None:
        strides = [size]
        for length in reversed(shape[1:]):
            strides.insert(0, builder.mul(length, strides[0]))
    if count is None:
        count = functools.reduce(builder.mul, shape)
    value = ir.Constant(context.get_value_type(kind), None)
    for place, number in ((_META, owner), (_COUNT, count), (_SIZE, size), (_DATA, data)):
        value = value if number is None else builder.insert_value(value, number, place)
    for axis, (length, stride) in enumerate(zip(shape, strides, strict=True)):
        value = builder.insert_value(builder.insert_value(value, length, (_SHAPE, axis)), stride, (_STRIDES, axis))
    return value


def _get(context: Any, builder: Any, signature: Any, arguments: Any, instead: Any) -> Any:
    of, (array, index) = signature.args[0], arguments
    kinds, indices = _indices(signature.args[1], index, builder)
    if not _is_covered(of, kinds):
        return instead(context, builder, signature, arguments)
    if len(kinds) == of.ndim and not _is_slice(kinds):
        found = arrayobj.load_item(context, builder, of, _element(context, builder, of, array, kinds, indices))
    elif isinstance(signature.return_type, types.Array) and signature.return_type.layout == "C":
        found = _view(context, builder, of, array, kinds, indices)
        if has_no_owner(found):
            return found
    else:
        return instead(context, builder, signature, arguments)
    return impl_ret_borrowed(context, builder, signature.return_type, found)


@lower_builtin(operator.getitem, types.Array, types.Integer)
def _get_at_number(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _get(context, builder, signature, arguments, arrayobj.getitem_arraynd_intp)


@lower_builtin(operator.getitem, types.Array, types.SliceType)
def _get_slice(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _get(context, builder, signature, arguments, arrayobj.getitem_arraynd_intp)


@lower_builtin(operator.getitem, types.Array, types.BaseTuple)
def _get_at_tuple(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _get(context, builder, signature, arguments, arrayobj.getitem_array_tuple)


@lower_builtin(operator.setitem, types.Array, types.Integer, types.Any)
@lower_builtin(operator.setitem, types.Array, types.BaseTuple, types.Any)
@lower_builtin(operator.setitem, types.Array, types.SliceType, types.Any)
def _set(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    of, (array, index, value) = signature.args[0], arguments
    kinds, indices = _indices(signature.args[1], index, builder)
    if not _is_covered(of, kinds):
        return arrayobj.setitem_array(context, builder, signature, arguments)
    if len(kinds) == of.ndim and not _is_slice(kinds):
        number = context.cast(builder, value, signature.args[2], of.dtype)
        arrayobj.store_item(context, builder, of, number, _element(context, builder, of, array, kinds, indices))
        return None
    given = signature.args[2]
    axes = of.ndim - len(kinds) + _is_slice(kinds)
    if isinstance(given, types.Number | types.Boolean):
        data, _, count = _part(context, builder, of, array, kinds, indices)
        _fill(context, builder, of, data, count, context.cast(builder, value, given, of.dtype))
    elif _kernels and isinstance(given, types.Array) and (given.layout, given.ndim, given.dtype) == ("C", axes, of.dtype):
        data, shape, count = _part(context, builder, of, array, kinds, indices)
        _move(context, builder, of, (data, shape, count), value)
    else:
        return arrayobj.setitem_array(context, builder, signature, arguments)
    return None


def _fill(context: Any, builder: Any, of: Any, data: Any, count: Any, number: Any) -> None:
    """Set all elements of a part."""
    with cgutils.for_range(builder, count) as loop:
        arrayobj.store_item(context, builder, of, number, builder.gep(data, [loop.index]))


def _move(context: Any, builder: Any, of: Any, part: tuple[Any, list[Any], Any], given: Any) -> None:
    """Set a part to an array of the same shape, which may overlap it, or to an array of one number."""
    data, shape, count = part
    source, same = builder.extract_value(given, _DATA), None
    for axis, length in enumerate(shape):
        equal = builder.icmp_signed("==", length, builder.extract_value(given, (_SHAPE, axis)))
        same = equal if same is None else builder.and_(same, equal)
    with builder.if_else(same) as (whole, other):
        with whole:
            cgutils.raw_memmove(builder, data, source, count, context.get_abi_sizeof(context.get_data_type(of.dtype)))
        with other:
            single = None
            for axis in range(len(shape)):
                length = builder.extract_value(given, (_SHAPE, axis))
                equal = builder.icmp_signed("==", length, ir.Constant(length.type, 1))
                single = equal if single is None else builder.and_(single, equal)
            with builder.if_then(builder.not_(single), likely=False):
                text = "cannot assign an array to a part of another shape"
                context.call_conv.return_user_exc(builder, ValueError, (text,))
            _fill(context, builder, of, data, count, arrayobj.load_item(context, builder, of, source))


def has_no_owner(array: Any) -> bool:
    """Whether the code that makes an array gives it no owner, so that no references to it are counted."""
    while isinstance(array, ir.instructions.InsertValue):
        if next(iter(array.indices)) == _META:
            return False
        array = array.operands[0]
    return isinstance(array, ir.Constant) and array.constant is None


_kernels: list[None] = []
"""One entry for each kernel that is compiled now."""


@contextmanager
def in_kernels() -> Iterator[None]:
    """Compile functions in this block as parts of a kernel of this package."""
    _kernels.append(None)
    try:
        yield
    finally:
        _kernels.pop()
