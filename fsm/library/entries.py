"""Entries of the library: a table of `catalogue.toml` and a CSV file of the same name each.

A new entry is a table with all keys of `Entry` and the file NAME.csv, with the header that `crease.data` of a case has. The
numbers are published measurements under a licence that permits copies; the text of the licence is beside the files.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

_FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Entry:
    """A measured law.

    Attributes
    ----------
    name : name in a case file
    title : what was measured
    material, made : of the tested crease, and how it was made
    thickness, width : of the tested crease, m; "not stated" if the source does not give them
    branches : which ways the angle moved, opening and closing
    scatter : of the moments
    relaxation : of the rest angle, or "not measured"
    assumed : what the source does not state
    source, licence : of the numbers
    """

    name: str
    title: str
    material: str
    thickness: float | str
    made: str
    width: float | str
    branches: str
    scatter: str
    relaxation: str
    assumed: str
    source: str
    licence: str

    @property
    def file(self) -> Path:
        """CSV file of moments over the opening."""
        return _FOLDER / f"{self.name}.csv"


@cache
def entries() -> dict[str, Entry]:
    """All entries by their names."""
    tables = tomllib.loads((_FOLDER / "catalogue.toml").read_text(encoding="utf-8"))
    return {name: Entry(name=name, **table) for name, table in tables.items()}
