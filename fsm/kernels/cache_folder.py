"""Folders of compiled kernels, named by a hash of their sources.

The folder of a module has the name of a hash of the sources, the versions of the libraries and the compiler options. The
sources are the module and all modules of the package that it imports, directly or indirectly. A changed byte gives a new
folder to the modules that depend on it, and to no others. Copies of the package with equal sources share their kernels.

A folder that another user owns or can write to is refused, because its machine code would be executed.
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
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

import llvmlite
import llvmlite.binding
import numba
import numpy as np

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
)  # these settings (NUMBA_... variables) change the machine code but not numba's own cache key

PACKAGE: Final = Path(os.path.abspath(__file__)).parent.parent
_PREFIX: Final = os.path.join(PACKAGE, "")
_ABOVE: Final = os.path.join(PACKAGE.parent, "")
_NAME: Final = re.compile(r"\w+")
_DAY: Final = 86400.0
_STAMP: Final = ".last_used"
_PRIVATE: Final = 0o700
_FOLDER_NAME: Final = re.compile(r"[0-9a-f]{20}(\.old-[0-9a-f]{32})?")

_IMPORT: Final = re.compile(
    rb"\n[ \t]*(?:from[ \t]+(PACKAGE[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)|import[ \t]+(PACKAGE[\w.]*))".replace(
        b"PACKAGE", PACKAGE.name.encode()
    )
)
"""Import statement; a search for the start of any line, instead of a line break, would take three times as long."""
_RELATIVE_IMPORT: Final = re.compile(rb"\n[ \t]*from[ \t]+\.")

_log = logging.getLogger(__name__)


def is_covered(function: Callable[..., Any]) -> bool:
    """Whether the hash covers the source of `function` and of all functions that it can call."""
    path = source_of(function)
    if not is_inside(path):
        return False
    if function.__closure__ is not None or "<locals>" in function.__qualname__:
        fault = " is defined inside another function: define it at the top level of the module"
    elif _has_relative_imports(path):
        fault = ": the kernel cache does not follow relative imports; import by full names"
    else:
        return True
    raise RuntimeError(f"kernel {function.__qualname__} in {path.relative_to(PACKAGE.parent).as_posix()}{fault}")


@cache
def is_inside(path: Path) -> bool:
    """Whether a file is in the package."""
    return path.is_relative_to(PACKAGE)


@cache
def _has_relative_imports(path: Path) -> bool:
    return _RELATIVE_IMPORT.search(b"\n" + (_text_at_import(str(path)) or b"")) is not None


def source_of(function: Callable[..., Any]) -> Path:
    """Path of the file that defines `function`."""
    return _absolute(function.__code__.co_filename)


@cache
def _absolute(name: str) -> Path:
    return Path(os.path.abspath(name))


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
        if not (PACKAGE / "__init__.py").is_file():
            raise FileNotFoundError(errno.ENOENT, "no Python sources", str(PACKAGE))
        folder = _base_folder() / PACKAGE.name / "kernels"
        if not folder.is_dir():
            missing = [place for place in (folder, *folder.parents) if not place.exists()]
            for place in reversed(missing):
                place.mkdir(_PRIVATE, exist_ok=True)
        if (fault := fault_of(folder)) is not None:
            raise PermissionError(errno.EPERM, fault)
        tempfile.TemporaryFile(dir=folder).close()
        _remove_unused(folder)
    except OSError as fault:
        reason = fault.strerror if fault.errno == errno.EPERM and fault.filename is None else fault
        _log.warning("compiled kernels cannot be stored (%s); set NUMBA_CACHE_DIR to a writable folder of your own", reason)
        return None
    return folder


def fault_of(folder: Path, checked: Path | None = None) -> str | None:
    """Reason why another user could have written machine code to `folder`, or None.

    If the folder above is `checked`, only the folder itself is looked at.

    The user must own the folder, and others must not have write permission. The user or root must own the folders above it.
    Others may have write permission there only with the sticky bit, which prevents renaming. The user's private group (with
    the name of the user) may write to the folders above.
    """
    if sys.platform == "win32":
        return None
    user, private_group = os.geteuid(), _private_group()
    above = () if folder.parent == checked and not folder.is_symlink() else folder.resolve().parents
    for place in (folder, *above):
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
    if os.path.isabs(chosen):  # the XDG specification requires that a relative path is ignored
        return Path(chosen)
    try:
        return Path.home().joinpath(*default)
    except RuntimeError as fault:
        raise FileNotFoundError(errno.ENOENT, "the user has no home folder") from fault


def _text(path: str) -> bytes | None:
    """Content of a file, or None if it does not exist. A file is read again only if it was written in the meantime."""
    try:
        status = os.stat(path)
        written = status.st_mtime_ns, status.st_size, status.st_ino
        if _read.get(path, (None, b""))[0] != written:
            with open(path, "rb") as file:
                _read[path] = written, file.read()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return _read[path][1]


_read: Final[dict[str, tuple[tuple[int, int, int], bytes]]] = {}
"""Time, size and number of each file in its last reading, and its content."""
_text_at_import: Final = cache(_text)


@cache
def key(path: Path) -> str:
    """Hash of everything that the machine code of kernels in `path` depends on, as read at the first call."""
    return key_now(path, _text_at_import)


def key_now(path: Path, read: Callable[[str], bytes | None] = _text) -> str:
    """Hash of everything that the machine code of kernels in `path` depends on, as it is on disk now."""
    digest = hashlib.sha256()
    settings = {name: getattr(numba.config, name, None) for name in _NUMBA_SETTINGS}
    versions = (sys.version, numba.__version__, llvmlite.__version__, np.__version__)
    digest.update(repr((versions, _machine(), sorted(OPTIONS.items()), sorted(settings.items()))).encode())
    for source, content in sorted(_imported(str(path), read).items()):
        digest.update(f"\n{source.removeprefix(_PREFIX).replace(os.sep, '/')} {_digest(content)}".encode())
    return digest.hexdigest()[:20]


@cache
def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


@cache
def _machine() -> tuple[str, str]:
    """Name and features of the processor."""
    return llvmlite.binding.get_host_cpu_name(), llvmlite.binding.get_host_cpu_features().flatten()


def _imported(path: str, read: Callable[[str], bytes | None]) -> dict[str, bytes]:
    """Contents, by path, of the module at `path` and of all modules of the package that it imports."""
    imports = _found_at_import if read is _text_at_import else _candidates
    contents: dict[str, bytes] = {}
    waiting = [path]
    while waiting:
        source = waiting.pop()
        if source not in contents and (text := read(source)) is not None:
            contents[source] = text
            waiting.extend(imports(text))
    return contents


@cache
def _found_at_import(text: bytes) -> tuple[str, ...]:
    """Modules of the package that `text` imports, as read at the first call: most of `_candidates` do not exist."""
    return tuple(file for file in _candidates(text) if _text_at_import(file) is not None)


@cache
def _candidates(text: bytes) -> tuple[str, ...]:
    """Paths in the package that the import statements in `text` may refer to; not all of them exist."""
    stems: set[str] = set()
    for statement in _IMPORT.finditer(b"\n" + text):
        stem = _ABOVE + (statement[1] or statement[3]).decode().replace(".", os.sep)
        names = _NAME.findall((statement[2] or b"").decode())
        stems |= {stem, *(f"{stem}{os.sep}{name}" for name in names)}
    return tuple(file for stem in stems for file in (f"{stem}.py", f"{stem}{os.sep}__init__.py"))


def mark_as_used(folder: Path) -> None:
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


def create_folder(folder: Path) -> None:
    """Create a folder of kernels with permissions for this user only."""
    with suppress(FileExistsError):
        folder.mkdir(_PRIVATE)
        (folder / _STAMP).touch()


def write(file: Path, content: bytes) -> bool:
    """Write a file of the cache as a whole; return whether it was written. A full disk is not an error."""
    place = None
    try:
        create_folder(file.parent)
        with tempfile.NamedTemporaryFile(dir=file.parent, delete=False) as out:
            place = Path(out.name)
            out.write(content)
        place.replace(file)
    except OSError as fault:
        _log.debug("cannot store %s: %s", file.name, fault)
        with suppress(OSError):
            if place is not None:
                place.unlink()
        return False
    return True
