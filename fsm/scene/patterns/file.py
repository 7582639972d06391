"""Crease pattern of a file, written into the section [sheet]."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fsm.errors import Fault
from fsm.input_file import read_failure, read_input_file
from fsm.scene.patterns.fold_file import read_fold
from fsm.scene.patterns.pattern import Pattern
from fsm.scene.patterns.svg_file import read_svg
from fsm.scene.sheet import MOST_FACETS, Sheet

__all__ = ["with_pattern"]

_MOST_TEXT = 16 * 2**20
"""Largest size of a pattern file, bytes."""


def with_pattern(sheet: Sheet, folder: Path) -> tuple[Sheet, list[Fault]]:
    """Sheet with the pattern of its file in place of the file name, or the fault of the file."""
    if sheet.pattern is None:
        return sheet, []
    place = folder / sheet.pattern
    try:
        text = read_input_file(place, _MOST_TEXT).decode("utf-8-sig")
        pattern = _read(sheet, place.suffix.lower(), text)
    except OSError as error:
        return sheet, [Fault("sheet.pattern", f"cannot read {place}: {read_failure(error)}")]
    except UnicodeDecodeError as error:
        return sheet, [Fault("sheet.pattern", f"{place} is not UTF-8 text (byte {error.start}); save it as UTF-8")]
    except ValueError as error:
        return sheet, [Fault("sheet.pattern", f"{place.name}: {error}")]
    if len(pattern.faces) > MOST_FACETS:
        text = f"{place.name} has {len(pattern.faces):,} facets; at most {MOST_FACETS:,} are allowed"
        return sheet, [Fault("sheet.pattern", text)]
    return sheet.model_copy(update=_keys(pattern) | {"pattern": None, "scale": None, "frame": None}), []


def _read(sheet: Sheet, kind: str, text: str) -> Pattern:
    if kind == ".fold":
        return read_fold(text, sheet.scale, sheet.frame)
    if kind != ".svg":
        raise ValueError("is neither a .fold nor an .svg file; give a file of one of these formats")
    if sheet.frame is not None:
        raise ValueError("an SVG file has no frames; remove sheet.frame")
    if sheet.scale is None:
        raise ValueError("an SVG file has no lengths; give sheet.scale, the length of one unit of the file")
    return read_svg(text, sheet.scale)


def _keys(pattern: Pattern) -> dict[str, Any]:
    """Keys of the section [sheet] that describe a pattern."""
    return {
        "vertices": tuple(tuple(row) for row in pattern.vertices.tolist()),
        "edges": tuple((u, v) for u, v in pattern.edges.tolist()),
        "assignment": pattern.assignment,
        "angles": tuple(0.0 if angle != angle else angle for angle in pattern.target.tolist()),
        "faces": pattern.faces,
    }
