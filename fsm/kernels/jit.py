"""Decorator that compiles kernels with numba, and a disk cache whose entries always match the sources.

numba stores a compiled function with a stamp of the file that *defines the function*. Functions of other files that it calls
are compiled into it, but are not part of the stamp. After an edit of such a file, or a new version of the package, numba
runs the old machine code without a warning.

Here each module has a cache folder. Its name is a hash of the sources, the versions of the libraries and the compiler
options. The sources are the module and all modules of the package that it imports, directly or indirectly. A changed byte
gives a new folder to the modules that depend on it, and to no others. Copies of the package with equal sources share their
kernels.

This module adds to ``numba.njit(cache=True)``:

* the folder; other users of numba in the process keep their own folders;
* a process whose sources were edited since its start no longer writes to the cache, because it would store new code under an
  old name;
* a damaged or wrong entry is compiled again. If two processes compile two signatures of one kernel at the same time, numba's
  index can refer to the wrong machine code, which numba would call;
* a folder that another user owns or can write to is refused, because its machine code would be executed;
* a full disk is not an error;
* a counter and a timer of compilations, and a callback at the start of each compilation.

The pure-Python mode (``NUMBA_DISABLE_JIT=1``) is for coverage and debugging. In this mode a division of Python floats by
zero raises an error, while a compiled kernel returns inf or nan as NumPy does.
"""

from __future__ import annotations

import errno
import hashlib
import logging
import os
import re
import shutil
import stat
import sys
import tempfile
import threading
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeVar, overload

import llvmlite
import llvmlite.binding
import numba
import numba.extending
import numpy as np
from numba.core import event, sigutils
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator
from numba.core.types import containers

__all__ = [
    "Pointer", "cache_folder", "cache_misses", "compile_time", "compiled_as", "kernel", "kernel_names", "on_compile",
    "shared",
]  # fmt: skip

OPTIONS: Final[dict[str, Any]] = {"error_model": "numpy", "fastmath": False}
"""Options of every kernel. In NumPy's error model a division by zero gives inf or nan, and loops can be vectorised."""

KEEP_DAYS: Final = 30
"""Age in days, since its last use, at which a folder is removed."""

_NUMBA_SETTINGS: Final = (
    "OPT",
    "CPU_NAME",
    "CPU_FEATURES",
    "ENABLE_AVX",
    "LOOP_VECTORIZE",
    "SLP_VECTORIZE",
    "DISABLE_INTEL_SVML",
    "USING_SVML",
    "BOUNDSCHECK",
    "DEBUGINFO_DEFAULT",
)  # settings (NUMBA_... variables) that change the machine code but not numba's own cache key

_PACKAGE: Final = Path(os.path.abspath(__file__)).parent.parent
_DAY: Final = 86400.0
_STAMP: Final = ".last_used"
_PRIVATE: Final = 0o700
_FOLDER_NAME: Final = re.compile(r"[0-9a-f]{20}(\.old-[0-9a-f]{32})?")

_IMPORT: Final = re.compile(
    rb"^[ \t]*(?:from[ \t]+(PACKAGE[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)|import[ \t]+(PACKAGE[\w.]*))".replace(
        b"PACKAGE", _PACKAGE.name.encode()
    ),
    re.MULTILINE,
)
_RELATIVE_IMPORT: Final = re.compile(rb"^[ \t]*from[ \t]+\.", re.MULTILINE)

_log = logging.getLogger(__name__)
_lock = threading.RLock()
_kernels: dict[int, Any] = {}

F = TypeVar("F", bound=Callable[..., Any])


# -------------------------------------------------------------------------------------------------- decorator


@overload
def kernel(function: F) -> F: ...


@overload
def kernel(*, inline: bool = False) -> Callable[[F], F]: ...


def kernel(function: F | None = None, *, inline: bool = False) -> F | Callable[[F], F]:
    """Compile a pure function on numbers, contiguous arrays and NamedTuples of arrays.

    Use ``@kernel``, or ``@kernel(inline=True)`` for a short function in inner loops of other kernels. The first call with a
    new set of argument types compiles the function, or loads it from the cache.

    Parameters
    ----------
    function : function
        Function at the top level of a module of the package. A function defined elsewhere (a test, a user's law) is
        compiled but not cached, because the hash does not cover its source.
    inline : bool
        Make LLVM inline the function into every caller, for any size. LLVM often does so by itself, so use this only after
        a measurement.

    Returns
    -------
    The compiled function; the function itself when ``NUMBA_DISABLE_JIT`` is set.

    Raises
    ------
    RuntimeError
        A function of the package is defined inside another function, or its module has relative imports, which the hash
        does not follow.
    """
    if function is None:
        return lambda f: _compile_lazily(f, inline)
    return _compile_lazily(function, inline)


def shared(function: F) -> F:
    """Let kernels call a Python function; in Python it stays what it is.

    An algorithm over models of any kind is written once with such functions. A kernel compiles it for models of arrays, and
    Python runs it for all others.
    """
    return function if numba.config.DISABLE_JIT else numba.extending.register_jitable(**OPTIONS)(function)


def compiled_as(asked: Callable[..., Any], kind: type, instead: Callable[..., Any]) -> None:
    """Let kernels call another function than Python does, if its first argument is a NamedTuple of one kind.

    Parameters
    ----------
    asked : function
        Function that kernels call; Python runs the function itself.
    kind : NamedTuple class
    instead : Python function with the same number of arguments
    """

    def choose(model: Any, *arguments: Any) -> Callable[..., Any] | None:
        return instead if getattr(model, "instance_class", None) is kind else None

    if not numba.config.DISABLE_JIT:
        numba.extending.overload(asked, strict=False)(choose)


class Pointer:
    """A compiled kernel that other kernels call by its address, so that they are not compiled together.

    A kernel contains the code of all kernels that it calls, and the compiler optimises it again at each level. A call by
    address takes 50 ns and has none of it.

    Parameters
    ----------
    function : kernel
    arguments : examples of its arguments
    """

    def __init__(self, function: Any, *arguments: Any) -> None:
        kinds = tuple(numba.typeof(argument) for argument in arguments)
        function.compile(kinds)
        self._result = function.overloads[kinds]
        self._numba_type_ = numba.types.FunctionType(self._result.signature)

    def __wrapper_address__(self) -> int:
        """Address of the machine code, for numba."""
        return int(self._result.library.get_pointer_to_function(self._result.fndesc.llvm_cfunc_wrapper_name))

    def signature(self) -> Any:
        """Types of the arguments and of the result, for numba."""
        return self._result.signature


def _compile_lazily(function: F, inline: bool) -> F:
    """Wrap `function` in a numba dispatcher with the cache of this module."""
    if numba.config.DISABLE_JIT:
        return function
    options = OPTIONS | ({"forceinline": True} if inline else {})
    dispatcher: Any = numba.njit(**options)(function)
    if _is_covered(function) and cache_folder() is not None:
        with suppress(RuntimeError, OSError):  # if the folder has disappeared, the kernel is not cached
            dispatcher._cache = _KernelCache(function)
    _kernels[id(dispatcher)] = dispatcher
    return dispatcher


def _is_covered(function: Callable[..., Any]) -> bool:
    """Whether the hash covers the source of `function` and of all functions that it can call."""
    path = _source(function)
    if not path.is_relative_to(_PACKAGE):
        return False
    name = f"kernel {function.__qualname__} in {path.relative_to(_PACKAGE.parent).as_posix()}"
    if function.__closure__ is not None or "<locals>" in function.__qualname__:
        raise RuntimeError(f"{name} is defined inside another function: define it at the top level of the module")
    if _RELATIVE_IMPORT.search(path.read_bytes()):
        raise RuntimeError(f"{name}: the kernel cache does not follow relative imports; import by full names")
    return True


def _source(function: Callable[..., Any]) -> Path:
    """Path of the file that defines `function`."""
    return Path(os.path.abspath(function.__code__.co_filename))


class _Locator(UserProvidedCacheLocator):  # type: ignore[misc, unused-ignore]
    """Location of the cache entries of one function: a folder named by a hash of its sources."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._py_file = str(_source(function))
        self._lineno = function.__code__.co_firstlineno
        parent = cache_folder()
        if parent is None:
            raise FileNotFoundError(errno.ENOENT, "no cache folder")
        self._cache_path = str(parent / _key(_source(function)))

    def get_source_stamp(self) -> str:
        """Return a constant, because the name of the folder already identifies the sources."""
        return ""

    def ensure_cache_path(self) -> None:
        """Create the folder with permissions for this user only."""
        folder = Path(self._cache_path)
        with suppress(FileExistsError):
            folder.mkdir(_PRIVATE)
            (folder / _STAMP).touch()


class _CacheImpl(CompileResultCacheImpl):  # type: ignore[misc, unused-ignore]
    """Serialisation as in numba, at the location of `_Locator` for any settings of numba."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._lineno = function.__code__.co_firstlineno
        self._locator = _Locator(function)
        full_name = f"{_source(function).stem}.{function.__qualname__}"
        self._filename_base = self.get_filename_base(full_name, getattr(sys, "abiflags", ""))


class _KernelCache(FunctionCache):
    """numba's cache of one function; instead of an error, an invalid entry causes a new compilation."""

    _impl_class = _CacheImpl

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._folder = Path(self._cache_path)
        self._file = _source(function)
        if self._folder.exists():
            if (fault := _fault_of(self._folder)) is not None:
                _log.warning("compiled kernels are not used: %s", fault)
                self.disable()
            else:
                _mark_as_used(self._folder)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the stored machine code for the signature `sig`, or None."""
        try:
            stored = super().load_overload(sig, target_context)
        except Exception as fault:  # a damaged pickle can raise anything
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
        if self._folder.name != _key_now(self._file):
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


# ----------------------------------------------------------------------------------------------- cache folder


def _field_names(argument_types: Any) -> tuple[Any, ...]:
    """Field names of all NamedTuples among numba types, including those inside tuples."""
    names: list[Any] = []
    for kind in argument_types:
        if isinstance(kind, containers.BaseNamedTuple):
            names.append(tuple(kind.fields))
        if isinstance(kind, containers.BaseTuple):
            names.append(_field_names(kind))
    return tuple(names)


@cache
def cache_folder() -> Path | None:
    """Return the parent folder of all folders of compiled kernels, and create it in the first call.

    The folder is ``<base>/fsm/kernels``. The base is ``NUMBA_CACHE_DIR`` if it is set, else the user's cache folder
    (``XDG_CACHE_HOME`` or ``~/.cache``; ``~/Library/Caches`` on macOS; ``%LOCALAPPDATA%`` on Windows). Each module with
    kernels has one folder per version of its sources there.

    Returns
    -------
    Path or None
        None with ``NUMBA_DISABLE_JIT``, if no folder can be created, or if other users can write to it. The last two cases
        are logged once as a warning.
    """
    if numba.config.DISABLE_JIT:
        return None
    try:
        if not (_PACKAGE / "__init__.py").is_file():
            raise FileNotFoundError(errno.ENOENT, "no Python sources", str(_PACKAGE))
        folder = _base_folder() / _PACKAGE.name / "kernels"
        if not folder.is_dir():
            missing = [place for place in (folder, *folder.parents) if not place.exists()]
            for place in reversed(missing):
                place.mkdir(_PRIVATE, exist_ok=True)
        if (fault := _fault_of(folder)) is not None:
            raise PermissionError(errno.EPERM, fault)
        tempfile.TemporaryFile(dir=folder).close()
        _remove_unused(folder)
    except OSError as fault:
        reason = fault.strerror if fault.errno == errno.EPERM and fault.filename is None else fault
        _log.warning("compiled kernels cannot be stored (%s); set NUMBA_CACHE_DIR to a writable folder of your own", reason)
        return None
    return folder


def _fault_of(folder: Path) -> str | None:
    """Reason why another user could have written machine code to `folder`, or None.

    The user must own the folder, and others must not have write permission. The user or root must own the folders above it.
    Others may have write permission there only with the sticky bit, which prevents renaming. The user's private group (with
    the name of the user) may write to the folders above.
    """
    if sys.platform == "win32":
        return None
    user, private_group = os.geteuid(), _private_group()
    for place in (folder, *folder.resolve().parents):
        status = place.stat()
        mine = {user} if place == folder else {user, 0}
        if status.st_uid not in mine:
            return f"{place} belongs to user {status.st_uid}, who could put other code there"
        alone = place != folder and status.st_gid == private_group
        others = stat.S_IWOTH if alone else stat.S_IWOTH | stat.S_IWGRP
        if status.st_mode & others and (place == folder or not status.st_mode & stat.S_ISVTX):
            return f"other users can write to {place}: chmod go-w {place}"
    return None


def _private_group() -> int | None:
    """Number of the user's primary group if it has the name of the user, else None."""
    import grp
    import pwd

    with suppress(KeyError):
        user = pwd.getpwuid(os.geteuid())
        if grp.getgrgid(user.pw_gid).gr_name == user.pw_name:
            return user.pw_gid
    return None


def _base_folder() -> Path:
    """Return the cache folder of the user or the platform."""
    if numba.config.CACHE_DIR:
        return Path(os.path.abspath(numba.config.CACHE_DIR))
    if sys.platform == "win32":
        variable, default = "LOCALAPPDATA", ("AppData", "Local")
    elif sys.platform == "darwin":
        variable, default = "XDG_CACHE_HOME", ("Library", "Caches")
    else:
        variable, default = "XDG_CACHE_HOME", (".cache",)
    chosen = os.environ.get(variable, "")
    if os.path.isabs(chosen):  # the XDG specification: a relative path is to be ignored
        return Path(chosen)
    try:
        return Path.home().joinpath(*default)
    except RuntimeError as fault:
        raise FileNotFoundError(errno.ENOENT, "the user has no home folder") from fault


def _text(path: str) -> bytes | None:
    """Content of a file, or None if it does not exist."""
    try:
        with open(path, "rb") as file:
            return file.read()
    except (FileNotFoundError, NotADirectoryError):
        return None


_text_at_import: Final = cache(_text)


@cache
def _key(path: Path) -> str:
    """Hash of everything that the machine code of kernels in `path` depends on, as read at the first call."""
    return _key_now(path, _text_at_import)


def _key_now(path: Path, read: Callable[[str], bytes | None] = _text) -> str:
    """Hash of everything that the machine code of kernels in `path` depends on, as it is on disk now."""
    digest = hashlib.sha256()
    settings = {name: getattr(numba.config, name, None) for name in _NUMBA_SETTINGS}
    versions = (sys.version, numba.__version__, llvmlite.__version__, np.__version__)
    digest.update(repr((versions, _machine(), sorted(OPTIONS.items()), sorted(settings.items()))).encode())
    for source, content in sorted(_imported(str(path), read).items()):
        digest.update(f"\n{Path(source).relative_to(_PACKAGE).as_posix()} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()[:20]


@cache
def _machine() -> tuple[str, str]:
    """Name and features of the processor."""
    return llvmlite.binding.get_host_cpu_name(), llvmlite.binding.get_host_cpu_features().flatten()


def _imported(path: str, read: Callable[[str], bytes | None]) -> dict[str, bytes]:
    """Contents, by path, of the module at `path` and of all modules of the package that it imports."""
    contents: dict[str, bytes] = {}
    waiting = [path]
    while waiting:
        source = waiting.pop()
        if source not in contents and (text := read(source)) is not None:
            contents[source] = text
            waiting.extend(_candidates(text))
    return contents


@cache
def _candidates(text: bytes) -> tuple[str, ...]:
    """Paths in the package that the import statements in `text` may refer to; not all of them exist."""
    stems: set[str] = set()
    for statement in _IMPORT.finditer(text):
        stem = os.path.join(_PACKAGE.parent, *(statement[1] or statement[3]).decode().split("."))
        names = re.findall(r"\w+", (statement[2] or b"").decode())
        stems |= {stem, *(os.path.join(stem, name) for name in names)}
    return tuple(file for stem in stems for file in (f"{stem}.py", os.path.join(stem, "__init__.py")))


def _mark_as_used(folder: Path) -> None:
    """Update the time of last use of `folder`, at most once a day."""
    stamp = folder / _STAMP
    with suppress(OSError):
        if not stamp.exists() or time.time() - stamp.stat().st_mtime > _DAY:
            stamp.touch()


def _remove_unused(parent: Path) -> None:
    """Remove the folders in `parent` that were not used for `KEEP_DAYS`, at most once a day.

    A folder is renamed first, so another process finds either the complete folder or none. Errors are ignored.
    """
    stamp = parent / _STAMP
    if stamp.exists() and time.time() - stamp.stat().st_mtime < _DAY:
        return
    stamp.touch()
    for folder in parent.iterdir():
        if folder.is_symlink() or not _FOLDER_NAME.fullmatch(folder.name):
            continue
        with suppress(OSError):
            used = folder / _STAMP
            last_used = (used if used.exists() else folder).stat().st_mtime
            if time.time() - last_used > KEEP_DAYS * _DAY:
                trash = folder.with_name(f"{folder.name[:20]}.old-{uuid.uuid4().hex}")
                shutil.rmtree(folder.rename(trash), ignore_errors=True)


# ----------------------------------------------------------------------------------------------- compilations


class _Compilations(event.Listener):
    """Counter and timer of the compilations of kernels of this package; numba's compiler lock serialises the events."""

    def __init__(self) -> None:
        self.count = 0
        self.callbacks: list[Callable[[str], None]] = []
        self._seconds = 0.0
        self._depth = 0  # nesting depth: a kernel compiles its callees during its own compilation
        self._started = 0.0

    def on_start(self, happening: Any) -> None:
        """Handle the start of a compilation of any dispatcher in the process."""
        dispatcher = happening.data["dispatcher"]
        if id(dispatcher) not in _kernels:
            return
        for callback in tuple(self.callbacks):
            callback(_name(dispatcher))
        if self._depth == 0:
            self._started = time.perf_counter()
        self._depth += 1
        self.count += 1

    def on_end(self, happening: Any) -> None:
        """Handle the end of a compilation, successful or not, of any dispatcher in the process."""
        if id(happening.data["dispatcher"]) not in _kernels:
            return
        self._depth -= 1
        if self._depth == 0:
            self._seconds += time.perf_counter() - self._started

    def seconds(self) -> float:
        """Time of the finished compilations and of the running one, s."""
        running = time.perf_counter() - self._started if self._depth else 0.0
        return self._seconds + running


_compilations = _Compilations()
event.register("numba:compile", _compilations)


def _name(dispatcher: Any) -> str:
    """Full name of a kernel, such as ``fsm.laws.bushing.effort``."""
    return f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"


def kernel_names() -> tuple[str, ...]:
    """Return the full names of all kernels that this process has imported, compiled or not."""
    return tuple(_name(dispatcher) for dispatcher in _kernels.values())


def compile_time() -> float:
    """Return the time that this process has spent compiling kernels, s.

    Loading from the cache does not count. The compilation of a callee counts once.
    """
    return _compilations.seconds()


def cache_misses() -> int:
    """Return the number of compilations in this process, one for each kernel and set of argument types."""
    return _compilations.count


def on_compile(callback: Callable[[str], None]) -> Callable[[], None]:
    """Register a callback that receives the full name of every kernel whose compilation starts.

    Parameters
    ----------
    callback : function of one string
        Called in the compiling thread, for a caller before its callees. An exception aborts the compilation.

    Returns
    -------
    Function without arguments that removes the callback.
    """
    _compilations.callbacks.append(callback)

    def remove() -> None:
        with suppress(ValueError):
            _compilations.callbacks.remove(callback)

    return remove
