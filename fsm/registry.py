"""Extensions: laws, elements and builders that users add in Python files, and the loading of these files.

A case names its files, ``extensions = ["my_law.py"]``, relative to its own folder. Each file is executed once in a
process. The file registers its additions with the functions of `fsm.extend`.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, Final, NamedTuple

from fsm.errors import Fault
from fsm.io.input_file import read_failure, read_input_file

_MOST_CODE = 2**20
"""Largest size of an extension, bytes."""
_DIGEST = "#sha256:"
_OF_PACKAGE = "fsm.model.contact.geometries"
"""Folder of contact geometries of the package, one file each."""


class AddedLaw(NamedTuple):
    """Law of an extension.

    Attributes
    ----------
    law : `NormalLaw`, `FrictionLaw`, `ElementLaw`, `PointKind`, `Coupling`, or the function that builds the tables of a
        contact geometry
    parameters : pydantic model of its `parameters` in a case, or None
    text : description for `fsm check`
    """

    law: Any
    parameters: Any
    text: str


class AddedBuilder(NamedTuple):
    """Builder of an extension: model of its section, and the function from the section to a scene."""

    section: Any
    build: Any


CONTACT_LAWS: Final[dict[str, AddedLaw]] = {}
FRICTION_LAWS: Final[dict[str, AddedLaw]] = {}
ELEMENT_LAWS: Final[dict[str, AddedLaw]] = {}
POINT_KINDS: Final[dict[str, AddedLaw]] = {}
COUPLINGS: Final[dict[str, AddedLaw]] = {}
GEOMETRIES: Final[dict[str, AddedLaw]] = {}
BUILDERS: Final[dict[str, AddedBuilder]] = {}


def geometries(name: object) -> dict[str, AddedLaw]:
    """Contact geometries that a pair may name. A file of the package with this name is loaded, see `_OF_PACKAGE`."""
    file = str(name).replace("-", "_")
    if isinstance(name, str) and name not in GEOMETRIES and file.isidentifier() and find_spec(f"{_OF_PACKAGE}.{file}"):
        import_module(f"{_OF_PACKAGE}.{file}")
    return GEOMETRIES


def load_extensions(files: Sequence[str], folder: Path) -> tuple[tuple[str, ...], list[Fault]]:
    """Execute extensions that this process has not executed yet.

    Parameters
    ----------
    files : names of Python files
        If a name has a digest (as in a complete case), the content of the file must match it.
    folder : Path
        Folder to which the names are relative.

    Returns
    -------
    tuple of str
        Absolute paths with digests.
    list of Fault
        Faults of files that cannot be read or executed.
    """
    found, faults = [], []
    for index, name in enumerate(files):
        path, _, digest = name.partition(_DIGEST)
        place = (folder / path).resolve()
        where = f"extensions.{index}"
        try:
            content = read_input_file(place, _MOST_CODE)
        except (OSError, ValueError) as error:
            faults.append(Fault(where, f"cannot read {place}: {read_failure(error)}"))
            continue
        now = hashlib.sha256(content).hexdigest()[:16]
        if digest and digest != now:
            faults.append(Fault(where, f"{place} has changed since the case was written; run the case from its own file"))
            continue
        fault = _execute(place, f"fsm_extension_{now}", content)
        if fault:
            faults.append(Fault(where, fault))
        found.append(f"{place}{_DIGEST}{now}")
    return tuple(found), faults


def _execute(path: Path, name: str, content: bytes) -> str:
    """Execute a file once as a module with this name; return the reason of a failure, or an empty text."""
    if name in sys.modules:
        return ""
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        exec(compile(content, str(path), "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        line = _line_of(error, path)
        return f"{path}{line}: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
    return ""


def _line_of(error: BaseException, path: Path) -> str:
    """Line of the file in which an error occurred."""
    if isinstance(error, SyntaxError):
        return f", line {error.lineno}"
    trace, line = error.__traceback__, ""
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(path):
            line = f", line {trace.tb_lineno}"
        trace = trace.tb_next
    return line


