"""Decorator that compiles kernels with numba, and a disk cache whose entries always match the sources.

numba stores a compiled function with a stamp of the file that *defines the function*. Functions of other files that it calls
are compiled into it, but are not part of the stamp. After an edit of such a file, or a new version of the package, numba
runs the old machine code without a warning. Here each module has a cache folder named by a hash of all sources
(`fsm.kernels.cache_folder`), and kernels have a special dispatcher (`fsm.kernels.dispatcher`).

The pure-Python mode (``NUMBA_DISABLE_JIT=1``) is for coverage and debugging. In this mode a division of Python floats by
zero raises an error, while a compiled kernel returns inf or nan as NumPy does.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar, overload

import numba
import numba.extending
from numba.core import event

from fsm.kernels.cache_folder import OPTIONS
from fsm.kernels.compile_lock import waited
from fsm.kernels.dispatcher import ImportedKernel

_kernels: dict[int, Any] = {}

F = TypeVar("F", bound=Callable[..., Any])


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
    """Allow kernels to call a Python function, which remains unchanged in Python.

    An algorithm over models of any kind is written once with such functions. A kernel compiles it for compiled models, and
    Python runs it for all others.
    """
    return function if numba.config.DISABLE_JIT else numba.extending.register_jitable(**OPTIONS)(function)


def compiled_as(asked: Callable[..., Any], kind: type, instead: Callable[..., Any]) -> None:
    """Let kernels call another function in place of this one if the first argument is a NamedTuple of one kind.

    Parameters
    ----------
    asked : function
        Function that kernels call; Python runs the function itself.
    kind : NamedTuple class
    instead : Python function with the same number of arguments
    """

    def choose(model: Any, *arguments: Any) -> Callable[..., Any] | None:
        return instead if getattr(model, "instance_class", None) is kind else None

    # symbols have the names of functions: in two libraries from the cache, functions of one name would be taken as one
    instead.__qualname__ = f"{asked.__qualname__}.{kind.__name__}"
    if not numba.config.DISABLE_JIT:
        numba.extending.overload(asked, strict=False)(choose)


def _compile_lazily(function: F, inline: bool) -> F:
    """Wrap `function` in a dispatcher with the cache of this package."""
    if numba.config.DISABLE_JIT:
        return function
    dispatcher: Any = ImportedKernel(function, inline)
    _kernels[id(function)] = dispatcher
    return dispatcher


# ----------------------------------------------------------------------------------------------- compilations


class _Compilations(event.Listener):
    """Counter and timer of the compilations of kernels of this package; numba's compiler lock serialises the events."""

    def __init__(self) -> None:
        self.count = 0
        self.callbacks: list[Callable[[str], None]] = []
        self._seconds = 0.0
        self._depth = 0  # nesting depth; it exceeds one because a kernel compiles its callees during its own compilation
        self._started = 0.0

    def on_start(self, happening: Any) -> None:
        """Handle the start of a compilation of any dispatcher in the process."""
        dispatcher = happening.data["dispatcher"]
        if id(dispatcher.py_func) not in _kernels:
            return
        for callback in tuple(self.callbacks):
            callback(_name(dispatcher))
        if self._depth == 0:
            self._started = time.perf_counter()
        self._depth += 1
        self.count += 1

    def on_end(self, happening: Any) -> None:
        """Handle the end of a compilation, successful or not, of any dispatcher in the process."""
        if id(happening.data["dispatcher"].py_func) not in _kernels:
            return
        self._depth -= 1
        if self._depth == 0:
            self._seconds += time.perf_counter() - self._started

    def seconds(self) -> float:
        """Time of the finished compilations and of the running compilation, s."""
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
    """Return the time that this process has spent compiling kernels or waiting for others that compile them, s.

    Loading from the cache does not count. The compilation of a callee counts once.
    """
    return _compilations.seconds() + waited()


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
