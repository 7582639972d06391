"""Tables of keys in docs/case_file.md and docs/studies.md, from the models of a case and of studies.

A comment `<!-- keys strip -->` in the page stands above the table of the section `[strip]`; `<!-- keys -->` stands for the
top level.
`python docs/_ext/key_tables.py` (`make keys`) writes all tables again. The text between the tables is written by hand.
"""

from __future__ import annotations

import re
from pathlib import Path

from fsm.case.loading.key_help import FILES
from fsm.case.models.case import root
from fsm.case.schema.schema import Place, facts_of, section_of

PAGES = tuple(Path(__file__).parents[1] / name for name in ("case_file.md", "studies.md"))
_TABLE = re.compile(r"^<!-- keys ?([\w.]*) -->\n\n((?:\|.*\n)*)", re.MULTILINE)


def sections(text: str) -> dict[str, Place]:
    """Sections whose tables a page has, by their paths."""
    return {path: _section(path) for path, _ in _TABLE.findall(text)}


def with_tables(text: str) -> str:
    """Text of a page with its tables written again."""
    return _TABLE.sub(lambda found: f"{found[0][: found.start(2) - found.start()]}{_table(_section(found[1]))}", text)


def _section(path: str) -> Place:
    keys = path.split(".") if path else []
    place: Place | None = Place(FILES[keys.pop(0)], None, {}) if keys and keys[0] in FILES else root({})
    for key in keys:
        place = section_of(place.step(key)) if place is not None else None
    if place is None:
        raise ValueError(f"a case has no section {path!r}")
    return place


def _table(section: Place) -> str:
    lines = ["| key | unit | default | range | meaning |", "|---|---|---|---|---|"]
    for key in section.keys():  # noqa: SIM118
        facts = facts_of(section, key)
        cells = (f"`{key}`", facts.kind, facts.default, facts.range, facts.full_meaning)
        lines.append("|".join(["", *(f" {cell} " if cell else " " for cell in cells), ""]))
    return "".join(f"{line}\n" for line in lines)


if __name__ == "__main__":
    for page in PAGES:
        page.write_text(with_tables(page.read_text(encoding="utf-8")), encoding="utf-8")
