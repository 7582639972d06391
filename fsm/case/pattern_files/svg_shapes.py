"""Lines of the shapes of an SVG file: straight pieces, and curves as chains of points."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterator
from xml.etree.ElementTree import Element

import numpy as np

_CURVE_PARTS = 8
"""Number of straight lines in place of a curve; an arc has at least as many."""
_ARC_PART = math.pi / 16.0
"""Largest angle of a straight line in place of a part of a circle, rad."""
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_LENGTH = re.compile(rf"({_NUMBER.pattern})\s*(px|in|mm|cm|pt|pc|%|)")
_BLANK = re.compile(r"[\s,]*")
_FUNCTION = re.compile(r"[\s,]*([A-Za-z]+)\s*\(([^()]*)\)")
UNITS = {"": 1.0, "px": 1.0, "in": 96.0, "mm": 96.0 / 25.4, "cm": 960.0 / 25.4, "pt": 96.0 / 72.0, "pc": 16.0}
"""Units of lengths in SVG, in units of the file."""
_COUNTS = {"m": 2, "l": 2, "h": 1, "v": 1, "z": 0, "c": 6, "s": 4, "q": 4, "t": 2, "a": 7}
"""Numbers of each command of a path."""

Points = np.ndarray
Viewport = tuple[float, float] | None
"""Width and height to which percentages refer, in units of the file; None: unknown."""


def pieces(tag: str, element: Element, viewport: Viewport) -> Iterator[Points]:
    """Points (n, 2) of each straight line and of each curve of an element, in its coordinates."""

    def number(name: str) -> float:
        return length(tag, element, name, viewport)

    if tag == "line":
        yield np.array([[number("x1"), number("y1")], [number("x2"), number("y2")]])
    elif tag == "rect":
        yield from _rectangle(element, number)
    elif tag in ("polyline", "polygon"):
        values = numbers(element.get("points") or "", f"a <{tag}>")
        if len(values) % 2:
            raise ValueError(f"has a <{tag}> with {len(values)} coordinates, an odd number; give x and y of each point")
        points = np.array(values).reshape(-1, 2)
        if tag == "polygon" and len(points):
            points = np.vstack([points, points[:1]])
        yield from (points[k : k + 2] for k in range(len(points) - 1))
    elif tag in ("circle", "ellipse"):
        radii = (number("r"),) * 2 if tag == "circle" else (number("rx"), number("ry"))
        if min(radii) > 0.0:
            yield from _rounds(np.array([number("cx"), number("cy")]), radii, 0.0, 2.0 * math.pi)
    elif tag == "path":
        yield from _path(element.get("d") or "")


def length(tag: str, element: Element, name: str, viewport: Viewport, default: str = "0") -> float:
    """Length of an attribute in units of the file.

    Raises
    ------
    ValueError
        It is not a length.
    """
    text = (element.get(name) or default).strip()
    match = _LENGTH.fullmatch(text)
    if match is None or (match[2] == "%" and viewport is None):
        units = ", ".join(unit for unit in UNITS if unit)
        raise ValueError(f"has a <{tag}> whose {name} is {short(text)!r}, not a number, or a number with {units}")
    if match[2] == "%" and viewport is not None:
        width, height = viewport
        whole = math.hypot(width, height) / math.sqrt(2.0) if name == "r" else height if name in _UPRIGHT else width
        return float(match[1]) / 100.0 * whole
    return float(match[1]) * UNITS[match[2]]


_UPRIGHT = ("y", "y1", "y2", "cy", "ry", "height")


def numbers(text: str, what: str) -> list[float]:
    """Numbers of a text, separated by commas or blanks.

    Raises
    ------
    ValueError
        The text contains something else.
    """
    scanner, found = _Scanner(text, what), []
    while not scanner.at_end():
        found.append(scanner.number())
    return found


def short(text: str) -> str:
    """Text for a message, with at most 20 characters of it."""
    return text if len(text) <= 20 else f"{text[:20]}..."


class _Scanner:
    """Reading of numbers from a text, each character once."""

    def __init__(self, text: str, what: str) -> None:
        self.text, self.what, self.place = text, what, 0

    def at_end(self) -> bool:
        """Whether only blanks and commas remain."""
        match = _BLANK.match(self.text, self.place)
        self.place = match.end() if match else self.place
        return self.place >= len(self.text)

    def command(self) -> str | None:
        """Letter of a command at the present place, if there is one."""
        if self.at_end() or not self.text[self.place].isalpha():
            return None
        self.place += 1
        return self.text[self.place - 1]

    def number(self) -> float:
        """Next number."""
        if self.at_end():
            raise ValueError(f"has {self.what} that lacks numbers at its end; complete it")
        match = _NUMBER.match(self.text, self.place)
        if match is None:
            rest = short(self.text[self.place : self.place + 24].split()[0])
            raise ValueError(f"has {self.what} with {rest!r} among its numbers; remove it")
        self.place = match.end()
        return float(match[0])

    def flag(self) -> bool:
        """Next flag of an arc: one digit, 0 or 1."""
        if self.at_end() or self.text[self.place] not in "01":
            raise ValueError(f"has {self.what} with an arc whose flags are not 0 or 1; correct the arc")
        self.place += 1
        return self.text[self.place - 1] == "1"


def _rectangle(element: Element, number: Callable[[str], float]) -> Iterator[Points]:
    x, y, w, h = (number(name) for name in ("x", "y", "width", "height"))
    if not (w > 0.0 and h > 0.0):
        return
    given = [name for name in ("rx", "ry") if (element.get(name) or "auto").strip() != "auto"]
    rx, ry = (number(name if name in given else given[0]) if given else 0.0 for name in ("rx", "ry"))
    rx, ry = min(max(rx, 0.0), w / 2.0), min(max(ry, 0.0), h / 2.0)
    rx, ry = (rx, ry) if rx and ry else (0.0, 0.0)
    sides = [((x + rx, y), (x + w - rx, y)), ((x + w, y + ry), (x + w, y + h - ry)),
             ((x + w - rx, y + h), (x + rx, y + h)), ((x, y + h - ry), (x, y + ry))]  # fmt: skip
    centres = (x + w - rx, y + ry), (x + w - rx, y + h - ry), (x + rx, y + h - ry), (x + rx, y + ry)
    for k, (first, last) in enumerate(sides):
        if first != last:
            yield np.array([first, last])
        if rx:
            begin = 0.5 * math.pi * (k - 1)
            yield from _rounds(np.array(centres[k]), (rx, ry), begin, begin + 0.5 * math.pi)


def _rounds(centre: Points, radii: tuple[float, float], begin: float, end: float) -> Iterator[Points]:
    """Part of an ellipse between two angles, as one chain."""
    count = max(_CURVE_PARTS, math.ceil(abs(end - begin) / _ARC_PART - 1e-9))
    turn = np.linspace(begin, end, count + 1)
    yield centre + np.column_stack([np.cos(turn), np.sin(turn)]) * radii


def _path(text: str) -> Iterator[Points]:
    """Lines and curves of a path."""
    scanner = _Scanner(text, "a path")
    here, start, control = np.zeros(2), np.zeros(2), np.zeros(2)
    previous, command = "", ""
    while not scanner.at_end():
        letter = scanner.command()
        if letter is None and command in ("", "z", "Z"):
            scanner.number()  # an error names what is not a number
            raise ValueError("has a path with numbers before a command; a path begins with M or m")
        if letter is not None:
            if letter.lower() not in _COUNTS:
                raise ValueError(f"has a path with the command {letter!r}, which SVG does not have; correct the path")
            if not command and letter.lower() != "m":
                raise ValueError(f"has a path that begins with {letter!r}; a path begins with M or m")
            command = letter
        elif command in "mM":
            command = "l" if command == "m" else "L"  # further points of a move are lines
        kind, origin = command.lower(), here if command.islower() else np.zeros(2)
        if kind == "a":
            rx, ry, turn = scanner.number(), scanner.number(), scanner.number()
            large, positive = scanner.flag(), scanner.flag()
            last = origin + (scanner.number(), scanner.number())
            yield _arc(here, last, (abs(rx), abs(ry)), math.radians(turn), large, positive)
            here = last
        elif kind == "z":
            if np.any(here != start):
                yield np.array([here, start])
            here = start
        else:
            values = [scanner.number() for _ in range(_COUNTS[kind])]
            before = here
            if kind == "m":
                here = start = origin + values
            elif kind == "h":
                here = np.array([values[0] + origin[0], here[1]])
            elif kind == "v":
                here = np.array([here[0], values[0] + origin[1]])
            elif kind == "l":
                here = origin + values
            if kind in "hvl":
                yield np.array([before, here])
            if kind in "csqt":
                points = [origin + values[k : k + 2] for k in range(0, len(values), 2)]
                if kind in "st":
                    follows = previous != "" and previous in ("cs" if kind == "s" else "qt")
                    points.insert(0, 2.0 * here - control if follows else here)
                control, here = points[-2], points[-1]
                yield _curve([before, *points])
        previous = kind


def _curve(points: list[Points]) -> Points:
    """Points of a Bezier curve."""
    found = []
    for t in np.linspace(0.0, 1.0, _CURVE_PARTS + 1):
        level = points
        while len(level) > 1:
            level = [(1.0 - t) * a + t * b for a, b in itertools.pairwise(level)]
        found.append(level[0])
    return np.array(found)


def _arc(first: Points, last: Points, radii: tuple[float, float], turn: float, large: bool, positive: bool) -> Points:
    """Points of an elliptical arc between two points (SVG 1.1, appendix F.6: from end points to the centre)."""
    rx, ry = radii
    ends = np.array([first, last])
    if not (rx > 0.0 and ry > 0.0 and np.isfinite([rx, ry, turn]).all() and np.isfinite(ends).all()):
        return ends
    c, s = math.cos(turn), math.sin(turn)
    axes = np.array([[c, -s], [s, c]])
    half = axes.T @ (first - last) / (2.0 * np.array([rx, ry]))  # in units of the radii
    size = float(half @ half)
    if size == 0.0:
        return ends
    scale = max(1.0, math.sqrt(size))  # radii that are too small are enlarged
    half, size = half / scale, size / scale**2
    away = math.sqrt(max(0.0, 1.0 / size - 1.0)) * (-1.0 if large == positive else 1.0)
    centre = away * np.array([half[1], -half[0]])
    begin, end = half - centre, -half - centre
    angle = math.atan2(begin[1], begin[0])
    span = math.atan2(end[1], end[0]) - angle
    span += 2.0 * math.pi * ((span < 0.0 and positive) - (span > 0.0 and not positive))
    count = max(_CURVE_PARTS, math.ceil(abs(span) / _ARC_PART - 1e-9))
    steps = angle + np.linspace(0.0, span, count + 1)
    middle = 0.5 * (first + last) + axes @ (centre * (scale * rx, scale * ry))
    points = middle + np.column_stack([np.cos(steps), np.sin(steps)]) * (scale * rx, scale * ry) @ axes.T
    points[0], points[-1] = first, last
    return np.asarray(points)


def transform(text: str) -> np.ndarray:
    """Matrix (3, 3) of an attribute `transform`.

    Raises
    ------
    ValueError
        It has other functions than those of SVG.
    """
    matrix, place = np.eye(3), 0
    while _BLANK.fullmatch(text, place) is None:
        match = _FUNCTION.match(text, place)
        if match is None:
            raise ValueError(
                f"has the transform {short(text[place:].strip())!r}, which is not a list of functions; correct it"
            )
        place = match.end()
        one = _function(match[1], numbers(match[2], "a transform"))
        if one is None:
            shown = f"{match[1]}({match[2]})"
            raise ValueError(f"has the transform {short(shown)!r}, which is not supported; apply it to the coordinates")
        matrix = matrix @ one
    return matrix


def _function(name: str, v: list[float]) -> np.ndarray | None:
    """Matrix of one function of a transform; None if it is not supported."""
    one = np.eye(3)
    if not np.isfinite(v).all():
        return None
    if name == "matrix" and len(v) == 6:
        one[:2] = np.array(v).reshape(3, 2).T
    elif name == "translate" and len(v) in (1, 2):
        one[:2, 2] = v[0], v[1] if len(v) > 1 else 0.0
    elif name == "scale" and len(v) in (1, 2):
        one[0, 0], one[1, 1] = v[0], v[-1]
    elif name in ("skewX", "skewY") and len(v) == 1:
        one[(0, 1) if name == "skewX" else (1, 0)] = math.tan(math.radians(v[0]))
    elif name == "rotate" and len(v) in (1, 3):
        c, s = math.cos(math.radians(v[0])), math.sin(math.radians(v[0]))
        one[:2, :2] = [[c, -s], [s, c]]
        if len(v) == 3:
            centre = np.array(v[1:])
            one[:2, 2] = centre - one[:2, :2] @ centre
    else:
        return None
    return one
