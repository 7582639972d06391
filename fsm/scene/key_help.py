"""Pages of keys for `fsm help`: type, unit, default and range from the models that check cases, and the meaning."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import cache
from typing import Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic.fields import FieldInfo

from fsm.errors import CaseError
from fsm.scene.case import root
from fsm.scene.key_meanings import KeyRow, key_row
from fsm.scene.schema import Place, metadata_of, tags
from fsm.scene.units import did_you_mean

__all__ = ["all_keys", "bounds_text", "help_lines", "type_text", "unit_of"]

_NAMES = {str: "text", bool: "true or false", int: "whole number", float: "number", dict: "section"}


def help_lines(key: str) -> list[str]:
    """Lines of the help page of a key or a section; without a key, the page lists all sections.

    Parameters
    ----------
    key : str
        Dotted path such as "strip.fold_angle" or "drive.speed", or the last part of one.

    Raises
    ------
    CaseError
        No key has this path or name.
    """
    if not key:
        return _section_lines("", root({}))
    path = ".".join(part for part in key.strip("[]. ").split(".") if not part.isdigit())
    pages = _pages()
    if path in pages:
        return _page(path, *pages[path])
    found = [known for known in pages if known.rpartition(".")[2] == path or known.endswith(f".{path}")]
    if len(found) == 1:
        return _page(found[0], *pages[found[0]])
    if found:
        width = max(len(known) for known in found)
        return [f"{known:{width}}  {_meaning(*pages[known])}" for known in found]
    names = {known.rpartition(".")[2]: None for known in pages} | dict.fromkeys(pages)
    raise CaseError(f'unknown key "{key[:60]}"{did_you_mean(path, names)}; `fsm help` lists the sections', "help")


def all_keys() -> tuple[str, ...]:
    """Paths of all keys of a case; the paths have no item numbers."""
    return tuple(_pages())


@cache
def _pages() -> dict[str, tuple[Place, str]]:
    """Place of the section and name of each key, by the path of the key without item numbers."""
    return {path: (section, key) for path, section, key in _walk("", root({}))}


def _walk(path: str, section: Place) -> Iterator[tuple[str, Place, str]]:
    for key in section.keys():  # noqa: SIM118
        inner = section.step(key)
        here = f"{path}.{key}" if path else key
        yield here, section, key
        below = _section_of(inner)
        if below is not None and here.count(".") < 4:
            yield from _walk(here, below)


def _section_of(place: Place | None) -> Place | None:
    """Section at a place; for a list or a mapping, the section of its items."""
    for each in (place, place and place.step(0), place and place.step("name")):
        if each is not None and each.all_models():
            return each
    return None


def _page(path: str, section: Place, key: str) -> list[str]:
    place = section.step(key)
    assert place is not None
    row = _row(section, key)
    below = _section_of(place)
    several = place.is_list_of_sections()
    head = f"[[{path}]]" if several else f"[{path}]" if below is not None else path
    facts = [("type", type_text(place)), ("unit", unit_of(place))]
    facts += [("default", _default(section, key)), ("range", _range(place, row))]
    used = _used(section, key)
    facts += [("only with", used), ("meaning", row.meaning if row else "")]
    lines = [head, *(f"  {name:9} {text}" for name, text in facts if text)]
    return lines if below is None else [*lines, "", *_section_lines(path, below)]


def _section_lines(path: str, section: Place) -> list[str]:
    """One line for each key of a section."""
    rows = []
    for key in section.keys():  # noqa: SIM118
        place = section.step(key)
        assert place is not None
        kind = unit_of(place) or ("section" if _section_of(place) else "")
        rows.append((key, kind, _default(section, key), _meaning(section, key)))
    widths = [max((len(row[k]) for row in rows), default=0) for k in range(3)]
    lines = ["  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=False)) + f"  {row[3]}" for row in rows]
    hint = f"fsm help {path}.KEY" if path else "fsm help SECTION"
    return [*(line.rstrip() for line in lines), "", f"{hint} shows a key"]


def _row(section: Place, key: str) -> KeyRow | None:
    return key_row(tuple(section.all_models()), key, _names().get(id(section), ""))


@cache
def _names() -> dict[int, str]:
    """Path of each section, by the identity of its place."""
    return {id(section): path.rpartition(".")[0] for path, (section, _) in _pages().items()}


def _meaning(section: Place, key: str) -> str:
    row = _row(section, key)
    return row.meaning if row else ""


def _fields(section: Place, key: str) -> list[FieldInfo]:
    return [model.model_fields[key] for model in section.all_models() if key in model.model_fields]


def _default(section: Place, key: str) -> str:
    fields = _fields(section, key)
    row = _row(section, key)
    if row is not None and row.default:
        return row.default
    if all(field.is_required() for field in fields):
        return "needed"
    value = fields[0].get_default(call_default_factory=True)
    return "absent" if value is None else json.dumps(value, default=str)


def _used(section: Place, key: str) -> str:
    """Variants of a section that have the key; empty if all variants have it."""
    models, tag = section.all_models(), section.discriminator()
    having = [model for model in models if key in model.model_fields]
    if len(having) == len(models) or not tag:
        return ""
    return f"{tag} = " + " or ".join(f'"{name}"' for model in having for name in tags(model, tag))


def type_text(place: Place) -> str:
    """Type of a value in words."""
    if place.is_list_of_sections():
        return "list of sections"
    if place.all_models():
        return "section"
    texts = []
    for leaf in place.variants():
        if leaf is type(None):
            continue
        if get_origin(leaf) is Literal:
            texts.append("one of " + ", ".join(json.dumps(value) for value in get_args(leaf)))
        elif get_origin(leaf) is tuple:
            inner = get_args(leaf)
            count = "list" if len(inner) == 2 and inner[1] is Ellipsis else f"list of {len(inner)}"
            texts.append(count)
        else:
            name = _NAMES.get(get_origin(leaf) or leaf, "text")
            texts.append("number, or text with a unit" if name == "number" and place.unit() else name)
    return " or ".join(dict.fromkeys(texts))


def unit_of(place: Place) -> str:
    """SI unit of a number, or of the numbers of a list; empty if there is none."""
    inner = place.step(0)
    return place.unit() or (inner.unit() or (inner.step(0) or inner).unit() if inner is not None else "")


def _range(place: Place, row: KeyRow | None) -> str:
    return (row.range if row is not None else "") or bounds_text(place)


def bounds_text(place: Place) -> str:
    """Bounds of a number with its unit."""
    words = {Gt: ("gt", ">"), Ge: ("ge", ">="), Lt: ("lt", "<"), Le: ("le", "<=")}
    found = []
    for item in metadata_of(place.kind):
        if type(item) in words:
            name, sign = words[type(item)]
            limit = float(getattr(item, name))
            unit = f" {place.unit()}" if place.unit() and limit else ""
            angle = f" ({math.degrees(limit):.4g} deg)" if place.unit() == "rad" and limit else ""
            found.append(f"{sign} {limit:.6g}{unit}{angle}")
    return ", ".join(found)
