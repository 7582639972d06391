"""Machine code of kernels that Python calls, in the cache: one file for each kernel and types of its arguments.

An entry does not contain data that only a later link would need. Types that are those of arguments are not stored: the
process that loads the entry has them already, and to make a type of a model from its text takes half a millisecond.
"""

from __future__ import annotations

import hashlib
import io
import logging
import pickle
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba.core import sigutils
from numba.core.compiler import CompileResult
from numba.core.runtime import _nrt_python
from numba.core.serialize import NumbaPickler
from numba.core.types import containers

from fsm.kernels import cache_folder as folders
from fsm.kernels.compile_lock import CompileLock
from fsm.kernels.records import Record

_log = logging.getLogger(__name__)


class StoredLibrary:
    """Library of a kernel whose machine code is from the cache; other kernels cannot link it.

    Parameters
    ----------
    codegen : numba's generator of code
    name : str
    """

    def __init__(self, codegen: Any, name: str) -> None:
        self.codegen, self.name = codegen, name

    def get_pointer_to_function(self, name: str) -> int:
        """Address of a function, for numba; zero if there is none."""
        engine = self.codegen._engine
        return int(engine.get_function_address(name)) if engine.is_symbol_defined(name) else 0


class KernelCache:
    """Entries of one function; instead of an error, an invalid entry causes a new compilation.

    Parameters
    ----------
    function : function of a kernel
    address : bool
        Whether other kernels call it by its address, and Python does not call it.
    """

    def __init__(self, function: Callable[..., Any], address: bool) -> None:
        parent, self._source = folders.cache_folder(), folders.source_of(function)
        if parent is None:
            raise FileNotFoundError("no cache folder")
        self._function, self._kind = function, "address" if address else "code"
        self.folder = parent / folders.key(self._source)
        self.cache_path = str(self.folder)
        self._enabled = True
        self._name = f"{self._source.stem}.{function.__qualname__}"
        self.lock = CompileLock(self.folder / f"{self._name}.{self._kind}.lock")
        if self.folder.exists():
            if (fault := folders.fault_of(self.folder, parent)) is not None:
                _log.warning("compiled kernels are not used: %s", fault)
                self._enabled = False
            else:
                folders.mark_as_used(self.folder)

    def file(self, kinds: tuple[Any, ...], kind: str) -> Path | None:
        """File of code of the function for arguments of these types; None if a type is of an object of this process."""
        digests = tuple(map(_digest, kinds))
        if not self._enabled or None in digests:
            return None
        text = repr((self._function.__code__.co_firstlineno, *digests))
        return self.folder / f"{self._name}.{kind}-{hashlib.sha256(text.encode()).hexdigest()[:24]}"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the stored machine code for the signature `sig`, or None; this process compiles the kernel then."""
        _add_memory_management()
        kinds = sigutils.normalize_signature(sig)[0]
        file = self.file(kinds, self._kind)
        if file is None:
            return None
        stored = _load(file, kinds, target_context)
        if stored is None and self.folder.name == folders.key_now(self._source) and self.lock.acquire():
            stored = _load(file, kinds, target_context)  # another process has compiled the kernel in the meantime
        return stored

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the machine code for the signature `sig` unless the sources have changed since import."""
        kinds = sigutils.normalize_signature(sig)[0]
        file = self.file(kinds, self._kind)
        if file is None or self.folder.name != folders.key_now(self._source):
            return
        if data.library.has_dynamic_globals:
            _log.warning("kernel %s is not kept, because it contains addresses of this process", self._function.__qualname__)
            return
        self._enabled = folders.write(file, _content(kinds, data))


_digests: dict[int, tuple[Any, str | None]] = {}
"""Types by their addresses, with their digests: equal types are one object, and the text of a model is long."""


def _digest(kind: Any) -> str | None:
    """Digest of a type; None if it is of an object of this process.

    It includes the classes and field names of all NamedTuples inside: machine code reads fields by their order, and the
    module of a NamedTuple is possibly not covered by the hash of the folder.
    """
    if id(kind) not in _digests:
        text, inner = str(kind), [*map(_digest, _parts(kind))]
        if isinstance(kind, containers.BaseNamedTuple):
            text += f" {kind.instance_class.__module__}.{kind.instance_class.__qualname__} {kind.fields}"
        known = " at 0x" not in text and None not in inner
        _digests[id(kind)] = kind, hashlib.sha256(repr((text, inner)).encode()).hexdigest()[:32] if known else None
    return _digests[id(kind)][1]


def _parts(kind: Any) -> tuple[Any, ...]:
    """Types inside a type."""
    if isinstance(kind, containers.BaseTuple):
        return tuple(kind.types)
    if isinstance(kind, Record):
        return (kind.whole,)
    called = getattr(kind, "sig", None)  # of a pointer
    return () if called is None else (called.return_type, *called.args)


class _Writer(NumbaPickler):  # type: ignore[misc, unused-ignore]
    """Writes numbers in place of the types of arguments."""

    def __init__(self, file: io.BytesIO, kinds: tuple[Any, ...]) -> None:
        super().__init__(file, protocol=5)
        self._places = {id(kind): place for place, kind in enumerate(kinds)}

    def persistent_id(self, value: Any) -> int | None:
        return self._places.get(id(value))


class _Reader(pickle.Unpickler):
    """Reads what `_Writer` has written."""

    def __init__(self, file: io.BytesIO, kinds: tuple[Any, ...]) -> None:
        super().__init__(file)
        self._kinds = kinds

    def persistent_load(self, place: int) -> Any:
        return self._kinds[place]


@cache
def _add_memory_management() -> None:
    """Let machine code find numba's functions of counted references.

    A compilation also makes those that kernels contain, which takes 20 ms; stored machine code has its own.
    """
    for name, address in _nrt_python.c_helpers.items():
        llvm.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


def _content(kinds: tuple[Any, ...], data: Any) -> bytes:
    """Content of the entry of a compiled function."""
    library, described = data.library, data.fndesc
    described.typemap = described.calltypes = None  # this part is large, and nothing uses it after the compilation
    names = (described.llvm_func_name, described.llvm_cpython_wrapper_name, described.llvm_cfunc_wrapper_name)
    symbols = {name for name in names if library.codegen._engine.is_symbol_defined(name)}
    parts = (
        tuple(map(_digest, kinds)), library.name, library._get_compiled_object(), symbols, described, data.environment,
        data.signature, data.reload_init, tuple(data._find_referenced_environments()),
    )  # fmt: skip
    with io.BytesIO() as file:
        _Writer(file, kinds).dump(parts)
        return file.getvalue()


def _load(file: Path, kinds: tuple[Any, ...], context: Any) -> Any:
    """Compiled function from its entry, or None."""
    try:
        parts = _Reader(io.BytesIO(file.read_bytes()), kinds).load()
        return _rebuilt(parts, kinds, context)
    except FileNotFoundError:
        return None
    except Exception as fault:  # a damaged entry can raise any exception
        _log.debug("cache entry %s is damaged (%r); compiling again", file.name, fault)
        return None


def _rebuilt(parts: tuple[Any, ...], kinds: tuple[Any, ...], context: Any) -> Any:
    of, name, machine_code, symbols, described, environment, signature, reload_init, environments = parts
    if of != tuple(map(_digest, kinds)):
        return None
    for function in reload_init:
        function()
    codegen = context.codegen()
    engine = codegen._engine
    engine._ee.add_object_file(llvm.ObjectFileRef.from_data(machine_code))
    engine.finalize_object()
    engine._defined_symbols |= symbols
    library = StoredLibrary(codegen, name)
    fields = dict.fromkeys(CompileResult._fields) | {
        "target_context": context,
        "typing_context": context.typing_context,
        "library": library,
        "environment": environment,
        "entry_point": context.get_executable(library, described, environment),
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
