"""Crease patterns of files, written into the section [sheet]: FOLD, SVG, and lists of lines.

Lists of lines are files of ORIPA (`.opx`), of Oriedita (`.ori`), and of both (`.cp`).
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from fsm.case.models.sheet import MOST_FACETS, Sheet
from fsm.case.pattern_files.fold_file import read_fold
from fsm.case.pattern_files.pattern import Line, Pattern, PatternFault, Reading, counted, unit_targets
from fsm.case.pattern_files.planar import planar_pattern
from fsm.case.pattern_files.svg_file import parsed, read_svg
from fsm.case.pattern_files.svg_shapes import short
from fsm.errors import Fault
from fsm.io.input_file import read_failure, read_input_file

_MOST_LINES = 20_000
_NUMBERED = {1: "B", 2: "M", 3: "V"}
"""Letters of the kinds of lines of ORIPA; all others are auxiliary lines."""
_COLOURED = {"BLACK_0": "B", "RED_1": "M", "BLUE_2": "V"}
"""Letters of the colours of Oriedita; all others are auxiliary lines."""

Row = tuple[str, float, float, float, float]


def _pattern(rows: Iterator[Row], scale: float, reading: Reading | None) -> Pattern:
    lines = []
    for letter, x0, y0, x1, y1 in rows:
        lines.append(Line((x0, y0), (x1, y1), letter, unit_targets(letter)))
        if len(lines) > _MOST_LINES:
            raise ValueError(f"has more than {_MOST_LINES:,} lines, the limit; give fewer lines")
    count = sum(line.letter == "F" for line in lines)
    text = f"{counted(count, 'auxiliary line is a flat crease', 'auxiliary lines are flat creases')}"
    return planar_pattern(lines, scale, reading=reading, notes=[text] if count else [])


def _cp(text: str) -> Iterator[Row]:
    """Lines of a text with one line of the pattern in each row: its kind, x and y of its first end, and of its last end."""
    for number, row in enumerate(text.splitlines(), 1):
        words = row.replace(",", " ").split()
        if not words:
            continue
        try:
            kind, (x0, y0, x1, y1) = int(words[0]), (float(word) for word in words[1:])
        except ValueError:
            form = "a kind (1 boundary, 2 mountain, 3 valley, others auxiliary) and the coordinates x y x y"
            raise ValueError(f"has line {number} with {short(row.strip())!r}; a line has {form}") from None
        yield _NUMBERED.get(kind, "F"), x0, y0, x1, y1


def _opx(text: str) -> Iterator[Row]:
    """Lines of an XML file of ORIPA; a property that is not given is 0."""
    root = parsed(text, "a file of ORIPA")
    for element in root.iter("object"):
        if (element.get("class") or "").endswith("OriLineProxy"):
            found = {own.get("property") or "": _number(own) for own in element.findall("void")}
            values = (found.get(name, 0.0) for name in ("x0", "y0", "x1", "y1"))
            x0, y0, x1, y1 = values
            yield _NUMBERED.get(int(found.get("type", 0.0)), "F"), x0, y0, x1, y1


def _number(element: Element) -> float:
    text = "".join(element.itertext()).strip()
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"has a line with {short(text)!r}, which is not a number; correct it") from None


def _ori(text: str) -> Iterator[Row]:
    """Lines of a JSON file of Oriedita."""
    try:
        data = json.loads(text)
        rows = data["lineSegments"]
        for row in rows:
            (x0, y0), (x1, y1) = ([float(x) for x in row[end].split(",")] for end in ("a", "b"))
            yield _COLOURED.get(row.get("color", ""), "F"), x0, y0, x1, y1
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise ValueError('is not a file of Oriedita with a list "lineSegments"; export it as .fold or .cp') from None


def _reader(rows: Callable[[str], Iterator[Row]]) -> Callable[[str, float, Reading | None], Pattern]:
    return lambda text, scale, reading: _pattern(rows(text), scale, reading)


LINE_FILES = {".cp": _reader(_cp), ".opx": _reader(_opx), ".ori": _reader(_ori)}
"""Readers by the suffix of the file: text, length of one unit (m), and choices of the section [sheet]."""


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
