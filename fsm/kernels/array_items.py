"""Elements and rows of contiguous arrays in kernels, with a third of the code that numba generates for them.

numba copies the seven numbers of an array to the stack for every element that a kernel reads or writes. The compiler removes
this code again, but takes long for it. The functions here read the address and the sizes where they are; a negative index
counts from the end, as in Python.
"""

from __future__ import annotations

import operator
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
    """Types and values of indices, if all are integers, or None."""
    if isinstance(kind, types.Integer):
        return (kind,), (index,)
    if all(isinstance(one, types.Integer) for one in kind.types):
        return kind.types, cgutils.unpack_tuple(builder, index, count=len(kind))
    return None, None


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


def _row(context: Any, builder: Any, of: Any, array: Any, kinds: Any, indices: Any) -> Any:
    """Part of an array: all elements with these first indices."""
    given = len(kinds)
    data, offset = builder.extract_value(array, _DATA), _offset(context, builder, array, kinds, indices)
    shape = [builder.extract_value(array, (_SHAPE, axis)) for axis in range(given, of.ndim)]
    strides = [builder.extract_value(array, (_STRIDES, axis)) for axis in range(given, of.ndim)]
    count = shape[0]
    for length in shape[1:]:
        count = builder.mul(count, length)
    row = arrayobj.make_array(of.copy(ndim=of.ndim - given))(context, builder)
    arrayobj.populate_array(
        row, data=builder.gep(data, [builder.mul(offset, count)]), shape=shape, strides=strides,
        itemsize=builder.extract_value(array, _SIZE), meminfo=builder.extract_value(array, _META),
    )  # fmt: skip
    return row._getvalue()


def _get(context: Any, builder: Any, signature: Any, arguments: Any, instead: Any) -> Any:
    of, (array, index) = signature.args[0], arguments
    kinds, indices = _indices(signature.args[1], index, builder)
    if not _is_covered(of, kinds):
        return instead(context, builder, signature, arguments)
    if len(kinds) == of.ndim:
        found = arrayobj.load_item(context, builder, of, _element(context, builder, of, array, kinds, indices))
    elif isinstance(signature.return_type, types.Array) and signature.return_type.layout == "C":
        found = _row(context, builder, of, array, kinds, indices)
    else:
        return instead(context, builder, signature, arguments)
    return impl_ret_borrowed(context, builder, signature.return_type, found)


@lower_builtin(operator.getitem, types.Array, types.Integer)
def _get_at_number(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _get(context, builder, signature, arguments, arrayobj.getitem_arraynd_intp)


@lower_builtin(operator.getitem, types.Array, types.BaseTuple)
def _get_at_tuple(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _get(context, builder, signature, arguments, arrayobj.getitem_array_tuple)


@lower_builtin(operator.setitem, types.Array, types.Integer, types.Any)
@lower_builtin(operator.setitem, types.Array, types.BaseTuple, types.Any)
def _set(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    of, (array, index, value) = signature.args[0], arguments
    kinds, indices = _indices(signature.args[1], index, builder)
    if not _is_covered(of, kinds) or len(kinds) < of.ndim:
        return arrayobj.setitem_array(context, builder, signature, arguments)
    number = context.cast(builder, value, signature.args[2], of.dtype)
    arrayobj.store_item(context, builder, of, number, _element(context, builder, of, array, kinds, indices))
    return None
