"""Reading and writing of `summary.json`, which carries a checksum and is written in one step."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fsm.errors import CaseError
from fsm.io.atomic_write import atomic_write

SUMMARY = "summary.json"
"""Name of the summary file; a folder that has it holds a solved case."""

_KEY = "checksum"


def write_summary(summary: Mapping[str, Any], path: str | Path) -> None:
    """Write a summary as JSON; the key `checksum` is the SHA-256 of the other keys."""
    with atomic_write(path, to_disk=True) as part:
        part.write_text(json.dumps({**summary, _KEY: _checksum(summary)}, indent=2) + "\n", encoding="utf-8")


def read_summary(path: str | Path) -> dict[str, Any]:
    """Read a summary, without its checksum.

    Raises
    ------
    CaseError
        The file is missing, is not a summary, or was changed after it was written.
    """
    try:
        summary = json.loads(Path(path).read_text(encoding="utf-8"))
        stored = summary.pop(_KEY)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise CaseError(f"is not a summary of a run ({error}); run the case again", str(path)) from None
    if stored != _checksum(summary):
        raise CaseError("is damaged or was edited: its checksum differs; run the case again", str(path))
    return dict(summary)


def _checksum(summary: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(summary, sort_keys=True).encode()).hexdigest()
