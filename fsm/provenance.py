"""What made a file: versions, and the source itself, of which one version number may have many."""

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
import scipy

__all__ = ["made_by", "provenance"]


@cache
def made_by() -> dict[str, str]:
    """The code that the bits of a result hang on besides its input; found once, not to be changed."""
    import fsm

    return {
        "fsm": fsm.__version__,
        "source": _source_digest(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "numba": version("numba"),
    }


def provenance() -> dict[str, str]:
    """What made a file, where, by what command, and when."""
    return made_by() | {
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "command": " ".join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        "written": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
    }


def _source_digest() -> str:
    """The first 16 digits of the SHA-256 of all modules of the package, their names and what is in them."""
    package = Path(__file__).parent
    digest = hashlib.sha256()
    for module in sorted(path for path in package.rglob("*.py") if path.stem.isidentifier()):  # not what editors leave
        content = module.read_bytes()
        digest.update(f"{module.relative_to(package).as_posix()} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()[:16]
