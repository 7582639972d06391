"""Shorter ways through numba's compiler, which lead to the same machine code.

Each function here replaces one of numba, from the first compilation of a process on. It gives the same result in less time.
Only the message on shapes that do not agree in an assignment is shorter.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
import numba.extending
from llvmlite import ir as llvm_ir
from numba.core import base, ir, targetconfig, types
from numba.core.runtime.context import NRTContext
from numba.core.typing import npydecl
from numba.np import arrayobj

_PLAIN = frozenset({str, int, float, bool, type(None), ir.Loc, ir.Const})
"""Classes of parts of a statement that contain no variables."""


@contextmanager
def shortcuts() -> Iterator[None]:
    """Compile with the functions of this module.

    Within the block, numba also reports no events of the lock of LLVM, which are a twentieth of the time of a compilation.
    """
    _take()
    lock = llvm.ffi.lib._lock
    callbacks, lock._cblist = lock._cblist, []
    try:
        yield
    finally:
        lock._cblist = callbacks


@functools.cache
def _take() -> None:
    ir.Stmt.list_vars, ir.Expr.list_vars = _variables_of_statement, _variables_of_expression
    targetconfig.TargetConfig.__hash__, targetconfig.TargetConfig.__eq__ = _hash_of_options, _equal_options
    base.BaseContext.get_abi_sizeof = _each_size_once(base.BaseContext.get_abi_sizeof)
    base._has_loc = functools.cache(base._has_loc)
    operators = npydecl.NumpyRulesArrayOperator
    operators.generic = _only_with_arrays(operators.generic)
    NRTContext.get_meminfos = _only_counted(NRTContext.get_meminfos)
    numba.extending.overload(_report_shapes)(_shape_report)
    arrayobj.raise_with_shape_context = _report_shapes


# numba lists the variables of all statements after each of its passes


def _variables_of_statement(statement: Any) -> list[Any]:
    found: list[Any] = []
    for part in statement.__dict__.values():
        if part.__class__ not in _PLAIN:
            _add_variables(part, found)
    return found


def _variables_of_expression(expression: Any) -> list[Any]:
    found: list[Any] = []
    _add_variables(expression, found)
    return found


def _add_variables(part: Any, found: list[Any]) -> None:
    kind = part.__class__
    if kind is ir.Var:
        found.append(part)
    elif kind is ir.Expr or kind is dict:
        for inner in (part._kws if kind is ir.Expr else part).values():
            if inner.__class__ not in _PLAIN:
                _add_variables(inner, found)
    elif kind is list or kind is tuple:
        for inner in part:
            _add_variables(inner, found)
    elif isinstance(part, ir.Inst):
        found += part.list_vars()


# options of a compilation are keys of the types of each call


def _hash_of_options(options: Any) -> int:
    return hash(options.__class__)  # numba's own depends on the names of the options only


def _equal_options(options: Any, other: Any) -> Any:
    if options is other or (options.__class__ is other.__class__ and options._values == other._values):
        return True
    return options.values() == other.values() if isinstance(other, targetconfig.TargetConfig) else NotImplemented


def _each_size_once(size_of: Callable[[Any, Any], int]) -> Callable[[Any, Any], int]:
    """Sizes of types in LLVM; llvmlite parses a text for each request."""
    known: dict[str, int] = {}

    def remembered(context: Any, kind: Any) -> int:
        if isinstance(kind, llvm_ir.IdentifiedStructType):  # another module may have another type of this name
            return size_of(context, kind)
        name = str(kind)
        if name not in known:
            known[name] = size_of(context, kind)
        return known[name]

    return remembered


def _only_with_arrays(generic: Callable[..., Any]) -> Callable[..., Any]:
    """Types of operators of arrays; numba searches all loops of NumPy before it rejects two numbers."""

    def found(template: Any, arguments: Any, named: Any) -> Any:
        numbers = all(isinstance(one, types.Number | types.Boolean) for one in arguments)
        return None if numbers else generic(template, arguments, named)

    return found


def _only_counted(references: Callable[..., list[Any]]) -> Callable[..., list[Any]]:
    """Counted references in a value; a record or a tuple of numbers has none."""
    known: dict[Any, bool] = {}

    def has_some(context: Any, builder: Any, kind: Any) -> bool:
        model = context._context.data_model_manager[kind]
        return bool(model.has_nrt_meminfo()) or any(has_some(context, builder, part) for part, _ in model.traverse(builder))

    def found(context: Any, builder: Any, kind: Any, value: Any) -> list[Any]:
        if kind not in known:
            known[kind] = has_some(context, builder, kind)
        return references(context, builder, kind, value) if known[kind] else []

    return found


# an assignment to a part of an array compiles twenty functions of texts for the message on shapes that do not agree


def _report_shapes(given: Any, wanted: Any) -> None:
    raise NotImplementedError


def _shape_report(given: Any, wanted: Any) -> Callable[[Any, Any], None]:
    def report(given: Any, wanted: Any) -> None:
        raise ValueError("an array does not fit into the part of an array that is assigned")

    return report
