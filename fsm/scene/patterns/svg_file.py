"""Crease patterns from SVG files, with the colours and opacities of Origami Simulator.

Red lines (#ff0000) are mountains, blue (#0000ff) valleys, black boundaries, green (#00ff00) cuts, yellow (#ffff00) bend
lines, magenta (#ff00ff) creases without a fold angle. The opacity times 180 degrees is the fold angle.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping
from xml.etree import ElementTree

import numpy as np

from fsm.scene.patterns.pattern import Pattern
from fsm.scene.patterns.planar import Line, planar_pattern, unit_targets

__all__ = ["COLOURS", "read_svg"]

COLOURS = {
    "ff0000": "M", "0000ff": "V", "000000": "B", "00ff00": "C", "ffff00": "J", "ff00ff": "U",
}  # fmt: skip
"""Letters of the stroke colours."""
_NAMED = {"red": "ff0000", "blue": "0000ff", "black": "000000", "lime": "00ff00", "green": "00ff00", "yellow": "ffff00",
          "magenta": "ff00ff", "fuchsia": "ff00ff"}  # fmt: skip
_MOST_LINES = 20_000
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_LENGTH = re.compile(rf"({_NUMBER.pattern})\s*(px|in|mm|cm|pt|pc|)")
_COMMAND = re.compile(r"([a-zA-Z])([^a-zA-Z]*(?:[eE][-+]?\d+[^a-zA-Z]*)*)")
_CURVE_PARTS = 8
"""Number of straight lines in place of a curve."""
_CIRCLE_PARTS = 32
_STYLES = ("stroke", "stroke-opacity", "opacity", "display")
"""Properties that are read from attributes, from `style`, and from style sheets."""
_UNITS = {"": 1.0, "px": 1.0, "in": 96.0, "mm": 96.0 / 25.4, "cm": 960.0 / 25.4, "pt": 96.0 / 72.0, "pc": 16.0}
"""Units of lengths in SVG, in units of the file."""

_UNDRAWN = ("defs", "clipPath", "mask", "symbol", "pattern", "marker", "metadata", "namedview", "style", "title", "desc")
"""Elements without lines of the pattern."""

Points = np.ndarray


def read_svg(text: str, scale: float) -> Pattern:
    """Flat pattern of an SVG file; y points up.

    Parameters
    ----------
    text : content of the file
    scale : length of one unit of the file, m

    Raises
    ------
    ValueError
        The file is not SVG, or the pattern is faulty.
    """
    if "<!ENTITY" in text:
        text = _without_entities(text)
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise ValueError(f"is not an SVG file: {error}") from None
    if not root.tag.endswith("svg"):
        raise ValueError(f"is not an SVG file; its root is <{root.tag}>")
    with np.errstate(over="ignore", invalid="ignore"):  # an error is raised for such coordinates later
        lines = list(itertools.islice(_lines(root, _style_sheet(root)), _MOST_LINES + 1))
    if len(lines) > _MOST_LINES:
        raise ValueError(f"has more than {_MOST_LINES:,} lines, the limit; give fewer lines")
    if not lines:
        colours = ", ".join(f"#{colour}" for colour in COLOURS)
        raise ValueError(
            f"has no lines with the stroke colours of a crease pattern; "
            f"draw lines with these colours: {colours}"
        )
    return planar_pattern(lines, scale)


def _without_entities(text: str) -> str:
    """Text without its document type, and without references to the entities that it defines."""
    text = re.sub(r"<!DOCTYPE[^\[>]*(\[.*?\])?\s*>", "", text, count=1, flags=re.DOTALL)
    return re.sub(r"&(?!(?:amp|lt|gt|quot|apos|#\w+);)[\w.]+;", "", text)


def _tag(element: ElementTree.Element) -> str:
    return element.tag.rsplit("}", 1)[-1] if isinstance(element.tag, str) else ""


def _properties(text: str) -> dict[str, str]:
    """Properties that are read, from a text like "stroke: red; opacity: 0.5"."""
    pairs = (entry.partition(":") for entry in text.split(";"))
    return {name.strip(): value.replace("!important", "").strip() for name, _, value in pairs if name.strip() in _STYLES}


def _style_sheet(root: ElementTree.Element) -> dict[str, dict[str, str]]:
    """Properties by selector (a tag, ".class" or "#id") of all <style> elements."""
    found: dict[str, dict[str, str]] = {}
    for element in root.iter():
        if _tag(element) == "style":
            text = re.sub(r"/\*.*?\*/", "", "".join(element.itertext()), flags=re.DOTALL)
            for selectors, body in re.findall(r"([^{}]+)\{([^{}]*)\}", text):
                for selector in selectors.split(","):
                    found.setdefault(selector.strip(), {}).update(_properties(body))
    return found


def _own_style(element: ElementTree.Element, sheet: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """Properties of an element from its attributes, the style sheet and its `style`; later ones replace earlier
    ones.
    """
    own = {name: value for name in _STYLES if (value := element.get(name)) is not None}
    names = [_tag(element), *(f".{name}" for name in (element.get("class") or "").split()), f"#{element.get('id')}"]
    for name in names if sheet else ():
        own.update(sheet.get(name, {}))
    return own | _properties(element.get("style") or "")


def _lines(root: ElementTree.Element, sheet: Mapping[str, Mapping[str, str]]) -> Iterator[Line]:
    """Lines of an element and of the elements in it."""
    waiting: list[tuple[ElementTree.Element, dict[str, str], np.ndarray]] = [(root, {}, np.eye(3))]
    while waiting:
        element, inherited, matrix = waiting.pop()
        tag = _tag(element)
        own = _own_style(element, sheet)
        if tag in _UNDRAWN or own.get("display") == "none":
            continue
        if tag == "use":
            raise ValueError("has a <use> element, which is not supported; replace it by the lines that it repeats")
        opacity = _fraction(inherited.get("opacity")) * _fraction(own.get("opacity"))
        style = inherited | own | {"opacity": str(opacity)}
        matrix = matrix @ _transform(element.get("transform") or "")
        letter = _letter(style.get("stroke"))
        if letter is not None:
            target = unit_targets(letter, _fraction(style.get("stroke-opacity")) * opacity)
            for chain in _chains(tag, element):
                points = np.column_stack([chain, np.ones(len(chain))]) @ matrix.T
                for first, last in itertools.pairwise(points):
                    yield Line((float(first[0]), -float(first[1])), (float(last[0]), -float(last[1])), letter, target)
        waiting += [(child, style, matrix) for child in reversed(element)]


def _fraction(text: str | None) -> float:
    if text is None:
        return 1.0
    try:
        value = float(text.strip().rstrip("%")) / (100.0 if text.strip().endswith("%") else 1.0)
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise ValueError(f"has the opacity {text!r}, which is not a number; give a number from 0 to 1")
    return min(max(value, 0.0), 1.0)


def _letter(stroke: str | None) -> str | None:
    """Letter of a stroke colour; None for no stroke and for other colours."""
    text = (stroke or "").strip().lower()
    match = re.fullmatch(r"rgb\(\s*(\d+)\s*,\s*(\d+)\s*,\s*(\d+)\s*\)", text)
    if match:
        text = "#" + "".join(f"{min(int(value), 255):02x}" for value in match.groups())
    text = _NAMED.get(text, text.removeprefix("#"))
    if len(text) == 3:
        text = "".join(2 * digit for digit in text)
    return COLOURS.get(text)


def _transform(text: str) -> np.ndarray:
    """Matrix (3, 3) of an attribute `transform`."""
    matrix = np.eye(3)
    for name, arguments in re.findall(r"(\w+)\s*\(([^)]*)\)", text):
        v = _numbers(arguments, "a transform")
        one = np.eye(3)
        if name == "matrix" and len(v) == 6:
            one[:2] = np.array(v).reshape(3, 2).T
        elif name == "translate" and v:
            one[:2, 2] = v[0], v[1] if len(v) > 1 else 0.0
        elif name == "scale" and v:
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
            text = f"{name}({arguments})"
            raise ValueError(f"has the transform {text!r}, which is not supported; apply it to the coordinates")
        matrix = matrix @ one
    return matrix


def _numbers(text: str, what: str) -> list[float]:
    """Numbers of a text, separated by commas or blanks."""
    rest = _NUMBER.sub("", text).replace(",", "").strip()
    if rest:
        raise ValueError(f"has {what} with {_short(rest)!r} among its numbers; remove it")
    return [float(number) for number in _NUMBER.findall(text)]


def _short(text: str) -> str:
    return text if len(text) <= 20 else f"{text[:20]}..."


def _chains(tag: str, element: ElementTree.Element) -> Iterator[Points]:
    """Chains of points (n, 2) of an element."""

    def number(name: str) -> float:
        text = (element.get(name) or "0").strip()
        match = _LENGTH.fullmatch(text)
        if match is None:
            units = ", ".join(unit for unit in _UNITS if unit)
            raise ValueError(f"has a <{tag}> whose {name} is {_short(text)!r}, not a number, or a number with {units}")
        return float(match[1]) * _UNITS[match[2]]

    if tag == "line":
        yield np.array([[number("x1"), number("y1")], [number("x2"), number("y2")]])
    elif tag == "rect":
        x, y, w, h = (number(name) for name in ("x", "y", "width", "height"))
        yield np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h], [x, y]])
    elif tag in ("polyline", "polygon"):
        values = _numbers(element.get("points") or "", f"a <{tag}>")
        if len(values) % 2:
            raise ValueError(f"has a <{tag}> with {len(values)} coordinates, an odd number; give x and y of each point")
        points = np.array(values).reshape(-1, 2)
        if len(points):
            yield np.vstack([points, points[:1]]) if tag == "polygon" else points
    elif tag in ("circle", "ellipse"):
        turn = np.linspace(0.0, 2.0 * math.pi, _CIRCLE_PARTS + 1)
        radii = [number("r")] * 2 if tag == "circle" else [number("rx"), number("ry")]
        centre = np.array([number("cx"), number("cy")])
        yield centre + np.column_stack([np.cos(turn), np.sin(turn)]) * radii
    elif tag == "path":
        yield from _path(element.get("d") or "")


_COUNTS = {"m": 2, "l": 2, "h": 1, "v": 1, "z": 0, "c": 6, "s": 4, "q": 4, "t": 2}


def _path(text: str) -> Iterator[Points]:
    """Chains of the points of a path; curves are divided into straight lines."""
    here, start, control = np.zeros(2), np.zeros(2), np.zeros(2)
    chain: list[np.ndarray] = []
    previous = ""
    for command, arguments in _COMMAND.findall(text):
        kind, relative = command.lower(), command.islower()
        if kind not in _COUNTS:
            raise ValueError(f"has a path with the command {command!r}, which is not supported; use straight lines")
        if not previous and kind != "m":
            raise ValueError(f"has a path that begins with {command!r}; a path begins with M or m")
        values = _numbers(arguments, "a path")
        count = _COUNTS[kind]
        groups = [values[i : i + count] for i in range(0, len(values), count)] if count else [[]]
        for k, group in enumerate(groups):
            if len(group) < count:
                raise ValueError(f"has a path whose command {command!r} lacks numbers")
            origin = here if relative else np.zeros(2)
            if kind == "m" and k == 0:
                if len(chain) > 1:
                    yield np.array(chain)
                here = origin + group
                start, chain = here, [here]
                continue
            if kind == "z":
                here = start
                chain.append(here)
            elif kind == "h":
                here = np.array([group[0] + origin[0], here[1]])
                chain.append(here)
            elif kind == "v":
                here = np.array([here[0], group[0] + origin[1]])
                chain.append(here)
            elif kind in "ml":
                here = origin + group
                chain.append(here)
            else:
                points = [origin + group[i : i + 2] for i in range(0, count, 2)]
                if kind in "st":
                    follows = previous != "" and previous in ("cs" if kind == "s" else "qt")
                    smooth = 2.0 * here - control if follows else here
                    points.insert(0, smooth)
                control = points[-2]
                chain += _curve([here, *points])
                here = points[-1]
            previous = kind
        previous = kind
    if len(chain) > 1:
        yield np.array(chain)


def _curve(points: list[np.ndarray]) -> list[np.ndarray]:
    """Points of a Bezier curve, without its first one."""
    found = []
    for t in np.linspace(0.0, 1.0, _CURVE_PARTS + 1)[1:]:
        level = points
        while len(level) > 1:
            level = [(1.0 - t) * a + t * b for a, b in itertools.pairwise(level)]
        found.append(level[0])
    return found
