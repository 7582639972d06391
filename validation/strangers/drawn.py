"""Generated case: the content of its file, and the other files."""

from __future__ import annotations

from dataclasses import dataclass, field

from fsm.case.loading.toml_text import tables_text
from validation.stress.dice import Tables

__all__ = ["Drawn"]


@dataclass(frozen=True)
class Drawn:
    """Tables of the case file, and texts of the other files by name."""

    tables: Tables
    files: dict[str, str] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """The case file."""
        return tables_text(self.tables)
