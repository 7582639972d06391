"""Meanings of the keys of a case, read from the tables of docs/case_file.md, which is part of the package."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

from pydantic import BaseModel

__all__ = ["KeyRow", "key_row"]

_HEADING = "| key | unit | default | range | meaning |"
_PLACES = (Path(__file__).with_name("case_file.md"), Path(__file__).parents[2] / "docs" / "case_file.md")
"""The page in an installed package, and in a source tree."""


class KeyRow(NamedTuple):
    """Row of a table of docs/case_file.md, as plain text without Markdown."""

    key: str
    unit: str
    default: str
    range: str
    meaning: str


def key_row(models: tuple[type[BaseModel], ...], key: str, section: str) -> KeyRow | None:
    """Row of a key of a section; None if the page is not installed.

    Parameters
    ----------
    models : models of the section, one of which has the key
    key : str
    section : name of the section in the case, which selects between sections with the same keys
    """
    fields = {name for model in models if key in model.model_fields for name in model.model_fields}
    fitting = [(heading, rows) for heading, rows in _tables() if fields <= rows.keys()]
    if not fitting:
        return None
    smallest = min(len(rows) for _, rows in fitting)
    same = [(heading, rows) for heading, rows in fitting if len(rows) == smallest]
    named = [rows for heading, rows in same if f"{section}]" in heading]
    return (named or [same[0][1]])[0][key]


@cache
def _tables() -> list[tuple[str, dict[str, KeyRow]]]:
    """Headings of all tables of keys, with the rows by key."""
    page = next((path for path in _PLACES if path.is_file()), None)
    heading, found = "", []
    rows: dict[str, KeyRow] | None = None
    for line in [] if page is None else page.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            heading, rows = line, None
        elif line == _HEADING:
            rows = {}
            found.append((heading, rows))
        elif not line.startswith("|"):
            rows = None
        elif rows is not None and not line.startswith("|--"):
            cells = [_plain(cell) for cell in line.strip().strip("|").split("|")]
            rows[cells[0]] = KeyRow(*(cells + [""] * 5)[:5])
    return found


def _plain(text: str) -> str:
    """Plain text of a cell, without backticks and without the targets of links."""
    return re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", text).replace("`", "").strip()
