"""The one decorator that compiles, and the cache that can be trusted.

numba keeps a compiled function on disk under a stamp of the file that *holds the function*. What the
function calls from another file is compiled into it but is not part of the stamp: edit the callee, or
install a new version of the package, and the old machine code runs in silence. Here the folder of the cache
is named by a hash of all files that can hold a kernel, of the versions below them and of the options they
are compiled with, so that one changed byte means another folder.

What this module adds to ``numba.njit(cache=True)``:

* the folder, set only while a kernel is decorated, so that other users of numba in the process keep their
  own;
* a process whose sources were edited under it no longer writes to the cache (it would store new code under
  an old name);
* a damaged or foreign entry is compiled again. Two processes that compile two signatures of one kernel at
  the same time can leave numba's index pointing at the other's machine code; numba calls it all the same,
  here it is refused;
* a full disk is no error;
* a count and a clock of compilations, and a hook for saying that one starts.

The pure-Python run (``NUMBA_DISABLE_JIT=1``) is for coverage and debugging. Divisions of Python floats by
zero raise there, where the compiled kernel gives inf or nan as NumPy does.
"""

from __future__ import annotations

import errno
import hashlib
import logging
import os
import re
import shutil
import sys
import tempfile
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeVar, overload

import llvmlite
import llvmlite.binding
import numba
import numpy as np
from numba.core import event, sigutils
from numba.core.caching import FunctionCache

__all__ = ["cache_folder", "cache_misses", "compile_time", "kernel", "kernel_names", "on_compile"]

KERNEL_FOLDERS: Final = ("kernels", "laws", "interactions", "segments", "ancf", "solve")
"""Folders of the package that may hold kernels. Any edit in them is a new cache."""

OPTIONS: Final[dict[str, Any]] = {"error_model": "numpy", "fastmath": False}
"""Options of every kernel. NumPy's error model: a division by zero is inf or nan, and loops vectorise."""

KEEP_DAYS: Final = 30
"""A folder that no process has used for so long is removed."""

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
_FOLDER_NAME: Final = re.compile(r"[0-9a-f]{20}(\.old-[0-9a-f]{32})?")

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

    Use as ``@kernel``, or as ``@kernel(inline=True)`` for a short function in the inner loop of others. The
    first call with a new set of argument types compiles, or loads from the cache.

    Parameters
    ----------
    function : function
        Defined at the top of a module in one of `KERNEL_FOLDERS`. A function defined anywhere else outside
        the package (a test, a user's own law) is compiled as well but not cached, because the hash does not
        cover its source.
    inline : bool
        Have LLVM inline it into every caller, whatever its size. LLVM does so of its own accord where it
        sees a gain, so this is for measured cases.

    Returns
    -------
    The compiled function; the function itself when ``NUMBA_DISABLE_JIT`` is set.

    Raises
    ------
    RuntimeError
        The function is in the package, but in a folder that the hash does not cover or inside another
        function.
    """
    if function is None:
        return lambda f: _compile_lazily(f, inline)
    return _compile_lazily(function, inline)


def _compile_lazily(function: F, inline: bool) -> F:
    """Wrap `function` in a numba dispatcher with the cache of this module."""
    if numba.config.DISABLE_JIT:
        return function
    options = OPTIONS | ({"forceinline": True} if inline else {})
    dispatcher: Any = numba.njit(**options)(function)
    folder = cache_folder() if _is_covered(function) else None
    if folder is not None:
        with _numba_cache_in(folder), suppress(RuntimeError, OSError):  # folder lost since: stays uncached
            dispatcher._cache = _KernelCache(function)
    _kernels[id(dispatcher)] = dispatcher
    return dispatcher


def _is_covered(function: Callable[..., Any]) -> bool:
    """Whether the source of `function`, and of all that it can call, is part of the hash."""
    try:
        place = Path(os.path.abspath(function.__code__.co_filename)).relative_to(_PACKAGE)
    except ValueError:
        return False
    name = f"kernel {function.__qualname__} in {_PACKAGE.name}/{place.as_posix()}"
    if place.parts[0] not in KERNEL_FOLDERS:
        folders = ", ".join(KERNEL_FOLDERS)
        raise RuntimeError(f"{name} is not hashed by the kernel cache: move it to one of {folders}")
    if function.__closure__ is not None or "<locals>" in function.__qualname__:
        raise RuntimeError(f"{name} is made inside another function: define it at the top of the module")
    return True


@contextmanager
def _numba_cache_in(folder: Path) -> Iterator[None]:
    """Let numba look for its cache in `folder` and nowhere else, then give it its settings back."""
    ours = {"CACHE_DIR": str(folder), "CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator"}
    with _lock:
        theirs = {name: getattr(numba.config, name) for name in ours if hasattr(numba.config, name)}
        try:
            for name in theirs:
                setattr(numba.config, name, ours[name])
            yield
        finally:
            for name, value in theirs.items():
                setattr(numba.config, name, value)


class _KernelCache(FunctionCache):
    """numba's cache of one function; an entry that cannot be trusted or kept is compiled, never an error."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the stored machine code for the signature `sig`, or None."""
        try:
            stored = super().load_overload(sig, target_context)
        except Exception as fault:  # a damaged pickle can raise anything
            _log.debug("cache entry of %s is damaged (%r), compiling again", self._name, fault)
            with suppress(OSError):
                self.flush()
            return None
        if stored is not None and tuple(stored.signature.args) != tuple(sigutils.normalize_signature(sig)[0]):
            _log.debug("cache entry of %s is for %s, compiling again", self._name, stored.signature)
            return None
        return stored

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the machine code for the signature `sig` unless the sources have changed since import."""
        folder = cache_folder()
        if folder is None or folder.name != _key():
            return
        try:
            super().save_overload(sig, data)
        except OSError as fault:
            self.disable()
            _log.debug("cannot keep %s: %s", self._name, fault)


# ----------------------------------------------------------------------------------------------- cache folder


@cache
def cache_folder() -> Path | None:
    """Give the folder in which compiled kernels are kept, made on the first call.

    ``<base>/fsm/kernels/<hash>``, with ``NUMBA_CACHE_DIR`` as the base where set, and else the user's cache
    folder (``XDG_CACHE_HOME`` or ``~/.cache``; ``~/Library/Caches`` on macOS; ``%LOCALAPPDATA%`` on
    Windows).

    Returns
    -------
    Path or None
        None when there is nothing to keep (``NUMBA_DISABLE_JIT``) or nowhere to keep it; the latter is
        logged, once, as a warning.
    """
    if numba.config.DISABLE_JIT:
        return None
    try:
        if not any(_sources()):
            raise FileNotFoundError(errno.ENOENT, "no Python sources", str(_PACKAGE))
        folder = _base_folder() / _PACKAGE.name / "kernels" / _key()
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        _mark_as_used(folder)
    except OSError as fault:
        _log.warning("compiled kernels cannot be kept (%s); set NUMBA_CACHE_DIR to a writable folder", fault)
        return None
    return folder


def _base_folder() -> Path:
    """Give the folder that the user or the platform sets aside for caches."""
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


def _sources() -> Iterator[Path]:
    """Give the files that can hold a kernel, in a fixed order, without what editors leave (`.#a.py`)."""
    for folder in KERNEL_FOLDERS:
        yield from sorted(path for path in (_PACKAGE / folder).rglob("*.py") if path.stem.isidentifier())


def _key() -> str:
    """Hash all that the machine code of any kernel depends on, as it is on disk now."""
    digest = hashlib.sha256()
    settings = {name: getattr(numba.config, name, None) for name in _NUMBA_SETTINGS}
    machine = (llvmlite.binding.get_host_cpu_name(), llvmlite.binding.get_host_cpu_features().flatten())
    versions = (sys.version, numba.__version__, llvmlite.__version__, np.__version__)
    digest.update(repr((versions, machine, sorted(OPTIONS.items()), sorted(settings.items()))).encode())
    for path in _sources():
        with suppress(FileNotFoundError):
            content = path.read_bytes()
            digest.update(f"\n{path.relative_to(_PACKAGE).as_posix()} {len(content)}\n".encode())
            digest.update(content)
    return digest.hexdigest()[:20]


def _mark_as_used(folder: Path) -> None:
    """Date `folder`, at most once a day, and on that occasion remove its neighbours that are out of use."""
    stamp = folder / _STAMP
    with suppress(FileNotFoundError):
        if time.time() - stamp.stat().st_mtime < _DAY:
            return
    stamp.touch()
    _remove_unused(folder.parent, keep=folder)


def _remove_unused(parent: Path, keep: Path) -> None:
    """Remove the cache folders in `parent` that are out of use for `KEEP_DAYS`; what resists stays.

    A folder is first renamed, so that a process that comes back to it at that moment finds all of it or
    nothing.
    """
    for folder in parent.iterdir():
        if folder == keep or folder.is_symlink() or not _FOLDER_NAME.fullmatch(folder.name):
            continue
        with suppress(OSError):
            stamp = folder / _STAMP
            last_used = (stamp if stamp.exists() else folder).stat().st_mtime
            if time.time() - last_used > KEEP_DAYS * _DAY:
                trash = folder.with_name(f"{folder.name[:20]}.old-{uuid.uuid4().hex}")
                shutil.rmtree(folder.rename(trash), ignore_errors=True)


# ----------------------------------------------------------------------------------------------- compilations


class _Compilations(event.Listener):
    """Counts and times the compilations of our kernels; numba's compiler lock keeps events in sequence."""

    def __init__(self) -> None:
        self.count = 0
        self.callbacks: list[Callable[[str], None]] = []
        self._seconds = 0.0
        self._depth = 0  # a kernel that calls others compiles them while it is being compiled
        self._started = 0.0

    def on_start(self, happening: Any) -> None:
        """A dispatcher, ours or not, starts to compile."""
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
        """A dispatcher, ours or not, has compiled or failed to."""
        if id(happening.data["dispatcher"]) not in _kernels:
            return
        self._depth -= 1
        if self._depth == 0:
            self._seconds += time.perf_counter() - self._started

    def seconds(self) -> float:
        """Time in finished compilations and in the running one."""
        running = time.perf_counter() - self._started if self._depth else 0.0
        return self._seconds + running


_compilations = _Compilations()
event.register("numba:compile", _compilations)


def _name(dispatcher: Any) -> str:
    """Full name of a kernel, such as ``fsm.laws.bushing.effort``."""
    return f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"


def kernel_names() -> tuple[str, ...]:
    """Give the full names of the kernels that have been imported in this process, compiled or not."""
    return tuple(_name(dispatcher) for dispatcher in _kernels.values())


def compile_time() -> float:
    """Give the seconds that this process has spent compiling kernels.

    Loading from the cache is not compiling. A kernel that is compiled for the sake of another is counted
    once.
    """
    return _compilations.seconds()


def cache_misses() -> int:
    """Give the number of times that this process had to compile a kernel for a set of argument types."""
    return _compilations.count


def on_compile(callback: Callable[[str], None]) -> Callable[[], None]:
    """Have `callback` called with the full name of every kernel that starts to compile.

    Parameters
    ----------
    callback : function of one string
        Called in the thread that compiles, callees after their caller. An exception ends the compilation.

    Returns
    -------
    A function without arguments that ends the calls.
    """
    _compilations.callbacks.append(callback)

    def forget() -> None:
        with suppress(ValueError):
            _compilations.callbacks.remove(callback)

    return forget
