"""Kernels that a table names by their addresses, as a tuple of functions in another kernel.

A group brings its kernels in its own table, so that the types of a model do not depend on the kinds of its groups.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numba
import numba.extending
import numpy as np
from numba.core import cgutils
from numba.np.arrayobj import make_array

from fsm.kernels.pointers import AbsentPointer, pointers

T = TypeVar("T")


_kept: dict[int, Any] = {}


def addresses_of(kernels: Sequence[Any], arguments: Sequence[Any]) -> np.ndarray:
    """Addresses (n,) of kernels, with examples of their arguments; without the compiler numbers that stand for kernels."""
    found = pointers(kernels, arguments)
    if numba.config.DISABLE_JIT:
        _kept.update((id(one), one) for one in found)
    return np.array([getattr(one, "address", id(one)) for one in found])


def kernels_in(kind: Callable[..., T], examples: Callable[[], tuple[Any, Any]]) -> Callable[[Any], T]:
    """Function of kernels that returns the kernels of a table: ``f(table)`` with their addresses in ``table.calls``.

    Parameters
    ----------
    kind : NamedTuple class
        Its fields are the kernels.
    examples : function
        Returns examples of the result and of the arguments of each kernel.
    """

    def of(table: Any) -> T:
        return kind(*(_kept[number] for number in table.calls.tolist()))  # without the compiler

    if numba.config.DISABLE_JIT:
        return of

    @numba.extending.intrinsic
    def found(context: Any, addresses: Any) -> Any:
        functions = [AbsentPointer(result, *rest)._numba_type_ for result, rest in zip(*examples(), strict=True)]
        tuple_type = numba.types.NamedTuple(functions, kind)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            data = make_array(addresses)(context, builder, arguments[0]).data
            values = []
            for row in range(len(functions)):
                place = builder.gep(data, [context.get_constant(numba.types.intp, row)])
                values.append(builder.inttoptr(builder.load(place), cgutils.voidptr_t))
            return context.make_tuple(builder, tuple_type, values)

        return tuple_type(addresses), generate

    @numba.extending.overload(of, strict=False)
    def choose(table: Any) -> Any:
        return lambda table: found(table.calls)

    return of
