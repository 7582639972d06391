"""Code of functions that kernels link, kept in the cache as LLVM's bitcode.

Without it, each process would compile a function again for each kernel that links it: both processes of a first run, and the
first run of a case of another kind. An entry contains the code of the function and of all functions that it links; it is
valid while the sources of all of them are unchanged.
"""

from __future__ import annotations

import copy
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import llvmlite.binding as llvm
import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.runtime import rtsys

from fsm.kernels.cache_folder import PACKAGE, is_inside, key, key_now, source_of, write

_NUMBA: Final = Path(os.path.abspath(numba.__file__)).parent

_INNER: Final = "_3clocals_3e"
"""Part of the symbols of functions inside others: such functions with equal names may differ."""
_OF_NUMBA: Final = "_ZN5numba"
"""Begin of the symbols of functions of numba."""


class LinkedLibrary(JITCodeLibrary):  # type: ignore[misc, unused-ignore]
    """Code of a function that other libraries link; it has no separate machine code.

    Passes over whole modules run once, in the library of the kernel that Python calls.

    Attributes
    ----------
    sources : set of Path
        Files of the package that the function itself is from, and those of code from the cache.
    covered : bool
        Whether all code of the function itself is from `sources` or from numba.
    """

    sources: set[Path]
    covered: bool

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


def origin(function: Callable[..., Any]) -> tuple[set[Path], bool]:
    """File of a function, if it is from this package, and whether it is from this package or from numba."""
    source = source_of(function)
    if is_inside(source):
        return {source}, True
    return set(), source.is_relative_to(_NUMBA)


def _sources(library: Any) -> set[Path] | None:
    """Files of the package that the code of a library is from; None if it has other code, too."""
    if library is rtsys.library:
        return set()
    if not isinstance(library, LinkedLibrary):
        names = [function.name for function in library._final_module.functions if not function.is_declaration]
        return set() if all(name.startswith(_OF_NUMBA) for name in names) else None
    if not library.covered:
        return None
    found = set(library.sources)
    for below in library._linking_libraries:
        inner = _sources(below)
        if inner is None:
            return None
        found |= inner
    return found


def save(file: Path, source: Path, result: Any) -> None:
    """Keep the code of a compiled function, if its sources are known and unchanged."""
    sources = _sources(result.library)
    if sources is None or result.library.has_dynamic_globals or file.parent.name != key_now(source):
        return
    module = result.library._get_module_for_linking().clone()
    for function in module.functions:
        if _INNER in function.name and not function.is_declaration:
            function.linkage = "internal"
    described = copy.copy(result.fndesc)
    described.typemap = described.calltypes = None
    keys = {str(one.relative_to(PACKAGE)): key(one) for one in sources}
    environments = tuple(result._find_referenced_environments())
    content = (
        keys, result.signature, described, result.library.name, module.as_bitcode(), tuple(result.library._reload_init),
        environments,
    )  # fmt: skip
    try:
        text = pickle.dumps(content)
    except (pickle.PicklingError, AttributeError, TypeError):  # a constant of the function cannot be stored
        return
    write(file, text)


def load(file: Path, kinds: tuple[Any, ...], context: Any) -> Any:
    """Kept code of a function, or None."""
    if not file.exists():
        return None
    try:
        keys, signature, described, name, code, starts, environments = pickle.loads(file.read_bytes())
        if tuple(signature.args) != kinds or any(key(PACKAGE / one) != known for one, known in keys.items()):
            return None
        library = LinkedLibrary(context.codegen(), name)
        library._final_module = llvm.parse_bitcode(code)
    except Exception:  # a damaged entry can raise any exception; the function is compiled again
        return None
    for start in starts:
        start()
    library._reload_init.update(starts)
    library.sources, library.covered, library._finalized = {PACKAGE / one for one in keys}, True, True
    fields = dict.fromkeys(CompileResult._fields) | {
        "library": library, "signature": signature, "fndesc": described, "referenced_envs": environments,
        "objectmode": False, "lifted": (), "reload_init": starts, "typing_context": context.typing_context,
        "target_context": context,
    }  # fmt: skip
    return CompileResult(**fields)
