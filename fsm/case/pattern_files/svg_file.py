"""Crease patterns from SVG files, with the colours and opacities of Origami Simulator.

Red lines are mountains, blue valleys, black boundaries, green cuts, yellow bend lines, magenta creases without a fold angle.
The opacity times 180 degrees is the fold angle. Near colours count as the colour of their hue (`svg_colour`).
"""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np

from fsm.case.pattern_files.pattern import ASSIGNMENTS, Line, Pattern, Reading, unit_targets
from fsm.case.pattern_files.planar import planar_pattern
from fsm.case.pattern_files.svg_shapes import Viewport, length, numbers, pieces, short, transform
from fsm.case.pattern_files.svg_style import COLOURS, Styles, colour_of, letter_of, tag_of

_MOST_LINES = 20_000
_MOST_ELEMENTS = 100_000
"""Largest number of elements, with those that <use> repeats, and of lines that are not part of the pattern."""
_MOST_TEXT = 2**25
"""Largest number of characters after the replacement of entities."""
_DEEPEST = 32
"""Largest number of <use> elements in one another."""
_UNDRAWN = (
    "defs", "clipPath", "mask", "symbol", "pattern", "marker", "metadata", "namedview", "style", "title", "desc",
    "foreignObject", "filter", "linearGradient", "radialGradient", "script",
)  # fmt: skip
"""Elements without lines of the pattern."""
_LISTED = 12
"""Largest number of ignored colours in messages."""


def read_svg(text: str, scale: float, reading: Reading | None = None) -> Pattern:
    """Flat pattern of an SVG file; y points up.

    Parameters
    ----------
    text : content of the file
    scale : length of one unit of the file, m
    reading : choices of the section [sheet]

    Raises
    ------
    ValueError
        The file is not SVG, or the pattern is faulty.
    """
    root = parsed(text, "an SVG file")
    if tag_of(root) != "svg":
        raise ValueError(f"is not an SVG file; its root is <{short(tag_of(root))}>")
    drawing = _Drawing(root)
    with np.errstate(over="ignore", invalid="ignore"):  # an error is raised for such coordinates later
        lines = list(itertools.islice(drawing.lines(), _MOST_LINES + 1))
    if len(lines) > _MOST_LINES:
        raise ValueError(f"has more than {_MOST_LINES:,} lines, the limit; give fewer lines")
    if not lines:
        ignored = "".join(f"; {note}" for note in drawing.notes())
        raise ValueError(
            f"has no lines with the stroke colours of a crease pattern; "
            f"draw lines with these colours: {', '.join(COLOURS)}{ignored}"
        )
    return planar_pattern(lines, scale, reading=reading, notes=drawing.notes())


def parsed(text: str, what: str) -> ElementTree.Element:
    """Root of an XML text.

    Raises
    ------
    ValueError
        It is not XML, or has too many elements.
    """
    plain = _without_entities(text)
    parser: ElementTree.XMLPullParser[Any] = ElementTree.XMLPullParser(["start"])
    root: ElementTree.Element | None = None
    count = 0
    try:
        for start in range(0, len(plain), 65536):
            parser.feed(plain[start : start + 65536])
            started: list[Any] = [*parser.read_events()]  # pairs of "start" and the element
            root = started[0][1] if started and root is None else root
            count += len(started)
            if count > _MOST_ELEMENTS:
                raise ValueError(f"has more than {_MOST_ELEMENTS:,} elements, the limit; give a simpler drawing")
        parser.close()
    except ElementTree.ParseError as error:
        raise ValueError(f"is not {what}: {error}") from None
    if root is None:
        raise ValueError(f"is not {what}: it has no element")
    return root


def _without_entities(text: str) -> str:
    """Text with the values of its own entities in their places, and without its document type."""
    begin = text.find("<!DOCTYPE")
    if begin < 0:
        return text
    end, inner = text.find(">", begin), text.find("[", begin)
    subset = ""
    if 0 <= inner < end:
        close = text.find("]", inner)
        end, subset = text.find(">", close), text[inner + 1 : close]
        if close < 0 or end < 0:
            raise ValueError("is not an SVG file: its document type has no end")
    values = {match[1]: match[3] for match in re.finditer(r"<!ENTITY\s+([\w.-]+)\s+(\"|')([^\"'<>]*)\2\s*>", subset)}
    parts = (text[:begin] + text[end + 1 :]).split("&")
    whole, size = [parts[0]], len(text)
    for part in parts[1:]:
        name, semicolon, rest = part[:80].partition(";")
        if semicolon and name in values and "&" not in values[name]:
            part = values[name] + rest + part[80:]
            size += len(values[name])
        else:
            part = f"&{part}"
        if size > _MOST_TEXT:
            raise ValueError(f"has entities whose text exceeds {_MOST_TEXT / 2**20:g} MB; write it without entities")
        whole.append(part)
    return "".join(whole)


class _Style:
    """Inherited properties of an element; `opacity` is the product over all groups around it."""

    __slots__ = ("opacity", "values")

    def __init__(self, values: dict[str, str], opacity: float) -> None:
        self.values, self.opacity = values, opacity

    def inner(self, own: dict[str, str]) -> _Style:
        """Properties of an element in this one."""
        values = self.values | {name: value for name, value in own.items() if value.lower() != "inherit"}
        return _Style(values, self.opacity * _fraction(own.get("opacity")))


class _Drawing:
    """Lines of a document, and what is not read of it."""

    def __init__(self, root: ElementTree.Element) -> None:
        self.root, self.styles = root, Styles(root)
        self.by_id = {element.get("id"): element for element in reversed(list(root.iter())) if element.get("id")}
        self.space = root.tag.rpartition("}")[0]
        self.read: Counter[tuple[str, str]] = Counter()
        self.ignored: Counter[str] = Counter()
        self.hidden, self.elements = 0, 0
        self.unused: list[str] = []

    def notes(self) -> list[str]:
        """Notes on lines that are ignored, and on colours that are not those of the convention."""
        found = []
        if self.ignored:
            listed = self.ignored.most_common(_LISTED)
            kinds = ", ".join(f"{count} in {colour}" for colour, count in listed)
            more = f", and {len(self.ignored) - len(listed)} more colours" if len(self.ignored) > len(listed) else ""
            count = sum(self.ignored.values())
            lines = "1 line is" if count == 1 else f"{count:,} lines are"
            found.append(f"{lines} ignored, because the colour is not one of a crease pattern: {kinds}{more}")
        for (colour, letter), count in self.read.items():
            lines = "1 line" if count == 1 else f"{count:,} lines"
            exact = next(code for code, own in COLOURS.items() if own == letter)
            found.append(f"{lines} in {colour}: read as {ASSIGNMENTS[letter]}, whose colour is {exact}")
        if self.hidden:
            lines = "1 line that is" if self.hidden == 1 else f"{self.hidden:,} lines that are"
            found.append(f"{lines} not shown (display, visibility, opacity or stroke-width) ignored")
        unread = list(dict.fromkeys(self.styles.unread))
        if unread:
            named = ", ".join(f'"{short(text)}"' for text in unread[:3]) + (" ..." if len(unread) > 3 else "")
            found.append(f"style rules that are not read: {named}")
        if self.unused:
            found.append(f"<use> elements without their element in this file: {', '.join(self.unused[:3])}")
        return found

    def lines(self) -> Iterator[Line]:
        """Lines of the pattern."""
        viewport = _viewport(self.root)
        first = (self.root, _Style({}, 1.0), np.eye(3), 0, True)
        waiting: list[tuple[ElementTree.Element, _Style, np.ndarray, int, bool]] = [first]
        while waiting:
            element, outer, matrix, depth, shown = waiting.pop()
            self.elements += 1
            if self.elements > _MOST_ELEMENTS:
                raise ValueError(f"has more than {_MOST_ELEMENTS:,} elements with those of <use>; draw them once")
            tag = tag_of(element)
            foreign = "}" in str(element.tag) and element.tag.rpartition("}")[0] != self.space
            if foreign or (tag in _UNDRAWN and not (tag == "symbol" and depth)):
                continue
            own = self.styles.own(element)
            style = outer.inner(own)
            shown = shown and own.get("display", "").lower() != "none"
            matrix = matrix @ transform(element.get("transform") or "")
            if tag == "use":
                inner = self._used(element, depth, viewport)
                if inner is not None:
                    waiting.append((inner[0], style, matrix @ inner[1], depth + 1, shown))
                continue
            if tag in ("svg", "symbol") and element is not self.root:
                matrix = matrix @ _view(element, viewport)
            yield from self._own_lines(tag, element, style, matrix, viewport, shown)
            children = [child for child in element if isinstance(child.tag, str)]
            if tag == "switch":
                children = [child for child in children if tag_of(child) != "foreignObject"][:1]
            waiting += [(child, style, matrix, depth, shown) for child in reversed(children)]

    def _own_lines(
        self, tag: str, element: ElementTree.Element, style: _Style, matrix: np.ndarray, viewport: Viewport, shown: bool
    ) -> Iterator[Line]:
        """Lines of the pattern in one shape; other lines are counted."""
        stroke = style.values.get("stroke", "none").strip()
        if stroke.lower() == "currentcolor":
            stroke = style.values.get("color", "black").strip()
        if not stroke or stroke.lower() == "none":
            return
        colour = colour_of(stroke)
        opacity = _fraction(style.values.get("stroke-opacity")) * style.opacity * (1.0 if colour is None else colour.alpha)
        shown = shown and opacity > 0.0 and style.values.get("visibility", "visible").lower() == "visible"
        shown = shown and _width(style.values.get("stroke-width")) > 0.0
        letter = letter_of(colour) if colour is not None else None
        if letter is None or colour is None or not shown:
            self._count(stroke if colour is None else colour.code, shown, pieces(tag, element, viewport))
            return
        for chain in pieces(tag, element, viewport):
            if colour.code not in COLOURS:
                self.read[colour.code, letter] += 1
            target = unit_targets(letter, opacity)
            points = np.column_stack([chain, np.ones(len(chain))]) @ matrix.T
            for first, last in itertools.pairwise(points):
                yield Line((float(first[0]), -float(first[1])), (float(last[0]), -float(last[1])), letter, target)

    def _count(self, colour: str, shown: bool, chains: Iterator[np.ndarray]) -> None:
        """Count the lines of a shape that is not part of the pattern."""
        count = 0
        try:
            for _ in chains:
                count += 1
                self.elements += 1
                if self.elements > _MOST_ELEMENTS:
                    break
        except ValueError:
            count += 1  # a fault of a shape that is not read
        if self.elements > _MOST_ELEMENTS:
            raise ValueError(f"has more than {_MOST_ELEMENTS:,} elements and lines; give the crease pattern alone")
        if shown and count:
            self.ignored[short(colour)] += count
        elif count:
            self.hidden += count

    def _used(
        self, element: ElementTree.Element, depth: int, viewport: Viewport
    ) -> tuple[ElementTree.Element, np.ndarray] | None:
        """Element that a <use> repeats, and its displacement."""
        name = next((value for key, value in element.items() if key.rsplit("}", 1)[-1] == "href"), "").strip()
        found = self.by_id.get(name[1:]) if name.startswith("#") else None
        if found is None:
            self.unused.append(f'"{short(name)}"')
            return None
        if depth >= _DEEPEST:
            raise ValueError(f"has more than {_DEEPEST} <use> elements in one another, or a <use> that repeats itself")
        move = np.eye(3)
        move[:2, 2] = [length("use", element, axis, viewport) for axis in ("x", "y")]
        return found, move


def _viewport(root: ElementTree.Element) -> Viewport:
    """Width and height of the drawing, in units of the file."""
    try:
        box = numbers(root.get("viewBox") or "", "a viewBox")
        if len(box) == 4:
            return box[2], box[3]
        return length("svg", root, "width", None, "%"), length("svg", root, "height", None, "%")
    except ValueError:
        return None


def _view(element: ElementTree.Element, viewport: Viewport) -> np.ndarray:
    """Matrix of the place and of the viewBox of an inner <svg>, or of a <symbol>; proportions are kept."""
    matrix = np.eye(3)
    tag = tag_of(element)
    move = np.array([length(tag, element, name, viewport) for name in ("x", "y")])
    box = numbers(element.get("viewBox") or "", "a viewBox")
    if len(box) == 4 and element.get("width") and element.get("height") and min(box[2:]) > 0.0:
        sides = np.array([length(tag, element, name, viewport) for name in ("width", "height")])
        factor = float(np.min(sides / box[2:]))
        matrix[0, 0] = matrix[1, 1] = factor
        move = move + 0.5 * (sides - factor * np.array(box[2:])) - factor * np.array(box[:2])
    matrix[:2, 2] = move
    return matrix


def _width(text: str | None) -> float:
    """Width of a stroke, for the question whether it is zero."""
    match = re.match(r"\s*(\d*\.?\d*(?:e-?\d+)?)", text or "1", re.IGNORECASE)
    try:
        return float(match[1]) if match and match[1] else 1.0
    except ValueError:
        return 1.0


def _fraction(text: str | None) -> float:
    if text is None or text.strip().lower() == "inherit":
        return 1.0
    try:
        value = float(text.strip().rstrip("%")) / (100.0 if text.strip().endswith("%") else 1.0)
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise ValueError(f"has the opacity {short(text)!r}, which is not a number; give a number from 0 to 1")
    return min(max(value, 0.0), 1.0)
