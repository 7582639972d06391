"""Pages of keys for `fsm help`, from the models that check cases, and of the measured laws of the library."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import cache, reduce
from operator import or_
from typing import Literal, get_args, get_origin

from fsm.case.loading.crease_data import read_crease_data
from fsm.case.models.case import root
from fsm.case.models.coupling import OWN_COUPLINGS
from fsm.case.models.materials import SplineCrease
from fsm.case.models.study import OptimiseFile, StudyFile
from fsm.case.schema.model import Model
from fsm.case.schema.schema import Place, facts_of, plain, section_of
from fsm.case.schema.units import did_you_mean
from fsm.errors import CaseError
from fsm.library import Entry, entries
from fsm.registry import BUILDERS, CONTACT_LAWS, COUPLINGS, ELEMENT_LAWS, FRICTION_LAWS, GEOMETRIES, POINT_KINDS
from fsm.text.shown_units import shown, shown_range

FILES: dict[str, type[Model]] = {"study": StudyFile, "optimise": OptimiseFile}
"""Models of the files, by the names of their commands, which are also the names of their pages of help."""
_WITH_PARTS = "scene.joints", "scene.springs", "scene.cords", "wing.hinge", "wing.root"
"""Sections whose pages list the keys of their parts."""
_NAMES = {str: "text", bool: "true or false", int: "whole number", float: "number", dict: "section"}


def help_lines(key: str) -> list[str]:
    """Lines of the help page of a key or a section; without a key, the page lists all sections. Sections and parameters of
    extensions that this process has loaded are included.

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
        *lines, hint = _section_lines("", root({}))
        others = [f"{name}  file of fsm {name}" for name in FILES]
        added = (f"{name}  section of an extension" for name in BUILDERS)
        return [*lines[:-1], *added, "", *others, "library  measured laws of creases and hinges", "", hint]
    path = ".".join(part for part in key.strip("[]. ").split(".") if not part.isdigit())
    if path == "library":
        return library_lines()
    pages = _pages()
    if path in pages:
        return _page(path, *pages[path])
    if path in FILES:
        return [f"file of fsm {path}", "", *_section_lines(path, Place(FILES[path], None, {}))]
    if path in BUILDERS:
        return [f"[{path}]", "", *_section_lines(path, dict(_added())[path])]
    found = [known for known in pages if known.rpartition(".")[2] == path or known.endswith(f".{path}")]
    if len(found) == 1:
        return _page(found[0], *pages[found[0]])
    if found:
        width = max(len(known) for known in found)
        return [f"{known:{width}}  {plain(facts_of(*pages[known]).meaning)}" for known in found]
    names = {known.rpartition(".")[2]: None for known in pages} | dict.fromkeys(pages)
    raise CaseError(f'unknown key "{key[:60]}"{did_you_mean(path, names)}; `fsm help` lists the sections', "help")


def _pages() -> dict[str, tuple[Place, str]]:
    """Place of the section and name of each key, by the path of the key without item numbers."""
    added = {path: (section, key) for name, place in _added() for path, section, key in _walk(name, place)}
    return _own_pages() | added


@cache
def _own_pages() -> dict[str, tuple[Place, str]]:
    studies = (each for name, model in FILES.items() for each in _walk(name, Place(model, None, {})))
    return {path: (section, key) for path, section, key in (*_walk("", root({})), *studies)}


def _added() -> Iterator[tuple[str, Place]]:
    """Sections of builders, laws and kinds of elements that extensions add, with their paths."""
    for name, builder in BUILDERS.items():
        yield name, Place(builder.section, None, {})
    laws = (("contact", CONTACT_LAWS), ("friction", FRICTION_LAWS), ("scene.elements", ELEMENT_LAWS))
    kinds = (("scene.point_elements", POINT_KINDS), ("scene.couplings", OWN_COUPLINGS | COUPLINGS))
    for path, known in (*laws, *kinds, ("scene.pairs", GEOMETRIES)):
        models = [law.parameters for law in known.values() if law.parameters is not None]
        if models:
            yield f"{path}.parameters", Place(reduce(or_, models), None, {})


def _walk(path: str, section: Place) -> Iterator[tuple[str, Place, str]]:
    for key in section.keys():  # noqa: SIM118
        inner = section.step(key)
        here = f"{path}.{key}" if path else key
        yield here, section, key
        below = section_of(inner)
        if below is not None and here.count(".") < 4:
            yield from _walk(here, below)


def _page(path: str, section: Place, key: str) -> list[str]:
    place = section.step(key)
    assert place is not None
    facts = facts_of(section, key)
    below = section_of(place) or dict(_added()).get(path)
    head = f"[[{path}]]" if place.is_list_of_sections() else f"[{path}]" if below is not None else path
    rows = (
        ("type", type_text(place)), ("unit", facts.unit), ("default", facts.default), ("range", facts.range),
        ("only with", facts.used), ("meaning", facts.meaning),
    )  # fmt: skip
    lines = [head, *(f"  {name:9} {plain(text)}" for name, text in rows if text)]
    if below is None:
        return lines
    *own, hint = _section_lines(path, below)
    return [*lines, "", *own, *_part_lines(path, below), hint]


def _part_lines(path: str, section: Place) -> list[str]:
    """Keys of the parts of joints, springs, cords and hinges of wings, and the parameters of each kind of coupling."""
    if path == "scene.couplings":
        kinds = (OWN_COUPLINGS | COUPLINGS).items()
        parts = [(f'parameters of kind "{name}"', Place(law.parameters, None, {})) for name, law in kinds if law.parameters]
    elif path in _WITH_PARTS:
        inner = ((key, section_of(section.step(key))) for key in section.keys())  # noqa: SIM118
        parts = [(key, below) for key, below in inner if below is not None]
    else:
        return []
    return [line for title, place in parts for line in (f"{title}:", *_section_lines("", place)[:-2], "")]


def _section_lines(path: str, section: Place) -> list[str]:
    """One line for each key of a section."""
    rows = []
    for key in section.keys():  # noqa: SIM118
        facts = facts_of(section, key)
        kind = facts.unit or ("section" if section_of(section.step(key)) else "")
        rows.append((key, kind, plain(facts.default), plain(facts.full_meaning)))
    widths = [max((len(row[k]) for row in rows), default=0) for k in range(3)]
    lines = ["  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=False)) + f"  {row[3]}" for row in rows]
    hint = f"fsm help {path}.KEY" if path else "fsm help SECTION"
    return [*(line.rstrip() for line in lines), "", f"{hint} shows a key"]


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


def library_lines() -> list[str]:
    """Lines of the page: how a case names an entry, and every entry with all that is known of it."""
    head = "measured laws of creases and hinges for [crease], elements of a scene and springs of joints:"
    return [head, '  crease = { library = "NAME" }', *(line for each in entries().values() for line in _entry_lines(each))]


def _entry_lines(entry: Entry) -> Iterator[str]:
    curve = read_crease_data(entry.file, SplineCrease(law="spline", library=entry.name), path=f"{entry.name}.csv")
    angles = f"{math.degrees(curve.angle[0]):.4g} to {math.degrees(curve.angle[-1]):.4g} deg"
    rows = (
        ("measured", entry.title), ("material", entry.material), ("thickness", length_text(entry.thickness)),
        ("made", entry.made), ("width", length_text(entry.width)), ("opening", f"{angles}, {len(curve.angle)} points"),
        ("moment", shown_range(min(curve.moment), max(curve.moment), "N m")), ("branches", entry.branches),
        ("scatter", entry.scatter), ("relaxation", entry.relaxation), ("assumed", entry.assumed), ("source", entry.source),
        ("licence", entry.licence),
    )  # fmt: skip
    yield ""
    yield entry.name
    yield from (f"  {name:10} {text}" for name, text in rows)


def length_text(length: float | str) -> str:
    """A length (m) of an entry with a suitable unit, or the words in its place."""
    return length if isinstance(length, str) else shown(length, "m")
