"""Style of the elements of an SVG file: attributes, style sheets with selectors, and `style`, in the order of CSS."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element

PROPERTIES = ("stroke", "stroke-opacity", "stroke-width", "opacity", "display", "visibility", "color")
"""Properties that are read."""
_MOST_TESTS = 2_000_000
"""Largest number of tests of an element against a part of a selector."""
_MOST_RULES = 20_000
_MOST_COMPOUNDS = 50
"""Largest number of elements that one selector names."""
_NAME = r"(?:[\w-]|[^\x00-\x7f]|\\.)+"
_PART = re.compile(
    rf"(?P<combinator>\s*[>+~]\s*|\s+)|(?P<tag>\*|(?:{_NAME}\|)?{_NAME})|#(?P<id>{_NAME})|\.(?P<class>{_NAME})"
    rf"|\[\s*(?P<key>{_NAME})\s*(?:(?P<how>[~|^$*]?)=\s*(?P<value>\"[^\"]*\"|'[^']*'|{_NAME})\s*)?\]|:(?P<pseudo>:?[\w-]+)"
)
_DELIMITER = re.compile(r"[{};]")
_NEVER = ("hover", "active", "focus", "visited", "link", "target", ":before", ":after", "before", "after", ":selection")
"""Pseudo-classes and pseudo-elements that no element of a drawing has."""


def tag_of(element: Element) -> str:
    """Name of an element without its namespace."""
    return element.tag.rsplit("}", 1)[-1] if isinstance(element.tag, str) else ""


class _Compound(NamedTuple):
    """Conditions on one element: tag, identifiers, classes, attributes (key, how, value), pseudo-classes."""

    tag: str
    ids: tuple[str, ...]
    classes: tuple[str, ...]
    attributes: tuple[tuple[str, str, str | None], ...]
    pseudo: tuple[str, ...]


class _Rule(NamedTuple):
    """Compounds from right to left, each with the combinator on its left; specificity; order; properties."""

    compounds: tuple[tuple[_Compound, str], ...]
    specificity: tuple[int, int, int]
    order: int
    properties: tuple[tuple[str, str, bool], ...]


class Styles:
    """Style sheets of a document.

    Parameters
    ----------
    root : Element
        Root of the document.

    Attributes
    ----------
    unread : selectors with properties of lines that are not supported, and other style sheets
    """

    def __init__(self, root: Element) -> None:
        self.root = root
        self.unread: list[str] = []
        self._tests = 0
        self._own: dict[Element, dict[str, str]] = {}
        self._rules: dict[str, list[_Rule]] = {}
        count = 0
        for element in root.iter():
            if tag_of(element) == "style":
                for selectors, properties in self._read("".join(element.itertext())):
                    for selector in selectors.split(","):
                        rule = _rule(selector.strip(), count, properties)
                        count += 1
                        if count > _MOST_RULES:
                            raise ValueError(f"has more than {_MOST_RULES:,} style rules, the limit; remove some")
                        if rule is None:
                            self.unread.append(selector.strip())
                        elif not any(word in _NEVER for compound, _ in rule.compounds for word in compound.pseudo):
                            self._rules.setdefault(_key(rule.compounds[0][0]), []).append(rule)
        self._parents: dict[Element, Element] = {}
        self._places: dict[Element, int] = {}
        if any(len(rule.compounds) > 1 or rule.compounds[0][0].pseudo for rules in self._rules.values() for rule in rules):
            for parent in root.iter():
                for place, child in enumerate(parent):
                    self._parents[child], self._places[child] = parent, place

    def own(self, element: Element) -> dict[str, str]:
        """Properties of an element: its attributes, the rules that match, and its `style`; each replaces the ones before
        it, and important ones replace all others.
        """
        if element not in self._own:
            found = {name: value for name in PROPERTIES if (value := element.get(name)) is not None}
            rules = sorted(self._matching(element), key=lambda rule: (rule.specificity, rule.order))
            inner = declarations((element.get("style") or "").split(";"))
            for important in (False, True):
                for properties in (*(rule.properties for rule in rules), inner):
                    found.update({name: value for name, value, strong in properties if strong == important})
            self._own[element] = found
        return self._own[element]

    def _matching(self, element: Element) -> Iterator[_Rule]:
        if self._rules:
            names = [tag_of(element), f"#{element.get('id')}", "*"]
            names += [f".{name}" for name in dict.fromkeys((element.get("class") or "").split())]
            for name in names:
                yield from (rule for rule in self._rules.get(name, ()) if self._matches(rule, element))

    def _matches(self, rule: _Rule, element: Element) -> bool:
        at = [element]
        for compound, combinator in rule.compounds:
            self._tests += len(at)
            if self._tests > _MOST_TESTS:
                raise ValueError("has style rules that are too many for its elements; give the strokes as attributes")
            at = [one for one in at if self._is(compound, one)]
            if not at:
                return False
            at = self._beside(at, combinator)
        return True

    def _beside(self, elements: list[Element], combinator: str) -> list[Element]:
        """Elements at which the next compound of a selector may match, each once."""
        found: dict[Element, None] = {}
        for element in elements:
            parent = self._parents.get(element)
            if parent is None or not combinator:
                continue
            if combinator in ("+", "~"):
                place = self._places[element]
                found |= dict.fromkeys(parent[max(place - 1, 0) : place] if combinator == "+" else parent[:place])
                continue
            while parent is not None and parent not in found:
                found[parent] = None
                parent = self._parents.get(parent) if combinator == " " else None
        return list(found)

    def _is(self, compound: _Compound, element: Element) -> bool:
        """Whether an element meets the conditions of a compound."""
        if compound.tag not in ("*", tag_of(element)) or any(element.get("id") != name for name in compound.ids):
            return False
        if compound.classes and not set(compound.classes) <= set((element.get("class") or "").split()):
            return False
        if not all(_has(element, *condition) for condition in compound.attributes):
            return False
        for word in compound.pseudo:
            parent = self._parents.get(element)
            place = {"first-child": 0, "last-child": -1 if parent is None else len(parent) - 1}.get(word)
            if (element is not self.root) if word == "root" else (parent is None or self._places[element] != place):
                return False
        return True

    def _read(self, text: str) -> Iterator[tuple[str, tuple[tuple[str, str, bool], ...]]]:
        """Selectors and properties of the rules of a style sheet that have properties of lines."""
        text = _without_comments(text)
        start, open_blocks = 0, list[bool]()
        selectors: str | None = None
        body: list[str] = []
        for match in _DELIMITER.finditer(text):
            piece, start = text[start : match.start()], match.end()
            if match[0] == "{" and selectors is None:
                head = piece.strip()
                if head.startswith("@"):
                    kind = head.split(None, 1)[0].lower()
                    open_blocks.append(kind in ("@supports", "@layer") or (kind == "@media" and "print" not in head))
                else:
                    selectors, body = head, []
            elif match[0] == ";" and selectors is None and piece.strip().startswith("@import"):
                self.unread.append(piece.strip())
            elif selectors is not None:
                body.append(piece)
                if match[0] == "}":
                    found = declarations(body)
                    if found and all(open_blocks):
                        yield selectors, found
                    selectors = None
            elif match[0] == "}" and open_blocks:
                open_blocks.pop()


def declarations(parts: Sequence[str]) -> tuple[tuple[str, str, bool], ...]:
    """Properties that are read, from texts like "stroke: red": name, value, and whether it is important."""
    found = []
    for part in parts:
        name, _, value = part.partition(":")
        name = name.strip().lower()
        if name in PROPERTIES:
            plain, important, _ = value.partition("!")
            found.append((name, plain.strip(), bool(important)))
    return tuple(found)


def _without_comments(text: str) -> str:
    kept, start = [], 0
    while (begin := text.find("/*", start)) >= 0:
        kept.append(text[start:begin])
        end = text.find("*/", begin + 2)
        start = len(text) if end < 0 else end + 2
    return " ".join([*kept, text[start:]]).replace("<!--", " ").replace("-->", " ")


def _rule(text: str, order: int, properties: tuple[tuple[str, str, bool], ...]) -> _Rule | None:
    """Rule of one selector; None if the selector is not supported."""
    compounds: list[tuple[_Compound, str]] = []
    place, combinator, empty = 0, "", _Compound("*", (), (), (), ())
    now = empty
    while place < len(text):
        match = _PART.match(text, place)
        if match is None:
            return None
        place = match.end()
        kind = match.lastgroup
        if match["combinator"] is not None:
            if now is empty or len(compounds) >= _MOST_COMPOUNDS:
                return None
            compounds.append((now, combinator))
            combinator, now = match["combinator"].strip() or " ", empty
        elif match["tag"] is not None:
            if now is not empty:
                return None
            now = _Compound(_plain(match["tag"].rsplit("|", 1)[-1]), (), (), (), ())
        elif kind == "id":
            now = now._replace(ids=(*now.ids, _plain(match["id"])))
        elif kind == "class":
            now = now._replace(classes=(*now.classes, _plain(match["class"])))
        elif kind == "pseudo":
            if match["pseudo"] not in (*_NEVER, "root", "first-child", "last-child"):
                return None
            now = now._replace(pseudo=(*now.pseudo, match["pseudo"]))
        else:
            value = match["value"]
            value = value[1:-1] if value and value[0] in "\"'" else value
            now = now._replace(attributes=(*now.attributes, (match["key"], match["how"] or "", value)))
    if now is empty and not text.endswith("*"):
        return None
    compounds.append((now, combinator))
    every = [compound for compound, _ in compounds]
    specificity = (
        sum(len(c.ids) for c in every),
        sum(len(c.classes) + len(c.attributes) + len(c.pseudo) for c in every),
        sum(c.tag != "*" for c in every),
    )
    return _Rule(tuple(reversed(compounds)), specificity, order, properties)


def _plain(name: str) -> str:
    return re.sub(r"\\(.)", r"\1", name)


def _key(compound: _Compound) -> str:
    """Name under which the rules of a compound are looked up."""
    if compound.ids:
        return f"#{compound.ids[0]}"
    return f".{compound.classes[0]}" if compound.classes else compound.tag


def _has(element: Element, key: str, how: str, value: str | None) -> bool:
    """Whether an attribute of an element has a value."""
    own = next((text for name, text in element.items() if name.rsplit("}", 1)[-1] == key), None)
    if own is None or value is None:
        return own is not None
    tests = {
        "": own == value, "~": value in own.split(), "^": bool(value) and own.startswith(value),
        "$": bool(value) and own.endswith(value), "*": bool(value) and value in own,
        "|": own == value or own.startswith(f"{value}-"),
    }  # fmt: skip
    return tests[how]
