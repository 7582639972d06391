"""Report of `fsm check` on laws of the library: source, what was tested, and whether the thickness is that of the case."""

from __future__ import annotations

from collections.abc import Iterator

from fsm.case.loading.key_help import length_text
from fsm.case.models.case import Case
from fsm.check.view import CheckContext
from fsm.library import Entry, entries
from fsm.text.shown_units import shown


def library_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the measured laws of the case."""
    for entry in _used(view.case):
        sizes = f"thickness {length_text(entry.thickness)}, width {length_text(entry.width)}"
        yield f"{entry.name}: {entry.title}; material {entry.material}, {sizes}; {entry.source}, {entry.licence}"
        yield f"scatter {entry.scatter}; relaxation {entry.relaxation}; assumed: {entry.assumed}"


def library_warnings(view: CheckContext) -> Iterator[str]:
    """Warnings about a thickness that differs from that of the test, or that the source does not state."""
    sheet = view.case.strip or view.case.sheet
    if sheet is not None:
        for entry in _used(view.case):
            yield from _of_thickness(entry, sheet.thickness)


def _of_thickness(entry: Entry, thickness: float) -> Iterator[str]:
    tested, remedy = entry.thickness, "test a crease of this sheet (`fsm calibrate crease`)"
    if isinstance(tested, str):
        yield f"{entry.name}: the thickness of the test is {tested}; here it is {shown(thickness, 'm')}: {remedy}"
    elif abs(tested - thickness) > 1e-3 * tested:
        yield f"{entry.name} was tested at a thickness of {shown(tested, 'm')}; here it is {shown(thickness, 'm')}: {remedy}"


def _used(case: Case) -> list[Entry]:
    """Entries that the creases, elements and joints of a case name, each once."""
    scene = case.scene
    laws = (
        [case.crease]
        if scene is None
        else [case.crease, *(e.crease for e in scene.elements), *(j.spring for j in scene.joints)]
    )
    names = dict.fromkeys(getattr(law, "library", None) for law in laws)
    return [entries()[name] for name in names if name in entries()]  # a copy of a case may name an entry of another version
