"""Version of the installed package."""

from __future__ import annotations

from functools import cache
from importlib import metadata


@cache
def fsm_version() -> str:
    """Version of the installed package; ``0+unknown`` for a source tree that is not installed."""
    try:
        return metadata.version("fsm")
    except metadata.PackageNotFoundError:
        return "0+unknown"
