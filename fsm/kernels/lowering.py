"""Generation of LLVM code for kernels: as numba's, with less code for variables and for loops over ranges, and with the
names of modules of this package as constants.

LLVM removes the rest of numba's code again, but takes long for it.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any, Final

import numba
from llvmlite import ir
from numba.core import cgutils, rewrites
from numba.core import ir as numba_ir
from numba.core.compiler_machinery import register_pass
from numba.core.ir_utils import get_definition, guard
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

from fsm.kernels.array_items import has_no_owner

types: Any = numba.types
_RANGE: Final = types.range_state64_type
_ITERATOR: Final = types.range_iter64_type
_PLACE, _STEP, _COUNT = 0, 2, 3
_MEMBERS: Final = ("iter", "stop", "step", "count")
"""Members of an iterator over a range in numba's data model."""


class _Lower(Lower):  # type: ignore[misc, unused-ignore]
    """Generator of the code of one function."""

    def delvar(self, name: str) -> None:
        """End the life of a variable; numba sets also those to zero that have no counted references."""
        if self.context.data_model_manager[self.typeof(name)].contains_nrt_meminfo():
            super().delvar(name)

    def incref(self, kind: Any, value: Any) -> None:
        """Count a reference."""
        if not (isinstance(kind, types.Array) and has_no_owner(value)):
            super().incref(kind, value)

    def decref(self, kind: Any, value: Any) -> None:
        """Count a reference less."""
        if not (isinstance(kind, types.Array) and has_no_owner(value)):
            super().decref(kind, value)

    def lower_expr(self, resty: Any, expr: Any) -> Any:
        """Code of an expression."""
        if expr.op in ("getiter", "iternext") and self.context.data_model_manager[_ITERATOR]._fields == _MEMBERS:
            of = self.typeof(expr.value.name)
            if expr.op == "getiter" and of == _RANGE:
                return self._begin(self.loadvar(expr.value.name))
            if expr.op == "iternext" and of == _ITERATOR:
                return self._next(self.loadvar(expr.value.name), self.context.get_value_type(resty))
        return super().lower_expr(resty, expr)

    def _begin(self, given: Any) -> Any:
        """Iterator over a range: n = (stop - start + step - sign(step)) / step numbers."""
        builder = self.builder
        start, stop, step = cgutils.unpack_tuple(builder, given, 3)
        zero, one = ir.Constant(step.type, 0), ir.Constant(step.type, 1)
        with builder.if_then(builder.icmp_signed("==", step, zero), likely=False):
            self.context.call_conv.return_user_exc(builder, ValueError, ("range() arg 3 must not be zero",))
        sign = builder.select(builder.icmp_signed(">", step, zero), one, ir.Constant(step.type, -1))
        count = builder.sdiv(builder.sub(builder.add(builder.sub(stop, start), step), sign), step)
        iterator = ir.Constant(self.context.get_value_type(_ITERATOR), None)
        for member, number in ((_PLACE, start), (_COUNT, count)):
            place = cgutils.alloca_once(builder, number.type)
            builder.store(number, place)
            iterator = builder.insert_value(iterator, place, member)
        return builder.insert_value(iterator, step, _STEP)

    def _next(self, iterator: Any, form: Any) -> Any:
        """Next number, and whether there is one."""
        builder = self.builder
        place, count_place = (builder.extract_value(iterator, member) for member in (_PLACE, _COUNT))
        number, count = builder.load(place), builder.load(count_place)
        there = builder.icmp_signed(">", count, ir.Constant(count.type, 0))
        builder.store(builder.sub(count, ir.Constant(count.type, 1), flags=["nsw"]), count_place)
        builder.store(builder.add(number, builder.extract_value(iterator, _STEP)), place)
        return builder.insert_value(builder.insert_value(ir.Constant(form, None), number, 0), there, 1)


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(NativeLowering):  # type: ignore[misc, unused-ignore]
    """Pass of the compiler with this generator."""

    _name = "kernel_lowering"

    @property
    def lowering_class(self) -> Any:
        """Class of the generator."""
        return _Lower


@rewrites.register_rewrite("before-inference")
class _NamesOfModules(rewrites.Rewrite):  # type: ignore[misc, unused-ignore]
    """``module.NAME`` of this package as if NAME were imported: numba has no constants from modules."""

    def match(self, func_ir: Any, block: Any, *types_of: Any) -> bool:
        """Find such names in a block."""
        self._block, self._found = block, {}
        for one in block.find_exprs(op="getattr"):
            of = guard(get_definition, func_ir, one.value)
            module = of.value if isinstance(of, numba_ir.Global) else None
            if isinstance(module, ModuleType) and module.__name__.startswith("fsm."):
                self._found[one] = numba_ir.Global(one.attr, getattr(module, one.attr), one.loc)
        return bool(self._found)

    def apply(self) -> Any:
        """Replace them."""
        for one in self._block.find_insts(numba_ir.Assign):
            one.value = self._found.get(one.value, one.value)
        return self._block


def with_less_code(passes: list[tuple[Any, str]]) -> list[tuple[Any, str]]:
    """Passes of the compiler with this generator in place of numba's."""
    return [(KernelLowering if one is NativeLowering else one, name) for one, name in passes]
