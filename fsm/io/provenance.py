"""Origin of a results file: versions of fsm and its libraries, and a digest of the source code."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
import time
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

from fsm.io.version import fsm_version


@cache
def made_by() -> dict[str, str]:
    """Versions and source digest that determine the bits of a result; cached, must not be modified."""
    return {
        "fsm": fsm_version(),
        "source": _source_digest(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": version("scipy"),
        "numba": version("numba"),
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
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    # identifiers only: no backup files of editors
    for module in sorted(path for path in package.rglob("*.py") if path.stem.isidentifier()):
        content = module.read_bytes()
        digest.update(f"{module.relative_to(package).as_posix()} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()[:16]
