"""Origin of a results file: versions of fsm and its libraries, and a digest of the source code.

Version of the installed package.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import sys
import time
from functools import cache
from importlib import metadata
from pathlib import Path

import numpy as np


@cache
def fsm_version() -> str:
    """Version of the installed package; ``0+unknown`` for a source tree that is not installed."""
    try:
        return _version("fsm")
    except metadata.PackageNotFoundError:
        return "0+unknown"


def _version(package: str) -> str:
    """Version of an installed package; `metadata.version` would parse its whole description, for 2 ms."""
    found = re.search(r"^Version: *(\S+)", metadata.distribution(package).read_text("METADATA") or "", re.MULTILINE)
    return found[1] if found else metadata.version(package)


@cache
def made_by() -> dict[str, str]:
    """Versions and source digest that determine the bits of a result; cached, must not be modified."""
    return {
        "fsm": fsm_version(),
        "source": _source_digest(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": _version("scipy"),
        "numba": _version("numba"),
    }


def provenance() -> dict[str, str]:
    """Versions, machine, command and time, for a results file."""
    return made_by() | {
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "command": " ".join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        "written": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
    }


def _source_digest() -> str:
    """First 16 digits of the SHA-256 over names and contents of all modules of the package."""
    package = str(Path(__file__).parents[1])
    modules = [
        os.path.join(folder, name)
        for folder, _, names in os.walk(package)
        for name in names
        if name.endswith(".py") and name[:-3].isidentifier()  # no backup files of editors
    ]
    digest = hashlib.sha256()
    for module in sorted(modules):
        with open(module, "rb") as file:
            content = file.read()
        digest.update(f"{module.removeprefix(package).replace(os.sep, '/')} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()[:16]
