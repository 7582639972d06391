"""Crease patterns from files of ORIPA (`.opx`), of Oriedita (`.ori`), and from the lists of lines of both (`.cp`)."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from xml.etree.ElementTree import Element

from fsm.case.pattern_files.lines import Line, counted, unit_targets
from fsm.case.pattern_files.pattern import Pattern
from fsm.case.pattern_files.planar import planar_pattern
from fsm.case.pattern_files.reading import Reading
from fsm.case.pattern_files.svg_file import parsed
from fsm.case.pattern_files.svg_shapes import short

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
