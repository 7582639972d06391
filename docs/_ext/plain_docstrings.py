"""Docstrings as they are written here: equations are indented, and |x| is an absolute value."""

from __future__ import annotations

from typing import Any

from sphinx.application import Sphinx


def as_written(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """An indented paragraph becomes a literal block; bars elsewhere are bars."""
    result: list[str] = []
    literal = False
    for index, line in enumerate(lines):
        indented = line.startswith("    ")
        after_blank = index > 0 and not lines[index - 1].strip()
        if indented and after_blank and not literal:
            before = next((text for text in reversed(result) if text.strip()), "")
            literal = not before.startswith(" ")
            if literal and not before.endswith("::"):
                result += ["::", ""]
        elif line.strip() and not indented:
            literal = False
        result.append(line if literal else line.replace("|", "\\|"))
    lines[:] = result


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx; before napoleon, which has the priority 500."""
    app.connect("autodoc-process-docstring", as_written, priority=400)
    return {"version": "1", "parallel_read_safe": True}
