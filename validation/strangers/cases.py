"""Kinds of cases, the number of each, and the case with a given number."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass

from validation.strangers.arrays import draw_array
from validation.strangers.drawn import Drawn
from validation.strangers.films import draw_film
from validation.strangers.folded import draw_folded
from validation.strangers.lattices import draw_lattice
from validation.strangers.mechanisms import draw_mechanism
from validation.strangers.packed import draw_packed
from validation.strangers.scenes import draw_scene
from validation.strangers.strips import draw_deployed, draw_released, draw_strip
from validation.stress.dice import Dice

__all__ = ["CHECKED", "KINDS", "Kind", "Row", "draw", "rows"]

CHECKED = 0.1
"""Part of the cases that is checked by a second solver, or a finer mesh; mechanisms are all checked."""


@dataclass(frozen=True)
class Kind:
    """Kind of cases: the function that draws a case, and the number of cases of a complete campaign."""

    draw: Callable[[Dice], Drawn]
    cases: int


KINDS: dict[str, Kind] = {
    "strips": Kind(draw_strip, 400),
    "released": Kind(draw_released, 150),
    "lattices": Kind(draw_lattice, 100),
    "films": Kind(draw_film, 300),
    "deployed": Kind(draw_deployed, 150),
    "arrays": Kind(draw_array, 200),
    "scenes": Kind(draw_scene, 200),
    "sheets": Kind(draw_folded, 200),
    "packed": Kind(draw_packed, 500),
    "mechanisms": Kind(draw_mechanism, 200),
}
FULL = sum(kind.cases for kind in KINDS.values())


@dataclass(frozen=True)
class Row:
    """Case by its kind and number, and whether it is in the sample that is checked."""

    kind: str
    index: int
    checked: bool


def rows(cases: int, kinds: tuple[str, ...], seed: int) -> list[Row]:
    """All rows of a campaign, alternating between the kinds, so that an interrupted campaign has some rows of each.

    `cases` scales the numbers of all kinds equally; a smaller campaign is the beginning of a larger one.
    """
    found = []
    for name in kinds:
        count = max(1, round(KINDS[name].cases * cases / FULL))
        part = 1.0 if name == "mechanisms" else CHECKED
        found += [(index / count, Row(name, index, _dice(name, index, seed, 1).chance(part))) for index in range(count)]
    return [row for _, row in sorted(found, key=lambda item: item[0])]


def draw(kind: str, index: int, seed: int) -> Drawn:
    """Case with a number; it depends on the kind, the number and the seed only."""
    drawn = KINDS[kind].draw(_dice(kind, index, seed, 0))
    return Drawn(json.loads(json.dumps(drawn.tables)), drawn.files)


def _dice(kind: str, index: int, seed: int, purpose: int) -> Dice:
    return Dice(seed, (2 * list(KINDS).index(kind) + purpose) * 1_000_000 + index)
