"""Kernels that other kernels call by their addresses, so that they are not compiled together.

A kernel contains the code of all kernels that it calls. The compiler optimises this code again in each kernel that Python
calls. A call by address takes 50 ns and avoids this cost.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any, ClassVar, TypeVar

import numba
import numba.extending
from llvmlite import ir
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.types.functions import BaseFunction
from numba.core.typing.templates import make_concrete_template
from numba.core.typing.typeof import typeof_impl
from numba.np.arrayobj import make_array

from fsm.kernels.records import kinds_of, record_type

T = TypeVar("T")
_backwards = False


class _Address(BaseFunction):  # type: ignore[misc, unused-ignore]
    """Type of a `Pointer`: an address in machine code, which a kernel calls directly.

    A call through numba's own function types compiles in code that asks Python for a missing address and reports it.
    """

    def __init__(self, signature: Any) -> None:
        self.sig = signature
        super().__init__(make_concrete_template("Address", signature, [signature]))
        self.name = f"Address({hashlib.sha256(str(signature).encode()).hexdigest()[:32]})"

    def __reduce__(self) -> Any:
        return _Address, (self.sig,)

    @property
    def key(self) -> Any:
        """Identification of the type."""
        return (self.sig,)

    def get_call_type(self, context: Any, arguments: Any, named: Any) -> Any:
        """Types of a call, whose first argument is the address."""
        called: Any = super().get_call_type(context, arguments, named)
        return called.replace(recvr=self)

    def get_impl_key(self, signature: Any) -> Any:
        """Identification of the code of a call."""
        return _Address


@lower_builtin(_Address, _Address, numba.types.VarArg(numba.types.Any))
def _call(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kinds = [context.get_value_type(kind) for kind in signature.args[1:]]
    form = ir.FunctionType(context.get_value_type(signature.return_type), kinds)
    return builder.call(builder.bitcast(arguments[0], form.as_pointer()), arguments[1:])


@numba.extending.register_model(_Address)
class _AddressModel(numba.extending.models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, cgutils.voidptr_t)


@numba.extending.unbox(_Address)
def _read(kind: Any, pointer: Any, c: Any) -> Any:
    number = c.pyapi.object_getattr_string(pointer, "address")
    address = c.pyapi.long_as_voidptr(number)
    c.pyapi.decref(number)
    return numba.extending.NativeValue(address)


class Pointer:
    """A compiled kernel by its address; the same object for the same kernel and types of arguments.

    Parameters
    ----------
    function : kernel
    arguments : examples of its arguments
    """

    _made: ClassVar[dict[tuple[Any, ...], Pointer]] = {}
    _numba_type_: Any
    address: int
    _keeps: Any  # the pointer refers to the machine code and to the types
    _entries: dict[Any, Any]
    _beside: dict[tuple[int, ...], Pointer]

    def __new__(cls, function: Any, *arguments: Any) -> Pointer:
        """Find or compile the kernel."""
        return cls.for_kinds(function, kinds_of(arguments))

    @classmethod
    def for_kinds(cls, function: Any, kinds: tuple[Any, ...]) -> Pointer:
        """Find or compile the kernel for arguments of these types of numba."""
        key = (function, *map(id, kinds))  # equal types are one object, and their hashes take long
        found = cls._made.get(key)
        if found is None:
            called = function.by_address(kinds)
            called.compile(kinds)
            result = called.overloads[kinds]
            found = cls._made[key] = super().__new__(cls)
            found._numba_type_ = _Address(result.signature)
            found.address = int(result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name))
            found._keeps, found._entries, found._beside = (result, kinds), {}, {}
        return found

    def beside(self, others: Sequence[Any]) -> Pointer:
        """Pointer to this kernel, one object for the same types of pointers beside it: their results may be constants."""
        key = (*(id(other._numba_type_) for other in others),)
        found = self._beside.get(key)
        if found is None:
            found = self._beside[key] = object.__new__(Pointer)
            found._numba_type_, found.address = self._numba_type_, self.address
            found._keeps, found._entries, found._beside = (self, [*others]), {}, {}
        return found

    @classmethod
    def is_compiled_elsewhere(cls, function: Any, kinds: tuple[Any, ...]) -> bool:
        """Whether another process compiles this kernel now."""
        if (function, *map(id, kinds)) in cls._made:
            return False
        return bool(function.by_address(kinds).is_compiled_elsewhere())

    @property
    def first_type(self) -> Any:
        """Type of the first argument, for numba."""
        return self._numba_type_.sig.args[0]

    def entry(self, function: Any, *arguments: Any) -> Any:
        """Entry point of a kernel for arguments of these types, remembered with this pointer.

        Later arguments must have the same types. A call of the kernel itself would look up all types, for 10 us.
        """
        found = self._entries.get(function)
        if found is None:
            kinds = kinds_of(arguments)
            function.compile(kinds)
            found = self._entries[function] = function.overloads[kinds].entry_point
        return found


class Example:
    """Example of an argument of the type of a value, which is determined only once.

    Parameters
    ----------
    value : any argument of a kernel
    """

    def __init__(self, value: Any) -> None:
        (self._numba_type_,) = kinds_of((value,))


class AbsentPointer:
    """`Pointer` of the type of some function that is never called, so that it need not be compiled.

    Parameters
    ----------
    result : example of the result
    arguments : examples of the arguments
    """

    address = 1

    _made: ClassVar[dict[tuple[int, ...], Any]] = {}

    def __init__(self, result: Any, *arguments: Any) -> None:
        kinds = kinds_of((result, *arguments))
        key = (*map(id, kinds),)
        if key not in self._made:
            self._made[key] = kinds, _Address(kinds[0](*kinds[1:]))
        self._numba_type_ = self._made[key][1]


def pointers(kernels: T, arguments: T) -> T:
    """Tuple of pointers to kernels, with examples of the arguments of each; without the compiler the kernels themselves."""
    if numba.config.DISABLE_JIT:
        return kernels
    each: Any = zip(kernels, arguments, strict=True)  # type: ignore[call-overload]
    first, *others = pointers_to([(one, *of) for one, of in each])
    return type(kernels)(*[first.beside(others), *others])


def pointers_to(wanted: Sequence[tuple[Any, ...]]) -> list[Any]:
    """Pointers to kernels, each given with examples of its arguments.

    Kernels that another process compiles now come last, so that two processes seldom wait for each other.
    """
    typed = [(function, kinds_of(arguments)) for function, *arguments in wanted]
    found: list[Any] = [None] * len(typed)
    left = [*range(len(typed))][:: -1 if _backwards else 1]
    for waits in (False, True):
        for k in [*left]:
            if waits or not Pointer.is_compiled_elsewhere(*typed[k]):
                found[k] = Pointer.for_kinds(*typed[k])
                left.remove(k)
    return found


def compile_backwards() -> None:
    """Let `pointers` begin with the last kernel: beside a process that begins with the first, each compiles a half."""
    global _backwards
    _backwards = True


def enter(first: Any, function: Any, *arguments: Any) -> Any:
    """Call a kernel from Python by its entry point, remembered with one of the pointers among its arguments."""
    if numba.config.DISABLE_JIT:
        return function(*arguments)
    return first.entry(function, *arguments)(*arguments)


def typed_by(kind: type) -> None:
    """Make NamedTuples of one kind records and let numba remember their types; fields `calls` (pointers) and `arrays` (their
    argument).

    Without this, a call from Python takes a millisecond to determine the types of all fields.
    """

    def find(model: Any, context: Any) -> Any:
        first = model.calls[0]
        known = getattr(first, "of_model", None)
        if known is None:
            calls = record_type(type(model.calls), [pointer._numba_type_ for pointer in model.calls])
            known = first.of_model = record_type(kind, [calls, first.first_type])
        return known

    typeof_impl.register(kind)(find)


if numba.config.DISABLE_JIT:
    _functions: dict[int, Any] = {}

    def address_of(function: Any, *arguments: Any) -> int:
        """Address of a kernel; without the compiler a number by which `call_at` finds it."""
        _functions[id(function)] = function
        return id(function)

    def call_at(address: int, first: Any, second: Any, *numbers: float) -> float:
        """Call the kernel at an address, see below."""
        return float(_functions[address](first, second, *numbers))

    def borrowed(value: T) -> T:
        """Placeholder for numba; the overload below implements it."""
        return value

else:
    _pointers: dict[Any, Pointer] = {}

    def address_of(function: Any, *arguments: Any) -> int:
        """Address of a kernel, whose machine code is kept; `arguments` are examples of its arguments, always of the same
        types.
        """
        if function not in _pointers:
            _pointers[function] = Pointer(function, *arguments)
        return _pointers[function].address

    @numba.extending.intrinsic
    def call_at(context: Any, address: Any, first: Any, second: Any, *numbers: Any) -> Any:
        """Call the kernel at an address, with two tables of `fsm.kernels.addresses` and numbers; the kernel returns a
        number.

        Kernels of elements have this form, so that a model holds the addresses of any combination of them in one array.
        """
        table = numba.types.Array(numba.types.int64, 2, "C")
        real = numba.types.float64

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            address, *tables, packed = arguments
            passed = [*tables, *cgutils.unpack_tuple(builder, packed, len(numbers))]
            kinds = [context.get_value_type(kind) for kind in [*signature.args[1:3], *signature.args[3]]]
            form = ir.FunctionType(context.get_value_type(signature.return_type), kinds)
            return builder.call(builder.inttoptr(address, form.as_pointer()), passed)

        return real(numba.types.int64, table, table, numba.types.UniTuple(real, len(numbers))), generate

    @numba.extending.intrinsic
    def borrowed(context: Any, value: Any) -> Any:
        """Return arrays, or tuples that contain them, without their owners.

        A kernel counts the references of all arrays of a tuple whenever it passes the tuple on. Without owners it does not.
        The caller must keep the arrays alive.
        """

        def without(context: Any, builder: Any, kind: Any, passed: Any) -> Any:
            if isinstance(kind, numba.types.Array):
                array = make_array(kind)(context, builder, passed)
                array.meminfo = array.parent = context.get_constant_null(numba.types.voidptr)
                return array._getvalue()
            if isinstance(kind, numba.types.BaseTuple):
                for i, part in enumerate(kind.types):
                    inner = without(context, builder, part, builder.extract_value(passed, i))
                    passed = builder.insert_value(passed, inner, i)
            return passed

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return without(context, builder, signature.args[0], arguments[0])

        return value(value), generate
