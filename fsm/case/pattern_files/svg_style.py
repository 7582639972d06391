"""Style of the elements of an SVG file, in the order of CSS, and the letter of the crease pattern that a colour means.

Style sheets are read and matched by tinycss2 and cssselect2.
"""

from __future__ import annotations

import colorsys
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import tinycss2
from cssselect2 import ElementWrapper, Matcher, SelectorError, compile_selector_list
from tinycss2.color4 import Color, parse_color

COLOURS = {
    "#ff0000": "M", "#0000ff": "V", "#000000": "B", "#00ff00": "C", "#ffff00": "J", "#ff00ff": "U",
}  # fmt: skip
"""Letters of the stroke colours of Origami Simulator."""

_HUES = {"M": (-20.0, 20.0), "J": (45.0, 75.0), "C": (80.0, 165.0), "V": (200.0, 262.0), "U": (270.0, 335.0)}
"""Range of hues of each letter, degrees."""
_CHROMA = 0.3
"""Smallest difference of the largest and the smallest component of a colour with a hue; components are from 0 to 1."""
_DARK, _GREY = 0.35, 0.1
"""Largest component of a black, and largest difference of its components."""
_LONGEST_COLOUR = 200
"""Largest number of characters of a colour."""


class Colour(NamedTuple):
    """Colour with components from 0 to 1."""

    red: float
    green: float
    blue: float
    alpha: float

    @property
    def code(self) -> str:
        """Text like "#ff0000", without the alpha component."""
        return "#" + "".join(f"{round(255.0 * x):02x}" for x in self[:3])


def colour_of(text: str) -> Colour | None:
    """Colour of a CSS text: a name, `#rgb`, `#rgba`, `#rrggbb`, `#rrggbbaa`, `rgb()`, `rgba()`, `hsl()`, `hsla()` or
    `hwb()`, with numbers or per cent; None for any other text.

    Examples
    --------
    >>> colour_of("hsl(240 100% 50% / 50%)")
    Colour(red=0.0, green=0.0, blue=1.0, alpha=0.5)
    """
    # a colour of SVG 1.1 may have its equivalent in print
    text = text.strip().lower()[:_LONGEST_COLOUR].partition(" icc-color")[0]
    found = parse_color(text)
    if not isinstance(found, Color) or found.space not in ("srgb", "hsl", "hwb"):
        return None
    red, green, blue = (min(max(component, 0.0), 1.0) for component in found.to("srgb").coordinates)
    return Colour(red, green, blue, found.alpha)


def letter_of(colour: Colour) -> str | None:
    """Letter of the nearest colour of the convention; None if no colour is near.

    A colour counts as red, blue and so on by its hue, if its components differ by at least 0.3 of their range. It counts as
    black if no component is above 0.35 and they differ by at most 0.1.

    Examples
    --------
    >>> letter_of(colour_of("#ed1c24")), letter_of(colour_of("#231f20")), letter_of(colour_of("orange"))
    ('M', 'B', None)
    """
    low, high = min(colour[:3]), max(colour[:3])
    if high <= _DARK and high - low <= _GREY:
        return "B"
    if high - low < _CHROMA:
        return None
    hue = 360.0 * colorsys.rgb_to_hsv(*colour[:3])[0]
    for letter, (first, last) in _HUES.items():
        if first <= hue <= last or first <= hue - 360.0 <= last:
            return letter
    return None


PROPERTIES = ("stroke", "stroke-opacity", "stroke-width", "opacity", "display", "visibility", "color")
"""Properties that are read."""
_MOST_RULES = 20_000
_LONGEST = 1000
"""Largest number of words and signs before the properties of a rule."""
_DEEPEST = 500
"""Largest number of elements around an element to which a style sheet applies."""

Properties = tuple[tuple[str, str, bool], ...]
"""Name, value, and whether it is important."""


def tag_of(element: Element) -> str:
    """Name of an element without its namespace."""
    return element.tag.rsplit("}", 1)[-1] if isinstance(element.tag, str) else ""


class Styles:
    """Style sheets of a document.

    Parameters
    ----------
    root : Element
        Root of the document.

    Attributes
    ----------
    unread : selectors with properties of lines that are not supported, and other style sheets

    Raises
    ------
    ValueError
        There are too many rules, or elements too deep in one another.
    """

    def __init__(self, root: Element) -> None:
        self.unread: list[str] = []
        self._own: dict[Element, dict[str, str]] = {}
        self._matcher, self._wrapped = Matcher(), dict[Element, Any]()
        count, added = 0, False
        for element in root.iter():
            if tag_of(element) == "style":
                for selectors, properties in self._read(tinycss2.parse_stylesheet("".join(element.itertext()))):
                    count += 1
                    if count > _MOST_RULES:
                        raise ValueError(f"has more than {_MOST_RULES:,} style rules, the limit; remove some")
                    added |= self._add(selectors, properties)
        if added:
            self._wrap(root)

    def own(self, element: Element) -> dict[str, str]:
        """Properties of an element: its attributes, the rules that match, and its `style`; each replaces the ones before
        it, and important ones replace all others.
        """
        if element not in self._own:
            found = {name: value for name in PROPERTIES if (value := element.get(name)) is not None}
            matches = self._matcher.match(self._wrapped[element]) if self._wrapped else []
            rules = [payload for _, _, pseudo, payload in matches if pseudo is None]
            inner = _properties(tinycss2.parse_blocks_contents(element.get("style") or ""))
            for important in (False, True):
                for properties in (*rules, inner):
                    found.update({name: value for name, value, strong in properties if strong == important})
            self._own[element] = found
        return self._own[element]

    def _wrap(self, root: Element) -> None:
        """Elements with their parents and places."""
        depth: dict[Any, int] = {None: -1}
        for one in ElementWrapper.from_xml_root(root).iter_subtree():
            depth[one] = depth[one.parent] + 1
            if depth[one] > _DEEPEST:
                raise ValueError(f"has a style sheet and more than {_DEEPEST} elements in one another; give fewer groups")
            self._wrapped[one.etree_element] = one

    def _add(self, selectors: list[Any], properties: Properties) -> bool:
        """Rule for each of its selectors, divided by commas; False if they are not supported."""
        try:
            if len(selectors) > _LONGEST:
                raise SelectorError("too long")
            for selector in compile_selector_list(selectors):
                self._matcher.add_selector(selector, properties)
        except SelectorError:
            self.unread.append(tinycss2.serialize(selectors).strip())
            return False
        return True

    def _read(self, rules: Sequence[Any]) -> Iterator[tuple[list[Any], Properties]]:
        """Selectors and properties of the rules of a style sheet that have properties of lines."""
        for rule in rules:
            if rule.type == "qualified-rule":
                properties = _properties(tinycss2.parse_blocks_contents(rule.content))
                if properties:
                    yield rule.prelude, properties
            elif rule.type == "at-rule" and rule.lower_at_keyword == "import":
                self.unread.append(rule.serialize())
            elif rule.type == "at-rule" and rule.content is not None and _applies(rule):
                yield from self._read(tinycss2.parse_rule_list(rule.content))


def _applies(rule: Any) -> bool:
    """Whether the rules within an at-rule apply on a screen."""
    name = rule.lower_at_keyword
    return name in ("supports", "layer") or (name == "media" and "print" not in tinycss2.serialize(rule.prelude))


def _properties(nodes: Sequence[Any]) -> Properties:
    """Properties that are read, from the declarations of a rule or of an attribute `style`."""
    return tuple(
        (node.lower_name, tinycss2.serialize(node.value).strip(), node.important)
        for node in nodes
        if node.type == "declaration" and node.lower_name in PROPERTIES
    )
