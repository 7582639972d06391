"""Dispatcher of kernels for calls from Python and from other kernels, with a cache on disk.

This module adds to ``numba.njit(cache=True)``:

* machine code is made only for kernels that Python calls. A kernel that calls another kernel links its code, so the callee
  by itself needs neither machine code, nor wrappers for calls from Python, nor an entry in the cache;
* entries of the cache do not contain data that only a later link would need, so they load quickly;
* symbols have short names. The names of numba contain the types of all arguments, which for tables of arrays are 100 kB in
  each of hundreds of symbols and messages of a kernel;
* a process whose sources were edited since its start no longer writes to the cache, because it would store new code under an
  old name;
* a kernel is compiled by one process at a time (`fsm.kernels.compile_lock`). Others wait and load its entry;
* a damaged or wrong entry is compiled again;
* a full disk is not an error.
"""

from __future__ import annotations

import errno
import functools
import gc
import hashlib
import logging
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from numba.core import event, itanium_mangler, sigutils, typing, untyped_passes
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator
from numba.core.compiler import Compiler, CompilerBase, CompileResult, DefaultPassBuilder, Flags, compile_extra
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys
from numba.core.target_extension import jit_registry, target_registry
from numba.core.types import containers
from numba.core.types.misc import unliteral

from fsm.io.gc_startup import keep_garbage
from fsm.kernels import cache_folder as folders
from fsm.kernels import linked_code
from fsm.kernels.array_items import in_kernels
from fsm.kernels.compile_lock import CompileLock
from fsm.kernels.lowering import with_less_code
from fsm.kernels.records import Record

_LONGEST_NAME: Final = 200
"""Letters of the names of types in a symbol that keeps the name that numba gives it."""

_log = logging.getLogger(__name__)
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
        if called is not None and _is_linkable(called.library):
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
            if isinstance(self._cache, _KernelCache):
                self._cache.lock.release()
            keep_garbage()
            if collects:
                gc.enable()

    def is_compiled_elsewhere(self) -> bool:
        """Whether another process compiles the function now."""
        self._begin_cache()
        return isinstance(self._cache, _KernelCache) and self._cache.lock.is_taken()

    def _begin_cache(self) -> None:
        if self._to_cache:
            self._to_cache = False
            if folders.cache_folder() is not None:
                with suppress(RuntimeError, OSError):  # if the folder has disappeared, the kernel is not cached
                    self._cache = _KernelCache(self.py_func, self._address)

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
        if not isinstance(self._cache, _KernelCache) or not self._cache._enabled:
            return None
        return linked_code.entry(self._cache.folder, self.py_func, kinds, _field_names(kinds))

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


def _is_linkable(library: Any) -> bool:
    """Whether a library has the code that another library links. A library from the cache has machine code only."""
    return any(not function.is_declaration for function in library._final_module.functions)


# ------------------------------------------------------------------------------------------------------ cache


class _Locator(UserProvidedCacheLocator):  # type: ignore[misc, unused-ignore]
    """Location of the cache entries of one function: a folder named by a hash of its sources."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._py_file = str(folders.source_of(function))
        self._lineno = function.__code__.co_firstlineno
        parent = folders.cache_folder()
        if parent is None:
            raise FileNotFoundError(errno.ENOENT, "no cache folder")
        self._cache_path = str(parent / folders.key(folders.source_of(function)))

    def get_source_stamp(self) -> str:
        """Return a constant, because the name of the folder already identifies the sources."""
        return ""

    def ensure_cache_path(self) -> None:
        """Create the folder with permissions for this user only."""
        folders.create_folder(Path(self._cache_path))


class _CacheImpl(CompileResultCacheImpl):  # type: ignore[misc, unused-ignore]
    """Machine code and data for a call from Python, at the location of `_Locator` for any settings of numba."""

    def __init__(self, function: Callable[..., Any], address: bool) -> None:
        self._lineno = function.__code__.co_firstlineno
        self._locator = _Locator(function)
        full_name = f"{folders.source_of(function).stem}.{function.__qualname__}{'.address' * address}"
        self._filename_base = self.get_filename_base(full_name, getattr(sys, "abiflags", ""))

    def reduce(self, data: Any) -> tuple[Any, ...]:
        """Return the part of the compiled function `data` that is stored."""
        library, described = data.library, data.fndesc
        described.typemap = described.calltypes = None  # this part is large, and nothing uses it after the compilation
        names = (described.llvm_func_name, described.llvm_cpython_wrapper_name, described.llvm_cfunc_wrapper_name)
        symbols = {name for name in names if library.codegen._engine.is_symbol_defined(name)}
        environments = tuple(data._find_referenced_environments())
        return (
            library.name, library._get_compiled_object(), symbols, described, data.environment, data.signature,
            data.reload_init, environments,
        )  # fmt: skip

    def rebuild(self, target_context: Any, payload: tuple[Any, ...]) -> Any:
        """Return the compiled function from its stored part."""
        name, machine_code, symbols, described, environment, signature, reload_init, environments = payload
        for function in reload_init:
            function()
        codegen = target_context.codegen()
        library = codegen.create_library(name)
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._finalize_final_module()
        codegen._engine._defined_symbols |= symbols
        fields = dict.fromkeys(CompileResult._fields) | {
            "target_context": target_context,
            "typing_context": target_context.typing_context,
            "library": library,
            "environment": environment,
            "entry_point": target_context.get_executable(library, described, environment),
            "fndesc": described,
            "signature": signature,
            "objectmode": False,
            "lifted": (),
            "reload_init": reload_init,
            "referenced_envs": environments,
        }
        for below in environments:
            codegen.set_env(below.env_name, below)
        return CompileResult(**fields)


class _KernelCache(FunctionCache):
    """numba's cache of one function; instead of an error, an invalid entry causes a new compilation."""

    def __init__(self, function: Callable[..., Any], address: bool) -> None:
        self._impl_class = functools.partial(_CacheImpl, address=address)
        super().__init__(function)
        self.folder = Path(self._cache_path)
        self._file = folders.source_of(function)
        self.lock = CompileLock(self.folder / f"{self._impl.filename_base}.lock")
        if self.folder.exists():
            if (fault := folders.fault_of(self.folder)) is not None:
                _log.warning("compiled kernels are not used: %s", fault)
                self.disable()
            else:
                folders.mark_as_used(self.folder)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the stored machine code for the signature `sig`, or None; this process compiles the kernel then.

        It needs the memory management of numba, but not the tables of types and functions that a compilation needs.
        """
        rtsys.initialize(target_context)
        stored = self._stored(sig, target_context)
        if stored is None and self._enabled and self.folder.name == folders.key_now(self._file) and self.lock.acquire():
            stored = self._stored(sig, target_context)  # another process has compiled the kernel in the meantime
        return stored

    def _stored(self, sig: Any, target_context: Any) -> Any:
        try:
            stored = self._load_overload(sig, target_context)
        except Exception as fault:  # a damaged pickle can raise any exception
            _log.debug("cache entry of %s is damaged (%r); compiling again", self._name, fault)
            with suppress(OSError):
                self.flush()
            return None
        if stored is not None and tuple(stored.signature.args) != tuple(sigutils.normalize_signature(sig)[0]):
            _log.debug("cache entry of %s is for %s; compiling again", self._name, stored.signature)
            return None
        return stored

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the machine code for the signature `sig` unless the sources have changed since import."""
        if self.folder.name != folders.key_now(self._file):
            return
        try:
            super().save_overload(sig, data)
        except OSError as fault:
            self.disable()
            _log.debug("cannot store %s: %s", self._name, fault)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Return numba's key of a signature, and the field names of the NamedTuples among the arguments.

        Machine code reads fields by their order, and the module of a NamedTuple is possibly not covered by the hash.
        """
        return (*super()._index_key(sig, codegen), _field_names(sig))


def _field_names(argument_types: Any) -> tuple[Any, ...]:
    """Field names of all NamedTuples among numba types, including those inside tuples."""
    names: list[Any] = []
    for kind in argument_types:
        if isinstance(kind, containers.BaseNamedTuple):
            names.append(tuple(kind.fields))
        if isinstance(kind, containers.BaseTuple):
            names.append(_field_names(kind))
    return tuple(names)
