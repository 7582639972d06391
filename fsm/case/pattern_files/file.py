"""Crease pattern of a file, written into the section [sheet]."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from fsm.case.models.sheet import MOST_FACETS, Sheet
from fsm.case.pattern_files.fold_file import read_fold
from fsm.case.pattern_files.line_file import LINE_FILES
from fsm.case.pattern_files.pattern import Pattern
from fsm.case.pattern_files.reading import PatternFault, Reading
from fsm.case.pattern_files.svg_file import read_svg
from fsm.errors import Fault
from fsm.io.input_file import read_failure, read_input_file

_MOST_TEXT = 16 * 2**20
"""Largest size of a pattern file, bytes."""
_READ = {"pattern": None, "scale": None, "frame": None, "part": None, "merge": None}
"""Keys of the section [sheet] that a pattern in the section replaces."""
_ENCODINGS = ("iso-8859-1", "iso-8859-15", "latin-1", "us-ascii", "windows-1252", "cp1252", "shift_jis", "euc-jp", "gb2312")
"""Encodings that an XML file may name, beside UTF-8 and UTF-16."""


def with_pattern(sheet: Sheet, folder: Path) -> tuple[Sheet, list[Fault]]:
    """Sheet with the pattern of its file in place of the file name, or the fault of the file."""
    if sheet.pattern is None:
        return sheet, []
    place = folder / sheet.pattern
    try:
        pattern = _read(sheet, place.suffix.lower(), _text(read_input_file(place, _MOST_TEXT)))
    except OSError as error:
        return sheet, [Fault("sheet.pattern", f"cannot read {place}: {read_failure(error)}")]
    except UnicodeDecodeError as error:
        return sheet, [Fault("sheet.pattern", f"{place} is not UTF-8 text (byte {error.start}); save it as UTF-8")]
    except PatternFault as error:
        return sheet, [Fault("sheet.pattern", f"{place.name}: {error}", cause=error)]
    except ValueError as error:
        return sheet, [Fault("sheet.pattern", f"{place.name}: {error}")]
    if len(pattern.faces) > MOST_FACETS:
        text = f"{place.name} has {len(pattern.faces):,} facets; at most {MOST_FACETS:,} are allowed"
        return sheet, [Fault("sheet.pattern", text)]
    return sheet.model_copy(update=_keys(pattern) | _READ), []


def _text(data: bytes) -> str:
    """Text of a file in UTF-8, in UTF-16 with a byte order mark, or in the encoding that an XML file names."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16")
    match = re.match(rb"<\?xml[^>]{0,200}?encoding=[\"']([\w-]{1,20})[\"']", data[:300])
    named = match[1].decode().lower() if match else "utf-8"
    return data.decode(named if named in _ENCODINGS else "utf-8-sig")


def _read(sheet: Sheet, kind: str, text: str) -> Pattern:
    reading = Reading(sheet.merge, sheet.part, sheet.facets in ("bend-lines", "bars"))
    if kind == ".fold":
        return read_fold(text, sheet.scale, sheet.frame, reading)
    if kind != ".svg" and kind not in LINE_FILES:
        raise ValueError("is no .fold, .svg, .cp, .opx or .ori file; give a file of one of these formats")
    name = "an SVG file" if kind == ".svg" else f"a {kind} file"
    if sheet.frame is not None:
        raise ValueError(f"{name} has no frames; remove sheet.frame")
    if sheet.scale is None:
        raise ValueError(f"{name} has no lengths; give sheet.scale, the length of one unit of the file")
    return read_svg(text, sheet.scale, reading) if kind == ".svg" else LINE_FILES[kind](text, sheet.scale, reading)


def _keys(pattern: Pattern) -> dict[str, Any]:
    """Keys of the section [sheet] that describe a pattern."""
    return {
        "vertices": tuple(tuple(row) for row in pattern.vertices.tolist()),
        "edges": tuple((u, v) for u, v in pattern.edges.tolist()),
        "assignment": pattern.assignment,
        "angles": tuple(0.0 if angle != angle else angle for angle in pattern.target.tolist()),
        "faces": pattern.faces,
        "notes": pattern.notes,
    }
