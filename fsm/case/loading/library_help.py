"""Page of `fsm help library`: the measured laws of creases and hinges with their ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator

from fsm.case.loading.crease_data import read_crease_data
from fsm.case.models.materials import SplineCrease
from fsm.library import Entry, entries
from fsm.text.shown_units import shown, shown_range


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
