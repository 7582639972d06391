"""Dispatcher of kernels for calls from Python and from other kernels, with a cache on disk.

This module adds to ``numba.njit(cache=True)``:

* machine code is made only for kernels that Python calls. A kernel that calls another kernel links its code, so the callee
  by itself needs neither machine code, nor wrappers for calls from Python, nor an entry in the cache;
* entries of the cache load quickly (`fsm.kernels.machine_code`);
* symbols have short names. The names of numba contain the types of all arguments, which for tables of arrays are 100 kB in
  each of hundreds of symbols and messages of a kernel;
* a process whose sources were edited since its start no longer writes to the cache, because it would store new code under an
  old name;
* a kernel is compiled by one process at a time (`fsm.kernels.compile_lock`). Others wait and load its entry;
* a damaged or wrong entry is compiled again;
* a full disk is not an error.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from numba.core import event, itanium_mangler, sigutils, typing, untyped_passes
from numba.core.compiler import Compiler, CompilerBase, DefaultPassBuilder, Flags, compile_extra
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager
from numba.core.registry import CPUDispatcher
from numba.core.target_extension import jit_registry, target_registry
from numba.core.types import containers
from numba.core.types.misc import unliteral

from fsm.io.gc_startup import keep_garbage
from fsm.kernels import cache_folder as folders
from fsm.kernels import linked_code
from fsm.kernels.array_items import in_kernels
from fsm.kernels.lowering import with_less_code
from fsm.kernels.machine_code import KernelCache, StoredLibrary
from fsm.kernels.records import Record

_LONGEST_NAME: Final = 200
"""Letters of the names of types in a symbol that keeps the name that numba gives it."""

_making = threading.RLock()


class _KernelPasses(CompilerBase):  # type: ignore[misc, unused-ignore]
    """Passes of the compiler that kernels need; kernels have no closures, ``with`` blocks and loops over mixed tuples."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes as numba's own compiler groups them."""
        untyped = PassManager("untyped")
        for step in (
            untyped_passes.TranslateByteCode, untyped_passes.FixupArgs, untyped_passes.IRProcessing,
            untyped_passes.RewriteSemanticConstants, untyped_passes.DeadBranchPrune, untyped_passes.GenericRewrites,
            untyped_passes.ReconstructSSA, untyped_passes.LiteralPropagationSubPipelinePass,
        ):  # fmt: skip
            untyped.add_pass(step, step.__name__)
        untyped.finalize()
        typed = DefaultPassBuilder.define_typed_pipeline(self.state)
        lowering = DefaultPassBuilder.define_nopython_lowering_pipeline(self.state)
        whole = PassManager("nopython")
        whole.passes.extend([*untyped.passes, *typed.passes, *with_less_code(lowering.passes)])
        whole.finalize()
        return [whole]


class _LinkedPasses(Compiler):  # type: ignore[misc, unused-ignore]
    """Passes of numba's compiler, for functions of numba and of users that kernels link."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes as numba's own compiler groups them."""
        found = super().define_pipelines()
        for manager in found:
            manager.passes[:] = with_less_code(manager.passes)
        return list(found)


class _Linkable(CPUDispatcher):  # type: ignore[misc, unused-ignore]
    """numba's dispatcher of a function, which other kernels link without machine code of its own.

    Parameters
    ----------
    function : Python function
    passes : numba's class of a compiler
    options : options of numba
    """

    def __init__(self, function: Callable[..., Any], passes: type[CompilerBase] = _LinkedPasses, **options: Any) -> None:
        super().__init__(function, targetoptions=options, pipeline_class=passes)
        self._passes = passes
        self.targetctx.mangler = _short_name
        self._linked: dict[tuple[Any, ...], Any] = {}

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return the types of a call by another kernel, for numba; compile the function for it."""
        signature, given = self._compiler.fold_argument_types(args, kws)
        kinds = tuple(self._kind(kind) for kind in given)
        self._compile_linked(kinds)
        name = self.py_func.__name__
        found = [result.signature for result in self._linked.values()]
        return typing.make_concrete_template(f"CallTemplate({name})", key=name, signatures=found), signature, kinds, {}

    def get_overload(self, sig: Any) -> Any:
        """Return the identification of the code for a call by another kernel, for numba."""
        return self._linked[tuple(sigutils.normalize_signature(sig)[0])].entry_point

    def _kind(self, given: Any) -> Any:
        """Type of an argument for which the function is compiled."""
        return given

    def _compile_linked(self, kinds: tuple[Any, ...]) -> None:
        """Compile the function only as far as calls by other kernels require."""
        if kinds in self._linked:
            return
        called = self.overloads.get(kinds)
        if called is not None and not isinstance(called.library, StoredLibrary):
            self._linked[kinds] = called
            return
        file = self._entry(kinds)
        result = None if file is None else linked_code.load(file, kinds, self.targetctx)
        if result is None:
            result = self._compiled(kinds)
            if file is not None:
                linked_code.save(file, folders.source_of(self.py_func), result)
        result = result._replace(entry_point=object())
        self.targetctx.insert_user_function(result.entry_point, result.fndesc, [result.library])
        self._linked[kinds] = result

    def _compiled(self, kinds: tuple[Any, ...]) -> Any:
        """Code of the function for other kernels."""
        with in_kernels(), self._compiling_counter, event.trigger_event(
            "numba:compile", data={"dispatcher": self, "args": kinds, "return_type": None}
        ):
            flags = Flags()
            self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
            flags.no_cpython_wrapper = flags.no_cfunc_wrapper = flags.no_compile = True
            library = linked_code.LinkedLibrary(self.targetctx.codegen(), self.py_func.__qualname__)
            library.sources, library.covered = linked_code.origin(self.py_func)
            return compile_extra(
                self.typingctx, self.targetctx, self.py_func, kinds, None, flags, self.locals, library=library,
                pipeline_class=self._passes,
            )

    def _entry(self, kinds: tuple[Any, ...]) -> Path | None:
        """File for the code of the function for other kernels, if it is kept."""
        return None


class KernelDispatcher(_Linkable):
    """numba's dispatcher of a function, with the cache of this package.

    Parameters
    ----------
    function : Python function
    inline : bool
        Make LLVM inline the function into every caller.
    address : bool
        Other kernels call the function by its address, and Python does not call it.
    """

    _cache: Any

    def __init__(self, function: Callable[..., Any], inline: bool, address: bool = False) -> None:
        options = {"nopython": True, "boundscheck": None} | folders.OPTIONS | ({"forceinline": True} if inline else {})
        super().__init__(function, _KernelPasses, **options, no_cpython_wrapper=address)
        self._to_cache, self._address = folders.is_covered(function), address

    def compile(self, sig: Any) -> Any:
        """Compile the function for calls from Python, or load it from the cache."""
        self._begin_cache()
        collects = gc.isenabled()
        gc.disable()  # a compilation allocates millions of objects that live until its end
        try:
            with global_compiler_lock, _overloads_linked(), in_kernels():
                kinds = sigutils.normalize_signature(sig)[0]
                self.targetoptions["no_cfunc_wrapper"] = not self._address and _has_tuples(kinds)
                return super().compile(sig)
        finally:
            if isinstance(self._cache, KernelCache):
                self._cache.lock.release()
            keep_garbage()
            if collects:
                gc.enable()

    def is_compiled_elsewhere(self) -> bool:
        """Whether another process compiles the function now."""
        self._begin_cache()
        return isinstance(self._cache, KernelCache) and self._cache.lock.is_taken()

    def _begin_cache(self) -> None:
        if self._to_cache:
            self._to_cache = False
            if folders.cache_folder() is not None:
                with suppress(RuntimeError, OSError):  # if the folder has disappeared, the kernel is not cached
                    self._cache = KernelCache(self.py_func, self._address)

    def by_address(self, kinds: tuple[Any, ...]) -> KernelDispatcher:
        """The same function for calls by its address, with arguments of these types.

        Calls from Python and calls by address share their code, except for those with tuples of arrays, whose code for a
        call can take longer to compile than the function.
        """
        return self._called_by_address if _has_tuples(kinds) else self

    @functools.cached_property
    def _called_by_address(self) -> KernelDispatcher:
        return KernelDispatcher(self.py_func, bool(self.targetoptions.get("forceinline")), address=True)

    def _kind(self, given: Any) -> Any:
        return unliteral(given)  # not compiled for each constant

    def _entry(self, kinds: tuple[Any, ...]) -> Path | None:
        self._begin_cache()
        return self._cache.file(kinds, "linked") if isinstance(self._cache, KernelCache) else None

    def _compilation_chain_init_hook(self) -> None:
        """Do nothing before a call: extensions of numba are needed for a compilation only, which loads them itself."""


@contextmanager
def _overloads_linked() -> Iterator[None]:
    """Let kernels link numba's own functions that they call; numba makes machine code and wrappers of each."""
    target = target_registry["cpu"]
    before = jit_registry.pop(target)  # the registry refuses a second value
    jit_registry[target] = lambda **options: functools.partial(_Linkable, **({"nopython": True} | options))
    try:
        yield
    finally:
        jit_registry.pop(target)
        jit_registry[target] = before


class ImportedKernel(KernelDispatcher):
    """Kernel that was imported and not used so far. The first use makes it a `KernelDispatcher`.

    Most kernels of the package are never used in a process, and to make the dispatchers of all of them takes 50 ms.

    Parameters
    ----------
    function, inline : as for `KernelDispatcher`
    """

    def __init__(self, function: Callable[..., Any], inline: bool) -> None:
        functools.update_wrapper(self, function)
        self.py_func, self._made_with, self._maker = function, (function, inline), 0
        if folders.is_covered(function):
            folders.key(folders.source_of(function))  # this is the hash of the sources at the time of the import

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the kernel."""
        self._make()
        return self(*arguments, **named)

    def __getattr__(self, name: str) -> Any:
        if self._maker == threading.get_ident():
            raise AttributeError(name)
        self._make()
        return getattr(self, name)

    @property
    def _numba_type_(self) -> Any:
        self._make()
        return self._numba_type_

    def __reduce__(self) -> Any:
        self._make()
        return self.__reduce__()

    def _make(self) -> None:
        """Make the dispatcher; other threads wait for it."""
        with _making:
            if type(self) is ImportedKernel:
                self._maker = threading.get_ident()
                super().__init__(*self._made_with)
                self.__class__ = KernelDispatcher


def _has_tuples(kinds: tuple[Any, ...]) -> bool:
    return any(isinstance(kind, (containers.BaseTuple, Record)) for kind in kinds)


def _short_name(name: str, types: Any, *, abi_tags: Any = (), uid: int | None = None) -> str:
    """Name of a symbol: that of numba, or a hash of the types of its arguments if their names are long."""
    whole = "\n".join((name, *map(str, types), *abi_tags))
    if len(whole) <= _LONGEST_NAME:
        return str(itanium_mangler.mangle(name, types, abi_tags=abi_tags, uid=uid))
    digest = hashlib.sha256(whole.encode()).hexdigest()[:32]
    inner = "<locals>." * ("<locals>" in name)  # as `fsm.kernels.linked_code` finds these functions
    return str(itanium_mangler.mangle(f"{inner}{name.rpartition('.')[2]}.{digest}", (), uid=uid))
